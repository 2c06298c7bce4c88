//! Where a new cue is not as those that it is made of, though nothing was changed there. Control thread; pure.

use super::kept::KeptSpan;
use super::{CuePiece, LaidPiece, Seam};
use crate::time::ShowTime;
use crate::timeline::{Hint, Timeline};

/// Positions that differ by less, as a part of the stroke, are the same.
const SAME_PLACE: f64 = 1e-6;
/// So many rows from where something changes no curve is another.
const REACH: usize = 16;
/// Between two rows it is looked so often.
const LOOKS: i64 = 8;

/// A stretch in which the curve of a new cue is another beside what was edited.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stray {
    /// From when, in the new cue.
    pub(crate) from: ShowTime,
    /// Until when.
    pub(crate) until: ShowTime,
    /// The axis that is farthest off, as a part of its stroke, from 0.
    pub(crate) axis: usize,
    /// By how much at the most, in its unit.
    pub(crate) by: f64,
    part: f64,
}

impl LaidPiece<'_> {
    /// Where the new cue is not as this piece was treated.
    pub(super) fn strays(&self, after: &Timeline, seams: &[Seam]) -> Vec<Stray> {
        let CuePiece { of, from, until, at } = *self.piece;
        let is_alone = self.is_first && self.next.is_none() && at == ShowTime::ZERO;
        if is_alone && self.how.dense.is_empty() && from == ShowTime::ZERO && until == of.duration() {
            return Vec::new(); // nothing meets anything
        }
        self.kept().iter().filter_map(|span| self.stray(span, after, seams)).collect()
    }

    fn stray(&self, span: &KeptSpan, after: &Timeline, seams: &[Seam]) -> Option<Stray> {
        // The row before a jump gives way to it.
        let gives_way = |at: ShowTime| {
            seams.iter().any(|seam| at <= seam.at && seam.at.since(at) <= ShowTime::from_millis(1))
        };
        let (mut hint, mut new_hint, mut worst) = (Hint::default(), Hint::default(), None::<Stray>);
        for time in self.looks(span) {
            let at = self.there(time);
            if gives_way(at) {
                continue;
            }
            let (was, is) = (self.piece.of.sample(time, &mut hint), after.sample(at, &mut new_hint));
            for (axis, from) in self.how.axes.iter().enumerate() {
                let by = (is[axis] - (self.how.position)(at, axis, was[*from])).abs();
                let (low, high) = self.how.ends[*from];
                let part = by / (high - low);
                if part > SAME_PLACE {
                    let one = worst.unwrap_or(Stray { from: at, until: at, axis, by, part });
                    let farthest = if part > one.part { Stray { axis, by, part, ..one } } else { one };
                    worst = Some(Stray { until: at, ..farthest });
                }
            }
        }
        worst
    }

    /// The times at which the curve is looked at: between the rows near the ends of a span.
    fn looks(&self, span: &KeptSpan) -> Vec<ShowTime> {
        let rows = self.piece.of.cue().times().iter().copied();
        let mut ends: Vec<ShowTime> = rows.filter(|at| span.from < *at && *at < span.until).collect();
        ends.insert(0, span.from);
        ends.push(span.until);
        let last = ends.len().saturating_sub(REACH);
        let near = |pair: &usize| *pair < REACH || *pair >= last;
        let between = (0..ends.len() - 1).filter(near).flat_map(|pair| {
            let (begin, end) = (ends[pair].as_nanos(), ends[pair + 1].as_nanos());
            (0..LOOKS).map(move |look| begin + (2 * look + 1) * (end - begin) / (2 * LOOKS))
        });
        between.map(ShowTime::from_nanos).collect()
    }
}
