//! One axis of the cue on one seat: position, velocity, acceleration and jerk, and vibration on top.

use std::sync::Arc;

use super::pieces::{At, Pieces, extremes};
use super::stencil::{Stencils, step_limit};
use super::sweep::{Swept, sweep};
use super::violation::{Breach, Quantity};
use super::{Found, SLACK, Terms, Worst};
use crate::cue::{Step, Vibration};
use crate::motion::{SeatType, Slot};
use crate::time::ShowTime;
use crate::timeline::{Figure, Timeline};

/// What one axis does at most on a seat that takes it, at the level of the proof.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisProof {
    /// The axis of the cue, from 0.
    pub axis: usize,
    /// The seat that it was judged for.
    pub seat: Arc<SeatType>,
    /// The lowest position that is sent, mm from the stroke's lower end.
    pub lowest: Figure,
    /// The highest position that is sent, mm from the stroke's lower end.
    pub highest: Figure,
    /// The lowest position with vibration on top; none where the axis never vibrates.
    pub lowest_shaken: Option<Figure>,
    /// The highest position with vibration on top; none where the axis never vibrates.
    pub highest_shaken: Option<Figure>,
    /// mm/s.
    pub velocity: Worst,
    /// Change of velocity from one frame to the next, mm/s.
    pub step: Worst,
    /// mm/s².
    pub acceleration: Worst,
    /// mm/s³.
    pub jerk: Worst,
}

impl AxisProof {
    /// The figures that have a limit.
    #[must_use]
    pub fn worst(&self) -> [(Quantity, Worst); 4] {
        [
            (Quantity::Velocity, self.velocity),
            (Quantity::Step, self.step),
            (Quantity::Acceleration, self.acceleration),
            (Quantity::Jerk, self.jerk),
        ]
    }

    /// How far what is sent stays from the nearer end of the stroke, vibration on top, as a part of the stroke; below 0
    /// past it.
    #[must_use]
    pub fn position_margin(&self) -> f64 {
        let low = self.lowest_shaken.map_or(self.lowest.value, |shaken| shaken.value.min(self.lowest.value));
        let high =
            self.highest_shaken.map_or(self.highest.value, |shaken| shaken.value.max(self.highest.value));
        low.min(self.seat.stroke_mm - high) / self.seat.stroke_mm
    }
}

/// An axis of the cue on one of the seats that take it.
pub(super) struct Subject<'a> {
    pub(super) timeline: &'a Timeline,
    pub(super) axis: usize,
    /// The axis of the cue that is the seat's first.
    pub(super) first: usize,
    pub(super) seat: &'a Arc<SeatType>,
    pub(super) slot: Slot,
}

