//! What a cue does that it must not, in words.

mod drives;

pub(crate) use drives::{DriveBreach, LinkBreach, OnDrive, OverLimit};

use std::time::Duration;

use crate::cue::Place;
use crate::motion::AxisUnit;
use crate::time::ShowTime;

/// One limit that is broken, and where in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Violation {
    /// The row that stands at or before the worst of it.
    pub(crate) place: Place,
    /// The column of the file that it is about, or nothing.
    pub(crate) column: String,
    /// What is broken.
    pub(crate) breach: Breach,
}

impl std::fmt::Display for Violation {
    /// The place and what is broken, to be put behind the file's name and a colon.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}{}", self.place, self.message())
    }
}

impl Violation {
    /// True if links of the hall are what it is about: no change of amplitude is looked for then.
    #[must_use]
    pub(crate) const fn is_of_links(&self) -> bool {
        matches!(self.breach, Breach::OnLink(_) | Breach::TooSlow { .. })
    }

    /// What is broken, with the column that it is about.
    #[must_use]
    pub(crate) fn message(&self) -> String {
        match self.column.as_str() {
            "" => self.breach.to_string(),
            column => format!("{column}: {}", self.breach),
        }
    }
}

/// A figure of motion that has a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// Distance over Time.
    Velocity,
    /// Change of velocity from one frame to the next.
    Step,
    /// Change of velocity over Time.
    Acceleration,
    /// Change of acceleration over Time.
    Jerk,
}

impl Quantity {
    /// What people call it.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Step => "change of velocity from frame to frame",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
        }
    }

    /// Its unit on an axis that is measured in `axis`.
    #[must_use]
    pub(crate) const fn unit(self, axis: AxisUnit) -> &'static str {
        match (self, axis) {
            (Self::Velocity | Self::Step, AxisUnit::Millimetre) => "mm/s",
            (Self::Velocity | Self::Step, AxisUnit::Degree) => "deg/s",
            (Self::Acceleration, AxisUnit::Millimetre) => "mm/s²",
            (Self::Acceleration, AxisUnit::Degree) => "deg/s²",
            (Self::Jerk, AxisUnit::Millimetre) => "mm/s³",
            (Self::Jerk, AxisUnit::Degree) => "deg/s³",
        }
    }
}

