//! From the places of an axis to the microsteps of its motor, and back.

use crate::motion::AxisGeometry;
use crate::wire::sixpack2::{MOST_SPEED, steps_of_a_unit};

/// The least that the counter reads at the lower end of the stroke, below 0 where it is reversed: one that was reset, at 0, never looks like
/// a place.
const LEAST_BASE: u64 = 1_000_000;
/// From there on it reads what the settings come to: with a stroke of 900,000 at the most it stays below 2^23.
const BASES: u64 = 6_000_000;
/// So far beside its stroke a counter may still be taken for a place of the seat, mm.
pub(super) const BESIDE_MM: f64 = 10.0;

/// How a motor counts one axis. Where it is reversed its counter goes down as the axis goes up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MotorScale {
    /// Microsteps a millimetre, negative where it is reversed.
    per_mm: f64,
    /// The counter at the lower end of the stroke.
    base: f64,
    low_mm: f64,
    stroke_mm: f64,
    clock_divider: u8,
}

impl MotorScale {
    /// Of an axis of a seat.
    pub(crate) fn of(axis: &AxisGeometry, is_reversed: bool, clock_divider: u8) -> Self {
        let size = axis.pulses_per_rev / axis.lead;
        let per_mm = if is_reversed { -size } else { size };
        let scale = Self { per_mm, base: 0.0, low_mm: axis.low, stroke_mm: axis.stroke(), clock_divider };
        scale.counting_by(0, 0)
    }

    /// The same, counting from what a sum of its settings says: nothing else can be read of a motor but its counter, so that is to be no
    /// place of the stroke once the settings are others than those that the seat was homed with, or its line leads to another seat. Of
    /// two seats that are set alike no place is one of both, or each is: neither is ever led by a count that is beside its own.
    pub(crate) fn counting_by(self, sum: u64, whose: u64) -> Self {
        let stroke = u64::from(self.way(self.stroke_mm + 2.0 * BESIDE_MM)) + 1;
        let shifted = sum % BASES + stroke * (whose % (BASES / stroke).max(1));
        #[expect(clippy::cast_precision_loss, reason = "millions")]
        let base = (LEAST_BASE + shifted % BASES) as f64;
        Self { base: base.copysign(self.per_mm), ..self }
    }

    /// The counter at a place.
    pub(crate) fn steps(&self, mm: f64) -> f64 {
        self.base + (mm - self.low_mm) * self.per_mm
    }

    /// The same, whole.
    #[expect(clippy::cast_possible_truncation, reason = "a stroke fits i32; saturating")]
    pub(crate) fn whole(&self, mm: f64) -> i32 {
        self.steps(mm).round() as i32
    }

    /// Microsteps of a way, whatever its direction.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a stroke fits; saturating")]
    pub(crate) fn way(&self, mm: f64) -> u32 {
        (mm * self.per_mm).abs().ceil() as u32
    }

    /// The counter at a fraction of the stroke.
    pub(crate) fn at(&self, fraction: f64) -> f64 {
        self.base + self.way_of(fraction)
    }

    /// Microsteps of a part of the stroke.
    pub(crate) fn way_of(&self, fraction: f64) -> f64 {
        fraction * self.stroke_mm * self.per_mm
    }

    /// The fraction of the stroke at the counter.
    pub(crate) fn fraction(&self, steps: f64) -> f64 {
        (steps - self.base) / (self.stroke_mm * self.per_mm)
    }

    /// The ends of the stroke, and so far beyond, by the counter, the lower number first.
    pub(crate) fn reach(&self, margin_mm: f64) -> (f64, f64) {
        let down = self.steps(self.low_mm - margin_mm);
        let up = self.steps(self.low_mm + self.stroke_mm + margin_mm);
        (down.min(up), down.max(up))
    }

    /// The place of the counter.
    pub(crate) fn mm(&self, steps: f64) -> f64 {
        self.low_mm + self.mm_of(steps - self.base)
    }

    /// The way of microsteps, in mm.
    pub(crate) fn mm_of(&self, steps: f64) -> f64 {
        steps / self.per_mm
    }

