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
            Self::Unusable => "what is heard of the film makes no sense",
            Self::Lost => "nothing is heard of the film any more",
        }
    }
}

impl HoldCause {
    /// Why the seats wait.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Film(state) => state.words(),
            Self::Apart => "the film was more than 40 ms away from the seats",
            Self::Unstable => {
                "the seats had to join five times in a minute: its source is not to be relied on"
            }
            Self::Asks => "each join waits for a person",
        }
    }
}

impl ParkCause {
    /// Why the seats park.
    #[must_use]
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::FilmEnded => "the film is over",
            Self::CueLeft => "the film has left the cue",
            Self::HeldTooLong => "the film could not be followed for five minutes",
        }
    }
}
