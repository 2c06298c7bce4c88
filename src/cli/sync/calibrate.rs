use std::time::Duration;

use serde::Serialize;

use super::LabelArgs;
use crate::app::film::{FilmReader, FilmTable, SourceRow, SourceRules};
use crate::cli::{Exit, Failure, exit, print};
use crate::film::point::FilmState;
use crate::film::source::{FilmArgs, FilmSource};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Measures the delay of a capture chain against another source of the same film: the `latency` of [sync.ltc].
///
/// Let mpv play a reel of timecode into a cable back to the input: the result is the delay of the input, plus what mpv does not know
/// of the delay of its own output.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kinocue sync calibrate ltc:alsa:hw:2,0 --against mpv:/run/user/1000/film.sock"
)]
pub(in crate::cli) struct Args {
    /// The source to measure, as for `play --chase`.
    #[arg(value_name = "SOURCE")]
    source: FilmSource,
    /// The reference: a source that knows the position of the same film, such as the mpv that plays the reel.
    #[arg(long, value_name = "SOURCE")]
    against: FilmSource,
    #[command(flatten)]
    labels: LabelArgs,
    /// Duration of the measurement in seconds.
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=3_600))]
    seconds: u32,
    /// Print a JSON object.
    #[arg(long)]
    json: bool,
}

/// How often both are compared.
const EVERY: Duration = Duration::from_millis(50);
/// For how long both may take until it is known where the film is.
const LOCKS_WITHIN: Duration = Duration::from_secs(30);
/// A source that is followed settles for so long before it is compared: a slow one is off by milliseconds at first.
const SETTLES: Duration = Duration::from_secs(2);
/// A reference that is later than the source by more is none.
const NOISE_MS: f64 = 0.5;

/// How much later one source is than another, ms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Lateness {
    median_ms: f64,
    /// Nine in ten are between these.
    low_ms: f64,
    high_ms: f64,
}

impl Lateness {
    fn of(mut each_ms: Vec<f64>) -> Option<Self> {
        each_ms.sort_by(f64::total_cmp);
        let at = |twentieths: usize| each_ms.get(each_ms.len().saturating_sub(1) * twentieths / 20).copied();
        Some(Self { median_ms: at(10)?, low_ms: at(1)?, high_ms: at(19)? })
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let of = |source: &FilmSource| match source {
        // It tells the reel's own time, from its first label on.
        FilmSource::Mpv(_) => Ok(FilmArgs::of(source.clone())),
        _ => args.labels.of(source),
    };
    let sources = [of(&args.source)?, of(&args.against)?];
    let rules = SourceRules { allows_coarse: true, ..SourceRules::default() };
    let reader = FilmReader::start(&sources, rules).map_err(exit::of_film)?;
    wait_for_both(&reader)?;
    let table = reader.table();
    let (begun, span) = (Monotonic.now(), Duration::from_secs(args.seconds.into()));
    let mut each_ms = Vec::new();
    while Monotonic.now().since(begun) < span {
        Monotonic.sleep_until(Monotonic.now() + EVERY);
        each_ms.extend(late_ms(&table.read()));
    }
    let late = Lateness::of(each_ms).ok_or_else(|| lost(&table.read()))?;
    if args.json {
        print::json(&late)?;
    } else {
        print::out(&text(args, late))?;
    }
    Ok(Exit::Done)
}

fn wait_for_both(reader: &FilmReader) -> Result<(), Failure> {
    let begun = Monotonic.now();
    let mut locked = None;
    while locked.is_none_or(|since| Monotonic.now().since(since) < SETTLES) {
        Monotonic.sleep_until(Monotonic.now() + EVERY);
        let table = reader.table().read();
        locked = late_ms(&table).and(locked.or_else(|| Some(Monotonic.now())));
        if locked.is_none() && Monotonic.now().since(begun) > LOCKS_WITHIN {
            return Err(lost(&table));
        }
    }
    Ok(())
}

/// How much later the first is than the second, while both know where the film is.
fn late_ms(table: &FilmTable) -> Option<f64> {
    let at = |row: &SourceRow| row.media_s.filter(|_| row.state == FilmState::Locked);
    let [source, against] = table.sources.as_slice() else { return None };
    Some((at(against)? - at(source)?) * 1e3)
}

fn lost(table: &FilmTable) -> Failure {
    let each = table.sources.iter().map(|row| {
        let trouble = row.notes.trouble.as_ref().map(|trouble| format!(" ({trouble})")).unwrap_or_default();
        format!("{}: {}{trouble}", row.source, row.words)
    });
    let each: Vec<String> = each.collect();
    let error = anyhow::anyhow!("both sources have to be received while the reel plays; {}", each.join("; "));
    Failure { exit: Exit::Unavailable, error }
}

fn text(args: &Args, late: Lateness) -> String {
    let Lateness { median_ms, low_ms, high_ms } = late;
    let (source, against) = (&args.source, &args.against);
    let found = format!(
        "{source} is {median_ms:.1} ms later than {against} ({low_ms:.1} to {high_ms:.1} ms in nine of ten readings).\n"
    );
    if median_ms < -NOISE_MS {
        return found
            + "The reference is the later one: it is no reference, or --tc-start is not the reel's first label.\n";
    }
    if median_ms > 1_000.0 {
        return found + "No capture takes that long: --tc-start is not the reel's first label.\n";
    }
    found + &format!("In the configuration:\n[sync.ltc]\nlatency = \"{:.1}ms\"\n", median_ms.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_the_looks_is_what_is_written_down() {
        let each = (0..=100).map(|n| if n == 50 { 400.0 } else { 10.0 + f64::from(n) * 0.01 });
        let late = Lateness::of(each.collect()).unwrap();
        assert!(
            (late.median_ms - 10.5).abs() < 0.02 && late.low_ms < 10.1 && late.high_ms < 11.0,
            "{late:?}"
        );
        assert_eq!(Lateness::of(Vec::new()), None);
    }
}
