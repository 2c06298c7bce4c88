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

impl Next {
    /// Its stable code, and what it says.
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::AwaitAnswers => (
                "await-answers",
                "wait until every controller has answered, or disable the one that does not",
            ),
            Self::AwaitPositions => ("await-positions", "wait until the positions are read, then park"),
            Self::AwaitHome => ("await-home", "wait until the seats are home, and keep clear of them"),
            Self::AwaitRest => ("await-rest", "wait until the seats are at rest"),
            Self::ParkOrHome => ("park-or-home", "park, or home"),
            Self::ParkOrStart => ("park-or-start", "park, or start a show: it joins slowly"),
            Self::Home => {
                ("home", "home, with nobody on the seats; or disable the seat whose position is unknown")
            }

            Self::Load => ("load", "load a cue, then arm"),
            Self::Prove => ("prove", "check the cue against the seats, then arm"),
            Self::Preflight => ("preflight", "run preflight, then arm"),
            Self::Arm => ("arm", "arm"),
            Self::ArmAndHome => ("arm-and-home", "arm, with nobody on the seats: they home first"),
            Self::Go => ("go", "go, or disarm"),
            Self::Watch => ("watch", "nothing; pause, park or stop as needed"),
            Self::AwaitJoin => ("await-join", "nothing; the seats rejoin by themselves"),
            Self::AwaitFilm => (
                "await-film",
                "check the film; the seats join it then, by themselves or when a person resumes (rejoin)",
            ),
            Self::LetJoin => ("let-join", "check the film, then resume; or park"),
            Self::Resume => ("resume", "resume, or park"),
            Self::Release => (
                "release",
                "release the emergency-stop button, then clear; or disable a seat that cannot report it",
            ),

            Self::PutRight => {
                ("put-right", "clear the error at the controller, then clear the hall; or disable its seat")
            }

            Self::AwaitStandstill => {
                ("await-standstill", "wait until the seats stand still, then clear and home")
            }
            Self::CheckCue => ("check-cue", "check the cue against the seats, then clear"),
            Self::LookAtSeat => ("look-at-seat", "inspect the seat, then clear and home again"),
            Self::StopOtherMaster => ("stop-other-master", "stop the other master, then clear"),
            Self::Clear => ("clear", "clear, then park or home"),
            Self::Restart => {
                ("restart", "clear, then park; if the positions are still not read, restart the service")
            }
        }
    }

    /// Its stable code, for programs.
    #[must_use]
    pub(crate) const fn code(self) -> &'static str {
        self.row().0
    }

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

impl fmt::Display for Next {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.row().1)
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
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::Limiter => ("limiter", "the limiter held motion back three times in a second"),
            Self::Planner => ("planner", "a move could not be planned"),
            Self::Deaf => {
                ("deaf", "replies were not read for too long; an emergency stop would have gone unnoticed")
            }
            Self::Alone => (
                "alone",
                "neither the other show machine nor the engine was heard for 0.6 s; the other one may take over",
            ),
            Self::Homing(_) => ("homing", "a seat failed to home"),
            Self::HomingTime => ("homing-time", "homing took too long"),
            Self::ParkingTime => ("parking-time", "parking took too long"),
            Self::OtherMaster(_) => ("other-master", "another master sends frames to a controller"),
        }
    }
}

impl Readiness {
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::NoCue => ("no-cue", "no cue is loaded"),
            Self::NotProved => ("not-proved", "the cue is not proved for these seats"),
            Self::NotPreflighted => ("not-preflighted", "preflight has not passed"),
            Self::Ready => ("ready", "the cue is ready"),
        }
    }
}

