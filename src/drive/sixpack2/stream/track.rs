//! Where a lane is led: poses as they came, each with when the seat is to be there, and what an axis does at any instant between
//! them. Pure; told the time.

use std::collections::VecDeque;
use std::time::Duration;

use crate::drive::Middle;
use crate::drive::link::LedPose;
use crate::motion::{AxisState, Halt, Limits, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// Poses that are kept in mind behind the present one.
const BEHIND: usize = 3;
/// How much of each tick the grid is stretched at most to come back to when poses are to be there.
const STRETCH: f64 = 0.01;
/// What of the limits a brake takes, first: as the planner's.
const SHARES: [f64; 2] = [0.85, 1.0];
/// Poses that differ by less, in strokes, stand still.
const STILL: f64 = 1e-7;

/// A pose, and when the seat is to be there.
#[derive(Debug, Clone, Copy)]
struct Knot {
    at: MonoTime,
    places: Pose,
    frame: Option<FrameNo>,
}

/// The way of a lane.
#[derive(Debug)]
pub(super) struct Track {
    knots: VecDeque<Knot>,
    tick: Duration,
    /// When the first pose is executed, and the poses since.
    origin: MonoTime,
    poses: u32,
    /// How much later they are than an even grid from the origin, seconds.
    shift: f64,
    /// Nothing follows the last: there it rests.
    is_over: bool,
}

impl Track {
    /// Rests at `places`.
    pub(super) fn at_rest(tick: Duration, places: Pose, now: MonoTime) -> Self {
        let knots = VecDeque::from([Knot { at: now, places, frame: None }]);
        Self { knots, tick, origin: now, poses: 0, shift: 0.0, is_over: true }
    }

    /// Begins with the next pose, which is executed from `origin` on.
    pub(super) fn begin(&mut self, origin: MonoTime) {
        self.knots.clear();
        (self.origin, self.poses, self.shift, self.is_over) = (origin, 0, 0.0, false);
    }

    /// Takes the next pose, with what vibrates on it. Poses go on in stream time, one tick after the other: where ticks were missed, and
    /// `at` leaps, what was ahead shrinks by that, and the grid is stretched by up to 1 % until it is regained.
    pub(super) fn push(&mut self, led: &LedPose, places: Pose) {
        let tick = self.tick.as_secs_f64();
        let stream = f64::from(self.poses) * tick;
        let wanted = seconds(led.at, self.origin) - stream;
        self.shift += (wanted - self.shift).clamp(-STRETCH * tick, STRETCH * tick);
        self.poses += 1;
        let at = self.origin + Duration::from_secs_f64((stream + self.shift).max(0.0));
        self.knots.push_back(Knot { at, places, frame: Some(led.pose.frame) });
    }

    /// What lies behind is forgotten.
    pub(super) fn forget(&mut self, now: MonoTime) {
        while self.knots.get(BEHIND).is_some_and(|knot| knot.at < now) {
            self.knots.pop_front();
        }
    }

    /// Nothing more comes: it rests where the last pose is.
    pub(super) const fn end(&mut self) {
        self.is_over = true;
    }

    /// True if the last poses differ.
    pub(super) fn ends_moving(&self, axes: usize) -> bool {
        let mut last = self.knots.iter().rev().take(2);
        let (Some(one), Some(other)) = (last.next(), last.next()) else { return false };
        !self.is_over
            && one.places.iter().zip(other.places).take(axes).any(|(one, other)| (one - other).abs() > STILL)
    }

    /// True once it rests for good.
    pub(super) fn has_ended(&self, now: MonoTime) -> bool {
        self.is_over && self.knots.back().is_none_or(|knot| knot.at <= now)
    }

    /// The newest frame that is executed by then.
    pub(super) fn frame(&self, at: MonoTime) -> Option<FrameNo> {
        self.knots.iter().rev().find(|knot| knot.at <= at)?.frame
    }

    /// The last frame that leads it anywhere.
    pub(super) fn newest(&self) -> Option<FrameNo> {
        self.knots.back()?.frame
    }

    /// What an axis does at an instant, in strokes; none where the poses do not reach.
    pub(super) fn at(&self, axis: usize, at: MonoTime) -> Option<Middle> {
        let place = |index: usize| self.knots[index].places[axis];
        let rests = |index: usize| Some(Middle { position: place(index), velocity: 0.0 });
        let last = self.knots.len().checked_sub(1)?;
        let Some(index) = self.knots.iter().rposition(|knot| knot.at <= at) else { return rests(0) };
        if index == last {
            return if self.is_over { rests(last) } else { None };
        }
        let after = if index + 2 <= last {
            index + 2
        } else if self.is_over {
            last
        } else {
            return None;
        };
        let poses = [index.saturating_sub(1), index, index + 1, after].map(place);
        let tick = seconds(self.knots[index + 1].at, self.knots[index].at);
        Some(Middle::between(poses, seconds(at, self.knots[index].at) / tick, tick))
    }

    /// From the first pose behind `from` on it is a way to rest, within the limits of each axis.
    pub(super) fn brake(&mut self, limits: &[Limits], from: MonoTime) {
        if self.is_over {
            return;
        }
        self.is_over = true;
        // How it moves shows by the pose before and the one behind.
        let Some(most) = self.knots.len().checked_sub(2).filter(|index| *index > 0) else { return };
        let first = self.knots.iter().position(|knot| knot.at >= from).unwrap_or(most);
        let index = first.clamp(1, most);
        let tick = self.tick.as_secs_f64();
        let state = |axis: usize| {
            let [before, position, after] =
                [index - 1, index, index + 1].map(|index| self.knots[index].places[axis]);
            let velocity = (after - before) / (2.0 * tick);
            AxisState { position, velocity, acceleration: (after - 2.0 * position + before) / (tick * tick) }
        };
        let halt = |(axis, limits): (usize, &Limits)| {
            let from = state(axis);
            Halt::inside(from, *limits, &SHARES).unwrap_or_else(|| Halt::full(from, *limits))
        };
        let halts: Vec<Halt> = limits.iter().enumerate().map(halt).collect();
        self.knots.truncate(index + 1);
        // Where no pose reaches beyond now, what came is as late as it is.
        let late = from.since(self.knots[index].at);
        self.knots.iter_mut().for_each(|knot| knot.at = knot.at + late);
        let longest = halts.iter().map(Halt::seconds).fold(0.0, f64::max);
        // What it brakes from is executed with that: whoever is where the brake leads confirms it.
        let Knot { mut at, mut places, frame } = self.knots[index];
        let mut after = 0.0;
        while after <= longest + tick {
            (after, at) = (after + tick, at + self.tick);
            places.iter_mut().zip(&halts).for_each(|(place, halt)| *place = halt.position(after));
            self.knots.push_back(Knot { at, places, frame });
        }
    }
}

/// Seconds from one instant to a later one, negative where it is earlier.
pub(super) fn seconds(later: MonoTime, earlier: MonoTime) -> f64 {
    later.since(earlier).as_secs_f64() - earlier.since(later).as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cue::Vibration;
    use crate::drive::link::LinkPose;
    use crate::motion::MAX_AXES;

    const TICK: Duration = Duration::from_millis(10);
    const LIMITS: Limits = Limits { velocity: 1.6, acceleration: 20.0, jerk: 400.0 };

    fn pose(index: u32, origin: MonoTime, missed: u32) -> LedPose {
        let vibration = [Vibration { hz: 0.0, amplitude: 0.0 }; MAX_AXES];
        let pose = LinkPose { frame: FrameNo(index), lasts_ms: 10, axes: [0.0; MAX_AXES], vibration };
        LedPose { lane: 0, at: origin + TICK * (index + missed), pose }
    }

    fn track(count: u32, place: impl Fn(f64) -> f64) -> (Track, MonoTime) {
        let origin = MonoTime::from_nanos(1_000_000_000);
        let mut track = Track::at_rest(TICK, [place(0.0); MAX_AXES], origin);
        track.begin(origin);
        for index in 0..count {
            track.push(&pose(index, origin, 0), [place(f64::from(index) * 0.01); MAX_AXES]);
        }
        (track, origin)
    }

    #[test]
    fn a_cubic_is_met_anywhere_between_poses_and_nothing_is_said_of_what_they_do_not_reach() {
        let cubic = |t: f64| 0.2 + t * t * (2.0 - t);
        let (track, origin) = track(50, cubic);
        for us in (10_000..470_000).step_by(777) {
            let (at, t) = (origin + Duration::from_micros(us), f64::from(u32::try_from(us).unwrap()) * 1e-6);
            let Middle { position, velocity } = track.at(3, at).unwrap();
            assert!(
                (position - cubic(t)).abs() < 1e-9 && (velocity - t * (4.0 - 3.0 * t)).abs() < 1e-6,
                "{us}"
            );
        }
        assert_eq!(track.at(0, origin + TICK * 48), None);
        assert_eq!(track.at(0, origin.before(TICK)).map(|middle| middle.velocity), Some(0.0));
        assert_eq!(track.frame(origin + TICK * 7), Some(FrameNo(7)));
    }

    #[test]
    fn a_brake_rests_within_the_limits_from_whatever_it_did() {
        let (mut track, origin) = track(50, |t| 0.2 + 1.2 * t);
        let from = origin + Duration::from_millis(205);
        track.brake(&[LIMITS], from);
        let way: Vec<f64> =
            (0..60_u32).map(|step| track.at(0, from + TICK * step).unwrap().position).collect();
        let speeds: Vec<f64> = way.windows(2).map(|pair| (pair[1] - pair[0]) / 0.01).collect();
        assert!(speeds.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 20.5 * 0.01), "{speeds:?}");
        assert!(speeds[0] > 1.1 && speeds[59 - 1] == 0.0, "{speeds:?}");
        assert!(track.has_ended(from + Duration::from_secs(1)) && !track.ends_moving(1));
    }

    #[test]
    fn a_brake_where_poses_reach_no_further_begins_where_they_end() {
        let (mut track, origin) = track(20, |t| 0.2 + 1.2 * t);
        let late = origin + Duration::from_millis(400);
        track.brake(&[LIMITS], late);
        let place = track.at(0, late).unwrap().position;
        assert!((place - (0.2 + 1.2 * 0.18)).abs() < 1e-9, "{place}");
        assert!(track.has_ended(late + Duration::from_secs(1)));
    }

    #[test]
    fn ticks_that_were_missed_are_regained_by_a_hundredth_of_each() {
        let origin = MonoTime::from_nanos(1_000_000_000);
        let mut track = Track::at_rest(TICK, [0.0; MAX_AXES], origin);
        track.begin(origin);
        (0..20).for_each(|index| track.push(&pose(index, origin, 0), [0.0; MAX_AXES]));
        (20..60).for_each(|index| track.push(&pose(index, origin, 1), [0.0; MAX_AXES]));
        let last = track.knots.back().unwrap().at;
        let owed = (origin + TICK * 60).since(last);
        assert!(owed > Duration::from_millis(5) && owed < Duration::from_millis(7), "{owed:?}");
    }
}
