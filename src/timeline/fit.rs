//! Decides if a curve stays within a seat's stroke.

use std::ops::Range;

use super::Timeline;
use crate::cue::{Collector, CueFaults, Problem, Unit};
use crate::motion::SeatType;
use crate::time::ShowTime;

/// The part of the stroke by which a curve may leave it between rows, to be held at its end there: a spline out of rest
/// at an end always dips.
pub(crate) const HELD_BACK: f64 = 0.001;

/// True if a cue's axes stay within a stroke.
#[derive(Debug, Clone, PartialEq)]
pub struct StrokeFit {
    /// Rows outside the stroke, and stretches between rows more than [`HELD_BACK`] of it outside.
    pub faults: Option<CueFaults>,
    /// Axes whose curve is held at an end of the stroke somewhere.
    pub(crate) held: Vec<Held>,
}

/// An axis whose curve is held at an end of the stroke between some rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Held {
    /// The axis, from 0.
    pub(crate) axis: usize,
    /// Between how many pairs of rows.
    pub(crate) stretches: usize,
    /// How far the curve would go over the end at the most, in the cue's unit.
    pub(crate) over: f64,
    /// When it would.
    pub(crate) at: ShowTime,
    /// The line of the row before that, or the number of its message.
    pub(crate) line: u64,
}

impl Timeline {
    /// Holds some of the cue's axes against a stroke. Without a seat the ends are those of the unit: of an axis in
    /// fractions both, of one in mm, degrees or pulses none.
    #[must_use]
    pub fn fits_stroke(&self, axes: Range<usize>, seat: Option<&SeatType>) -> StrokeFit {
        let ends = |axis: usize| match (seat, self.unit(axis)) {
            (Some(seat), unit) => unit.ends(&seat.each[axis - axes.start]),
            (None, Unit::Fraction) => (0.0, 1.0),
            (None, _) => (f64::NEG_INFINITY, f64::INFINITY),
        };
        let mut check = FitCheck { timeline: self, faults: Collector::default(), held: Vec::new() };
        for (axis, seat) in axes.clone().enumerate().filter_map(|(index, axis)| Some((axis, (seat?, index))))
        {
            check.unit(axis, seat);
        }
        if !check.faults.is_empty() {
            // In another unit no row means anything.
            return StrokeFit { faults: check.faults.into_faults(self.cue.path()), held: Vec::new() };
        }
        for row in 0..self.cue.rows() {
            for axis in axes.start..axes.end.min(self.axes()) {
                let ends = ends(axis);
                check.point(row, axis, ends);
                if row + 1 < self.cue.rows() {
                    check.stretch(row, axis, ends);
                }
            }
        }
        check.held.sort_by_key(|held| held.axis);
        StrokeFit { faults: check.faults.into_faults(self.cue.path()), held: check.held }
    }
}

struct FitCheck<'a> {
    timeline: &'a Timeline,
    faults: Collector,
    held: Vec<Held>,
}

impl FitCheck<'_> {
    /// The unit of an axis, which is axis `index` of the seat.
    fn unit(&mut self, axis: usize, (seat, index): (&SeatType, usize)) {
        let (unit, geometry) = (self.timeline.unit(axis), &seat.each[index]);
        if axis < self.timeline.axes() && !unit.suits(geometry) {
            let (seat, wanted) = (seat.name.clone(), geometry.unit.name());
            self.add(0, axis, Problem::OtherUnit { unit: unit.name(), seat, wanted });
        }
    }

    fn point(&mut self, row: usize, axis: usize, (low, high): (f64, f64)) {
        let value = self.timeline.cue.row(row)[axis];
        if !(low..=high).contains(&value) {
            let unit = self.timeline.unit(axis).suffix();
            self.add(row, axis, Problem::OutsideStroke { value, low, high, unit });
        }
    }

    /// The curve between a row and the next; where a row itself is outside, that has been said.
    fn stretch(&mut self, row: usize, axis: usize, (low, high): (f64, f64)) {
        let (least, most) = self.timeline.bounds(row)(axis);
        if least >= low && most <= high {
            return;
        }
        let cubic = self.timeline.cubic(row, axis);
        let over = |value: f64| (low - value).max(value - high);
        let worst = cubic.still().map(|u| (u, cubic.at(u))).max_by(|a, b| over(a.1).total_cmp(&over(b.1)));
        let Some((u, value)) = worst.filter(|(_, value)| over(*value) > 0.0) else { return };
        let at = self.timeline.time(row, u);
        // The end of a stroke of unknown length has nothing to take a part of: that is endless too.
        if over(value) > HELD_BACK * (high - low) {
            let unit = self.timeline.unit(axis).suffix();
            self.add(row, axis, Problem::CurveOutsideStroke { value, at, low, high, unit });
        } else {
            self.hold(Held { axis, stretches: 1, over: over(value), at, line: self.timeline.cue.line(row) });
        }
    }

    fn hold(&mut self, new: Held) {
        match self.held.iter_mut().find(|held| held.axis == new.axis) {
            Some(held) => {
                let stretches = held.stretches + 1;
                let worst = if new.over > held.over { new } else { *held };
                *held = Held { stretches, ..worst };
            }
            None => self.held.push(new),
        }
    }

    fn add(&mut self, row: usize, axis: usize, problem: Problem) {
        if self.faults.is_full() {
            return self.faults.count();
        }
        let place = self.timeline.cue.place(row, axis);
        self.faults.add(place, Some(&format!("a{}", axis + 1)), problem);
    }
}
