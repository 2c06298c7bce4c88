//! What a fleet brought and wishes to go again: removed only while the hall is parked and unarmed, and never what is loaded, what a playlist
//! that stays names, or what people put there.

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

use super::fleet_kept::{Wished, list_with};
use super::fleet_lists::{AllHad, FailedWishes};
use super::input::id;
use super::shared::Shared;
use crate::config::FleetWord;
use crate::control::{Code, Problem, Status, Who};
use crate::fleet::{Drops, HadState, Wish, WishHad};
use crate::library::{Id, LeftThere};
use crate::log::{Line, Priority};
use crate::playlist::{Playlist, PlaylistInfo};

/// What may be dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DroppedKind {
    Cue,
    Playlist,
}

/// A file that shall go.
type DroppedFile<'a> = (DroppedKind, &'a String);

impl DroppedKind {
    const fn word(self) -> &'static str {
        match self {
            Self::Cue => "cue",
            Self::Playlist => "playlist",
        }
    }

    const fn allowed_as(self) -> FleetWord {
        match self {
            Self::Cue => FleetWord::Cues,
            Self::Playlist => FleetWord::Playlists,
        }
    }
}

/// How far the hall is with what shall go: cues, then playlists.
pub(super) fn had(
    shared: &Shared,
    wish: &Wish,
    status: &Status,
    failed: &FailedWishes,
) -> Result<[AllHad; 2], Problem> {
    let named = Named::new(shared, wish);
    let of = |kind, names: &BTreeSet<String>| {
        let one = |name: &String| {
            let mut had = standing(shared, &named, status, (kind, name))?;
            if let Some(problem) = failed.get(&key((kind, name))).filter(|_| had.state == HadState::Missing) {
                (had.state, had.why) = (HadState::Waiting, Some(problem.to_string()));
            }
            Ok((name.clone(), had))
        };
        names.iter().map(one).collect::<Result<BTreeMap<_, _>, Problem>>()
    };
    Ok([of(DroppedKind::Cue, &wish.drops.cues)?, of(DroppedKind::Playlist, &wish.drops.playlists)?])
}

/// Removes what may go now, playlists first, since a cue stays for as long as one names it.
pub(super) fn drop_all(
    shared: &Shared,
    who: &Who,
    wish: &Wish,
    failed: &mut FailedWishes,
) -> Result<(), Problem> {
    let playlists: Vec<_> = wish.drops.playlists.iter().map(|name| (DroppedKind::Playlist, name)).collect();
    let cues: Vec<_> = wish.drops.cues.iter().map(|name| (DroppedKind::Cue, name)).collect();
    drop_each(shared, who, wish, &playlists, failed)?;
    drop_each(shared, who, wish, &cues, failed)
}

