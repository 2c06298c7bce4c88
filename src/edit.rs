//! Cues into others: stretches of them laid one after the other, and what becomes of each position on the way. Control thread; pure.

use crate::channel::{CHANNELS, PartKind, Sample, Scope, TrackId};
use crate::cue::{Cue, Effects, Problem, Splice};
use crate::time::ShowTime;
use crate::timeline::{Hint, Timeline};

/// Rows are so close where positions are changed by more than the rows that there are can show.
const DENSE: ShowTime = ShowTime::from_millis(20);
/// Positions that differ by less, as a fraction of the stroke or in mm, degrees or pulses, are the same.
const SAME: f64 = 1e-9;

/// A part of a cue, and where it goes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CuePiece<'a> {
    /// The cue.
    pub(crate) of: &'a Timeline,
    /// Where the part begins in it.
    pub(crate) from: ShowTime,
    /// Where it ends.
    pub(crate) until: ShowTime,
    /// Where it begins in the new cue.
    pub(crate) at: ShowTime,
}

/// What becomes of positions and of the strength of vibration, by the time in the new cue and the axis there.
pub(crate) struct Treatment<'a> {
    /// Which axes of the cues the new one has, in that order, from 0.
    pub(crate) axes: Vec<usize>,
    /// The new position of one.
    pub(crate) position: &'a dyn Fn(ShowTime, usize, f64) -> f64,
    /// The factor of its vibration, and of what is for all seats, which has no axis.
    pub(crate) strength: &'a dyn Fn(ShowTime, Option<usize>) -> f64,
    /// Where these change with time.
    pub(crate) dense: Vec<(ShowTime, ShowTime)>,
}

/// Where two pieces meet, and an axis is elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seam {
    /// When.
    pub(crate) at: ShowTime,
    /// The axis that is farthest off, from 0.
    pub(crate) axis: usize,
    /// By how much, in its unit.
    pub(crate) by: f64,
}

/// Why cues cannot be laid one after the other.
#[derive(Debug, thiserror::Error)]
pub(crate) enum EditError {
    /// One is made of other things than the first.
    #[error("{0} differs from the first cue in {1}; convert or edit it first, so that they are alike")]
    Unlike(String, &'static str),
    /// There is no such stretch.
    #[error("nothing lies from {0} to {1}")]
    Nothing(ShowTime, ShowTime),
    /// More than the cue has room for.
    #[error("that is longer than the cue, or than the stretch, has room for; the cue is {0} long")]
    TooLong(ShowTime),
    /// An axis that is not there.
    #[error("there is no axis {0}; the cue has {1}")]
    NoAxis(usize, usize),
    /// The new cue is none.
    #[error("the new cue: {0}")]
    Cue(Problem),
}

/// Lays pieces one after the other, the first at 0; gives the new cue, and where it jumps.
///
/// # Errors
/// [`EditError`] where the cues are not alike, or what comes of them is no cue.
pub(crate) fn lay(pieces: &[CuePiece<'_>], how: &Treatment<'_>) -> Result<(Cue, Vec<Seam>), EditError> {
    let Some(first) = pieces.first().map(|piece| piece.of.cue()) else {
        return Err(EditError::Cue(Problem::Empty));
    };
    let (mut out, mut seams, mut last) = (Splice::like(first, &how.axes), Vec::new(), Vec::new());
    for (number, piece) in pieces.iter().enumerate() {
        alike(first, piece.of.cue())?;
        let mut laid = LaidPiece { piece, how, is_last: number + 1 == pieces.len() };
        seams.extend(laid.rows(&mut out, &mut last));
        laid.tracks(&mut out);
        laid.effects(&mut out).map_err(EditError::Cue)?;
        laid.markers(&mut out);
    }
    Ok((out.finish().map_err(EditError::Cue)?, seams))
}

fn alike(first: &Cue, other: &Cue) -> Result<(), EditError> {
    let words = |cue: &Cue| matches!(cue.effects(), Effects::Words(_));
    let differs = [
        (first.axes() != other.axes(), "its number of axes"),
        (first.unit_words() != other.unit_words(), "its units"),
        (first.interpolation() != other.interpolation(), "how its curve runs between rows"),
        (words(first) != words(other), "how it says effects: by name, or as a raw output word"),
    ];
    match differs.into_iter().find(|(differs, _)| *differs) {
        Some((_, what)) => Err(EditError::Unlike(other.path().display().to_string(), what)),
        None => Ok(()),
    }
}

struct LaidPiece<'p> {
    piece: &'p CuePiece<'p>,
    how: &'p Treatment<'p>,
    is_last: bool,
}

impl LaidPiece<'_> {
    /// A time of the cue in the new one.
    fn there(&self, at: ShowTime) -> ShowTime {
        let CuePiece { from, at: begins, .. } = self.piece;
        ShowTime::from_nanos(begins.as_nanos() + at.as_nanos() - from.as_nanos())
    }

