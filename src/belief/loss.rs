//! Where a frame leads while frames before it are not acked: no farther than a seat may go in its Time that got none of them. Such a
//! frame falls short of the pose that was asked for, or takes some ticks, and later ones close up. Tick thread; allocates nothing.

use std::time::Duration;

use super::{Belief, GAP, slots_in};
use crate::belief::span::Reach;
use crate::motion::{MAX_AXES, Pose};
use crate::time::MonoTime;

/// How much faster than its type allows a seat may go that did not get some of its frames. The rest of a quarter is for rounding.
const AFTER_LOSS: f64 = 1.22;
/// How soon a seat closes up with the poses that are asked for: long for a person, short for a ride. The measure sees 60 ms.
const CLOSES_IN: Duration = Duration::from_millis(40);
/// So close to the pose that is asked for it is there, strokes: three pulses.
const THERE: f64 = 1e-5;
/// By so much of the difference one ack moves the time that acks take here, where it came sooner than others.
const SOONER: u32 = 64;
/// Places that were led apart by just what a frame may go are not farther apart for a last bit.
const ROUNDING: f64 = 1.0 + 1e-9;
/// No frame takes more ticks than this.
const MOST_TICKS: u32 = 200;

/// How a lane is led that frames may not reach.
#[derive(Debug, Clone)]
pub(super) struct HeldBack {
    /// How far short of the pose that was asked for the last frame led, strokes; signed.
    short: Pose,
    /// Ticks that it takes.
    ticks: u32,
    /// Whether it fell short, or takes more than one.
    is: bool,
    /// How long acks take here.
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
        Self { short: [0.0; MAX_AXES], ticks: 1, is: false, acks_take: Duration::ZERO }
    }

    /// The seat is at one place, and nothing has to be closed up.
    pub(super) const fn end(&mut self) {
        (self.short, self.ticks, self.is) = ([0.0; MAX_AXES], 1, false);
    }

    /// An ack was there that long after its frame left: the slowest of about the last hundred counts.
    pub(super) fn on_ack(&mut self, took: Duration) {
        let sooner = self.acks_take.saturating_sub(took) / SOONER;
        self.acks_take = took.max(self.acks_take - sooner);
    }

    /// How much longer than else an ack may be missing: fewer frames go out that could be acked, and each is slow enough from wherever
    /// the seat may be.
    pub(super) fn longer(&self, period: Duration) -> Duration {
        GAP.min(2 * (self.ticks - 1) * period)
    }

    /// Ticks that acks take here, one at the least, and no more than make a gap.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "50 at the most")]
    fn acks_take_ticks(&self, period: Duration) -> u32 {
        let ticks = |span: Duration| span.as_secs_f64() / period.as_secs_f64();
        ticks(self.acks_take).round().min(ticks(GAP).floor()).max(1.0) as u32
    }
}

impl Belief {
    /// True if the next frame begins where the last one leads, or nobody can know better, and the seat is where it was asked to be.
    #[inline]
    #[must_use]
    pub(crate) fn is_sure(&self) -> bool {
        !self.held_back.is && (self.ack_every != 1 || self.is_led_ahead() || self.newest_is_acked())
    }

    fn newest_is_acked(&self) -> bool {
        self.spans.is_empty() || self.acked.is_some_and(|acked| self.spans.are_confirmed(acked))
    }

    /// True if only losses of the last frames are in doubt: else a frame passes as it is, or not at all.
    #[must_use]
    pub(crate) fn may_hold_back(&self, now: MonoTime) -> bool {
        self.within == self.own && self.sways == 0.0 && !self.may_be_anywhere_between(now)
    }

    /// The frame that leads a seat towards `pose`, `span_ms` being the Time of so many ticks; none where no frame is slow enough from every
    /// place at which it may begin.
    pub(crate) fn lead(&mut self, pose: &Pose, now: MonoTime, span_ms: impl Fn(u32) -> u32) -> Option<Lead> {
        let known = self.newest_is_acked();
        let reach = self.begins_at();
        let wish = self.closing_up(pose, now);
        let usual = self.held_back.acks_take_ticks(self.period);
        let factor = if known { 1.0 } else { AFTER_LOSS };
        let room = |slot: usize, lasts_ms: u32| {
            let far = self.speed[slot] * f64::from(lasts_ms) * ROUNDING;
            let (low, high, last) = (reach.low[slot], reach.high[slot], self.spans.last()[slot]);
            // A seat that got all of them keeps its limit.
            ((high - factor * far).max(last - far), (low + factor * far).min(last + far))
        };
        let fits = |&(ticks, lasts_ms): &(u32, u32)| {
            slots_in(self.own).all(|slot| {
                let (from, to) = room(slot, lasts_ms);
                from <= to && (ticks >= usual || (from..=to).contains(&wish[slot]))
            })
        };
        // From long frames to short ones the seat would make up for the difference at once.
        let least = self.held_back.ticks.min(usual);
        let (ticks, lasts_ms) = (least..=MOST_TICKS).map(|ticks| (ticks, span_ms(ticks))).find(fits)?;
        let mut to = wish;
        for slot in slots_in(self.own) {
            let (from, until) = room(slot, lasts_ms);
            to[slot] = wish[slot].max(from).min(until);
        }
        self.hold_back(pose, &mut to, ticks);
        Some(Lead { to, lasts_ms, ticks })
    }

    /// Between which places the next frame may begin.
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

    /// A pose on the way back to the one that is asked for.
    fn closing_up(&self, pose: &Pose, now: MonoTime) -> Pose {
        let since = self.open.newest_at().map_or(CLOSES_IN, |at| now.since(at));
        let left = 1.0 - (since.as_secs_f64() / CLOSES_IN.as_secs_f64()).min(1.0);
        std::array::from_fn(|slot| pose[slot] - left * self.held_back.short[slot])
    }

    fn hold_back(&mut self, pose: &Pose, to: &mut Pose, ticks: u32) {
        let short: Pose = std::array::from_fn(|slot| pose[slot] - to[slot]);
        let is_short = short.iter().any(|short| short.abs() > THERE);
        if !is_short {
            *to = *pose;
        }
        self.held_back.short = if is_short { short } else { [0.0; MAX_AXES] };
        (self.held_back.ticks, self.held_back.is) = (ticks, is_short || ticks > 1);
        self.tally.held_back += u64::from(self.held_back.is);
    }

    /// The seat is at one place, wherever frames led it.
    pub(super) fn restart_at(&mut self, pose: Pose) {
        self.spans.restart_at(pose);
        self.open.clear();
        self.held_back.end();
    }
}
