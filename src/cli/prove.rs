//! `kinocue prove`: the process that the library has cues checked and drawn by.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context as _;

use super::bounds::{BoundsArgs, confine};
use super::{Exit, Failure, OrExit as _, load, print};
use crate::app::StagedShow;
use crate::app::staged::at_any_pace;
use crate::config::Config;
use crate::cue::{self, Cue, CueFaults, Source};
use crate::drive::Manner;
use crate::engine::Show;
use crate::library::{Drawing, Hashed, MAX_POINTS, Verdict, draw, needs_hall};
use crate::proof::{Digest, Proof, Terms, prove_in};
use crate::sys;
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The cue.
    cue: PathBuf,
    /// The configuration of the hall.
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Print the verdict as one JSON object.
    #[arg(long)]
    json: bool,
    /// Print its curves in so many stretches of time instead, as JSON; nothing is proved.
    #[arg(long, value_name = "N", value_parser = parse_points)]
    curve: Option<usize>,
    #[command(flatten)]
    bounds: BoundsArgs,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    args.bounds.lower("the check")?;
    let config = load::config(&args.config);
    let open = || sys::file::open(&args.cue).context("cannot read the cue").or_exit(Exit::Io);
    if let Some(points) = args.curve {
        let file = open()?;
        confine();
        print::json(&draw_curves(&args.cue, file, config, points)?)?;
        return Ok(Exit::Done);
    }
    let (config, file) = (config?, open()?);
    confine();
    let verdict = judge(&args.cue, file, config).context("cannot read the cue").or_exit(Exit::Io)?;
    if args.json {
        print::json(&verdict)?;
    } else {
        print::out(&verdict.lines().iter().map(|line| format!("{line}\n")).collect::<String>())?;
    }
    Ok(match (verdict.passed, verdict.playable) {
        (true, _) => Exit::Done,
        (false, true) => Exit::CheckFailed,
        (false, false) => Exit::BadCue,
    })
}

fn parse_points(text: &str) -> Result<usize, String> {
    let points = text.parse().ok().filter(|points| (1..=MAX_POINTS).contains(points));
    points.ok_or_else(|| format!("write 1 to {MAX_POINTS}"))
}

/// The curves of a cue; the hall is looked at for those in mm or pulses alone.
fn draw_curves(
    path: &Path,
    file: File,
    config: Result<Config, Failure>,
    points: usize,
) -> Result<Drawing, Failure> {
    let cue = match cue::read(path, file, &Source::Native) {
        Ok(cue) => cue,
        Err(faults) => return Ok(Drawing::Faults(faults.to_string().lines().map(str::to_owned).collect())),
    };
    let timeline = Timeline::new(cue);
    let hall = needs_hall(&timeline).then_some(config).transpose()?;
    Ok(Drawing::Curve(draw(&timeline, hall.as_ref(), points)))
}

/// Reads a cue and proves it for all seats of a hall, at full level, as `play` does before it starts.
fn judge(path: &Path, file: File, config: Config) -> io::Result<Verdict> {
    let file = Arc::new(file);
    let mut input = Hashed::new(&*file);
    let cue = cue::read(path, &mut input, &Source::Native);
    let mcap = cue::is_mcap(input.front());
    let sha256 = input.finish()?; // reading ends at the first fault of some kinds
    let mut verdict = Verdict {
        passed: false,
        playable: false,
        faults: Vec::new(),
        more: 0,
        led_faults: Vec::new(),
        sha256,
        digest: None,
        title: None,
        length_s: None,
        axes: None,
        effects: Vec::new(),
        mcap,
    };
    match cue {
        Ok(cue) => of_cue(cue.keeping(file), config, &mut verdict),
        Err(faults) => note(&faults, &mut verdict),
    }
    verdict.passed = verdict.faults.is_empty();
    Ok(verdict)
}

fn of_cue(cue: Cue, config: Config, verdict: &mut Verdict) {
    let digest = Digest::of(&cue);
    let timeline = Timeline::new(cue);
    verdict.digest = Some(digest.to_string());
    verdict.title = timeline.cue().title().map(str::to_owned);
    verdict.length_s = Some(timeline.duration().as_secs_f64());
    verdict.axes = Some(timeline.axes());
    verdict.effects = timeline.switch_names();
    for misfit in config.misfits(&timeline) {
        let place = timeline.cue().column_place(&misfit.column(), misfit.at());
        verdict.faults.push(format!("{place}{misfit}").trim_start().to_owned());
    }
    config.fits_stroke(&timeline).faults.iter().for_each(|faults| note(faults, verdict));
    verdict.playable = verdict.faults.is_empty();
    let rate = Rate::from_hz(config.show.rate_hz);
    let prove = |config: &Config| prove_in(config, &timeline, Terms::of_hall(config, digest, rate, 1.0));
    let lines = |proof: &Proof| -> Vec<String> {
        proof.violations.iter().map(|one| one.to_string().trim_start().to_owned()).collect()
    };
    let led = config.sync.as_ref().map(|sync| prove(&at_any_pace(&config, sync.pace, rate)));
    verdict.led_faults = led.as_ref().map_or_else(Vec::new, lines);
    // What keeps the limits that any pace leaves keeps them at the clock's; and where the film leads every show, no other counts.
    let is_enough = |led: &Proof| led.passed() || config.sync.as_ref().is_some_and(|sync| sync.leads);
    let proof = led.filter(is_enough).unwrap_or_else(|| prove(&config));
    verdict.faults.extend(lines(&proof));
    verdict.more += proof.more;
    if verdict.faults.is_empty() {
        let show = Show { rate, timing: config.show.timing, start: ShowTime::ZERO, plays: 1 };
        let staged = StagedShow::new(&config, timeline, show, Manner { level: 1.0, silent: false });
        verdict.faults.extend(staged.err().map(|error| error.to_string()));
    }
}

fn note(faults: &CueFaults, verdict: &mut Verdict) {
    verdict.faults.extend(faults.told().iter().map(|fault| fault.to_string().trim_start().to_owned()));
    verdict.more += faults.more();
}
