//! From the rows around an instant to the cubic of one axis.

use super::Timeline;
use super::cubic::Cubic;
use crate::cue::{Cue, Interpolation};

impl Timeline {
    /// The curve of an axis from `row` to the next row, which there is.
    #[inline]
    pub(crate) fn cubic(&self, row: usize, axis: usize) -> Cubic {
        let (y0, y1) = (value(&self.cue, row, axis), value(&self.cue, row + 1, axis));
        match self.cue.interpolation() {
            Interpolation::Spline => {
                let h = seconds(&self.cue, row);
                let bend = |row: usize| f64::from(self.bends[row * self.cue.axes() + axis]);
                let (m0, m1, sixth) = (bend(row), bend(row + 1), h * h / 6.0);
                Cubic([y0, y1 - y0 - sixth * (2.0 * m0 + m1), 3.0 * sixth * m0, sixth * (m1 - m0)])
            }
            Interpolation::Monotone => {
                let h = seconds(&self.cue, row);
                let (s0, s1) = (h * slope(&self.cue, row, axis), h * slope(&self.cue, row + 1, axis));
                let rise = y1 - y0;
                Cubic([y0, s0, 3.0 * rise - 2.0 * s0 - s1, s0 + s1 - 2.0 * rise])
            }
            Interpolation::Linear => Cubic([y0, y1 - y0, 0.0, 0.0]),
            Interpolation::Hold => Cubic([y0, 0.0, 0.0, 0.0]),
        }
    }

    /// Bounds that the curve of an axis cannot leave between `row` and the next row: a spline bends away from its chord
    /// by an eighth of h² times its greatest second derivative at the most, the other curves not at all.
    pub(super) fn bounds(&self, row: usize) -> impl Fn(usize) -> (f64, f64) {
        let (here, next) = (self.cue.row(row), self.cue.row(row + 1));
        let axes = self.cue.axes();
        let bends = self.bends.get(row * axes..(row + 2) * axes).map(|both| both.split_at(axes));
        let h = seconds(&self.cue, row);
        let eighth = h * h / 8.0;
        move |axis| {
            let bow = bends.map_or(0.0, |(m0, m1)| eighth * f64::from(m0[axis].abs().max(m1[axis].abs())));
            (here[axis].min(next[axis]) - bow, here[axis].max(next[axis]) + bow)
        }
    }
}

/// The slope of a monotone curve at a row, after Fritsch and Carlson (SIAM J. Numer. Anal. 17, 1980): that of the
/// parabola through the neighbours, held within 3 x the slope of either side, and 0 at a turn. It depends on the
/// neighbours only, so it needs no memory.
fn slope(cue: &Cue, row: usize, axis: usize) -> f64 {
    let secant = |row: usize| (value(cue, row + 1, axis) - value(cue, row, axis)) / seconds(cue, row);
    let last = cue.rows() - 1;
    if row == 0 || row == last {
        return secant(row.min(last - 1));
    }
    let (before, after) = (secant(row - 1), secant(row));
    if before * after <= 0.0 {
        return 0.0;
    }
    let (h0, h1) = (seconds(cue, row - 1), seconds(cue, row));
    let parabola = (h1 * before + h0 * after) / (h0 + h1);
    parabola.abs().min(3.0 * before.abs()).min(3.0 * after.abs()).copysign(before)
}

fn value(cue: &Cue, row: usize, axis: usize) -> f64 {
    cue.positions()[row * cue.axes() + axis]
}

/// Seconds from a row to the next.
#[expect(clippy::cast_precision_loss, reason = "spans under a day are exact")]
pub(super) fn seconds(cue: &Cue, row: usize) -> f64 {
    (cue.times()[row + 1].as_nanos() - cue.times()[row].as_nanos()) as f64 * 1e-9
}
