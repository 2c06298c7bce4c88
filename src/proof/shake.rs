//! Vibration on top of an axis's motion: whether both together stay inside the stroke, and within the velocity and the
//! acceleration that a seat and the person on it stand.
//!
//! An axis that swings A to either side f times a second has 2 pi f A of velocity and (2 pi f)^2 A of acceleration at the
//! most, and as nobody knows where in its swing a controller is, each is met together with the worst of the motion under it:
//! the sums are what is judged.

use std::f64::consts::TAU;

use super::axis::Subject;
use super::loads::Loads;
use super::pieces::{At, AxisPieces};
use super::stencil::Stencils;
use super::violation::{Breach, Quantity};
use super::{Found, SLACK, Terms};
use crate::cue::Vibration;
use crate::time::ShowTime;
use crate::wire;

/// In stretches of this length the motion under a vibration is looked at, nanoseconds: about what the measure spans.
const STRETCH: i64 = 50_000_000;
// It adds that much to a sum at the most (docs/limiter.md, section 7).
/// The part of a limit below which motion is not measured closely.
const LIGHT: f64 = 0.01;
// Half of the slack, for the decimals of a file.
/// What is left below a limit that an amplitude was lowered to.
const ROUNDING: f64 = 0.9995;

/// What vibrations are put on top of: the motion of one axis.
pub(super) struct Under<'a> {
    pieces: &'a AxisPieces,
    loads: Loads,
}

/// One vibration, as it is executed.
struct AxisSwing {
    low: At,
    high: At,
    /// In strokes.
    amplitude: f64,
    hz: f64,
    /// The greatest velocity and acceleration of motion meanwhile.
    moved: [f64; 2],
}

impl AxisSwing {
    /// Velocity and acceleration of an amplitude of 1.
    fn per_amplitude(&self) -> [f64; 2] {
        // Derivatives of A sin (2 pi f t).
        let turns = TAU * self.hz;
        [turns, turns * turns]
    }
}

