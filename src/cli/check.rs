//! `kinocue check`.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::figures::{self, AxisReport};
use super::load::{self, Judge, SeatArgs, SourceArgs};
use super::{Exit, Failure, print};
use crate::config::{self, Config, ConfigFault, ConfigFaults};
use crate::cue::{self, CueFaults, Fault, Place, Source};
use crate::timeline::Timeline;

/// The codes of bad files, the one that counts most first.
const WORST_FIRST: [Exit; 4] = [Exit::NoInput, Exit::Config, Exit::Io, Exit::BadCue];

/// Checks cue and configuration files: every fault, with its place.
///
/// Proves format, units, axes and stroke of a cue, and with --config that each axis has a controller and each
/// effect an output. Velocity, acceleration and jerk are shown, and not judged.
#[derive(Debug, clap::Args)]
#[command(after_help = load::after_help(&[
    "kinocue check cues/*.csv",
    "kinocue check hall.toml",
    "kinocue check cues/voyage.csv --config hall.toml",
    "kinocue check cues/coaster.csv --config hall.toml --seat platform6 --rate 1000 --json",
    "kinocue check ride.txt --from rows --units percent",
]))]
pub(super) struct Args {
    /// Cues, CSV or MCAP, and configurations, whose names end in .toml.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,

    #[command(flatten)]
    source: SourceArgs,

    #[command(flatten)]
    seat: SeatArgs,

    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let mut report = Report::default();
    let judge = match args.seat.config.as_deref().map(|path| report.configuration(path)) {
        Some(None) => None, // cues are then checked by themselves
        Some(hall) => Some(args.seat.judge(hall)?),
        None => Some(args.seat.judge(None)?),
    };
    report.rate_hz = judge.as_ref().map(|judge| judge.rate_hz);
    for file in &args.files {
        if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
            if let Some(hall) = report.configuration(file) {
                report.passes(file, &hall_in_words(&hall));
            }
        } else {
            report.cue(file, &args.source.source(), judge.as_ref());
        }
    }
    report.passed = report.exits.is_empty();
    if args.json {
        print::json(&report)?;
    } else {
        print::out(&report.text)?;
        if !report.passed {
            print::tell(report.in_words().trim_end());
        }
    }
    Ok(WORST_FIRST.into_iter().find(|exit| report.exits.contains(exit)).unwrap_or(Exit::Done))
}

/// What all files together have shown.
#[derive(Debug, Default, Serialize)]
struct Report {
    passed: bool,
    faults: Vec<FaultReport>,
    /// Faults beyond those listed.
    faults_unlisted: u64,
    seat: String,
    rate_hz: Option<f64>,
    axes: Vec<AxisReport>,
    #[serde(skip)]
    exits: Vec<Exit>,
    /// What is said of the files that passed.
    #[serde(skip)]
    text: String,
}

/// One fault; line and column count from 1, and are null where the file has none.
#[derive(Debug, PartialEq, Eq, Serialize)]
struct FaultReport {
    file: String,
    line: Option<u64>,
    column: Option<u64>,
    message: String,
}

impl FaultReport {
    fn new(file: &Path, place: &Place, message: String) -> Self {
        let (line, column) = match *place {
            Place::Text { line, column } => (Some(line), Some(column)),
            _ => (None, None),
        };
        Self { file: file.display().to_string(), line, column, message }
    }

    fn of_cue(file: &Path, fault: &Fault) -> Self {
        let message = match (&fault.place, &fault.column) {
            (Place::Text { .. }, Some(column)) => format!("{column}: {}", fault.problem),
            (Place::Text { .. }, None) => fault.problem.to_string(),
            _ => fault.to_string().trim_start().to_owned(),
        };
        Self::new(file, &fault.place, message)
    }

    fn of_config(fault: &ConfigFault) -> Self {
        let place = Place::Text { line: fault.line as u64, column: fault.column as u64 };
        Self::new(&fault.path, &place, fault.message.clone())
    }
}

impl Report {
    fn fault(&mut self, exit: Exit, fault: FaultReport) {
        self.exits.push(exit);
        if !self.faults.contains(&fault) {
            self.faults.push(fault);
        }
    }

    fn cue_faults(&mut self, faults: &CueFaults) {
        for fault in faults.told() {
            self.fault(load::cue_exit(faults), FaultReport::of_cue(faults.path(), fault));
        }
        self.faults_unlisted += faults.more();
    }

    /// Notes the faults of a configuration, or gives it.
    fn configuration(&mut self, path: &Path) -> Option<Config> {
        let faults = match config::load(path) {
            Ok(config) => return Some(config),
            Err(faults) => faults,
        };
        let exit = load::config_exit(&faults);
        match &faults {
            ConfigFaults::Bad(list) => {
                list.iter().for_each(|fault| self.fault(exit, FaultReport::of_config(fault)))
            }
            ConfigFaults::Unreadable { source, .. } => {
                self.fault(exit, FaultReport::new(path, &Place::File, source.to_string()));
            }
        }
        None
    }

    fn cue(&mut self, path: &Path, source: &Source, judge: Option<&Judge>) {
        let timeline = match cue::load(path, source) {
            Ok(cue) => Timeline::new(cue),
            Err(faults) => return self.cue_faults(&faults),
        };
        let before = self.exits.len();
        let Some(judge) = judge else {
            timeline
                .fits_stroke(0..timeline.axes(), None)
                .faults
                .iter()
                .for_each(|faults| self.cue_faults(faults));
            return;
        };
        judge.stroke(&timeline).faults.iter().for_each(|faults| self.cue_faults(faults));
        for misfit in judge.hall.iter().flat_map(|hall| hall.misfits(&timeline)) {
            let place = timeline.cue().column_place(&misfit.column());
            self.fault(Exit::BadCue, FaultReport::new(path, &place, misfit.to_string()));
        }
        let seats = judge.seats(timeline.axes());
        let figures = timeline.figures(judge.rate_hz, &seats);
        self.axes.extend(figures::report(&path.display().to_string(), &figures));
        self.seat = figures::seat_names(&seats);
        if self.exits.len() == before {
            let axes = timeline.axes();
            let noun = if axes == 1 { "axis" } else { "axes" };
            let words = format!(
                "{axes} {noun}, {}; velocity, acceleration and jerk for seat {} at {} frames a second are shown, not judged",
                timeline.duration(),
                self.seat,
                judge.rate_hz
            );
            self.passes(path, &words);
            self.text += &figures::table(&figures);
        }
    }

    fn passes(&mut self, path: &Path, words: &str) {
        self.text += &format!("{}: passed: {words}\n", path.display());
    }

    /// Every fault on a line of its own, and how many there are.
    fn in_words(&self) -> String {
        let mut text = String::new();
        for fault in &self.faults {
            let place = match (fault.line, fault.column) {
                (Some(line), Some(column)) => format!("{line}:{column}:"),
                _ => String::new(),
            };
            text += &format!("{}:{place} {}\n", fault.file, fault.message);
        }
        if self.faults_unlisted > 0 {
            text += &format!("and {} more\n", self.faults_unlisted);
        }
        match self.faults.len() as u64 + self.faults_unlisted {
            0 => text,
            1 => text + "1 fault\n",
            count => format!("{text}{count} faults\n"),
        }
    }
}

fn hall_in_words(hall: &Config) -> String {
    format!(
        "{} controllers, {} seat types, {} effects",
        hall.controllers.len(),
        hall.seats.len(),
        hall.effects.len()
    )
}
