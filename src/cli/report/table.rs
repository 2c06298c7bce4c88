//! A report for people.

use comfy_table::CellAlignment;

use crate::cli::table;
use crate::control::model::FrameCounts;
use crate::journal::{FilmProof, JournalReport, ReportShown, Totals};

/// One row a show, and a line for all together.
pub(super) fn shows(report: &JournalReport) -> String {
    let days = days(report);
    if report.shows.is_empty() {
        return format!("nothing was played {days}\n");
    }
    let mut table = table::ruled();
    table.set_header([
        "start", "cue", "result", "took", "level", "seats", "sent", "acked", "refused", "lost", "missed",
        "late p99", "ack p99", "by",
    ]);
    report.shows.iter().for_each(|one| {
        table.add_row(show(one));
    });
    table
        .column_iter_mut()
        .skip(3)
        .take(10)
        .for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    let events: String = report.shows.iter().map(events).collect();
    let blank = if events.is_empty() { "" } else { "\n" };
    format!("{}\n{blank}{events}\n{}\n", table.trim_fmt(), totals(&report.totals, &days))
}

/// One row for each thing that was asked.
pub(super) fn actions(report: &JournalReport) -> String {
    if report.actions.is_empty() {
        return format!("no commands {}\n", days(report));
    }
    let mut table = table::ruled();
    table.set_header(["at", "who", "what", "result", "state"]);
    for one in &report.actions {
        let often = if one.times > 1 { format!(" ({} times)", one.times) } else { String::new() };
        let result = safe(&one.result) + &often;
        table.add_row([short(&one.at), safe(&one.who), safe(&one.what), result, safe(&one.state)]);
    }
    format!("{}\n", table.trim_fmt())
}

fn days(report: &JournalReport) -> String {
    if report.from == report.to {
        format!("on {}", report.from)
    } else {
        format!("from {} to {}", report.from, report.to)
    }
}

fn show(show: &ReportShown) -> Vec<String> {
    let record = &show.record;
    let mut row = vec![
        short(&record.start),
        safe(&record.cue),
        show.result.word().to_owned(),
        show.took_s.map_or_else(String::new, span),
        format!("{:.0} %", 100.0 * record.level),
        format!("{}/{}", record.seats_available, record.seats_total),
    ];
    match &record.outcome {
        None => row.resize(13, String::new()),
        Some(one) => {
            row.extend([one.frames.sent.to_string(), acked(one.frames)]);
            row.extend(
                [one.frames.refused, one.frames.lost, one.missed_ticks].map(|count| count.to_string()),
            );
            row.extend([one.lateness.p99_us, one.ack.p99_us].map(micros));
        }
    }
    let marks = [(record.scheduled, " (scheduled)"), (record.out_of_hours, " (out of hours)")];
    let marks: String = marks.iter().filter(|(on, _)| *on).map(|(_, mark)| *mark).collect();
    row.push(safe(&record.operator) + &marks);
    row
}

/// What happened in a show, under its start, and first how it followed its film.
fn events(show: &ReportShown) -> String {
    let outcome = show.record.outcome.as_ref();
    let film = outcome.and_then(|outcome| outcome.film.as_ref()).map(film);
    let events = outcome.iter().flat_map(|outcome| &outcome.events).cloned();
    film.into_iter()
        .chain(events)
        .map(|event| format!("{} {}: {}\n", short(&show.record.start), safe(&show.record.cue), safe(&event)))
        .collect()
}

/// By which source a show followed its film, and how well.
fn film(film: &FilmProof) -> String {
    let FilmProof { sources, switches, greatest_error_ms } = film;
    match greatest_error_ms {
        None => "the seats never followed the film".to_owned(),
        Some(ms) => {
            let often = match switches {
                0 => String::new(),
                1 => ", the source changed once".to_owned(),
                often => format!(", the source changed {often} times"),
            };
            format!("followed the film by {}, at the most {ms:.2} ms from it{often}", sources.join(", "))
        }
    }
}

fn totals(totals: &Totals, days: &str) -> String {
    let Totals {
        shows,
        completed,
        stopped,
        faults,
        interrupted,
        running,
        took_s,
        frames: FrameCounts { sent, acked, refused, lost, .. },
    } = totals;
    let noun = if *shows == 1 { "show" } else { "shows" };
    let parts = [
        (*completed, "completed"),
        (*stopped, "stopped"),
        (*faults, "with a fault"),
        (*interrupted, "interrupted"),
        (*running, "running"),
    ];
    let parts: Vec<_> =
        parts.iter().filter(|(count, _)| *count > 0).map(|(count, word)| format!("{count} {word}")).collect();
    let took = span(*took_s);
    format!(
        "{shows} {noun} {days}: {}; {took} in all; {sent} frames sent, {acked} acked, {refused} refused, {lost} lost",
        parts.join(", ")
    )
}

#[expect(clippy::cast_precision_loss, reason = "for people")]
fn acked(frames: FrameCounts) -> String {
    match frames.asked {
        0 => "–".to_owned(),
        // Rounded down, so that only all of them are 100 %.
        asked => format!("{:.2} %", (10_000.0 * frames.acked as f64 / asked as f64).floor() / 100.0),
    }
}

fn micros(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |us| format!("{us:.0} µs"))
}

/// `HH:MM:SS`.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a saturating cast is what is wanted"
)]
fn span(seconds: f64) -> String {
    let s = seconds.round() as u64;
    format!("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

/// `2026-11-21 19:00:03`.
fn short(stamp: &str) -> String {
    safe(&stamp.chars().take(19).collect::<String>().replace('T', " "))
}

/// A text of the journal, which may have come from anywhere, without what a terminal would obey.
fn safe(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}
