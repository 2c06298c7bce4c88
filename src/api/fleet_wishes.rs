//! Wishes of a fleet in, and what the hall has of them out. What may be done of one is done while the hall is parked and unarmed, and
//! nothing that is loaded changes.

use std::sync::Arc;
use std::time::Duration;

use axum::Json as JsonReply;
use axum::extract::{Request, State};
use jiff::Zoned;

use super::fleet_cues::{self, check_cue};
use super::fleet_drops;
use super::fleet_kept::{keep, kept_wish};
use super::fleet_lists::{self, check_playlist};
use super::input::{id, parse, whole_within};
use super::shared::Shared;
use crate::control::Problem;
use crate::fleet::{Drops, HaveReport, LONGEST_WISH, Letter, Wish};
use crate::journal::stamp;
use crate::state::State as HallState;
use crate::sys::clock::wall_now_ns;
use crate::sys::lock::lock;

/// How often it is looked whether the time of something has come: whether or not the engine is there then.
const LOOK: Duration = Duration::from_secs(5);

/// Takes a signed wish, which is kept from now on, does of it what may be done now, and says what the hall has of it. The one that is
/// kept may come again.
pub(super) async fn wish(
    State(shared): State<Arc<Shared>>,
    request: Request,
) -> Result<JsonReply<HaveReport>, Problem> {
    let headers = request.headers().clone();
    let text = whole_within(&headers, request.into_body(), LONGEST_WISH).await?;
    let letter: Letter = parse(&text)?;
    let (_, wish) = shared.fleet.open_wish(&letter, wall_now_ns())?;
    check(&wish, shared.library.max_bytes())?;
    let of_blocking = Arc::clone(&shared);
    let report = shared.blocking(move || {
        keep(&of_blocking.library, &letter, &wish)?;
        settle(&of_blocking)?;
        report(&of_blocking, &wish)
    });
    report.await.map(JsonReply)
}

/// What the hall has of the wish that it keeps; nothing where it keeps none that still counts.
pub(super) async fn kept(State(shared): State<Arc<Shared>>) -> Result<JsonReply<HaveReport>, Problem> {
    let of_blocking = Arc::clone(&shared);
    let report = shared.blocking(move || {
        let wish = kept_wish(&of_blocking).map_or_else(|_| Wish::default(), |(_, wish)| wish);
        report(&of_blocking, &wish)
    });
    report.await.map(JsonReply)
}

/// Does what is wished at its time, for as long as the server runs.
pub(super) async fn keep_settled(shared: Arc<Shared>) {
    loop {
        tokio::time::sleep(LOOK).await;
        if shared.handle.status().state != HallState::Parked {
            continue; // nor is a thread woken for it
        }
        let of_blocking = Arc::clone(&shared);
        // Why it does not come to that is in the report.
        let _ = shared.blocking(move || settle(&of_blocking)).await;
    }
}

/// Does of the wish that is kept what may be done now.
fn settle(shared: &Shared) -> Result<(), Problem> {
    let status = shared.handle.status();
    if status.state != HallState::Parked || shared.library.wish().is_none() {
        return Ok(());
    }
    let Ok((who, wish)) = kept_wish(shared) else { return Ok(()) };
    let mut failed = lock(&shared.fleet_failed); // so that one thing is done at a time
    failed.clear();
    fleet_drops::drop_all(shared, &who, &wish, &mut failed)?;
    if wish.playlists.is_empty() {
        return Ok(());
    }
    let cues = fleet_cues::had(shared, &wish, &status)?;
    fleet_lists::bring(shared, &who, &wish, &cues, &mut failed)
}

/// That all that a wish names can be what it is named.
fn check(wish: &Wish, most: u64) -> Result<(), Problem> {
    let Drops { cues, playlists } = &wish.drops;
    cues.iter().chain(playlists).try_for_each(|name| id(name).map(drop))?;
    wish.cues.iter().try_for_each(|(id, cue)| check_cue(id, cue, most))?;
    wish.playlists.iter().try_for_each(|(id, playlist)| check_playlist(id, playlist))
}

/// What the hall has of a wish.
fn report(shared: &Shared, wish: &Wish) -> Result<HaveReport, Problem> {
    let status = shared.handle.status();
    let failed = lock(&shared.fleet_failed);
    let cues = fleet_cues::had(shared, wish, &status)?;
    let [dropped_cues, dropped_playlists] = fleet_drops::had(shared, wish, &status, &failed)?;
    Ok(HaveReport {
        at: stamp(&Zoned::now()),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        config: shared.library.config_digest(),
        rev: wish.rev,
        playlists: fleet_lists::had(shared, wish, &cues, &status, &failed)?,
        cues,
        dropped_cues,
        dropped_playlists,
        ..HaveReport::default()
    })
}

/// Takes a wish apart, whoever has signed it.
#[cfg(feature = "harness")]
pub(crate) fn try_wish(text: &str) {
    if let Ok(letter) = serde_json::from_str::<Letter>(text) {
        let wish = Wish::of(&letter);
        drop(std::hint::black_box(wish.map(|wish| check(&wish, 1).is_ok())));
    }
    drop(std::hint::black_box(serde_json::from_str::<HaveReport>(text)));
}
