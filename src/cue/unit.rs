//! The unit of a cue's positions, and what a file may declare it to be.

use std::str::FromStr;

use super::limits::{MAX_MILLIMETRES, MAX_PULSES};
use crate::motion::{AxisGeometry, AxisUnit, SeatType, Slot};

/// The unit that positions and vibration amplitudes have in memory, counted from the stroke's lower end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Unit {
    /// Fraction of the stroke, 0 to 1.
    #[default]
    Fraction,
    /// Millimetres.
    Millimetre,
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
            Self::Pulse => "pulse",
        }
    }

    /// True if the places of an axis can be told in this unit.
    #[must_use]
    pub(crate) fn suits(self, axis: &AxisGeometry) -> bool {
        match self {
            Self::Fraction | Self::Pulse => true,
            Self::Millimetre => axis.unit == AxisUnit::Millimetre,
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
            Self::Millimetre => axis.stroke(),
            Self::Pulse => axis.stroke_pulses(),
        }
    }

    /// Between which positions in this unit the axis can be.
    #[must_use]
    pub(crate) fn ends(self, axis: &AxisGeometry) -> (f64, f64) {
        match self {
            Self::Fraction => (0.0, 1.0),
            Self::Millimetre => (axis.low, axis.high),
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
            Self::Pulse => " pulses",
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
    /// Millimetres from the stroke's lower end.
    Millimetre,
    /// Motor pulses from the stroke's lower end.
    Pulse,
}

impl DeclaredUnit {
    /// The unit in memory.
    #[must_use]
    pub(crate) const fn unit(self) -> Unit {
        match self {
            Self::Fraction | Self::Percent | Self::U8 => Unit::Fraction,
            Self::Millimetre => Unit::Millimetre,
            Self::Pulse => Unit::Pulse,
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
            Self::Fraction | Self::Millimetre | Self::Pulse => value,
        }
    }
}

/// The text is none of the units.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("units are fraction, percent, u8, mm or pulse")]
pub struct UnknownUnit;

impl FromStr for DeclaredUnit {
    type Err = UnknownUnit;

    fn from_str(text: &str) -> Result<Self, UnknownUnit> {
        match text {
            "fraction" => Ok(Self::Fraction),
            "percent" => Ok(Self::Percent),
            "u8" => Ok(Self::U8),
            "mm" => Ok(Self::Millimetre),
            "pulse" => Ok(Self::Pulse),
            _ => Err(UnknownUnit),
        }
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
