//! The files of cues that a fleet wishes, into the library. They come only while the hall is parked and unarmed, and nothing that is loaded
//! changes.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json as JsonReply;
use axum::extract::{Request, State};

use super::cues::receive;
use super::fleet_kept::{Wished, kept_wish, list_with};
use super::input::{Id, id};
use super::shared::Shared;
use crate::config::FleetWord;
use crate::control::{Code, Problem, Status, Who};
use crate::fleet::{HadState, Wish, WishHad, WishedCue};
use crate::library::{CueId, CueInfo, StandingOfCue, theirs};
use crate::log::{Line, Priority};

/// Takes the file of a cue that is wished, checked and proved as any upload is.
pub(super) async fn take(
    State(shared): State<Arc<Shared>>,
    Id(id): Id,
    request: Request,
) -> Result<JsonReply<CueInfo>, Problem> {
    let (of_blocking, wanted) = (Arc::clone(&shared), id.clone());
    let (who, cue, replaces) = shared.blocking(move || may_come(&of_blocking, &wanted)).await?;
    let of_finish = Arc::clone(&shared);
    let info = receive(&shared, id.clone(), request, move |upload, awaited| {
        // The hall may be another by the time that it is proved.
        let may = || check_rest(&of_finish.handle.status(), &id, replaces);
        let info = upload.finish_wished(Some(awaited), &id, &cue.sha256, may)?;
        let text = format!("the cue {id} was brought by the fleet, as {} wishes", who.name);
        of_finish.log.say(Line::new(Priority::Notice, "fleet-cue", text).with("cue", id.to_string()));
        Ok(info)
    });
    info.await
}

/// Whose wish a cue is, its file, and whether that takes the place of another; why it may not come now.
fn may_come(shared: &Shared, id: &CueId) -> Result<(Who, WishedCue, bool), Problem> {
    let (who, mut wish) = kept_wish(shared)?;
    shared.fleet.check_allowed(&[FleetWord::Cues])?;
    let cue = wish.cues.remove(&id.to_string()).ok_or_else(|| {
        let detail = format!("no wish names the cue {id}");
        Problem::new(Code::Unknown, detail, "push it")
    })?;
    match shared.library.standings(&[(id.clone(), &cue.sha256)])?.as_slice() {
        [StandingOfCue::Missing { replaces }] => {
            check_rest(&shared.handle.status(), id, *replaces)?;
            Ok((who, cue, *replaces))
        }
        [StandingOfCue::Theirs] => Err(theirs(id)),
        _ => {
            let detail = format!("the cue {id} is there, or was refused, or is being checked");
            Err(Problem::new(Code::State, detail, "GET /api/v1/fleet/wish says which"))
        }
    }
}

/// That it can be a cue, by its id and its length.
pub(super) fn check_cue(text: &str, cue: &WishedCue, most: u64) -> Result<(), Problem> {
    id(text)?;
    if cue.bytes > most {
        let detail = format!("{text} has {} bytes, more than the {most} that the library takes", cue.bytes);
        return Err(Problem::new(Code::Size, detail, "make it smaller, or raise max_cue_mib in [library]"));
    }
    Ok(())
}

/// That the hall rests, unarmed, and has not loaded what would be replaced.
fn check_rest(status: &Status, id: &CueId, replaces: bool) -> Result<(), Problem> {
    Wished::Comes.check_parked(status)?;
    let id = id.to_string();
    if status.show.as_ref().is_some_and(|show| show.cue == id) {
        return Wished::Comes.waits(format!("{id} is loaded"));
    }
    match list_with(status, &id).filter(|_| replaces) {
        Some(list) => Wished::Comes.waits(format!("the playlist {}, which has {id}, is loaded", list.id)),
        None => Ok(()),
    }
}

/// What the hall has of the cues of a wish.
pub(super) fn had(
    shared: &Shared,
    wish: &Wish,
    status: &Status,
) -> Result<BTreeMap<String, WishHad>, Problem> {
    let ids = wish.cues.iter().map(|(name, cue)| Ok((id(name)?, cue.sha256.as_str())));
    let ids = ids.collect::<Result<Vec<_>, Problem>>()?;
    let standings = shared.library.standings(&ids)?;
    let is_allowed = shared.fleet.check_allowed(&[FleetWord::Cues]);
    let mut all = BTreeMap::new();
    for ((standing, (id, _)), (name, cue)) in standings.into_iter().zip(&ids).zip(&wish.cues) {
        let had = match &is_allowed {
            Err(problem) if standing != StandingOfCue::Ready => {
                WishHad::new(cue, HadState::Refused, Some(problem.detail.clone()))
            }
            _ => standing_had(standing, status, id, cue),
        };
        all.insert(name.clone(), had);
    }
    Ok(all)
}

fn standing_had(standing: StandingOfCue, status: &Status, id: &CueId, cue: &WishedCue) -> WishHad {
    let of = |state, why: Option<String>| WishHad::new(cue, state, why);
    match standing {
        StandingOfCue::Ready => of(HadState::Ready, None),
        StandingOfCue::Unchecked => {
            of(HadState::Waiting, Some("what is there of that id was not checked yet".to_owned()))
        }
        StandingOfCue::Theirs => of(HadState::Refused, Some(theirs(id).to_string())),
        StandingOfCue::Refused { detail, faults } => {
            WishHad { faults, ..of(HadState::Refused, Some(detail)) }
        }
        StandingOfCue::Missing { replaces } => match check_rest(status, id, replaces) {
            Ok(()) => of(HadState::Missing, None),
            Err(problem) => of(HadState::Waiting, Some(problem.detail)),
        },
    }
}
