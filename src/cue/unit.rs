//! The units of a cue's positions, and what a file may declare them to be.

use std::str::FromStr;

use super::Problem;
use super::limits::{MAX_DEGREES, MAX_MILLIMETRES, MAX_PULSES};
use crate::motion::{AxisGeometry, AxisUnit, MAX_AXES, SeatType, Slot};

/// The unit that positions and vibration amplitudes of an axis have in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Unit {
    /// Fraction of the stroke, 0 to 1.
    #[default]
    Fraction,
    /// Millimetres from the zero of the axis.
    Millimetre,
    /// Degrees from the zero of the axis.
    Degree,
    /// Motor pulses.
    Pulse,
}

impl Unit {
    /// The word for it in a cue file.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Fraction => "fraction",
            Self::Millimetre => "mm",
            Self::Degree => "deg",
            Self::Pulse => "pulse",
        }
    }

    /// True if the places of an axis can be told in this unit.
    #[must_use]
    pub(crate) fn suits(self, axis: &AxisGeometry) -> bool {
        match self {
            Self::Fraction | Self::Pulse => true,
            Self::Millimetre => axis.unit == AxisUnit::Millimetre,
            Self::Degree => axis.unit == AxisUnit::Degree,
        }
    }

    /// The factor that turns a position in this unit into a fraction of the axis's stroke.
    #[must_use]
    pub(crate) fn to_stroke(self, axis: &AxisGeometry) -> f64 {
        self.stroke(axis).recip()
    }

    /// The length of the axis's stroke in this unit.
    #[must_use]
    pub(crate) fn stroke(self, axis: &AxisGeometry) -> f64 {
        match self {
            Self::Fraction => 1.0,
            Self::Millimetre | Self::Degree => axis.stroke(),
            Self::Pulse => axis.stroke_pulses(),
        }
    }

    /// Between which positions in this unit the axis can be.
    #[must_use]
    pub(crate) fn ends(self, axis: &AxisGeometry) -> (f64, f64) {
        match self {
            Self::Fraction => (0.0, 1.0),
            Self::Millimetre | Self::Degree => (axis.low, axis.high),
            Self::Pulse => {
                let range = axis.pulse_range();
                (range.low, range.high)
            }
        }
    }

    /// The slot that carries `axis` of a cue in this unit, `seat_axis` being the seat's own count from 0.
    #[must_use]
    pub(crate) fn slot(self, seat: &SeatType, seat_axis: usize, axis: Option<usize>) -> Slot {
        let geometry = &seat.each[seat_axis];
        let below = self.ends(geometry).0 / self.stroke(geometry);
        Slot::new(seat, seat_axis, axis, self.to_stroke(geometry)).zero_at(0.0 - below)
    }

    /// What stands behind a value in a message; nothing for fractions.
    #[must_use]
    pub(crate) const fn suffix(self) -> &'static str {
        match self {
            Self::Fraction => "",
            Self::Millimetre => " mm",
            Self::Degree => " deg",
            Self::Pulse => " pulses",
        }
    }
}

/// The unit of each axis of a cue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Units([Unit; MAX_AXES]);

impl Units {
    /// The same for all axes.
    pub(super) const fn all(unit: Unit) -> Self {
        Self([unit; MAX_AXES])
    }

    /// That of an axis, from 0.
    #[must_use]
    pub(crate) const fn of(self, axis: usize) -> Unit {
        self.0[axis]
    }

    /// Those of some axes, in that order, from 0.
    #[must_use]
    pub(super) fn picked(self, axes: &[usize]) -> Self {
        let mut picked = Self::default();
        axes.iter().enumerate().for_each(|(axis, from)| picked.0[axis] = self.0[*from]);
        picked
    }

    /// The word for them in a file: one for all of the axes, or one for each.
    #[must_use]
    pub(crate) fn words(self, axes: usize) -> String {
        let own = &self.0[..axes];
        match own {
            [first, others @ ..] if others.iter().any(|unit| unit != first) => {
                own.iter().map(|unit| unit.name()).collect::<Vec<_>>().join(", ")
            }
            _ => self.0[0].name().to_owned(),
        }
    }
}

/// The unit that a file, or the person who imports it, says the positions have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DeclaredUnit {
    /// Fraction of the stroke, 0 to 1.
    #[default]
    Fraction,
    /// Percent of the stroke, 0 to 100.
    Percent,
    /// Bytes, 0 to 255 over the stroke.
    U8,
    /// Millimetres from the zero of the axis.
    Millimetre,
    /// Degrees from the zero of the axis.
    Degree,
    /// Motor pulses from the zero of the axis.
    Pulse,
}

impl DeclaredUnit {
    /// The unit in memory.
    #[must_use]
    pub(crate) const fn unit(self) -> Unit {
        match self {
            Self::Fraction | Self::Percent | Self::U8 => Unit::Fraction,
            Self::Millimetre => Unit::Millimetre,
            Self::Degree => Unit::Degree,
            Self::Pulse => Unit::Pulse,
        }
    }

