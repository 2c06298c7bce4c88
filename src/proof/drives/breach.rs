//! What a serial drive would do of a cue that it must not, in words.

use super::Quantity;
use crate::motion::AxisUnit;
use crate::time::ShowTime;

/// Something that a drive would do, or could not.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum DriveBreach {
    /// Counts that no drive of the family has.
    #[error("a SilverMax counts 4000, 8000 or 16000 a turn; pulses_per_rev of seat {seat} is {counts}")]
    Counts {
        /// The seat type.
        seat: String,
        /// What it says.
        counts: f64,
    },
    /// The course of a drive breaks a limit.
    #[error(
        "{} {value:.1} {} at {at}, as a drive at {hz:.1} Hz executes it, is over {limit:.1}, the limit of seat {seat}; lower \
         the level, or raise the rate of the link",
        quantity.name(), quantity.unit(*unit)
    )]
    Motion {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// Which figure.
        quantity: Quantity,
        /// Its greatest size.
        value: f64,
        /// The most that the seat may do.
        limit: f64,
        /// When.
        at: ShowTime,
        /// Rate of the link.
        hz: f64,
        /// The seat type.
        seat: String,
    },
    /// A drive would be too far beside the cue.
    #[error(
        "a drive of seat {seat} at {hz:.1} Hz would be {value:.2} {0} beside the cue at {at}, {limit:.2} are allowed \
         (max_deviation_{0}); it fits at level {1:.0}%, or at a higher rate of the link",
        unit.name(), (100.0 * level).floor()
    )]
    Deviates {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// How far.
        value: f64,
        /// How far it may be.
        limit: f64,
        /// When.
        at: ShowTime,
        /// Rate of the link.
        hz: f64,
        /// The level at which it fits.
        level: f64,
        /// The seat type.
        seat: String,
    },
    /// The course of a drive leaves the stroke.
    #[error(
        "a drive of seat {seat} at {hz:.1} Hz would be at {place:.3} {0} at {at}, outside the stroke, {low} to {high} {0}; keep \
         away from the end, or lower the level",
        unit.name()
    )]
    PastStroke {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// Where it would be.
        place: f64,
        /// The ends of the stroke.
        low: f64,
        /// The upper one.
        high: f64,
        /// When.
        at: ShowTime,
        /// Rate of the link.
        hz: f64,
        /// The seat type.
        seat: String,
    },
    /// A drive whose link dies has no room to brake.
    #[error(
        "if the link died at {at}, a drive of seat {seat} would brake from {speed:.1} {0}/s and stop {missing:.3} {0} outside the \
         stroke; keep away from the end, or lower the level",
        unit.name()
    )]
    NoRoomToBrake {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// How fast it would be.
        speed: f64,
        /// How far outside it would stop.
        missing: f64,
        /// When.
        at: ShowTime,
        /// The seat type.
        seat: String,
    },
    /// The speed of a motor would jump too far.
    #[error(
        "the motor would jump by {value:.0} {0}/s at {at}, {limit:.0} are allowed (jump_{0}_s of seat {seat}); lower the level, \
         or use CAN, a higher baud, or fewer motors a link: it is at {hz:.1} Hz",
        unit.name()
    )]
    Jumps {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// The greatest change of speed at once.
        value: f64,
        /// The most that is allowed.
        limit: f64,
        /// When.
        at: ShowTime,
        /// Rate of the link.
        hz: f64,
        /// The seat type.
        seat: String,
    },
    /// The seat may be faster than its motors.
    #[error("{velocity} {}/s of seat {seat} needs clock_divider {fits} or less, it is {divider}", unit.name())]
    TooFast {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// The greatest speed of the seat.
        velocity: f64,
        /// The divider.
        divider: u8,
        /// The greatest that would do.
        fits: u8,
        /// The seat type.
        seat: String,
    },
    /// Nothing that a motor can be told makes its speed jump so little.
    #[error(
        "at {hz:.1} Hz no propdiv lets a motor at {velocity} {0}/s jump by no more than {jump:.1} {0}/s (jump_{0}_s of seat {seat});          raise the rate of the link, or the jump where the motor takes it",
        unit.name()
    )]
    NoPropdiv {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// The greatest speed of the seat.
        velocity: f64,
        /// The most that the speed may change at once.
        jump: f64,
        /// Rate of the link.
        hz: f64,
        /// The seat type.
        seat: String,
    },
    /// A vibration that a link is too slow for.
    #[error(
        "vibration at {hz:.1} Hz at {at} is too quick for drives at {link:.1} Hz, which swing at {most:.1} Hz at the most; set \
         the level of vibration to 0, or raise the rate of the link"
    )]
    TooQuick {
        /// How often it would swing.
        hz: f64,
        /// How often it may.
        most: f64,
        /// Rate of the link.
        link: f64,
        /// Since when.
        at: ShowTime,
    },
}
