//! `kinocue info`.

use std::fmt::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::drives::{self, DriveReport};
use super::figures::{self, AxisReport};
use super::load::{self, Judge, SeatArgs, SourceArgs};
use super::{Exit, Failure, print};
use crate::cue::Vibration;
use crate::drive::terms;
use crate::motion::AxisUnit;
use crate::plain;
use crate::proof::{self, AxisFigures};
use crate::time::{Rate, ShowTime};
use crate::timeline::{EffectUse, Held, Hint, LevelUse, Timeline};

/// How many marks a curve is drawn with.
const DRAWN: u32 = 64;

/// Shows what a cue contains, and what it demands of a seat.
///
/// Length, axes, effects, and the extremes of each axis with their times.
#[derive(Debug, clap::Args)]
#[command(after_help = load::after_help(&[
    "kinocue info cues/coaster.csv",
    "kinocue info cues/storm.mcap --json",
    "kinocue info examples/rows.csv --from rows --units mm",
    "kinocue info cues/bench-ride.csv --config examples/hall.toml --rate 200",
]))]
pub(super) struct Args {
    /// The cue, CSV or MCAP.
    cue: PathBuf,

    #[command(flatten)]
    source: SourceArgs,

    #[command(flatten)]
    seat: SeatArgs,

    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let hall = args.seat.config.as_deref().map(load::config).transpose()?;
    let judge = args.seat.judge(hall)?;
    let timeline = Timeline::new(load::cue(&args.cue, &args.source.source())?);
    let info = Info::new(&timeline, &judge);
    if args.json {
        print::json(&info)?
    } else {
        print::out(&info.text(&timeline))?
    }
    // Shown all the same; but no seat can play what leaves its stroke.
    Ok(judge.stroke(&timeline).faults.first().map_or(Exit::Done, load::cue_exit))
}

/// What is shown of a cue.
#[derive(Debug, Serialize)]
struct Info {
    cue: String,
    title: Option<String>,
    length_s: f64,
    rows: usize,
    row_interval_ms: f64,
    unit: String,
    interpolation: &'static str,
    seat: String,
    rate_hz: f64,
    vibration: Vec<VibrationReport>,
    effects: Vec<EffectReport>,
    outputs: Vec<OutputReport>,
    markers: Vec<MarkerReport>,
    notes: Vec<String>,
    axes: Vec<AxisReport>,
    /// What the links of the hall play of it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    drives: Vec<DriveReport>,
    #[serde(skip)]
    figures: Vec<AxisFigures>,
}

#[derive(Debug, Serialize)]
struct EffectReport {
    name: String,
    times: usize,
    on_s: f64,
    first_s: Option<f64>,
}

impl fmt::Display for EffectReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, times, on_s, first_s } = self;
        write!(f, "{name}: {times}×, {on_s:.1} s in all")?;
        first_s.map_or(Ok(()), |first| write!(f, ", first at {}", ShowTime::from_secs_f64(first)))
    }
}

impl From<LevelUse> for OutputReport {
    fn from(LevelUse { usage, most }: LevelUse) -> Self {
        Self { usage: usage.into(), max_level: most }
    }
}

impl From<EffectUse> for EffectReport {
    fn from(usage: EffectUse) -> Self {
        let first_s = usage.spans.first().map(|(from, _)| from.as_secs_f64());
        Self { times: usage.spans.len(), on_s: usage.on().as_secs_f64(), first_s, name: usage.name }
    }
}

/// An analogue output, while its level is above 0.
#[derive(Debug, Serialize)]
struct OutputReport {
    #[serde(flatten)]
    usage: EffectReport,
    max_level: f64,
}

/// The vibration of an axis: frequencies while its amplitude is above 0, and the greatest amplitude.
#[derive(Debug, Serialize)]
struct VibrationReport {
    axis: String,
    min_hz: f64,
    max_hz: f64,
    /// Null if the axis turns.
    max_amplitude_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_amplitude_deg: Option<f64>,
}

