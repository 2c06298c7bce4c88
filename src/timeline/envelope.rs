//! The least and greatest value of an axis in each of many stretches of time, exact also between rows: what a curve is drawn by, so
//! that no peak can vanish between two pixels.

use std::ops::RangeInclusive;

use super::{Cubic, Timeline};
use crate::time::ShowTime;

/// Stretches of time, all equally long, one behind the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretches {
    /// Show time at which the first begins, s.
    pub(crate) from: f64,
    /// How long each is, s; above 0.
    pub(crate) span: f64,
    /// How many there are, at least one.
    pub(crate) count: usize,
}

impl Stretches {
    /// When one begins, s.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far below 2^52")]
    pub(crate) fn start(&self, stretch: usize) -> f64 {
        self.from + stretch as f64 * self.span
    }

    /// When the last one ends, s.
    #[must_use]
    pub(crate) fn end(&self) -> f64 {
        self.start(self.count)
    }

    /// The one that a time falls into; the nearest for times outside.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates at 0")]
    pub(crate) fn holding(&self, time: f64) -> usize {
        (((time - self.from) / self.span) as usize).min(self.count - 1)
    }

    /// Those that a span of time lies in; where it ends as one begins, that one is none of them.
    #[must_use]
    pub(crate) fn touched(&self, from: f64, until: f64) -> RangeInclusive<usize> {
        let (first, last) = (self.holding(from), self.holding(until));
        first..=if last > first && self.start(last) >= until { last - 1 } else { last }
    }
}

impl Timeline {
    /// The least and greatest value of an axis's curve in each stretch, in the cue's unit and before anything is held at the
    /// stroke's ends; infinities the wrong way round where the cue has no curve.
    #[must_use]
    pub(crate) fn envelope(&self, axis: usize, stretches: &Stretches) -> Vec<(f64, f64)> {
        let times = self.cue().times();
        let mut ends = vec![(f64::INFINITY, f64::NEG_INFINITY); stretches.count];
        let [first, last] =
            [stretches.from, stretches.end()].map(|at| self.row_before(ShowTime::from_secs_f64(at)));
        for row in first..(last + 1).min(times.len() - 1) {
            let piece = CurvePiece {
                cubic: self.cubic(row, axis),
                from: times[row].as_secs_f64(),
                until: times[row + 1].as_secs_f64(),
            };
            let (first, last) = (stretches.holding(piece.from), stretches.holding(piece.until));
            for (index, ends) in ends[first..=last].iter_mut().enumerate() {
                let start = stretches.start(first + index);
                let (low, high) = piece.ends(start, start + stretches.span);
                *ends = (ends.0.min(low), ends.1.max(high));
            }
        }
        ends
    }
}

/// The curve of an axis from a row to the next, with their times in s.
struct CurvePiece {
    cubic: Cubic,
    from: f64,
    until: f64,
}

impl CurvePiece {
    /// The least and greatest value between two times, as far as they are its own.
    fn ends(&self, start: f64, end: f64) -> (f64, f64) {
        let part = |time: f64| ((time - self.from) / (self.until - self.from)).clamp(0.0, 1.0);
        let (start, end) = (part(start), part(end));
        let within = self.cubic.still().filter(|u| (start..=end).contains(u));
        let values = within.chain([start, end]).map(|u| self.cubic.at(u));
        values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    }
}
