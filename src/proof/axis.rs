//! One axis of the cue on one seat: position, velocity, acceleration and jerk, up to rest after the last pose.

use super::end::{Allowed, NoRest, no_rest};
use super::pieces::{At, AxisPieces, extremes};
use super::stencil::{Stencils, step_limit};
use super::sweep::{Swept, sweep};
use super::violation::{Breach, Quantity};
use super::{Found, SLACK, Terms, Worst};
use crate::motion::{AxisGeometry, AxisState, Limits, SeatAxis, Slot};
use crate::time::ShowTime;
use crate::timeline::{Figure, Timeline};

/// What one axis does at most on a seat that takes it, at the level of the proof.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AxisProof {
    /// The axis of the cue, from 0.
    pub(crate) axis: usize,
    /// The axis of a seat that it was judged for; all figures are in its unit.
    pub(crate) on: SeatAxis,
    /// The lowest position that is sent.
    pub(crate) lowest: Figure,
    /// The highest position that is sent.
    pub(crate) highest: Figure,
    /// The lowest position with vibration on top; `None` if the axis never vibrates.
    pub(crate) lowest_shaken: Option<Figure>,
    /// The highest position with vibration on top; `None` if the axis never vibrates.
    pub(crate) highest_shaken: Option<Figure>,
    /// Velocity.
    pub(crate) velocity: Worst,
    /// Change of velocity from one frame to the next.
    pub(crate) step: Worst,
    /// Acceleration.
    pub(crate) acceleration: Worst,
    /// Jerk.
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

    /// What is sent leaves so much of the stroke to its nearer end, vibration on top ([`AxisGeometry::room`]); below 0 past it.
    #[must_use]
    pub(crate) fn position_margin(&self) -> f64 {
        self.nearest().0
    }

    /// Where that is, with what it leaves.
    #[must_use]
    pub(crate) fn nearest(&self) -> (f64, Figure) {
        let axis = self.on.geometry();
        let shaken = self.lowest_shaken.into_iter().chain(self.highest_shaken);
        let all =
            [self.lowest, self.highest].into_iter().chain(shaken).map(|one| (axis.room(one.value), one));
        all.fold((f64::INFINITY, self.lowest), |least, one| if one.0 < least.0 { one } else { least })
    }
}

/// An axis of the cue on one of the seats that take it.
pub(super) struct Subject<'a> {
    pub(super) timeline: &'a Timeline,
    pub(super) axis: usize,
    pub(super) on: SeatAxis,
    pub(super) slot: Slot,
}

impl Subject<'_> {
    pub(super) fn geometry(&self) -> &AxisGeometry {
        self.on.geometry()
    }

    /// The name of the seat type.
    pub(super) fn seat(&self) -> String {
        self.on.seat.name.clone()
    }

    /// The same with what limits its speed, where that is the controller and not the seat type.
    fn limited_by(&self, quantity: Quantity) -> String {
        let axis = self.geometry();
        let ceiling = axis.speed_ceiling();
        if quantity != Quantity::Velocity || axis.max_velocity <= ceiling {
            return self.seat();
        }
        format!("{} at {:.0} rpm, its max_rpm", self.seat(), ceiling * 60.0 / axis.lead)
    }

    /// Proves the axis; what is broken goes to `found`.
    pub(super) fn prove(&self, terms: &Terms, stencils: &Stencils, found: &mut Vec<Found>) -> AxisProof {
        let pieces = AxisPieces::new(self.timeline, self.axis, &self.slot);
        let Allowed { limits, step, .. } = self.allowed(terms);
        let mut judge = |quantity, stencils: &[_], order, limit: f64| {
            // With the limiter's own slack: what passes here must not be held there.
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
            on: self.on.clone(),
            lowest: self.position(lowest),
            highest: self.position(highest),
            lowest_shaken: shaken.map(|(low, _)| self.position(low)),
            highest_shaken: shaken.map(|(_, high)| self.position(high)),
            velocity,
            step,
            acceleration,
            jerk,
        }
    }

    fn worst(&self, swept: &Swept, limit: f64) -> Worst {
        let stroke = self.geometry().stroke();
        let Figure { value, at, line } = self.figure(swept.worst * stroke, swept.at);
        Worst { value, limit: limit * stroke, at, line }
    }

    /// What the axis may do: the limits of its seat, and no faster than the controller lets it move.
    pub(super) fn allowed(&self, terms: &Terms) -> Allowed {
        let Limits { velocity, acceleration, jerk } = self.slot.limits;
        let velocity = velocity.min(self.geometry().speed_ceiling() / self.geometry().stroke());
        Allowed {
            limits: Limits { velocity, acceleration, jerk },
            step: step_limit(acceleration, terms.rate),
            pulse: self.slot.stroke_pulses.recip(),
        }
    }

    fn restless(&self, pieces: &AxisPieces, no_rest: NoRest) -> Found {
        let (&AxisGeometry { unit, low, high, .. }, mm) = (self.geometry(), self.geometry().stroke());
        let seat = self.seat();
        let at = ShowTime::from_nanos(pieces.end());
        let AxisState { position, velocity, .. } = pieces.last_motion();
        let (position, velocity) = (self.geometry().place(position), velocity * mm);
        let breach = match no_rest {
            NoRest::NoRoom { missing } => {
                Breach::NoRoomToRest { unit, velocity, position, missing: missing * mm, low, high, seat, at }
            }
            NoRest::TooRough { quantity, value, limit } => Breach::TooRoughToRest {
                unit,
                velocity,
                quantity,
                value: value * mm,
                limit: limit * mm,
                seat,
                at,
            },
        };
        Found { at, axis: Some(self.axis), column: format!("a{}", self.axis + 1), breach }
    }

    /// A place in the stroke.
    fn position(&self, met: At) -> Figure {
        self.figure(self.geometry().place(met.value), met.at)
    }

    /// A value in the unit of the axis, with the line of the row at or before it.
    fn figure(&self, value: f64, at: i64) -> Figure {
        let at = ShowTime::from_nanos(at);
        Figure { value, at, line: self.timeline.cue().line(self.timeline.row_before(at)) }
    }

    fn note(&self, quantity: Quantity, swept: &Swept, limit: f64, found: &mut Vec<Found>) {
        let stroke = self.geometry().stroke();
        found.extend(swept.over.iter().map(|stretch| Found {
            at: ShowTime::from_nanos(stretch.at),
            axis: Some(self.axis),
            column: format!("a{}", self.axis + 1),
            breach: Breach::Motion {
                unit: self.geometry().unit,
                quantity,
                value: stretch.worst * stroke,
                limit: limit * stroke,
                seat: self.limited_by(quantity),
                at: ShowTime::from_nanos(stretch.at),
                from: ShowTime::from_nanos(stretch.from),
                until: ShowTime::from_nanos(stretch.until),
            },
        }));
    }
}
