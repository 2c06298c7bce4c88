//! A report for people.

use comfy_table::CellAlignment;

use crate::cli::table;
use crate::control::model::FrameCounts;
use crate::journal::{FilmProof, JournalReport, ReportShown, SeatOut, Totals};

/// Seats that a line names, and events of a show that have a line each.
const NAMED: usize = 6;
const EVENTS: usize = 3;
/// States that every show goes through.
const USUAL: [&str; 4] = ["joining", "playing", "parking", "parked"];
/// Words that an event of the hall begins with.
const STATES: [&str; 14] = [
    "boot",
    "recovering",
    "parked",
    "homing",
    "armed",
    "waiting",
    "joining",
    "playing",
    "holding",
    "paused",
    "parking",
    "stopping",
    "stopped",
    "fault",
];

/// One row a show, and a line for all together.
pub(super) fn shows(report: &JournalReport) -> String {
    let days = days(report);
    if report.shows.is_empty() {
        return format!("nothing was played {days}\n");
    }
    let mut table = table::ruled();
    table.set_header([
        "start", "cue", "result", "took", "level", "seats", "out", "sent", "acked", "refused", "lost",
        "missed", "late p99", "ack p99", "by",
    ]);
    report.shows.iter().for_each(|one| {
        table.add_row(show(one));
    });
    table
        .column_iter_mut()
        .skip(3)
        .take(11)
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
        format!("on {}{}", report.from, zone(report))
    } else {
        format!("from {} to {}{}", report.from, report.to, zone(report))
    }
}

/// The zone of the times, which is that of the server: the offsets that the stamps have.
fn zone(report: &JournalReport) -> String {
    let stamps = report.shows.iter().map(|show| &show.record.start);
    let stamps = stamps.chain(report.actions.iter().map(|action| &action.at));
    let mut zones: Vec<&str> = stamps.filter_map(|stamp| stamp.get(23..)).collect();
    zones.dedup();
    if zones.is_empty() { String::new() } else { format!(" (UTC{})", safe(&zones.join(", then "))) }
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
        None => row.resize(14, String::new()),
        Some(one) => {
            row.extend([out(&one.seats_out), one.frames.sent.to_string(), acked(one.frames)]);
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

/// How many seats fell out, and the longest time that one of them was out.
fn out(seats: &[SeatOut]) -> String {
    let longest = seats.iter().map(|seat| seat.out_s).fold(0.0, f64::max);
    if seats.is_empty() { "0".to_owned() } else { format!("{}, {}", seats.len(), span(longest.ceil())) }
}

/// What is worth reading of a show, under its start: how it followed its film, its seats, and the first of all else.
fn events(show: &ReportShown) -> String {
    let Some(outcome) = &show.record.outcome else { return String::new() };
    let fallen = (!outcome.seats_out.is_empty()).then(|| fallen(&outcome.seats_out));
    // Where seats are told of in figures, their events are left to --json.
    let is_seat = |event: &&String| !outcome.seats_out.is_empty() && !is_of_hall(event);
    let mut events: Vec<&String> =
        outcome.events.iter().filter(|event| !is_usual(event) && !is_seat(event)).collect();
    let more = events.len().saturating_sub(EVENTS);
    events.truncate(EVENTS);
    let rest = (more > 0).then(|| format!("and {more} more (--json has all)"));
    outcome
        .film
        .as_ref()
        .map(film)
        .into_iter()
        .chain(fallen)
        .chain(events.into_iter().cloned())
        .chain(rest)
        .map(|event| format!("{} {}: {}\n", short(&show.record.start), safe(&show.record.cue), safe(&event)))
        .collect()
}

/// The seats that fell out, longest first.
fn fallen(seats: &[SeatOut]) -> String {
    let mut seats: Vec<&SeatOut> = seats.iter().collect();
    seats.sort_by(|one, other| other.out_s.total_cmp(&one.out_s));
    let one = |seat: &&SeatOut| {
        let often = if seat.times > 1 { format!(" in {} falls", seat.times) } else { String::new() };
        format!("{} {:.1} s{often}", seat.seat, seat.out_s)
    };
    let named: Vec<String> = seats.iter().take(NAMED).map(one).collect();
    let more = seats.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    format!("out: {}{more}", named.join(", "))
}

/// The words of an event behind its time of the day.
fn text_of(event: &str) -> &str {
    event.split_once(' ').filter(|(at, _)| at.len() == 8).map_or(event, |(_, text)| text)
}

/// An event of the hall begins with its state.
fn is_of_hall(event: &str) -> bool {
    let state = text_of(event).split_once(':').map_or("", |(state, _)| state);
    STATES.contains(&state)
}

/// What happens in each show.
fn is_usual(event: &str) -> bool {
    let text = text_of(event);
    USUAL.iter().any(|usual| text.strip_prefix(usual).is_some_and(|rest| rest.starts_with(':')))
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