impl Subject<'_> {
    /// Proves the axis; what is broken goes to `found`.
    pub(super) fn prove(&self, terms: &Terms, stencils: &Stencils, found: &mut Vec<Found>) -> AxisProof {
        let pieces = Pieces::new(self.timeline, self.axis, &self.slot);
        let limits = self.slot.limits;
        let ceiling = self.seat.speed_ceiling_mm_s() / self.seat.stroke_mm;
        let step = step_limit(limits.acceleration, terms.rate);
        let mut judge = |quantity, stencils: &[_], order, limit: f64| {
            let swept = sweep(&pieces, stencils, order, limit * SLACK);
            self.note(quantity, &swept, limit, found);
            self.worst(&swept, limit)
        };
        let velocity = judge(Quantity::Velocity, &stencils.velocity, 1, limits.velocity.min(ceiling));
        let step = judge(Quantity::Step, &stencils.step, 2, step);
        let acceleration = judge(Quantity::Acceleration, &stencils.acceleration, 2, limits.acceleration);
        let jerk = judge(Quantity::Jerk, &stencils.jerk, 3, limits.jerk);
        let (lowest, highest) = extremes(self.timeline, self.axis, &self.slot);
        let shaken = self.shaken(&pieces, terms, found);
        AxisProof {
            axis: self.axis,
            seat: Arc::clone(self.seat),
            lowest: self.figure(lowest),
            highest: self.figure(highest),
            lowest_shaken: shaken.map(|(low, _)| self.figure(low)),
            highest_shaken: shaken.map(|(_, high)| self.figure(high)),
            velocity,
            step,
            acceleration,
            jerk,
        }
    }

    fn worst(&self, swept: &Swept, limit: f64) -> Worst {
        let Figure { value, at, line } = self.figure(At { value: swept.worst, at: swept.at });
        Worst { value, limit: limit * self.seat.stroke_mm, at, line }
    }

    /// In mm, with the line of the row at or before it.
    fn figure(&self, met: At) -> Figure {
        let at = ShowTime::from_nanos(met.at);
        let line = self.timeline.cue().line(self.timeline.row_before(at));
        Figure { value: met.value * self.seat.stroke_mm, at, line }
    }

    fn note(&self, quantity: Quantity, swept: &Swept, limit: f64, found: &mut Vec<Found>) {
        let mm = self.seat.stroke_mm;
        found.extend(swept.over.iter().map(|stretch| Found {
            at: ShowTime::from_nanos(stretch.at),
            axis: Some(self.axis),
            column: format!("a{}", self.axis + 1),
            breach: Breach::Motion {
                quantity,
                value: stretch.worst * mm,
                limit: limit * mm,
                seat: self.seat.name.clone(),
                at: ShowTime::from_nanos(stretch.at),
                from: ShowTime::from_nanos(stretch.from),
                until: ShowTime::from_nanos(stretch.until),
            },
        }));
    }

    /// The ends that the axis reaches while it vibrates.
    fn shaken(&self, pieces: &Pieces, terms: &Terms, found: &mut Vec<Found>) -> Option<(At, At)> {
        let steps = self.timeline.cue().vibration().get(self.axis)?.as_slice();
        let mut ends: Option<(At, At)> = None;
        // A pulse for the rounding of the position and that of the amplitude.
        let slack = self.slot.stroke_pulses.recip();
        let mut outside_before = false;
        for (index, step) in steps.iter().enumerate() {
            let Some((low, high, amplitude)) = self.swing(pieces, terms, step, steps.get(index + 1)) else {
                outside_before = false;
                continue;
            };
            ends = Some(ends.map_or((low, high), |(least, most)| {
                (
                    if low.value < least.value { low } else { least },
                    if high.value > most.value { high } else { most },
                )
            }));
            let outside = low.value < -slack || high.value > 1.0 + slack;
            if outside && !outside_before {
                let worst = if -low.value > high.value - 1.0 { low } else { high };
                found.push(self.past_stroke(worst, amplitude, low));
            }
            outside_before = outside;
        }
        ends
    }

    /// The lowest and highest point of a vibration, in strokes, and its amplitude.
    fn swing(
        &self,
        pieces: &Pieces,
        terms: &Terms,
        step: &Step<Vibration>,
        next: Option<&Step<Vibration>>,
    ) -> Option<(At, At, f64)> {
        let amplitude = step.value.amplitude * self.slot.scale().0;
        if step.value.hz <= 0.0 || amplitude <= 0.0 {
            return None;
        }
        // What a frame switches acts while the axis moves to the frame's pose, a period later.
        let until = next.map_or(self.timeline.duration(), |next| next.at + terms.rate.period());
        let (low, high) = pieces.range(step.at.as_nanos(), until.as_nanos());
        let low = At { value: low.value - amplitude, ..low };
        Some((low, At { value: high.value + amplitude, ..high }, amplitude))
    }

    /// The largest amplitude that the stroke has room for while a vibration lasts, in the cue's unit; none where nothing
    /// vibrates.
    pub(super) fn most_amplitude(&self, pieces: &Pieces, terms: &Terms, index: usize) -> Option<f64> {
        let steps = self.timeline.cue().vibration().get(self.axis)?.as_slice();
        let (low, high, amplitude) = self.swing(pieces, terms, steps.get(index)?, steps.get(index + 1))?;
        let room = (low.value + amplitude).min(1.0 - (high.value - amplitude));
        Some(room.max(0.0) / self.slot.scale().0)
    }

    fn past_stroke(&self, worst: At, amplitude: f64, low: At) -> Found {
        let mm = self.seat.stroke_mm;
        let is_low = worst.at == low.at && worst.value == low.value;
        let position = if is_low { worst.value + amplitude } else { worst.value - amplitude };
        let at = ShowTime::from_nanos(worst.at);
        Found {
            at,
            axis: Some(self.axis),
            column: format!("v{}_amp", self.axis + 1),
            breach: Breach::VibrationPastStroke {
                amplitude: amplitude * mm,
                position: position * mm,
                stroke: mm,
                seat: self.seat.name.clone(),
                at,
            },
        }
    }
}
