//! `kinocue check`.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::drives::{self, DriveArgs, DriveReport, DriveVerdict};
use super::figures::{self, AxisReport};
use super::load::{self, Judge, SeatArgs, SourceArgs};
use super::{Exit, Failure, metres, print};
use crate::config::{self, Config, ConfigFault, ConfigFaults, line_load, parse_level};
use crate::cue::{self, CueFaults, Fault, Place};
use crate::drive::{EVERY_LED, terms};
use crate::plain;
use crate::proof::{Breach, Proof, Violation};
use crate::time::parse_trim;
use crate::timeline::Timeline;

/// The codes of bad files, the one that counts most first.
const WORST_FIRST: [Exit; 6] =
    [Exit::NoInput, Exit::NotAllowed, Exit::Config, Exit::Io, Exit::BadCue, Exit::CheckFailed];

/// Checks cue and configuration files: every fault, with its place.
///
/// Checks format, units, axes and stroke of a cue, and with --config that each axis has a controller and each effect an
/// output. Then proves its limits over the whole cue, at every phase of the frames: velocity, acceleration and jerk of each
/// axis, vibration on top of motion, the times of effects, and what the controllers themselves allow; with --drive also
/// how closely serial drives follow it. Exits with 1 if a limit is broken; `kinocue fit` lowers the motion until it fits.
#[derive(Debug, clap::Args)]
#[command(after_help = load::after_help(&[
    "kinocue check cues/*.csv",
    "kinocue check examples/hall.toml",
    "kinocue check cues/bench-ride.csv --config examples/hall.toml",
    "kinocue check cues/seat-demo.csv --config examples/hall.toml --level 60%",
    "kinocue check cues/bench-ride.csv --config examples/hall.toml --chase",
    "kinocue check cues/bench-ride.csv --config examples/hall.toml --seat bench3 --rate 1000 --json",
    "kinocue check cues/bench-ride.csv --config examples/silvermax.toml --drive silvermax --link-rate 30 --drive-vibration 0%",
    "kinocue check examples/rows.csv --from rows --units mm",
]))]
pub(super) struct Args {
    /// Cues, CSV or MCAP, and configurations, whose names end in .toml.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,

    #[command(flatten)]
    source: SourceArgs,

    #[command(flatten)]
    seat: SeatArgs,

    #[command(flatten)]
    drives: DriveArgs,

    /// Level of motion and vibration about the seats' neutral pose: 60%, 0.6 or -6dB. A cue that passes at one level passes at all lower ones.
    #[arg(long, value_name = "LEVEL", value_parser = parse_level, default_value = "100%", allow_hyphen_values = true)]
    level: f64,

    /// Trim against the film, -500ms to 500ms. It does not change the result: the proof holds at every phase of the frames.
    #[arg(long, value_name = "MS", value_parser = parse_trim, default_value = "0ms", allow_hyphen_values = true)]
    trim: i32,

    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let mut report = CheckReport { level: args.level, trim_ms: args.trim, ..CheckReport::default() };
    let hall = args.seat.config.as_deref().map(|path| (path, report.configuration(path)));
    if let Some((path, Some(hall))) = &hall {
        report.links(path, hall);
    }
    let judge = match hall.map(|(_, hall)| hall) {
        Some(None) => None, // cues are then checked by themselves
        Some(hall) => Some(args.seat.judge(hall)?),
        None => Some(args.seat.judge(None)?),
    };
    report.rate_hz = judge.as_ref().map(|judge| judge.rate_hz);
    for file in &args.files {
        if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
            if let Some(hall) = report.configuration(file) {
                report.hall(file, &hall);
            }
        } else {
            report.cue(file, args, judge.as_ref());
        }
    }
    report.passed = report.exits.is_empty();
    if args.json {
        print::json(&report)?;
    } else {
        let notes: String = report.notes.iter().map(|note| format!("{note}\n")).collect();
        print::out(&format!("{}{notes}{}", report.text, report.tables))?;
        if !report.passed {
            print::tell(report.in_words(args.seat.remedy()).trim_end());
        }
    }
    Ok(WORST_FIRST.into_iter().find(|exit| report.exits.contains(exit)).unwrap_or(Exit::Done))
}

