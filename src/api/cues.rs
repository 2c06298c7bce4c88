//! `/api/v1/cues`: the library. What reads files does it on a blocking thread; an upload goes there piece by piece.

use std::sync::Arc;
use std::time::Duration;

use axum::Json as JsonReply;
use axum::body::Body;
use axum::extract::{Query, Request, State};
use axum::http::HeaderValue;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse as _;
use http_body_util::BodyExt as _;
use hyper::body::Bytes;
use serde::Deserialize;
use tokio::sync::mpsc;
use tokio::time::timeout;
use utoipa::IntoParams;

use super::access::one as one_header;
use super::input::{Id, check_length};
use super::problem::bad_value;
use super::shared::{Shared, StillAsked, turn};
use crate::control::{Code, Problem};
use crate::library::{Awaited, CueId, CueInfo, CurveData, Library, MAX_POINTS, Upload};

/// Pieces that wait for the disk at the most.
const PIECES: usize = 4;
/// How long the next piece may take to come.
const STALL: Duration = Duration::from_secs(10);
/// How long an upload may take in all.
const WHOLE: Duration = Duration::from_secs(3600);
/// Where nothing is said.
const POINTS: usize = 800;

/// In how many stretches of time a curve is asked.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct CurveQuery {
    /// 1 to 4,000; 800 where it is left out.
    points: Option<usize>,
}

/// All cues, by their ids.
#[utoipa::path(get, path = "/api/v1/cues", tag = "library", responses((status = 200, body = [CueInfo])))]
pub(super) async fn all(State(shared): State<Arc<Shared>>) -> Result<JsonReply<Vec<CueInfo>>, Problem> {
    let library = shared.library.clone();
    shared.blocking(move || Ok(library.list())).await.map(JsonReply)
}

/// One cue.
#[utoipa::path(
    get, path = "/api/v1/cues/{id}", tag = "library", params(("id" = String, Path, description = "Its id")),
    responses((status = 200, body = CueInfo))
)]
pub(super) async fn one(
    State(shared): State<Arc<Shared>>,
    Id(id): Id,
) -> Result<JsonReply<CueInfo>, Problem> {
    let library = shared.library.clone();
    let found = shared.blocking(move || library.get(&id).ok_or_else(|| library.unknown(&id)));
    found.await.map(JsonReply)
}

/// The curves of a cue, as a page draws them.
#[utoipa::path(
    get, path = "/api/v1/cues/{id}/curve", tag = "library",
    params(("id" = String, Path, description = "Its id"), CurveQuery), responses((status = 200, body = CurveData))
)]
pub(super) async fn curve(
    State(shared): State<Arc<Shared>>,
    Id(id): Id,
    request: Request,
) -> Result<axum::response::Response, Problem> {
    let query = Query::<CurveQuery>::try_from_uri(request.uri()).map_err(|_| {
        bad_value("the query is not valid here", format!("send ?points= and 1 to {MAX_POINTS}"))
    })?;
    let points = query.points.unwrap_or(POINTS);
    let library = shared.library.clone();
    let turn = turn(&shared.curves, "a curve").await?;
    let curve = shared.awaiting(StillAsked::of(&request), move |awaited| {
        let _turn = turn; // held until it is drawn
        let curve = library.curve(&id, points, Some(awaited))?;
        Ok(serde_json::to_vec(&*curve).expect("numbers and names are written without fail"))
    });
    let json = HeaderValue::from_static("application/json");
    Ok(([(CONTENT_TYPE, json)], curve.await?).into_response())
}

/// Takes a cue in, CSV or MCAP as it is in its file, of any type but a form's. It is checked and proved for the hall before it
/// takes the place of the one with that id; one that does not pass is refused with every fault. For engineers.
#[utoipa::path(
    put, path = "/api/v1/cues/{id}", tag = "library", params(("id" = String, Path, description = "Its id")),
    request_body(content = Vec<u8>, content_type = "application/byte-stream"),
    responses((status = 200, body = CueInfo))
)]
pub(super) async fn upload(
    State(shared): State<Arc<Shared>>,
    Id(id): Id,
    request: Request,
) -> Result<JsonReply<CueInfo>, Problem> {
    no_form(&request)?;
    receive(&shared, id, request, |upload, awaited| upload.finish(Some(awaited))).await
}

/// Takes the body of a request in as a cue, which `finish` puts into the library.
pub(super) async fn receive(
    shared: &Arc<Shared>,
    id: CueId,
    request: Request,
    finish: impl FnOnce(Upload, &Awaited) -> Result<CueInfo, Problem> + Send + 'static,
) -> Result<JsonReply<CueInfo>, Problem> {
    check_length(request.headers(), shared.library.max_bytes())?;
    let (to, pieces) = mpsc::channel(PIECES);
    let asked = StillAsked::of(&request);
    let library = shared.library.clone();
    let fed =
        async { timeout(WHOLE, feed(request.into_body(), to)).await.unwrap_or_else(|_| Err(slow(WHOLE))) };
    let (fed, taken) = tokio::join!(
        fed,
        shared.awaiting(asked, move |awaited| finish(take_in(&library, &id, pieces)?, awaited))
    );
    fed?;
    taken.map(JsonReply)
}

/// A piece of an upload.
enum UploadPiece {
    Bytes(Bytes),
    /// That was all of it.
    End,
}

/// Hands a body on as it comes; ends early where nobody takes it any more, which whoever took it explains.
async fn feed(mut body: Body, to: mpsc::Sender<UploadPiece>) -> Result<(), Problem> {
    loop {
        let piece = match timeout(STALL, body.frame()).await {
            Ok(Some(Ok(frame))) => match frame.into_data() {
                Ok(bytes) => UploadPiece::Bytes(bytes),
                Err(_) => continue, // trailers
            },
            Ok(Some(Err(_))) => return Err(cut_short()),
            Ok(None) => UploadPiece::End,
            Err(_) => return Err(slow(STALL)),
        };
        let last = matches!(piece, UploadPiece::End);
        if to.send(piece).await.is_err() || last {
            return Ok(());
        }
    }
}

/// Takes the pieces in; what ends before its end leaves nothing.
fn take_in(
    library: &Library,
    id: &CueId,
    mut pieces: mpsc::Receiver<UploadPiece>,
) -> Result<Upload, Problem> {
    let mut upload = library.begin(id)?;
    loop {
        match pieces.blocking_recv() {
            Some(UploadPiece::Bytes(bytes)) => upload.write(&bytes)?,
            Some(UploadPiece::End) => return Ok(upload),
            None => return Err(cut_short()),
        }
    }
}

/// What a page of anybody could have a browser send.
fn no_form(request: &Request) -> Result<(), Problem> {
    let form = |essence: &str| {
        let forms = ["application/x-www-form-urlencoded", "multipart/form-data", "text/plain"];
        forms.iter().any(|form| essence.trim().eq_ignore_ascii_case(form))
    };
    let content_type = one_header(request.headers(), &CONTENT_TYPE)?;
    match content_type.and_then(|text| text.split(';').next()).filter(|essence| form(essence)) {
        None => Ok(()),
        Some(form) => {
            let detail = format!("{form} is for forms");
            Err(Problem::new(
                Code::Media,
                detail,
                "send the file as application/byte-stream, as curl -T does",
            ))
        }
    }
}

fn cut_short() -> Problem {
    bad_value("the upload ended before its length", "send all of it; nothing of it is kept")
}

fn slow(limit: Duration) -> Problem {
    let detail = format!("the upload took more than {} s", limit.as_secs());
    Problem { status: 408, ..Problem::new(Code::Timeout, detail, "send it faster; nothing of it is kept") }
}
