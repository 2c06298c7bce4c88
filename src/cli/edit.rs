//! `kinocue edit`: small changes of cues, one at a time.

use std::path::PathBuf;

use super::{Exit, Failure};
use crate::config::parse_level;
use crate::edit::{EditError, Treatment, lay};
use crate::time::{ShowTime, parse_duration, parse_time};

mod axes;
mod changes;

use axes::{AxisList, parse_axes};
use changes::{
    Seats, WrittenArgs, as_it_is, cut, edit, edit_all, fade, join, mirror, replace, scale, shift, whole,
};

const EXAMPLES: &str = "\
Examples:
  kinocue edit cut cues/coaster.csv --from 0:10 --to 0:20 -o middle.csv
  kinocue edit join cues/seat-demo.csv cues/bench-ride.csv --gap 3s -o evening.csv
  kinocue edit shift cues/bench-ride.csv --by +1.5s -o later.csv
  kinocue edit scale cues/coaster.csv --by 80% --axes 1 -o softer.csv
  kinocue edit mirror cues/bench-ride.csv --axes 2,3 -o mirrored.csv
  kinocue edit fade cues/coaster.csv --in 2s --out 3s -o faded.csv --plot
  kinocue edit mark cues/coaster.csv --at 0:12 \"the drop\" -o marked.mcap
  kinocue edit replace cues/bench-ride.csv --at 0:05 --with cues/seat-demo.csv --blend 3s -o mixed.csv
  kinocue edit axes cues/voyage.csv 1-3 -o three.csv

Exit codes: 0 written, and within all limits; 1 written, but it breaks limits, each told with its place; 64 wrong use; 65 no cue, or
written, but nothing can play it, as it leaves the stroke or is in another unit";

/// Changes cues in small ways: cuts, joins, shifts, scales, fades …
///
/// Each change writes a new cue, and says where that breaks the limits of its seats, as `kinocue check` does, where it jumps, and where
/// its curve is another beside what was edited. If `kinocue fit` mends what is broken, that was tried. Comments in the head of a CSV are
/// kept. The cue itself is written over only with --force; its owner and mode are kept then.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Args {
    #[command(subcommand)]
    change: EditChange,
}

#[derive(Debug, clap::Subcommand)]
enum EditChange {
    /// Keeps a stretch of a cue.
    #[command(
        after_help = "Example:\n  kinocue edit cut cues/coaster.csv --from 0:10 --to 0:20 -o middle.csv"
    )]
    Cut {
        /// The cue, CSV or MCAP.
        cue: PathBuf,
        /// Where the stretch begins [default: the beginning of the cue].
        #[arg(long, value_name = "TIME", value_parser = parse_time)]
        from: Option<ShowTime>,
        /// Where it ends [default: the end of the cue].
        #[arg(long, value_name = "TIME", value_parser = parse_time)]
        to: Option<ShowTime>,
        #[command(flatten)]
        written: WrittenArgs,
    },
    /// Joins cues, one after the other.
    #[command(
        after_help = "Example:\n  kinocue edit join cues/seat-demo.csv cues/bench-ride.csv --gap 3s -o evening.csv"
    )]
    Join {
        /// The cues, in order.
        #[arg(required = true, num_args = 2..)]
        cues: Vec<PathBuf>,
        /// Time between two of them, in which the curve leads from one to the other, and vibration, effects and outputs are off; what
        /// the last row of a cue switches lasts 20 ms.
        #[arg(long, value_name = "SPAN", value_parser = parse_span, default_value = "0s")]
        gap: ShowTime,
        #[command(flatten)]
        written: WrittenArgs,
    },
    /// Moves a cue in time: later with a rest before it, in which everything is off, earlier without its beginning.
    #[command(
        after_help = "Examples:\n  kinocue edit shift cues/bench-ride.csv --by +1.5s -o later.csv\n  kinocue edit shift \
                            cues/bench-ride.csv --by -500ms -o earlier.csv"
    )]
    Shift {
        /// The cue, CSV or MCAP.
        cue: PathBuf,
        /// By how much: +1.5s is later, -500ms earlier.
        #[arg(long, value_name = "SPAN", value_parser = parse_change, allow_hyphen_values = true)]
        by: ShowTime,
        #[command(flatten)]
        written: WrittenArgs,
    },
    /// Scales motion and vibration about the seats' neutral pose.
    #[command(after_help = "Example:\n  kinocue edit scale cues/coaster.csv --by 80% --axes 1 -o softer.csv")]
    Scale {
        /// The cue, CSV or MCAP.
        cue: PathBuf,
        /// To how much: 80%, 0.8 or -2dB.
        #[arg(long, value_name = "LEVEL", value_parser = parse_level, allow_hyphen_values = true)]
        by: f64,
        /// Only these axes, from 1: 2, or 1,3, or 1-3 [default: all].
        #[arg(long, value_name = "AXES", value_parser = parse_axes)]
        axes: Option<AxisList>,
        #[command(flatten)]
        written: WrittenArgs,
    },
    /// Mirrors axes about the middle of their stroke.
    #[command(after_help = "Example:\n  kinocue edit mirror cues/bench-ride.csv --axes 2,3 -o mirrored.csv")]
    Mirror {
        /// The cue, CSV or MCAP.
        cue: PathBuf,
        /// These axes, from 1: 2, or 1,3, or 1-3.
        #[arg(long, value_name = "AXES", value_parser = parse_axes)]
        axes: AxisList,
        #[command(flatten)]
        written: WrittenArgs,
    },
    /// Leads a cue out of the seats' park pose at its beginning, and back at its end. Types of seats that park elsewhere need --seat.
    #[command(
        after_help = "Example:\n  kinocue edit fade cues/coaster.csv --in 2s --out 3s -o faded.csv --plot"
    )]
    Fade {
        /// The cue, CSV or MCAP.
        cue: PathBuf,
        /// How long at the beginning.
        #[arg(long = "in", value_name = "SPAN", value_parser = parse_span, default_value = "0s")]
        rise: ShowTime,
        /// How long at the end.
        #[arg(long = "out", value_name = "SPAN", value_parser = parse_span, default_value = "0s")]
        fall: ShowTime,
        #[command(flatten)]
        written: WrittenArgs,
    },
    /// Sets a marker; MCAP alone has a place for it.
    #[command(
        after_help = "Example:\n  kinocue edit mark cues/coaster.csv --at 0:12 \"the drop\" -o marked.mcap"
    )]
    Mark {
        /// The cue, CSV or MCAP.
        cue: PathBuf,
        /// Its name.
        name: String,
        /// When.
        #[arg(long, value_name = "TIME", value_parser = parse_time)]
        at: ShowTime,
        #[command(flatten)]
        written: WrittenArgs,
    },
    /// Replaces a stretch of a cue by another cue, faded in and out over the stretch; before and after it all is as it was.
    #[command(
        after_help = "Example:\n  kinocue edit replace cues/bench-ride.csv --at 0:05 --with cues/seat-demo.csv --blend 3s -o mixed.csv"
    )]
    Replace {
        /// The cue, CSV or MCAP.
        cue: PathBuf,
        /// The other cue; the stretch is as long.
        #[arg(long, value_name = "CUE")]
        with: PathBuf,
        /// Where the stretch begins.
        #[arg(long, value_name = "TIME", value_parser = parse_time)]
        at: ShowTime,
        /// How long it takes from one to the other, at each end.
        #[arg(long, value_name = "SPAN", value_parser = parse_span, default_value = "1s")]
        blend: ShowTime,
        #[command(flatten)]
        written: WrittenArgs,
    },
    /// Keeps some axes of a cue, in the order given.
    #[command(after_help = "Example:\n  kinocue edit axes cues/voyage.csv 1-3 -o three.csv")]
    Axes {
        /// The cue, CSV or MCAP.
        cue: PathBuf,
        /// These axes, from 1: 1-3, or 3,1.
        #[arg(value_parser = parse_axes)]
        axes: AxisList,
        #[command(flatten)]
        written: WrittenArgs,
    },
}

