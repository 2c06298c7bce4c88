//! Playlists that a fleet wishes, into the folder of playlists: only while the hall is parked and unarmed, none that is loaded, and none in
//! the place of what people put there. They are checked as those that people load; loading one is a thing of people alone.

use std::collections::{BTreeMap, BTreeSet};

use jiff::Timestamp;
use jiff::tz::TimeZone;

use super::fleet_kept::Wished;
use super::input::id;
use super::problem::bad_value;
use super::shared::Shared;
use crate::config::{Config, FleetWord};
use crate::control::{Code, Problem, Status, Who};
use crate::fleet::{HadState, Wish, WishHad, WishedPlaylist};
use crate::journal::stamp;
use crate::library::{CueInfo, Proved};
use crate::log::{Line, Priority};
use crate::playlist::{Playlist, PlaylistId, WishedText, theirs};
use crate::sys::clock::wall_now_ns;

/// What the hall has, by ids.
pub(super) type AllHad = BTreeMap<String, WishHad>;
/// Why something could not be done of a wish when that was tried last.
pub(super) type FailedWishes = BTreeMap<String, Problem>;

/// The hall for which playlists are checked.
struct ListChecker<'a> {
    shared: &'a Shared,
    status: &'a Status,
    config: Result<Config, Problem>,
    /// The cues of the library.
    known: BTreeMap<String, CueInfo>,
    /// The cues of the same wish.
    wished: &'a AllHad,
}

/// That it can be a playlist, by its id and its time.
pub(super) fn check_playlist(text: &str, playlist: &WishedPlaylist) -> Result<(), Problem> {
    id(text)?;
    time(playlist).map(drop)
}

/// From when on the hall shall have it.
fn time(playlist: &WishedPlaylist) -> Result<Timestamp, Problem> {
    let from = i64::try_from(playlist.from_ms).ok().and_then(|ms| Timestamp::from_millisecond(ms).ok());
    from.ok_or_else(|| bad_value(format!("{} is no time", playlist.from_ms), "wish for it again"))
}

/// What the hall has of the playlists of a wish; `cues` is what it has of its cues.
pub(super) fn had(
    shared: &Shared,
    wish: &Wish,
    cues: &AllHad,
    status: &Status,
    failed: &FailedWishes,
) -> Result<AllHad, Problem> {
    let mut all = standings(shared, wish, cues, status)?;
    for (name, had) in all.iter_mut().filter(|(_, had)| had.state == HadState::Missing) {
        if let Some(problem) = failed.get(name) {
            (had.state, had.why) = (HadState::Waiting, Some(problem.to_string()));
        }
    }
    Ok(all)
}

/// Takes in the playlists of a wish that may come now; notes why one of them did not.
pub(super) fn bring(
    shared: &Shared,
    who: &Who,
    wish: &Wish,
    cues: &AllHad,
    failed: &mut FailedWishes,
) -> Result<(), Problem> {
    let all = standings(shared, wish, cues, &shared.handle.status())?;
    for (name, _) in all.iter().filter(|(_, had)| had.state == HadState::Missing) {
        let id = id(name)?;
        let may = || check_rest(&shared.handle.status(), &id);
        let _changing = shared.library.changing();
        match shared.shelf.bring(&id, &wish.playlists[name].text, may) {
            Ok(()) => {
                let text = format!("the playlist {id} was brought by the fleet, as {} wishes", who.name);
                shared
                    .log
                    .say(Line::new(Priority::Notice, "fleet-playlist", text).with("playlist", name.clone()));
            }
            Err(problem) => drop(failed.insert(name.clone(), problem)),
        }
    }
    Ok(())
}

fn standings(shared: &Shared, wish: &Wish, cues: &AllHad, status: &Status) -> Result<AllHad, Problem> {
    if wish.playlists.is_empty() {
        return Ok(AllHad::new());
    }
    let known = shared.library.list().into_iter().map(|info| (info.id.clone(), info)).collect();
    let checker = ListChecker { shared, status, config: shared.library.config(), known, wished: cues };
    let one =
        |(name, wished): (&String, &WishedPlaylist)| Ok((name.clone(), checker.standing(name, wished)?));
    wish.playlists.iter().map(one).collect()
}

