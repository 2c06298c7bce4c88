//! The wish of a fleet that the hall keeps. It counts for whose key has signed it, each time anew: the process that brings it has no say.

use std::collections::BTreeSet;

use super::fleet_access::is_of_now;
use super::problem::bad_value;
use super::shared::Shared;
use crate::control::{Code, PlaylistStatus, Problem, Status, Who};
use crate::fleet::{Drops, Letter, Wish};
use crate::library::Library;
use crate::state::State;
use crate::sys::clock::wall_now_ns;

/// Keeps a wish that is newer than the one that is kept; `absent` says what of it shall go and is not there, by what was to go before.
pub(super) fn keep(
    library: &Library,
    letter: &Letter,
    wish: &Wish,
    absent: impl FnOnce(&Drops) -> Result<BTreeSet<String>, Problem>,
) -> Result<(), Problem> {
    let text = serde_json::to_string(letter).expect("a letter is text");
    match check_newer(library.wish().as_deref(), &text, wish.rev)? {
        Newer::IsKept => Ok(()),
        Newer::Than(before) => {
            let absent = absent(&before.map(|wish| wish.drops).unwrap_or_default())?;
            library.keep_wish(text, |id| wish.cues.contains_key(id), absent)
        }
    }
}

/// What a wish that comes is to the one that is kept.
#[derive(Debug, PartialEq)]
enum Newer {
    IsKept,
    /// What was kept before, if anything was.
    Than(Option<Wish>),
}

fn check_newer(kept: Option<&str>, text: &str, rev: u64) -> Result<Newer, Problem> {
    let before = kept.and_then(wish_of);
    // One that is of more than a day from now counts no more: the clock was wrong when it came.
    let counts = before.as_ref().map(|wish| wish.rev).filter(|rev| is_of_now(*rev, wall_now_ns()));
    let late = |detail| Err(Problem::new(Code::Late, detail, "push again"));
    match counts {
        Some(kept) if rev < kept => {
            late(format!("the wish, rev {rev}, is older than the one that the hall keeps, rev {kept}"))
        }
        Some(same) if rev == same && kept != Some(text) => {
            late(format!("there are two wishes of rev {rev}, and the hall keeps the one that it had first"))
        }
        Some(same) if rev == same => Ok(Newer::IsKept),
        _ => Ok(Newer::Than(before)),
    }
}

/// The wish of a text that is kept, whoever signed it: a key that is gone leads to no older wish either.
fn wish_of(kept: &str) -> Option<Wish> {
    Wish::of(&serde_json::from_str(kept).ok()?).ok()
}

/// The rev of the wish that is kept, whether it still counts or not; 0 if none is.
pub(super) fn kept_rev(library: &Library) -> u64 {
    library.wish().as_deref().and_then(wish_of).map_or(0, |wish| wish.rev)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn letter(rev: u64) -> String {
        let body = format!("{{\"to\":\"berlin.h3\",\"rev\":{rev},\"cues\":{{}}}}");
        let letter = Letter { key: String::new(), sig: String::new(), body };
        serde_json::to_string(&letter).unwrap()
    }

    #[test]
    fn a_wish_that_is_older_than_the_kept_one_is_refused_unless_that_is_of_a_clock_that_was_wrong() {
        let now = wall_now_ns() / 1_000_000;
        let newer = |kept: Option<u64>, rev: u64| {
            let newer = check_newer(kept.map(letter).as_deref(), &letter(rev), rev);
            newer.map(|newer| newer == Newer::IsKept).map_err(|problem| problem.code)
        };
        assert_eq!(newer(None, now), Ok(false));
        assert_eq!(newer(Some(now), now), Ok(true), "the same once more");
        assert_eq!([newer(Some(now - 1), now), newer(Some(now), now - 1)], [Ok(false), Err(Code::Late)]);
        assert_eq!(newer(Some(now + 3_600_000), now), Err(Code::Late), "of an hour from now");
        assert_eq!(newer(Some(now + 3 * 86_400_000), now), Ok(false), "of the day after tomorrow");
        let other = letter(now).replace("berlin", "bern");
        assert_eq!(check_newer(Some(&other), &letter(now), now).unwrap_err().code, Code::Late);
    }

    #[test]
    fn a_hall_that_is_parked_and_loads_something_changes_nothing() {
        let mut status = Status { state: State::Parked.into(), ..Status::default() };
        assert_eq!(Wished::Comes.check_parked(&status), Ok(()));
        for (job, wished) in [("loading", Wished::Comes), ("playlist", Wished::Goes), ("test", Wished::Comes)]
        {
            status.job = Some(job.to_owned());
            let problem = wished.check_parked(&status).unwrap_err();
            assert_eq!(problem.detail, format!("{job} is under way in the hall"));
        }
        let armed = Status { state: State::Armed.into(), ..Status::default() };
        assert!(Wished::Comes.check_parked(&armed).is_err());
    }
}
