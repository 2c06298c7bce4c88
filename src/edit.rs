//! Cues into others: stretches of them laid one after the other, and what becomes of each position on the way. Control thread; pure.

use crate::channel::{CHANNELS, PartKind, Sample, Scope, TrackId};
use crate::cue::{Cue, Effects, Problem, Splice};
use crate::time::ShowTime;
use crate::timeline::{HELD_BACK, Hint, Timeline};

mod error;
mod kept;
mod stray;

pub(crate) use error::EditError;
use kept::{KeptRow, KeptSpan};
pub(crate) use stray::Stray;

/// Rows are so close where positions are changed by more than the rows that there are can show.
const DENSE: ShowTime = ShowTime::from_millis(20);
/// What the last row before a gap switches lasts so long, so that no frame misses it; half of a gap that is shorter than two of these.
const LASTS: ShowTime = ShowTime::from_millis(20);
/// Positions that differ by less, as a fraction of the stroke or in mm, degrees or pulses, are the same.
pub(crate) const SAME: f64 = 1e-9;

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
    /// The ends of the stroke of each axis of the cues, in its unit.
    pub(crate) ends: Vec<(f64, f64)>,
}

impl Treatment<'_> {
    /// A position that is none of a cue's own, held at the end of the stroke where it is no farther out than a curve may be between
    /// rows: a row may be nowhere outside.
    fn held(&self, position: f64, axis: usize) -> f64 {
        let (low, high) = self.ends[axis];
        let inside = position.clamp(low, high);
        if (position - inside).abs() <= HELD_BACK * (high - low) { inside } else { position }
    }
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

/// A new cue, where it jumps, and where it is not as those that it is made of though nothing was changed there.
#[derive(Debug)]
pub(crate) struct Laid {
    pub(crate) cue: Cue,
    pub(crate) seams: Vec<Seam>,
    pub(crate) strays: Vec<Stray>,
}

