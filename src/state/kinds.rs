//! What the state machine is told and what it says: plain values, all of them `Copy`.

use std::time::Duration;

use super::cause::{Cause, Trouble};
use crate::film::chase::{HoldCause, ParkCause};

/// Where a hall stands (DESIGN: boot, parked, homing, armed, playing and so on).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum State {
    /// Nothing is known of the controllers; nothing moves.
    Boot,
    /// The seats may be anywhere; nothing moves until a person parks or homes them.
    Recovering,
    /// The seats are at their park poses, at rest.
    Parked,
    /// The controllers home by themselves; no motion frame is sent.
    Homing,
    /// Ready to go, for ten minutes.
    Armed,
    /// The seats move with the cue.
    Playing(PlayMode),
    /// The seats hold; after its hold frames nothing is sent.
    Paused,
    /// The seats decelerate, to [`State::Stopped`] or to [`State::Fault`].
    Stopping,
    /// Stopped by a person, or by an emergency stop; latched until a person clears it.
    Stopped,
    /// The seats move to their park poses.
    Parking,
    /// Something is wrong; latched until a person clears it.
    Fault,
}

/// How seats move with the cue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PlayMode {
    /// On their way onto the moving cue.
    Joining,
    /// On the cue.
    Following,
    /// They hold after a gap, and will join again by themselves.
    Holding,
    /// The film that is chased cannot be followed: they rest, at park or where they are, and will join by themselves.
    Waiting,
}

impl State {
    /// Every state there is, in the order of a show.
    pub(crate) const ALL: [Self; 14] = [
        Self::Boot,
        Self::Recovering,
        Self::Parked,
        Self::Homing,
        Self::Armed,
        Self::Playing(PlayMode::Waiting),
        Self::Playing(PlayMode::Joining),
        Self::Playing(PlayMode::Following),
        Self::Playing(PlayMode::Holding),
        Self::Paused,
        Self::Parking,
        Self::Stopping,
        Self::Stopped,
        Self::Fault,
    ];

    /// How long it lasts at the most, where that is why; `None` if it does not end by itself.
    #[must_use]
    pub(crate) fn lasts(self, cause: Cause) -> Option<Duration> {
        Some(match self {
            // As a pause does: whoever sat there has got up.
            Self::Recovering if cause == Cause::TookOver => super::PAUSED_FOR,
            Self::Armed => super::ARMED_FOR,
            Self::Paused => super::PAUSED_FOR,
            Self::Homing => super::HOMING_FOR,
            Self::Stopping => super::STOPPING_FOR,
            Self::Parking => super::PARKING_FOR,
            _ => return None,
        })
    }

    /// True if motion frames may leave.
    #[must_use]
    pub const fn may_send_motion(self) -> bool {
        matches!(self, Self::Playing(_) | Self::Paused | Self::Stopping | Self::Parking)
    }

    /// True if only a person gets the hall out of it.
    #[must_use]
    pub(crate) const fn is_latched(self) -> bool {
        matches!(self, Self::Stopped | Self::Fault)
    }
}

/// What a person can ask for. Who it is, and whether they may, is settled before it comes here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Transition {
    /// Let the controllers find their zero. The seats move over their whole stroke by themselves: whoever asks has made
    /// sure that nobody sits on them.
    Home,
    /// Make ready to go. Refused where a position is unknown: nothing moves by this.
    Arm,
    /// The same, and where a position is unknown the seats are homed first, as [`Transition::Home`] does it and under the same
    /// condition.
    HomeAndArm,
    /// No longer ready to go.
    Disarm,
    /// Start the cue.
    Go,
    /// Decelerate and hold.
    Pause,
    /// Go on after a pause.
    Resume,
    /// Go on somewhere else in the cue.
    Seek,
    /// Decelerate and stay so until cleared. Always taken.
    Stop,
    /// Move to the park poses.
    Park,
    /// Leave stopped or fault.
    Clear,
}

impl Transition {
    /// Every request there is.
    pub const ALL: [Self; 11] = [
        Self::Home,
        Self::Arm,
        Self::HomeAndArm,
        Self::Disarm,
        Self::Go,
        Self::Pause,
        Self::Resume,
        Self::Seek,
        Self::Stop,
        Self::Park,
        Self::Clear,
    ];
}

/// True if a cue can be armed, as far as files, limits and preflight tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Readiness {
    /// No cue is loaded.
    NoCue,
    /// The cue is not proved to stay within the limits of these seats at this level and speed.
    NotProved,
    /// Preflight has not passed.
    NotPreflighted,
    /// All of it is there.
    Ready,
}

/// What the configuration asks of the hall when a group is out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Demand {
    /// All hold.
    Pause,
    /// All park.
    Park,
}

/// What the engine and the observers tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// Every controller that takes part has said what it is and where its seat stands.
    Identified(Finding),
    /// The positions of all seats were read (again).
    PositionsRead,
    /// True if a seat that frames may go to rests elsewhere than at park.
    Astray(bool),
    /// A controller has rebooted or was reset: its position is unknown until it is homed. Counted from 0.
    Rebooted(usize),
    /// What is loaded and proved has changed.
    Readiness(Readiness),
    /// All seats are home.
    Homed,
    /// A join begins after a gap.
    JoinBegun,
    /// All seats are on the cue.
    Joined,
    /// A frame came more than 50 ms late; the seats hold.
    Late,
    /// The cue is over, with all its repeats.
    CueEnded,
    /// The film that is chased can be followed.
    FilmLeads,
    /// It cannot.
    FilmAwaited(HoldCause),
    /// There is nothing more of it to follow.
    FilmOver(ParkCause),
    /// The seats have decelerated, and the hold frames are out.
    AtRest,
    /// The seats are at their park poses.
    Parked,
    /// The configuration's policy, and the group of seats that it is for, counted from 0.
    Policy(Demand, usize),
    /// An emergency stop is in effect at this controller, counted from 0.
    EmergencyStop(usize),
    /// No controller reports an emergency stop any more.
    AllReleased,
    /// No tick came for so long: the machine slept, or the program was held.
    Slept(Duration),
    /// Something is wrong.
    Trouble(Trouble),
    /// True if controllers that take part stand stopped or in error, and wait for a person to clear them.
    Latched(Latch),
    /// Every controller that takes part knows its position again: the one that did not was homed, or is out.
    ZerosKnown,
}

/// True if controllers that take part are held by an emergency stop or an error, whatever the hall is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Latch {
    /// None is.
    #[default]
    Free,
    /// One is, and what holds it goes on.
    Held,
    /// What held them is over; they wait until it is cleared.
    Over,
}

/// What was found when the controllers were first asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Finding {
    /// All of them know their zero (DPF0 reads 2).
    pub homed: bool,
    /// All seats are at their park poses.
    pub at_park: bool,
    /// How it ended before.
    pub before: LedBefore,
}

/// How the program ended that led the hall before this one started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum LedBefore {
    /// In order.
    #[default]
    Ended,
    /// Without parking: the mark that a start leaves and an orderly end takes away was there, or another machine led.
    Crashed,
    /// The other show machine died with a show under way, which may be gone on with.
    OnCue,
}

impl Finding {
    /// The state that a start leads to, and why.
    pub(super) const fn leads_to(self) -> (State, Cause) {
        match self {
            Self { before: LedBefore::OnCue, .. } => (State::Recovering, Cause::TookOver),
            Self { before: LedBefore::Crashed, .. } => (State::Recovering, Cause::Crashed),
            Self { at_park: false, .. } => (State::Recovering, Cause::AwayFromPark),
            Self { .. } => (State::Parked, Cause::FoundParked),
        }
    }
}