    /// The least position in the file that can be right for any seat: below 0 where the zero of an axis may be inside its range.
    #[must_use]
    pub(super) const fn floor(self) -> f64 {
        match self {
            Self::Fraction | Self::Percent | Self::U8 => 0.0,
            Self::Millimetre | Self::Degree | Self::Pulse => -self.ceiling(),
        }
    }

    /// The greatest position in the file that can be right for any seat.
    #[must_use]
    pub(super) const fn ceiling(self) -> f64 {
        match self {
            Self::Fraction => 1.0,
            Self::Percent => 100.0,
            Self::U8 => 255.0,
            Self::Millimetre => MAX_MILLIMETRES,
            Self::Degree => MAX_DEGREES,
            Self::Pulse => MAX_PULSES,
        }
    }

    /// What stands behind a value in a message; nothing for fractions and bytes.
    #[must_use]
    pub(super) const fn suffix(self) -> &'static str {
        match self {
            Self::Percent => " %",
            _ => self.unit().suffix(),
        }
    }

    /// A value of the file in the unit of memory.
    #[must_use]
    pub(super) const fn in_memory(self, value: f64) -> f64 {
        match self {
            Self::Percent => value / 100.0,
            Self::U8 => value / 255.0,
            Self::Fraction | Self::Millimetre | Self::Degree | Self::Pulse => value,
        }
    }
}

/// The text is none of the units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("units are fraction, percent, u8, mm, deg or pulse")]
pub struct UnknownUnit;

impl FromStr for DeclaredUnit {
    type Err = UnknownUnit;

    fn from_str(text: &str) -> Result<Self, UnknownUnit> {
        match text {
            "fraction" => Ok(Self::Fraction),
            "percent" => Ok(Self::Percent),
            "u8" => Ok(Self::U8),
            "mm" => Ok(Self::Millimetre),
            "deg" => Ok(Self::Degree),
            "pulse" => Ok(Self::Pulse),
            _ => Err(UnknownUnit),
        }
    }
}

/// The units that a file declares: one for all of its axes, or one for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct DeclaredUnits {
    each: [DeclaredUnit; MAX_AXES],
    given: usize,
}

impl Default for DeclaredUnits {
    fn default() -> Self {
        Self { each: [DeclaredUnit::default(); MAX_AXES], given: 1 }
    }
}

impl DeclaredUnits {
    /// That of an axis, from 0.
    pub(super) const fn of(&self, axis: usize) -> DeclaredUnit {
        self.each[axis]
    }

    /// The units in memory.
    pub(super) fn units(&self) -> Units {
        Units(self.each.map(DeclaredUnit::unit))
    }

    /// What is wrong with them for a file of so many axes, if anything is.
    pub(super) fn misfit(&self, axes: usize) -> Option<Problem> {
        let allowed = format!("give one unit for all axes, or one for each of the {axes}");
        let value = format!("{} units", self.given);
        (self.given != 1 && self.given != axes).then_some(Problem::Declaration { value, allowed })
    }
}

impl FromStr for DeclaredUnits {
    type Err = UnknownUnit;

    fn from_str(text: &str) -> Result<Self, UnknownUnit> {
        let units: Vec<DeclaredUnit> =
            text.split(',').map(|word| word.trim().parse()).collect::<Result<_, _>>()?;
        let mut each = [DeclaredUnit::default(); MAX_AXES];
        match units[..] {
            [all] => each = [all; MAX_AXES],
            _ => each.iter_mut().zip(&units).for_each(|(axis, unit)| *axis = *unit),
        }
        Ok(Self { each, given: units.len() })
    }
}

/// How the curve runs between the points of a cue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Interpolation {
    /// The C2 cubic spline, not-a-knot at its ends; a parabola through three points, a line through two.
    #[default]
    Spline,
    /// Fritsch-Carlson: never leaves the interval of its neighbours.
    Monotone,
    /// Straight lines.
    Linear,
    /// Each point's value until the next point.
    Hold,
}

impl Interpolation {
    /// The word for it in a cue file.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Spline => "spline",
            Self::Monotone => "monotone",
            Self::Linear => "linear",
            Self::Hold => "hold",
        }
    }
}

/// The text is none of the interpolations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interpolations are spline, monotone, linear or hold")]
pub(crate) struct UnknownInterpolation;

impl FromStr for Interpolation {
    type Err = UnknownInterpolation;

    fn from_str(text: &str) -> Result<Self, UnknownInterpolation> {
        match text {
            "spline" => Ok(Self::Spline),
            "monotone" => Ok(Self::Monotone),
            "linear" => Ok(Self::Linear),
            "hold" => Ok(Self::Hold),
            _ => Err(UnknownInterpolation),
        }
    }
}
