//! What each edit does, and what is said of the new cue.

use std::path::{Path, PathBuf};

use anyhow::anyhow;

use crate::cli::convert::ConvertTarget;
use crate::cli::load::{self, Judge, SeatArgs};
use crate::cli::{Exit, Failure, OrExit as _, convert, exit, fit, plot, print};
use crate::cue::{self, Source};
use crate::edit::{CuePiece, EditError, Laid, SAME, Seam, Stray, Treatment, eased, lay};
use crate::motion::{AxisGeometry, MAX_AXES, SeatAxis};
use crate::plain;
use crate::time::ShowTime;
use crate::timeline::{Hint, Timeline};

/// Where the new cue goes, and what it is held against.
#[derive(Debug, clap::Args)]
pub(super) struct WrittenArgs {
    /// The file to write; its name ends in .csv or .mcap.
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    seat: SeatArgs,
    /// Overwrite OUT if it exists, even where it is the cue itself.
    #[arg(long)]
    force: bool,
    /// Draw the cue before and after.
    #[arg(long)]
    plot: bool,
}

/// What comes of an edit.
pub(super) type Edit = Result<Laid, EditError>;

/// The most rows of a cue that `fit` is tried on before it is named as a remedy: some seconds of work.
const MAX_TRIED: usize = 100_000;

/// The seats that a cue is edited for: what each axis is on, first that of the controller that takes it first.
pub(super) struct Seats<'t>(pub(super) &'t Timeline, pub(super) Vec<(SeatAxis, Vec<SeatAxis>)>);

impl Seats<'_> {
    /// A place of an axis in the cue's unit, of a fraction of the stroke of a seat.
    fn place(&self, axis: usize, on: &SeatAxis, fraction: f64) -> f64 {
        let (low, high) = self.0.unit(axis).ends(on.geometry());
        low + fraction * (high - low)
    }

    /// A place that all seats have alike.
    fn common(
        &self,
        axis: usize,
        what: &'static str,
        fraction: fn(&AxisGeometry) -> f64,
    ) -> Result<f64, EditError> {
        let (first, others) = &self.1[axis];
        let of = |on: &SeatAxis| self.place(axis, on, fraction(on.geometry()));
        let place = of(first);
        match others.iter().find(|other| (of(other) - place).abs() > SAME) {
            None => Ok(place),
            Some(other) => Err(EditError::SeatsDiffer {
                axis: axis + 1,
                what,
                one: (first.seat.name.clone(), place),
                other: (other.seat.name.clone(), of(other)),
                unit: self.0.unit(axis).suffix(),
            }),
        }
    }

    pub(super) fn neutral(&self, axis: usize) -> Result<f64, EditError> {
        self.common(axis, "the neutral pose", |on| on.neutral)
    }

    fn park(&self, axis: usize) -> Result<f64, EditError> {
        self.common(axis, "the park pose", |on| on.park)
    }

    /// The middle of the stroke, about which an axis is mirrored.
    pub(super) fn middle(&self, axis: usize) -> Result<f64, EditError> {
        self.common(axis, "the middle of the stroke", |_| 0.5)
    }

    /// The ends of the stroke that all seats of an axis have.
    fn ends(&self, axis: usize) -> (f64, f64) {
        let (first, others) = &self.1[axis];
        let of = |on: &SeatAxis| self.0.unit(axis).ends(on.geometry());
        let both = |one: (f64, f64), other: (f64, f64)| (one.0.max(other.0), one.1.min(other.1));
        let ends = others.iter().map(of).fold(of(first), both);
        // Seats that have nothing in common have no end that a place could be held at; `check` says which it leaves.
        if ends.0 < ends.1 { ends } else { of(first) }
    }
}

