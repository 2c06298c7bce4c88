//! `kinocue record info`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use serde::Serialize;

use super::super::{Exit, Failure, print};
use super::{open, shown, unread, wall, wall_in_zone};
use crate::record::{Contents, Margin, Quantity, Summary, note_in_words, summarize};
use crate::time::ShowTime;

/// Above this part of a limit what was sent is a fault of ours.
const OVER: f64 = 1.01;
/// Happenings that are printed.
const PRINTED: usize = 40;

/// Shows the contents of a recording: seats, counts, what came nearest to its limits, and events.
///
/// Exits with 1 if a seat was sent beyond a limit by more than 1 %.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  kinocue record info ride.mcap\n  kinocue record info ride.mcap --json")]
pub(in super::super) struct Args {
    /// The recording.
    file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let (contents, summary) = summarize(open(&args.file)?).map_err(|error| unread(error, &args.file))?;
    if args.json {
        print::json(&InfoTold::new(&contents, &summary))?;
    } else {
        print::out(&text(&args.file.display().to_string(), &contents, &summary))?;
    }
    let is_over = summary.nearest().is_some_and(|margin| margin.part() > OVER);
    Ok(if is_over { Exit::CheckFailed } else { Exit::Done })
}

#[derive(Debug, Serialize)]
struct InfoTold<'a> {
    metadata: &'a BTreeMap<String, String>,
    end: &'a BTreeMap<String, String>,
    messages: &'a BTreeMap<String, u64>,
    attachments: &'a BTreeMap<String, usize>,
    flaws: Vec<String>,
    #[serde(flatten)]
    summary: &'a Summary,
}

impl<'a> InfoTold<'a> {
    fn new(contents: &'a Contents, summary: &'a Summary) -> Self {
        let Contents { begin, end, messages, attachments, .. } = contents;
        Self { metadata: begin, end, messages, attachments, flaws: contents.flaws(), summary }
    }
}

fn put(out: &mut String, text: std::fmt::Arguments<'_>) {
    out.write_fmt(format_args!("{text}\n")).expect("a String takes all text");
}

/// A line for each seat, below what stands in them.
fn seats(summary: &Summary) -> String {
    let mut out = String::new();
    let mut line = |text: std::fmt::Arguments<'_>| put(&mut out, text);
    line(format_args!(
        "  {:<12}{:>10}{:>8}{:>8}{:>10}  {:>7}{:>7}{:>7}",
        "seat", "sent", "unsent", "clamps", "apart", "speed", "acc", "jerk"
    ));
    for seat in &summary.seats {
        let part = |quantity| {
            let of_seat = summary.most.iter().filter(|one| one.seat == seat.name && one.quantity == quantity);
            let most = of_seat.map(Margin::part).reduce(f64::max);
            most.map_or_else(|| "–".to_owned(), |most| format!("{:.0} %", 100.0 * most))
        };
        let [speed, acceleration, jerk] = Quantity::ALL.map(part);
        let apart = format!("{:.2}", seat.apart);
        line(format_args!(
            "  {:<12}{:>10}{:>8}{:>8}{apart:>10}  {speed:>7}{acceleration:>7}{jerk:>7}",
            shown(&seat.name),
            seat.sent,
            seat.unsent,
            seat.clamps
        ));
    }
    out
}

fn text(name: &str, contents: &Contents, summary: &Summary) -> String {
    let mut out = String::new();
    let mut line = |text: std::fmt::Arguments<'_>| put(&mut out, text);
    let entry = |key| match contents.entry(key) {
        "" => "–".to_owned(),
        text => shown(text),
    };
    let of = ["cue", "cause", "of"].into_iter().find(|key| !contents.entry(key).is_empty()).unwrap_or("cue");
    line(format_args!(
        "{name}: {} recording of {}, {} Hz, by {}",
        entry("mode"),
        entry(of),
        entry("rate_hz"),
        entry("program")
    ));
    if !contents.entry("title").is_empty() {
        line(format_args!("  title     {}", entry("title")));
    }
    line(format_args!("  hall      {}, {} seats", entry("hall"), contents.seats.len()));
    line(format_args!("  digest    {}", entry("cue_sha256")));
    if !["", "1"].contains(&contents.entry("part")) {
        let part = entry("part");
        line(format_args!(
            "  part      {part} of its show; what was before is in the files with this digest before it"
        ));
    }
    if let Some((first, last)) = contents.span {
        let length = ShowTime::from_nanos((last - first).cast_signed());
        line(format_args!("  time      {} to {}, {length}", wall(first), wall_in_zone(last)));
    }
    if let Some((from, until)) = summary.film {
        line(format_args!("  film      {} to {}", film(from), film(until)));
    }
    let Summary { ticks, missed, dropped, late_max_us, late_film_s, .. } = summary;
    line(format_args!("  ticks     {ticks}, {missed} missed, {dropped} not recorded"));
    line(format_args!("  latest    {late_max_us:.0} µs at {}", film(*late_film_s)));
    if let Some(margin) = summary.nearest() {
        line(format_args!("  nearest   {}", margin.in_words()));
    }
    out += &seats(summary);
    let mut line = |text: std::fmt::Arguments<'_>| put(&mut out, text);
    for (topic, count) in &contents.messages {
        line(format_args!("  {count:>9} × {}", shown(topic)));
    }
    for (name, size) in &contents.attachments {
        line(format_args!("  attached  {}, {size} bytes", shown(name)));
    }
    for one in summary.happenings.iter().take(PRINTED) {
        let text = note_in_words(&one.topic, &one.text).map_or_else(|| one.text.clone(), |text| shown(&text));
        line(format_args!("  {} film {} {} {text}", wall(one.wall_ns), film(one.film_s), one.topic));
    }
    let more = summary.more + summary.happenings.len().saturating_sub(PRINTED) as u64;
    if more > 0 {
        line(format_args!("  and {more} more; --json has them"));
    }
    for flaw in contents.flaws() {
        line(format_args!("  {flaw}"));
    }
    out
}

fn film(seconds: f64) -> ShowTime {
    ShowTime::from_secs_f64(seconds)
}
