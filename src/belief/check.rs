//! What a frame is held against right before it leaves, and what is noted of it then.

use std::time::Duration;

use super::{Belief, Known, QUIET, SETTLE, Taken, slots_in};
use crate::motion::{MAX_AXES, Pose};
use crate::time::MonoTime;

impl Belief {
    /// True if a frame to `pose`, to be reached in so many milliseconds, keeps the greatest speed of every axis from wherever
    /// it may be, and its controller is not known to read frames otherwise. While acks come, an axis is where its last frame leads;
    /// [`Belief::lead`] takes into account what is acked too late, where each frame asks for an ack.
    #[must_use]
    pub(crate) fn allows(&self, pose: &Pose, lasts_ms: u32, now: MonoTime) -> bool {
        let time = f64::from(lasts_ms);
        if self.foreign {
            return false;
        }
        if self.is_quiet(now) && !self.is_fresh(now) && self.within != 0 {
            return false;
        }
        let from_all = self.may_be_anywhere_between(now);
        if !from_all && self.within == self.own && self.sways == 0.0 {
            // Nearly every frame: without a branch, on slots that the seat does not have as well, whose speed has no bound.
            let axes = pose.iter().zip(self.spans.last()).zip(&self.speed);
            return axes.fold(true, |all, ((to, from), speed)| all & ((to - from).abs() <= speed * time));
        }
        slots_in(self.own).all(|slot| self.distance(slot, pose, from_all) <= self.speed[slot] * time)
    }

    /// How far from `pose` each axis may be at the most; 0 where the seat has no such axis.
    #[must_use]
    pub(crate) fn farthest(&self, pose: &Pose, now: MonoTime) -> Pose {
        let from_all = self.may_be_anywhere_between(now);
        let mut farthest = [0.0; MAX_AXES];
        slots_in(self.own).for_each(|slot| farthest[slot] = self.distance(slot, pose, from_all));
        farthest
    }

    /// True if a seat may be at any place that its open frames lead through, not at the last alone.
    pub(super) fn may_be_anywhere_between(&self, now: MonoTime) -> bool {
        self.gap || self.is_quiet(now)
    }

    /// How far a slot may be from where `pose` has it, at the most.
    #[inline]
    fn distance(&self, slot: usize, pose: &Pose, from_all: bool) -> f64 {
        let (low, high) = if self.within >> slot & 1 == 0 {
            (0.0, 1.0)
        } else if from_all {
            self.spans.reach(slot)
        } else {
            (self.spans.last()[slot], self.spans.last()[slot])
        };
        (pose[slot] - low).abs().max((pose[slot] - high).abs()) + self.sways
    }

    /// Notes a frame that the kernel took.
    pub(crate) fn taken(&mut self, taken: &Taken<'_>) {
        let Taken { frame, asked, pose, lasts_ms, at_most_ms, shakes, at } = *taken;
        let [lasts, at_most] = [lasts_ms, at_most_ms].map(|ms| Duration::from_millis(u64::from(ms)));
        let behind = self.busy_until.since(at);
        self.tally.late += u64::from(behind > lasts.max(self.period));
        self.tally.hurried += u64::from(behind > 3 * lasts.max(self.period));
        self.busy_until = self.busy_until.max(at) + lasts;
        self.busy_at_most = self.busy_at_most.max(at) + at_most;
        self.shaking.on_frame(frame, shakes);
        // One that vibrates on does so until this frame arrives.
        self.history.push(self.spans.last(), pose, shakes.max(self.sways), (at, self.busy_until));
        // What was refused before it is missing as well, until it is acked. One of these may have been to ask: whoever took this frame has to ack
        // a later one all the sooner.
        let (since, asked_then) = self.refused.take().unwrap_or((at, false));
        self.open.push(frame, at, self.spans.last(), (pose, lasts_ms));
        self.spans.push(frame, asked || asked_then, pose, since);
        if !matches!(self.known, Known::Commanded(_)) {
            self.known = Known::Commanded(at);
        }
    }

    /// Notes that the kernel did not take a frame, and whether that was to ask for an ack.
    pub(crate) fn refused(&mut self, at: MonoTime, asked: bool) {
        let (_, one_asked) = self.refused.get_or_insert((at, false));
        *one_asked |= asked;
    }

    /// Notes that a frame was not sent.
    pub(crate) const fn withheld(&mut self) {
        self.tally.withheld += 1;
    }

    /// When the seat has executed all that the controller was sent.
    pub(super) fn executed_until(&self) -> MonoTime {
        self.busy_until + self.lead
    }

    /// Whether its seat may still be on its way to where the last frame leads: what is read until then says nothing of where it rests.
    #[must_use]
    pub(crate) fn is_under_way(&self, now: MonoTime) -> bool {
        now < self.executed_until() + SETTLE
    }

    /// Whether no frame has been under way for so long that the next is the first of a motion.
    #[must_use]
    pub(crate) fn is_quiet(&self, now: MonoTime) -> bool {
        now > self.executed_until() + QUIET.max(2 * self.period)
    }
}
