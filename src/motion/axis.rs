//! One axis of a seat type: its range, its limits, and the way from fractions of the range to pulses.

use serde::{Deserialize, Serialize};

use super::{PulseRange, Pulses};

/// The speed limit of a controller as it leaves the factory, turns a minute (PA07, IMAX manual 2.3.1).
const FACTORY_RPM: u32 = 3_000;
/// Free fall, mm/s².
const FREE_FALL_MM_S2: f64 = 9_806.65;
/// What arithmetic alone may put a place past an end, parts of the range.
const INSIDE: f64 = 1e-6;
/// How fast an axis parks, mm/s: slowly enough for whoever is getting off.
const PARK_VELOCITY_MM_S: f64 = 50.0;
/// How fast a rotary axis parks, deg/s: at half a metre from the middle not twice as fast as a cylinder.
const PARK_VELOCITY_DEG_S: f64 = 10.0;

/// How long an axis may take to park, seconds: the hall gives up after two minutes.
pub(crate) const PARKS_WITHIN_S: f64 = 100.0;

/// What the places of an axis are told in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum AxisUnit {
    /// A cylinder: millimetres.
    #[serde(rename = "mm")]
    Millimetre,
    /// A rotary axis: degrees.
    #[serde(rename = "deg")]
    Degree,
}

impl AxisUnit {
    /// The word for it.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Degree => "deg",
        }
    }

    /// How fast an axis parks, in the unit a second.
    #[must_use]
    pub(crate) const fn park_velocity(self) -> f64 {
        match self {
            Self::Millimetre => PARK_VELOCITY_MM_S,
            Self::Degree => PARK_VELOCITY_DEG_S,
        }
    }
}

/// Range and limits of one axis. Lengths are in its unit, speeds in that a second, and so on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisGeometry {
    /// What its places are told in.
    pub(crate) unit: AxisUnit,
    /// The lower end of the range; the motor is at pulse 0 at 0.
    pub(crate) low: f64,
    /// The upper end of the range, above the lower one.
    pub(crate) high: f64,
    /// Travel per turn of the motor, above 0.
    pub(crate) lead: f64,
    /// Pulses per turn of the motor, above 0.
    pub pulses_per_rev: f64,
    /// Greatest speed, above 0.
    pub max_velocity: f64,
    /// Greatest acceleration, above 0.
    pub max_acceleration: f64,
    /// Greatest jerk, above 0.
    pub max_jerk: f64,
    /// Greatest speed of motion and vibration together, where the site says what it is.
    pub(crate) max_shaken_velocity: Option<f64>,
    /// Greatest acceleration of motion and vibration together, where the site says what it is.
    pub(crate) max_shaken_acceleration: Option<f64>,
    /// The controller's own limit on speed, turns a minute (PA07), where the site says what it is.
    pub(crate) max_rpm: Option<u32>,
    /// Where it rests between shows, fraction of the range.
    pub park: f64,
    /// What levels scale about, fraction of the range.
    pub neutral: f64,
}

impl AxisGeometry {
    /// The cylinder of the bench seat.
    pub const BENCH: Self = Self {
        unit: AxisUnit::Millimetre,
        low: 0.0,
        high: 150.0,
        lead: 5.0,
        pulses_per_rev: 10_000.0,
        max_velocity: 240.0,
        max_acceleration: 3_000.0,
        max_jerk: 60_000.0,
        max_shaken_velocity: None,
        max_shaken_acceleration: None,
        max_rpm: None,
        park: 0.0,
        neutral: 0.0,
    };

    /// What stands in the places of a frame behind the axes of a seat: at pulse 0, with the limits of this axis.
    #[must_use]
    pub(crate) fn padding(self) -> Self {
        Self { low: 0.0, high: self.stroke(), park: 0.0, neutral: 0.0, ..self }
    }

    /// Length of the range.
    #[must_use]
    pub fn stroke(&self) -> f64 {
        self.high - self.low
    }

    /// What a place leaves to the nearer end of the range, a part of that; below 0 outside. The end at which the axis parks is no limit to
    /// what stays inside: every cue begins there.
    #[must_use]
    pub(crate) fn room(&self, place: f64) -> f64 {
        let ends = [(0.0, place - self.low), (1.0, self.high - place)];
        let left = ends.map(|(end, left)| {
            let is_park = (self.park - end).abs() < f64::EPSILON && left > -INSIDE * self.stroke();
            if is_park { 1.0 } else { left / self.stroke() }
        });
        left[0].min(left[1])
    }