/// Nothing is changed on the way.
pub(super) fn as_it_is(seats: &Seats<'_>) -> Treatment<'static> {
    let axes: Vec<usize> = (0..seats.0.axes()).collect();
    let ends = axes.iter().map(|axis| seats.ends(*axis)).collect();
    Treatment { axes, position: &|_, _, place| place, strength: &|_, _| 1.0, dense: Vec::new(), ends }
}

/// All of a cue, from there on.
pub(super) fn whole(of: &Timeline, at: ShowTime) -> CuePiece<'_> {
    CuePiece { of, from: ShowTime::ZERO, until: of.duration(), at }
}

/// The same cue from an instant to another.
pub(super) fn cut(seats: &Seats<'_>, from: Option<ShowTime>, to: Option<ShowTime>) -> Edit {
    let end = seats.0.duration();
    let (from, until) = (from.unwrap_or_default(), to.unwrap_or(end).min(end));
    if from >= until {
        return Err(EditError::Nothing(from, until));
    }
    lay(&[CuePiece { of: seats.0, from, until, at: ShowTime::ZERO }], &as_it_is(seats))
}

pub(super) fn shift(seats: &Seats<'_>, by: ShowTime) -> Edit {
    if by < ShowTime::ZERO {
        return cut(seats, Some(ShowTime::ZERO.since(by)), None);
    }
    lay(&[whole(seats.0, by)], &as_it_is(seats))
}

pub(super) fn join(all: &[Timeline], seats: &Seats<'_>, gap: ShowTime) -> Edit {
    let mut at = ShowTime::ZERO;
    let mut pieces = Vec::new();
    for one in all {
        pieces.push(whole(one, at));
        at = ShowTime::from_nanos(at.as_nanos() + one.duration().as_nanos() + gap.as_nanos());
    }
    lay(&pieces, &as_it_is(seats))
}

/// Scales some axes about the neutral pose.
pub(super) fn scale(seats: &Seats<'_>, by: f64, axes: Vec<usize>) -> Edit {
    let about = each(&axes, |axis| seats.neutral(axis))?;
    let how = Treatment {
        position: &|_, axis, place| about[axis].map_or(place, |about| about + by * (place - about)),
        strength: &|_, axis| if axis.is_some_and(|axis| axes.contains(&axis)) { by } else { 1.0 },
        ..as_it_is(seats)
    };
    lay(&[whole(seats.0, ShowTime::ZERO)], &how)
}

/// Mirrors some axes about the middle of their stroke.
pub(super) fn mirror(seats: &Seats<'_>, axes: Vec<usize>) -> Edit {
    let about = each(&axes, |axis| seats.middle(axis))?;
    let how = Treatment {
        position: &|_, axis, place| about[axis].map_or(place, |middle| 2.0 * middle - place),
        ..as_it_is(seats)
    };
    lay(&[whole(seats.0, ShowTime::ZERO)], &how)
}

/// A place for each of these axes, and none for others.
fn each(
    axes: &[usize],
    place: impl Fn(usize) -> Result<f64, EditError>,
) -> Result<[Option<f64>; MAX_AXES], EditError> {
    let mut places = [None; MAX_AXES];
    for axis in axes {
        places[*axis] = Some(place(*axis)?);
    }
    Ok(places)
}

/// How far a fade is by a time: 0 at the ends of the cue, 1 between.
fn weight(at: ShowTime, (rise, fall): (ShowTime, ShowTime), end: ShowTime) -> f64 {
    let part = |of: ShowTime, span: ShowTime| {
        if span > ShowTime::ZERO { of.as_secs_f64() / span.as_secs_f64() } else { 1.0 }
    };
    eased(part(at, rise)) * eased(part(end.since(at), fall))
}

