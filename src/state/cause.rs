//! Why a hall is in the state it is in.

use super::{Readiness, Transition};
use crate::film::chase::{HoldCause, ParkCause};

/// Why a hall is in the state it is in. Its words are [`Cause::words`]; which controller or group they speak of is
/// [`Cause::whose`], for whoever knows the names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Cause {
    /// The program started.
    Started,
    /// The program ended without parking the last time.
    Crashed,
    /// The other show machine died with a show under way.
    TookOver,
    /// A seat is not at its park pose.
    AwayFromPark,
    /// All seats are at their park poses.
    FoundParked,
    /// A person asked for it.
    Asked(Transition),
    /// A person asked for a stop while the controllers homed, which no frame can end.
    StoppedHoming,
    /// The seats are home.
    Homed,
    /// The seats are at their park poses again.
    ArrivedAtPark,
    /// Nobody started for ten minutes after arming.
    ArmLapsed,
    /// What was armed is no longer what is loaded and proved.
    NotReady(Readiness),
    /// This controller has rebooted or was reset.
    Rebooted(usize),
    /// A gap is over; the seats join.
    GapOver,
    /// The seats are on the cue.
    Joined,
    /// A frame came more than 50 ms late.
    Late,
    /// The cue is over.
    CueEnded,
    /// A pause took more than five minutes.
    PausedTooLong,
    /// This group of seats is out, and the configuration says what the hall does then.
    GroupOut(usize),
    /// An emergency stop at this controller.
    EmergencyStop(usize),
    /// Something is wrong.
    Trouble(Trouble),
    /// A person cleared it.
    Cleared,
    /// No tick came for more than two seconds: the machine or the program slept.
    Slept,
    /// The seats have left the film that they chased.
    FilmOver(ParkCause),
    /// They wait for it.
    FilmAwaited(HoldCause),
    /// They join it.
    FilmLeads,
}

/// Something that no play goes on with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Trouble {
    /// The limiter held motion back three times in a second.
    Limiter,
    /// A move could not be planned.
    Planner,
    /// Replies are no longer read: nobody would hear of an emergency stop.
    Deaf,
    /// Neither the other show machine of the hall nor the engine was heard: the other one may take over.
    Alone,
    /// A controller did not get home.
    Homing(usize),
    /// Homing took too long.
    HomingTime,
    /// Parking took too long.
    ParkingTime,
    /// Another master sends frames to this controller.
    OtherMaster(usize),
}

/// What a cause speaks of, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Whose {
    /// A controller.
    Controller(usize),
    /// A group of seats.
    Group(usize),
}

impl Cause {
    /// True for the end of a show that was played to its end: the cue's, or that of a film that led it through the cue.
    pub(crate) const fn completes(self) -> bool {
        matches!(self, Self::CueEnded | Self::FilmOver(ParkCause::FilmEnded))
    }

    /// Which controller or group it speaks of; `None` if it is the whole hall.
    #[must_use]
    pub(crate) const fn whose(self) -> Option<Whose> {
        match self {
            Self::Rebooted(controller) | Self::EmergencyStop(controller) => {
                Some(Whose::Controller(controller))
            }
            Self::GroupOut(group) => Some(Whose::Group(group)),
            Self::Trouble(trouble) => trouble.whose(),
            _ => None,
        }
    }
}

impl Trouble {
    const fn whose(self) -> Option<Whose> {
        match self {
            Self::Homing(controller) | Self::OtherMaster(controller) => Some(Whose::Controller(controller)),
            Self::Limiter
            | Self::Planner
            | Self::Deaf
            | Self::Alone
            | Self::HomingTime
            | Self::ParkingTime => None,
        }
    }
}
