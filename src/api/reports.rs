//! `/api/v1/reports/{day}`: the shows and commands of a day. Read and written on a thread for that, sent piece by
//! piece, one at a time: a great day takes no more memory than a small one, and nobody else's time.

use std::io::{self, BufWriter, Write};
use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::extract::State;
use axum::http::HeaderValue;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse as _, Response};
use hyper::body::Bytes;
use jiff::civil::Date;
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::input::Name;
use super::pieces::Pieces;
use super::problem::bad_value;
use super::shared::{Shared, turn};
use crate::control::Problem;
use crate::journal::{self, JournalReport, ReportBounds};

/// The newest of a day, and no more.
const MOST: ReportBounds = ReportBounds { shows: 500, actions: 5_000 };
/// Bytes of a piece, and how many wait for whoever reads them.
const PIECE: usize = 64 << 10;
const WAITING: usize = 2;
/// How long somebody may take to read a report, so that the next one gets a turn.
const READING: Duration = Duration::from_secs(30);

/// The report of a day, by the clock of the hall; empty if nothing was played. Of a day with more than 500 shows or 5,000
/// things that were asked, the newest; `kinocue report` has all. One at a time.
#[utoipa::path(
    get, path = "/api/v1/reports/{day}", tag = "library",
    params(("day" = String, Path, description = "YYYY-MM-DD")), responses((status = 200, body = JournalReport))
)]
pub(super) async fn one(State(shared): State<Arc<Shared>>, Name(day): Name) -> Result<Response, Problem> {
    let day = date(&day)?;
    let turn = turn(&shared.reports, "a report").await?;
    let dir = shared.journal.clone();
    let report = shared.blocking(move || Ok(journal::report(&dir, day, day, MOST)?));
    let report = report.await?;
    let (to, mut written) = mpsc::channel(WAITING);
    let (pieces, body) = mpsc::channel(WAITING);
    tokio::task::spawn_blocking(move || {
        let mut out = BufWriter::with_capacity(PIECE, ReportPieces(to));
        // Where it cannot be written, nobody reads it any more.
        let _ = serde_json::to_writer(&mut out, &report).map_err(io::Error::from).and_then(|()| out.flush());
    });
    tokio::spawn(async move {
        let _turn = turn;
        let pass_on = async {
            while let Some(piece) = written.recv().await {
                if pieces.send(piece).await.is_err() {
                    return;
                }
            }
        };
        let _ = timeout(READING, pass_on).await; // who reads too slowly gets a part, which is no JSON
    });
    let json = HeaderValue::from_static("application/json");
    Ok(([(CONTENT_TYPE, json)], Body::new(Pieces(body))).into_response())
}

/// Pieces on their way out; each write waits until there is room.
struct ReportPieces(mpsc::Sender<Bytes>);

impl Write for ReportPieces {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let sent = self.0.blocking_send(Bytes::copy_from_slice(bytes));
        sent.map(|()| bytes.len()).map_err(|_| io::ErrorKind::BrokenPipe.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// `YYYY-MM-DD` and nothing else that could be taken for a day.
fn date(text: &str) -> Result<Date, Problem> {
    let date = text.parse::<Date>().ok().filter(|date| date.to_string() == text);
    date.ok_or_else(|| bad_value(format!("{text:?} is not a day"), "write it like 2026-01-31"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_is_written_in_one_way() {
        assert!(date("2026-01-31").is_ok());
        for bad in ["", "2026-02-30", "20260131", "2026-01-31T10:00", "2026-1-31", "../2026-01-31", "today"] {
            assert!(date(bad).is_err(), "{bad}");
        }
    }
}
