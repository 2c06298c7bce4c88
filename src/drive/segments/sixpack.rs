//! Targets of a SIXpack 2, and what its loop makes of them.
//!
//! Each 2 ms a motor's speed is its distance to the target over `propdiv`: a lag of the first order. So targets lead by
//! what it lags. A new one makes the speed jump, which a motor without feedback may lose; what it jumps is judged, not
//! bounded by anything in the unit.

use std::time::Duration;

use super::middles::Middle;
use crate::wire::sixpack2::{MOST_SPEED, steps_of_a_unit};

/// How often the loop runs.
pub(crate) const LOOP: Duration = Duration::from_millis(2);

/// How a motor follows its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Lag {
    /// `$12`.
    clock_divider: u8,
    /// `$19`.
    propdiv: u8,
}

impl Lag {
    /// A divider of the clock (`$12`), and one of the distance (`$19`), at least 1.
    #[must_use]
    pub(crate) fn new(clock_divider: u8, propdiv: u8) -> Self {
        Self { clock_divider, propdiv: propdiv.max(1) }
    }

    /// The one with the least propdiv at which a new target each period makes the speed jump by no more than `jump` at the
    /// speed `velocity`, both in one unit; none where even the greatest is too small. A setting of the seat, whatever it plays.
    #[must_use]
    pub(crate) fn gentlest(clock_divider: u8, period: Duration, velocity: f64, jump: f64) -> Option<Self> {
        (1..=u8::MAX)
            .map(|propdiv| Self::new(clock_divider, propdiv))
            .find(|lag| velocity * period.as_secs_f64() <= jump * lag.tau())
    }

    /// Microsteps a second of one unit of speed.
    fn unit(self) -> f64 {
        steps_of_a_unit(self.clock_divider)
    }

    /// How long it lags behind, seconds.
    #[must_use]
    pub(crate) fn tau(self) -> f64 {
        f64::from(self.propdiv) / self.unit()
    }

    /// What is written with `$19`.
    #[must_use]
    pub(crate) const fn propdiv(self) -> u8 {
        self.propdiv
    }
}

/// Makes targets of middles, one axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TargetMaker {
    lag: Lag,
    /// The ends of the stroke, microsteps.
    stroke: (f64, f64),
    last: i32,
}

impl TargetMaker {
    /// In a stroke, the lower end first, at rest at `position`, in microsteps.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a stroke fits i32; saturating")]
    pub(crate) fn at_rest(lag: Lag, stroke: (f64, f64), position: f64) -> Self {
        let stroke = (stroke.0.min(stroke.1), stroke.1.max(stroke.0));
        Self { lag, stroke, last: position.round() as i32 }
    }

    /// The target at the beginning of a slice, of its middle in microsteps; the one before where that is no number.
    ///
    /// It leads by the lag, and is held at the end of the stroke: where the last target is, the axis comes to rest when its link
    /// is dead.
    #[expect(clippy::cast_possible_truncation, reason = "a stroke fits i32; saturating")]
    pub(crate) fn push(&mut self, middle: Middle) -> i32 {
        let led = middle.position + self.lag.tau() * middle.velocity;
        if led.is_finite() {
            // Nearer to what it should be than where the axis is a lag later, and without a jump from one to the other.
            self.last = led.clamp(self.stroke.0, self.stroke.1).round() as i32;
        }
        self.last
    }
}

/// One motor as its unit runs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motor {
    lag: Lag,
    /// Microsteps.
    position: f64,
    /// In the unit's own units.
    speed: i32,
}

impl Motor {
    /// At rest there, in microsteps.
    #[must_use]
    pub(crate) const fn at_rest(lag: Lag, position: f64) -> Self {
        Self { lag, position, speed: 0 }
    }

    /// Runs the loop once, and so for 2 ms.
    #[expect(clippy::cast_possible_truncation, reason = "a stroke fits i32; saturating")]
    pub(crate) fn run(&mut self, target: i32) {
        let distance = target.saturating_sub(self.position.round() as i32);
        self.speed = (distance / i32::from(self.lag.propdiv)).clamp(-MOST_SPEED, MOST_SPEED);
        self.position += self.velocity() * LOOP.as_secs_f64();
    }

    /// Microsteps.
    #[must_use]
    pub(crate) const fn position(&self) -> f64 {
        self.position
    }

    /// Microsteps a second.
    #[must_use]
    pub(crate) fn velocity(&self) -> f64 {
        f64::from(self.speed) * self.lag.unit()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_micros(7_500);

    #[test]
    fn the_lag_is_that_of_the_dividers() {
        let ms = |clock_divider, propdiv| Lag::new(clock_divider, propdiv).tau() * 1e3;
        assert!((ms(5, 8) - 39.3).abs() < 0.1 && (ms(3, 1) - 3.28).abs() < 0.01, "{} {}", ms(5, 8), ms(3, 1));
    }

    #[test]
    fn a_motor_comes_to_its_target_by_the_lag() {
        let lag = Lag::new(3, 12);
        let mut motor = Motor::at_rest(lag, 0.0);
        (0..20).for_each(|_| motor.run(1_000));
        let left = 1_000.0 - motor.position();
        let wanted = 1_000.0 * (1.0 - 0.002 / lag.tau()).powi(20);
        assert!((left - wanted).abs() < 15.0, "{left} {wanted}");
        (0..500).for_each(|_| motor.run(1_000));
        assert!(motor.velocity() == 0.0 && (1_000.0 - motor.position()).abs() <= 12.0, "{motor:?}");
    }

    #[test]
    fn at_an_even_speed_targets_lead_by_the_lag_and_no_further_than_the_stroke() {
        let lag = Lag::new(3, 12);
        let mut targets = TargetMaker::at_rest(lag, (0.0, 20_000.0), 0.0);
        for slice in 0..400_u32 {
            let position = 10_000.0 * (f64::from(slice) + 0.5) * PERIOD.as_secs_f64();
            let target = targets.push(Middle { position, velocity: 10_000.0 });
            let wanted = (position + 10_000.0 * lag.tau()).min(20_000.0);
            assert!((f64::from(target) - wanted).abs() <= 0.5, "{slice}: {target} {wanted}");
        }
    }

    #[test]
    fn a_target_that_would_lead_out_of_the_stroke_is_at_its_end_and_nonsense_is_as_the_one_before() {
        let mut targets = TargetMaker::at_rest(Lag::new(3, 12), (100.0, 90_000.0), 500.0);
        assert_eq!(targets.push(Middle { position: f64::NAN, velocity: 0.0 }), 500);
        assert_eq!(targets.push(Middle { position: 300.0, velocity: -50_000.0 }), 100);
        assert_eq!(targets.push(Middle { position: 300.0, velocity: f64::INFINITY }), 100);
        assert_eq!(targets.push(Middle { position: 89_000.0, velocity: 50_000.0 }), 90_000);
    }

    #[test]
    fn propdiv_is_the_least_at_which_full_speed_jumps_no_more_than_allowed() {
        let lag = Lag::gentlest(3, PERIOD, 240.0, 22.5).expect("one does");
        assert!(240.0 * 0.0075 / lag.tau() <= 22.5, "{lag:?}");
        let next = Lag::new(3, lag.propdiv() - 1);
        assert!(240.0 * 0.0075 / next.tau() > 22.5, "{next:?}");
        assert_eq!(Lag::gentlest(3, PERIOD, 240.0, 0.1), None);
    }
}
