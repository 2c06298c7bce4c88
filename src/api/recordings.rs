//! `/api/v1/recordings` and `/api/v1/record`: what was recorded, and what a person has recorded. Files are read on a thread for that,
//! and sent piece by piece, one at a time.

use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, UNIX_EPOCH};

use axum::Json as JsonReply;
use axum::body::Body;
use axum::extract::{Path as UrlPath, Query, Request, State};
use axum::http::HeaderValue;
use axum::http::header::{CONTENT_DISPOSITION, CONTENT_LENGTH, CONTENT_TYPE, HeaderName};
use axum::response::{IntoResponse as _, Response};
use hyper::body::Bytes;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc;
use tokio::time::timeout;
use utoipa::{IntoParams, ToSchema};

use super::asker::{Asker, StatusReply};
use super::input::{Nothing, OrNothing};
use super::pieces::Pieces;
use super::problem::bad_value;
use super::shared::{Shared, StillAsked, turn};
use crate::control::model::Ending;
use crate::control::{Code, Command, Problem, is_recording};
use crate::journal::{Outcome, ShowRecord, stamp};
use crate::library::RecordingPicture;
use crate::record::closing_of;
use crate::sys::file;

/// The newest that are listed, and no more.
const MOST: usize = 500;
/// What came of shows is looked up for so many of them: more than any page shows, and few enough for whoever waits for the disk.
pub(super) const OUTCOMES: usize = 50;
/// Bytes of a piece, and how many wait for whoever reads them.
const PIECE: usize = 64 << 10;
const WAITING: usize = 2;
/// How long a piece may wait for whoever reads, so that the next one gets a turn.
const READING: Duration = Duration::from_secs(30);

/// A recording that is whole.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
pub(super) struct RecordingInfo {
    /// The name of its file: when it was begun, `show`, `test`, `homing` or `incident`, and what it is of.
    name: String,
    /// When it was begun, RFC 3339; null where its name does not say.
    begun: Option<String>,
    /// How large it is, bytes.
    bytes: u64,
    /// When it was closed, unix seconds.
    closed: u64,
    /// What came of the show, where it is of one that is over and among the newest 50.
    #[serde(flatten)]
    outcome: Option<RecordedOutcome>,
}

/// What came of a show, by the report in its recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
struct RecordedOutcome {
    /// How it ended.
    result: Ending,
    /// Frames that were lost.
    lost: u64,
    /// Ticks that were slept through.
    missed_ticks: u64,
}

/// Whom to draw.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct PictureQuery {
    /// The seat; where it is left out one that a mark names, else that fell out, else the one that was held back farthest.
    seat: Option<String>,
}

/// What was seen at a moment.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub(super) struct MarkText {
    /// In words.
    text: Option<String>,
}

/// All recordings that are whole, newest first, at most 500.
#[utoipa::path(get, path = "/api/v1/recordings", tag = "recordings", responses((status = 200, body = [RecordingInfo])))]
pub(super) async fn all(State(shared): State<Arc<Shared>>) -> Result<JsonReply<Vec<RecordingInfo>>, Problem> {
    let dir = shared.recordings.clone();
    shared.blocking(move || Ok(list(&dir))).await.map(JsonReply)
}

/// A recording: the file. For engineers; one at a time.
#[utoipa::path(
    get, path = "/api/v1/recordings/{name}", tag = "recordings",
    params(("name" = String, Path, description = "The name of its file")),
    responses((status = 200, body = Vec<u8>, content_type = "application/octet-stream"))
)]
pub(super) async fn one(
    State(shared): State<Arc<Shared>>,
    UrlPath(name): UrlPath<String>,
) -> Result<Response, Problem> {
    let path = path_of(&shared, &name)?;
    let turn = turn(&shared.reports, "a file").await?;
    let opened = shared.blocking(move || {
        let file = file::open_ours(&path).map_err(|_| no_recording(&path))?;
        let len = file.metadata().map_err(|_| no_recording(&path))?.len();
        Ok((file, len))
    });
    let (file, len) = opened.await?;
    let (to, mut read) = mpsc::channel::<Bytes>(WAITING);
    let (pieces, body) = mpsc::channel(WAITING);
    tokio::task::spawn_blocking(move || {
        let mut file = file.take(len);
        loop {
            let mut piece = Vec::with_capacity(PIECE);
            let got = file.by_ref().take(PIECE as u64).read_to_end(&mut piece);
            if piece.is_empty() || to.blocking_send(piece.into()).is_err() || got.is_err() {
                return;
            }
        }
    });
    tokio::spawn(async move {
        let _turn = turn;
        while let Some(piece) = read.recv().await {
            // Who reads too slowly gets a part, which is shorter than was said.
            if !matches!(timeout(READING, pieces.send(piece)).await, Ok(Ok(()))) {
                return;
            }
        }
    });
    let header = |name: HeaderName, value: &str| HeaderValue::from_str(value).ok().map(|value| (name, value));
    let mut response = Body::new(Pieces(body)).into_response();
    let headers = [
        header(CONTENT_TYPE, "application/octet-stream"),
        header(CONTENT_LENGTH, &len.to_string()),
        header(CONTENT_DISPOSITION, &format!("attachment; filename=\"{name}\"")),
    ];
    response.headers_mut().extend(headers.into_iter().flatten());
    Ok(response)
}

