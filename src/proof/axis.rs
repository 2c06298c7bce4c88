//! One axis of the cue on one seat: position, velocity, acceleration and jerk, up to rest after the last pose.

use std::sync::Arc;

use super::end::{Allowed, NoRest, no_rest};
use super::pieces::{At, Pieces, extremes};
use super::stencil::{Stencils, step_limit};
use super::sweep::{Swept, sweep};
use super::violation::{Breach, Quantity};
use super::{Found, SLACK, Terms, Worst};
use crate::motion::{AxisState, Limits, SeatType, Slot};
use crate::time::ShowTime;
use crate::timeline::{Figure, Timeline};

/// What one axis does at most on a seat that takes it, at the level of the proof.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AxisProof {
    /// The axis of the cue, from 0.
    pub(crate) axis: usize,
    /// The seat that it was judged for.
    pub(crate) seat: Arc<SeatType>,
    /// The lowest position that is sent, mm from the stroke's lower end.
    pub(crate) lowest: Figure,
    /// The highest position that is sent, mm from the stroke's lower end.
    pub(crate) highest: Figure,
    /// The lowest position with vibration on top; `None` if the axis never vibrates.
    pub(crate) lowest_shaken: Option<Figure>,
    /// The highest position with vibration on top; `None` if the axis never vibrates.
    pub(crate) highest_shaken: Option<Figure>,
    /// mm/s.
    pub(crate) velocity: Worst,
    /// Change of velocity from one frame to the next, mm/s.
    pub(crate) step: Worst,
    /// mm/s².
    pub(crate) acceleration: Worst,
    /// mm/s³.
    pub(crate) jerk: Worst,
}

impl AxisProof {
    /// The figures that have a limit.
    #[must_use]
    pub(crate) fn worst(&self) -> [(Quantity, Worst); 4] {
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
    pub(crate) fn position_margin(&self) -> f64 {
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
        let Allowed { limits, step, .. } = self.allowed(terms);
        let mut judge = |quantity, stencils: &[_], order, limit: f64| {
            let swept = sweep(&pieces, stencils, order, limit * SLACK);
            self.note(quantity, &swept, limit, found);
            self.worst(&swept, limit)
        };
        let velocity = judge(Quantity::Velocity, &stencils.velocity, 1, limits.velocity);
        let step = judge(Quantity::Step, &stencils.step, 2, step);
        let acceleration = judge(Quantity::Acceleration, &stencils.acceleration, 2, limits.acceleration);
        let jerk = judge(Quantity::Jerk, &stencils.jerk, 3, limits.jerk);
        let keeps =
            [&velocity, &step, &acceleration, &jerk].iter().all(|worst| worst.margin() >= 1.0 - SLACK);
        if keeps {
            // What breaks a limit before its end is mended first.
            let no_rest = no_rest(&pieces, &self.allowed(terms), stencils);
            found.extend(no_rest.map(|no_rest| self.restless(&pieces, no_rest)));
        }
        let (lowest, highest) = extremes(self.timeline, self.axis, &self.slot);
        let shaken = self.shaken(&pieces, terms, stencils, found);
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

    /// What the axis may do: the limits of its seat, and no faster than the controller lets it move.
    pub(super) fn allowed(&self, terms: &Terms) -> Allowed {
        let Limits { velocity, acceleration, jerk } = self.slot.limits;
        let velocity = velocity.min(self.seat.speed_ceiling_mm_s() / self.seat.stroke_mm);
        Allowed {
            limits: Limits { velocity, acceleration, jerk },
            step: step_limit(acceleration, terms.rate),
            pulse: self.slot.stroke_pulses.recip(),
        }
    }

    fn restless(&self, pieces: &Pieces, no_rest: NoRest) -> Found {
        let (mm, seat) = (self.seat.stroke_mm, self.seat.name.clone());
        let at = ShowTime::from_nanos(pieces.end());
        let AxisState { position, velocity, .. } = pieces.last_motion();
        let (position, velocity) = (position * mm, velocity * mm);
        let breach = match no_rest {
            NoRest::NoRoom { missing } => {
                Breach::NoRoomToRest { velocity, position, missing: missing * mm, stroke: mm, seat, at }
            }
            NoRest::TooRough { quantity, value, limit } => {
                Breach::TooRoughToRest { velocity, quantity, value: value * mm, limit: limit * mm, seat, at }
            }
        };
        Found { at, axis: Some(self.axis), column: format!("a{}", self.axis + 1), breach }
    }

    /// In mm, with the line of the row at or before it.
    pub(super) fn figure(&self, met: At) -> Figure {
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
}
