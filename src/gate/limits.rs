//! The limits of one axis, and the plain tests that nearly every pose passes.

use super::history::Shown;
use crate::motion::Limits;

/// What the measure allows over the limits.
pub(super) const SLACK: f64 = 1.001;

/// Share of the acceleration and of the jerk that a way to rest is thought to have where nobody looks closer.
const EASY_BRAKE: f64 = 0.7;

/// What an axis may do, in strokes and seconds, and what follows from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AxisLimits {
    pub(super) velocity: f64,
    pub(super) acceleration: f64,
    pub(super) jerk: f64,
    /// Greatest change of velocity from one frame to the next.
    pub(super) step: f64,
    /// Greatest difference between the newest frame's velocity and that over the shorter distance, where nobody looks closer.
    rough: f64,
    per_jerk: f64,
    half_per_acceleration: f64,
    half_rise: f64,
}

impl AxisLimits {
    /// For frames of that period and distances of that many seconds.
    pub(super) fn new(limits: Limits, period: f64, apart: f64) -> Self {
        let Limits { velocity, acceleration, jerk } = limits;
        Self {
            velocity,
            acceleration,
            jerk,
            step: 4.0 * acceleration * period.max(0.005),
            rough: 0.1 * jerk * apart * apart,
            per_jerk: 1.0 / (EASY_BRAKE * jerk),
            half_per_acceleration: 0.5 / (EASY_BRAKE * acceleration),
            half_rise: 0.5 * acceleration / jerk,
        }
    }

    /// Whether the next pose keeps the limits: inside the stroke, frame velocity, its step, both distances. Not-a-number does not.
    #[inline]
    pub(super) fn hold(&self, next: &Next) -> bool {
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

    /// Whether the next pose is so far inside the limits that a way to rest need not be looked for.
    #[inline]
    pub(super) fn are_far(&self, next: &Next) -> bool {
        let [n, m] = next.shown;
        let (velocity, acceleration) = next.motion;
        let rising = acceleration.max(0.0);
        let falling = (-acceleration).max(0.0);
        let up = velocity.max(0.0) + 0.5 * rising * rising * self.per_jerk;
        let down = (-velocity).max(0.0) + 0.5 * falling * falling * self.per_jerk;
        let rough = next.velocity - (velocity - 0.5 * acceleration * next.seconds);
        (n.acceleration.abs().max(m.acceleration.abs()) <= 0.9 * self.acceleration)
            & (acceleration.abs() <= 0.9 * self.acceleration)
            & (n.jerk.abs().max(m.jerk.abs()) <= 0.7 * self.jerk)
            & (rough.abs() <= self.rough)
            & (up.max(down) <= 0.96 * self.velocity)
            & (next.position + self.way(up, rising) <= 1.0 + 1e-9)
            & (next.position - self.way(down, falling) >= -1e-9)
    }

    /// At least the way to rest from a speed that is left when an acceleration is gone.
    #[inline]
    fn way(&self, speed: f64, acceleration: f64) -> f64 {
        speed * (acceleration * self.per_jerk + speed * self.half_per_acceleration + self.half_rise)
    }
}

/// The next pose of an axis, as the measure sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Next {
    pub(super) position: f64,
    pub(super) seconds: f64,
    /// Of the frame: distance over Time.
    pub(super) velocity: f64,
    /// Its change from the frame before.
    pub(super) step: f64,
    /// Over the two distances.
    pub(super) shown: [Shown; 2],
    /// Velocity and acceleration at the pose itself, over the shorter distance.
    pub(super) motion: (f64, f64),
}