/// A recording drawn: what a seat was asked, sent and measured, and what went wrong. Drawn at the lowest priority, one at a time.
#[utoipa::path(
    get, path = "/api/v1/recordings/{name}/picture", tag = "recordings",
    params(("name" = String, Path, description = "The name of its file"), PictureQuery),
    responses((status = 200, body = RecordingPicture))
)]
pub(super) async fn picture(
    State(shared): State<Arc<Shared>>,
    UrlPath(name): UrlPath<String>,
    request: Request,
) -> Result<JsonReply<RecordingPicture>, Problem> {
    let query = Query::<PictureQuery>::try_from_uri(request.uri())
        .map_err(|_| bad_value("the query is not valid here", "send ?seat= and the name of a seat"))?;
    let path = path_of(&shared, &name)?;
    let library = shared.library.clone();
    let turn = turn(&shared.pictures, "a picture").await?;
    let drawn = shared.awaiting(StillAsked::of(&request), move |awaited| {
        let _turn = turn; // held until it is drawn
        file::open_ours(&path).map_err(|_| no_recording(&path))?;
        library.picture(&path, query.seat.as_deref(), Some(awaited))
    });
    drawn.await.map(JsonReply)
}

/// Deletes a recording. For engineers.
#[utoipa::path(
    delete, path = "/api/v1/recordings/{name}", tag = "recordings",
    params(("name" = String, Path, description = "The name of its file")),
    responses((status = 200, body = [RecordingInfo]))
)]
pub(super) async fn remove(
    State(shared): State<Arc<Shared>>,
    UrlPath(name): UrlPath<String>,
) -> Result<JsonReply<Vec<RecordingInfo>>, Problem> {
    let (path, dir) = (path_of(&shared, &name)?, shared.recordings.clone());
    let left = shared.blocking(move || {
        fs::remove_file(&path).map_err(|_| no_recording(&path))?;
        Ok(list(&dir))
    });
    left.await.map(JsonReply)
}

/// Marks this moment: what was before and comes after it is kept as an incident.
#[utoipa::path(
    post, path = "/api/v1/record/mark", tag = "recordings", request_body = Option<MarkText>,
    responses((status = 200, body = crate::control::Status))
)]
pub(super) async fn mark(
    asker: Asker,
    OrNothing(MarkText { text }): OrNothing<MarkText>,
) -> Result<StatusReply, Problem> {
    asker.ask(Command::Mark { text }).await
}

/// Writes out what the flight recorder holds, as an incident.
#[utoipa::path(
    post, path = "/api/v1/record/dump", tag = "recordings",
    responses((status = 200, body = crate::control::Status))
)]
pub(super) async fn dump(asker: Asker, _: Nothing) -> Result<StatusReply, Problem> {
    asker.ask(Command::Dump).await
}

fn list(dir: &Path) -> Vec<RecordingInfo> {
    let info = |entry: fs::DirEntry| {
        let name = entry.file_name().into_string().ok().filter(|name| is_recording(name))?;
        let about = entry.metadata().ok().filter(fs::Metadata::is_file)?;
        let closed = about.modified().ok()?.duration_since(UNIX_EPOCH).ok()?.as_secs();
        Some(RecordingInfo { begun: begun(&name), name, bytes: about.len(), closed, outcome: None })
    };
    // Where there is no folder nothing was recorded.
    let mut all: Vec<_> = fs::read_dir(dir).into_iter().flatten().flatten().filter_map(info).collect();
    all.sort_unstable_by(|one, other| other.cmp(one));
    all.truncate(MOST);
    for one in all.iter_mut().take(OUTCOMES) {
        one.outcome = outcome(&dir.join(&one.name));
    }
    all
}

/// When a file was begun, which its name has in the zone of the server.
fn begun(name: &str) -> Option<String> {
    let at = DateTime::strptime("%Y-%m-%dT%H-%M-%S", name.get(..19)?).ok()?;
    Some(stamp(&at.to_zoned(TimeZone::system()).ok()?))
}

/// The names of all recordings that are whole, newest first.
pub(super) fn names(dir: &Path) -> Vec<String> {
    let name = |entry: fs::DirEntry| {
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        entry.file_name().into_string().ok().filter(|name| is_file && is_recording(name))
    };
    let mut all: Vec<_> = fs::read_dir(dir).into_iter().flatten().flatten().filter_map(name).collect();
    all.sort_unstable_by(|one, other| other.cmp(one));
    all
}

/// What came of the show that a file is of.
fn outcome(path: &Path) -> Option<RecordedOutcome> {
    let report = closing_of(file::open_ours(path).ok()?).ok()?.report?;
    let Outcome { result, missed_ticks, frames, .. } =
        serde_json::from_slice::<ShowRecord>(&report).ok()?.outcome?;
    Some(RecordedOutcome { result, lost: frames.lost, missed_ticks })
}

fn path_of(shared: &Shared, name: &str) -> Result<PathBuf, Problem> {
    let path = shared.recordings.join(name);
    if is_recording(name) { Ok(path) } else { Err(no_recording(Path::new(name))) }
}

fn no_recording(path: &Path) -> Problem {
    let name = path.file_name().unwrap_or_default().display();
    Problem::new(Code::Unknown, format!("there is no recording {name}"), "GET /api/v1/recordings lists them")
}
