//! What a fleet wishes for the library of this hall, and the files of that. A wish counts for whose key has signed it, each time anew: the
//! process that brings the files has no say. They come only while the hall is parked and unarmed, and nothing that is loaded changes.

use std::sync::Arc;

use axum::Json as JsonReply;
use axum::extract::{Request, State};
use jiff::Zoned;

use super::cues::receive;
use super::input::{Id, id, parse, whole_within};
use super::problem::bad_value;
use super::shared::Shared;
use crate::control::{Code, Problem, Status, Who};
use crate::fleet::{CueHad, HadState, HaveReport, LONGEST_WISH, Letter, Wish, WishedCue};
use crate::journal::stamp;
use crate::library::{CueId, CueInfo, Library, StandingOfCue, theirs};
use crate::log::{Line, Priority};
use crate::state::State as HallState;
use crate::sys::clock::wall_now_ns;

/// Takes a signed wish, which is kept from now on, and says what the hall has of it. The one that is kept may come again.
pub(super) async fn wish(
    State(shared): State<Arc<Shared>>,
    request: Request,
) -> Result<JsonReply<HaveReport>, Problem> {
    let headers = request.headers().clone();
    let text = whole_within(&headers, request.into_body(), LONGEST_WISH).await?;
    let letter: Letter = parse(&text)?;
    let (_, wish) = shared.fleet.open_wish(&letter, wall_now_ns())?;
    for (id, cue) in &wish.cues {
        check_cue(id, cue, shared.library.max_bytes())?;
    }
    let of_blocking = Arc::clone(&shared);
    let report = shared.blocking(move || {
        keep(&of_blocking.library, &letter, &wish)?;
        report(&of_blocking, &wish)
    });
    report.await.map(JsonReply)
}

/// What the hall has of the wish that it keeps; nothing where it keeps none that still counts.
pub(super) async fn kept(State(shared): State<Arc<Shared>>) -> Result<JsonReply<HaveReport>, Problem> {
    let of_blocking = Arc::clone(&shared);
    let report = shared.blocking(move || {
        let none = || Wish { to: String::new(), rev: 0, cues: Default::default() };
        let wish = kept_wish(&of_blocking).map_or_else(|_| none(), |(_, wish)| wish);
        report(&of_blocking, &wish)
    });
    report.await.map(JsonReply)
}

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

/// Keeps a wish that is newer than the one that is kept.
fn keep(library: &Library, letter: &Letter, wish: &Wish) -> Result<(), Problem> {
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

/// The wish that is kept, where its key still counts.
fn kept_wish(shared: &Shared) -> Result<(Who, Wish), Problem> {
    let none = || Problem::new(Code::Unknown, "the fleet wishes nothing of this hall", "push something");
    let kept = shared.library.wish().ok_or_else(none)?;
    let letter = serde_json::from_str(&kept).map_err(|error| bad_value(error.to_string(), "push again"))?;
    shared.fleet.open_wish(&letter, wall_now_ns())
}

/// Whose wish a cue is, its file, and whether that takes the place of another; why it may not come now.
fn may_come(shared: &Shared, id: &CueId) -> Result<(Who, WishedCue, bool), Problem> {
    let (who, mut wish) = kept_wish(shared)?;
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

fn check_cue(text: &str, cue: &WishedCue, most: u64) -> Result<(), Problem> {
    id(text)?;
    if cue.bytes > most {
        let detail = format!("{text} has {} bytes, more than the {most} that the library takes", cue.bytes);
        return Err(Problem::new(Code::Size, detail, "make it smaller, or raise max_cue_mib in [library]"));
    }
    Ok(())
}

/// That the hall rests, unarmed, and has not loaded what would be replaced.
fn check_rest(status: &Status, id: &CueId, replaces: bool) -> Result<(), Problem> {
    let id = id.to_string();
    let wait =
        |detail: String| Err(Problem::new(Code::State, detail, "it comes by itself when that is over"));
    if status.state != HallState::Parked {
        return wait(format!("the hall is {}", status.state));
    }
    if status.show.as_ref().is_some_and(|show| show.cue == id) {
        return wait(format!("{id} is loaded"));
    }
    let list = status.playlist.as_ref().filter(|list| list.entries.iter().any(|entry| entry.cue == id));
    match list.filter(|_| replaces) {
        Some(list) => wait(format!("the playlist {}, which has {id}, is loaded", list.id)),
        None => Ok(()),
    }
}

/// What the hall has of a wish.
fn report(shared: &Shared, wish: &Wish) -> Result<HaveReport, Problem> {
    let status = shared.handle.status();
    let mut report = HaveReport {
        at: stamp(&Zoned::now()),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        config: shared.library.config_digest(),
        rev: wish.rev,
        ..HaveReport::default()
    };
    let ids = wish.cues.iter().map(|(name, cue)| Ok((id(name)?, cue.sha256.as_str())));
    let ids = ids.collect::<Result<Vec<_>, Problem>>()?;
    let standings = shared.library.standings(&ids)?;
    for ((standing, (id, _)), (name, cue)) in standings.into_iter().zip(&ids).zip(&wish.cues) {
        report.cues.insert(name.clone(), had(standing, &status, id, cue));
    }
    Ok(report)
}

fn had(standing: StandingOfCue, status: &Status, id: &CueId, cue: &WishedCue) -> CueHad {
    let of = |state, why: Option<String>| CueHad::new(cue, state, why);
    match standing {
        StandingOfCue::Ready => of(HadState::Ready, None),
        StandingOfCue::Unchecked => {
            of(HadState::Waiting, Some("what is there of that id was not checked yet".to_owned()))
        }
        StandingOfCue::Theirs => of(HadState::Refused, Some(theirs(id).to_string())),
        StandingOfCue::Refused { detail, faults } => CueHad { faults, ..of(HadState::Refused, Some(detail)) },
        StandingOfCue::Missing { replaces } => match check_rest(status, id, replaces) {
            Ok(()) => of(HadState::Missing, None),
            Err(problem) => of(HadState::Waiting, Some(problem.detail)),
        },
    }
}

/// Takes a wish apart, whoever has signed it.
#[cfg(feature = "harness")]
pub(crate) fn try_wish(text: &str) {
    if let Ok(letter) = serde_json::from_str::<Letter>(text) {
        let wish = Wish::of(&letter);
        drop(std::hint::black_box(wish.map(|wish| {
            wish.cues.iter().map(|(id, cue)| check_cue(id, cue, 1).is_ok()).collect::<Vec<_>>()
        })));
    }
    drop(std::hint::black_box(serde_json::from_str::<HaveReport>(text)));
}
