//! A seat type: the geometry and limits of the axes of one controller, and the way from stroke to pulses.

use std::fmt;

use super::MAX_AXES;

/// The speed limit of a controller as it leaves the factory, turns a minute (PA07, IMAX manual 2.3.1).
const FACTORY_RPM: u32 = 3_000;
/// The longest Time that a controller executes as it leaves the factory, ms (PA0b, IMAX manual 2.3.1).
pub(crate) const FACTORY_INTERVAL_MS: u32 = 3_000;

/// Free fall, mm/s².
const FREE_FALL_MM_S2: f64 = 9_806.65;

/// A motor position as the controller counts it: whole pulses from the lower end of the stroke.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Pulses(pub i32);

/// Geometry and limits of a seat's axes; every axis of one controller has the same.
#[derive(Debug, Clone, PartialEq)]
pub struct SeatType {
    /// The name it has in the configuration.
    pub(crate) name: String,
    /// Axes of one controller, 1 to 12.
    pub axes: usize,
    /// Length of the stroke, mm, above 0.
    pub stroke_mm: f64,
    /// Travel per turn of the motor, mm, above 0.
    pub(crate) lead_mm: f64,
    /// Pulses per turn of the motor, above 0.
    pub(crate) pulses_per_rev: f64,
    /// Greatest speed, mm/s, above 0.
    pub max_velocity_mm_s: f64,
    /// Greatest acceleration, mm/s², above 0.
    pub max_acceleration_mm_s2: f64,
    /// Greatest jerk, mm/s³, above 0.
    pub max_jerk_mm_s3: f64,
    /// Greatest speed of motion and vibration together, mm/s, where the site says what it is.
    pub(crate) max_shaken_velocity_mm_s: Option<f64>,
    /// Greatest acceleration of motion and vibration together, mm/s², where the site says what it is.
    pub(crate) max_shaken_acceleration_mm_s2: Option<f64>,
    /// The controller's own limit on speed, turns a minute (PA07), where the site says what it is.
    pub(crate) max_rpm: Option<u32>,
    /// The longest Time that the controller executes as it is, ms (PA0b).
    pub(crate) max_interval_ms: u32,
    /// Where each axis rests between shows, fraction of the stroke; axes past the last one rest at 0.
    pub park: [f64; MAX_AXES],
    /// What levels scale about, fraction of the stroke.
    pub neutral: [f64; MAX_AXES],
}

impl SeatType {
    /// The seat that `--to` means: the bench seat with that many axes.
    #[must_use]
    pub fn bench3(axes: usize) -> Self {
        Self {
            name: "bench3".to_owned(),
            axes,
            stroke_mm: 150.0,
            lead_mm: 5.0,
            pulses_per_rev: 10_000.0,
            max_velocity_mm_s: 240.0,
            max_acceleration_mm_s2: 3_000.0,
            max_jerk_mm_s3: 60_000.0,
            max_shaken_velocity_mm_s: None,
            max_shaken_acceleration_mm_s2: None,
            max_rpm: None,
            max_interval_ms: FACTORY_INTERVAL_MS,
            park: [0.0; MAX_AXES],
            neutral: [0.0; MAX_AXES],
        }
    }

    /// Pulses over the whole stroke.
    #[must_use]
    pub fn stroke_pulses(&self) -> f64 {
        self.stroke_mm / self.lead_mm * self.pulses_per_rev
    }

    /// Between which pulses a motor of this seat stands.
    #[must_use]
    pub(crate) fn pulse_range(&self) -> PulseRange {
        PulseRange { low: 0.0, high: self.stroke_pulses() }
    }

    /// How fast the controller lets an axis move, mm/s: its own limit, else that of the factory.
    #[must_use]
    pub(crate) fn speed_ceiling_mm_s(&self) -> f64 {
        f64::from(self.max_rpm.unwrap_or(FACTORY_RPM)) * self.lead_mm / 60.0
    }

    /// How fast motion and vibration together may be, mm/s: as fast as the controller lets an axis move, unless the site says
    /// less. What is faster is cut there, so the axis would not swing as it is said, and lag behind the cue.
    #[must_use]
    pub(crate) fn shaken_velocity_mm_s(&self) -> f64 {
        self.max_shaken_velocity_mm_s.unwrap_or(f64::INFINITY).min(self.speed_ceiling_mm_s())
    }

