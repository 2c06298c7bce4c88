//! The axes of one seat: they begin at one instant, share a grid, and stop together.

use super::SilverMax;
use super::axis::{Axis, Kind};
use super::clock::{after, seconds};
use crate::drive::Segment;
use crate::drive::link::{LedLane, LedPose, LinkPose, STANDS_MM, Stage, StreamEvent};
use crate::drive::silvermax::set_up::HALF;
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// Slices whose frames are kept in mind: more than ever are on their way.
const FRAMES: usize = 64;
/// How much of each tick the grid is stretched at most to come back to when poses are to be there.
const STRETCH: f64 = 0.01;

/// The axes of one seat on SilverMax units.
pub(super) type SilverLane = LedLane<SilverMax>;

/// What such a lane is beside its axes and stage.
#[derive(Debug)]
pub(crate) struct LaneState {
    /// What register 40 of its units holds while they are home; none before it was seen.
    pub(super) canary: Option<i32>,
    /// What a canary of homing with its settings has in its lower half.
    sum: i32,
    /// One that is out comes back as soon as its units are seen to be home.
    pub(super) returns: bool,
    /// When its first slice begins.
    pub(super) origin: MonoTime,
    /// Poses since then.
    poses: u32,
    /// How much later its knots are than an even grid from the origin, seconds.
    shift: f64,
    /// The last frame in each slice.
    frames: [Option<FrameNo>; FRAMES],
    /// Slices that all axes have, and that were told.
    told: u32,
    /// The last two poses differ.
    still_moves: bool,
}

impl LaneState {
    pub(super) const fn new(sum: i32, now: MonoTime) -> Self {
        Self {
            canary: None,
            sum,
            returns: false,
            origin: now,
            poses: 0,
            shift: 0.0,
            frames: [None; FRAMES],
            told: 0,
            still_moves: false,
        }
    }
}

impl SilverLane {
    /// True if it stands where a pose leads, which goes on nowhere.
    pub(super) fn stands_at(&self, pose: &LinkPose) -> bool {
        !self.moves_to(pose) && self.off(pose, STANDS_MM).is_none()
    }

    /// True if a pose leads elsewhere than the one before it, or vibrates.
    fn moves_to(&self, pose: &LinkPose) -> bool {
        self.leads_on(pose) || pose.vibration.iter().any(|swing| swing.amplitude > 0.0)
    }

    /// Whether its units are home, once all have told: they hold the one number that homing wrote.
    pub(super) fn is_home(&self) -> Option<bool> {
        let mut told = self.axes.iter().map(|axis| axis.canary);
        let first = told.next()??;
        let mut is_home = first != 0
            && first & HALF == self.own.sum
            && self.own.canary.is_none_or(|canary| canary == first);
        for canary in told {
            is_home &= canary? == first;
        }
        Some(is_home)
    }

    /// All axes rest until then, when the first pose is to be there.
    pub(super) fn rest_until(&mut self, origin: MonoTime) {
        let own = &mut self.own;
        (own.origin, own.poses, own.shift, own.told, own.still_moves) = (origin, 0, 0.0, 0, false);
        for axis in &mut self.axes {
            let place = axis.last().position;
            axis.make(Segment::resting(1, place), Kind::Start);
        }
    }

    /// Takes the next pose. Poses go on in stream time, one tick after the other: where ticks were missed, and `at` leaps, what was
    /// ahead shrinks by that, and the grid is stretched by up to 1 % until it is regained.
    pub(super) fn push(&mut self, led: &LedPose) {
        let stream = f64::from(self.own.poses) * self.terms.tick.as_secs_f64();
        let slice = whole(stream / self.terms.period.as_secs_f64());
        let LedPose { at, pose, .. } = *led;
        self.own.frames[slice % FRAMES] = Some(pose.frame);
        let wanted = seconds(at, self.own.origin) - stream;
        let most = STRETCH * self.terms.tick.as_secs_f64();
        self.own.shift += (wanted - self.own.shift).clamp(-most, most);
        self.own.poses += 1;
        self.own.still_moves = self.moves_to(&pose);
        self.feed(&pose);
    }

    fn feed(&mut self, pose: &LinkPose) {
        let (origin, period, shift) = (self.own.origin, self.terms.period.as_secs_f64(), self.own.shift);
        let knot = |index: u32| after(origin, f64::from(index) * period + shift);
        for ((axis, place), swing) in self.axes.iter_mut().zip(pose.axes).zip(pose.vibration) {
            axis.push(place, swing, knot);
        }
    }

    /// The poses have ended: what is still to be made of them, up to rest. False where they ended in motion.
    pub(super) fn end(&mut self) -> bool {
        let Some(last) = self.last.filter(|_| !self.own.still_moves) else { return false };
        // What was fitted is two slices and a half behind the poses.
        let ticks = whole(4.0 * self.terms.period.as_secs_f64() / self.terms.tick.as_secs_f64()) + 4;
        (0..ticks).for_each(|_| self.feed(&last));
        if !self.axes.iter().all(Axis::fit_rests) {
            return false;
        }
        for axis in &mut self.axes {
            let last = axis.last();
            axis.make(last, Kind::Last);
        }
        self.stage = Stage::Ends;
        true
    }

    /// What all axes have taken since it was told.
    pub(super) fn confirm(&mut self, lane: u16) -> [Option<StreamEvent>; 2] {
        let confirmed = self.axes.iter().map(|axis| axis.confirmed).min().unwrap_or(0);
        let told = self.own.told;
        self.own.told = confirmed.max(told);
        let newest =
            (told..confirmed).rev().find_map(|slice| self.own.frames[slice as usize % FRAMES].take());
        let confirms = newest.map(|last| {
            let first = std::mem::replace(&mut self.unconfirmed, last.next());
            StreamEvent::Confirmed { lane, first, last }
        });
        let moves = self.axes.iter().any(Axis::ends_moving);
        let turns = (confirmed > told && moves != self.moves).then(|| {
            self.moves = moves;
            let ends = self.axes.iter().map(Axis::ends).max().unwrap_or(self.own.origin);
            if moves {
                StreamEvent::Moves { lane, at: after(ends, -self.terms.period.as_secs_f64()) }
            } else {
                StreamEvent::Rests { lane, axes: self.places(), at: ends }
            }
        });
        [confirms, turns]
    }

    /// True if an axis has nothing left to execute, and is still to move or rest on.
    pub(super) fn is_dry(&self, now: MonoTime) -> bool {
        self.axes.iter().any(|axis| axis.has_started() && !axis.has_ended() && axis.ends() < now)
    }

    /// True if the first slice begins, and an axis has not begun.
    pub(super) fn is_late(&self, now: MonoTime) -> bool {
        now > self.own.origin && !self.axes.iter().all(Axis::has_started)
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a film is some 1e6 slices")]
fn whole(slices: f64) -> usize {
    slices.max(0.0) as usize
}
