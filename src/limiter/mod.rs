//! The check behind the engine: whatever that asks for, what is sent keeps the limits of every axis by the measure of
//! [`crate::motion::Measure`], on the poses before they are rounded to pulses. Tick thread; told the time; allocates
//! nothing.
//!
//! What keeps the limits passes unchanged, bit for bit. A pose that does not, or after which no way to rest within the
//! limits is left, is not sent: the axis goes on along a way to rest instead, and once what is asked has kept the limits
//! for as long as the measure looks back, it fades from rest onto it.

mod axis;
mod counts;
mod fast_path;
mod history;
mod limits;
mod stop_path;
mod times;

pub use counts::Limit;
pub(crate) use counts::{Clamp, Counts};

use axis::{AxisLimiter, AxisMode};
use counts::Counter;
use fast_path::FastPath;
use history::{PoseHistory, Reciprocals};
use limits::{AxisLimits, NextPose, SLACK};
use stop_path::StopPath;
use times::FrameTimes;

use crate::belief::KnownPose;
use crate::motion::{AxisState, Halt, Limits, MAX_AXES, Pose, Spacing, Window};
use crate::time::Rate;

/// What the turn of a pose that was proved may lie outside the stroke, in strokes: what poses show of a motion is off by
/// some thousandths of a millimetre.
const ROOM_SLACK: f64 = 1e-4;

/// What became of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admitted {
    /// It is sent as it was asked for.
    Passed,
    /// At least one axis is sent something else.
    Held,
    /// The same, and clamps have come so often that the show must end.
    Fault,
}

/// What is known of a pose that is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Provenance {
    /// It lies on a cue whose limits were proved up to rest after its last pose, or on a move that was planned within them
    /// and ends at rest or on the cue.
    Proved,
    /// Nothing.
    Anyhow,
}

/// The limiter of one lane.
#[derive(Debug, Clone)]
pub struct Limiter {
    axes: Vec<AxisLimiter>,
    fast_path: FastPath,
    history: PoseHistory,
    times: FrameTimes,
    /// True if every axis is sent what is asked.
    following: bool,
    /// True if it was told where the lane stands.
    is_seeded: bool,
    counter: Counter,
}

/// What the differences of one tick need.
#[derive(Clone, Copy)]
struct Frame {
    index: u64,
    time_ms: u32,
    seconds: f64,
    per_second: f64,
    per_second_before: f64,
    differences: [Reciprocals; 2],
}

impl Limiter {
    /// The limiter of a lane. It lets nothing pass before it is told where the lane stands ([`Self::restart`]).
    #[must_use]
    pub(crate) fn new(window: &Window, rate: Rate) -> Self {
        let (spacing, times) = (Spacing::at_rate(rate.hz()), FrameTimes::new(rate));
        let limits = window.slots().iter().map(|slot| AxisLimits::new(slot.limits, times.period()));
        let axes: Vec<AxisLimiter> = limits.map(|limits| AxisLimiter::new(limits, spacing)).collect();
        let pose = [0.0; MAX_AXES];
        Self {
            fast_path: FastPath::new(
                axes.iter().map(|axis| &axis.limits),
                spacing,
                pose,
                f64::from(times.usual_ms()) * 1e-3,
            ),
            axes,
            history: PoseHistory::new(spacing, pose, times.usual_ms()),
            times,
            following: false,
            is_seeded: false,
            counter: Counter::default(),
        }
    }

    /// Tells that frames stopped for long: what comes next goes on from the last pose.
    pub fn rest(&mut self) {
        self.rest_in(*self.history.last());
    }

    /// Tells that the lane is known to have stood in that pose for long, wherever it was before.
    pub fn restart(&mut self, known: &KnownPose) {
        self.is_seeded = true;
        self.rest_in(*known.pose());
    }

    /// The same for a lane that is known to stand in its park pose, but for what is noise.
    pub(crate) fn restart_at_park(&mut self, known: &KnownPose, window: &Window) {
        self.restart(known);
        self.rest_in(window.park());
    }

