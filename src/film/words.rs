//! Every word about why seats wait for a film, or leave it.

use super::chase::{HoldCause, ParkCause};
use super::point::FilmState;

impl FilmState {
    const fn words(self) -> &'static str {
        match self {
            Self::FreeRunning | Self::Locked => "the film is outside the cue, or was found a moment ago",
            Self::Freewheeling => "nothing is heard of the film at the moment",
            Self::Absent => "nothing has been heard of the film yet",
            Self::Acquiring => "where the film is, is not known well enough yet",
            Self::Stopped => "the film is stopped",
            Self::Ended => "the film is over",
            Self::Jumped => "the film has jumped",
            Self::Reverse => "the film runs backwards",
            Self::Shuttle => "the film runs at a speed that the seats may not follow",
            Self::Unusable => "what is heard of the film makes no sense, or is too coarse",
            Self::Lost => "nothing is heard of the film any more",
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
            Self::FreeRunning | Self::Locked => "nothing; seats follow it once a person has let the show go",
            Self::Freewheeling | Self::Acquiring | Self::Jumped => "wait a moment",
            Self::Absent | Self::Lost => "start the film; see that its source is connected",
            Self::Stopped => "let the film go on",
            Self::Ended => "nothing; let the next show go",
            Self::Reverse | Self::Shuttle => "let the film run forward at its speed",
            Self::Unusable => "see what its source sends; allow_coarse allows one that is merely coarse",
        }
    }
}

impl HoldCause {
    /// Why the seats wait.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Film(state) => state.words(),
            Self::Apart => "the film was further away from the seats than they slew to it",
            Self::Unstable => "the seats had to join five times in a minute: see to its source, and resume",
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
                "the film is over, and the seats have followed it through a part of the cue alone"
            }
            Self::CueLeft => "the film has left the cue",
            Self::HeldTooLong => "the film could not be followed for five minutes",
        }
    }
}
