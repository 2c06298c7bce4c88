//! What a serial drive would do of a cue that it must not, in words.

use super::Quantity;
use crate::motion::AxisUnit;
use crate::time::ShowTime;

/// On what seat, at what rate of its link, and when.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OnDrive {
    /// What the axis is measured in; so is all that is told of it.
    pub(crate) unit: AxisUnit,
    /// The seat type.
    pub(crate) seat: String,
    /// Segments or targets of an axis, a second.
    pub(crate) hz: f64,
    /// When it is worst.
    pub(crate) at: ShowTime,
}

/// Something that has a limit, and is over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OverLimit {
    /// Its greatest size.
    pub(crate) value: f64,
    /// The most that is allowed.
    pub(crate) limit: f64,
}

/// Something that a drive would do, or could not.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum DriveBreach {
    /// Counts that no drive of the family has.
    #[error("a SilverMax has 4000, 8000 or 16000 counts per turn; pulses_per_rev of seat {seat} is {counts}")]
    Counts { seat: String, counts: f64 },
    /// The course of a drive breaks a limit.
    #[error(
        "{name} {:.1} {per_s} at {}, as a drive at {:.1} Hz executes it, is over {:.1}, the limit of seat {}; lower the level, or \
         raise the rate of the link",
        over.value, on.at, on.hz, over.limit, on.seat, name = quantity.name(), per_s = quantity.unit(on.unit)
    )]
    Motion { on: OnDrive, quantity: Quantity, over: OverLimit },
    /// A drive would be too far beside the cue; with the level at which it fits.
    #[error(
        "a drive of seat {} at {:.1} Hz would be {:.2} {unit} off the cue at {}, {:.2} are allowed (max_deviation_{unit}); it fits \
         at level {percent:.0}%, or at a higher rate of the link",
        on.seat, on.hz, over.value, on.at, over.limit, unit = on.unit.name(), percent = (100.0 * level).floor()
    )]
    Deviates { on: OnDrive, over: OverLimit, level: f64 },
    /// The course of a drive leaves the stroke.
    #[error(
        "a drive of seat {} at {:.1} Hz would be at {place:.3} {unit} at {}, outside the stroke, {low} to {high} {unit}; keep away from \
         the end, or lower the level",
        on.seat, on.hz, on.at, unit = on.unit.name()
    )]
    PastStroke { on: OnDrive, place: f64, low: f64, high: f64 },
    /// A drive whose link dies has no room to brake.
    #[error(
        "if the link died at {}, a drive of seat {} would brake from {speed:.1} {unit}/s and stop {missing:.3} {unit} outside the stroke; \
         keep away from the end, or lower the level",
        on.at, on.seat, unit = on.unit.name()
    )]
    NoRoomToBrake { on: OnDrive, speed: f64, missing: f64 },
    /// The speed of a motor would jump too far.
    #[error(
        "the motor would jump by {:.0} {unit}/s at {}, {:.0} are allowed (jump_{unit}_s of seat {}); lower the level, or use CAN, a higher \
         baud, or fewer motors a link: it is at {:.1} Hz",
        over.value, on.at, over.limit, on.seat, on.hz, unit = on.unit.name()
    )]
    Jumps { on: OnDrive, over: OverLimit },
    /// The seat may be faster than its motors, which would take a smaller divider of their clock.
    #[error("{velocity} {}/s of seat {} {}", on.unit.name(), on.seat, needed(*fits, *divider))]
    TooFast { on: OnDrive, velocity: f64, divider: u8, fits: Option<u8> },
    /// Nothing that a motor can be told makes its speed jump so little.
    #[error(
        "at {:.1} Hz no propdiv lets a motor at {velocity} {unit}/s jump by no more than {jump:.1} {unit}/s (jump_{unit}_s of seat {}); raise \
         the rate of the link, or the jump if the motor can take it",
        on.hz, on.seat, unit = on.unit.name()
    )]
    NoPropdiv { on: OnDrive, velocity: f64, jump: f64 },
    /// A vibration that a link is too slow for.
    #[error(
        "vibration at {hz:.1} Hz at {} is too fast for drives at {:.1} Hz, which follow at most {most:.1} Hz; set the level of \
         vibration of such seats to 0, or raise the rate of the link",
        on.at, on.hz
    )]
    TooQuick { on: OnDrive, hz: f64, most: f64 },
    /// The cue begins or ends in motion, where a seat that is led ahead stands.
    #[error(
        "the cue {edge} at {} in motion, {speed:.1} {unit}/s, and drives are led ahead: there they would stand at its {row} row; let it          {} at rest", on.at, edge.trim_end_matches('s'), unit = on.unit.name()
    )]
    InMotion { on: OnDrive, edge: &'static str, row: &'static str, speed: f64 },
}

/// What drives on a link of a hall would do of a cue that they must not.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("link {link}, {controllers}: {breach}{remedy}")]
pub(crate) struct LinkBreach {
    pub(crate) link: String,
    /// Their names.
    pub(crate) controllers: String,
    pub(crate) breach: DriveBreach,
    /// What was proved to mend it; may be empty.
    pub(crate) remedy: String,
}

impl DriveBreach {
    /// True if a link with a higher rate may mend it.
    #[must_use]
    pub(crate) const fn is_of_rate(&self) -> bool {
        !matches!(
            self,
            Self::Counts { .. } | Self::TooFast { .. } | Self::NoRoomToBrake { .. } | Self::InMotion { .. }
        )
    }

    /// The part of its level at which it fits, as far as it goes by the level.
    #[must_use]
    pub(crate) fn part_that_fits(&self) -> Option<f64> {
        match self {
            Self::Motion { over, .. } | Self::Deviates { over, .. } | Self::Jumps { over, .. } => {
                Some(over.limit / over.value)
            }
            _ => None,
        }
    }
}

/// What a divider would have to be, if any would do.
fn needed(fits: Option<u8>, divider: u8) -> String {
    fits.map_or_else(
        || "is more than a SIXpack 2 makes with any clock_divider; lower its max_velocity".to_owned(),
        |fits| format!("needs clock_divider {fits} or less, it is {divider}"),
    )
}