impl VibrationReport {
    /// True if another axis vibrates alike.
    fn is_as(&self, other: &Self) -> bool {
        let figures = |v: &Self| (v.min_hz, v.max_hz, v.max_amplitude_mm, v.max_amplitude_deg);
        figures(self) == figures(other)
    }
}

#[derive(Debug, Serialize)]
struct MarkerReport {
    name: String,
    at_s: f64,
}

impl Info {
    fn new(timeline: &Timeline, judge: &Judge) -> Self {
        let cue = timeline.cue();
        let seats = judge.seats(timeline.axes());
        let figures = proof::figures(timeline, Rate::from_hz(judge.rate_hz), &seats);
        let name = cue.path().display().to_string();
        let stroke = judge.stroke(timeline);
        let notes = stroke.held.iter().filter_map(|held| note(held, &figures, timeline));
        let (told, faults) = judge.hall.as_ref().map(terms::in_words).unwrap_or_default();
        let driven = judge.links(timeline, 1.0);
        let plays = drives::links_in_words(&driven.plays);
        let mut links: Vec<_> = told.into_iter().chain(plays).chain(faults).collect();
        for violation in &driven.violations {
            let words = violation.to_string().trim_start().to_owned();
            if !links.iter().any(|told| told.ends_with(&words)) {
                links.push(words);
            }
        }
        Self {
            axes: figures::report(&name, &figures),
            cue: name,
            title: cue.title().map(str::to_owned),
            length_s: timeline.duration().as_secs_f64(),
            rows: cue.rows(),
            row_interval_ms: timeline.row_interval().as_secs_f64() * 1000.0,
            unit: cue.unit_words(),
            interpolation: cue.interpolation().name(),
            seat: figures::seat_names(&seats),
            rate_hz: judge.rate_hz,
            vibration: vibration(timeline, &figures),
            effects: timeline.effect_uses().into_iter().map(Into::into).collect(),
            outputs: timeline.level_uses().into_iter().map(Into::into).collect(),
            markers: cue
                .markers()
                .iter()
                .map(|m| MarkerReport { name: m.name.clone(), at_s: m.at.as_secs_f64() })
                .collect(),
            drives: drives::on_links(cue.path(), &driven.plays),
            notes: notes.chain(stroke.faults.iter().map(ToString::to_string)).chain(links).collect(),
            figures,
        }
    }

    fn text(&self, timeline: &Timeline) -> String {
        let title = self.title.as_ref().map_or_else(String::new, |title| format!(": {title}"));
        let mut text = format!("{}{title}\n\n", plain::path(Path::new(&self.cue)));
        for (word, value) in self.facts(timeline) {
            append(&mut text, format_args!("{word:<14}{value}\n"));
        }
        append(&mut text, format_args!("\nfor seat {} at {} frames a second:\n", self.seat, self.rate_hz));
        text += &figures::axes_table(&self.figures);
        text.push('\n');
        for (axis, curve) in drawn(timeline, &self.figures).iter().enumerate() {
            append(&mut text, format_args!("{:<4}{curve}\n", format!("a{}", axis + 1)));
        }
        if !self.notes.is_empty() {
            append(&mut text, format_args!("\n{}\n", self.notes.join("\n")));
        }
        text
    }

    fn facts(&self, timeline: &Timeline) -> Vec<(&'static str, String)> {
        let ms = self.row_interval_ms;
        let mut facts = vec![
            ("length", timeline.duration().to_string()),
            (
                "rows",
                format!("{}, {} ms apart ({} Hz)", self.rows, thousandths(ms), thousandths(1000.0 / ms)),
            ),
            ("axes", format!("{}, in {}", timeline.axes(), self.unit)),
            ("interpolation", self.interpolation.to_owned()),
        ];
        facts.extend(self.vibration.chunk_by(VibrationReport::is_as).map(|alike| {
            let axes: Vec<_> = alike.iter().map(|v| v.axis.as_str()).collect();
            let VibrationReport { min_hz, max_hz, max_amplitude_mm: mm, max_amplitude_deg: deg, .. } =
                &alike[0];
            let most =
                mm.map_or_else(|| format!("{:.2} deg", deg.unwrap_or_default()), |mm| format!("{mm:.2} mm"));
            let axes = axes.join(", ");
            let hz = if min_hz == max_hz { min_hz.to_string() } else { format!("{min_hz} to {max_hz}") };
            ("vibration", format!("{axes}: {hz} Hz, up to {most}"))
        }));
        facts.extend(self.effects.iter().map(|effect| ("effect", effect.to_string())));
        let output = |OutputReport { usage, max_level }: &OutputReport| format!("{usage}, up to {max_level}");
        facts.extend(self.outputs.iter().map(|used| ("output", output(used))));
        let at = |marker: &MarkerReport| ShowTime::from_secs_f64(marker.at_s);
        facts.extend(self.markers.iter().map(|marker| ("marker", format!("{} {}", at(marker), marker.name))));
        facts
    }
}