pub(super) fn fade(seats: &Seats<'_>, rise: ShowTime, fall: ShowTime) -> Edit {
    let end = seats.0.duration();
    if rise.as_nanos() + fall.as_nanos() > end.as_nanos() {
        return Err(EditError::TooLong(end));
    }
    let park = (0..seats.0.axes()).map(|axis| seats.park(axis)).collect::<Result<Vec<_>, _>>()?;
    let weight = |at| weight(at, (rise, fall), end);
    let how = Treatment {
        position: &|at, axis, place| match weight(at) {
            1.0 => place,
            weight => park[axis] + weight * (place - park[axis]),
        },
        strength: &|at, _| weight(at),
        dense: vec![(ShowTime::ZERO, rise), (end.since(fall), end)],
        ..as_it_is(seats)
    };
    lay(&[whole(seats.0, ShowTime::ZERO)], &how)
}

/// Lays another cue over a stretch, faded in and out.
pub(super) fn replace(seats: &Seats<'_>, other: &Timeline, at: ShowTime, blend: ShowTime) -> Edit {
    let was = seats.0;
    let (begin, end) = (at, ShowTime::from_nanos(at.as_nanos() + other.duration().as_nanos()));
    if end > was.duration() || 2 * blend.as_nanos() > other.duration().as_nanos() {
        return Err(EditError::TooLong(was.duration()));
    }
    let weight = |time: ShowTime| weight(time.since(begin), (blend, blend), other.duration());
    let how = Treatment {
        position: &|time, axis, place| {
            if !(begin..=end).contains(&time) {
                return place;
            }
            let before = was.sample(time, &mut Hint::default())[axis];
            before + weight(time) * (place - before)
        },
        // From its end on the cue holds what it held.
        strength: &|time, axis| {
            if (begin..end).contains(&time) && axis.is_some() { weight(time) } else { 1.0 }
        },
        dense: vec![
            (begin, ShowTime::from_nanos(begin.as_nanos() + blend.as_nanos())),
            (end.since(blend), end),
        ],
        ..as_it_is(seats)
    };
    let zero = ShowTime::ZERO;
    let pieces = [
        CuePiece { of: was, from: zero, until: begin, at: zero },
        whole(other, begin),
        CuePiece { of: was, from: end, until: was.duration(), at: end },
    ];
    lay(&pieces, &how)
}

