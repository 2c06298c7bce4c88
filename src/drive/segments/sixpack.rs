//! TargetMaker of a SIXpack 2, and what its loop makes of them.
//!
//! Each 2 ms a motor's speed is its distance to the target over `propdiv`: a lag of the first order. So targets lead by
//! what it lags. A new one makes the speed jump, which a motor without feedback may lose; what it jumps is judged, not
//! bounded by anything in the unit.

use std::time::Duration;

use super::middles::Middle;

/// How often the loop runs.
pub(crate) const LOOP: Duration = Duration::from_millis(2);

/// The clock of the unit, Hz.
const CLOCK_HZ: f64 = 20e6;
/// The greatest speed, in the unit's own units.
const MOST_SPEED: i32 = 511;
/// How many slices are looked ahead at the most.
const AHEAD: usize = 48;
/// The longest lag that fits into that, in slices.
const AHEAD_SLICES: f64 = 46.0;

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
            .find(|lag| velocity * period.as_secs_f64() <= jump * lag.tau() && lag.fits(period))
    }

    /// True if it may be looked ahead so far.
    fn fits(self, period: Duration) -> bool {
        self.tau() / period.as_secs_f64() <= AHEAD_SLICES
    }

    /// Microsteps a second of one unit of speed.
    fn unit(self) -> f64 {
        CLOCK_HZ / (f64::from(self.clock_divider) + 1.0) / f64::from(1_u32 << 14)
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

    /// The greatest speed, microsteps a second.
    #[must_use]
    pub(crate) fn most(self) -> f64 {
        f64::from(MOST_SPEED) * self.unit()
    }
}

/// Makes targets of middles, one axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TargetMaker {
    lag: Lag,
    /// Slices that the lag lasts.
    slices: f64,
    /// The ends of the stroke, microsteps: where the last target is, the axis stays when its link is dead.
    stroke: (f64, f64),
    /// The newest first.
    middles: [Middle; AHEAD],
    seen: usize,
}

impl TargetMaker {
    /// At rest at `position` in a stroke, the lower end first, in microsteps; a target each period. A lag that is too long to
    /// be looked ahead is taken as the longest that is not.
    #[must_use]
    pub(crate) fn at_rest(lag: Lag, period: Duration, stroke: (f64, f64), position: f64) -> Self {
        let slices = (lag.tau() / period.as_secs_f64()).min(AHEAD_SLICES);
        let stroke = (stroke.0.min(stroke.1), stroke.1.max(stroke.0));
        Self { lag, slices, stroke, middles: [Middle { position, velocity: 0.0 }; AHEAD], seen: 0 }
    }

    /// How many slices behind the newest middle the target is that [`Self::push`] gives.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 47")]
    pub(crate) fn behind(&self) -> usize {
        self.slices.floor() as usize + 1
    }

    /// Takes the middle of the next slice, in microsteps, and gives the target at the beginning of one before it.
    #[expect(clippy::cast_possible_truncation, reason = "a stroke fits i32; saturating")]
    pub(crate) fn push(&mut self, middle: Middle) -> Option<i32> {
        self.middles.rotate_right(1);
        if middle.position.is_finite() && middle.velocity.is_finite() {
            self.middles[0] = middle;
        }
        self.seen = (self.seen + 1).min(AHEAD);
        let behind = self.behind();
        if self.seen <= behind {
            return None;
        }
        let Middle { position, velocity } = self.middles[behind];
        let led = position + self.lag.tau() * velocity;
        let (low, high) = self.stroke;
        let target = if (low..=high).contains(&led) { led } else { self.later().clamp(low, high) };
        Some(target.round() as i32)
    }

    /// Where the axis is to be a lag later: inside its stroke, and off by no more than half the acceleration times the lag
    /// squared.
    fn later(&self) -> f64 {
        // The lag ends between the two newest.
        let (before, after) = (self.middles[1].position, self.middles[0].position);
        before + self.slices.fract() * (after - before)
    }
}

/// One motor as its unit runs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motor {
    lag: Lag,
    /// Microsteps.
    position: f64,
    /// DriveUnits of speed.
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
        assert!((Lag::new(5, 8).most() / 640.0 - 162.0).abs() < 1.0, "mm/s at a lead of 5 mm");
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
        let mut targets = TargetMaker::at_rest(Lag::new(3, 12), PERIOD, (0.0, 20_000.0), 0.0);
        let (tau, mut made) = (Lag::new(3, 12).tau(), Vec::new());
        for slice in 0..400_u32 {
            let at = (f64::from(slice) + 0.5) * PERIOD.as_secs_f64();
            made.extend(targets.push(Middle { position: 10_000.0 * at, velocity: 10_000.0 }));
        }
        for (slice, target) in (0_u32..).zip(made) {
            let at = (f64::from(slice) + 0.5) * PERIOD.as_secs_f64();
            let wanted = (10_000.0 * (at + tau)).min(20_000.0);
            assert!((f64::from(target) - wanted).abs() < 1.0, "{slice}: {target} {wanted}");
        }
    }

    #[test]
    fn a_target_that_would_lead_out_of_the_stroke_is_where_the_axis_is_a_lag_later() {
        let (lag, stroke) = (Lag::new(3, 12), (0.0, 90_000.0));
        let mut targets = TargetMaker::at_rest(lag, PERIOD, stroke, 0.0);
        let slices = lag.tau() / PERIOD.as_secs_f64();
        let pose = |slice: f64| 5_000.0 * (1.0 - (0.1 * slice).cos());
        let speed = |slice: f64| 500.0 * (0.1 * slice).sin() / PERIOD.as_secs_f64();
        let behind = f64::from(u32::try_from(targets.behind()).expect("some slices"));
        let mut met = 0;
        for slice in (0..200_u32).map(|slice| f64::from(slice) + 0.5) {
            let middle = Middle { position: pose(slice), velocity: speed(slice) };
            let Some(target) = targets.push(middle) else { continue };
            let at = slice - behind;
            if pose(at) + lag.tau() * speed(at) < 0.0 {
                met += 1;
                let later = pose(at + slices);
                assert!((f64::from(target) - later).abs() < 12.0, "{target} {later}");
            }
        }
        assert!(met > 10, "{met}");
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
