//! `/api/v1/reports/{day}`: what was played on a day, and what was asked.

use std::sync::Arc;

use axum::Json as JsonReply;
use axum::extract::State;
use jiff::civil::Date;

use super::input::Name;
use super::problem::bad_value;
use super::shared::Shared;
use crate::hall::{Code, Problem};
use crate::journal::{self, Report};

/// The report of a day, by the clock of the hall; empty where nothing was played.
#[utoipa::path(
    get, path = "/api/v1/reports/{day}", tag = "library",
    params(("day" = String, Path, description = "YYYY-MM-DD")), responses((status = 200, body = Report))
)]
pub(super) async fn one(
    State(shared): State<Arc<Shared>>,
    Name(day): Name,
) -> Result<JsonReply<Report>, Problem> {
    let day = date(&day)?;
    let dir = shared.journal.clone();
    let report = shared.blocking(move || {
        journal::report(&dir, day, day).map_err(|error| {
            Problem::new(Code::File, error.to_string(), "look at the folder of the journal and its disk")
        })
    });
    report.await.map(JsonReply)
}

/// `YYYY-MM-DD` and nothing else that could be taken for a day.
fn date(text: &str) -> Result<Date, Problem> {
    let date = text.parse::<Date>().ok().filter(|date| date.to_string() == text);
    date.ok_or_else(|| bad_value(format!("{text:?} is no day"), "write it as 2026-01-31"))
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
