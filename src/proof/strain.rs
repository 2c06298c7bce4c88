//! What each axis of a cue asks of its seat, stretch by stretch of show time: what pictures are drawn of, measured as the proof
//! measures, so that their greatest is the greatest of [`AxisFigures`] to the last digit.

use std::thread;

use super::figures::{AxisFigures, of_pieces};
use super::loads::fill;
use super::pieces::AxisPieces;
use super::stencil::{Stencil, Stencils};
use crate::motion::SeatAxis;
use crate::time::Rate;
use crate::timeline::{Figure, Timeline};

/// What is below this part of a limit may be told as anything up to it: less than can be seen.
const LIGHT: f64 = 0.002;

/// What one axis does, as parts of its limits.
#[derive(Debug, Clone)]
pub(crate) struct AxisStrain {
    /// The most of the whole cue.
    pub(crate) figures: AxisFigures,
    /// The greatest speed, acceleration and jerk of each stretch from show time 0 on, as parts of the limits of the seat.
    pub(crate) parts: [Vec<f32>; 3],
}

impl AxisStrain {
    /// The most of the whole cue and what the seat allows: of speed, acceleration and jerk.
    #[must_use]
    pub(crate) fn worst(&self) -> [(Figure, f64); 3] {
        let (figures, axis) = (&self.figures, self.figures.on.geometry());
        [
            (figures.velocity, axis.max_velocity),
            (figures.acceleration, axis.max_acceleration),
            (figures.jerk, axis.max_jerk),
        ]
    }
}

/// What each axis of a cue does in stretches of `span` nanoseconds, in frames of `rate` and however these fall. `seats` has what
/// each axis is on. A thread for each axis.
#[must_use]
pub(crate) fn strains(timeline: &Timeline, rate: Rate, seats: &[SeatAxis], span: i64) -> Vec<AxisStrain> {
    let stencils = &Stencils::at(rate);
    let axes = seats.iter().enumerate().take(timeline.axes());
    thread::scope(|scope| {
        let of_axis = |(axis, on)| scope.spawn(move || of_axis(timeline, axis, on, stencils, span));
        let workers: Vec<_> = axes.map(of_axis).collect();
        workers.into_iter().map(|worker| worker.join().expect("a sweep does not panic")).collect()
    })
}

fn of_axis(timeline: &Timeline, axis: usize, on: &SeatAxis, stencils: &Stencils, span: i64) -> AxisStrain {
    let slot = timeline.unit(axis).slot(&on.seat, on.index, Some(axis));
    let pieces = AxisPieces::new(timeline, axis, &slot);
    let figures = of_pieces(timeline, axis, on, stencils, &pieces);
    let mut strain = AxisStrain { figures, parts: Default::default() };
    let limits = [slot.limits.velocity, slot.limits.acceleration, slot.limits.jerk];
    let all: [&[Stencil]; 3] = [&stencils.velocity, &stencils.acceleration, &stencils.jerk];
    let worst = strain.worst();
    for (order, ((stencils, limit), (figure, most))) in (1..).zip(all.into_iter().zip(limits).zip(worst)) {
        let met = fill(&pieces, stencils, order, LIGHT * limit, span);
        strain.parts[order - 1] = as_parts(&met, limit, figure, figure.value / most, span);
    }
    strain
}

/// Both ways of looking may overstate, each by its own amount: the greatest of the whole cue is what nothing is above, and what
/// the stretch reaches that has it.
#[expect(clippy::cast_possible_truncation, reason = "a picture is no finer")]
fn as_parts(met: &[f32], limit: f64, figure: Figure, greatest: f64, span: i64) -> Vec<f32> {
    let mut parts: Vec<f32> = met.iter().map(|met| (f64::from(*met) / limit).min(greatest) as f32).collect();
    let at = usize::try_from(figure.at.as_nanos() / span).unwrap_or(0);
    if let Some(part) = parts.get_mut(at) {
        *part = greatest as f32;
    }
    parts
}
