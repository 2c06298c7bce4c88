//! The least and greatest values of a curve, also between its rows.

use super::Timeline;
use crate::time::ShowTime;

/// A value that a curve takes, and where.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Extreme {
    /// In the cue's unit.
    pub(crate) value: f64,
    /// When it is first taken.
    pub(crate) at: ShowTime,
    /// The line of the row at or before it; the number of its message where the file has no lines.
    pub(crate) line: u64,
}

/// The ends of what an axis does.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct AxisExtremes {
    /// The least value.
    pub(crate) min: Extreme,
    /// The greatest value.
    pub(crate) max: Extreme,
}

/// The extremes of every axis.
pub(super) fn find(timeline: &Timeline) -> Vec<AxisExtremes> {
    let cue = timeline.cue();
    let begin = |value: &f64| Reached { min: (*value, 0, 0.0), max: (*value, 0, 0.0) };
    let mut reached: Vec<_> = cue.row(0).iter().map(begin).collect();
    for row in 0..cue.rows() - 1 {
        let bounds = timeline.bounds(row);
        for (axis, reached) in reached.iter_mut().enumerate() {
            let (low, high) = bounds(axis);
            if low < reached.min.0 || high > reached.max.0 {
                let cubic = timeline.cubic(row, axis);
                cubic.still().for_each(|u| reached.take(cubic.at(u), row, u));
                reached.take(cue.row(row + 1)[axis], row + 1, 0.0);
            }
        }
    }
    let extreme = |(value, row, u)| Extreme { value, at: timeline.time(row, u), line: cue.line(row) };
    reached.iter().map(|r| AxisExtremes { min: extreme(r.min), max: extreme(r.max) }).collect()
}

/// Value, row and part of the way to the next row.
struct Reached {
    min: (f64, usize, f64),
    max: (f64, usize, f64),
}

impl Reached {
    fn take(&mut self, value: f64, row: usize, u: f64) {
        if value < self.min.0 {
            self.min = (value, row, u);
        }
        if value > self.max.0 {
            self.max = (value, row, u);
        }
    }
}

impl Timeline {
    /// The show time a part of the way from a row to the next.
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, reason = "spans under a day")]
    pub(super) fn time(&self, row: usize, part: f64) -> ShowTime {
        let times = self.cue.times();
        let start = times[row].as_nanos();
        let span = times.get(row + 1).map_or(0, |end| end.as_nanos() - start);
        ShowTime::from_nanos(start + (span as f64 * part).round() as i64)
    }
}