impl Cause {
    /// Its stable code, and the cause in words, without the name of whom it speaks of.
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::Started => ("started", "the program has started"),
            Self::Crashed => ("crashed", "the program ended without parking the last time"),
            Self::TookOver => ("took-over", "the other show machine is gone, and its show was under way"),
            Self::AwayFromPark => ("away-from-park", "a seat is not at its park pose"),
            Self::FoundParked => ("found-parked", "all seats that take part were found at their park poses"),
            Self::Asked(request) => asked(request),
            Self::StoppedHoming => (
                "stopped-homing",
                "stopped by the operator; controllers on the network finish their homing by themselves, which only the hard-wired \
                 emergency stop can end",
            ),
            Self::Homed => ("homed", "the seats are home"),
            Self::ArrivedAtPark => ("arrived-at-park", "the seats that take part have parked"),
            Self::ArmLapsed => ("arm-lapsed", "nobody started within ten minutes of arming"),
            Self::NotReady(readiness) => readiness.row(),
            Self::Rebooted(_) => ("rebooted", "a controller has rebooted; its position is unknown"),
            Self::GapOver => ("gap-over", "the seats join after a gap"),
            Self::Joined => ("joined", "the seats that take part are on the cue"),
            Self::Late => ("late", "this machine sent the seats a frame more than 50 ms late"),
            Self::CueEnded => ("cue-ended", "the cue is over"),
            Self::FilmLeads => ("film-leads", "the seats join the film"),
            Self::FilmAwaited(why) => why.row(),
            Self::FilmOver(why) => why.row(),
            Self::PausedTooLong => ("paused-too-long", "nobody resumed for five minutes"),
            Self::GroupOut(_) => ("group-out", "a group of seats is out"),
            Self::EmergencyStop(_) => ("emergency-stop", "emergency stop"),
            Self::Trouble(trouble) => trouble.row(),
            Self::Cleared => ("cleared", "cleared by the operator"),
            Self::Slept => ("slept", "the machine slept, or the program was suspended, for more than 2 s"),
        }
    }

    /// Its stable code, for programs.
    #[must_use]
    pub(crate) const fn code(self) -> &'static str {
        self.row().0
    }

    /// The cause in words, without the name of whom it speaks of.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        self.row().1
    }
}

const fn asked(request: Transition) -> (&'static str, &'static str) {
    match request {
        Transition::Home => ("asked-home", "homed by the operator"),
        Transition::Arm | Transition::HomeAndArm => ("asked-arm", "armed by the operator"),
        Transition::Disarm => ("asked-disarm", "disarmed by the operator"),
        Transition::Go => ("asked-go", "started by the operator"),
        Transition::Pause => ("asked-pause", "paused by the operator"),
        Transition::Resume => ("asked-resume", "resumed by the operator"),
        Transition::Seek => ("asked-seek", "moved to another place by the operator"),
        Transition::Stop => ("asked-stop", "stopped by the operator"),
        Transition::Park => ("asked-park", "parked by the operator"),
        Transition::Clear => ("asked-clear", "cleared by the operator"),
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())
    }
}

impl Why {
    /// Its stable code, and what stands against the request.
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::NotIdentified => ("not-identified", "not every controller has been identified"),
            Self::PositionsNotRead => {
                ("positions-not-read", "the seats' positions have not been read since they stopped")
            }
            Self::PositionUnknown => ("position-unknown", "a controller does not know its position"),
            Self::HomesFirst => {
                ("homes-first", "the seats have to home first, and move over their whole stroke")
            }
            Self::NoCue => Readiness::NoCue.row(),
            Self::NotProved => Readiness::NotProved.row(),
            Self::NotPreflighted => Readiness::NotPreflighted.row(),
            Self::NotArmed => ("not-armed", "the hall is not armed"),
            Self::PlaysAlready => ("plays-already", "the cue is already playing"),
            Self::PausedNow => ("paused-now", "the cue is paused"),
            Self::FilmLeads => ("film-leads", "the film leads"),
            Self::Riding => ("riding", "the cue is under way"),
            Self::NothingPlays => ("nothing-plays", "nothing is playing"),
            Self::HomingNow => ("homing-now", "the seats are homing"),
            Self::ParkingNow => ("parking-now", "the seats are on their way to park"),
            Self::StoppingNow => ("stopping-now", "the seats are coming to rest"),
            Self::Latched => ("latched", "it is latched"),
            Self::SeatsAnywhere => ("seats-anywhere", "the seats may be anywhere"),
            Self::ArmedNow => ("armed-now", "the hall is armed"),
            Self::StillPressed => ("still-pressed", "an emergency stop is still in effect"),
            Self::StillWrong => ("still-wrong", "a controller or a drive still has an error"),
            Self::NothingToClear => ("nothing-to-clear", "there is nothing to clear"),
        }
    }

    /// Its stable code, for programs.
    #[must_use]
    pub(crate) const fn code(self) -> &'static str {
        self.row().0
    }

    /// What stands against the request.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        self.row().1
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
