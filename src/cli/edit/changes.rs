//! What each edit does, and what is said of the new cue.

use std::path::{Path, PathBuf};

use anyhow::anyhow;

use crate::cli::load::{self, Judge, SeatArgs};
use crate::cli::{Exit, Failure, OrExit as _, convert, exit, plot, print};
use crate::cue::{Cue, Source};
use crate::edit::{CuePiece, EditError, Seam, Treatment, eased, lay};
use crate::motion::SeatAxis;
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

/// A new cue, and where it jumps.
pub(super) type Edit = Result<(Cue, Vec<Seam>), EditError>;

/// The seats that a cue is edited for, an axis each.
pub(super) struct Seats<'t>(&'t Timeline, Vec<SeatAxis>);

impl Seats<'_> {
    /// A place of an axis in the cue's unit, of a fraction of its stroke.
    fn place(&self, axis: usize, fraction: f64) -> f64 {
        let (low, high) = self.0.unit(axis).ends(self.1[axis].geometry());
        low + fraction * (high - low)
    }

    pub(super) fn neutral(&self, axis: usize) -> f64 {
        self.place(axis, self.1[axis].geometry().neutral)
    }

    fn park(&self, axis: usize) -> f64 {
        self.place(axis, self.1[axis].geometry().park)
    }

    /// The place on the other side of the middle of the stroke.
    pub(super) fn mirrored(&self, axis: usize, place: f64) -> f64 {
        self.place(axis, 0.0) + self.place(axis, 1.0) - place
    }
}

/// Nothing is changed on the way.
pub(super) fn as_it_is(was: &Timeline) -> Treatment<'static> {
    let axes = (0..was.axes()).collect();
    Treatment { axes, position: &|_, _, place| place, strength: &|_, _| 1.0, dense: Vec::new() }
}

/// All of a cue, from there on.
pub(super) fn whole(of: &Timeline, at: ShowTime) -> CuePiece<'_> {
    CuePiece { of, from: ShowTime::ZERO, until: of.duration(), at }
}

/// The same cue from an instant to another.
pub(super) fn cut(was: &Timeline, from: Option<ShowTime>, to: Option<ShowTime>) -> Edit {
    let end = was.duration();
    let (from, until) = (from.unwrap_or_default(), to.unwrap_or(end).min(end));
    if from >= until {
        return Err(EditError::Nothing(from, until));
    }
    lay(&[CuePiece { of: was, from, until, at: ShowTime::ZERO }], &as_it_is(was))
}

pub(super) fn shift(was: &Timeline, by: ShowTime) -> Edit {
    if by < ShowTime::ZERO {
        return cut(was, Some(ShowTime::ZERO.since(by)), None);
    }
    let rest = CuePiece { of: was, from: ShowTime::ZERO, until: ShowTime::ZERO, at: ShowTime::ZERO };
    lay(&[rest, whole(was, by)], &as_it_is(was))
}

pub(super) fn join(all: &[Timeline], gap: ShowTime) -> Edit {
    let mut at = ShowTime::ZERO;
    let mut pieces = Vec::new();
    for one in all {
        pieces.push(whole(one, at));
        at = ShowTime::from_nanos(at.as_nanos() + one.duration().as_nanos() + gap.as_nanos());
    }
    lay(&pieces, &as_it_is(&all[0]))
}

/// How far a fade is by a time: 0 at the ends of the cue, 1 between.
fn weight(at: ShowTime, (rise, fall): (ShowTime, ShowTime), end: ShowTime) -> f64 {
    let part = |of: ShowTime, span: ShowTime| {
        if span > ShowTime::ZERO { of.as_secs_f64() / span.as_secs_f64() } else { 1.0 }
    };
    eased(part(at, rise)) * eased(part(end.since(at), fall))
}

pub(super) fn fade(was: &Timeline, seats: &Seats<'_>, rise: ShowTime, fall: ShowTime) -> Edit {
    let end = was.duration();
    if rise.as_nanos() + fall.as_nanos() > end.as_nanos() {
        return Err(EditError::TooLong(end));
    }
    let weight = |at| weight(at, (rise, fall), end);
    let how = Treatment {
        position: &|at, axis, place| seats.park(axis) + weight(at) * (place - seats.park(axis)),
        strength: &|at, _| weight(at),
        dense: vec![(ShowTime::ZERO, rise), (end.since(fall), end)],
        ..as_it_is(was)
    };
    lay(&[whole(was, ShowTime::ZERO)], &how)
}

