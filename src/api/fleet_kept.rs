//! The wish of a fleet that the hall keeps. It counts for whose key has signed it, each time anew: the process that brings it has no say.

use super::problem::bad_value;
use super::shared::Shared;
use crate::control::{Code, PlaylistStatus, Problem, Status, Who};
use crate::fleet::{Letter, Wish};
use crate::library::Library;
use crate::state::State;
use crate::sys::clock::wall_now_ns;

/// Keeps a wish that is newer than the one that is kept.
pub(super) fn keep(library: &Library, letter: &Letter, wish: &Wish) -> Result<(), Problem> {
    let text = serde_json::to_string(letter).expect("a letter is text");
    // Whoever signed the one that is kept: a key that is gone leads to no older wish either.
    let kept = library.wish();
    let kept_rev = kept.as_deref().and_then(|kept| {
        let kept = serde_json::from_str(kept).ok()?;
        Wish::of(&kept).ok().map(|wish| wish.rev)
    });
    match kept_rev {
        Some(rev) if wish.rev < rev => {
            let detail =
                format!("the wish, rev {}, is older than the one that the hall keeps, rev {rev}", wish.rev);
            Err(Problem::new(Code::Late, detail, "push again"))
        }
        Some(rev) if wish.rev == rev && kept.as_ref() != Some(&text) => {
            let detail =
                format!("there are two wishes of rev {rev}, and the hall keeps the one that it had first");
            Err(Problem::new(Code::Late, detail, "push again"))
        }
        Some(rev) if wish.rev == rev => Ok(()),
        _ => library.keep_wish(text, |id| wish.cues.contains_key(id)),
    }
}

/// The wish that is kept, and whose it is, where its key still counts.
pub(super) fn kept_wish(shared: &Shared) -> Result<(Who, Wish), Problem> {
    let none = || Problem::new(Code::Unknown, "the fleet wishes nothing of this hall", "push something");
    let kept = shared.library.wish().ok_or_else(none)?;
    let letter = serde_json::from_str(&kept).map_err(|error| bad_value(error.to_string(), "push again"))?;
    shared.fleet.open_wish(&letter, wall_now_ns())
}

/// Whether what is wished comes or goes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Wished {
    Comes,
    Goes,
}

impl Wished {
    /// It has to wait, and why.
    pub(super) fn waits(self, detail: String) -> Result<(), Problem> {
        let remedy = match self {
            Self::Comes => "it comes by itself when that is over",
            Self::Goes => "it goes by itself when that is over",
        };
        Err(Problem::new(Code::State, detail, remedy))
    }

    /// That the hall rests, unarmed, and is about nothing by which another cue or playlist may be loaded than its status says.
    pub(super) fn check_parked(self, status: &Status) -> Result<(), Problem> {
        if status.state != State::Parked {
            return self.waits(format!("the hall is {}", status.state));
        }
        status.job.as_ref().map_or(Ok(()), |job| self.waits(format!("{job} is under way in the hall")))
    }
}

/// The playlist that is loaded, where that names a cue.
pub(super) fn list_with<'s>(status: &'s Status, cue: &str) -> Option<&'s PlaylistStatus> {
    status.playlist.as_ref().filter(|list| list.entries.iter().any(|entry| entry.cue == cue))
}