    /// How long it takes to park from where that is farthest, seconds.
    #[must_use]
    pub(crate) fn longest_park(&self) -> f64 {
        let farthest = self.stroke() * self.park.max(1.0 - self.park);
        farthest / self.max_velocity.min(self.unit.park_velocity())
    }

    /// Pulses over the whole range.
    #[must_use]
    pub fn stroke_pulses(&self) -> f64 {
        self.stroke() / self.lead * self.pulses_per_rev
    }

    /// Between which pulses the motor stands.
    #[must_use]
    pub(crate) fn pulse_range(&self) -> PulseRange {
        let low = self.low / self.lead * self.pulses_per_rev;
        PulseRange { low, high: low + self.stroke_pulses() }
    }

    /// How fast the controller lets the axis move: its own limit, else that of the factory.
    #[must_use]
    pub(crate) fn speed_ceiling(&self) -> f64 {
        f64::from(self.max_rpm.unwrap_or(FACTORY_RPM)) * self.lead / 60.0
    }

    /// Turns a minute that the greatest speed takes.
    #[must_use]
    pub(crate) fn needed_rpm(&self) -> f64 {
        self.max_velocity * 60.0 / self.lead
    }

    /// How fast motion and vibration together may be: as fast as the controller lets the axis move, unless the site says
    /// less. What is faster is cut there, so the axis would not swing as it is said, and lag behind the cue.
    #[must_use]
    pub(crate) fn shaken_velocity(&self) -> f64 {
        self.max_shaken_velocity.unwrap_or(f64::INFINITY).min(self.speed_ceiling())
    }

    /// How hard motion and vibration together may accelerate: a cylinder at 1 g at the most, unless the site says otherwise. A
    /// seat that falls any harder leaves the person on it, and meets them again at the bottom of the swing. Where motion
    /// alone may be harder, vibration may not add to that.
    #[must_use]
    pub(crate) fn shaken_acceleration(&self) -> f64 {
        let usual = match self.unit {
            AxisUnit::Millimetre => FREE_FALL_MM_S2.max(self.max_acceleration),
            AxisUnit::Degree => self.max_acceleration,
        };
        self.max_shaken_acceleration.unwrap_or(usual)
    }

    /// The greatest velocity and acceleration of motion and vibration together.
    #[must_use]
    pub(crate) fn most_shaken(&self) -> [f64; 2] {
        [self.shaken_velocity(), self.shaken_acceleration()]
    }

    /// Where the motor stands at `fraction` of the range: rounded to nearest, ties away from zero, saturating.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a saturating cast is what is wanted")]
    pub(crate) fn pulses(&self, fraction: f64) -> Pulses {
        Pulses((self.pulse_range().low + fraction * self.stroke_pulses()).round() as i32)
    }

    /// The fraction of the range at which the motor stands at `pulses`.
    #[must_use]
    pub(crate) fn fraction(&self, pulses: Pulses) -> f64 {
        (f64::from(pulses.0) - self.pulse_range().low) / self.stroke_pulses()
    }

    /// The place at `fraction` of the range, in the unit.
    #[must_use]
    pub(crate) fn place(&self, fraction: f64) -> f64 {
        self.low + fraction * self.stroke()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bench_seat_turns_stroke_into_pulses() {
        let axis = AxisGeometry::BENCH;
        assert_eq!(axis.pulses(1.0), Pulses(300_000));
        assert_eq!(axis.pulses(0.5), Pulses(150_000));
        assert_eq!(axis.fraction(Pulses(75_000)), 0.25);
    }

    #[test]
    fn half_a_pulse_rounds_away_from_zero() {
        let axis = AxisGeometry { high: 1.0, lead: 1.0, pulses_per_rev: 1.0, ..AxisGeometry::BENCH };
        assert_eq!(axis.pulses(0.5), Pulses(1));
        assert_eq!(axis.pulses(-0.5), Pulses(-1));
    }

    #[test]
    fn a_turntable_is_at_pulse_0_in_the_middle_of_its_range() {
        let unit = AxisUnit::Degree;
        let turns = AxisGeometry { unit, low: -180.0, high: 180.0, lead: 360.0, ..AxisGeometry::BENCH };
        for (fraction, degrees, pulses) in [(0.0, -180.0, -5_000), (0.5, 0.0, 0), (0.75, 90.0, 2_500)] {
            assert_eq!((turns.pulses(fraction), turns.place(fraction)), (Pulses(pulses), degrees));
            assert_eq!(turns.fraction(Pulses(pulses)), fraction);
        }
        assert_eq!(turns.padding().pulses(turns.padding().park), Pulses(0));
    }
}