    fn rest_in(&mut self, pose: Pose) {
        // A pose outside is never sent: an axis that is said to stand there could not be told to stay.
        let pose = held_inside(pose);
        self.history.rest(pose, self.times.usual_ms());
        self.fast_path.rest(pose, f64::from(self.times.usual_ms()) * 1e-3);
        self.axes.iter_mut().for_each(AxisLimiter::rest);
        // Calm poses pass without being judged: of a seat that nobody has placed none may.
        self.following = self.is_seeded;
    }

    /// Counts since the limiter was made.
    #[must_use]
    pub const fn counts(&self) -> &Counts {
        &self.counter.counts
    }

    /// Goes on counting where another limiter of the same lane left off; its latched fault is its own.
    pub(crate) const fn count_on(&mut self, before: &Counts) {
        let fault = self.counter.counts.fault;
        self.counter.counts = *before;
        self.counter.counts.fault = fault;
    }

    /// The pose sent last.
    #[must_use]
    pub fn sent(&self) -> &Pose {
        self.history.last()
    }

    /// Puts into `pose`, which frame `index` (counted from 0, of [`Rate::time_ms`]) is to carry, what may be sent, and takes
    /// it as sent. Frames that were left out, few or many, are not missed: see [`Self::rest`].
    #[inline]
    pub fn admit(&mut self, pose: &mut Pose, index: u64, asked: Provenance) -> Admitted {
        let time_ms = self.times.of(index);
        self.fast_path.begin(f64::from(time_ms) * 1e-3);
        // The sums know what was sent. While an axis goes its own way
        // that is not what is asked, so none of the lane passes by them.
        if self.following && self.fast_path.admit_calm(pose) {
            self.history.push(*pose, time_ms);
            self.counter.tick(time_ms, false, false);
            return Admitted::Passed;
        }
        self.judge(pose, index, time_ms, asked)
    }

    #[expect(clippy::cast_precision_loss, reason = "some seconds")]
    fn frame(&mut self, index: u64, time_ms: u32) -> Frame {
        let seconds = f64::from(time_ms) * 1e-3;
        Frame {
            index,
            time_ms,
            seconds,
            per_second: 1.0 / seconds,
            per_second_before: 1e3 / self.history.last_time() as f64,
            differences: self.history.differences(time_ms),
        }
    }

    #[inline]
    fn next(&self, axis: usize, position: f64, frame: &Frame) -> NextPose {
        let before = |back: usize| self.history.before(back)[axis];
        let velocity = (position - before(1)) * frame.per_second;
        let shown = frame.differences.map(|difference| {
            let apart = difference.apart;
            difference.show([position, before(apart), before(2 * apart), before(3 * apart)])
        });
        NextPose {
            position,
            velocity,
            step: velocity - (before(1) - before(2)) * frame.per_second_before,
            shown,
        }
    }

    /// The same axis by axis, where not all is plain.
    #[cold]
    #[inline(never)]
    fn judge(&mut self, pose: &mut Pose, index: u64, time_ms: u32, asked: Provenance) -> Admitted {
        // Any pose may be a jump for a seat that nobody has placed, so the show has to end.
        if !self.is_seeded {
            *pose = *self.history.last();
            return Admitted::Fault;
        }
        let frame = &self.frame(index, time_ms);
        // Not up to the first refusal: each axis brakes from its own motion, and the others go on.
        let (mut refused, mut held) = (false, false);
        for (axis, position) in pose.iter_mut().enumerate().take(self.axes.len()) {
            let (sent, was_refused) = self.judge_axis(axis, *position, frame, asked);
            *position = sent;
            refused |= was_refused;
            held |= self.axes[axis].mode != AxisMode::Following;
        }
        self.following = !held;
        // What is sent counts, not what was asked: differences of the next frames reach back to it.
        self.fast_path.take(pose);
        self.history.push(*pose, time_ms);
        self.counter.tick(time_ms, refused, held);
        match (held, self.counter.counts.fault) {
            (false, _) => Admitted::Passed,
            (true, false) => Admitted::Held,
            (true, true) => Admitted::Fault,
        }
    }

