//! `kinocue report`.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use jiff::civil::Date;

use super::{Exit, Failure, OrExit as _, load, places, print};
use crate::config::journal_in;
use crate::journal::{self, JournalError, JournalKeys, JournalReport, ReportBounds};
use crate::sys::clock::local_now;

mod csv;
mod table;

/// Reports what was played, or what operators requested.
///
/// Lists every show of a day with its cue, levels, seats, frames and how it ended, and the totals.
///
/// Reads the journal that `kinocue serve` writes, even while the service runs. A show that neither
/// ended nor is still running is reported as interrupted. Truncated journal lines are skipped with a
/// note. Lines that are missing, altered or put in are named and do not count.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  kinocue report --day yesterday
  kinocue report --day 2026-11-21 --config /etc/kinocue/kinocue.toml
  kinocue report --from 2026-11-01 --to 2026-11-30 --csv > november.csv
  kinocue report --day today --actions

Exit codes: 0 shown, even if nothing was played, 1 lines are missing, or not the hall's, 66 there is no journal, 77 no permission to read it")]
pub(super) struct Args {
    /// The day: today, yesterday, or a date as 2026-11-21 [default: today].
    #[arg(long, value_name = "DAY", value_parser = parse_day, conflicts_with_all = ["from", "to"])]
    day: Option<Day>,
    /// The first day.
    #[arg(long, value_name = "DAY", value_parser = parse_day)]
    from: Option<Day>,
    /// The last day [default: today].
    #[arg(long, value_name = "DAY", value_parser = parse_day, requires = "from")]
    to: Option<Day>,
    /// The folder of the journal [default: that of the configuration, else /var/log/kinocue, or of an ordinary user ~/.local/state/kinocue/log].
    #[arg(long, value_name = "DIR", conflicts_with = "config")]
    dir: Option<PathBuf>,
    /// The configuration that names the folder.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Count only lines that this key has sealed, or one that it signed; may be given again [default: that of the first line].
    #[arg(long, value_name = "KEY", value_parser = parse_key)]
    key: Vec<String>,
    /// Print the public keys whose lines count, for the desk of a fleet, and nothing else.
    #[arg(long, conflicts_with_all = ["actions", "csv", "json"])]
    keys: bool,
    /// Show the commands with their issuers and results, instead of the shows.
    #[arg(long)]
    actions: bool,
    /// Print CSV (RFC 4180), one record per show or command.
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A day as a person names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Day {
    Today,
    Yesterday,
    On(Date),
}

pub(super) fn parse_day(text: &str) -> Result<Day, String> {
    match text {
        "today" => Ok(Day::Today),
        "yesterday" => Ok(Day::Yesterday),
        date => date
            .parse()
            .map(Day::On)
            .map_err(|_| "write today, yesterday, or a date as 2026-11-21".to_owned()),
    }
}

impl Day {
    pub(super) fn date(self, today: Date) -> Date {
        match self {
            Self::Today => today,
            Self::Yesterday => today.yesterday().unwrap_or(today),
            Self::On(date) => date,
        }
    }
}

/// The shows of a report as a table.
pub(super) fn shows_table(report: &JournalReport) -> String {
    table::shows(report)
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let (from, to) = days(args, local_now().date())?;
    let dir = folder(args)?;
    let keys = JournalKeys::any_of(args.key.iter().cloned());
    let report = journal::report_by(&dir, (from, to), ReportBounds::ALL, keys)
        .map_err(|error| Failure { exit: exit(&error), error: error.into() })?;
    if args.keys {
        report.keys.iter().try_for_each(|key| print::out(&format!("{key}\n")))?;
        tell_notes(&report);
    } else if args.json {
        print::json(&report)?;
    } else if args.csv {
        print::data(&if args.actions { csv::actions(&report) } else { csv::shows(&report) })?;
        tell_notes(&report);
    } else {
        print::out(&if args.actions { table::actions(&report) } else { table::shows(&report) })?;
        tell_notes(&report);
    }
    Ok(if report.faults.is_empty() { Exit::Done } else { Exit::CheckFailed })
}

fn parse_key(text: &str) -> Result<String, String> {
    let remedy = "a key of a journal begins with M; `kinocue report --keys` prints it in the hall";
    if journal::is_journal_key(text) { Ok(text.to_owned()) } else { Err(remedy.to_owned()) }
}

fn days(args: &Args, today: Date) -> Result<(Date, Date), Failure> {
    let from = args.from.or(args.day).unwrap_or(Day::Today).date(today);
    let to = match args.from {
        Some(_) => args.to.unwrap_or(Day::Today).date(today),
        None => from,
    };
    if from > to {
        return Err(anyhow!("--from {from} is after --to {to}")).or_exit(Exit::Usage);
    }
    Ok((from, to))
}

fn folder(args: &Args) -> Result<PathBuf, Failure> {
    let of_config = |path: &Path| load::config(path).map(|config| config.kept_in(&places::state()).log.dir);
    let named = args
        .dir
        .clone()
        .map_or_else(|| args.config.as_deref().map(of_config).transpose(), |dir| Ok(Some(dir)));
    Ok(named?.unwrap_or_else(|| journal_in(&places::state())))
}

fn exit(error: &JournalError) -> Exit {
    match error.source.kind() {
        std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory => Exit::NoInput,
        std::io::ErrorKind::PermissionDenied => Exit::NotAllowed,
        _ => Exit::Io,
    }
}

fn tell_notes(report: &JournalReport) {
    report.remarks().for_each(|note| print::tell(&note));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_is_named_or_dated() {
        let today: Date = "2026-03-01".parse().unwrap();
        assert_eq!(parse_day("today").unwrap().date(today), today);
        assert_eq!(parse_day("yesterday").unwrap().date(today).to_string(), "2026-02-28");
        assert_eq!(parse_day("2026-11-21").unwrap().date(today).to_string(), "2026-11-21");
        for bad in ["", "tomorrow", "21.11.2026", "2026-13-01"] {
            assert!(parse_day(bad).is_err(), "{bad}");
        }
    }
}
