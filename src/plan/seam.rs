//! How rough the seam between two movements is, by the measure of what is sent.
//!
//! A plan keeps the limits by itself, and so does a good cue; but the states at which they meet are differences over 40 ms,
//! not derivatives, and what is off between the two shows as jerk.

use super::Plan;
use crate::motion::{Measure, Pose, Spacing, Window};
use crate::time::ShowTime;

/// What the measure allows over the limits.
pub(super) const SLACK: f64 = 1.001;

/// Where a lane's slots are at show times before a move, as fractions of the stroke.
pub(super) type Before<'a, 'b> = &'a mut (dyn FnMut(ShowTime) -> Pose + 'b);

/// Where the frames fall against a seam is not known beforehand: so many phases of the grid are looked at.
const PHASES: i64 = 4;

/// Of plans that the measure sees a seam of, the least rough.
#[derive(Default)]
pub(super) struct LeastRough(Option<(f64, Plan)>);

impl LeastRough {
    /// Gives a plan back whose seam the measure does not see; else keeps it, if it is less rough than those before.
    pub(super) fn smooth_or_keep(&mut self, plan: Plan, roughness: f64) -> Option<Plan> {
        if roughness <= SLACK {
            return Some(plan);
        }
        if self.0.as_ref().is_none_or(|(least, _)| roughness < *least) {
            self.0 = Some((roughness, plan));
        }
        None
    }

    /// True if there is none.
    pub(super) const fn is_none(&self) -> bool {
        self.0.is_none()
    }

    /// That plan; `None` if there is none.
    pub(super) fn into_plan(self) -> Option<Plan> {
        self.0.map(|(_, plan)| plan)
    }
}

/// The worst of velocity, acceleration and jerk around an instant: 1 is just within the limits. A move that meets a fast cue
/// while it slows down was faster before.
pub(super) fn roughness_around(
    window: &Window,
    middle: ShowTime,
    rate_hz: f64,
    mut pose: impl FnMut(ShowTime) -> Pose,
) -> f64 {
    let spacing = Spacing::at_rate(rate_hz);
    let reach = i64::try_from(3 * spacing.m + 1).expect("at most 82");
    let period = ShowTime::from_secs_f64(1.0 / rate_hz).as_nanos();
    let mut worst = 0.0_f64;
    for phase in 0..PHASES {
        let mut measures: Vec<Measure> = window.moving().map(|_| Measure::new(spacing)).collect();
        for k in -reach..=reach {
            let at = ShowTime::from_nanos(middle.as_nanos() + k * period + phase * period / PHASES);
            let pose = pose(at);
            for ((slot, axis), measure) in window.moving().zip(&mut measures) {
                let readings = measure.push(at, pose[slot]);
                worst = worst
                    .max(readings.velocity.value.abs() / axis.limits.velocity)
                    .max(readings.acceleration.value.abs() / axis.limits.acceleration)
                    .max(readings.jerk.value.abs() / axis.limits.jerk);
            }
        }
    }
    worst
}

/// The same where a move leaves what the lane did before.
pub(super) fn roughness_of_leaving(
    window: &Window,
    plan: &mut Plan,
    start: ShowTime,
    rate_hz: f64,
    before: Before<'_, '_>,
) -> f64 {
    roughness_around(window, start, rate_hz, |at| {
        if at < start { before(at) } else { plan.pose_at(at, start, window) }
    })
}
