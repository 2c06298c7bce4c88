//! How the cue moves at an instant: central differences over poses 20 ms before and after, never the curve's own
//! derivatives, which jump where a curve is only C1.

use std::time::Duration;

use super::Curve;
use crate::motion::{AxisState, MAX_AXES, Window};
use crate::time::ShowTime;

const APART: Duration = Duration::from_millis(20);

/// The state of each moving slot of a window, following the cue at `at`, in strokes.
pub(super) fn following(window: &Window, cue: &Curve<'_>, at: ShowTime) -> Vec<AxisState> {
    let states = following_by_slot(window, cue, at);
    window.moving().map(|(slot, _)| states[slot]).collect()
}

/// The same for every slot, in frame order. Never allocates.
///
/// Within 20 ms of the cue's end, after which it stands still, the differences look back instead.
pub(super) fn following_by_slot(window: &Window, cue: &Curve<'_>, at: ShowTime) -> [AxisState; MAX_AXES] {
    if at <= cue.end && at + APART > cue.end {
        return leaving(window, cue, at);
    }
    let [before, now, after] = [at - APART, at, at + APART].map(|at| window.place(&(cue.pose)(at)));
    let h = APART.as_secs_f64();
    std::array::from_fn(|slot| AxisState {
        position: now[slot],
        velocity: (after[slot] - before[slot]) / (2.0 * h),
        acceleration: (after[slot] - 2.0 * now[slot] + before[slot]) / (h * h),
    })
}

/// The same at the cue's very end, from the poses before it alone: of the cubic through four of them, since a parabola is off
/// by a third of the jerk times the square of their distance, 8 mm/s at the limit of the bench seat. Those are nearer to each
/// other, for what the jerk itself changes meanwhile.
fn leaving(window: &Window, cue: &Curve<'_>, at: ShowTime) -> [AxisState; MAX_AXES] {
    let apart = APART / 2;
    let [now, one, two, three] = [0, 1, 2, 3].map(|back| window.place(&(cue.pose)(at - back * apart)));
    let h = apart.as_secs_f64();
    std::array::from_fn(|slot| AxisState {
        position: now[slot],
        velocity: (11.0 * now[slot] - 18.0 * one[slot] + 9.0 * two[slot] - 2.0 * three[slot]) / (6.0 * h),
        acceleration: (2.0 * now[slot] - 5.0 * one[slot] + 4.0 * two[slot] - three[slot]) / (h * h),
    })
}
