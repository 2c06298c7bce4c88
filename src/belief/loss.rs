//! Frames after one whose ack is overdue. They lead no farther than a seat may go in their Time that got none of the open ones: a frame
//! takes several ticks and aims at the pose of their end; if even that is too fast, the seat brakes, and later frames close up.
//! Tick thread; allocates nothing.

use std::time::Duration;

use super::span::Reach;
use super::{Belief, GAP, GAP_UNTOLD, slots_in};
use crate::motion::Pose;
use crate::time::MonoTime;

/// The speed of a seat that did not get some of its frames, over its greatest. The rest of a quarter is for rounding.
const AFTER_LOSS: f64 = 1.22;
/// The distance of poses from which the measure takes acceleration: a straight line no longer than this does not show, and a step of
/// speed between two longer ones shows as if it took this long.
const SIGHT_S: f64 = 0.020;
/// Longer a frame does not take, ms.
const LONGEST_MS: u32 = 400;
/// Parts of the greatest acceleration: for braking, and for closing up with the poses that are asked for.
const BRAKE_SHARE: f64 = 0.9;
const CLOSE_SHARE: f64 = 0.85;
/// The part of it that ends the closing up, and the least time of its end, seconds.
const END_SHARE: f64 = 0.7;
const CLOSES_IN_S: f64 = 0.060;
/// The step of speed from one frame to the next that a proved motion may have, as a part of what the greatest acceleration makes.
const PROVED_SHARE: f64 = 1.1;
/// A seat this close to the pose that is asked for is there, strokes: three pulses.
const THERE: f64 = 1e-5;
/// One ack moves the usual time of acks by this part of the difference, if it came later, and if it came sooner: a delay of one ack in
/// thirty is usual.
const LATER: u32 = 2;
const SOONER: u32 = 64;
/// Acks that take no longer are never waited for: a frame that covers an open time of 4 ms takes 18 ms at the greatest speed.
const PROMPT: Duration = Duration::from_millis(4);
/// The ack thread is held up if its word is older than this, or than a period if that is shorter.
const TOLD_WITHIN: Duration = Duration::from_millis(5);
/// Frames of several ticks are fewer, and fewer can be acked: an ack may be missing for up to this much longer.
const LONGER: Duration = Duration::from_millis(100);
/// What of the way that a frame may go is gone: a place that is just so far away would be farther by a last bit.
const JUST: f64 = 1.0 - 1e-9;
/// A last bit of a place, strokes.
const ROUNDING: f64 = 1e-12;

/// The motion that is asked of a lane: the pose of the tick before, and pose, velocity and acceleration of this one; strokes and seconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish {
    pub(crate) before: Pose,
    pub(crate) pose: Pose,
    pub(crate) velocity: Pose,
    pub(crate) acceleration: Pose,
}

impl Wish {
    /// Where a slot is to be so many seconds after this tick's pose.
    fn after(&self, slot: usize, seconds: f64) -> f64 {
        let speed = self.velocity[slot] + 0.5 * self.acceleration[slot] * seconds;
        // The pose itself may be a last bit beyond the stroke.
        if seconds > 0.0 { (self.pose[slot] + speed * seconds).clamp(0.0, 1.0) } else { self.pose[slot] }
    }
}

/// The state of a lane whose frames may not arrive.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeldBack {
    /// Its last frame took several ticks, or led elsewhere than was asked for.
    is: bool,
    /// The usual time of acks here.
    acks_take: Duration,
}

/// A frame that is held back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lead {
    /// Where it leads.
    pub(crate) to: Pose,
    /// Its Time, and the ticks that it takes, the one in which it is sent included.
    pub(crate) lasts_ms: u32,
    pub(crate) ticks: u32,
}

impl HeldBack {
    pub(super) const fn not() -> Self {
        Self { is: false, acks_take: Duration::ZERO }
    }

    /// An ack was there that long after its frame left.
    fn on_ack(&mut self, took: Duration) {
        let sooner = self.acks_take.saturating_sub(took) / SOONER;
        self.acks_take = self.acks_take + took.saturating_sub(self.acks_take) / LATER - sooner;
    }
}

/// All that one frame is planned from.
struct Plan<'a> {
    belief: &'a Belief,
    wish: &'a Wish,
    reach: Reach,
    factor: f64,
    /// The speed of the frame before, and its Time in seconds.
    before: (Pose, f64),
}

