//! `/api/v1/history`: the last shows of the journal, each with what its recording says of it. Read on a thread for that, one at a time.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use axum::Json as JsonReply;
use axum::extract::State;
use jiff::{ToSpan as _, Zoned};
use serde::Serialize;
use utoipa::ToSchema;

use super::recordings::{OUTCOMES, names};
use super::shared::{Shared, turn};
use crate::control::Problem;
use crate::journal::{self, ReportBounds, ReportShown, ShowRecord, ShowResult};
use crate::record::{Closing, Margin, closing_of};
use crate::sys::file;

/// Shows that are told; more than a page shows.
const SHOWS: usize = 20;
/// They are looked for in the journal of so many days, of more only where these have too few.
const DAYS: [i32; 3] = [2, 14, 60];

/// A show of the past, or the one that goes on.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub(super) struct PastShow {
    /// When it began, RFC 3339.
    start: String,
    /// The id of the cue.
    cue: String,
    /// Its title.
    title: Option<String>,
    /// What came of it.
    result: ShowResult,
    /// How long it took, s; null if it has no end.
    took_s: Option<f64>,
    /// Frames that were lost.
    lost: u64,
    /// Ticks that were slept through.
    missed_ticks: u64,
    /// What its recording says; null where there is none that is whole.
    recorded: Option<RecordedShow>,
}

/// What the recording of a show says.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
struct RecordedShow {
    /// The name of its file; of several parts the last.
    name: String,
    /// How often the limiter held a seat back.
    clamps: u64,
    /// Moments that were marked.
    marks: u64,
    /// What came nearest to its limit; null where nothing moved.
    nearest: Option<NearestLimit>,
}

/// What came nearest to its limit in a show.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
struct NearestLimit {
    /// Of what: `velocity`, `acceleration` or `jerk`.
    of: &'static str,
    /// The seat.
    seat: String,
    /// Its axis, from 1.
    axis: usize,
    /// What was left, 0 to 1; below 0 it was over the limit.
    left: f64,
    /// The show time, s.
    at_s: f64,
}

impl From<&Margin> for NearestLimit {
    fn from(margin: &Margin) -> Self {
        let of = ["velocity", "acceleration", "jerk"][margin.quantity as usize];
        let Margin { seat, axis, film_s, .. } = margin;
        Self { of, seat: seat.clone(), axis: *axis, left: 1.0 - margin.part(), at_s: *film_s }
    }
}

/// The last 20 shows of the journal, newest first, with what their recordings say of them.
#[utoipa::path(get, path = "/api/v1/history", tag = "recordings", responses((status = 200, body = [PastShow])))]
pub(super) async fn all(State(shared): State<Arc<Shared>>) -> Result<JsonReply<Vec<PastShow>>, Problem> {
    let turn = turn(&shared.reports, "the history").await?;
    let (journal, recordings) = (shared.journal.clone(), shared.recordings.clone());
    let told = shared.blocking(move || {
        let _turn = turn; // held until it is told, also where nobody waits for it any more
        history(&journal, &recordings)
    });
    told.await.map(JsonReply)
}

fn history(journal: &Path, recordings: &Path) -> Result<Vec<PastShow>, Problem> {
    let today = Zoned::now().date();
    let bounds = ReportBounds { shows: SHOWS, actions: 0 };
    let mut shows = Vec::new();
    for days in DAYS {
        let first = today.checked_sub(days.days()).unwrap_or(today);
        shows = journal::report(journal, first, today, bounds)?.shows;
        if shows.len() >= SHOWS {
            break;
        }
    }
    let mut recorded = recorded_shows(recordings);
    Ok(shows.into_iter().rev().map(|shown| past(shown, &mut recorded)).collect())
}

fn past(shown: ReportShown, recorded: &mut HashMap<String, RecordedShow>) -> PastShow {
    let ReportShown { result, took_s, record } = shown;
    let ShowRecord { start, cue, title, outcome, .. } = record;
    let (lost, missed_ticks) = outcome.map_or((0, 0), |outcome| (outcome.frames.lost, outcome.missed_ticks));
    let recorded = recorded.remove(&start);
    PastShow { start, cue, title, result, took_s, lost, missed_ticks, recorded }
}

/// What the newest recordings of shows say, by when these began.
fn recorded_shows(dir: &Path) -> HashMap<String, RecordedShow> {
    let newest = names(dir).into_iter().take(OUTCOMES);
    newest.filter_map(|name| recorded_show(dir, name)).collect()
}

fn recorded_show(dir: &Path, name: String) -> Option<(String, RecordedShow)> {
    let Closing { report, end } = closing_of(file::open_ours(&dir.join(&name)).ok()?).ok()?;
    let start = serde_json::from_slice::<ShowRecord>(&report?).ok()?.start;
    let count = |key: &str| end.get(key).and_then(|count| count.parse().ok()).unwrap_or_default();
    let most: Vec<Margin> =
        end.get("most").and_then(|most| serde_json::from_str(most).ok()).unwrap_or_default();
    let nearest = most.iter().filter(|one| one.part() > 0.0);
    let nearest = nearest.max_by(|one, other| one.part().total_cmp(&other.part())).map(NearestLimit::from);
    Some((start, RecordedShow { name, clamps: count("clamps"), marks: count("marks"), nearest }))
}
