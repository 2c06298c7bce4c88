use std::fmt::Write as _;
use std::io::{self, IsTerminal as _};
use std::time::Duration;

use super::LabelArgs;
use crate::app::film::{FilmReader, FilmTable, SourceRow, SourceRules};
use crate::cli::{Exit, Failure, exit, print};
use crate::film::source::FilmSource;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, ShowTime};

/// Shows what the sources report of a film, without a hall, cue or seat: position and quality of each, and which would lead.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kinocue sync watch artnet:127.0.0.1 mtc:/dev/snd/midiC1D0")]
pub(in crate::cli) struct Args {
    /// The sources, best first, as for `play --chase`.
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<FilmSource>,
    #[command(flatten)]
    labels: LabelArgs,
    /// Let coarse sources lead as well.
    #[arg(long)]
    allow_coarse: bool,
    /// End after this many seconds [default: at Ctrl-C].
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u32).range(1..=86_400))]
    seconds: Option<u32>,
    /// Print a JSON object twice a second.
    #[arg(long)]
    json: bool,
}

/// How often it is said.
const EVERY: Duration = Duration::from_millis(500);

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let sources = args.sources.iter().map(|source| args.labels.of(source)).collect::<Result<Vec<_>, _>>()?;
    let rules = SourceRules { allows_coarse: args.allow_coarse, ..SourceRules::default() };
    let reader = FilmReader::start(&sources, rules).map_err(exit::of_film)?;
    let (table, draws) = (reader.table(), io::stdout().is_terminal() && !args.json);
    let mut drawn = 0;
    let mut at = Monotonic.now();
    let end = args.seconds.map(|seconds| at + Duration::from_secs(seconds.into()));
    while end.is_none_or(|end| at < end) {
        at = at + EVERY;
        Monotonic.sleep_until(at);
        let table = table.read();
        if args.json {
            print::json(&table)?;
            continue;
        }
        let text = text(&table);
        // Over what was said before.
        let up = if draws && drawn > 0 { format!("\x1b[{drawn}A\x1b[J") } else { String::new() };
        drawn = text.lines().count();
        print::out(&(up + &text))?;
    }
    Ok(Exit::Done)
}

fn text(table: &FilmTable) -> String {
    let mut text = String::new();
    for (place, row) in table.sources.iter().enumerate() {
        let leads = if table.leads == Some(place) { "> " } else { "  " };
        let _ = writeln!(text, "{leads}{}", line(row)); // a String takes it
    }
    for warning in table.warnings() {
        let _ = writeln!(text, "  {warning}");
    }
    text
}

fn line(row: &SourceRow) -> String {
    let SourceRow { source, words, notes, .. } = row;
    let mut text = format!("{source}: {words}");
    if let Some(media_s) = row.media_s {
        let _ = write!(text, ", at {}", ShowTime::from_secs_f64(media_s));
    }
    if let (Some(ppm), Some(sigma)) = (row.rate_ppm, row.sigma_ms) {
        let _ = write!(text, ", {ppm:+.0} ppm, sigma {sigma:.2} ms");
    }
    if let Some(fps) = &notes.fps {
        let _ = write!(text, ", {fps} fps");
    }
    if let Some(level) = notes.level_db {
        let _ = write!(text, ", {level:.0} dBFS");
    }
    if let Some(film) = &notes.film {
        let _ = write!(text, ", {film}");
    }
    if let Some(error) = notes.clock_error_ms {
        let _ = write!(text, ", clock within {error:.1} ms");
    }
    let counts = [
        (row.dropouts, "dropouts"),
        (row.jumps, "jumps"),
        (row.rejected, "rejected"),
        (notes.foreign, "from other senders"),
        (notes.garbage, "unreadable"),
    ];
    for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
        let _ = write!(text, ", {count} {what}");
    }
    text
}