impl Plan<'_> {
    fn last(&self, slot: usize) -> f64 {
        self.belief.spans.last()[slot]
    }

    /// The step of speed to a line of so many seconds, at such a share of the greatest acceleration.
    fn step(&self, slot: usize, seconds: f64, share: f64) -> f64 {
        share * self.belief.acceleration[slot] * (self.before.1.min(SIGHT_S) + seconds.min(SIGHT_S)) / 2.0
    }

    /// The end of a frame that leads on, so many seconds after this tick's pose.
    fn ideal(&self, slot: usize, seconds: f64, after: f64) -> f64 {
        let (wish, last, speed) = (self.wish.after(slot, after), self.last(slot), self.before.0[slot]);
        let behind = self.wish.before[slot] - last;
        let smooth = self.step(slot, seconds, PROVED_SHARE);
        // A seat that only crosses its course is not there yet.
        if behind.abs() <= THERE && ((wish - last) / seconds - speed).abs() <= smooth {
            return wish;
        }
        let ends = (2.0 * END_SHARE * self.belief.acceleration[slot] * behind.abs()).sqrt();
        let closes = ends.min(behind.abs() / CLOSES_IN_S.max(seconds)).copysign(behind);
        let pace = (wish - self.wish.before[slot]) / seconds + closes;
        let step = self.step(slot, seconds, CLOSE_SHARE);
        (last + pace.max(speed - step).min(speed + step) * seconds).clamp(0.0, 1.0)
    }

    /// The end of one that brakes.
    fn braking(&self, slot: usize, seconds: f64) -> f64 {
        let speed = self.before.0[slot];
        let slower = (speed.abs() - self.step(slot, seconds, BRAKE_SHARE)).max(0.0);
        (self.last(slot) + slower.copysign(speed) * seconds).clamp(0.0, 1.0)
    }

    /// The places to which a frame of that Time may lead.
    fn room(&self, slot: usize, lasts_ms: u32) -> (f64, f64) {
        let far = JUST * self.belief.speed[slot] * f64::from(lasts_ms);
        let (low, high, last) = (self.reach.low[slot], self.reach.high[slot], self.last(slot));
        // A seat that got all of them keeps its limit.
        ((high - self.factor * far).max(last - far), (low + self.factor * far).min(last + far))
    }

    fn fits(&self, lasts_ms: u32, place: impl Fn(usize) -> f64) -> bool {
        slots_in(self.belief.own).all(|slot| {
            let (from, to) = self.room(slot, lasts_ms);
            (from - ROUNDING..=to + ROUNDING).contains(&place(slot))
        })
    }

    /// Ticks and Time of the frame: the shortest that may lead on, up to what does not show, or else the shortest that brakes.
    fn time(&self, longest_ms: u32, span_ms: &impl Fn(u32) -> u32) -> Option<(u32, u32)> {
        let tick_ms = span_ms(1);
        let after = |lasts_ms: u32| f64::from(lasts_ms - tick_ms) * 1e-3;
        let seconds = |lasts_ms: u32| f64::from(lasts_ms) * 1e-3;
        let timed = |ticks: u32| (ticks, span_ms(ticks));
        let mut straight = (1..=LONGEST_MS).map(timed).take_while(|&(ticks, lasts_ms)| {
            ticks == 1 || (seconds(lasts_ms) <= SIGHT_S && lasts_ms <= longest_ms)
        });
        let leads = |&(_, lasts_ms): &(u32, u32)| {
            self.fits(lasts_ms, |slot| self.ideal(slot, seconds(lasts_ms), after(lasts_ms)))
        };
        straight.find(leads).or_else(|| {
            let longer = std::iter::successors(Some(1), |ticks: &u32| Some(ticks + (ticks / 8).max(1)));
            let mut braking = longer
                .map(timed)
                .take_while(|(ticks, lasts_ms)| *ticks == 1 || *lasts_ms <= longest_ms.min(LONGEST_MS));
            braking.find(|&(_, lasts_ms)| self.fits(lasts_ms, |slot| self.braking(slot, seconds(lasts_ms))))
        })
    }

    /// The frame of that Time.
    fn frame(&self, (ticks, lasts_ms): (u32, u32), tick_ms: u32) -> Lead {
        let after = f64::from(lasts_ms - tick_ms) * 1e-3;
        let mut to = self.wish.pose;
        for slot in slots_in(self.belief.own) {
            let (from, until) = self.room(slot, lasts_ms);
            to[slot] = self.ideal(slot, f64::from(lasts_ms) * 1e-3, after).max(from).min(until);
        }
        Lead { to, lasts_ms, ticks }
    }
}

impl Belief {
    /// True if the next frame begins where the last one leads, as far as anybody can know by now, and the seat is where it was asked to be.
    #[inline]
    #[must_use]
    pub(crate) fn is_sure(&self) -> bool {
        !self.held_back.is && (self.ack_every != 1 || self.newest_is_acked() || !self.is_late())
    }

    fn newest_is_acked(&self) -> bool {
        self.spans.is_empty() || self.acked.is_some_and(|acked| self.spans.are_confirmed(acked))
    }