fn drop_each(
    shared: &Shared,
    who: &Who,
    wish: &Wish,
    files: &[DroppedFile<'_>],
    failed: &mut FailedWishes,
) -> Result<(), Problem> {
    let named = Named::new(shared, wish);
    for &one in files {
        let (kind, name) = one;
        let standing = standing(shared, &named, &shared.handle.status(), one)?;
        if standing.state != HadState::Missing {
            continue;
        }
        let id = id(name)?;
        let may = || check_rest(&shared.handle.status(), one);
        let dropped = match kind {
            DroppedKind::Cue => shared.library.drop_brought(&id, may),
            DroppedKind::Playlist => {
                let _changing = shared.library.changing();
                shared.shelf.drop_brought(&id, may)
            }
        };
        match dropped {
            Ok(()) => {
                let word = kind.word();
                let text =
                    format!("the {word} {id}, which the fleet brought, is gone, as {} wishes", who.name);
                shared.log.say(Line::new(Priority::Notice, "fleet-drop", text).with(word, name.clone()));
            }
            Err(problem) => drop(failed.insert(key(one), problem)),
        }
    }
    Ok(())
}

/// What of a wish shall go and is not there, where it was not to go before: nobody had it.
pub(super) fn absent(shared: &Shared, wish: &Wish, before: &Drops) -> Result<BTreeSet<String>, Problem> {
    let cues = wish.drops.cues.iter().map(|name| ((DroppedKind::Cue, name), before.cues.contains(name)));
    let playlists = wish.drops.playlists.iter();
    let playlists = playlists.map(|name| ((DroppedKind::Playlist, name), before.playlists.contains(name)));
    let mut absent = BTreeSet::new();
    for (one, was_to_go) in cues.chain(playlists) {
        let is_absent = match was_to_go {
            true => shared.library.was_absent(&key(one)),
            false => left_there(shared, one)? == LeftThere::Nothing,
        };
        absent.extend(is_absent.then(|| key(one)));
    }
    Ok(absent)
}

fn left_there(shared: &Shared, (kind, name): DroppedFile<'_>) -> Result<LeftThere, Problem> {
    let id = id(name)?;
    match kind {
        DroppedKind::Cue => shared.library.left_there(&id),
        DroppedKind::Playlist => shared.shelf.left_there(&id),
    }
}

/// What a failure is kept by.
fn key((kind, name): DroppedFile<'_>) -> String {
    format!("dropped {} {name}", kind.word())
}

/// How the hall stands to a file that shall go; missing is one that may go now.
fn standing(
    shared: &Shared,
    named: &Named<'_>,
    status: &Status,
    one: DroppedFile<'_>,
) -> Result<WishHad, Problem> {
    let (kind, name) = one;
    let of = |state, why: Option<String>| WishHad { state, why, ..WishHad::default() };
    let id = id(name)?;
    Ok(match left_there(shared, one)? {
        LeftThere::Nothing => {
            let was_absent = shared.library.was_absent(&key(one));
            of(HadState::Ready, was_absent.then(|| format!("there was no {} {id}", kind.word())))
        }
        LeftThere::Theirs => {
            let why =
                format!("people of the hall put the {} {id} there, and what is theirs stays", kind.word());
            of(HadState::Refused, Some(why))
        }
        LeftThere::Brought => {
            let may = shared.fleet.check_allowed(&[kind.allowed_as()]);
            match may.and_then(|()| named.check_unused(one)).and_then(|()| check_rest(status, one)) {
                Ok(()) => of(HadState::Missing, None),
                Err(problem) if problem.code == Code::Role => of(HadState::Refused, Some(problem.detail)),
                Err(problem) => of(HadState::Waiting, Some(problem.detail)),
            }
        }
    })
}

/// The cues that playlists name, those of the hall and those that are still to come. They are read once for all cues that shall go, and
/// only where one is there.
struct Named<'s> {
    shared: &'s Shared,
    wish: &'s Wish,
    read: OnceCell<Result<CuesNamed, Problem>>,
}

/// Which playlist names a cue, and why that is so of any cue.
#[derive(Debug, Default)]
struct CuesNamed {
    by: BTreeMap<String, String>,
    any: Option<String>,
}

impl<'s> Named<'s> {
    fn new(shared: &'s Shared, wish: &'s Wish) -> Self {
        Self { shared, wish, read: OnceCell::new() }
    }

    /// That no playlist names a cue that shall go.
    fn check_unused(&self, (kind, name): DroppedFile<'_>) -> Result<(), Problem> {
        if kind == DroppedKind::Playlist {
            return Ok(());
        }
        let CuesNamed { by, any } = self.read.get_or_init(|| self.read()).as_ref().map_err(Problem::clone)?;
        match by.get(name).or(any.as_ref()) {
            Some(why) => Wished::Goes.waits(why.clone()),
            None => Ok(()),
        }
    }

    fn read(&self) -> Result<CuesNamed, Problem> {
        let mut named = CuesNamed::default();
        for PlaylistInfo { id, cues, faults, .. } in self.shared.shelf.all()? {
            if !faults.is_empty() {
                named.any =
                    Some(format!("the playlist {id} has faults, and nobody knows which cues it names"));
            }
            named.by.extend(cues.into_iter().map(|cue| (cue, format!("the playlist {id} names it"))));
        }
        for (name, wished) in &self.wish.playlists {
            let id = name.parse::<Id>().ok();
            let playlist = id.and_then(|id| self.shared.shelf.read_wished(&id, &wished.text).ok());
            for cue in playlist.iter().flat_map(Playlist::cues) {
                let why = || format!("the playlist {name}, which is wished, names it");
                named.by.entry(cue.to_string()).or_insert_with(why);
            }
        }
        Ok(named)
    }
}

/// That the hall rests, unarmed, and has not loaded it.
fn check_rest(status: &Status, (kind, name): DroppedFile<'_>) -> Result<(), Problem> {
    Wished::Goes.check_parked(status)?;
    match kind {
        DroppedKind::Cue if status.show.as_ref().is_some_and(|show| show.cue == *name) => {
            Wished::Goes.waits(format!("{name} is loaded"))
        }
        DroppedKind::Cue => match list_with(status, name) {
            Some(list) => Wished::Goes.waits(format!("the playlist {}, which is loaded, names it", list.id)),
            None => Ok(()),
        },
        DroppedKind::Playlist if status.playlist.as_ref().is_some_and(|list| list.id == *name) => {
            Wished::Goes.waits(format!("{name} is loaded"))
        }
        DroppedKind::Playlist => Ok(()),
    }
}
