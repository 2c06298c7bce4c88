//! Rows that keep a curve as it was up to an instant at which it is cut, or goes on otherwise. Control thread; pure.
//!
//! The slope of a monotone curve at a row hangs on the rows beside it, so a row that goes or comes bends two stretches. Four rows close
//! to each end of such a stretch, two of them placed so that slopes come out as they were, leave it exactly the same cubic. A
//! spline needs nothing but more points of itself: what is bent beyond them dies away by three quarters from one to the next.

use crate::cue::Interpolation;
use crate::motion::MAX_AXES;
use crate::time::ShowTime;
use crate::timeline::{Hint, Timeline};

/// How close the rows of a monotone curve are, ns: between them it is off by far less than a millionth of a stroke.
const CLOSE: i64 = 20_000;
/// The same of a spline, at the most.
const NEAR: i64 = 1_000_000;

/// A stretch of a cue that is to stay as it is, and whether the curve goes on otherwise at either end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct KeptSpan {
    pub(super) from: ShowTime,
    pub(super) until: ShowTime,
    pub(super) is_cut: (bool, bool),
}

/// A row to add, by its time in the cue.
pub(super) type KeptRow = (ShowTime, [f64; MAX_AXES]);

impl KeptSpan {
    /// What is to be added to the rows of a cue within the span, and at its ends, so that its curve is kept there.
    pub(super) fn rows(&self, of: &Timeline) -> Vec<KeptRow> {
        let times = of.cue().times();
        let inner: Vec<usize> =
            (0..times.len()).filter(|row| self.from < times[*row] && times[*row] < self.until).collect();
        let (Some(first), Some(last)) = (inner.first().copied(), inner.last().copied()) else {
            let both =
                KeptStretch { of, from: self.from, until: self.until, is_cut: self.is_cut, outer: None };
            return if self.is_cut == (false, false) { Vec::new() } else { both.rows() };
        };
        // The row between two stretches that are both kept so has the slope of either.
        let outer = |row| (inner.len() > 1 || self.is_cut != (true, true)).then_some(row);
        let mut rows = Vec::new();
        if self.is_cut.0 {
            let (until, outer) = (times[first], outer(first));
            rows.extend(KeptStretch { of, from: self.from, until, is_cut: (true, false), outer }.rows());
        }
        if self.is_cut.1 {
            let (from, outer) = (times[last], outer(last - 1));
            rows.extend(KeptStretch { of, from, until: self.until, is_cut: (false, true), outer }.rows());
        }
        rows
    }
}

/// A stretch without a row within it.
struct KeptStretch<'t> {
    of: &'t Timeline,
    from: ShowTime,
    until: ShowTime,
    is_cut: (bool, bool),
    /// The row from which a line leads to the next beyond the end that is not cut, where that line stays.
    outer: Option<usize>,
}

impl KeptStretch<'_> {
    fn rows(&self) -> Vec<KeptRow> {
        match self.of.cue().interpolation() {
            Interpolation::Monotone => self.monotone(),
            Interpolation::Spline => self.spline(),
            Interpolation::Linear | Interpolation::Hold => Vec::new(),
        }
    }

    fn span(&self) -> i64 {
        self.until.as_nanos() - self.from.as_nanos()
    }

    fn after(&self, ns: i64) -> ShowTime {
        ShowTime::from_nanos(self.from.as_nanos() + ns)
    }

    /// Position and slope of an axis at a time within the stretch.
    fn at(&self, time: ShowTime, axis: usize) -> (f64, f64) {
        let row = self.of.row_before(self.from);
        let times = self.of.cue().times();
        let long = times[row + 1].since(times[row]).as_secs_f64();
        let part = time.since(times[row]).as_secs_f64() / long;
        let cubic = self.of.cubic(row, axis);
        (cubic.at(part), cubic.from(part).0[1] / long)
    }

    fn spline(&self) -> Vec<KeptRow> {
        let step = NEAR.min(self.span() / 8);
        let near = |is_cut: bool, place: fn(i64, i64) -> i64| {
            (1..=3).filter(move |_| is_cut && step > 0).map(move |count| place(self.span(), count * step))
        };
        let places = near(self.is_cut.0, |_, off| off).chain(near(self.is_cut.1, |span, off| span - off));
        let sample = |place| (self.after(place), self.of.sample(self.after(place), &mut Hint::default()));
        places.map(sample).collect()
    }

    fn monotone(&self) -> Vec<KeptRow> {
        let span = self.span();
        if span < 12 * CLOSE {
            return Vec::new();
        }
        let places = [1, 2, 3].map(|count| count * CLOSE).into_iter();
        let places: Vec<i64> = places.clone().chain(places.rev().map(|place| span - place)).collect();
        let mut rows: Vec<KeptRow> =
            places.iter().map(|place| (self.after(*place), [0.0; MAX_AXES])).collect();
        for axis in 0..self.of.axes() {
            let values = self.six(axis, (self.after(places[2]), self.after(places[3])));
            rows.iter_mut().zip(values).for_each(|(row, value)| row.1[axis] = value);
        }
        rows
    }

    /// Three positions behind the beginning and three before the end, so that the curve between the third and the fourth is as it was,
    /// and so is the slope at both ends of the stretch.
    fn six(&self, axis: usize, (third, fourth): (ShowTime, ShowTime)) -> [f64; 6] {
        let close = ShowTime::from_nanos(CLOSE).as_secs_f64();
        let [begin, left, right, end] =
            [self.from, third, fourth, self.until].map(|time| self.at(time, axis));
        let long = fourth.since(third).as_secs_f64();
        let inner = Chord { slope: (right.0 - left.0) / long, long };
        let outer = self.outer.map(|row| Chord::of(self.of, row, axis));
        let slope = |is_cut: bool, slope: f64| match &outer {
            Some(line) if !is_cut => line.beside(slope, close),
            _ => slope,
        };
        [
            begin.0 + close * slope(self.is_cut.0, begin.1),
            left.0 - close * inner.beside(left.1, close),
            left.0,
            right.0,
            right.0 + close * inner.beside(right.1, close),
            end.0 - close * slope(self.is_cut.1, end.1),
        ]
    }
}

/// The straight line from a row to the next.
struct Chord {
    /// Per second.
    slope: f64,
    /// In seconds.
    long: f64,
}

impl Chord {
    fn of(timeline: &Timeline, row: usize, axis: usize) -> Self {
        let (cue, times) = (timeline.cue(), timeline.cue().times());
        let long = times[row + 1].since(times[row]).as_secs_f64();
        Self { slope: (cue.row(row + 1)[axis] - cue.row(row)[axis]) / long, long }
    }

    /// How steep the line on the other side of a row has to be, which is so long, for a monotone curve to have that slope at the row: the
    /// other way round what `timeline` makes of both.
    fn beside(&self, slope: f64, long: f64) -> f64 {
        if slope == 0.0 {
            return 0.0;
        }
        slope * (1.0 + long / self.long * (1.0 - self.slope / slope)).max(1.0 / 3.0)
    }
}