    /// What one axis is sent, and whether what was asked broke a limit.
    fn judge_axis(&mut self, axis: usize, asked: f64, frame: &Frame, by: Provenance) -> (f64, bool) {
        let state = &self.axes[axis];
        // Near an end of the stroke one axis of many is not calm, in all lanes of a hall at once.
        if state.mode == AxisMode::Following && self.passes_by_sums(axis, asked, by) {
            self.axes[axis].take_up(AxisMode::Following);
            return (asked, false);
        }
        let state = &mut self.axes[axis];
        // As long as it follows, what is asked is what is sent, and that is measured below.
        // Apart from it it is looked at by itself, to know when it may be followed again.
        let broken = state.mode != AxisMode::Following && state.look(asked, frame.time_ms);
        let (mode, wish) = state.wish(asked, frame.seconds);
        // A fade is on no cue that was proved, whatever it fades onto: only a way out of its own is one.
        let by = if mode == AxisMode::Following { by } else { Provenance::Anyhow };
        let next = self.next(axis, wish, frame);
        let held = self.axes[axis].limits.hold(&next);
        // A way to rest needs no other way out: what is left of it is one.
        if let AxisMode::Braking { .. } = mode {
            if held {
                self.axes[axis].take_up(mode);
                return (wish, broken);
            }
            return (self.brake(axis, frame), broken);
        }
        if held && self.leads_on(axis, &next, frame, by) {
            self.axes[axis].take_up(mode);
            return (wish, broken);
        }
        let allowed = self.brake(axis, frame);
        let (limit, times) = exceeded(&self.axes[axis].limits, &next);
        self.counter.refused(Clamp { axis, asked, allowed, limit, times });
        (allowed, true)
    }

    /// True if an axis that follows is calm, or keeps the limits by the same sums and was proved to come to rest: of that as much is
    /// asked as in [`Self::leads_on`], but of how it moves by its newest poses.
    fn passes_by_sums(&self, axis: usize, asked: f64, by: Provenance) -> bool {
        // The sums bound all that the measure sees, so that the poses of 81 frames need not be fetched: in a hall they are no longer in
        // the cache of the processor, and near an end of the stroke all lanes would ask for them in the same tick.
        let AxisLimits { velocity, acceleration, jerk, .. } = self.axes[axis].limits;
        // That it comes to rest is proved. What was said to be proved and runs out of its stroke is refused while there is room left.
        let turns = |state| Halt::plainly_turns(state, Limits { velocity, acceleration, jerk });
        self.fast_path.is_calm(axis, asked)
            || (by == Provenance::Proved && self.fast_path.bounded(axis, asked).is_some_and(turns))
    }

    /// True if a way to rest goes on from this pose.
    fn leads_on(&mut self, axis: usize, next: &NextPose, frame: &Frame, by: Provenance) -> bool {
        // Of what was proved, one does: it can be followed to its end within the limits, and from its last
        // pose a way to rest within them is part of the proof (`proof::end`); a planned move ends at rest or
        // on the cue. The stroke has room for a stop at once as well, since what turns inside it leaves room
        // to turn sooner. That much is asked all the same, in closed form: what was said to be proved and
        // runs out of its stroke is refused while there is room left.
        (by == Provenance::Proved && self.has_room(axis, next, frame))
            || self.leaves_a_way_out(axis, next, frame)
    }

    /// True if the axis can turn inside the stroke, by what its last poses show of its motion.
    fn has_room(&self, axis: usize, next: &NextPose, frame: &Frame) -> bool {
        let AxisLimits { velocity, acceleration, jerk, .. } = self.axes[axis].limits;
        let limits = Limits { velocity, acceleration, jerk };
        frame.differences.iter().zip(next.shown).any(|(difference, shown)| {
            let (velocity, acceleration) = difference.newest(shown);
            // At its end a cubic through four poses may bend by more than what was proved does anywhere.
            let acceleration = acceleration.clamp(-limits.acceleration, limits.acceleration);
            let state = AxisState { position: next.position, velocity, acceleration };
            // No way peaks lower than braking with everything (docs/limiter.md, section 4).
            Halt::plainly_turns(state, limits) || Halt::least_past(state, limits, 1.0) <= ROOM_SLACK
        })
    }

