//! What each axis of a cue asks of the seat that takes it: the figures that people judge a cue by, measured as the proof
//! measures, however the frames fall.

use super::pieces::AxisPieces;
use super::stencil::{Stencil, Stencils};
use super::sweep::sweep;
use crate::motion::SeatAxis;
use crate::time::{Rate, ShowTime};
use crate::timeline::{Extreme, Figure, Timeline};

/// What one axis does at most, on the seat that takes it.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisFigures {
    /// The axis of a seat that it was judged for; all figures are in its unit.
    pub on: SeatAxis,
    /// The lowest position of the curve.
    pub(crate) lowest: Figure,
    /// The highest position of the curve.
    pub highest: Figure,
    /// The greatest speed.
    pub velocity: Figure,
    /// The greatest acceleration.
    pub acceleration: Figure,
    /// The greatest jerk.
    pub jerk: Figure,
}

/// What each axis of a cue does at most, in frames of `rate`: positions are those of the curve itself, also between rows,
/// and before it is held at the stroke's ends. `seats` has what each axis is on.
#[must_use]
pub fn figures(timeline: &Timeline, rate: Rate, seats: &[SeatAxis]) -> Vec<AxisFigures> {
    let stencils = Stencils::at(rate);
    let axis = |(axis, on): (usize, &SeatAxis)| of_axis(timeline, axis, on, &stencils);
    seats.iter().enumerate().take(timeline.axes()).map(axis).collect()
}

fn of_axis(timeline: &Timeline, axis: usize, on: &SeatAxis, stencils: &Stencils) -> AxisFigures {
    let slot = timeline.unit(axis).slot(&on.seat, on.index, Some(axis));
    let pieces = AxisPieces::new(timeline, axis, &slot);
    of_pieces(timeline, axis, on, stencils, &pieces)
}

/// The same of an axis whose pieces are known.
pub(super) fn of_pieces(
    timeline: &Timeline,
    axis: usize,
    on: &SeatAxis,
    stencils: &Stencils,
    pieces: &AxisPieces,
) -> AxisFigures {
    let slot = timeline.unit(axis).slot(&on.seat, on.index, Some(axis));
    let stroke = on.geometry().stroke();
    let most = |stencils: &[Stencil], order| {
        // Without a limit: what people judge a cue by is how much it asks, whoever may take it.
        let swept = sweep(pieces, stencils, order, f64::INFINITY);
        let at = ShowTime::from_nanos(swept.at);
        let line = timeline.cue().line(timeline.row_before(at));
        Figure { value: swept.worst * stroke, at, line }
    };
    let (per_unit, zero) = (slot.to_stroke * stroke, on.geometry().place(slot.cue_zero));
    let extreme = |e: Extreme| Figure { value: e.value * per_unit + zero, at: e.at, line: e.line };
    let extremes = &timeline.extremes()[axis];
    AxisFigures {
        on: on.clone(),
        lowest: extreme(extremes.min),
        highest: extreme(extremes.max),
        velocity: most(&stencils.velocity, 1),
        acceleration: most(&stencils.acceleration, 2),
        jerk: most(&stencils.jerk, 3),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use super::*;
    use crate::cue::{self, Source};
    use crate::motion::SeatType;

    fn timeline(text: &str) -> Timeline {
        Timeline::new(cue::read(Path::new("test.csv"), text.as_bytes(), &Source::Native).unwrap())
    }

    #[test]
    fn a_steady_move_has_its_speed_in_mm_of_the_seat() {
        let cue = timeline("# interpolation: linear\ntime_s,a1,a2\n0,0,0.5\n1,0.5,0.5\n2,0.5,0.5\n");
        let seats = [0, 1].map(|axis| SeatAxis::new(&Arc::new(SeatType::bench3(2)), axis));
        let figures = figures(&cue, Rate::from_hz(100.0), &seats);
        assert!((figures[0].velocity.value - 75.0).abs() < 1e-6, "{figures:?}");
        assert_eq!((figures[0].velocity.line, figures[0].highest.line), (3, 4));
        assert_eq!((figures[0].lowest.value, figures[0].highest.value), (0.0, 75.0));
        assert!(figures[0].acceleration.value > 1000.0, "the corner at the end of the move shows");
        assert_eq!(figures[0].acceleration.line, 4);
        assert_eq!(figures[1].velocity.value, 0.0);
    }

    #[test]
    fn the_unit_of_the_file_makes_no_difference() {
        let rows = |unit: &str, full: f64| {
            format!("# units: {unit}\ntime_s,a1\n0,0\n1,{}\n2,{}\n3,0\n", 0.3 * full, 0.8 * full)
        };
        let seats = [SeatAxis::new(&Arc::new(SeatType::bench3(1)), 0)];
        let figures = |unit: &str, full: f64| {
            super::figures(&timeline(&rows(unit, full)), Rate::from_hz(100.0), &seats)[0].clone()
        };
        let (fraction, mm, pulse) =
            (figures("fraction", 1.0), figures("mm", 150.0), figures("pulse", 300_000.0));
        for other in [mm, pulse] {
            assert!((fraction.jerk.value / other.jerk.value - 1.0).abs() < 1e-3);
            assert!((fraction.highest.value - other.highest.value).abs() < 1e-3);
        }
    }
}