    /// The times of its rows, and those between them that are needed.
    fn times(&self) -> Vec<ShowTime> {
        let CuePiece { of, from, until, at } = *self.piece;
        let mut times: Vec<ShowTime> =
            of.cue().times().iter().copied().filter(|time| (from..=until).contains(time)).collect();
        times.extend([from, until]);
        for (begin, end) in &self.how.dense {
            let here =
                |there: ShowTime| ShowTime::from_nanos(there.as_nanos() - at.as_nanos() + from.as_nanos());
            let (begin, end) = (here(*begin).max(from), here(*end).min(until));
            if begin > end {
                continue; // elsewhere
            }
            let count = (end.as_nanos() - begin.as_nanos()) / DENSE.as_nanos();
            let step = |step| ShowTime::from_nanos(begin.as_nanos() + step * DENSE.as_nanos());
            times.extend((0..=count).map(step).chain([end]));
        }
        times.sort_unstable();
        times.dedup();
        times
    }

    /// Its rows; gives the seam before it, if there is one.
    fn rows(&mut self, out: &mut Splice, last: &mut Vec<f64>) -> Option<Seam> {
        let (mut hint, mut seam) = (Hint::default(), None);
        for (number, time) in self.times().into_iter().enumerate() {
            let (pose, at) = (self.piece.of.sample(time, &mut hint), self.there(time));
            let axes = self.how.axes.iter().enumerate();
            let row: Vec<f64> = axes.map(|(axis, from)| (self.how.position)(at, axis, pose[*from])).collect();
            if number == 0 && out.end() == Some(at) {
                let off =
                    last.iter().zip(&row).map(|(before, now): (&f64, &f64)| (now - before).abs()).enumerate();
                let worst = off.max_by(|one, other| one.1.total_cmp(&other.1)).filter(|(_, by)| *by > SAME);
                seam = worst.map(|(axis, by)| Seam { at, axis, by });
                if seam.is_some() {
                    out.make_room();
                }
            }
            out.row(at, &row);
            *last = row;
        }
        seam
    }

    /// True of a change that is in this piece, and not its first instant.
    fn is_in(&self, at: ShowTime) -> bool {
        let CuePiece { from, until, .. } = *self.piece;
        from < at && (at < until || self.is_last && at == until)
    }

