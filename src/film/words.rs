//! Every word about why seats wait for a film, or leave it.

use super::chase::{HoldCause, ParkCause};
use super::point::FilmState;

impl FilmState {
    const fn words(self) -> &'static str {
        match self {
            Self::FreeRunning | Self::Locked => "the film is outside the cue, or has just been found",
            Self::Freewheeling => "no position is received from the film at the moment",
            Self::Absent => "nothing has been received from the film yet",
            Self::Acquiring => "the position of the film is not known well enough yet",
            Self::Stopped => "the film is stopped",
            Self::Ended => "the film is over",
            Self::Jumped => "the film has jumped",
            Self::Reverse => "the film runs backwards",
            Self::Shuttle => "the film runs at a speed that seats may not follow",
            Self::Unusable => "what is received from the film makes no sense, or is too coarse",
            Self::Lost => "no position is received from the film any more",
        }
    }
}

impl FilmState {
    /// What a source says of the film, for somebody who looks at that source alone.
    pub(crate) const fn of_a_source(self) -> &'static str {
        match self {
            Self::FreeRunning | Self::Locked => "the film runs",
            _ => self.words(),
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

    /// What a person does next about the film; that depends on whether seats follow it.
    pub(crate) const fn next(self, is_followed: bool) -> &'static str {
        match self {
            Self::FreeRunning | Self::Locked if is_followed => "nothing; the seats follow it",
            Self::FreeRunning | Self::Locked => "nothing; seats follow it once a person starts the show",
            Self::Freewheeling | Self::Acquiring | Self::Jumped => "wait a moment",
            Self::Absent | Self::Lost => "start the film; check that its source is connected",
            Self::Stopped => "let the film run on",
            Self::Ended => "nothing; start the next show",
            Self::Reverse | Self::Shuttle => "let the film run forward at its speed",
            Self::Unusable => "check what its source sends; allow_coarse permits one that is only coarse",
        }
    }
}

impl HoldCause {
    /// Why the seats wait.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Film(state) => state.words(),
            Self::Apart => "the film was too far from the seats for them to slew to it",
            Self::Unstable => "the seats had to join five times in a minute: check its source, and resume",
            Self::Asks => "each join waits for a person: resume",
        }
    }
}

impl ParkCause {
    /// Why the seats park.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::FilmEnded => "the film is over",
            Self::FilmCutShort => {
                "the film is over, and the seats followed it through only a part of the cue"
            }
            Self::CueLeft => "the film has left the cue",
            Self::HeldTooLong => "the film could not be followed for five minutes",
        }
    }
}