/// Lays another cue over a stretch, faded in and out.
pub(super) fn replace(was: &Timeline, other: &Timeline, at: ShowTime, blend: ShowTime) -> Edit {
    let (begin, end) = (at, ShowTime::from_nanos(at.as_nanos() + other.duration().as_nanos()));
    if end > was.duration() || 2 * blend.as_nanos() > other.duration().as_nanos() {
        return Err(EditError::TooLong(was.duration()));
    }
    let weight = |time: ShowTime| weight(time.since(begin), (blend, blend), other.duration());
    let is_there = |time: ShowTime| (begin..=end).contains(&time);
    let how = Treatment {
        position: &|time, axis, place| {
            if !is_there(time) {
                return place;
            }
            let before = was.sample(time, &mut Hint::default())[axis];
            before + weight(time) * (place - before)
        },
        strength: &|time, axis| if is_there(time) && axis.is_some() { weight(time) } else { 1.0 },
        dense: vec![
            (begin, ShowTime::from_nanos(begin.as_nanos() + blend.as_nanos())),
            (end.since(blend), end),
        ],
        ..as_it_is(was)
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
    change: impl FnOnce(&Timeline, &Seats<'_>) -> Edit,
) -> Result<Exit, Failure> {
    edit_all(&[cue.to_path_buf()], written, |all, seats| change(&all[0], seats))
}

/// The same of several; the first is drawn as it was.
pub(super) fn edit_all(
    cues: &[PathBuf],
    written: &WrittenArgs,
    change: impl FnOnce(&[Timeline], &Seats<'_>) -> Edit,
) -> Result<Exit, Failure> {
    let target = convert::target(&written.output).or_exit(Exit::Usage)?;
    exit::refuse_to_replace(&written.output, written.force)?;
    let hall = written.seat.config.as_deref().map(load::config).transpose()?;
    let judge = written.seat.judge(hall)?;
    let read = |path: &PathBuf| load::cue(path, &Source::Native).map(Timeline::new);
    let all = cues.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let seats = Seats(&all[0], judge.seats(all[0].axes()));
    let (after, seams) = change(&all, &seats).map_err(|error| {
        let exit = if matches!(error, EditError::Cue(_)) { Exit::BadCue } else { Exit::Usage };
        Failure { exit, error: anyhow::Error::new(error).context(cues[0].display().to_string()) }
    })?;
    if matches!(target, convert::ConvertTarget::Csv) && !after.markers().is_empty() {
        let error = anyhow!(
            "{}: CSV has no place for markers; give an output whose name ends in .mcap",
            written.output.display()
        );
        return Err(error).or_exit(Exit::Usage);
    }
    convert::write(&after, &written.output, target)?;
    // As it is read, so that faults have their places in the file.
    let after = Timeline::new(load::cue(&written.output, &Source::Native)?);
    if written.plot {
        plot::draw(&all[0], &judge)?;
        plot::draw(&after, &judge)?;
    }
    tell(&after, &seams, &judge, written)
}

/// Says what was written, where it jumps, and which limits it breaks.
fn tell(after: &Timeline, seams: &[Seam], judge: &Judge, written: &WrittenArgs) -> Result<Exit, Failure> {
    let name = plain::path(&written.output);
    let (rows, axes, length) = (after.cue().rows(), after.axes(), after.duration());
    let noun = if axes == 1 { "axis" } else { "axes" };
    print::tell(&format!("{name}: {rows} rows, {axes} {noun}, {length}"));
    for Seam { at, axis, by } in seams {
        let unit = after.unit(*axis).suffix();
        print::tell(&format!(
            "{name}: a{} jumps by {by:.3}{unit} at {at}, where the cues meet; --gap 2s leads from one to the other",
            axis + 1
        ));
    }
    let strokes = judge.stroke(after).faults;
    strokes.iter().for_each(|faults| print::tell(&format!("{name}: {faults}")));
    let proof = judge.prove(after, judge.terms(after, 1.0));
    proof.violations.iter().for_each(|one| print::tell(&format!("{name}:{one}")));
    let remedy = written.seat.remedy();
    Ok(match (strokes.is_empty(), proof.passed()) {
        (true, true) => {
            print::tell(&format!("{name}: keeps all limits at {} frames a second", judge.rate_hz));
            Exit::Done
        }
        _ => {
            print::tell(&format!(
                "{name}: is written, and breaks limits; {remedy} makes one that keeps them"
            ));
            Exit::CheckFailed
        }
    })
}
