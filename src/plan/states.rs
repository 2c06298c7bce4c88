//! How the cue moves at an instant: central differences over poses 20 ms before and after, never the curve's own
//! derivatives, which jump where a curve is only C1.

use std::time::Duration;

use super::{AxisState, Curve};
use crate::motion::Window;
use crate::time::ShowTime;

const APART: Duration = Duration::from_millis(20);

/// The state of each moving slot of a window, following the cue at `at`, in strokes.
///
/// Within 20 ms of the cue's end, after which it stands still, the differences look back instead.
pub(super) fn following(window: &Window, cue: &Curve<'_>, at: ShowTime) -> Vec<AxisState> {
    if at <= cue.end && at + APART > cue.end {
        return leaving(window, cue, at);
    }
    let [before, now, after] = [at - APART, at, at + APART].map(|at| window.place(&(cue.pose)(at)));
    let h = APART.as_secs_f64();
    window
        .moving()
        .map(|(slot, _)| AxisState {
            position: now[slot],
            velocity: (after[slot] - before[slot]) / (2.0 * h),
            acceleration: (after[slot] - 2.0 * now[slot] + before[slot]) / (h * h),
        })
        .collect()
}

/// The same at the cue's very end, from the poses before it alone.
pub(super) fn leaving(window: &Window, cue: &Curve<'_>, at: ShowTime) -> Vec<AxisState> {
    let [now, before, earlier] = [at, at - APART, at - 2 * APART].map(|at| window.place(&(cue.pose)(at)));
    let h = APART.as_secs_f64();
    window
        .moving()
        .map(|(slot, _)| AxisState {
            position: now[slot],
            velocity: (3.0 * now[slot] - 4.0 * before[slot] + earlier[slot]) / (2.0 * h),
            acceleration: (now[slot] - 2.0 * before[slot] + earlier[slot]) / (h * h),
        })
        .collect()
}