    /// How hard motion and vibration together may accelerate, mm/s²: at 1 g at the most, unless the site says otherwise. A
    /// seat that falls any harder leaves the person on it, and meets them again at the bottom of the swing. Where motion
    /// alone may be harder, vibration may not add to that.
    #[must_use]
    pub(crate) fn shaken_acceleration_mm_s2(&self) -> f64 {
        self.max_shaken_acceleration_mm_s2.unwrap_or(FREE_FALL_MM_S2.max(self.max_acceleration_mm_s2))
    }

    /// Where the motor stands at `fraction` of the stroke: rounded to nearest, ties away from zero, saturating.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a saturating cast is what is wanted")]
    pub(crate) fn pulses(&self, fraction: f64) -> Pulses {
        Pulses((fraction * self.stroke_pulses()).round() as i32)
    }

    /// The fraction of the stroke at which the motor stands at `pulses`.
    #[must_use]
    pub(crate) fn fraction(&self, pulses: Pulses) -> f64 {
        f64::from(pulses.0) / self.stroke_pulses()
    }
}

/// Between which pulses the motor of an axis stands, the lower first; below 0 where its zero is inside the range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PulseRange {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl PulseRange {
    /// Pulses from one end to the other.
    #[must_use]
    pub(crate) fn span(self) -> f64 {
        self.high - self.low
    }

    /// True if `pulses` is inside the range, its ends included.
    #[must_use]
    pub(crate) fn contains(self, pulses: Pulses) -> bool {
        (self.low..=self.high).contains(&f64::from(pulses.0))
    }
}

impl fmt::Display for PulseRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.0}..={:.0}", self.low, self.high)
    }
}

/// How far outside its stroke a motor may be found that stands at its end, in strokes: 0.15 mm of 150. Drives hold a
/// place to some pulses.
const ROUNDING: f64 = 0.001;

/// True if a motor of that range can stand at `pulses`: inside it, or outside by no more than rounding. What is
/// farther out is no position, but a wrong word order, another seat type, or a zero that was lost.
#[must_use]
pub(crate) fn in_stroke(pulses: Pulses, range: PulseRange) -> bool {
    let slack = (ROUNDING * range.span()).max(1.0);
    (range.low - slack..=range.high + slack).contains(&f64::from(pulses.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bench_seat_turns_stroke_into_pulses() {
        let seat = SeatType::bench3(3);
        assert_eq!(seat.pulses(1.0), Pulses(300_000));
        assert_eq!(seat.pulses(0.5), Pulses(150_000));
        assert_eq!(seat.fraction(Pulses(75_000)), 0.25);
    }

    #[test]
    fn half_a_pulse_rounds_away_from_zero() {
        let seat = SeatType { stroke_mm: 1.0, lead_mm: 1.0, pulses_per_rev: 1.0, ..SeatType::bench3(1) };
        assert_eq!(seat.pulses(0.5), Pulses(1));
        assert_eq!(seat.pulses(-0.5), Pulses(-1));
    }
    #[test]
    fn a_motor_is_found_outside_its_stroke_by_rounding_alone() {
        let of = |low, high| PulseRange { low, high };
        for (pulses, inside) in [(-301, false), (-300, true), (0, true), (300_300, true), (300_301, false)] {
            assert_eq!(in_stroke(Pulses(pulses), of(0.0, 300_000.0)), inside, "{pulses}");
        }
        assert!(in_stroke(Pulses(-1), of(0.0, 100.0)) && !in_stroke(Pulses(-2), of(0.0, 100.0)));
    }

    #[test]
    fn a_range_with_its_zero_in_the_middle_has_the_same_room_at_both_ends() {
        let turntable = PulseRange { low: -250_000.0, high: 250_000.0 };
        for (pulses, inside) in [(-250_500, true), (-250_501, false), (250_500, true), (250_501, false)] {
            assert_eq!(in_stroke(Pulses(pulses), turntable), inside, "{pulses}");
        }
        assert!(turntable.contains(Pulses(-250_000)) && !turntable.contains(Pulses(-250_001)));
        assert_eq!(turntable.to_string(), "-250000..=250000");
    }
}