impl ListChecker<'_> {
    fn standing(&self, name: &str, wished: &WishedPlaylist) -> Result<WishHad, Problem> {
        let (id, from, file) = (id(name)?, time(wished)?, wished.file());
        let of = |state, why: String| WishHad::new(&file, state, Some(why));
        let refused = |detail, faults| WishHad { faults, ..of(HadState::Refused, detail) };
        if let Err(problem) = self.shared.fleet.check_allowed(&[FleetWord::Playlists]) {
            return Ok(of(HadState::Refused, problem.detail));
        }
        let standing = self.shared.shelf.standing(&id, &wished.text)?;
        if standing == WishedText::Theirs {
            return Ok(of(HadState::Refused, theirs(&id).to_string()));
        }
        let playlist = match self.shared.shelf.read_wished(&id, &wished.text) {
            Ok(playlist) => playlist,
            Err(problem) => return Ok(refused(problem.detail, problem.faults)),
        };
        let config = match &self.config {
            Ok(config) => config,
            Err(problem) => return Ok(of(HadState::Waiting, problem.detail.clone())),
        };
        if let Some(why) = self.waits(&playlist) {
            return Ok(of(HadState::Waiting, why));
        }
        let faults = playlist.check_by(config, |cue| self.examine(&cue.to_string()));
        if !faults.is_empty() {
            let faults = faults.iter().map(ToString::to_string).collect();
            return Ok(refused(format!("the playlist {id} cannot be played"), faults));
        }
        if standing == WishedText::There {
            return Ok(WishHad::new(&file, HadState::Ready, None));
        }
        if u128::from(wished.from_ms) * 1_000_000 > u128::from(wall_now_ns()) {
            let from = stamp(&from.to_zoned(TimeZone::system()));
            return Ok(of(HadState::Due, format!("it comes at {from}")));
        }
        Ok(match check_rest(self.status, &id) {
            Ok(()) => WishHad::new(&file, HadState::Missing, None),
            Err(problem) => of(HadState::Waiting, problem.detail),
        })
    }

    /// Which of its cues is on its way, or was not looked at yet, if one is.
    fn waits(&self, playlist: &Playlist) -> Option<String> {
        let cues: BTreeSet<_> = playlist.cues().map(ToString::to_string).collect();
        cues.iter().find_map(|cue| match (self.wished.get(cue), self.known.get(cue)) {
            (Some(had), _) if !had.is_settled() => Some(format!("its cue {cue} is not there yet")),
            (_, Some(info)) if info.proof == Proved::Unknown => {
                Some(format!("its cue {cue} was not checked yet"))
            }
            _ => None,
        })
    }

    /// What is known of a cue. One that the same wish names, and that is refused, is not played by another of its name.
    fn examine(&self, cue: &str) -> Result<CueInfo, Problem> {
        if self.wished.get(cue).is_some_and(|had| had.state == HadState::Refused) {
            let detail = format!("the cue {cue} that is wished is refused");
            return Err(Problem::new(Code::Check, detail, "kinocue fleet have says why"));
        }
        let unknown = || {
            let known = self.known.keys().map(String::as_str);
            Problem::unknown("cue", cue, known, "push it to this hall, or name another")
        };
        self.known.get(cue).cloned().ok_or_else(unknown)
    }
}

/// That the hall rests, unarmed, and has not loaded that playlist.
fn check_rest(status: &Status, id: &PlaylistId) -> Result<(), Problem> {
    Wished::Comes.check_parked(status)?;
    let id = id.to_string();
    match status.playlist.as_ref().filter(|list| list.id == id) {
        Some(_) => Wished::Comes.waits(format!("{id} is loaded, and stays until another is, or none")),
        None => Ok(()),
    }
}
