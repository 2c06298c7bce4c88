//! `kinocue fit`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use serde::Serialize;

use super::convert;
use super::figures::{self, AxisReport};
use super::load::{self, Judge, SeatArgs, SourceArgs};
use super::{Exit, Failure, OrExit as _, exit, print};
use crate::config::parse_level;
use crate::cue::Cue;
use crate::drive::terms;
use crate::motion::AxisUnit;
use crate::proof::{self, FitManner, Fitted};
use crate::timeline::Timeline;

/// Fits a cue into the limits of its seats.
///
/// Scales the motion down about the neutral pose just as far as needed, and never changes its timing. A cue that ends in motion without
/// room to stop is brought to rest over its last stretch, if that changes it less. --smooth allows a zero-phase low-pass filter against
/// what scaling cannot cure, such as the steps of coarse sources and the corners of straight lines; of all pairs of filter and scale it
/// uses the one that changes the cue least. Vibration that the seat cannot take on top of the motion is lowered too. What the serial
/// links of the hall cannot carry, and what it has not (effects, axes, vibration), is reported, not fixed. The result passes `kinocue check` with the same options.
#[derive(Debug, clap::Args)]
#[command(after_help = load::after_help(&[
    "kinocue fit cues/coaster.csv -o fitted.csv",
    "kinocue fit cues/bench-ride.csv -o fitted.mcap --config examples/hall.toml --per-axis",
    "kinocue fit cues/bench-ride.csv -o smooth.csv --smooth",
    "kinocue fit cues/bench-ride.csv -o film.csv --config examples/hall.toml --chase",
    "kinocue fit examples/rows.csv -o ride.csv --from rows --units mm --smooth --json",
]))]
pub(super) struct Args {
    /// The cue to read, CSV or MCAP.
    cue: PathBuf,

    /// The file to write; its name ends in .csv or .mcap.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    #[command(flatten)]
    source: SourceArgs,

    #[command(flatten)]
    seat: SeatArgs,

    /// The level at which the cue will be played: 60%, 0.6 or -6dB.
    #[arg(long, value_name = "LEVEL", value_parser = parse_level, default_value = "100%", allow_hyphen_values = true)]
    level: f64,

    /// Scale each axis by itself; by default all axes are scaled alike, which keeps the shape of the motion.
    #[arg(long)]
    per_axis: bool,

    /// Allow a low-pass filter (zero phase, so without delay).
    #[arg(long)]
    smooth: bool,

    /// Overwrite OUT if it exists, but never the cue itself.
    #[arg(long)]
    force: bool,

    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let target = convert::target(&args.output).or_exit(Exit::Usage)?;
    refuse_the_input(&args.cue, &args.output)?;
    exit::refuse_to_replace(&args.output, args.force)?;
    let hall = args.seat.config.as_deref().map(load::config).transpose()?;
    let judge = args.seat.judge(hall)?;
    let timeline = Timeline::new(load::cue(&args.cue, &args.source.source())?);
    let terms = judge.terms(&timeline, args.level);
    let manner = FitManner { per_axis: args.per_axis, smooth: args.smooth };
    let fitted = proof::fit(timeline, &terms, manner)
        .map_err(|error| anyhow!("{}: {error}", args.cue.display()))
        .or_exit(Exit::CheckFailed)?;
    if !is_fit(&fitted, &judge) {
        let error = anyhow!("{}: the fitted cue still breaks limits; nothing is written", args.cue.display());
        return Err(error).or_exit(Exit::CheckFailed);
    }
    refuse_what_the_hall_misses(args, &judge, &fitted)?;
    refuse_what_links_miss(args, &judge, &fitted)?;
    convert::write(fitted.timeline.cue(), &[], &args.output, target)?;
    let report = FitReport::new(args, &fitted);
    if args.json {
        print::json(&report)?;
    } else {
        print::tell(&report.text(&fitted));
    }
    Ok(Exit::Done)
}

fn is_fit(fitted: &Fitted, judge: &Judge) -> bool {
    fitted.after.passed() && judge.stroke(&fitted.timeline).faults.is_empty()
}

/// True if a fit of a cue at full level, with these arguments, makes one that keeps all limits.
pub(super) fn mends(cue: &Cue, judge: &Judge, smooth: bool) -> bool {
    let timeline = Timeline::new(cue.clone());
    let terms = judge.terms(&timeline, 1.0);
    let fitted = proof::fit(timeline, &terms, FitManner { per_axis: false, smooth });
    fitted.is_ok_and(|fitted| {
        is_fit(&fitted, judge)
            && judge.misfits(&fitted.timeline).is_empty()
            && judge.links(&fitted.timeline, 1.0).violations.is_empty()
    })
}

/// What the hall has not, no change of the motion gives it; nor a rate that its links cannot play.
fn refuse_what_the_hall_misses(args: &Args, judge: &Judge, fitted: &Fitted) -> Result<(), Failure> {
    let misfits = judge.misfits(&fitted.timeline);
    let links: Vec<_> = judge.hall.iter().flat_map(|hall| terms::in_words(hall).1).collect();
    if misfits.is_empty() && links.is_empty() {
        return Ok(());
    }
    let cue = args.cue.display();
    let of_cue = misfits.iter().map(|(place, misfit)| format!("{cue}:{place}{misfit}\n"));
    let lines: String = of_cue.chain(links.iter().map(|why| format!("{why}\n"))).collect();
    let exit = if misfits.is_empty() { Exit::CheckFailed } else { Exit::BadCue };
    Err(anyhow!(
        "{lines}fit cannot mend what the hall cannot do: change the hall or the cue; nothing is written"
    ))
    .or_exit(exit)
}

