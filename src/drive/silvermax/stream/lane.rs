//! The axes of one seat: they begin at one instant, share a grid, and stop together.

use std::time::Duration;

use super::axis::{Axis, Kind};
use super::clock::{after, seconds};
use crate::drive::Segment;
use crate::drive::link::{LedPose, LinkPose, Stage, StreamEvent};
use crate::motion::{MAX_AXES, Pose};
use crate::time::MonoTime;
use crate::wire::FrameNo;

/// Slices whose frames are kept in mind: more than ever are on their way.
const FRAMES: usize = 64;
/// How much of each tick the grid is stretched at most to come back to when poses are to be there.
const STRETCH: f64 = 0.01;
/// A seat stands where it is led from so near, mm: as far as a loaded motor may be beside its target.
const STANDS_MM: f64 = 0.1;
/// Poses that differ by less, in strokes, stand still.
const STILL: f64 = 1e-7;

/// The axes of one seat.
#[derive(Debug)]
pub(super) struct Lane {
    pub(super) axes: Vec<Axis>,
    pub(super) stage: Stage,
    /// What register 40 of its units holds while they are home; none before it was seen.
    pub(super) canary: Option<i32>,
    /// One that is out comes back as soon as its units are seen to be home.
    pub(super) returns: bool,
    period: Duration,
    tick: Duration,
    /// When its first slice begins.
    pub(super) origin: MonoTime,
    /// Poses since then.
    poses: u32,
    /// How much later its knots are than an even grid from the origin, seconds.
    shift: f64,
    /// The first frame that is not confirmed, and the last one in each slice.
    unconfirmed: FrameNo,
    frames: [Option<FrameNo>; FRAMES],
    /// Slices that all axes have, and that were told.
    told: u32,
    /// Told last.
    pub(super) moves: bool,
    last: Option<LinkPose>,
    /// The last two poses differ.
    still_moves: bool,
    /// When the last pose came.
    heard: MonoTime,
}

impl Lane {
    pub(super) fn new(
        axes: Vec<Axis>,
        canary: Option<i32>,
        period: Duration,
        tick: Duration,
        now: MonoTime,
    ) -> Self {
        Self {
            axes,
            stage: if canary.is_some() { Stage::Readying } else { Stage::Out },
            canary,
            returns: false,
            period,
            tick,
            origin: now,
            poses: 0,
            shift: 0.0,
            unconfirmed: FrameNo::FIRST,
            frames: [None; FRAMES],
            told: 0,
            moves: true,
            last: None,
            still_moves: false,
            heard: now,
        }
    }

    /// The first axis that is farther from a pose than so many mm, and how far.
    pub(super) fn off(&self, pose: &LinkPose, most_mm: f64) -> Option<(usize, f64)> {
        let off = self.axes.iter().zip(pose.axes).map(|(axis, place)| {
            let scale = axis.terms.scale;
            scale.mm(scale.at(place) - axis.course.position()).abs()
        });
        // What is no number is nowhere near.
        off.enumerate().find(|(_, off)| off.is_nan() || *off > most_mm)
    }

    /// True if it stands where a pose leads, which goes on nowhere.
    pub(super) fn stands_at(&self, pose: &LinkPose) -> bool {
        !self.moves_to(pose) && self.off(pose, STANDS_MM).is_none()
    }

    /// True if a pose leads elsewhere than the one before it, or vibrates.
    fn moves_to(&self, pose: &LinkPose) -> bool {
        let differs = |last: LinkPose| {
            let pairs = last.axes.iter().zip(pose.axes).take(self.axes.len());
            pairs.into_iter().any(|(a, b)| (a - b).abs() > STILL)
        };
        self.last.is_some_and(differs) || pose.vibration.iter().any(|swing| swing.amplitude > 0.0)
    }

    /// Hears a pose that leads it nowhere.
    pub(super) const fn hear(&mut self, pose: LinkPose, now: MonoTime) {
        (self.last, self.heard) = (Some(pose), now);
    }

    /// True if a pose that comes now is the first of a motion: one that was cut off while it moved is over before another begins.
    pub(super) fn may_begin(&self, now: MonoTime) -> bool {
        self.is_left_alone(now) || self.last.is_some_and(|last| self.off(&last, STANDS_MM).is_none())
    }

    /// Whether its units are home, once all have told: they hold the one number that homing wrote.
    pub(super) fn is_home(&self) -> Option<bool> {
        let mut told = self.axes.iter().map(|axis| axis.canary);
        let first = told.next()??;
        let mut is_home = first != 0 && self.canary.is_none_or(|canary| canary == first);
        for canary in told {
            is_home &= canary? == first;
        }
        Some(is_home)
    }