/// What all files together have shown.
#[derive(Debug, Default, Serialize)]
struct CheckReport {
    passed: bool,
    faults: Vec<FaultReport>,
    /// Faults beyond those listed.
    faults_unlisted: u64,
    seat: String,
    rate_hz: Option<f64>,
    /// Of motion and vibration, 0 to 1.
    level: f64,
    trim_ms: i32,
    axes: Vec<AxisReport>,
    /// What serial drives would execute: those of the hall, and those that somebody asks about.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    drives: Vec<DriveReport>,
    /// What was not looked at.
    notes: Vec<String>,
    #[serde(skip)]
    exits: Vec<Exit>,
    /// What is said of the files that passed.
    #[serde(skip)]
    text: String,
    /// What was measured, of the cues that can be measured.
    #[serde(skip)]
    tables: String,
    /// True if a cue breaks limits.
    #[serde(skip)]
    unfit: bool,
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

    fn of_proof(file: &Path, violation: &Violation) -> Self {
        let message = match violation.place {
            Place::Text { .. } => violation.message(),
            _ => violation.to_string().trim_start().to_owned(),
        };
        Self::new(file, &violation.place, message)
    }

    fn of_config(fault: &ConfigFault) -> Self {
        let place = Place::Text { line: fault.line as u64, column: fault.column as u64 };
        Self::new(&fault.path, &place, fault.message.clone())
    }
}

impl CheckReport {
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

    /// Notes of a configuration what passes, and how often its links play.
    fn hall(&mut self, path: &Path, hall: &Config) {
        let before = self.exits.len();
        self.links(path, hall);
        if hall.film.is_none() && hall.sync.as_ref().is_some_and(|sync| !sync.leads) {
            let note = "[sync] has no start: a cue follows the film only where its entry of a playlist has film, else it starts at once";
            self.note(path, note);
        }
        for (at, one) in hall.effects.iter().enumerate() {
            let other = hall.effects[..at].iter().find(|other| other.output == one.output);
            other.iter().for_each(|other| {
                let text =
                    format!("{} and {} switch the same output, Y{:02}", other.name, one.name, one.output);
                self.note(path, &text);
            });
        }
        if self.exits.len() == before {
            self.passes(path, &hall_in_words(hall));
        }
    }

