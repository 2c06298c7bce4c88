//! From the places of an axis to the counts of its drive, and back.

use crate::drive::{DriveUnits, TICK_NS};
use crate::motion::AxisGeometry;

/// How a drive counts one axis. Where it is reversed its positive counts go down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DriveScale {
    units: DriveUnits,
    /// Counts a millimetre, negative where it is reversed.
    per_mm: f64,
    low_mm: f64,
    stroke_mm: f64,
}

impl DriveScale {
    /// Of an axis of a seat; none where no such drive counts as the axis does.
    pub(crate) fn of(axis: &AxisGeometry, is_reversed: bool) -> Option<Self> {
        let units = DriveUnits::of(axis.pulses_per_rev)?;
        let size = axis.pulses_per_rev / axis.lead;
        let per_mm = if is_reversed { -size } else { size };
        Some(Self { units, per_mm, low_mm: axis.low, stroke_mm: axis.stroke() })
    }

    /// Its units of velocity.
    pub(crate) const fn units(&self) -> DriveUnits {
        self.units
    }

    /// Counts at a place, or of a way, in mm.
    pub(crate) fn counts(&self, mm: f64) -> f64 {
        mm * self.per_mm
    }

    /// The same, whole.
    #[expect(clippy::cast_possible_truncation, reason = "a stroke fits i32; saturating")]
    pub(crate) fn whole(&self, mm: f64) -> i32 {
        self.counts(mm).round() as i32
    }

    /// Counts at a fraction of the stroke.
    pub(crate) fn at(&self, fraction: f64) -> f64 {
        self.counts(self.low_mm + fraction * self.stroke_mm)
    }

    /// The place of counts, or the way that they are, in mm.
    pub(crate) fn mm(&self, counts: f64) -> f64 {
        counts / self.per_mm
    }

    /// The fraction of the stroke at counts.
    pub(crate) fn fraction(&self, counts: f64) -> f64 {
        (self.mm(counts) - self.low_mm) / self.stroke_mm
    }

    /// The ends of the stroke, and so far beyond, in counts, the lower number first.
    pub(crate) fn reach(&self, margin_mm: f64) -> (f64, f64) {
        let (down, up) =
            (self.counts(self.low_mm - margin_mm), self.counts(self.low_mm + self.stroke_mm + margin_mm));
        (down.min(up), down.max(up))
    }

    /// A speed in units of the drive, at least 1.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating")]
    pub(crate) fn velocity(&self, mm_s: f64) -> u32 {
        let units = (mm_s * self.per_mm).abs() * TICK * self.units.per_count();
        units.round().clamp(1.0, f64::from(i32::MAX)) as u32
    }

    /// An acceleration in units of the drive, at least 2.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating")]
    pub(crate) fn acceleration(&self, mm_s2: f64) -> u32 {
        let units = (mm_s2 * self.per_mm).abs() * TICK * TICK * self.units.per_count();
        units.round().clamp(2.0, f64::from(0x1fff_ffff_u32)) as u32
    }
}

/// A tick of a drive, seconds.
const TICK: f64 = TICK_NS as f64 * 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    fn axis() -> AxisGeometry {
        AxisGeometry { pulses_per_rev: 4_000.0, ..AxisGeometry::BENCH }
    }

    #[test]
    fn speeds_and_accelerations_are_those_of_the_command_reference() {
        let scale = DriveScale::of(&axis(), false).unwrap();
        assert_eq!((scale.velocity(240.0), scale.acceleration(3_000.0)), (1_546_188_227, 2_319_282));
        assert_eq!((scale.velocity(0.0), scale.velocity(1e9)), (1, i32::MAX.unsigned_abs()));
    }

    #[test]
    fn a_reversed_axis_counts_down_where_it_goes_up() {
        let [plain, reversed] = [false, true].map(|reversed| DriveScale::of(&axis(), reversed).unwrap());
        assert_eq!((plain.whole(-2.0), reversed.whole(-2.0)), (-1_600, 1_600));
        assert_eq!((plain.at(0.5), reversed.at(0.5)), (60_000.0, -60_000.0));
        assert_eq!((plain.reach(1.0), reversed.reach(1.0)), ((-800.0, 120_800.0), (-120_800.0, 800.0)));
        assert!((reversed.fraction(reversed.at(0.3)) - 0.3).abs() < 1e-12);
    }
}
