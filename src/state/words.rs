//! Every word about states, causes, next actions and refusals, once: report, console and API take theirs from here.

use std::borrow::Cow;
use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Cause, Next, PlayMode, Readiness, Refusal, State, Transition, Trouble, Why};
use crate::plain;

/// Without --config or --to the command would ask the service.
const HOME_BY_COMMAND: &str =
    "quit, then `kinocue home` with this --config or --to, with nobody on the seats";

impl State {
    /// The state in one word, as every surface shows it.
    #[must_use]
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Boot => "boot",
            Self::Recovering => "recovering",
            Self::Parked => "parked",
            Self::Homing => "homing",
            Self::Armed => "armed",
            Self::Playing(PlayMode::Waiting) => "waiting",
            Self::Playing(PlayMode::Joining) => "joining",
            Self::Playing(PlayMode::Following) => "playing",
            Self::Playing(PlayMode::Holding) => "holding",
            Self::Paused => "paused",
            Self::Stopping => "stopping",
            Self::Stopped => "stopped",
            Self::Parking => "parking",
            Self::Fault => "fault",
        }
    }
}

impl Serialize for State {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(self.word())
    }
}

impl<'de> Deserialize<'de> for State {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let word = Cow::<str>::deserialize(from)?;
        let known = Self::ALL.into_iter().find(|state| state.word() == word);
        known.ok_or_else(|| D::Error::custom(format_args!("{word:?} is no state")))
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

plain::displayed!(Transition {
    Self::Home => "home",
    Self::Arm => "arm",
    Self::HomeAndArm => "home and arm",
    Self::Disarm => "disarm",
    Self::Go => "go",
    Self::Pause => "pause",
    Self::Resume => "resume",
    Self::Seek => "seek",
    Self::Stop => "stop",
    Self::Park => "park",
    Self::Clear => "clear",
});

plain::displayed!(Next {
    Self::AwaitAnswers =>
        "wait until every controller has answered, or disable the one that does not",
    Self::AwaitPositions => "wait until the positions are read, then park",
    Self::AwaitHome => "wait until the seats are home, and keep clear of them",
    Self::AwaitRest => "wait until the seats are at rest",
    Self::ParkOrHome => "park, or home",
    Self::ParkOrStart => "park, or start a show: it joins slowly",
    Self::Home => "home, with nobody on the seats; or disable the seat whose position is unknown",

    Self::Load => "load a cue, then arm",
    Self::Prove => "check the cue against the seats, then arm",
    Self::Preflight => "run preflight, then arm",
    Self::Arm => "arm",
    Self::ArmAndHome => "arm, with nobody on the seats: they home first",
    Self::Go => "go, or disarm",
    Self::Watch => "nothing; pause, park or stop as needed",
    Self::AwaitJoin => "nothing; the seats rejoin by themselves",
    Self::AwaitFilm => "check the film; the seats join it then, by themselves or when a person resumes (rejoin)",
    Self::LetJoin => "check the film, then resume; or park",
    Self::Resume => "resume, or park",
    Self::Release =>
        "release the emergency-stop button, then clear; or disable a seat that cannot report it",

    Self::PutRight => "clear the error at the controller, then clear the hall; or disable its seat",

    Self::AwaitStandstill => "wait until the seats stand still, then clear and home",
    Self::CheckCue => "check the cue against the seats, then clear",
    Self::LookAtSeat => "inspect the seat, then clear and home again",
    Self::StopOtherMaster => "stop the other master, then clear",
    Self::Clear => "clear, then park or home",
    Self::Restart =>
        "clear, then park; if the positions are still not read, restart the service",
});

impl Next {
    /// The same where a play in the foreground is led by keys, which neither home nor take out a seat.
    #[must_use]
    pub(crate) const fn by_keys(self) -> Option<&'static str> {
        Some(match self {
            Self::Home | Self::ArmAndHome => HOME_BY_COMMAND,
            Self::ParkOrHome => "park",
            Self::Release => "release the emergency-stop button, then clear",
            Self::PutRight => "clear the error at the controller, then clear the hall",
            Self::AwaitAnswers => "wait until every controller has answered, or quit",
            Self::StopOtherMaster => "stop the other master, then quit and start the play again",
            Self::Clear => "clear, then park",
            Self::Restart => "quit, then start the play again",
            _ => return None,
        })
    }
}

impl Refusal {
    /// The same where a play in the foreground is led by keys, which neither home nor take out a seat.
    #[must_use]
    pub(crate) fn by_keys(&self) -> String {
        let remedy = match self.why {
            Why::PositionUnknown | Why::HomesFirst => HOME_BY_COMMAND,
            Why::StillPressed => "release its button",
            Why::StillWrong => "clear the error at the controller",
            Why::NotIdentified => "wait until they answer, or quit",
            why => why.remedy(),
        };
        format!("cannot {} while {}: {}; {remedy}", self.asked, self.state, self.why.words())
    }
}

impl Trouble {
    const fn words(self) -> &'static str {
        match self {
            Self::Limiter => "the limiter held motion back three times in a second",
            Self::Planner => "a move could not be planned",
            Self::Deaf => "replies were not read for too long; an emergency stop would have gone unnoticed",
            Self::Homing(_) => "a seat failed to home",
            Self::HomingTime => "homing took too long",
            Self::ParkingTime => "parking took too long",
            Self::OtherMaster(_) => "another master sends frames to a controller",
        }
    }
}