    fn tracks(&self, out: &mut Splice) {
        let CuePiece { of, from, .. } = self.piece;
        let steps = of.cue().tracks();
        for channel in CHANNELS {
            for new in channel.tracks(self.how.axes.len()) {
                let axis = (channel.scope == Scope::Axis).then_some(new.axis);
                let old = TrackId { axis: axis.map_or(0, |axis| self.how.axes[axis]), ..new };
                let steps = steps.of(old);
                if steps.as_slice().is_empty() && out.is_bare(new) {
                    continue;
                }
                let changes = steps.as_slice().iter().map(|step| step.at).filter(|at| self.is_in(*at));
                let mut times: Vec<ShowTime> = changes.chain([*from]).collect();
                // What grows with time changes with each row there.
                let grows = |at: &ShowTime| {
                    self.how.dense.iter().any(|(begin, end)| (*begin..=*end).contains(&self.there(*at)))
                };
                times.extend(self.times().into_iter().filter(|at| self.is_in(*at) && grows(at)));
                times.sort_unstable();
                for at in times {
                    let Sample(mut values) = steps.at(at, &mut 0);
                    for (value, part) in values.iter_mut().zip(channel.parts) {
                        if part.kind != PartKind::Hertz {
                            *value *= (self.how.strength)(self.there(at), axis);
                        }
                    }
                    out.track(new, self.there(at), Sample(values));
                }
            }
        }
    }

    fn effects(&self, out: &mut Splice) -> Result<(), Problem> {
        let CuePiece { of, from, .. } = self.piece;
        match of.cue().effects() {
            Effects::Named { names, steps } => {
                let bits = names.iter().map(|name| out.effect(name)).collect::<Result<Vec<_>, _>>()?;
                let there = |on: u32| {
                    let set = bits.iter().enumerate().filter(|(bit, _)| on >> bit & 1 == 1);
                    set.filter_map(|(_, bit)| *bit).fold(0, |all, bit| all | 1 << bit)
                };
                out.switch(self.piece.at, there(steps.at(*from, &mut 0)));
                let changes = steps.as_slice().iter().filter(|step| self.is_in(step.at));
                changes.for_each(|step| out.switch(self.there(step.at), there(step.value)));
            }
            Effects::Words(steps) => {
                out.switch(self.piece.at, steps.at(*from, &mut 0).into());
                let changes = steps.as_slice().iter().filter(|step| self.is_in(step.at));
                changes.for_each(|step| out.switch(self.there(step.at), step.value.into()));
            }
        }
        Ok(())
    }

    fn markers(&self, out: &mut Splice) {
        let markers = self.piece.of.cue().markers().iter();
        let here = markers.filter(|marker| marker.at == self.piece.from || self.is_in(marker.at));
        here.for_each(|marker| out.marker(self.there(marker.at), &marker.name));
    }
}