/// What a link makes of a cue is a matter of its rate and of the level: it is told, and nothing is changed for it.
fn refuse_what_links_miss(args: &Args, judge: &Judge, fitted: &Fitted) -> Result<(), Failure> {
    let broken = judge.links(&fitted.timeline, args.level).violations;
    if broken.is_empty() {
        return Ok(());
    }
    let lines: String = broken.iter().map(|one| format!("{}:{one}\n", args.cue.display())).collect();
    let error = anyhow!(
        "{lines}fit cannot mend what a serial link cannot carry: change the link, the level or the cue; nothing is written"
    );
    Err(error).or_exit(Exit::CheckFailed)
}

/// Whatever was asked for, a cue is never written over itself.
fn refuse_the_input(cue: &Path, output: &Path) -> Result<(), Failure> {
    let same = matches!((fs::canonicalize(cue), fs::canonicalize(output)), (Ok(a), Ok(b)) if a == b);
    if same {
        let error = anyhow!("{} is the cue itself; give another name with -o", output.display());
        return Err(error).or_exit(Exit::Usage);
    }
    Ok(())
}

/// What was done.
#[derive(Debug, Serialize)]
struct FitReport {
    cue: String,
    output: String,
    seat: String,
    rate_hz: f64,
    level: f64,
    /// Amplitude of each axis about its neutral pose, 1 where it is as it was.
    factors: Vec<f64>,
    /// The last seconds in which it is brought to rest; null if it needs none.
    eased_s: Option<f64>,
    /// The low-pass; null if none was used.
    cut_off_hz: Option<f64>,
    /// The largest change of a position, its axis and its time; null in mm if that axis turns.
    change_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    change_deg: Option<f64>,
    change_axis: String,
    change_at_s: f64,
    /// Stretches of vibration that swing less than they did.
    vibration_lowered: usize,
    before: Vec<AxisReport>,
    after: Vec<AxisReport>,
}

impl FitReport {
    fn new(args: &Args, fitted: &Fitted) -> Self {
        let seats: Vec<_> = fitted.after.axes.iter().map(|axis| axis.on.clone()).collect();
        let (cue, output) = (args.cue.display().to_string(), args.output.display().to_string());
        let changed = fitted.after.axes.iter().find(|axis| axis.axis == fitted.change.axis);
        let unit = changed.map_or(AxisUnit::Millimetre, |axis| axis.on.geometry().unit);
        let change = |of: AxisUnit| (unit == of).then_some(fitted.change.by);
        Self {
            seat: figures::seat_names(&seats),
            rate_hz: fitted.after.terms.rate.hz(),
            level: args.level,
            factors: fitted.factors.clone(),
            eased_s: fitted.eased_s,
            cut_off_hz: fitted.smoothing.map(|smoothing| smoothing.cut_off_hz),
            change_mm: change(AxisUnit::Millimetre),
            change_deg: change(AxisUnit::Degree),
            change_axis: format!("a{}", fitted.change.axis + 1),
            change_at_s: fitted.change.at.as_secs_f64(),
            vibration_lowered: fitted.lowered,
            before: figures::proved(&cue, &fitted.before.axes),
            after: figures::proved(&output, &fitted.after.axes),
            cue,
            output,
        }
    }

    fn text(&self, fitted: &Fitted) -> String {
        let mut lines = Vec::new();
        if let Some(seconds) = self.eased_s {
            lines.push(format!(
                "brought to rest in its last {seconds:.2} s, because it ended in motion without room for a stop"
            ));
        }
        if let Some(hz) = self.cut_off_hz {
            lines.push(format!("low-pass at {hz:.2} Hz, without delay"));
        }
        let lowered = self.factors.iter().enumerate().filter(|(_, factor)| **factor < 1.0);
        lines.extend(lowered.map(|(axis, factor)| format!("a{}: amplitude x {factor:.4}", axis + 1)));
        if self.vibration_lowered > 0 {
            lines.push(format!(
                "vibration lowered {} times, to keep the stroke and the limits of the seat",
                self.vibration_lowered
            ));
        }
        if lines.is_empty() {
            lines.push("already keeps all limits; written unchanged".to_owned());
        } else {
            let (by, axis, at) = (fitted.change.by, &self.change_axis, fitted.change.at);
            let unit = self.change_deg.map_or(AxisUnit::Millimetre, |_| AxisUnit::Degree).name();
            lines.push(format!("largest change of position: {by:.3} {unit} ({axis} at {at})"));
        }
        let mut text: String = lines.iter().map(|line| format!("{}: {line}\n", self.cue)).collect();
        let after = figures::proof_table(&fitted.after.axes);
        text += &if fitted.before.passed() {
            format!("\n{after}")
        } else {
            format!("\nbefore:\n{}\nafter:\n{after}", figures::proof_table(&fitted.before.axes))
        };
        let Self { output, seat, rate_hz, .. } = self;
        text + &format!("\n{output}: keeps all limits of seat {seat} at {rate_hz} frames a second")
    }
}
