//! Wishes of a fleet in, and what the hall has of them out. What may be done of one is done while the hall is parked and unarmed, and
//! nothing that is loaded changes.

use std::sync::Arc;
use std::time::Duration;

use axum::Json as JsonReply;
use axum::extract::{Request, State};
use jiff::Zoned;

use super::fleet_cues::{self, check_cue};
use super::fleet_drops;
use super::fleet_kept::{keep, kept_rev, kept_wish};
use super::fleet_lists::{self, FailedWishes, check_playlist};
use super::input::{id, parse, whole_within};
use super::shared::{Shared, turn};
use crate::control::{Problem, Status, Who};
use crate::fleet::{Drops, HaveReport, LONGEST_WISH, Letter, Wish};
use crate::journal::stamp;
use crate::state::State as HallState;
use crate::sys::clock::wall_now_ns;
use crate::sys::lock::{lock, try_lock};

/// How often it is looked whether the time of something has come: whether or not the engine is there then.
const LOOK: Duration = Duration::from_secs(5);
/// What is made for one at a time.
const REPORT: &str = "a report of what is wished";

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
    let turn = turn(&shared.wishes, REPORT).await?;
    let of_blocking = Arc::clone(&shared);
    let report = shared.blocking(move || {
        let _turn = turn;
        let absent = |before: &Drops| fleet_drops::absent(&of_blocking, &wish, before);
        keep(&of_blocking.library, &letter, &wish, absent)?;
        settle(&of_blocking)?;
        report(&of_blocking, &wish)
    });
    report.await.map(JsonReply)
}

/// What the hall has of the wish that it keeps; nothing where it keeps none that still counts.
pub(super) async fn kept(State(shared): State<Arc<Shared>>) -> Result<JsonReply<HaveReport>, Problem> {
    let turn = turn(&shared.wishes, REPORT).await?;
    let of_blocking = Arc::clone(&shared);
    let report = shared.blocking(move || {
        let _turn = turn;
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
    // Whoever does it now does it for all, and the next look is soon.
    let Some(_settling) = try_lock(&shared.fleet_settling) else { return Ok(()) };
    let mut failed = FailedWishes::new();
    let settled = drop_and_bring(shared, &who, &wish, &status, &mut failed);
    *lock(&shared.fleet_failed) = failed;
    settled
}

fn drop_and_bring(
    shared: &Shared,
    who: &Who,
    wish: &Wish,
    status: &Status,
    failed: &mut FailedWishes,
) -> Result<(), Problem> {
    fleet_drops::drop_all(shared, who, wish, failed)?;
    if wish.playlists.is_empty() {
        return Ok(());
    }
    let cues = fleet_cues::had(shared, wish, status)?;
    fleet_lists::bring(shared, who, wish, &cues, failed)
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
    let failed = lock(&shared.fleet_failed).clone();
    let cues = fleet_cues::had(shared, wish, &status)?;
    let [dropped_cues, dropped_playlists] = fleet_drops::had(shared, wish, &status, &failed)?;
    Ok(HaveReport {
        at: stamp(&Zoned::now()),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        config: shared.library.config_digest(),
        rev: kept_rev(&shared.library),
        playlists: fleet_lists::had(shared, wish, &cues, &status, &failed)?,
        cues,
        dropped_cues,
        dropped_playlists,
        ..HaveReport::default()
    }
    .bounded())
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

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::mpsc::channel;
    use std::thread;

    use super::*;
    use crate::api::access::Access;
    use crate::api::fleet_access::FleetAccess;
    use crate::api::{Setup, shared};
    use crate::config::{self, FleetKey, FleetWord, Role};
    use crate::control::handle;
    use crate::fleet::{HadState, new_letter_key};
    use crate::library::{self, Library};
    use crate::log::Log;
    use crate::playlist::Shelf;
    use crate::rt::Desk;

    /// A hall that is parked, in that folder, and a letter of a desk that it allows to wish for cues.
    fn hall(folder: &Path, wish: &str) -> (Arc<Shared>, Letter) {
        let pair = new_letter_key();
        let key = FleetKey { name: "office".to_owned(), role: Role::Operate, public: pair.public_key() };
        let fleet = config::Fleet {
            name: "berlin.h3".to_owned(),
            allow: vec![FleetWord::Cues, FleetWord::Playlists],
            start: false,
            start_bound: Duration::from_millis(2),
            keys: vec![key],
        };
        let status = Status { state: HallState::Parked.into(), ..Status::default() };
        let (handle, ..) = handle(Arc::new(Desk::new(std::iter::empty())), status);
        let config = folder.join("hall.toml");
        let library =
            library::Hall { config, program: folder.join("none"), bounds: library::Bounds::default() };
        let setup = Setup {
            config: config::Api::default(),
            socket: folder.join("control.sock"),
            handle,
            library: Library::open(&folder.join("cues"), library).unwrap(),
            playlists: Shelf::new(&folder.join("playlists")),
            journal: folder.join("journal"),
            recordings: folder.join("recordings"),
            pages: |_| None,
            log: Log::start(|_| {}).unwrap(),
        };
        let access = Access::new(&config::Api::default(), &[]);
        let closing = tokio::sync::watch::channel(false).1;
        let fleet = FleetAccess::of(Some(&fleet));
        let shared = Arc::new(shared(setup, access, fleet, closing, Default::default()));
        let rev = wall_now_ns() / 1_000_000;
        let body = format!("{{\"to\":\"berlin.h3\",\"rev\":{rev},\"cues\":{{}},{wish}}}");
        (shared, Letter::sign(&pair, body).unwrap())
    }

    #[test]
    fn what_is_done_of_a_wish_for_long_keeps_no_report_and_nobody_else_waiting() {
        let dir = tempfile::tempdir().unwrap();
        let (shared, letter) = hall(dir.path(), r#""drops":{"cues":["strom"]}"#);
        let wish = Wish::of(&letter).unwrap();
        let absent = |before: &Drops| fleet_drops::absent(&shared, &wish, before);
        keep(&shared.library, &letter, &wish, absent).unwrap();
        let held = lock(&shared.fleet_settling);
        let (tell, told) = channel();
        let of_thread = Arc::clone(&shared);
        thread::spawn(move || {
            let done = settle(&of_thread).and_then(|()| report(&of_thread, &wish));
            tell.send(done).unwrap();
        });
        let report = told.recv_timeout(Duration::from_secs(20)).expect("it waits").unwrap();
        drop(held);
        let had = &report.dropped_cues["strom"];
        assert_eq!((had.state, had.why.as_deref()), (HadState::Ready, Some("there was no cue strom")));
        assert!(settle(&shared).is_ok());
    }
}
