//! What a fleet brought and wishes to go again: removed only while the hall is parked and unarmed, and never what is loaded, what a playlist
//! that stays names, or what people put there.

use std::collections::{BTreeMap, BTreeSet};

use super::fleet_kept::{Wished, list_with};
use super::fleet_lists::{AllHad, FailedWishes};
use super::input::id;
use super::shared::Shared;
use crate::config::FleetWord;
use crate::control::{Code, Problem, Status, Who};
use crate::fleet::{HadState, Wish, WishHad};
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
    let of = |kind, names: &BTreeSet<String>| {
        let one = |name: &String| {
            let mut had = standing(shared, wish, status, (kind, name))?;
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
    let playlists = wish.drops.playlists.iter().map(|name| (DroppedKind::Playlist, name));
    for one in playlists.chain(wish.drops.cues.iter().map(|name| (DroppedKind::Cue, name))) {
        let (kind, name) = one;
        let standing = standing(shared, wish, &shared.handle.status(), one)?;
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

/// What a failure is kept by.
fn key((kind, name): DroppedFile<'_>) -> String {
    format!("dropped {} {name}", kind.word())
}

/// How the hall stands to a file that shall go; missing is one that may go now.
fn standing(shared: &Shared, wish: &Wish, status: &Status, one: DroppedFile<'_>) -> Result<WishHad, Problem> {
    let (kind, name) = one;
    let of = |state, why: Option<String>| WishHad { state, why, ..WishHad::default() };
    let id = id(name)?;
    let left = match kind {
        DroppedKind::Cue => shared.library.left_there(&id)?,
        DroppedKind::Playlist => shared.shelf.left_there(&id)?,
    };
    Ok(match left {
        LeftThere::Nothing => of(HadState::Ready, None),
        LeftThere::Theirs => {
            let why =
                format!("people of the hall put the {} {id} there, and what is theirs stays", kind.word());
            of(HadState::Refused, Some(why))
        }
        LeftThere::Brought => {
            let may = shared.fleet.check_allowed(&[kind.allowed_as()]);
            match may.and_then(|()| check_unused(shared, wish, one)).and_then(|()| check_rest(status, one)) {
                Ok(()) => of(HadState::Missing, None),
                Err(problem) if problem.code == Code::Role => of(HadState::Refused, Some(problem.detail)),
                Err(problem) => of(HadState::Waiting, Some(problem.detail)),
            }
        }
    })
}

/// That no playlist names a cue that shall go: none of the hall, and none that is still to come.
fn check_unused(shared: &Shared, wish: &Wish, (kind, name): DroppedFile<'_>) -> Result<(), Problem> {
    if kind == DroppedKind::Playlist {
        return Ok(());
    }
    for PlaylistInfo { id, cues, faults, .. } in shared.shelf.list() {
        if !faults.is_empty() {
            return Wished::Goes
                .waits(format!("the playlist {id} has faults, and nobody knows whether it names {name}"));
        }
        if cues.contains(name) {
            return Wished::Goes.waits(format!("the playlist {id} names it"));
        }
    }
    let names_it = |id: &str, text: &str| {
        let playlist = id.parse::<Id>().ok().and_then(|id| shared.shelf.read_wished(&id, text).ok());
        playlist.is_some_and(|playlist: Playlist| playlist.cues().any(|cue| cue.to_string() == *name))
    };
    match wish.playlists.iter().find(|(id, playlist)| names_it(id, &playlist.text)) {
        Some((id, _)) => Wished::Goes.waits(format!("the playlist {id}, which is wished, names it")),
        None => Ok(()),
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
