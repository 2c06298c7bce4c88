//! What is known of one controller.

use std::time::Duration;

use super::counter::{CountVerdict, PacketCounter};
use super::faults::FaultLatch;
use super::proof::{Baseline, Sighting, Traffic, Verdict};
use super::reads::Reads;
use super::replies::Replies;
use super::{Pushed, Why};
use crate::belief::Fall;
use crate::motion::Pulses;
use crate::state::Trouble;
use crate::time::MonoTime;
use crate::wire::{DPFE, FrameNo};

/// How long a sighting speaks for a controller whose group waits for the others.
const SEEN_FOR: Duration = Duration::from_secs(1);
/// A seat that falls out three times within so long is not led back and forth any more.
const UNSTEADY: Duration = Duration::from_mins(1);
/// Frames go to a controller to which one went so long ago.
const FLOWS: Duration = Duration::from_millis(500);

/// By what a controller is known again.
#[derive(Debug, Clone, Copy)]
enum KnownBy {
    /// Its position is known from homing or preflight, so that the next sighting needs no proof.
    Trusted,
    /// Nothing can prove that it has not restarted.
    Unproved,
    /// By what it counted when it was seen last.
    Seen(Baseline),
}

#[derive(Debug, Clone)]
pub(super) struct Member {
    controller: usize,
    replies: Replies,
    traffic: Traffic,
    identity: KnownBy,
    /// It has to say that it knows its zero, however it came.
    must_be_home: bool,
    /// When it was last seen as it was.
    seen: Option<MonoTime>,
    pub(super) reads: Reads,
    /// Nobody wants it to take part.
    pub(super) out: bool,
    /// It has to be homed, and why.
    pub(super) must_rehome: Option<Why>,
    /// What it says is wrong with it.
    pub(super) faults: FaultLatch,
    /// Nobody knows where its seat is, and why; or it was found elsewhere than frames left it.
    pub(super) unsure: Option<Why>,
    /// When it was sent to last before each of the last two times that nobody knew that any more.
    falls: [Option<MonoTime>; 2],
    /// The axis, from 0, that told a position outside of its stroke, and which.
    pub(super) outside: Option<(usize, Pulses)>,
    /// An axis that is pushed off where its drive holds it.
    pub(super) pushed: Option<Pushed>,
    /// Its positions make two places each.
    pub(super) ambiguous: bool,
    /// When a frame was last sent, and what the controller counts meanwhile.
    framed: Option<MonoTime>,
    counter: PacketCounter,
    /// What was sent and acked when it told its count last: frames go on while the rest of a look is on its way.
    counted: Option<Traffic>,
    /// Another master that was found, until the hall is told.
    trouble: Option<Trouble>,
}

impl Member {
    pub(super) fn new(controller: usize, interval: Duration) -> Self {
        Self {
            controller,
            replies: Replies::new(interval),
            traffic: Traffic::default(),
            identity: KnownBy::Trusted,
            must_be_home: false,
            seen: None,
            reads: Reads::default(),
            out: false,
            must_rehome: None,
            faults: FaultLatch::of(controller),
            unsure: None,
            falls: [None; 2],
            outside: None,
            pushed: None,
            ambiguous: false,
            framed: None,
            counter: PacketCounter::default(),
            counted: None,
            trouble: None,
        }
    }

    /// One of which nothing is known but how it is watched.
    pub(super) fn anew(&self) -> Self {
        let replies = Replies::new(self.replies.interval()).led_ahead(self.replies.lead());
        let Self { controller, must_be_home, out, .. } = *self;
        Self { replies, must_be_home, out, ..Self::new(controller, self.replies.interval()) }
    }

    /// Acks of what it is sent come so much later.
    pub(super) fn expect_acks_after(&mut self, lead: Duration) {
        self.replies = Replies::new(self.replies.interval()).led_ahead(lead);
    }

    pub(super) fn on_sent(&mut self, frame: FrameNo, asked: bool, at: MonoTime) {
        self.traffic.sent += 1;
        self.framed = Some(at);
        if asked {
            self.replies.on_asked(frame, at);
        }
    }

    pub(super) fn on_ack(&mut self, frame: FrameNo, at: MonoTime) {
        let Some(alive) = self.replies.on_ack(frame, at) else { return };
        self.traffic.acked += 1;
        if alive {
            self.faults.on_frame_taken();
            self.on_life(at);
        }
    }

    /// It has answered something.
    pub(super) fn on_answer(&mut self, at: MonoTime) {
        self.replies.on_answer(at);
    }

    /// A sign of life, told again at every look, is one only once.
    pub(super) fn on_life(&mut self, at: MonoTime) {
        self.replies.on_life(at);
    }

    pub(super) fn on_read_sent(&mut self, datagrams: u32) {
        self.counter.ask(self.traffic.sent);
        self.traffic.sent += u64::from(datagrams);
        self.replies.on_read_sent(self.reads.on_sent());
    }

    /// So many datagrams went out that ask for nothing of this.
    pub(super) const fn on_other_sent(&mut self, datagrams: u64) {
        self.traffic.sent += datagrams;
    }

