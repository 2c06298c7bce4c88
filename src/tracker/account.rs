//! The books of one controller.

use crate::time::MonoTime;
use crate::wire::{FrameNo, ReplyCode};

use super::in_flight::{FrameEntry, FrameState, KEPT, NumberPlace, Ring};
use super::{ACK_TIMEOUT, Counts, Fate, Histogram, histogram};

/// Fewer frames that asked than these do not tell whether a controller is lost.
const LAST_ASKED: u32 = 10;

#[derive(Debug)]
pub(super) struct Account {
    ring: Ring,
    /// Every frame before this one has met its fate.
    oldest_open: FrameNo,
    /// Time of the newest record.
    recorded_at: MonoTime,
    /// A reply is asked for in each of so many frames; 0 in none.
    ack_every: u32,
    /// Frames so far that wanted a reply, taken by the kernel or not, round after 4,294,967,295.
    wanted: u32,
    pub(super) counts: Counts,
    pub(super) latency: Histogram,
    pub(super) last_ack: Option<(FrameNo, MonoTime)>,
    /// The entry of that frame.
    last_acked: Option<FrameEntry>,
}

impl Account {
    pub(super) fn new(first: FrameNo, ack_every: u32) -> Self {
        Self {
            ring: Ring::new(first),
            oldest_open: first,
            recorded_at: MonoTime::default(),
            ack_every,
            wanted: 0,
            counts: Counts::default(),
            latency: histogram(),
            last_ack: None,
            last_acked: None,
        }
    }

    pub(super) fn begin_at(&mut self, first: FrameNo) {
        *self = Self::new(first, self.ack_every);
    }

    pub(super) fn recorded(&self, frame: FrameNo) -> bool {
        self.ring.ahead(frame) == 0
    }

    /// Whether a frame waits for its reply of which it is known when it was sent.
    pub(super) fn is_timed(&self, frame: FrameNo) -> bool {
        matches!(self.ring.find(frame), NumberPlace::Kept(index) if self.ring.get(index).state == FrameState::InFlight)
    }

    /// When a frame was sent, at the latest; `None` where it is not remembered.
    pub(super) fn sent_at(&self, frame: FrameNo) -> Option<MonoTime> {
        match self.ring.find(frame) {
            NumberPlace::Kept(index) => Some(self.ring.get(index).at),
            _ => None,
        }
    }

    pub(super) fn on_sent(&mut self, frame: FrameNo, asked: bool, at: MonoTime) {
        let Some(unrecorded) = self.ring.ahead(frame).checked_sub(1) else { return };
        self.recorded_at = at;
        self.record_unrecorded(unrecorded);
        self.record(if asked { FrameState::InFlight } else { FrameState::Unasked });
    }

    pub(super) fn on_send_failed(&mut self, frame: FrameNo) {
        self.record_unrecorded(self.ring.ahead(frame));
        let NumberPlace::Kept(index) = self.ring.find(frame) else { return };
        let entry = self.ring.get_mut(index);
        match entry.state {
            FrameState::Acked | FrameState::Refused | FrameState::Withdrawn | FrameState::Failed => return,
            FrameState::Unasked => {}
            FrameState::InFlight | FrameState::InFlightUntimed => self.counts.asked -= 1,
            FrameState::Lost => {
                self.counts.asked -= 1;
                self.counts.lost -= 1;
            }
        }
        entry.state = FrameState::Failed;
        self.counts.sent -= 1;
        self.counts.send_failed += 1;
    }

    /// No frame has the numbers before `next` that are not on record.
    pub(super) fn on_skipped(&mut self, next: FrameNo) {
        let count = self.ring.ahead(FrameNo(next.0.wrapping_sub(1)));
        let forgotten = count.saturating_sub(KEPT);
        if forgotten > 0 {
            // As in `record_unrecorded`: the rest takes the place of every frame remembered now.
            self.ring.skip(forgotten);
            self.oldest_open = self.ring.next();
        }
        let (at, wanted) = (self.recorded_at, self.wanted);
        for _ in forgotten..count {
            let before = self.ring.push(FrameEntry { state: FrameState::Failed, at, wanted });
            self.counts.lost += u64::from(before.state.open());
        }
    }

    pub(super) fn on_last(&mut self, last: FrameNo, at: MonoTime) {
        if !self.recorded(last) {
            self.recorded_at = at;
            self.record_unrecorded(self.ring.ahead(last));
        }
    }

