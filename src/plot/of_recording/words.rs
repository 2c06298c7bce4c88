//! What a picture of a recording says in words: the sentence, the facts below it, a row for each seat.

use super::gather::{APART, Gathered};
use crate::plain::escaped;
use crate::plot::text::number;
use crate::plot::{Table, TimeAxis};
use crate::record::{Contents, FilmInstant, SeatFall, Summary};
use crate::time::ShowTime;

/// A tick is late from here on, µs.
const LATE_US: f64 = 1_000.0;
/// An ack is late from here on, µs: without one for so long a seat falls out.
const ACK_US: f64 = 50_000.0;
/// A level has changed from here on.
const LEVEL: f64 = 0.05;

/// To two places where that is little.
pub(super) fn places(value: f64) -> String {
    if value < 10.0 { format!("{value:.2}") } else { number(value) }
}

pub(super) fn title(contents: &Contents, seat: &str) -> String {
    let title = contents.entry("title");
    format!("{}, {seat}", if title.is_empty() { what(contents) } else { title })
}

/// What it is a recording of: a cue, or else an incident, a test, a homing.
fn what(contents: &Contents) -> &str {
    let cue = contents.entry("cue");
    if cue.is_empty() { contents.entry("of") } else { cue }
}

/// What happened to a seat, for whoever asks why it jerked.
pub(super) fn sentence(name: &str, gathered: &Gathered, rate_hz: f64) -> String {
    let counts = &gathered.counts;
    if counts.sent + counts.unsent == 0 && gathered.falls.count == 0 {
        return format!("{name}: nothing was sent in what is shown.");
    }
    let held = counts.apart > APART || counts.clamps > 0;
    let fell = fallen(gathered);
    let mut words = match &fell {
        Some(how) => format!("{name}{how}; "),
        None if held => format!("{name} at {}: ", counts.apart_at),
        None => format!("{name}: "),
    };
    words += &if held {
        // From tick to tick it is one period longer than from the first instant to the last.
        let ms = 1_000.0 * (counts.held + if gathered.is_whole { 1.0 / rate_hz } else { 0.05 });
        let about = if gathered.is_whole { "" } else { "about " };
        let at = if fell.is_some() { format!(" at {}", counts.apart_at) } else { String::new() };
        format!("held back by the limiter for {about}{ms:.0} ms{at}, by up to {} mm", places(counts.apart))
    } else if fell.is_some() {
        "otherwise sent as it was asked for".to_owned()
    } else {
        "sent as it was asked for".to_owned()
    };
    if let Some((from, to, at)) = counts.level.most.filter(|(from, to, _)| (to - from).abs() >= LEVEL) {
        words += &format!("; its level went from {:.0} % to {:.0} % at {at}", 100.0 * from, 100.0 * to);
    }
    let late = if counts.missed > 0 {
        format!("{} ticks missed", counts.missed)
    } else if counts.late_us > LATE_US {
        format!("latest {:.1} ms at {}", counts.late_us / 1e3, counts.late_at)
    } else {
        "nothing late".to_owned()
    };
    let acks = match (counts.lost, counts.refused, counts.acked) {
        (0, 0, 0) => "no acks recorded".to_owned(),
        (0, 0, _) => "all acked".to_owned(),
        (lost, 0, _) => format!("{lost} lost"),
        (lost, refused, _) => format!("{lost} lost, {refused} refused"),
    };
    words += &format!("; {late}, {acks}");
    if counts.ack_us > ACK_US {
        words += &format!(", the slowest ack after {:.0} ms", counts.ack_us / 1e3);
    }
    if counts.unsent > 0 {
        words += &format!(", {} not taken by the kernel", counts.unsent);
    }
    if counts.dropped > 0 {
        words += &format!(", {} ticks not recorded", counts.dropped);
    }
    words + "."
}

