//! The film of a hall as surfaces show it.

use super::act::Act;
use super::hall::HallContext;
use crate::app::film::{FilmTable, SharedTable, SourceRow};
use crate::control::{Coded, FilmDisagreement, FilmSourceStatus, FilmStatus, Problem};
use crate::film::point::FilmState;
use crate::film::words::FilmLed;
use crate::state::State;
use crate::time::ShowTime;

/// The film by the source that leads, or by the first while none does.
pub(super) fn status(table: &FilmTable, hall: &HallContext) -> FilmStatus {
    let follows = hall.cued.as_ref().and_then(|cued| cued.film);
    let begin_s = follows.map_or(0.0, |film| film.begin.as_secs_f64());
    let best = table.leads.or(Some(0)).and_then(|place| table.sources.get(place));
    let state = best.map_or(FilmState::Absent, |row| row.state);
    let error_ms = hall.live.film_error_s().map(|error_s| error_s * 1e3);
    let (code, next) = state.next(led(hall, error_ms));
    FilmStatus {
        state: state.word().to_owned(),
        cause: best.map(cause).unwrap_or_default(),
        next: next.to_owned(),
        next_coded: Coded::new(code, []),
        leads: follows.is_some(),
        source: table.leads.and(best).map(|row| row.source.clone()),
        position_s: best.and_then(|row| row.media_s).map(|at| at - begin_s),
        rate_ppm: best.and_then(|row| row.rate_ppm),
        error_ms,
        timecode: table.leads.and(best).and_then(|row| row.timecode.clone()),
        disagrees: table.disagrees.and_then(|two| {
            let source = table.sources.get(two.source)?.source.clone();
            Some(FilmDisagreement { source, ahead_s: two.ahead_s })
        }),
        chosen: table.chosen.and_then(|place| Some(table.sources.get(place)?.source.clone())),
        switches: table.switches,
        joins: hall.live.film_joins(),
        sources: table.sources.iter().map(|row| source(row, begin_s)).collect(),
    }
}

/// What the hall's seats do with a film that can be followed.
fn led(hall: &HallContext, error_ms: Option<f64>) -> FilmLed {
    match hall.mirror.state {
        _ if error_ms.is_some() => FilmLed::Following,
        State::Playing(_) => FilmLed::Joining,
        _ if hall.player.is_some() => FilmLed::Own,
        _ => FilmLed::Nobody,
    }
}

/// On which side of the cue that waits for it the film is, where it is outside; in words that do not change as it runs.
pub(super) fn outside(hall: &HallContext) -> Option<&'static str> {
    let (cued, table) = (hall.cued.as_ref()?, hall.film.as_ref()?.read());
    let row = table.sources.get(table.leads.unwrap_or(0))?;
    let at = ShowTime::from_secs_f64(row.media_s?).since(cued.film?.begin);
    match at {
        at if at < ShowTime::ZERO => Some("it is before the beginning of the cue"),
        at if at > cued.timeline.duration() => Some("it is behind the end of the cue"),
        _ => None,
    }
}

/// A person chooses the source that is followed, or leaves it to the ranking.
pub(super) fn choose(name: Option<&str>, hall: &HallContext) -> Result<Vec<Act>, Problem> {
    let Some(table) = &hall.film else { return Err(Problem::no_film()) };
    if table.choose(name) {
        return Ok(Vec::new());
    }
    let names: Vec<_> = table.read().sources.into_iter().map(|row| row.source).collect();
    let remedy = format!("choose one of {}, or none", names.join(", "));
    Err(Problem::unknown("source", name.unwrap_or_default(), names.iter().map(String::as_str), remedy))
}

/// How long so many frames of the film last, ms.
pub(super) fn frames_ms(frames: i32, hall: &HallContext) -> i32 {
    hall.film.as_ref().map(SharedTable::read).unwrap_or_default().frames_ms(frames)
}

fn source(row: &SourceRow, begin_s: f64) -> FilmSourceStatus {
    FilmSourceStatus {
        source: row.source.clone(),
        state: row.state.word().to_owned(),
        cause: cause(row),
        trouble: trouble(row),
        position_s: row.media_s.map(|at| at - begin_s),
        timecode: row.timecode.clone(),
        rate_ppm: row.rate_ppm,
        sigma_ms: row.sigma_ms,
        may_lead: row.may_lead,
        dropouts: row.dropouts,
        freewheel_s: row.freewheel_s,
        rejected: row.rejected,
        jumps: row.jumps,
        level_dbfs: row.notes.level_db,
        foreign: row.notes.foreign,
        garbage: row.notes.garbage,
    }
}

/// What the state of a source means, and what is wrong with it.
fn cause(row: &SourceRow) -> String {
    trouble(row).map_or_else(|| row.words.to_owned(), |why| format!("{}: {why}", row.words))
}

/// What is wrong with a source.
fn trouble(row: &SourceRow) -> Option<String> {
    let troubles: Vec<&str> =
        [&row.notes.trouble, &row.notes.refused].into_iter().flatten().map(|one| &**one).collect();
    (!troubles.is_empty()).then(|| troubles.join(": "))
}