/// A limit that is broken.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum Breach {
    /// An axis moves faster, or more roughly, than its seat may.
    #[error(
        "{} {value:.1} {} at {at} is over {limit:.1}, the limit of seat {seat} ({from} to {until})",
        quantity.name(), quantity.unit(*unit)
    )]
    Motion {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// Which figure.
        quantity: Quantity,
        /// Its greatest size in this stretch, in its unit.
        value: f64,
        /// The most that the seat may do, in the same unit.
        limit: f64,
        /// The seat type.
        seat: String,
        /// When it is worst.
        at: ShowTime,
        /// Since when it is over the limit.
        from: ShowTime,
        /// Until when.
        until: ShowTime,
    },
    /// Vibration takes an axis past an end of its stroke.
    #[error(
        "vibration of {amplitude:.3} {0} about {position:.3} {0} at {at} leaves the stroke of seat {seat}, {low} to {high} {0}; \
         lower the amplitude, or stay away from the end", unit.name()
    )]
    VibrationPastStroke {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// How far it swings to either side.
        amplitude: f64,
        /// Where the axis stands.
        position: f64,
        /// The ends of the stroke.
        low: f64,
        /// The upper one.
        high: f64,
        /// The seat type.
        seat: String,
        /// When it is worst.
        at: ShowTime,
    },
    /// The cue is too short to be judged, or to be meant.
    #[error(
        "the cue lasts only {length}; if its times are in seconds, name their column time_s; motion is judged over {least} and more"
    )]
    TooShort {
        /// How long it lasts.
        length: ShowTime,
        /// The least that differences need.
        least: ShowTime,
    },
    /// The cue ends in motion, and the stroke has no room to come to rest.
    #[error(
        "the cue ends at {at} in motion, {velocity:.1} {0}/s at {position:.3} {0}, and needs {missing:.3} {0} more than \
         the stroke, {low} to {high} {0}, to come to rest within the limits of seat {seat}; end more slowly, or further from the end", unit.name()
    )]
    NoRoomToRest {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// How fast the axis is at the last row.
        velocity: f64,
        /// Where it is then.
        position: f64,
        /// How far it would leave the stroke.
        missing: f64,
        /// The ends of the stroke.
        low: f64,
        /// The upper one.
        high: f64,
        /// The seat type.
        seat: String,
        /// When the cue ends.
        at: ShowTime,
    },
    /// The cue ends in such motion that every way to rest breaks a limit.
    #[error(
        "the cue ends at {at} in motion, {velocity:.1} {}/s, and the gentlest way to rest from there takes {} {value:.1} {}, over \
         {limit:.1}, the limit of seat {seat}; let the motion end more gently",
        unit.name(), quantity.name(), quantity.unit(*unit)
    )]
    TooRoughToRest {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// How fast the axis is at the last row.
        velocity: f64,
        /// Which figure is over its limit.
        quantity: Quantity,
        /// What it comes to, in its unit.
        value: f64,
        /// The most that the seat may do, in the same unit.
        limit: f64,
        /// The seat type.
        seat: String,
        /// When the cue ends.
        at: ShowTime,
    },
    /// Motion and vibration together move an axis faster, or harder, than its seat may.
    #[error(
        "vibration of {amplitude:.3} {} at {hz:.1} Hz, {shaken:.1} {per_s} of {}, on motion of {moved:.1} {per_s} is over \
         {limit:.1} {per_s} in all, the limit of seat {seat}, at {at}; lower the amplitude or the frequency",
        unit.name(), quantity.name(), per_s = quantity.unit(*unit)
    )]
    Shaken {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// Velocity or acceleration.
        quantity: Quantity,
        /// How far it swings to either side.
        amplitude: f64,
        /// How often, as controllers execute it.
        hz: f64,
        /// What the vibration alone comes to.
        shaken: f64,
        /// What motion alone comes to while it vibrates.
        moved: f64,
        /// The most that both may come to.
        limit: f64,
        /// The seat type.
        seat: String,
        /// Since when it vibrates so.
        at: ShowTime,
    },
    /// An effect is switched off too soon.
    #[error(
        "on at {at} for {on:?}, which may be {sent:?} in frames; at least {least:?} is needed (min_on_ms)"
    )]
    OnTooShort {
        /// When it goes on.
        at: ShowTime,
        /// How long it is on in the cue.
        on: Duration,
        /// The shortest that frames can make of it.
        sent: Duration,
        /// The least that it needs.
        least: Duration,
    },
    /// An effect is left on too long.
    #[error(
        "on at {at} for {on:?}, which may be {sent:?} in frames; at most {most:?} is allowed (max_on_ms)"
    )]
    OnTooLong {
        /// When it goes on.
        at: ShowTime,
        /// How long it is on in the cue.
        on: Duration,
        /// The longest that frames can make of it.
        sent: Duration,
        /// The most that it stands.
        most: Duration,
    },
    /// An effect is on for too much of the time.
    #[error(
        "on for {:.1} % of the {window:?} from {from} on; at most {:.1} % is allowed (max_duty)", 100.0 * duty, 100.0 * most
    )]
    DutyTooHigh {
        /// Where the busiest window begins.
        from: ShowTime,
        /// How long the window is.
        window: Duration,
        /// The part of it that the effect is on.
        duty: f64,
        /// The most that it stands.
        most: f64,
    },
    /// The seat may move faster than its controller lets it.
    #[error(
        "axes may turn {rpm:.0} rpm (PA07), {ceiling:.1} {0}/s at a lead of {lead} {0}; seat {seat} goes up to {wanted} {0}/s; \
         allow {needed:.0} rpm and say so in max_rpm, or lower max_velocity_{0}_s of the seat type", unit.name()
    )]
    SpeedCeiling {
        /// What the axis is measured in.
        unit: AxisUnit,
        /// The seat type.
        seat: String,
        /// The controller's own limit, turns a minute.
        rpm: f64,
        /// The same.
        ceiling: f64,
        /// Travel per turn.
        lead: f64,
        /// The seat's limit.
        wanted: f64,
        /// Turns a minute that the seat's limit takes.
        needed: f64,
    },
    /// Frames are farther apart than the longest Time that the controller executes as it is.
    #[error(
        "PA0b = {most}: frames of the show, of {frame} ms, are cut to {most} ms and become faster; set PA0b and max_interval_ms \
         of seat {seat} to {frame} or more, or raise the rate"
    )]
    Interval {
        /// The seat type.
        seat: String,
        /// PA0b, ms.
        most: u32,
        /// The longest Time of the show's frames, ms.
        frame: u32,
    },
    /// Serial drives would not execute it as they must.
    #[error(transparent)]
    Drive(#[from] DriveBreach),
    /// The drives on a link of the hall would not.
    #[error(transparent)]
    OnLink(Box<LinkBreach>),
    /// A link is to play more often than it can.
    #[error("{why}")]
    TooSlow {
        /// Which, why, and what would fit.
        why: String,
    },
}