    /// True if the axis can come to rest after this pose; the way is kept for the next tick.
    fn leaves_a_way_out(&mut self, axis: usize, next: &NextPose, frame: &Frame) -> bool {
        let state = &mut self.axes[axis];
        // The brake that a calm pose leaves is found again from the same
        // poses (docs/limiter.md, section 3): nothing has to be kept of it.
        if self.fast_path.is_calm(axis, next.position) {
            return true;
        }
        self.counter.counts.looked += 1;
        let sent = Some(next.position);
        let mut outlook = StopPath::new(&self.history, axis, &state.limits, self.times, frame.time_ms, sent);
        let way = outlook.way(state.habit);
        if let Some((brake, habit)) = way {
            // With its frame: a tick later it begins where the axis no longer is.
            state.way_out = Some((frame.index, brake));
            state.habit = habit;
        }
        way.is_some()
    }

    /// Goes onto a way to rest: the one kept from the tick before, or one that is looked for now.
    fn brake(&mut self, axis: usize, frame: &Frame) -> f64 {
        // All of this way was laid against the measure with the Times of these very frames (docs/limiter.md, section 4).
        let begins_here = |&(index, _): &(u64, Halt)| index + 1 == frame.index;
        if let Some((_, brake)) = self.axes[axis].way_out.take_if(|way| begins_here(way)) {
            let position = brake.position(frame.seconds);
            let next = self.next(axis, position, frame);
            if self.axes[axis].limits.hold(&next) {
                return self.axes[axis].brake(brake, frame.seconds);
            }
        }
        let state = &self.axes[axis];
        let mut outlook = StopPath::new(&self.history, axis, &state.limits, self.times, frame.time_ms, None);
        // Where no way keeps the limits a person still has to be brought
        // to rest: by the one that is least beyond, and that is counted.
        let brake = outlook.way(state.habit).map_or_else(|| outlook.least(), |way| way.0);
        let next = self.next(axis, brake.position(frame.seconds), frame);
        if !self.axes[axis].limits.hold(&next) {
            self.counter.counts.beyond += 1;
        }
        self.axes[axis].brake(brake, frame.seconds)
    }
}

/// The limit that a pose exceeds most, and how many times.
fn exceeded(limits: &AxisLimits, next: &NextPose) -> (Limit, f64) {
    if !(0.0..=1.0).contains(&next.position) {
        return (Limit::Position, f64::INFINITY);
    }
    let [n, m] = next.shown;
    let shares = [
        (Limit::Velocity, next.velocity.abs() / limits.velocity),
        (Limit::Step, next.step.abs() / limits.step),
        (Limit::Acceleration, n.acceleration.abs().max(m.acceleration.abs()) / limits.acceleration),
        (Limit::Jerk, n.jerk.abs().max(m.jerk.abs()) / limits.jerk),
    ];
    // What is within the slack was let pass: what is refused with no more than that lacked a way to rest.
    let worst =
        shares.into_iter().fold((Limit::WayOut, SLACK), |most, of| if of.1 > most.1 { of } else { most });
    if worst.0 == Limit::WayOut { (Limit::WayOut, 1.0) } else { worst }
}

/// Positions held inside the stroke; what is no number rests at its lower end.
fn held_inside(pose: Pose) -> Pose {
    pose.map(|position| if position.is_nan() { 0.0 } else { position.clamp(0.0, 1.0) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::harness::asked::{read, window};
    use crate::motion::AxisGeometry;

    #[test]
    fn before_it_is_told_where_the_lane_stands_it_lets_nothing_pass_whatever_rests() {
        let window = window(Limits::of(&AxisGeometry::BENCH));
        let mut limiter = Limiter::new(&window, Rate::from_hz(100.0));
        for index in 0..3 {
            for provenance in [Provenance::Proved, Provenance::Anyhow] {
                let admitted = limiter.admit(&mut [0.0; MAX_AXES], index, provenance);
                assert_eq!(admitted, Admitted::Fault, "frame {index}");
            }
            limiter.rest();
        }
        let stands = [0.25; MAX_AXES];
        limiter.restart(&read(&window, stands));
        assert_eq!(limiter.admit(&mut { stands }, 3, Provenance::Anyhow), Admitted::Passed);
    }
}