impl Readiness {
    const fn words(self) -> &'static str {
        match self {
            Self::NoCue => "no cue is loaded",
            Self::NotProved => "the cue is not proved for these seats",
            Self::NotPreflighted => "preflight has not passed",
            Self::Ready => "the cue is ready",
        }
    }
}

impl Cause {
    /// The cause in words, without the name of whom it speaks of.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Started => "the program has started",
            Self::Crashed => "the program ended without parking the last time",
            Self::AwayFromPark => "a seat is not at its park pose",
            Self::FoundParked => "all seats were found at their park poses",
            Self::Asked(request) => asked(request),
            Self::StoppedHoming => {
                "stopped by the operator; the controllers finish their homing by themselves, which only the hard-wired \
                 emergency stop can end"
            }
            Self::Homed => "the seats are home",
            Self::ArrivedAtPark => "the seats have parked",
            Self::ArmLapsed => "nobody started within ten minutes of arming",
            Self::NotReady(readiness) => readiness.words(),
            Self::Rebooted(_) => "a controller has rebooted; its position is unknown",
            Self::GapOver => "the seats join after a gap",
            Self::Joined => "the seats are on the cue",
            Self::Late => "a frame came more than 50 ms late",
            Self::CueEnded => "the cue is over",
            Self::FilmLeads => "the seats join the film",
            Self::FilmAwaited(why) => why.words(),
            Self::FilmOver(why) => why.words(),
            Self::PausedTooLong => "the pause lasted more than five minutes",
            Self::GroupOut(_) => "a group of seats is out",
            Self::EmergencyStop(_) => "emergency stop",
            Self::Trouble(trouble) => trouble.words(),
            Self::Cleared => "cleared by the operator",
            Self::Slept => "the machine slept, or the program was suspended, for more than 2 s",
        }
    }
}

const fn asked(request: Transition) -> &'static str {
    match request {
        Transition::Home => "homed by the operator",
        Transition::Arm | Transition::HomeAndArm => "armed by the operator",
        Transition::Disarm => "disarmed by the operator",
        Transition::Go => "started by the operator",
        Transition::Pause => "paused by the operator",
        Transition::Resume => "resumed by the operator",
        Transition::Seek => "moved to another place by the operator",
        Transition::Stop => "stopped by the operator",
        Transition::Park => "parked by the operator",
        Transition::Clear => "cleared by the operator",
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())
    }
}

impl Why {
    /// What stands against the request.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::NotIdentified => "not every controller has been identified",
            Self::PositionsNotRead => "the seats' positions have not been read since they stopped",
            Self::PositionUnknown => "a controller does not know its position",
            Self::HomesFirst => "the seats have to home first, and move over their whole stroke",
            Self::NoCue => Readiness::NoCue.words(),
            Self::NotProved => Readiness::NotProved.words(),
            Self::NotPreflighted => Readiness::NotPreflighted.words(),
            Self::NotArmed => "the hall is not armed",
            Self::PlaysAlready => "the cue is already playing",
            Self::PausedNow => "the cue is paused",
            Self::FilmLeads => "the film leads",
            Self::Riding => "the cue is under way",
            Self::NothingPlays => "nothing is playing",
            Self::HomingNow => "the seats are homing",
            Self::ParkingNow => "the seats are on their way to park",
            Self::StoppingNow => "the seats are coming to rest",
            Self::Latched => "it is latched",
            Self::SeatsAnywhere => "the seats may be anywhere",
            Self::ArmedNow => "the hall is armed",
            Self::StillPressed => "an emergency stop is still in effect",
            Self::StillWrong => "a controller or a drive still has an error",
            Self::NothingToClear => "there is nothing to clear",
        }
    }

    /// What would have to be done first.
    #[must_use]
    pub(crate) const fn remedy(self) -> &'static str {
        match self {
            Self::NotIdentified => "wait until they answer, or disable the seat that does not",
            Self::PositionsNotRead => "wait until the controllers have answered",
            Self::PositionUnknown => "home first, with nobody on the seats, or disable that seat",
            Self::HomesFirst => {
                "see that the seats are empty, then arm with --seats-empty (seats_empty in the API)"
            }
            Self::NoCue => "load one",
            Self::NotProved => "check it against the seats",
            Self::NotPreflighted => "run it, after correcting what it found",
            Self::NotArmed => "arm first",
            Self::PlaysAlready => "seek to another position in it",
            Self::PausedNow => "resume, or park first",
            Self::FilmLeads => "seek in the film: the seats follow it",
            Self::Riding => "park first",
            Self::NothingPlays => "arm and go",
            Self::HomingNow => "wait until they are home",
            Self::ParkingNow => "wait until they are there",
            Self::StoppingNow => "wait, then clear",
            Self::Latched => "clear it first",
            Self::SeatsAnywhere => "park or home first",
            Self::ArmedNow => "disarm first",
            Self::StillPressed => {
                "release its button; where none is pressed, reset the controller, or disable a seat that cannot report it"
            }
            Self::StillWrong => "clear the error at the controller, or disable its seat",
            Self::NothingToClear => "go on",
        }
    }
}
