//! Every word about why seats wait for a film, or leave it.

use super::chase::{HoldCause, ParkCause};
use super::point::FilmState;

impl FilmState {
    /// Its stable code, and what it means.
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::FreeRunning | Self::Locked => {
                ("film-outside", "the film is outside the cue, or has just been found")
            }
            Self::Freewheeling => {
                ("film-freewheeling", "no position is received from the film at the moment")
            }
            Self::Absent => ("film-absent", "nothing has been received from the film yet"),
            Self::Acquiring => ("film-acquiring", "the position of the film is not known well enough yet"),
            Self::Stopped => ("film-stopped", "the film is stopped"),
            Self::Ended => ("film-ended", "the film is over"),
            Self::Jumped => ("film-jumped", "the film has jumped"),
            Self::Reverse => ("film-reverse", "the film runs backwards"),
            Self::Shuttle => ("film-shuttle", "the film runs at a speed that seats may not follow"),
            Self::Unusable => {
                ("film-unusable", "what is received from the film makes no sense, or is too coarse")
            }
            Self::Lost => ("film-lost", "no position is received from the film any more"),
        }
    }
}

/// Whom a film leads that can be followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FilmLed {
    /// A show that follows it has not been started, or is paused.
    Nobody,
    /// The same where the hall itself starts the film with its show.
    Own,
    /// Seats wait to be on the cue, or are on their way.
    Joining,
    /// Seats that are on the cue.
    Following,
}

const START_SHOW: (&str, &str) =
    ("start-show", "nothing; seats follow it once a person starts or resumes the show");

impl FilmState {
    /// What a source says of the film, for somebody who looks at that source alone.
    pub(crate) const fn of_a_source(self) -> &'static str {
        match self {
            Self::FreeRunning | Self::Locked => "the film runs",
            _ => self.row().1,
        }
    }
}

impl FilmState {
    /// The word of it for programs.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::FreeRunning => "free-running",
            Self::Absent => "absent",
            Self::Acquiring => "acquiring",
            Self::Locked => "locked",
            Self::Freewheeling => "freewheeling",
            Self::Stopped => "stopped",
            Self::Ended => "ended",
            Self::Jumped => "jumped",
            Self::Reverse => "reverse",
            Self::Shuttle => "shuttle",
            Self::Unusable => "unusable",
            Self::Lost => "lost",
        }
    }

    /// What a person does next about the film, by a stable code and in words; that depends on what its seats do.
    pub(crate) const fn next(self, led: FilmLed) -> (&'static str, &'static str) {
        match self {
            Self::FreeRunning | Self::Locked => match led {
                FilmLed::Following => ("followed", "nothing; the seats follow it"),
                FilmLed::Joining => ("joined", "nothing; the seats join it as soon as it is in the cue"),
                FilmLed::Nobody | FilmLed::Own => START_SHOW,
            },
            Self::Freewheeling | Self::Acquiring | Self::Jumped => ("wait", "wait a moment"),
            Self::Absent | Self::Lost => ("start-film", "start the film; check that its source is connected"),
            Self::Stopped if matches!(led, FilmLed::Own) => START_SHOW,
            Self::Stopped => ("run-on", "let the film run on"),
            Self::Ended => ("next-show", "nothing; start the next show"),
            Self::Reverse | Self::Shuttle => ("run-forward", "let the film run forward at its speed"),
            Self::Unusable => {
                ("check-source", "check what its source sends; allow_coarse permits one that is only coarse")
            }
        }
    }
}

impl HoldCause {
    /// Its stable code, and why the seats wait.
    #[must_use]
    pub(crate) const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::Film(state) => state.row(),
            Self::Apart => ("film-apart", "the film was too far from the seats for them to slew to it"),
            Self::Behind => {
                ("film-behind", "this machine was late, and the seats fell too far behind the film")
            }
            Self::Unstable => (
                "film-unstable",
                "the seats had to join five times in a minute: check the film's source, and resume",
            ),
            Self::Asks => ("film-asks", "each join waits for a person: resume"),
        }
    }
}

impl ParkCause {
    /// Its stable code, and why the seats park.
    #[must_use]
    pub(crate) const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::FilmEnded => ("film-ended", "the film is over"),
            Self::FilmCutShort => (
                "film-cut-short",
                "the film is over, and the seats followed it through only a part of the cue",
            ),
            Self::CueLeft => ("cue-left", "the film has left the cue"),
            Self::HeldTooLong => ("held-too-long", "the film could not be followed for five minutes"),
        }
    }
}
