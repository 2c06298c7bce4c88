//! The C2 cubic spline through the rows: its second derivatives, from one tridiagonal system for all axes at once.

use super::curve::seconds;
use crate::cue::{Cue, Interpolation};
use crate::motion::MAX_AXES;

/// Second derivatives `[row][axis]`, per second squared; empty if the cue's curve is no spline. Not-a-knot ends from
/// four rows on, the parabola through three, the line through two.
pub(super) fn solve(cue: &Cue) -> Vec<f32> {
    if cue.interpolation() != Interpolation::Spline {
        return Vec::new();
    }
    let mut bends = vec![0.0; cue.rows() * cue.axes()];
    match cue.rows() {
        0..=2 => {}
        3 => {
            let (h0, h1) = (seconds(cue, 0), seconds(cue, 1));
            for axis in 0..cue.axes() {
                let bend = single(2.0 * turn(cue, 1, axis) / (h0 + h1));
                (0..3).for_each(|row| bends[row * cue.axes() + axis] = bend);
            }
        }
        _ => {
            let uppers = forward(cue, &mut bends);
            backward(cue, &uppers, &mut bends);
            ends(cue, &mut bends);
        }
    }
    bends
}

/// The row of the system for an inner `row`: what stands below, on and above the diagonal. At the first and last inner
/// row the end's unknown is replaced by what not-a-knot makes of it.
fn coefficients(cue: &Cue, row: usize) -> (f64, f64, f64) {
    let (h0, h1) = (seconds(cue, row - 1), seconds(cue, row));
    let (below, on, above) = (h0, 2.0 * (h0 + h1), h1);
    if row == 1 {
        (0.0, on + h0 * (1.0 + h0 / h1), above - h0 * h0 / h1)
    } else if row == cue.rows() - 2 {
        (below - h1 * h1 / h0, on + h1 * (1.0 + h1 / h0), 0.0)
    } else {
        (below, on, above)
    }
}

/// Eliminates downwards. The right side is left in `bends`, in single precision: the system damps its rounding.
fn forward(cue: &Cue, bends: &mut [f32]) -> Vec<f64> {
    let axes = cue.axes();
    let mut uppers = vec![0.0; cue.rows()];
    let (mut upper, mut before, mut slope) = (0.0, [0.0; MAX_AXES], [0.0; MAX_AXES]);
    for (slope, (y0, y1)) in slope.iter_mut().zip(cue.row(0).iter().zip(cue.row(1))) {
        *slope = (y1 - y0) / seconds(cue, 0);
    }
    for row in 1..cue.rows() - 1 {
        let (below, on, above) = coefficients(cue, row);
        let per_pivot = (on - below * upper).recip();
        let per_second = seconds(cue, row).recip();
        upper = above * per_pivot;
        uppers[row] = upper;
        let (here, next) = (cue.row(row), cue.row(row + 1));
        for (axis, bend) in bends[row * axes..][..axes].iter_mut().enumerate() {
            let after = (next[axis] - here[axis]) * per_second;
            before[axis] = (6.0 * (after - slope[axis]) - below * before[axis]) * per_pivot;
            slope[axis] = after;
            *bend = single(before[axis]);
        }
    }
    uppers
}

/// Substitutes upwards.
fn backward(cue: &Cue, uppers: &[f64], bends: &mut [f32]) {
    let axes = cue.axes();
    let mut after = [0.0; MAX_AXES];
    for row in (1..cue.rows() - 1).rev() {
        for (after, bend) in after.iter_mut().zip(&mut bends[row * axes..][..axes]) {
            *after = f64::from(*bend) - uppers[row] * *after;
            *bend = single(*after);
        }
    }
}

/// The bends of the first and last row, so that the third derivative goes on over the row beside them.
fn ends(cue: &Cue, bends: &mut [f32]) {
    let (axes, last) = (cue.axes(), cue.rows() - 1);
    let at_start = seconds(cue, 0) / seconds(cue, 1);
    let at_end = seconds(cue, last - 1) / seconds(cue, last - 2);
    for axis in 0..axes {
        let bend = |row: usize| f64::from(bends[row * axes + axis]);
        let first = single(bend(1) + at_start * (bend(1) - bend(2)));
        let final_one = single(bend(last - 1) + at_end * (bend(last - 1) - bend(last - 2)));
        bends[axis] = first;
        bends[last * axes + axis] = final_one;
    }
}

/// How much the slope between rows changes at an inner row.
fn turn(cue: &Cue, row: usize, axis: usize) -> f64 {
    let value = |row: usize| cue.positions()[row * cue.axes() + axis];
    (value(row + 1) - value(row)) / seconds(cue, row) - (value(row) - value(row - 1)) / seconds(cue, row - 1)
}

/// In single precision, and finite, whatever a strange spacing of rows made of it.
#[expect(clippy::cast_possible_truncation, reason = "rounding is what is wanted")]
fn single(bend: f64) -> f32 {
    (bend as f32).clamp(f32::MIN, f32::MAX)
}
