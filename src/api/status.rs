//! `/api/v1/status` and `/api/v1/events`: the status of the hall, once or as it changes.

use std::sync::Arc;
use std::time::Duration;

use axum::Extension;
use axum::body::Body;
use axum::extract::State;
use axum::http::HeaderValue;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse as _, Response};
use hyper::body::Bytes;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::asker::StatusReply;
use super::pieces::Pieces;
use super::shared::Shared;
use super::streams::StreamPlace;
use crate::control::{Code, FilmStatus, Problem, Status, Who};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Between two events at the least.
pub(super) const PACE: Duration = Duration::from_millis(100);
/// After how long without an event a comment says that the server lives.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// The whole state of the hall; 503 where nothing new of it was heard for two seconds.
#[utoipa::path(get, path = "/api/v1/status", tag = "hall", responses((status = 200, body = Status)))]
pub(super) async fn status(State(shared): State<Arc<Shared>>) -> Result<StatusReply, Problem> {
    check_pulse(&shared)?;
    Ok(StatusReply(shared.write(&shared.handle.status())))
}

/// True if the status is of now.
pub(super) fn check_pulse(shared: &Shared) -> Result<(), Problem> {
    let Some(still) = shared.pulse.stopped(Monotonic.now()) else { return Ok(()) };
    let detail = format!("no update of the hall for {} s", still.as_secs());
    Err(Problem::new(Code::Timeout, detail, "check the seats; a stop still works"))
}

/// Who asks, by their token, and what they may do.
#[utoipa::path(get, path = "/api/v1/who", tag = "hall", responses((status = 200, body = Who)))]
pub(super) async fn who(Extension(who): Extension<Who>) -> axum::Json<Who> {
    axum::Json(who)
}

/// The film alone, as the status has it; 404 in a hall that follows none.
#[utoipa::path(get, path = "/api/v1/sync", tag = "hall", responses((status = 200, body = FilmStatus)))]
pub(super) async fn sync(State(shared): State<Arc<Shared>>) -> Result<Response, Problem> {
    let film = shared.handle.status().film.clone().ok_or_else(Problem::no_film)?;
    Ok(axum::Json(film).into_response())
}

/// Server-sent events named `status`, each the whole status: at once, then at each change, ten a second at the most. Between
/// them come comments. Who reads too slowly misses some, and who reads nothing is cut off.
#[utoipa::path(
    get, path = "/api/v1/events", tag = "hall",
    responses((status = 200, body = Status, content_type = "text/event-stream"))
)]
pub(super) async fn events(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
) -> Result<Response, Problem> {
    let place = shared.streams.take(&who)?;
    // One event waits at the most, beside what the connection holds.
    let (to, events) = mpsc::channel(1);
    tokio::spawn(push(shared, to, place));
    let body = Body::new(Pieces(events));
    Ok(([(CONTENT_TYPE, HeaderValue::from_static("text/event-stream"))], body).into_response())
}

/// Pushes statuses until the other end has gone, or the server ends.
async fn push(shared: Arc<Shared>, to: mpsc::Sender<Bytes>, place: StreamPlace) {
    let mut statuses = shared.handle.watch();
    let mut closing = shared.closing.clone();
    let mut pace = interval(PACE);
    pace.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut news = true;
    while !*closing.borrow() {
        pace.tick().await;
        let text = if news {
            let status = Arc::clone(&statuses.borrow_and_update());
            event(&shared.write(&status))
        } else {
            Bytes::from_static(b": the server lives\n\n")
        };
        if to.send(text).await.is_err() {
            return;
        }
        news = tokio::select! {
            changed = timeout(KEEP_ALIVE, statuses.changed()) => match changed {
                Ok(Ok(())) => true,
                Ok(Err(_)) => return, // there is no hall any more
                Err(_) => false,
            },
            () = to.closed() => return,
            () = place.leave() => return,
            _ = closing.changed() => return,
        };
    }
}

/// One event; JSON of ours is one line.
fn event(json: &Bytes) -> Bytes {
    let mut text = Vec::with_capacity(json.len() + 32);
    text.extend_from_slice(b"event: status\ndata: ");
    text.extend_from_slice(json);
    text.extend_from_slice(b"\n\n");
    text.into()
}