/// Lays pieces one after the other; gives the new cue, and where it jumps. Before the first, and where one begins later than the one
/// before ends, everything is off: before the first in the pose in which that begins, else on a curve from one to the next.
///
/// # Errors
/// [`EditError`] where the cues are not alike, or what comes of them is no cue.
pub(crate) fn lay(pieces: &[CuePiece<'_>], how: &Treatment<'_>) -> Result<Laid, EditError> {
    let plain = lay_rows(pieces, how, false)?;
    // Rows that keep the curve are no row of anybody's, so there are none where it stays by itself.
    if plain.strays.is_empty() { Ok(plain) } else { lay_rows(pieces, how, true) }
}

fn lay_rows(pieces: &[CuePiece<'_>], how: &Treatment<'_>, keeps: bool) -> Result<Laid, EditError> {
    let Some(first) = pieces.first().map(|piece| piece.of.cue()) else {
        return Err(EditError::Cue(Problem::Empty));
    };
    let (mut out, mut seams, mut last) = (Splice::like(first, &how.axes), Vec::new(), Vec::new());
    let (mut laid, mut offs) = (Vec::new(), Vec::new());
    for (number, piece) in pieces.iter().enumerate() {
        alike(first, piece.of.cue())?;
        let next = pieces.get(number + 1).map(|next| next.at);
        let one = LaidPiece { piece, how, is_first: number == 0, next, keeps };
        match out.end() {
            None if piece.at > ShowTime::ZERO => out.row(ShowTime::ZERO, &one.row(piece.from, None)),
            Some(end) if end < piece.at => {
                let half = piece.at.since(end).as_nanos() / 2;
                let off = ShowTime::from_nanos(end.as_nanos() + half.min(LASTS.as_nanos()));
                out.rest(off);
                offs.push(off);
            }
            _ => {}
        }
        seams.extend(one.rows(&mut out, &mut last));
        one.tracks(&mut out);
        one.effects(&mut out).map_err(EditError::Cue)?;
        one.markers(&mut out);
        laid.push(one);
    }
    let after = Timeline::new(with_rows_at(out.finish().map_err(EditError::Cue)?, offs));
    let strays = laid.iter().flat_map(|one| one.strays(&after, &seams)).collect();
    Ok(Laid { cue: after.into_cue(), seams, strays })
}

/// The cue with a row at each of these times at which something is switched, where its curve is.
fn with_rows_at(cue: Cue, mut times: Vec<ShowTime>) -> Cue {
    times.retain(|at| cue.switches_at(*at));
    if times.is_empty() {
        return cue;
    }
    times.extend_from_slice(cue.times());
    times.sort_unstable();
    times.dedup();
    let (axes, interpolation, curve) = (cue.axes(), cue.interpolation(), Timeline::new(cue));
    let mut hint = Hint::default();
    let positions = times.iter().flat_map(|at| curve.sample(*at, &mut hint).into_iter().take(axes)).collect();
    curve.cue().with_rows(times, positions, interpolation)
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
    is_first: bool,
    /// When the next begins in the new cue.
    next: Option<ShowTime>,
    /// Rows are added that keep its curve.
    keeps: bool,
}

impl LaidPiece<'_> {
    /// A time of the cue in the new one.
    fn there(&self, at: ShowTime) -> ShowTime {
        let CuePiece { from, at: begins, .. } = self.piece;
        ShowTime::from_nanos(begins.as_nanos() + at.as_nanos() - from.as_nanos())
    }

    /// The part of a stretch of the new cue that is in it, by its own time.
    fn own(&self, (begin, end): (ShowTime, ShowTime)) -> Option<(ShowTime, ShowTime)> {
        let CuePiece { from, until, at, .. } = *self.piece;
        let here = |there: ShowTime| ShowTime::from_nanos(there.as_nanos() - at.as_nanos() + from.as_nanos());
        Some((here(begin).max(from), here(end).min(until))).filter(|(begin, end)| begin <= end)
    }

    /// What of it is as it was, between where the treatment changes with time.
    fn kept(&self) -> Vec<KeptSpan> {
        let CuePiece { of, from, until, .. } = *self.piece;
        let (mut spans, mut begin, mut is_cut) = (Vec::new(), from, self.is_first && from > ShowTime::ZERO);
        let changing = self.how.dense.iter().filter(|(begin, end)| begin < end);
        for (change, end) in changing.filter_map(|stretch| self.own(*stretch)) {
            if begin < change {
                spans.push(KeptSpan { from: begin, until: change, is_cut: (is_cut, true) });
            }
            (begin, is_cut) = (end, true);
        }
        if begin < until {
            let ends = self.next.is_none() && until < of.duration();
            spans.push(KeptSpan { from: begin, until, is_cut: (is_cut, ends) });
        }
        spans
    }

    /// The times of its rows, and those between them that are needed; where the pose is not that of the cue, with it.
    fn times(&self) -> Vec<(ShowTime, Option<KeptRow>)> {
        let CuePiece { of, from, until, .. } = *self.piece;
        let mut times: Vec<ShowTime> =
            of.cue().times().iter().copied().filter(|time| (from..=until).contains(time)).collect();
        times.extend([from, until]);
        for (begin, end) in self.how.dense.iter().filter_map(|stretch| self.own(*stretch)) {
            let count = (end.as_nanos() - begin.as_nanos()) / DENSE.as_nanos();
            let step = |step| ShowTime::from_nanos(begin.as_nanos() + step * DENSE.as_nanos());
            times.extend((0..=count).map(step).chain([end]));
        }
        let kept = self.kept().into_iter().filter(|_| self.keeps);
        let kept = kept.flat_map(|span| span.rows(of)).map(|row| (row.0, Some(row)));
        let mut times: Vec<_> = times.into_iter().map(|time| (time, None)).chain(kept).collect();
        times.sort_by_key(|(time, _)| *time);
        times.dedup_by_key(|(time, _)| *time);
        times
    }

    /// What becomes of a pose of the cue, or of one given in its place.
    fn row(&self, time: ShowTime, given: Option<KeptRow>) -> Vec<f64> {
        let CuePiece { of, .. } = *self.piece;
        let pose = given.map_or_else(|| of.sample(time, &mut Hint::default()), |(_, pose)| pose);
        let is_own = given.is_none() && of.cue().times().binary_search(&time).is_ok();
        let axes = self.how.axes.iter().enumerate();
        let position = |(axis, from): (usize, &usize)| {
            let position = (self.how.position)(self.there(time), axis, pose[*from]);
            if is_own && position == pose[*from] { position } else { self.how.held(position, *from) }
        };
        axes.map(position).collect()
    }

    /// Its rows; gives the seam before it, if there is one.
    fn rows(&self, out: &mut Splice, last: &mut Vec<f64>) -> Option<Seam> {
        let mut seam = None;
        for (number, (time, given)) in self.times().into_iter().enumerate() {
            let (row, at) = (self.row(time, given), self.there(time));
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

    /// True of a change that is in this piece, and not its first instant; that of its last is in the next, where there is one at once.
    fn is_in(&self, at: ShowTime) -> bool {
        let CuePiece { from, until, .. } = *self.piece;
        from < at && (at < until || at == until && self.next != Some(self.there(until)))
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
                times.extend(
                    self.times().into_iter().map(|(at, _)| at).filter(|at| self.is_in(*at) && grows(at)),
                );
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
        let CuePiece { of, from, until, .. } = *self.piece;
        let is_end = |at: ShowTime| at == until && until == of.duration();
        let markers = of.cue().markers().iter();
        let here = markers.filter(|marker| marker.at == from || self.is_in(marker.at) || is_end(marker.at));
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
        Treatment {
            axes: (0..axes).collect(),
            position: AS_IT_IS,
            strength: &|_, _| 1.0,
            dense: Vec::new(),
            ends: vec![(0.0, 1.0); axes],
        }
    }

    /// The new cue, and where it jumps.
    fn laid(pieces: &[CuePiece<'_>], how: &Treatment<'_>) -> (Cue, Vec<Seam>) {
        let Laid { cue, seams, .. } = lay(pieces, how).unwrap();
        (cue, seams)
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
        let (cut, seams) = laid(&[piece(&ride, 500, 1500, 0)], &as_it_is(1));
        assert_eq!(csv(&cut), ",a1,v1_hz,v1_amp,fx_air\n0,0.25,20,0.1,1\n500,0.5,0,0,0\n1000,0.75,0,0,0\n");
        assert!(seams.is_empty());
    }

    #[test]
    fn cues_that_meet_elsewhere_have_a_seam_and_with_a_gap_a_way() {
        let [one, two] = [
            timeline("time_ms,a1,fx_air\n0,0,0\n1000,0.5,1\n"),
            timeline("time_ms,a1,fx_fog\n0,0.2,1\n1000,0,0\n"),
        ];
        let (joined, seams) = laid(&[piece(&one, 0, 1000, 0), piece(&two, 0, 1000, 1000)], &as_it_is(1));
        assert_eq!((joined.rows(), joined.duration()), (4, ms(2000)));
        assert_eq!(seams.len(), 1);
        assert!(seams[0].at == ms(1000) && (seams[0].by - 0.3).abs() < 1e-9, "{seams:?}");
        assert!(
            csv(&joined).starts_with(",a1,fx_air,fx_fog\n0,0,0,0\n999,0.5,0,0\n1000,0.2,0,1\n"),
            "{}",
            csv(&joined)
        );
        let (apart, seams) = laid(&[piece(&one, 0, 1000, 0), piece(&two, 0, 1000, 3000)], &as_it_is(1));
        assert!(seams.is_empty() && apart.duration() == ms(4000));
        assert!(
            csv(&apart).ends_with("\n1000,0.5,1,0\n1020,0.497,0,0\n3000,0.2,0,1\n4000,0,0,0\n"),
            "{}",
            csv(&apart)
        );
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
        let (faded, _) = laid(&[piece(&ride, 0, 1000, 0)], &how);
        assert_eq!(faded.rows(), 51);
        let middle = csv(&faded).lines().nth(26).unwrap().to_owned();
        assert_eq!(middle, "500,0.5,20,0.05");
    }

    #[test]
    fn what_changes_elsewhere_adds_no_rows_to_a_piece() {
        let ride = timeline("time_ms,a1\n0,0\n1000,0.5\n2000,0\n");
        let how = Treatment { dense: vec![(ms(1500), ms(1600))], ..as_it_is(1) };
        let (cue, _) = laid(&[piece(&ride, 0, 1000, 0), piece(&ride, 1000, 2000, 1000)], &how);
        let times: Vec<_> = cue.times().iter().map(|at| at.as_nanos() / 1_000_000).collect();
        assert_eq!(times, [0, 1000, 1500, 1520, 1540, 1560, 1580, 1600, 2000]);
    }

    #[test]
    fn axes_are_picked_with_their_vibration_and_cues_that_differ_are_refused() {
        let ride = timeline("time_ms,a1,a2,v2_hz,v2_amp\n0,0.1,0.2,20,0.1\n1000,0.1,0.2,0,0\n");
        let how = Treatment { axes: vec![1], ..as_it_is(2) };
        let (picked, _) = laid(&[piece(&ride, 0, 1000, 0)], &how);
        assert_eq!(csv(&picked), ",a1,v1_hz,v1_amp\n0,0.2,20,0.1\n1000,0.2,0,0\n");
        let other = timeline("time_ms,a1\n0,0\n1000,0\n");
        let error = lay(&[piece(&ride, 0, 1000, 0), piece(&other, 0, 1000, 1000)], &as_it_is(2)).unwrap_err();
        assert!(error.to_string().contains("its number of axes"), "{error}");
    }
}
