//! The limits of one axis, and whether its next pose keeps them.

use super::history::Shown;
use crate::motion::Limits;

// For rounding in sums of the same differences (docs/limiter.md, section 1).
/// What the measure allows over the limits.
pub(super) const SLACK: f64 = 1.001;

/// What an axis may do, in strokes and seconds, and what follows from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxisLimits {
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
    /// Greatest change of velocity from one frame to the next.
    pub(super) step: f64,
}

impl AxisLimits {
    /// For frames of that period.
    pub(super) fn new(limits: Limits, period: f64) -> Self {
        // Never less than 20 ms x A, so that it is in the way of nothing that acceleration allows (docs/limiter.md, section 1).
        let Limits { velocity, acceleration, jerk } = limits;
        Self { velocity, acceleration, jerk, step: 4.0 * acceleration * period.max(0.005) }
    }

    /// True if the next pose keeps the limits: inside the stroke, frame velocity, its step, both distances. Not-a-number does not.
    #[inline]
    pub(super) fn hold(&self, next: &NextPose) -> bool {
        // As `value <= limit`: what is no number fails that, and would pass `!(value > limit)`.
        let [n, m] = next.shown;
        (next.position >= 0.0)
            & (next.position <= 1.0)
            & (next.velocity.abs() <= SLACK * self.velocity)
            & (next.step.abs() <= SLACK * self.step)
            & (n.acceleration.abs() <= SLACK * self.acceleration)
            & (m.acceleration.abs() <= SLACK * self.acceleration)
            & (n.jerk.abs() <= SLACK * self.jerk)
            & (m.jerk.abs() <= SLACK * self.jerk)
    }
}

/// The next pose of an axis, as the measure sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct NextPose {
    pub(super) position: f64,
    /// Of the frame: distance over Time.
    pub(super) velocity: f64,
    /// Its change from the frame before.
    pub(super) step: f64,
    /// Over the two distances.
    pub(super) shown: [Shown; 2],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::AxisGeometry;

    #[test]
    fn each_limit_is_kept_by_itself_over_either_distance_and_what_is_no_number_keeps_none() {
        let limits = AxisLimits::new(Limits::of(&AxisGeometry::BENCH), 0.01);
        let at_most = Shown { slope: 0.0, acceleration: limits.acceleration, jerk: -limits.jerk };
        let sound = NextPose {
            position: 1.0,
            velocity: -limits.velocity,
            step: limits.step,
            shown: [at_most, at_most],
        };
        assert!(limits.hold(&sound));
        for more in [1.01, -1.01, f64::NAN, f64::INFINITY] {
            let breaks: [fn(&mut NextPose) -> &mut f64; 7] = [
                |next| &mut next.position,
                |next| &mut next.velocity,
                |next| &mut next.step,
                |next| &mut next.shown[0].acceleration,
                |next| &mut next.shown[1].acceleration,
                |next| &mut next.shown[0].jerk,
                |next| &mut next.shown[1].jerk,
            ];
            for (place, broken) in breaks.into_iter().enumerate() {
                let mut next = sound;
                *broken(&mut next) *= more;
                assert!(!limits.hold(&next), "{more} times the limit of {place}: {next:?}");
            }
        }
    }
}