    /// A speed in units of the motor, rounded down, from 1 to the greatest.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 511")]
    pub(crate) fn speed(&self, mm_s: f64) -> u16 {
        ((mm_s * self.per_mm).abs() / self.unit()).clamp(1.0, f64::from(MOST_SPEED)) as u16
    }

    /// A speed in units of the motor, in mm/s.
    pub(crate) fn mm_s(&self, speed: u16) -> f64 {
        f64::from(speed) * self.unit() / self.per_mm.abs()
    }

    /// An acceleration in units a loop of 2 ms, rounded down, from 1.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 511")]
    pub(crate) fn acceleration(&self, mm_s2: f64) -> u16 {
        let a_loop = crate::drive::LOOP.as_secs_f64();
        ((mm_s2 * self.per_mm).abs() * a_loop / self.unit()).clamp(1.0, f64::from(MOST_SPEED)) as u16
    }

    /// The greatest speed of the motor, whatever it is told, mm/s.
    pub(crate) fn full_mm_s(&self) -> f64 {
        f64::from(MOST_SPEED) * self.unit() / self.per_mm.abs()
    }

    /// An acceleration in units a loop, in mm/s².
    pub(crate) fn ramp_mm_s2(&self, units: u16) -> f64 {
        self.mm_s(units) / crate::drive::LOOP.as_secs_f64()
    }

    fn unit(&self) -> f64 {
        steps_of_a_unit(self.clock_divider)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lower_end_of_the_stroke_is_at_a_million_or_more_to_the_side_to_which_the_motor_counts() {
        let axis = AxisGeometry { pulses_per_rev: 3_200.0, low: 10.0, high: 160.0, ..AxisGeometry::BENCH };
        let [plain, reversed] = [false, true].map(|reversed| MotorScale::of(&axis, reversed, 3));
        assert_eq!([plain.whole(10.0), plain.whole(160.0)], [1_000_000, 1_096_000]);
        assert_eq!([reversed.whole(10.0), reversed.whole(160.0)], [-1_000_000, -1_096_000]);
        assert!((reversed.mm(reversed.steps(33.0)) - 33.0).abs() < 1e-9);
        assert_eq!(reversed.reach(1.0), (-1_096_640.0, -999_360.0));
        assert!(
            (reversed.at(0.5) + 1_048_000.0).abs() < 1e-6
                && (reversed.fraction(-1_048_000.0) - 0.5).abs() < 1e-12
        );
        let [low, high] = [5_999_999, 6_000_000].map(|sum| plain.counting_by(sum, 0).whole(10.0));
        assert_eq!((low, high), (6_999_999, 1_000_000));
        assert_eq!((plain.way(165.0), reversed.way(165.0)), (105_600, 105_600));
    }

    #[test]
    fn seats_that_are_set_alike_share_all_places_or_none() {
        let axis = AxisGeometry { pulses_per_rev: 3_200.0, ..AxisGeometry::BENCH };
        let scale = MotorScale::of(&axis, false, 3);
        let mut apart = 0;
        for (sum, (one, other)) in
            (0..400).flat_map(|n| [(n * 15_011, (n, n + 1)), (5_999_999 - n, (n, 7 * n))])
        {
            let [one, other] = [one, other].map(|whose| scale.counting_by(sum, whose).reach(BESIDE_MM));
            assert!(one.0 > 900_000.0 && one.1 < 7_200_000.0, "{one:?}");
            assert!(one == other || one.1 < other.0 || other.1 < one.0, "{one:?} {other:?}");
            apart += u32::from(one != other);
        }
        assert!(apart > 700, "{apart} of 800");
    }

    #[test]
    fn speeds_are_never_above_what_was_asked_for() {
        let axis = AxisGeometry { pulses_per_rev: 3_200.0, ..AxisGeometry::BENCH };
        let scale = MotorScale::of(&axis, true, 3);
        assert_eq!([10.0, 240.0, 1e9, 0.0].map(|speed| scale.speed(speed)), [20, 503, 511, 1]);
        assert!((scale.mm_s(20) - 9.54).abs() < 0.01);
        assert_eq!([3_000.0, 1.0].map(|acceleration| scale.acceleration(acceleration)), [12, 1]);
    }
}