impl Subject<'_> {
    /// The motion of the axis, to put vibrations on; `None` if it never vibrates.
    pub(super) fn under<'a>(
        &self,
        pieces: &'a AxisPieces,
        terms: &Terms,
        stencils: &Stencils,
    ) -> Option<Under<'a>> {
        self.timeline.vibrates(self.axis).then(|| {
            let loads = Loads::over(pieces, self.slot.limits, stencils, terms.rate, STRETCH, LIGHT);
            Under { pieces, loads }
        })
    }

    /// The velocity and the acceleration that motion and vibration together may reach.
    fn most_shaken(&self) -> [f64; 2] {
        [self.geometry().shaken_velocity(), self.geometry().shaken_acceleration()]
    }

    /// The ends that the axis reaches while it vibrates; what is broken goes to `found`.
    pub(super) fn shaken(
        &self,
        pieces: &AxisPieces,
        terms: &Terms,
        stencils: &Stencils,
        found: &mut Vec<Found>,
    ) -> Option<(At, At)> {
        let under = self.under(pieces, terms, stencils)?;
        let steps = self.timeline.cue().tracks().vibration(self.axis).as_slice();
        let mut ends: Option<(At, At)> = None;
        // Of steps in a row that break a limit the first is told.
        let mut broken_before = [false; 2];
        for (index, step) in steps.iter().enumerate() {
            let Some(swing) = self.swing(&under, terms, index) else {
                broken_before = [false; 2];
                continue;
            };
            let (low, high) = ends.unwrap_or((swing.low, swing.high));
            ends = Some((
                if swing.low.value < low.value { swing.low } else { low },
                if swing.high.value > high.value { swing.high } else { high },
            ));
            let broken = [self.past_stroke(&swing), self.too_much(&swing, step.at)];
            let before = std::mem::replace(&mut broken_before, [broken[0].is_some(), broken[1].is_some()]);
            let told =
                broken.into_iter().zip(before).filter_map(|(broken, before)| broken.filter(|_| !before));
            found.extend(told);
        }
        ends
    }

    /// One of the axis's vibrations; `None` if it stands for none.
    fn swing(&self, under: &Under<'_>, terms: &Terms, index: usize) -> Option<AxisSwing> {
        let steps = self.timeline.cue().tracks().vibration(self.axis).as_slice();
        let (step, next) = (steps.get(index)?, steps.get(index + 1));
        let Vibration { hz, amplitude } = step.value.into();
        let amplitude = amplitude * self.slot.scale().0;
        if hz <= 0.0 || amplitude <= 0.0 {
            return None;
        }
        // What a frame switches acts while the axis moves to the frame's pose, a period later.
        let until = next.map_or(self.timeline.duration(), |next| next.at + terms.rate.period());
        let (from, until) = (step.at.as_nanos(), until.as_nanos());
        let (low, high) = under.pieces.range(from, until);
        let low = At { value: low.value - amplitude, ..low };
        let high = At { value: high.value + amplitude, ..high };
        // As the frame says it, in whole eighths of a millisecond: acceleration goes by the square of it.
        let hz = executed_hz(hz);
        Some(AxisSwing { low, high, amplitude, hz, moved: self.moved(under, from, until) })
    }

    fn moved(&self, under: &Under<'_>, from: i64, until: i64) -> [f64; 2] {
        let Loads { velocity, acceleration, .. } = &under.loads;
        let last = velocity.len() - 1;
        let stretch = |at: i64| usize::try_from(at / STRETCH).unwrap_or(0).min(last);
        // Whole stretches, of which it may fill a part: the motion under it is never too little.
        let met = stretch(from)..=stretch(until);
        [velocity, acceleration].map(|loads| {
            let most = loads[met.clone()].iter().fold(0.0_f32, |most, load| most.max(*load));
            f64::from(most) * self.geometry().stroke()
        })
    }

    fn past_stroke(&self, swing: &AxisSwing) -> Option<Found> {
        let AxisSwing { low, high, amplitude, .. } = *swing;
        // A pulse for the rounding of the position and that of the amplitude.
        let slack = self.slot.stroke_pulses.recip();
        if low.value >= -slack && high.value <= 1.0 + slack {
            return None;
        }
        let is_low = -low.value > high.value - 1.0;
        let (worst, position) =
            if is_low { (low, low.value + amplitude) } else { (high, high.value - amplitude) };
        let (mm, at) = (self.geometry().stroke(), ShowTime::from_nanos(worst.at));
        let breach = Breach::VibrationPastStroke {
            amplitude: amplitude * mm,
            position: self.geometry().place(position),
            unit: self.geometry().unit,
            low: self.geometry().low,
            high: self.geometry().high,
            seat: self.seat(),
            at,
        };
        Some(self.of_vibration(at, breach))
    }

    /// The sum that is over its limit by the greater part, if one is.
    fn too_much(&self, swing: &AxisSwing, at: ShowTime) -> Option<Found> {
        let amplitude = swing.amplitude * self.geometry().stroke();
        let of = |place: usize| {
            let (shaken, moved) = (swing.per_amplitude()[place] * amplitude, swing.moved[place]);
            (place, shaken, moved, self.most_shaken()[place])
        };
        let part = |&(_, shaken, moved, limit): &(usize, f64, f64, f64)| (shaken + moved) / limit;
        let worst = [of(0), of(1)].into_iter().max_by(|a, b| part(a).total_cmp(&part(b)))?;
        let (place, shaken, moved, limit) = worst;
        let quantity = [Quantity::Velocity, Quantity::Acceleration][place];
        let (hz, seat, unit) = (swing.hz, self.seat(), self.geometry().unit);
        let breach = Breach::Shaken { unit, quantity, amplitude, hz, shaken, moved, limit, seat, at };
        (part(&worst) > SLACK).then(|| self.of_vibration(at, breach))
    }

    fn of_vibration(&self, at: ShowTime, breach: Breach) -> Found {
        Found { at, axis: Some(self.axis), column: format!("v{}_amp", self.axis + 1), breach }
    }

    /// The largest amplitude that stroke, velocity and acceleration have room for while a vibration lasts, in the cue's unit;
    /// none where nothing vibrates.
    pub(super) fn most_amplitude(&self, under: &Under<'_>, terms: &Terms, index: usize) -> Option<f64> {
        let swing = self.swing(under, terms, index)?;
        let AxisSwing { low, high, amplitude, moved, .. } = swing;
        let room = (low.value + amplitude).min(1.0 - (high.value - amplitude));
        let limits = self.most_shaken();
        let left = |place: usize| {
            ROUNDING * (limits[place] - moved[place])
                / swing.per_amplitude()[place]
                / self.geometry().stroke()
        };
        Some(room.min(left(0)).min(left(1)).max(0.0) / self.slot.scale().0)
    }
}

/// How often an axis swings that is told to do so `hz` times a second: a frame tells the period, in eighths of a
/// millisecond.
fn executed_hz(hz: f64) -> f64 {
    wire::Vibration::from_hz(hz, 1.0).hz().unwrap_or(hz)
}