/// Edits one cue, and writes what comes of it.
pub(super) fn edit(
    cue: &Path,
    written: &WrittenArgs,
    change: impl FnOnce(&Seats<'_>) -> Edit,
) -> Result<Exit, Failure> {
    edit_all(&[cue.to_path_buf()], written, "", |_, seats| change(seats))
}

/// The same of several; the first is drawn as it was. `bridge` says what leads from one to the other where they meet elsewhere.
pub(super) fn edit_all(
    cues: &[PathBuf],
    written: &WrittenArgs,
    bridge: &str,
    change: impl FnOnce(&[Timeline], &Seats<'_>) -> Edit,
) -> Result<Exit, Failure> {
    let target = convert::target(&written.output).or_exit(Exit::Usage)?;
    exit::refuse_to_replace(&written.output, written.force)?;
    let hall = written.seat.config.as_deref().map(load::config).transpose()?;
    let judge = written.seat.judge(hall)?;
    let read = |path: &PathBuf| load::cue(path, &Source::Native).map(Timeline::new);
    let all = cues.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let seats = Seats(&all[0], judge.all_seats(all[0].axes()));
    let laid = change(&all, &seats).map_err(|error| {
        let exit = if matches!(error, EditError::Cue(_)) { Exit::BadCue } else { Exit::Usage };
        Failure { exit, error: anyhow::Error::new(error).context(cues[0].display().to_string()) }
    })?;
    if matches!(target, ConvertTarget::Csv) && !laid.cue.markers().is_empty() {
        let error = anyhow!(
            "{}: CSV has no place for markers; give an output whose name ends in .mcap",
            written.output.display()
        );
        return Err(error).or_exit(Exit::Usage);
    }
    convert::write(&laid.cue, &comments(cues, target), &written.output, target)?;
    // As it is read, so that faults have their places in the file.
    let after = Timeline::new(load::cue(&written.output, &Source::Native)?);
    if written.plot {
        plot::draw(&all[0], &judge)?;
        plot::draw(&after, &judge)?;
    }
    tell_changes(&after, &laid, bridge, &plain::path(&written.output));
    tell_limits(&after, &judge, written)
}

/// The comments that the new cue keeps, which are those of the first cue; says whose are left out.
fn comments(cues: &[PathBuf], target: ConvertTarget) -> Vec<String> {
    let mut kept = Vec::new();
    for (number, cue) in cues.iter().enumerate() {
        let comments = cue::comments(cue);
        let why = match (number, target) {
            (0, ConvertTarget::Csv) => {
                kept = comments;
                continue;
            }
            (0, ConvertTarget::Mcap) => "MCAP has no place for them",
            _ => "only those of the first cue are kept",
        };
        if !comments.is_empty() {
            let (name, count) = (plain::path(cue), comments.len());
            let lines = if count == 1 { "line of comments is" } else { "lines of comments are" };
            print::tell(&format!("{name}: {count} {lines} left out: {why}"));
        }
    }
    kept
}

/// Says what was written, where it jumps, and where its curve is another beside what was edited.
fn tell_changes(after: &Timeline, laid: &Laid, bridge: &str, name: &str) {
    let (rows, axes, length) = (after.cue().rows(), after.axes(), after.duration());
    let noun = if axes == 1 { "axis" } else { "axes" };
    print::tell(&format!("{name}: {rows} rows, {axes} {noun}, {length}"));
    for Seam { at, axis, by } in &laid.seams {
        let unit = after.unit(*axis).suffix();
        print::tell(&format!(
            "{name}: a{} jumps by {by:.3}{unit} at {at}, where the cues meet; {bridge}",
            axis + 1
        ));
    }
    for Stray { from, until, axis, by, .. } in &laid.strays {
        let unit = after.unit(*axis).suffix();
        print::tell(&format!(
            "{name}: from {from} to {until} the curve is another than before, as it runs on into something else: a{} by up to {by:.6}{unit}",
            axis + 1
        ));
    }
}

/// Says which limits the new cue breaks, and what mends that.
fn tell_limits(after: &Timeline, judge: &Judge, written: &WrittenArgs) -> Result<Exit, Failure> {
    let name = plain::path(&written.output);
    let strokes = judge.stroke(after).faults;
    strokes.iter().for_each(|faults| print::tell(&format!("{name}: {faults}")));
    let proof = judge.prove(after, judge.terms(after, 1.0));
    proof.violations.iter().for_each(|one| print::tell(&format!("{name}:{one}")));
    if strokes.is_empty() && proof.passed() {
        print::tell(&format!("{name}: keeps all limits at {} frames a second", judge.rate_hz));
        return Ok(Exit::Done);
    }
    let exit = strokes.first().map_or(Exit::CheckFailed, load::cue_exit);
    let what = if strokes.is_empty() { "breaks limits" } else { "cannot be played" };
    print::tell(&format!("{name}: is written, and {what}; {}", remedy(after, judge, written)));
    Ok(exit)
}

/// What makes a cue of the new one that keeps the limits; it was tried.
fn remedy(after: &Timeline, judge: &Judge, written: &WrittenArgs) -> String {
    if after.cue().rows() > MAX_TRIED {
        return format!("whether kinocue fit mends that was not tried: it has over {MAX_TRIED} rows");
    }
    let mends = [("", false), (" --smooth", true)];
    let found = mends.into_iter().find(|(_, smooth)| fit::mends(after.cue(), judge, *smooth));
    match found {
        Some((smooth, _)) => {
            let (cue, seat) = (plain::shell(&written.output), written.seat.as_typed());
            format!("kinocue fit {cue} -o OUT{smooth}{seat} makes one that keeps them")
        }
        None => "kinocue fit cannot mend that; change the edit, or the cue that was edited".to_owned(),
    }
}

#[cfg(test)]
mod tests;