    /// A beat was sent at `at`: with no frames going there, an answer to it is the sign of life that is waited for.
    pub(super) fn on_beat_sent(&mut self, at: MonoTime) {
        self.traffic.sent += 1;
        self.on_beat(at);
    }

    /// The same of a beat that the kernel did not take: whoever cannot be asked is as silent as who does not answer.
    pub(super) fn on_beat(&mut self, at: MonoTime) {
        if self.flows(at) {
            return;
        }
        self.replies.on_beat_sent(at);
        self.reads.on_beat_sent(self.must_be_home, at);
    }

    /// Takes a sighting. Ignores an identity reply not requested since the loss.
    pub(super) fn on_sighting(&mut self, sighting: &Sighting, at: MonoTime) {
        if !self.reads.on_sighting() {
            return;
        }
        self.on_answer(at);
        let traffic = self.counted.take().unwrap_or(self.traffic);
        if let Some(packets) = sighting.packets() {
            // A look at a time, somebody else's frames are no more than may be under way: what they add up to tells.
            self.counter.hear(packets, traffic.acked);
        }
        self.faults.on_error(sighting.error);
        self.faults.on_alarm(DPFE, sighting.alarm);
        let is_well = sighting.error == 0 && sighting.alarm == 0;
        self.faults.refusing &= !is_well;
        if let Some(why) = self.against(sighting, traffic, at) {
            self.must_home_again(why);
        } else {
            let renewed = |before: Baseline| before.renewed(sighting, traffic, at);
            let baseline = self.baseline().map_or_else(|| Baseline::of(sighting, traffic), renewed);
            self.identity = KnownBy::Seen(baseline);
            self.replies.forget_gap();
            self.seen = is_well.then_some(at);
        }
    }

    /// True if a sighting is of another controller, or of one that restarted or that somebody else leads: wherever its seat stands.
    pub(super) fn is_refuted_by(&self, sighting: &Sighting, at: MonoTime) -> bool {
        let why = self.against(sighting, self.counted.unwrap_or(self.traffic), at);
        matches!(why, Some(Why::Other(_) | Why::Rebooted(_) | Why::OtherMaster(_)))
    }

    /// It has restarted, or let go of its seat.
    pub(super) fn on_lost_zero(&mut self) {
        self.must_rehome.get_or_insert(Why::NotHome(self.controller));
    }

    /// From now on it has to say that it knows its zero.
    pub(super) const fn demand_home(&mut self) {
        self.must_be_home = true;
    }

    fn against(&self, sighting: &Sighting, traffic: Traffic, now: MonoTime) -> Option<Why> {
        let controller = self.controller;
        let verdict = match &self.identity {
            KnownBy::Seen(baseline) => baseline.judge(sighting, traffic, self.replies.has_gap(), now),
            KnownBy::Trusted => Verdict::Same,
            KnownBy::Unproved => Verdict::Unproved,
        };
        match verdict {
            Verdict::Same if self.must_be_home && !sighting.homed => Some(Why::NotHome(controller)),
            Verdict::Same => None,
            Verdict::Other => Some(Why::Other(controller)),
            Verdict::NotHome => Some(Why::NotHome(controller)),
            Verdict::Rebooted => Some(Why::Rebooted(controller)),
            Verdict::Crowded => Some(Why::OtherMaster(controller)),
            Verdict::Gap => Some(Why::Gap(controller)),
            Verdict::Unproved => Some(Why::Unproved(controller)),
        }
    }

    /// Nobody presses it any more, and only a reset ends it, which is a homing.
    pub(super) const fn on_stop_held(&mut self) {
        self.faults.on_released();
        self.must_rehome = Some(Why::HeldUntilReset(self.controller));
    }

    pub(super) fn on_emergency_stop(&mut self, pressed: bool) {
        // It was reset at its place, or is pressed anew.
        self.must_rehome.take_if(|why| matches!(why, Why::HeldUntilReset(_)));
        self.faults.on_emergency_stop(pressed);
    }

    /// True if an emergency stop is in effect that the hall waits for.
    pub(super) const fn holds(&self) -> bool {
        self.faults.pressed && !self.out
    }

    /// What the hall is to hear of it: another master that was found since the last time.
    pub(super) const fn take_trouble(&mut self) -> Option<Trouble> {
        self.trouble.take()
    }

    /// It is out until it was homed, for the first reason that there was.
    fn must_home_again(&mut self, why: Why) {
        if self.must_rehome.is_none() && matches!(why, Why::OtherMaster(_)) {
            self.trouble = Some(Trouble::OtherMaster(self.controller));
        }
        self.must_rehome.get_or_insert(why);
    }

    /// True if it was seen, and can prove by that that it has not restarted since.
    pub(super) const fn has_baseline(&self) -> bool {
        matches!(self.identity, KnownBy::Seen(_))
    }

    const fn baseline(&self) -> Option<Baseline> {
        match self.identity {
            KnownBy::Seen(baseline) => Some(baseline),
            KnownBy::Trusted | KnownBy::Unproved => None,
        }
    }