/// That a seat fell out, which is graver than all else, since when it stood still, when that was found and why; `None` where it did not.
fn fallen(gathered: &Gathered) -> Option<String> {
    let SeatFall { still, out, standing, back, moved } = gathered.falls.first?;
    let axis = &gathered.look.axis;
    let place = |(at, film_s): FilmInstant| {
        let moment = axis.moment(at, film_s, gathered.sample_s);
        moment.map_or_else(|| ShowTime::from_secs_f64(film_s).to_string(), |moment| moment.to_string())
    };
    let stood = match (still.map(place), moved.map(place)) {
        (Some(from), Some(to)) => format!(" stood still from {from} to {to}"),
        (Some(from), None) => format!(" stood still from {from} on"),
        (None, _) => String::new(),
    };
    let why = gathered.why_fallen().map(|why| format!(" ({})", escaped(why, 200))).unwrap_or_default();
    let times = match gathered.falls.count {
        1 => String::new(),
        times => format!(" for the first of {times} times"),
    };
    let back = match back.map(place) {
        Some(back) => format!("back in play at {back}"),
        None => "not back in what is shown".to_owned(),
    };
    Some(format!("{stood}: judged {standing} at {}{times}{why}, {back}", place(out)))
}

pub(super) fn facts(contents: &Contents, summary: &Summary, gathered: &Gathered) -> Vec<String> {
    let entry = |key| contents.entry(key);
    let nearest =
        summary.nearest().map(|margin| format!("Nearest to its limit in all of it: {}.", margin.in_words()));
    let digest = match entry("cue_sha256") {
        "" => String::new(),
        digest => format!("digest {digest}, "),
    };
    let mut facts = vec![
        format!(
            "{} recording of {}, hall {}, {} Hz",
            entry("mode"),
            what(contents),
            entry("hall"),
            entry("rate_hz")
        ),
        format!("{digest}recorded by {}, drawn by kinocue {}", entry("program"), env!("CARGO_PKG_VERSION")),
    ];
    facts.extend(nearest);
    let mut fell =
        summary.seats.iter().filter(|seat| seat.falls.count > 0).map(|seat| seat.name.as_str()).peekable();
    if fell.peek().is_some() {
        facts.push(format!("Fell out: {}.", fell.collect::<Vec<_>>().join(", ")));
    }
    facts.extend(passes(&gathered.look.axis.time));
    if gathered.flags.more > 0 {
        facts.push(format!(
            "{} more marks, events and requests have no flag; record info lists them.",
            gathered.flags.more
        ));
    }
    if summary.dropped > 0 {
        facts.push(format!("{} ticks were not recorded.", summary.dropped));
    }
    if let Some(trouble) = &contents.trouble {
        facts.push(format!("The file {trouble}."));
    }
    if let Some(why) = &contents.recovered {
        facts.push(format!("Recovered from a file that {why}."));
    }
    facts
}

/// That the film ran over what is shown more than once, and what each pass is.
fn passes(time: &TimeAxis) -> Option<String> {
    /// Of more it is said how many there are.
    const TOLD: usize = 8;
    let passes = time.passes();
    let clock = ShowTime::from_secs_f64;
    let told = passes.iter().take(TOLD).zip(1..);
    let told =
        told.map(|(pass, number)| format!("{number}: {} to {}", clock(pass.film_s), clock(pass.until_s)));
    let told = told.collect::<Vec<_>>().join(", ");
    let more = passes.len().saturating_sub(TOLD);
    let more = if more > 0 { format!(", and {more} more") } else { String::new() };
    let count = passes.len();
    (count > 0).then(|| {
        format!("The film ran through this {count} times, side by side in the picture; {told}{more}.")
    })
}

/// A row for each seat.
pub(super) fn seats(summary: &Summary) -> Table {
    let row = |seat: &crate::record::SeatTotals| {
        let of_seat = summary.most.iter().filter(|one| one.seat == seat.name);
        let nearest = of_seat.max_by(|one, other| one.part().total_cmp(&other.part()));
        let word = |margin: &crate::record::Margin| {
            format!("a{} {} {:.0} %", margin.axis, margin.quantity.word(), 100.0 * margin.part())
        };
        [
            seat.name.clone(),
            seat.sent.to_string(),
            seat.unsent.to_string(),
            seat.clamps.to_string(),
            format!("{} at {}", places(seat.apart), ShowTime::from_secs_f64(seat.apart_film_s)),
            nearest.map(word).unwrap_or_default(),
        ]
    };
    Table {
        name: "Seats",
        head: ["seat", "sent", "not taken", "held back", "farthest apart", "nearest to a limit"],
        rows: summary.seats.iter().map(row).collect(),
    }
}
