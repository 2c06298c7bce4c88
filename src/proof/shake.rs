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
use crate::motion::Slot;
use crate::time::{Rate, ShowTime};
use crate::timeline::Timeline;
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
#[derive(Clone, Copy)]
struct Swing {
    /// Between which show times it is, nanoseconds.
    from: i64,
    until: i64,
    /// In strokes.
    amplitude: f64,
    hz: f64,
}

impl Swing {
    /// One of an axis's vibrations on a slot, at the slot's level; `None` if it stands for none.
    fn of(timeline: &Timeline, axis: usize, slot: &Slot, rate: Rate, index: usize) -> Option<Self> {
        let steps = timeline.cue().tracks().vibration(axis).as_slice();
        let (step, next) = (steps.get(index)?, steps.get(index + 1));
        let Vibration { hz, amplitude } = step.value.into();
        let amplitude = amplitude * slot.scale().0;
        if hz <= 0.0 || amplitude <= 0.0 {
            return None;
        }
        // What a frame switches acts while the axis moves to the frame's pose, a period later.
        let until = next.map_or(timeline.duration(), |next| next.at + rate.period());
        // As the frame says it, in whole eighths of a millisecond: acceleration goes by the square of it.
        let hz = executed_hz(hz);
        Some(Self { from: step.at.as_nanos(), until: until.as_nanos(), amplitude, hz })
    }

    /// Velocity and acceleration of an amplitude of 1.
    fn per_amplitude(&self) -> [f64; 2] {
        // Derivatives of A sin (2 pi f t).
        let turns = TAU * self.hz;
        [turns, turns * turns]
    }
}

/// One vibration, and the motion that it is put on.
struct AxisSwing {
    swing: Swing,
    low: At,
    high: At,
    /// The greatest velocity and acceleration of motion meanwhile.
    moved: [f64; 2],
}

/// The greatest velocity and acceleration of the vibration of an axis, in each stretch of `span` nanoseconds; strokes and seconds. On a
/// slot that carries it, at the slot's level.
pub(crate) fn shakes(
    timeline: &Timeline,
    axis: usize,
    slot: &Slot,
    rate: Rate,
    span: i64,
) -> Box<[[f64; 2]]> {
    let stretch = |at: i64| usize::try_from(at / span).unwrap_or(0);
    let mut most = vec![[0.0_f64; 2]; stretch(timeline.duration().as_nanos()) + 1];
    let last = most.len() - 1;
    let steps = timeline.cue().tracks().vibration(axis).as_slice().len();
    for swing in (0..steps).filter_map(|index| Swing::of(timeline, axis, slot, rate, index)) {
        let shaken = swing.per_amplitude().map(|one| swing.amplitude * one);
        for most in &mut most[stretch(swing.from).min(last)..=stretch(swing.until).min(last)] {
            *most = [most[0].max(shaken[0]), most[1].max(shaken[1])];
        }
    }
    most.into()
}

impl Subject<'_> {
    /// The motion of the axis, to put vibrations on; `None` if it never vibrates.
    pub(super) fn under<'a>(
        &self,
        pieces: &'a AxisPieces,
        terms: &Terms,
        stencils: &Stencils,
    ) -> Option<Under<'a>> {
        let is_shaken = self.on.seat.vibration > 0.0 && self.timeline.vibrates(self.axis);
        is_shaken.then(|| {
            let loads = Loads::over(pieces, self.slot.limits, stencils, terms.rate, STRETCH, LIGHT);
            Under { pieces, loads }
        })
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
        let swing = Swing::of(self.timeline, self.axis, &self.slot, terms.rate, index)?;
        let Swing { from, until, amplitude, .. } = swing;
        let (low, high) = under.pieces.range(from, until);
        let low = At { value: low.value - amplitude, ..low };
        let high = At { value: high.value + amplitude, ..high };
        Some(AxisSwing { swing, low, high, moved: self.moved(under, from, until) })
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
        let AxisSwing { low, high, swing: Swing { amplitude, .. }, .. } = *swing;
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
        let &AxisSwing { swing, moved, .. } = swing;
        let amplitude = swing.amplitude * self.geometry().stroke();
        let (shaken, most) = (swing.per_amplitude(), self.geometry().most_shaken());
        let of = |place: usize| (place, shaken[place] * amplitude, moved[place], most[place]);
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
        let AxisSwing { swing, low, high, moved } = self.swing(under, terms, index)?;
        let room = (low.value + swing.amplitude).min(1.0 - (high.value - swing.amplitude));
        let limits = self.geometry().most_shaken();
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