    /// Nobody knows where its frames have led it: what was seen of it is from before the last of them. `was_in` where it took part
    /// until then.
    pub(super) fn on_fell_out(&mut self, why: Fall, was_in: bool) {
        let why = match why {
            Fall::Gap => Why::Unsure(self.controller),
            Fall::Astray => Why::Astray(self.controller),
            Fall::PutBack | Fall::Stale => Why::NotSeenYet,
            Fall::Stopped => Why::CutShort(self.controller),
        };
        // One event on a link may tell several times that a seat fell out: of one that is out that is no news.
        let counts = was_in && self.unsure.is_none() && !matches!(why, Why::NotSeenYet | Why::CutShort(_));
        // That somebody moved its seat goes on to be worth a word.
        if !matches!(self.unsure, Some(Why::Moved(_))) {
            self.unsure = Some(why);
        }
        self.seen = None;
        self.reads.forget_open();
        if !counts {
            return;
        }
        let [last, before] = self.falls;
        let asked = self.replies.asked();
        self.falls = [Some(asked), last];
        if before.is_some_and(|first| asked.since(first) < UNSTEADY) {
            self.faults.latch(Why::Unsteady(self.controller));
        }
    }

    /// DPF0 was read by itself. Some seats are played without ever having been homed by it: only the loss of it tells something.
    pub(super) fn on_zero(&mut self, homed: bool) {
        let was_home = self.must_be_home || self.baseline().is_some_and(|baseline| baseline.homed());
        if was_home && !homed {
            self.must_rehome.get_or_insert(Why::NotHome(self.controller));
        }
    }

    /// Not all of its axes tell where they are.
    pub(super) fn on_unread(&mut self) {
        self.must_rehome.get_or_insert(Why::Unread(self.controller));
    }

    /// It was homed: its position is known, and what it counts from here on is the new measure.
    pub(super) fn on_homed(&mut self) {
        self.must_rehome = None;
        self.faults.on_homed();
        self.identity = KnownBy::Trusted;
        self.seen = None;
        self.replies.on_homed();
        self.counter = PacketCounter::default();
    }

    /// What was latched is over, unless it goes on.
    pub(super) fn clear(&mut self) {
        if self.faults.clear() {
            self.falls = [None; 2];
        }
    }

    pub(super) const fn on_count(&mut self, packets: u16) {
        self.on_counted();
        self.counter.hear(packets, self.traffic.acked);
    }

    pub(super) const fn on_counted(&mut self) {
        self.counted = Some(self.traffic);
    }

    pub(super) fn tick(&mut self, now: MonoTime) {
        self.replies.tick(now);
        match self.counter.judge(self.traffic.sent, now) {
            Some(CountVerdict::Crowded) => self.must_home_again(Why::OtherMaster(self.controller)),
            Some(CountVerdict::Rebooted) => self.must_home_again(Why::Rebooted(self.controller)),
            None => {}
        }
    }

    /// True if frames go there, and it is time to read its packet counter; if so, it counts as sent.
    pub(super) fn counts_now(&mut self, now: MonoTime) -> bool {
        let due = self.flows(now) && self.counter.is_turn(self.controller, now);
        if due {
            self.counter.ask(self.traffic.sent);
            self.traffic.sent += 1;
        }
        due
    }

    /// True if frames go there.
    fn flows(&self, now: MonoTime) -> bool {
        self.framed.is_some_and(|at| now.since(at) < FLOWS)
    }

    pub(super) const fn is_poor(&self) -> bool {
        self.replies.is_poor()
    }

    pub(super) fn is_silent(&self, now: MonoTime) -> bool {
        self.replies.is_silent(now)
    }

    pub(super) fn is_seen(&self, now: MonoTime) -> bool {
        self.seen.is_some_and(|at| now.since(at) <= SEEN_FOR)
    }

    /// Where it was never read, nothing can prove any more that it has not rebooted.
    pub(super) const fn distrust(&mut self) {
        if matches!(self.identity, KnownBy::Trusted) {
            self.identity = KnownBy::Unproved;
        }
    }

    /// Whatever was on its way, or was seen, does not count from here on.
    pub(super) fn forget(&mut self) {
        self.seen = None;
        self.unsure = None;
        self.reads.forget();
        // Who it is when it is back, and whether it rebooted, is for a sighting to prove.
        self.counter = self.counter.anew();
        self.replies.rest();
    }

    /// True if its packet counter has to be read, though all is well. One that has none is looked at all the time, also in a
    /// show: that it is not home any more is the only sign of a reset.
    pub(super) fn wants_baseline(&self, now: MonoTime) -> bool {
        let of_identity = match &self.identity {
            KnownBy::Trusted => true,
            KnownBy::Unproved => false,
            KnownBy::Seen(baseline) => {
                baseline.is_stale(self.traffic) || (!baseline.is_counted() && self.reads.is_old(now))
            }
        };
        self.reads.again() || of_identity
    }
}
