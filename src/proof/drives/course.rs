//! What an axis of a cue is to do, sampled evenly, with a way in from rest before it, where it begins in motion, and one to
//! rest behind it: what a join and a stop make of it when it is played.

use std::time::Duration;

use super::super::axis::Subject;
use super::super::pieces::AxisPieces;
use crate::cue::Vibration;
use crate::drive::Shaker;
use crate::motion::{AxisState, Halt, Limits, Slot};
use crate::time::{ShowTime, nanos};
use crate::timeline::Hint;

/// Samples are no farther apart than this.
const FINE: Duration = Duration::from_millis(2);
/// Shares of the limits that a way to rest takes.
const SHARES: [f64; 2] = [0.85, 1.0];

/// An axis at even times, in strokes.
#[derive(Debug)]
pub(super) struct WantedCourse {
    /// Show time of the first sample; slices of the link begin there. Nanoseconds.
    pub(super) from: i64,
    /// Between samples, ns; a whole part of the show's period.
    pub(super) step: i64,
    /// Samples in a period of the show.
    pub(super) per_tick: usize,
    pub(super) places: Vec<f64>,
    /// Show time of the cue's last row, nanoseconds.
    pub(super) end: i64,
}

impl WantedCourse {
    /// Of an axis of a cue, with vibration at a level of its own where there is any, for slices of a period that begin `sooner` than
    /// the cue's first row would have them, poses a `tick` apart.
    pub(super) fn of(
        subject: &Subject<'_>,
        tick: Duration,
        slice: Duration,
        sooner: Duration,
        shake: Option<f64>,
    ) -> Self {
        let ends = Ends::of(subject, slice);
        let slice = signed(slice);
        let lead = i64::max(Ends::span(ends.before.as_ref()) / slice + 2, 3) * slice + signed(sooner);
        let per_tick = tick.as_nanos().div_ceil(FINE.as_nanos()).max(1);
        let per_tick = usize::try_from(per_tick).unwrap_or(1);
        // Nothing that is told to a drive knows a finer time than the pose, but what it does is judged between poses as well.
        let step = (signed(tick) / i64::try_from(per_tick).unwrap_or(1)).max(1);
        let end = subject.timeline.duration().as_nanos();
        let until = end + Ends::span(ends.after.as_ref()) + 6 * slice + 4 * signed(tick);
        let mut sampler =
            Sampler { subject, ends, shake, swing: Shaker::default(), hints: Default::default() };
        let (mut at, mut places) = (-lead, Vec::new());
        while at <= until {
            places.push(sampler.next(at, step));
            at += step;
        }
        Self { from: -lead, step, per_tick, places, end }
    }

    /// The show time of a sample, nanoseconds.
    pub(super) fn at(&self, index: usize) -> i64 {
        self.from + i64::try_from(index).unwrap_or(i64::MAX / 2) * self.step
    }

    /// Where the axis is to be between two samples.
    #[expect(clippy::cast_precision_loss, reason = "less than a step")]
    pub(super) fn place(&self, at: i64) -> Option<f64> {
        let since = at - self.from;
        let index = usize::try_from(since / self.step).ok()?;
        let (here, next) = (self.places.get(index)?, self.places.get(index + 1)?);
        Some(here + (next - here) * (since % self.step) as f64 / self.step as f64)
    }

    /// What the tick thread would hand on: the place at each of its ticks.
    pub(super) fn poses(&self) -> impl Iterator<Item = f64> {
        self.places.iter().step_by(self.per_tick).copied()
    }
}

/// How an axis moves at the first row of the cue and at the last, and the show time of that, nanoseconds.
pub(super) fn edges(subject: &Subject<'_>) -> (AxisState, AxisState, i64) {
    let pieces = AxisPieces::new(subject.timeline, subject.axis, &subject.slot);
    let [position, velocity, bend, _] = pieces.list()[0].cubic.0;
    let first = AxisState { position, velocity, acceleration: 2.0 * bend };
    (first, pieces.last_motion(), pieces.end())
}

/// The ways from rest and to rest.
struct Ends {
    before: Option<Halt>,
    after: Option<Halt>,
    end: i64,
}

impl Ends {
    fn of(subject: &Subject<'_>, slice: Duration) -> Self {
        let (mut first, last, end) = edges(subject);
        // A way from rest is one to rest that is run backwards: speed turns round then, and acceleration, the
        // second derivative, stays what it is.
        first.velocity = -first.velocity;
        let halt = |from: AxisState, slot: &Slot| {
            let moves = from.velocity.abs() > standing(slot.limits, slice);
            let inside = || Halt::inside(from, slot.limits, &SHARES);
            moves.then(|| inside().unwrap_or_else(|| Halt::full(from, slot.limits)))
        };
        Self { before: halt(first, &subject.slot), after: halt(last, &subject.slot), end }
    }

    /// How long a way to rest takes, nanoseconds.
    fn span(way: Option<&Halt>) -> i64 {
        way.map_or(0, |halt| signed(Duration::from_secs_f64(halt.seconds().min(60.0))))
    }

    /// The place outside the cue, where it moves there.
    fn place(&self, at: i64) -> Option<f64> {
        let since = |ns: i64| ShowTime::from_nanos(ns).as_secs_f64();
        let place = |halt: &Halt, since: f64| halt.position(since).clamp(0.0, 1.0);
        if at < 0 {
            self.before.as_ref().map(|halt| place(halt, since(-at)))
        } else if at > self.end {
            self.after.as_ref().map(|halt| place(halt, since(at - self.end)))
        } else {
            None
        }
    }
}

struct Sampler<'a> {
    subject: &'a Subject<'a>,
    ends: Ends,
    shake: Option<f64>,
    swing: Shaker,
    /// Where cue and vibration were found last.
    hints: (Hint, usize),
}

impl Sampler<'_> {
    fn next(&mut self, at: i64, step: i64) -> f64 {
        let Subject { timeline, axis, slot, .. } = self.subject;
        let time = ShowTime::from_nanos(at);
        let own = || slot.place(timeline.sample(time, &mut self.hints.0)[*axis]);
        let place = self.ends.place(at).unwrap_or_else(own);
        let Some(shake) = self.shake else { return place };
        // A play leaves vibration out of its joins and stops.
        let inside = (0..=self.ends.end).contains(&at);
        let sample = timeline.cue().tracks().vibration(*axis).at(time, &mut self.hints.1);
        let Vibration { hz, amplitude } = sample.into();
        let amplitude = if inside { amplitude * slot.scale().0 * shake } else { 0.0 };
        place + self.swing.after(Duration::from_nanos(step.unsigned_abs()), hz, amplitude)
    }
}

/// The speed, strokes a second, below which an axis that is led stands as well as rests: to stop there within a slice takes a fiftieth
/// of its acceleration.
pub(super) fn standing(limits: Limits, slice: Duration) -> f64 {
    0.02 * limits.acceleration * slice.as_secs_f64()
}

/// Nanoseconds, to be reckoned with.
pub(super) fn signed(span: Duration) -> i64 {
    i64::try_from(nanos(span)).unwrap_or(i64::MAX / 4)
}