/// A way from 0 to 1 without a jump of speed or acceleration; `part` is how much of it is over.
pub(crate) fn eased(part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    part * part * part * (10.0 - 15.0 * part + 6.0 * part * part)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cue::{self, Source};

    fn timeline(text: &str) -> Timeline {
        let text = format!("# interpolation: linear\n{text}");
        Timeline::new(cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap())
    }

    fn ms(ms: i64) -> ShowTime {
        ShowTime::from_millis(ms)
    }

    fn piece(of: &Timeline, from: i64, until: i64, at: i64) -> CuePiece<'_> {
        CuePiece { of, from: ms(from), until: ms(until), at: ms(at) }
    }

    const AS_IT_IS: &dyn Fn(ShowTime, usize, f64) -> f64 = &|_, _, position| position;

    fn as_it_is(axes: usize) -> Treatment<'static> {
        Treatment { axes: (0..axes).collect(), position: AS_IT_IS, strength: &|_, _| 1.0, dense: Vec::new() }
    }

    fn csv(cue: &Cue) -> String {
        let mut text = Vec::new();
        cue::write_csv(cue, &mut text).unwrap();
        let text = String::from_utf8(text).unwrap();
        text.split_once("time_ms").unwrap().1.to_owned()
    }

    #[test]
    fn a_stretch_begins_where_the_cue_was_with_what_was_on_there() {
        let ride = timeline("time_ms,a1,v1_hz,v1_amp,fx_air\n0,0,20,0.1,1\n1000,0.5,0,0,0\n2000,1,0,0,1\n");
        let (cut, seams) = lay(&[piece(&ride, 500, 1500, 0)], &as_it_is(1)).unwrap();
        assert_eq!(csv(&cut), ",a1,v1_hz,v1_amp,fx_air\n0,0.25,20,0.1,1\n500,0.5,0,0,0\n1000,0.75,0,0,0\n");
        assert!(seams.is_empty());
    }

    #[test]
    fn cues_that_meet_elsewhere_have_a_seam_and_with_a_gap_a_way() {
        let [one, two] = [
            timeline("time_ms,a1,fx_air\n0,0,0\n1000,0.5,1\n"),
            timeline("time_ms,a1,fx_fog\n0,0.2,1\n1000,0,0\n"),
        ];
        let (joined, seams) =
            lay(&[piece(&one, 0, 1000, 0), piece(&two, 0, 1000, 1000)], &as_it_is(1)).unwrap();
        assert_eq!((joined.rows(), joined.duration()), (4, ms(2000)));
        assert_eq!(seams.len(), 1);
        assert!(seams[0].at == ms(1000) && (seams[0].by - 0.3).abs() < 1e-9, "{seams:?}");
        assert!(
            csv(&joined).starts_with(",a1,fx_air,fx_fog\n0,0,0,0\n999,0.5,0,0\n1000,0.2,0,1\n"),
            "{}",
            csv(&joined)
        );
        let (apart, seams) =
            lay(&[piece(&one, 0, 1000, 0), piece(&two, 0, 1000, 3000)], &as_it_is(1)).unwrap();
        assert!(seams.is_empty() && apart.duration() == ms(4000));
    }

    #[test]
    fn what_changes_with_time_has_rows_close_enough_and_fades_vibration_too() {
        let ride = timeline("time_ms,a1,v1_hz,v1_amp\n0,1,20,0.1\n1000,1,20,0.1\n");
        let weight = |at: ShowTime| eased(at.as_secs_f64());
        let how = Treatment {
            position: &|at, _, position| position * weight(at),
            strength: &|at, _| weight(at),
            dense: vec![(ms(0), ms(1000))],
            ..as_it_is(1)
        };
        let (faded, _) = lay(&[piece(&ride, 0, 1000, 0)], &how).unwrap();
        assert_eq!(faded.rows(), 51);
        let middle = csv(&faded).lines().nth(26).unwrap().to_owned();
        assert_eq!(middle, "500,0.5,20,0.05");
    }

    #[test]
    fn what_changes_elsewhere_adds_no_rows_to_a_piece() {
        let ride = timeline("time_ms,a1\n0,0\n1000,0.5\n2000,0\n");
        let how = Treatment { dense: vec![(ms(1500), ms(1600))], ..as_it_is(1) };
        let (laid, _) = lay(&[piece(&ride, 0, 1000, 0), piece(&ride, 1000, 2000, 1000)], &how).unwrap();
        let times: Vec<_> = laid.times().iter().map(|at| at.as_nanos() / 1_000_000).collect();
        assert_eq!(times, [0, 1000, 1500, 1520, 1540, 1560, 1580, 1600, 2000]);
    }

    #[test]
    fn axes_are_picked_with_their_vibration_and_cues_that_differ_are_refused() {
        let ride = timeline("time_ms,a1,a2,v2_hz,v2_amp\n0,0.1,0.2,20,0.1\n1000,0.1,0.2,0,0\n");
        let how = Treatment { axes: vec![1], ..as_it_is(2) };
        let (picked, _) = lay(&[piece(&ride, 0, 1000, 0)], &how).unwrap();
        assert_eq!(csv(&picked), ",a1,v1_hz,v1_amp\n0,0.2,20,0.1\n1000,0.2,0,0\n");
        let other = timeline("time_ms,a1\n0,0\n1000,0\n");
        let error = lay(&[piece(&ride, 0, 1000, 0), piece(&other, 0, 1000, 1000)], &as_it_is(2)).unwrap_err();
        assert!(error.to_string().contains("its number of axes"), "{error}");
    }
}