fn parse_span(text: &str) -> Result<ShowTime, String> {
    parse_duration(text).map(|span| ShowTime::ZERO + span)
}

/// A span that may be negative.
fn parse_change(text: &str) -> Result<ShowTime, String> {
    match text.strip_prefix('-') {
        Some(span) => parse_span(span).map(|span| ShowTime::ZERO.since(span)),
        None => parse_span(text.strip_prefix('+').unwrap_or(text)),
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    match &args.change {
        EditChange::Cut { cue, from, to, written } => edit(cue, written, |seats| cut(seats, *from, *to)),
        EditChange::Join { cues, gap, written } => {
            let bridge = "--gap 2s leads from one to the other";
            edit_all(cues, written, bridge, |all, seats| join(all, seats, *gap))
        }
        EditChange::Shift { cue, by, written } => edit(cue, written, |seats| shift(seats, *by)),
        EditChange::Scale { cue, by, axes, written } => {
            edit(cue, written, |seats| scale(seats, *by, chosen(axes.as_ref(), seats)?))
        }
        EditChange::Mirror { cue, axes, written } => {
            edit(cue, written, |seats| mirror(seats, chosen(Some(axes), seats)?))
        }
        EditChange::Fade { cue, rise, fall, written } => {
            edit(cue, written, |seats| fade(seats, *rise, *fall))
        }
        EditChange::Mark { cue, name, at, written } => edit(cue, written, |seats| {
            let mut laid = cut(seats, None, None)?;
            laid.cue.mark(*at, name).map_err(EditError::Cue)?;
            Ok(laid)
        }),
        EditChange::Replace { cue, with, at, blend, written } => {
            let bridge = "--blend SPAN, up to half of the other cue, leads from one to the other";
            let cues = [cue.clone(), with.clone()];
            edit_all(&cues, written, bridge, |all, seats| replace(seats, &all[1], *at, *blend))
        }
        EditChange::Axes { cue, axes, written } => edit(cue, written, |seats| {
            let how = Treatment { axes: chosen(Some(axes), seats)?, ..as_it_is(seats) };
            lay(&[whole(seats.0, ShowTime::ZERO)], &how)
        }),
    }
}

/// The axes that are meant, which the cue has.
fn chosen(axes: Option<&AxisList>, seats: &Seats<'_>) -> Result<Vec<usize>, EditError> {
    let was = seats.0;
    let Some(axes) = axes else { return Ok((0..was.axes()).collect()) };
    match axes.missing(was.axes()) {
        Some(axis) => Err(EditError::NoAxis(axis, was.axes())),
        None => Ok(axes.0.clone()),
    }
}