    /// Notes what was not looked at, or looks wrong, once.
    fn note(&mut self, path: &Path, text: &str) {
        let note = format!("{}: {text}", plain::path(path));
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    /// Notes how often the links of a hall play, and those that are to play more often than they can.
    fn links(&mut self, path: &Path, hall: &Config) {
        let (told, faults) = terms::in_words(hall);
        let of_lines = line_load::in_words(hall, EVERY_LED);
        told.iter().chain(&metres::of_hall(hall)).chain(&of_lines).for_each(|text| self.note(path, text));
        for fault in faults {
            self.fault(Exit::CheckFailed, FaultReport::new(path, &Place::File, fault));
        }
    }

    fn cue(&mut self, path: &Path, args: &Args, judge: Option<&Judge>) {
        let timeline = match cue::load(path, &args.source.source()) {
            Ok(cue) => Timeline::new(cue),
            Err(faults) => return self.cue_faults(&faults),
        };
        let before = self.exits.len();
        if judge.is_none_or(|judge| judge.hall.is_none()) {
            self.notes.extend(unwired(path, &timeline));
        }
        let Some(judge) = judge else {
            timeline
                .fits_stroke(0..timeline.axes(), None)
                .faults
                .iter()
                .for_each(|faults| self.cue_faults(faults));
            return;
        };
        let small = metres::of_cue(&timeline, &judge.seats(timeline.axes()));
        small.iter().for_each(|text| self.note(path, text));
        judge.stroke(&timeline).faults.iter().for_each(|faults| self.cue_faults(faults));
        for (place, misfit) in judge.misfits(&timeline) {
            self.fault(Exit::BadCue, FaultReport::new(path, &place, misfit.to_string()));
        }
        for seat in judge.hall.iter().flat_map(|hall| hall.unshaken_seats(&timeline)) {
            self.note(path, &format!("vibration is left out on seat {seat} (its vibration = 0%)"));
        }
        let terms = judge.terms(&timeline, self.level);
        let driven = args.drives.judge(path, &timeline, &terms);
        let links = self.proof(path, &judge.prove(&timeline, terms));
        let driven = driven.map_or_else(String::new, |driven| self.driven(path, driven));
        if self.exits.len() == before {
            let axes = timeline.axes();
            let noun = if axes == 1 { "axis" } else { "axes" };
            let (length, rate, level) = (timeline.duration(), judge.rate_hz, 100.0 * self.level);
            let seat = &self.seat;
            self.passes(
                path,
                &format!(
                    "{axes} {noun}, {length}; within all limits of seat {seat} at {rate} frames a second, level {level:.0} %"
                ),
            );
        }
        self.text += &(links + &driven);
    }

    /// Notes what a proof shows: the table in any case, and what is broken. Gives what is to be said of links.
    fn proof(&mut self, path: &Path, proof: &Proof) -> String {
        self.axes.extend(figures::proved(&path.display().to_string(), &proof.axes));
        let seats: Vec<_> = proof.axes.iter().map(|axis| axis.on.clone()).collect();
        self.seat = figures::seat_names(&seats);
        self.tables += &figures::proof_table(&proof.axes);
        // A link that is too slow was told of the hall.
        let is_told = |why: &str, faults: &[FaultReport]| faults.iter().any(|one| one.message.ends_with(why));
        for violation in &proof.violations {
            if matches!(&violation.breach, Breach::TooSlow { why } if is_told(why, &self.faults)) {
                continue;
            }
            self.fault(Exit::CheckFailed, FaultReport::of_proof(path, violation));
        }
        self.faults_unlisted += proof.more;
        self.unfit |= proof.violations.iter().any(|one| !one.is_of_links());
        self.drives.extend(drives::on_links(path, &proof.links));
        let words = drives::links_in_words(&proof.links).into_iter();
        words.map(|words| format!("{}: {words}\n", plain::path(path))).collect()
    }

    /// Notes what serial drives would execute; gives what is to be said of it.
    fn driven(&mut self, path: &Path, driven: DriveVerdict) -> String {
        for violation in &driven.proof.violations {
            self.fault(Exit::CheckFailed, FaultReport::of_proof(path, violation));
        }
        self.faults_unlisted += driven.proof.more;
        self.drives.extend(driven.reports);
        driven.words
    }

    fn passes(&mut self, path: &Path, words: &str) {
        self.text += &format!("{}: passed: {words}\n", plain::path(path));
    }

    /// Every fault on a line of its own, and how many there are.
    fn in_words(&self, remedy: &str) -> String {
        let mut text = String::new();
        for fault in &self.faults {
            let place = match (fault.line, fault.column) {
                (Some(line), Some(column)) => format!("{line}:{column}:"),
                _ => String::new(),
            };
            text += &format!("{}:{place} {}\n", plain::path(Path::new(&fault.file)), fault.message);
        }
        if self.faults_unlisted > 0 {
            text += &format!("and {} more\n", self.faults_unlisted);
        }
        text += &match self.faults.len() as u64 + self.faults_unlisted {
            0 => String::new(),
            1 => "1 fault\n".to_owned(),
            count => format!("{count} faults\n"),
        };
        if self.unfit {
            text += &format!("{remedy} makes a cue that keeps the limits\n");
        }
        text
    }
}

/// That nobody knows whether a hall has the effects of a cue, where it has some.
fn unwired(path: &Path, timeline: &Timeline) -> Option<String> {
    let names = timeline.switch_names();
    (!names.is_empty()).then(|| {
        let (path, names) = (path.display(), names.join(", "));
        format!("{path}: not checked whether the hall has its effects ({names}); --config FILE checks it")
    })
}

fn hall_in_words(hall: &Config) -> String {
    let counted = |count: usize, noun: &str| format!("{count} {noun}{}", if count == 1 { "" } else { "s" });
    let mut words = vec![
        counted(hall.controllers.len(), "controller"),
        counted(hall.seats.len(), "seat type"),
        counted(hall.effects.len(), "effect"),
    ];
    if !hall.links.is_empty() {
        words.insert(1, counted(hall.links.len(), "link"));
    }
    words.extend(hall.absent.iter().map(|one| format!("{} disabled", one.controller.name)));
    words.join(", ")
}
