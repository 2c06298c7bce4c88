//! `kinocue record compare`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::super::{Exit, Failure, print};
use super::{open, shown, tell_flaws, unread};
use crate::record::{Comparison, Places, compare, tracks};
use crate::time::ShowTime;

/// Events of each that are printed.
const PRINTED: usize = 20;

/// Compares two recordings by show time: how far the sent positions differ, for each axis of each seat, how much later the second was, and
/// what happened in one alone.
///
/// Exits with 1 if an axis differs by more than the tolerance, a seat is in one alone, either is cut short or damaged, or nothing could be
/// compared.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kinocue record compare before.mcap ride.mcap --tolerance 0.1mm")]
pub(in super::super) struct Args {
    /// The first recording.
    one: PathBuf,
    /// The second recording.
    other: PathBuf,
    /// How far an axis may differ, mm or degrees.
    #[arg(long, value_name = "LENGTH", default_value = "0.1mm", value_parser = tolerance)]
    tolerance: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

fn tolerance(text: &str) -> Result<f64, String> {
    let number = text.trim_end_matches("mm").trim_end_matches("deg").trim();
    let length = number.parse().ok().filter(|length: &f64| length.is_finite() && *length >= 0.0);
    length.ok_or_else(|| "a tolerance is a length such as 0.1mm".to_owned())
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let read = |path: &Path| tracks(open(path)?, Places::Sent).map_err(|error| unread(error, path));
    let comparison = compare(&read(&args.one)?, &read(&args.other)?);
    if args.json {
        print::json(&comparison)?;
    } else {
        print::out(&text(&comparison))?;
    }
    let is_over = comparison.axes.iter().any(|axis| axis.greatest > args.tolerance);
    let nothing = comparison.axes.iter().all(|axis| axis.compared == 0);
    let [one, other] = &comparison.flaws;
    let read = [tell_flaws(&args.one, one), tell_flaws(&args.other, other)];
    let is_sound = read == [Exit::Done; 2] && !is_over && !nothing && comparison.alone.is_empty();
    Ok(if is_sound { Exit::Done } else { Exit::CheckFailed })
}

fn text(comparison: &Comparison) -> String {
    let mut out = String::new();
    for axis in &comparison.axes {
        let at = ShowTime::from_secs_f64(axis.film_s);
        let name = shown(&axis.seat);
        writeln!(
            out,
            "{name} a{}: {:.3} at {at} at most, {:.4} rms, {} instants",
            axis.axis, axis.greatest, axis.rms, axis.compared
        )
        .expect("a String takes all text");
    }
    if let Some(lag) = comparison.lag_ms {
        let words = match lag {
            0.0 => "neither lags behind the other".to_owned(),
            ..0.0 => format!("the first is {:.1} ms later by show time", -lag),
            _ => format!("the second is {lag:.1} ms later by show time"),
        };
        out += &format!("{words}\n");
    }
    for (name, events) in ["first", "second"].into_iter().zip(&comparison.events) {
        for event in events.iter().take(PRINTED) {
            let at = ShowTime::from_secs_f64(event.film_s);
            out += &format!("only in the {name}: {at} {} {}\n", event.topic, event.text);
        }
        if events.len() > PRINTED {
            out += &format!("only in the {name}: {} more; --json has them\n", events.len() - PRINTED);
        }
    }
    for seat in &comparison.alone {
        out += &format!("{}: only in one of them\n", shown(seat));
    }
    if comparison.axes.is_empty() {
        out += "no seat is in both\n";
    }
    if !comparison.whole {
        out += "only samples were compared, 20 a second, each the worst of its window; full recordings have every tick\n";
    }
    out
}