    /// True if an ack is overdue, by the last word of the ack thread: it has not come, rather than not been read. Of slow acks the next one
    /// is waited for: it tells that a single frame was lost. The way of an open frame of several ticks is never made up for in one.
    fn is_late(&self) -> bool {
        let takes = self.held_back.acks_take;
        let is_prompt = takes <= PROMPT.max(self.period);
        let overdue = if is_prompt { self.period } else { takes + takes / 2 };
        let is_told = self.untold <= self.period.min(TOLD_WITHIN);
        let is_over = |since| self.told.since(since) + self.period * 3 / 4 >= overdue;
        (is_told && self.open.open_since(self.acked).is_some_and(is_over)) || !self.gap_is_longer().is_zero()
    }

    /// True if only losses of the last frames are in doubt: else a frame passes as it is, or not at all.
    #[must_use]
    pub(crate) fn may_hold_back(&self, now: MonoTime) -> bool {
        let is_led = self.within == self.own && self.sways == 0.0 && !self.is_led_ahead();
        is_led && !self.may_be_anywhere_between(now)
    }

    /// An ack came, of a frame that is kept: how long acks take here is known from that.
    pub(super) fn time_ack(&mut self, now: MonoTime) {
        let sent = self.acked.and_then(|acked| self.open.sent_at(acked));
        sent.into_iter().for_each(|at| self.held_back.on_ack(now.since(at)));
    }

    /// That the ack thread is slow is no gap at first: what an ack may still be read for is not missing.
    pub(super) fn has_gap(&self, told: MonoTime, now: MonoTime) -> bool {
        let refused = self.refused.is_some_and(|(since, _)| now.since(since) > GAP);
        let is_missed =
            |since, later| told.since(since) > GAP + later || now.since(since) > GAP_UNTOLD + later;
        let is_overdue = |since| {
            let later = self.acked_after;
            is_missed(since, later) && is_missed(since, later + self.gap_is_longer())
        };
        let unheard = || self.spans.waiting_since(self.acked, self.period).is_some_and(is_overdue);
        refused || (self.asks() && unheard())
    }

    /// The time by which an ack may be missing longer than usual before it is a gap: fewer frames leave that could be acked, each slow
    /// enough from every place at which the seat may be.
    fn gap_is_longer(&self) -> Duration {
        self.open.longer(self.acked, self.period).min(LONGER)
    }

    /// The next frame of a lane, `span_ms` being the Time of so many ticks, and `longest_ms` the longest that its controller executes; none
    /// if no frame is slow enough from every place at which it may begin.
    pub(crate) fn lead(
        &mut self,
        wish: &Wish,
        longest_ms: u32,
        span_ms: impl Fn(u32) -> u32,
    ) -> Option<Lead> {
        let late = !self.newest_is_acked() && self.is_late();
        let reach = if late { self.begins_at() } else { Reach::at(*self.spans.last()) };
        let factor = if late { AFTER_LOSS } else { 1.0 };
        let plan = Plan { belief: self, wish, reach, factor, before: self.open.last_move() };
        let mut lead = plan.frame(plan.time(longest_ms, &span_ms)?, span_ms(1));
        let is_there = slots_in(self.own).all(|slot| {
            let seconds = f64::from(lead.lasts_ms) * 1e-3;
            let speed = (lead.to[slot] - self.spans.last()[slot]) / seconds;
            let smooth = PROVED_SHARE * self.acceleration[slot] * seconds;
            let is_as_fast = (wish.velocity[slot] - speed).abs() <= smooth;
            (wish.pose[slot] - lead.to[slot]).abs() <= THERE && is_as_fast
        });
        self.held_back.is = lead.ticks > 1 || !is_there;
        if !self.held_back.is {
            lead.to = wish.pose;
        }
        self.tally.held_back += u64::from(self.held_back.is);
        Some(lead)
    }

    /// The places at which the next frame may begin.
    fn begins_at(&self) -> Reach {
        let of_spans = || {
            let mut reach = Reach::at(*self.spans.last());
            slots_in(self.own).for_each(|slot| {
                (reach.low[slot], reach.high[slot]) = self.spans.reach(slot);
            });
            reach
        };
        self.open.reach(self.acked).unwrap_or_else(of_spans)
    }

    /// The place to which frames have led a seat that was held back, and its speed, strokes a second; none if it is where it was asked to be.
    pub(crate) fn led_elsewhere(&self) -> Option<(Pose, Pose)> {
        self.held_back.is.then(|| (*self.spans.last(), self.open.last_move().0))
    }

    /// The seat is at one place, wherever frames led it.
    pub(super) fn restart_at(&mut self, pose: Pose) {
        self.spans.restart_at(pose);
        self.open.clear();
        self.held_back.is = false;
    }
}
