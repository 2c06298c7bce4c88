//! `kinocue replay`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use serde::Serialize;

use super::record::{open, shown, wall};
use super::{Exit, Failure, print};
use crate::record::Contents;
use crate::replay::{ReplayDifference, ReplayError, ReplayVerdict, replay};
use crate::time::ShowTime;

/// Differences that are printed.
const PRINTED: usize = 20;

/// Judges a full recording again, and says what differs.
///
/// Gives its frames and replies, at their instants, to the books of frames, the observer and the health of a hall in virtual time, and
/// compares what these say with what was recorded: the fate of each reply and its latency, lost frames, how seats stood, and the report.
/// Nothing is sent.
///
/// Ends with 1 where anything differs.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  kinocue replay ride.mcap\n  kinocue replay ride.mcap --json")]
pub(super) struct Args {
    /// The recording: of a play with --record-mode full, an incident, or a cut with --whole.
    file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct ReplayTold<'a> {
    equal: bool,
    flaws: Vec<String>,
    #[serde(flatten)]
    verdict: &'a ReplayVerdict,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let (contents, verdict) = replay(open(&args.file)?).map_err(|error| failure(error, &args.file))?;
    // A file in which nothing was judged does not pass for one that was judged well.
    let equal = verdict.differences.is_empty() && is_judged(&verdict);
    if args.json {
        print::json(&ReplayTold { equal, flaws: contents.flaws(), verdict: &verdict })?;
    } else {
        print::out(&text(&args.file, &contents, &verdict))?;
    }
    Ok(if equal { Exit::Done } else { Exit::CheckFailed })
}

/// True if it has a reply, or a change of how a seat stood.
const fn is_judged(verdict: &ReplayVerdict) -> bool {
    verdict.fates > 0 || verdict.standings > 0
}

fn failure(error: ReplayError, path: &Path) -> Failure {
    let exit = if matches!(error, ReplayError::Read(_)) { Exit::BadCue } else { Exit::Usage };
    Failure { exit, error: anyhow!(error).context(path.display().to_string()) }
}

fn text(path: &Path, contents: &Contents, verdict: &ReplayVerdict) -> String {
    let ReplayVerdict { drains, frames, fates, standings, from_the_start, gaps, unjudged, .. } = verdict;
    let count = verdict.differences.len() as u64 + verdict.more;
    let outcome = match count {
        0 if !is_judged(verdict) => {
            "nothing to judge: it has neither replies nor seats that came or went".to_owned()
        }
        0 => "no difference".to_owned(),
        1 => "1 difference".to_owned(),
        count => format!("{count} differences"),
    };
    let mut out = format!("{}: {outcome}\n", path.display());
    let mut line = |text: std::fmt::Arguments<'_>| {
        out.write_fmt(format_args!("  {text}\n")).expect("a String takes all text");
    };
    line(format_args!(
        "{frames} frames, {fates} replies, {standings} changes of how seats stood, in {drains} looks"
    ));
    if !from_the_start {
        line(format_args!("it begins in the middle: seats are judged once they stood well for two seconds"));
    }
    if *gaps > 0 {
        line(format_args!(
            "{gaps} times something was not recorded; what follows is judged from where enough is known"
        ));
    }
    if *unjudged > 0 {
        line(format_args!(
            "{unjudged} times a seat was lost whose last look is from before the recording: how it came back is not judged"
        ));
    }
    for one in verdict.differences.iter().take(PRINTED) {
        line(format_args!("{}", in_words(one)));
    }
    if count > PRINTED as u64 {
        line(format_args!("and {} more; --json has the first hundred", count - PRINTED as u64));
    }
    for flaw in contents.flaws() {
        line(format_args!("{flaw}"));
    }
    out
}

fn in_words(difference: &ReplayDifference) -> String {
    let ReplayDifference { wall_ns, film_s, seat, what, recorded, replayed } = difference;
    let film = ShowTime::from_secs_f64(*film_s);
    let seat = seat.as_deref().map_or_else(String::new, |seat| format!("{}: ", shown(seat)));
    let ms = wall_ns / 1_000_000 % 1_000;
    format!("{}.{ms:03} film {film} {seat}{what}: recorded {recorded}, now {replayed}", wall(*wall_ns))
}