    /// `latencies` takes the latency of an ack beside the account's own histogram.
    pub(super) fn on_reply(
        &mut self,
        frame: FrameNo,
        code: ReplyCode,
        at: MonoTime,
        latencies: &mut Histogram,
    ) -> Fate {
        let fate = match self.ring.find(frame) {
            NumberPlace::Never => Fate::Stray,
            NumberPlace::Forgotten => Fate::Stale,
            NumberPlace::Kept(index) => match self.ring.get(index).state {
                FrameState::Unasked | FrameState::Failed => Fate::Stray,
                FrameState::Acked | FrameState::Refused => Fate::Duplicate,
                FrameState::Lost | FrameState::Withdrawn => Fate::Stale,
                FrameState::InFlight | FrameState::InFlightUntimed => {
                    self.settle(index, frame, code, at, latencies)
                }
            },
        };
        self.counts.add_reply(fate);
        fate
    }

    /// Ends the flight of a frame by its first reply.
    fn settle(
        &mut self,
        index: usize,
        frame: FrameNo,
        code: ReplyCode,
        at: MonoTime,
        latencies: &mut Histogram,
    ) -> Fate {
        let entry = self.ring.get_mut(index);
        let latency = at.since(entry.at);
        if latency > ACK_TIMEOUT {
            entry.state = FrameState::Lost;
            self.counts.lost += 1;
            return Fate::Stale;
        }
        let timed = entry.state == FrameState::InFlight;
        entry.state = if code.refused() { FrameState::Refused } else { FrameState::Acked };
        if !code.refused() {
            if timed {
                let ns = crate::time::nanos(latency);
                self.latency.saturating_record(ns);
                latencies.saturating_record(ns);
            }
            if self.last_ack.is_none_or(|(last, _)| frame.since(last) > 0) {
                self.last_ack = Some((frame, at));
                self.last_acked = Some(*entry);
            }
        }
        Fate::Answered(code)
    }

    pub(super) fn withdraw(&mut self, first: FrameNo, last: FrameNo) {
        let next = |frame: &FrameNo| (frame.since(last) < 0).then(|| frame.next());
        for frame in std::iter::successors(Some(first), next).take(KEPT as usize) {
            let NumberPlace::Kept(index) = self.ring.find(frame) else { continue };
            let entry = self.ring.get_mut(index);
            if entry.state.open() {
                entry.state = FrameState::Withdrawn;
                self.counts.withdrawn += 1;
            }
        }
    }

    pub(super) fn expire(&mut self, now: MonoTime) {
        self.give_up(|sent_at| now.since(sent_at) > ACK_TIMEOUT);
    }

    pub(super) fn finish(&mut self) {
        self.give_up(|_| true);
    }

    /// Frames are on record in the order of their times, so the first one in flight that is not given up ends the walk.
    fn give_up(&mut self, too_old: impl Fn(MonoTime) -> bool) {
        while self.recorded(self.oldest_open) {
            if let NumberPlace::Kept(index) = self.ring.find(self.oldest_open) {
                let entry = self.ring.get_mut(index);
                if entry.state.open() {
                    if !too_old(entry.at) {
                        return;
                    }
                    entry.state = FrameState::Lost;
                    self.counts.lost += 1;
                }
            }
            self.oldest_open = self.oldest_open.next();
        }
    }

    pub(super) fn lost_at_end(&self) -> bool {
        // At a low rate of asking the last ten are far older than what the ring remembers.
        self.last_acked.map_or(self.wanted > 0, |acked| {
            self.wanted.wrapping_sub(acked.wanted) >= LAST_ASKED
                && self.recorded_at.since(acked.at) > ACK_TIMEOUT
        })
    }

    /// Takes frames on record that should have been, but of which no record came.
    fn record_unrecorded(&mut self, count: u32) {
        let forgotten = count.saturating_sub(KEPT);
        if forgotten > 0 {
            // Lost already, as is all before them: the rest will take the place of every frame remembered now.
            let asked = self.ring.next().asking(forgotten, self.ack_every);
            self.ring.skip(forgotten);
            self.oldest_open = self.ring.next();
            self.counts.sent += u64::from(forgotten);
            self.counts.asked += u64::from(asked);
            self.counts.lost += u64::from(asked);
            self.wanted = self.wanted.wrapping_add(asked);
        }
        for _ in forgotten..count {
            let asked = self.ring.next().asks(self.ack_every);
            self.record(if asked { FrameState::InFlightUntimed } else { FrameState::Unasked });
        }
    }

    fn record(&mut self, state: FrameState) {
        self.counts.sent += 1;
        self.counts.asked += u64::from(state.open());
        self.wanted = self.wanted.wrapping_add(u32::from(state.open()));
        let forgotten = self.ring.push(FrameEntry { state, at: self.recorded_at, wanted: self.wanted });
        self.counts.lost += u64::from(forgotten.state.open());
    }
}