fn vibration(timeline: &Timeline, figures: &[AxisFigures]) -> Vec<VibrationReport> {
    let report = figures.iter().enumerate().filter_map(|(axis, figures)| {
        let steps = timeline.cue().tracks().vibration(axis).as_slice().iter();
        let shaking =
            steps.map(|step| Vibration::from(step.value)).filter(|v| v.hz > 0.0 && v.amplitude > 0.0);
        let (hz, amplitudes): (Vec<_>, Vec<_>) = shaking.map(|v| (v.hz, v.amplitude)).unzip();
        let geometry = figures.on.geometry();
        let per_unit = timeline.unit(axis).to_stroke(geometry) * geometry.stroke();
        let most = per_unit * amplitudes.iter().copied().reduce(f64::max)?;
        let of = |unit: AxisUnit| (geometry.unit == unit).then_some(most);
        Some(VibrationReport {
            axis: format!("a{}", axis + 1),
            min_hz: hz.iter().copied().reduce(f64::min)?,
            max_hz: hz.iter().copied().reduce(f64::max)?,
            max_amplitude_mm: of(AxisUnit::Millimetre),
            max_amplitude_deg: of(AxisUnit::Degree),
        })
    });
    report.collect()
}

/// What is held back at the ends of an axis's stroke.
fn note(held: &Held, figures: &[AxisFigures], timeline: &Timeline) -> Option<String> {
    let axis = figures.get(held.axis)?.on.geometry();
    let unit = axis.unit.name();
    let over = held.over * timeline.unit(held.axis).to_stroke(axis) * axis.stroke();
    let Held { axis, stretches, at, .. } = held;
    Some(format!(
        "a{}: held at the stroke's end in {stretches} places, where the curve goes up to {over:.4} {unit} past it ({at})",
        axis + 1
    ))
}

/// Rounded to three places, and as short as that allows.
fn thousandths(value: f64) -> f64 {
    (1000.0 * value).round() / 1000.0
}

/// Each axis as a line of marks, from the bottom of its seat's stroke to the top.
fn drawn(timeline: &Timeline, figures: &[AxisFigures]) -> Vec<String> {
    const MARKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let slot = |(axis, figures): (usize, &AxisFigures)| {
        timeline.unit(axis).slot(&figures.on.seat, figures.on.index, Some(axis))
    };
    let mut curves: Vec<_> = figures.iter().enumerate().map(|one| (slot(one), String::new())).collect();
    let mut hint = Hint::default();
    for step in 0..DRAWN {
        let part = f64::from(step) / f64::from(DRAWN - 1);
        let at = ShowTime::from_secs_f64(part * timeline.duration().as_secs_f64());
        let pose = timeline.sample(at, &mut hint);
        for ((slot, curve), position) in curves.iter_mut().zip(pose) {
            let fraction = slot.place(position);
            let above = (1..8_u8).filter(|&mark| fraction >= f64::from(mark) / 8.0).count();
            curve.push(MARKS[above]);
        }
    }
    curves.into_iter().map(|(_, curve)| curve).collect()
}

fn append(text: &mut String, what: std::fmt::Arguments<'_>) {
    text.write_fmt(what).expect("a String takes all text");
}