    /// All axes rest until the first pose is to be there, or later where that is too soon.
    pub(super) fn begin(&mut self, pose: &LedPose, soonest: MonoTime) {
        self.origin = pose.at.max(soonest);
        (self.poses, self.shift, self.told, self.stage) = (0, 0.0, 0, Stage::Runs);
        (self.last, self.still_moves, self.moves) = (None, false, false);
        self.unconfirmed = pose.pose.frame;
        for axis in &mut self.axes {
            let place = axis.last().position;
            axis.make(Segment::resting(1, place), Kind::Start);
        }
    }

    /// Takes the next pose. Poses go on in stream time, one tick after the other: where ticks were missed, and `at` leaps, what was
    /// ahead shrinks by that, and the grid is stretched by up to 1 % until it is regained.
    pub(super) fn push(&mut self, led: LedPose, now: MonoTime) {
        let stream = f64::from(self.poses) * self.tick.as_secs_f64();
        let slice = whole(stream / self.period.as_secs_f64());
        let LedPose { at, pose, .. } = led;
        self.frames[slice % FRAMES] = Some(pose.frame);
        let wanted = seconds(at, self.origin) - stream;
        let most = STRETCH * self.tick.as_secs_f64();
        self.shift += (wanted - self.shift).clamp(-most, most);
        self.poses += 1;
        self.still_moves = self.moves_to(&pose);
        self.hear(pose, now);
        self.feed(&pose);
    }

    fn feed(&mut self, pose: &LinkPose) {
        let (origin, period, shift) = (self.origin, self.period.as_secs_f64(), self.shift);
        let knot = |index: u32| after(origin, f64::from(index) * period + shift);
        for ((axis, place), swing) in self.axes.iter_mut().zip(pose.axes).zip(pose.vibration) {
            axis.push(place, swing, knot);
        }
    }

    /// True if no pose came for so long that none will.
    pub(super) fn is_left_alone(&self, now: MonoTime) -> bool {
        let lasts = self.last.map_or(self.tick, |pose| Duration::from_millis(pose.lasts_ms.into()));
        now.since(self.heard) > (3 * lasts).max(self.period)
    }

    /// The poses have ended: what is still to be made of them, up to rest. False where they ended in motion.
    pub(super) fn end(&mut self) -> bool {
        let Some(last) = self.last.filter(|_| !self.still_moves) else { return false };
        // What was fitted is two slices and a half behind the poses.
        let ticks = whole(4.0 * self.period.as_secs_f64() / self.tick.as_secs_f64()) + 4;
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
    pub(super) fn confirm(&mut self, lane: u16, mut tell: impl FnMut(StreamEvent)) {
        let confirmed = self.axes.iter().map(|axis| axis.confirmed).min().unwrap_or(0);
        let told = self.told;
        self.told = confirmed.max(told);
        let newest = (told..confirmed).rev().find_map(|slice| self.frames[slice as usize % FRAMES].take());
        if let Some(last) = newest {
            let first = std::mem::replace(&mut self.unconfirmed, last.next());
            tell(StreamEvent::Confirmed { lane, first, last });
        }
        let moves = self.axes.iter().any(Axis::ends_moving);
        if confirmed > told && moves != self.moves {
            self.moves = moves;
            let ends = self.axes.iter().map(Axis::ends).max().unwrap_or(self.origin);
            tell(if moves {
                StreamEvent::Moves { lane, at: after(ends, -self.period.as_secs_f64()) }
            } else {
                StreamEvent::Rests { lane, axes: self.places(), at: ends }
            });
        }
    }

    /// Where it is behind all that is queued, in strokes.
    pub(super) fn places(&self) -> Pose {
        let mut places = [0.0; MAX_AXES];
        for (place, axis) in places.iter_mut().zip(&self.axes) {
            *place = axis.terms.scale.fraction(axis.course.position());
        }
        places
    }

    /// True if an axis has nothing left to execute, and is still to move or rest on.
    pub(super) fn is_dry(&self, now: MonoTime) -> bool {
        self.axes.iter().any(|axis| axis.has_started() && !axis.has_ended() && axis.ends() < now)
    }

    /// True if the first slice begins, and an axis has not begun.
    pub(super) fn is_late(&self, now: MonoTime) -> bool {
        now > self.origin && !self.axes.iter().all(Axis::has_started)
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a film is some 1e6 slices")]
fn whole(slices: f64) -> usize {
    slices.max(0.0) as usize
}
