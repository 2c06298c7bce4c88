//! Requests that are not taken, with what would have to be done first.

use super::{State, Transition};

/// Why a request was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[error("cannot {asked} while {state}: {}; {}", why.words(), why.remedy())]
pub struct Refusal {
    /// The state it met.
    pub(crate) state: State,
    /// What was asked.
    pub asked: Transition,
    /// Why not.
    pub why: Why,
}

/// What stands against a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Why {
    /// Not every controller has said what it is.
    NotIdentified,
    /// Where the seats stand was not read since they stopped.
    PositionsNotRead,
    /// A controller does not know its position.
    PositionUnknown,
    /// A controller does not know its position, and nobody said that the seats are empty.
    HomesFirst,
    /// No cue is loaded.
    NoCue,
    /// The cue is not proved.
    NotProved,
    /// Preflight has not passed.
    NotPreflighted,
    /// The hall is not armed.
    NotArmed,
    /// The cue plays already.
    PlaysAlready,
    /// The cue is paused.
    PausedNow,
    /// A film is chased.
    FilmLeads,
    /// The cue plays, or is paused.
    Riding,
    /// Nothing plays.
    NothingPlays,
    /// Homing is under way.
    HomingNow,
    /// Parking is under way.
    ParkingNow,
    /// The seats decelerate.
    StoppingNow,
    /// The hall is stopped, or there is a fault.
    Latched,
    /// The seats may be anywhere.
    SeatsAnywhere,
    /// The hall is armed.
    ArmedNow,
    /// An emergency stop is still in effect.
    StillPressed,
    /// A controller or a drive still has an error.
    StillWrong,
    /// There is nothing to clear.
    NothingToClear,
}
