//! One drain of the ack thread, taken again in the order in which it took it.

use super::bench::Bench;
use super::frames::PostedFrame;
use crate::health::HealthInput;
use crate::net::Origin;
use crate::observe::FirstAnswer;
use crate::record::{AckRecord, latency_ns};
use crate::time::MonoTime;
use crate::tracker::{Books, Fate, Ledger, Reply, Tracker};
use crate::wire::{FrameNo, ReplyCode};

/// Frames that a link confirms at once at the most; more are damage.
const CONFIRMED: u32 = 100_000;

/// A drain, and how far it was taken.
pub(super) struct Turn<'a> {
    bench: &'a mut Bench,
    records: &'a [AckRecord<'a>],
    began: MonoTime,
    /// The observer's events were passed on; all groups were judged.
    events_passed: bool,
    is_judged: bool,
}

impl<'a> Turn<'a> {
    pub(super) const fn new(bench: &'a mut Bench, records: &'a [AckRecord<'a>], began: MonoTime) -> Self {
        Self { bench, records, began, events_passed: false, is_judged: false }
    }

    /// Takes all of it.
    pub(super) fn go(mut self, books: &mut Books) {
        self.bench.verdict.drains += 1;
        while let Some((record, rest)) = self.records.split_first() {
            let is_taken = match *record {
                AckRecord::Reply(reply) => {
                    self.records = rest;
                    if self.bench.knows(reply.controller, reply.frame) {
                        books.on_reply(reply, &mut self);
                    }
                    continue;
                }
                AckRecord::Confirmed(controller, first, last) => {
                    self.records = rest;
                    self.confirm(books, controller, first, last);
                    continue;
                }
                AckRecord::First(controller, first) => {
                    self.bench.begins(controller, first, books);
                    true
                }
                _ => self.hears_told(record),
            };
            if is_taken {
                self.records = rest;
                continue;
            }
            // Perhaps the ack thread brought its books up to date before it heard what comes next.
            let before = self.records.len();
            books.catch_up(&mut self);
            if self.records.len() == before {
                break;
            }
        }
        books.settle(self.began, &mut self);
        self.take_rest(books.tracker_mut());
        let Self { bench, began, .. } = self;
        bench.compare(books.tracker(), began);
    }

    /// What is told beside frames, replies and what they come to; false where that is something else.
    fn hears_told(&mut self, record: &AckRecord<'_>) -> bool {
        let bench = &mut *self.bench;
        match *record {
            AckRecord::Heard(Origin::Controller(controller), at, octets) if controller < bench.stations => {
                let message = bench.observer.read(controller, octets);
                bench.observer.hear(controller, &message, at);
            }
            AckRecord::Heard(Origin::Stranger(from), at, octets) => {
                bench.observer.hear_elsewhere(from, octets, at);
            }
            AckRecord::Code(controller, code, at) if controller < bench.seats.len() => {
                bench.observer.on_code(controller, code, at);
            }
            AckRecord::Look(controller, look, at) if controller < bench.seats.len() => {
                bench.observer.on_look(controller, look, at);
            }
            AckRecord::Health(input) => bench.judge(input),
            AckRecord::Watched => bench.on_watched(),
            AckRecord::Heard(..) | AckRecord::Code(..) | AckRecord::Look(..) => {}
            _ => return false,
        }
        true
    }

    /// A link confirms frames: they count as acked by now.
    fn confirm(&mut self, books: &mut Books, controller: usize, first: FrameNo, last: FrameNo) {
        if !u32::try_from(last.since(first)).is_ok_and(|more| more < CONFIRMED) {
            return;
        }
        let ack_every = self.bench.judging.ack_every;
        let next = |frame: &FrameNo| (frame.since(last) < 0).then(|| frame.next());
        for frame in std::iter::successors(Some(first), next).filter(|frame| frame.asks(ack_every)) {
            if self.bench.knows(controller, frame) {
                let (code, at) = (ReplyCode::Running, self.began);
                books.on_reply(Reply { controller, frame, code, error: 0, inputs: 0, at }, self);
            }
        }
    }

    /// What comes once the books are settled: how controllers are looked at, and how they stand.
    fn take_rest(&mut self, tracker: &mut Tracker) {
        while let Some((record, rest)) = self.records.split_first() {
            self.records = rest;
            match *record {
                AckRecord::Fate(controller, frame, fate, latency) => {
                    if self.bench.knows(controller, frame) {
                        self.bench.fate_differs(self.began, controller, frame, Some((fate, latency)), None);
                    }
                }
                AckRecord::Events => self.pass_events(),
                AckRecord::Judged => self.look(),
                AckRecord::Withdrawn(controller, first, last) if controller < self.bench.seats.len() => {
                    tracker.withdraw(controller, first, last);
                }
                AckRecord::Lost(controller, total) => self.bench.on_lost(controller, total),
                AckRecord::Standing(controller, standing) => self.bench.on_standing(controller, standing),
                ref other => drop(self.hears_told(other)),
            }
        }
        self.look();
    }

    fn pass_events(&mut self) {
        if !std::mem::replace(&mut self.events_passed, true) {
            self.bench.pass_events();
        }
    }

    fn look(&mut self) {
        self.pass_events();
        if !std::mem::replace(&mut self.is_judged, true) {
            self.bench.look(self.began);
        }
    }

    /// What was recorded of the next reply. That before it which is not known is passed over, with what it told.
    fn next_fate(&mut self) -> Option<(usize, FrameNo, Fate, u32)> {
        loop {
            self.take_refusals();
            let (AckRecord::Fate(controller, frame, fate, latency), rest) = self.records.split_first()?
            else {
                return None;
            };
            self.records = rest;
            if self.bench.knows(*controller, *frame) {
                return Some((*controller, *frame, *fate, *latency));
            }
        }
    }

    /// Gives health what a reply told it.
    fn take_refusals(&mut self) {
        while let Some((AckRecord::Health(input @ HealthInput::Refused(_)), rest)) =
            self.records.split_first()
        {
            self.bench.judge(*input);
            self.records = rest;
        }
    }
}

impl Ledger for Turn<'_> {
    fn bring_up_to_date(&mut self, tracker: &mut Tracker) {
        while let Some((record, rest)) = self.records.split_first() {
            let controllers = self.bench.seats.len();
            match *record {
                AckRecord::Posted(count, lane, last) => match self.bench.frames.post(count, lane, last) {
                    PostedFrame::All(frames) => self.bench.on_frames(&frames, tracker),
                    PostedFrame::Some(frames) => self.bench.on_some_frames(&frames, tracker),
                },
                AckRecord::Failed(controller, frame) if self.bench.knows(controller, frame) => {
                    tracker.on_send_failed(controller, frame);
                }
                AckRecord::Skipped(controller, next) if self.bench.knows(controller, next) => {
                    tracker.on_skipped(controller, next);
                }
                AckRecord::Joined(controller) if controller < controllers => self.bench.on_joined(controller),
                AckRecord::FellOut(controller, why, _) if controller < controllers => {
                    self.bench.health.on_fell_out(controller, why);
                }
                AckRecord::Unread(controller) if controller < controllers => {
                    self.bench.health.on_unread(controller);
                }
                AckRecord::Failed(..)
                | AckRecord::Skipped(..)
                | AckRecord::Joined(_)
                | AckRecord::FellOut(..)
                | AckRecord::Unread(_) => {}
                _ => return,
            }
            self.records = rest;
        }
    }

    fn on_fate(&mut self, reply: &Reply, fate: Fate, sent_at: Option<MonoTime>) {
        let Reply { controller, frame, code, error, inputs, at } = *reply;
        // Something was missing since it came, its frame perhaps.
        if !self.bench.knows(controller, frame) {
            return;
        }
        let replayed = (controller, frame, fate, latency_ns(sent_at, at));
        let recorded = self.next_fate();
        self.bench.verdict.fates += 1;
        if recorded != Some(replayed) {
            let told = recorded.map(|(.., fate, latency)| (fate, latency));
            self.bench.fate_differs(self.began, controller, frame, told, Some((fate, replayed.3)));
        }
        if let Fate::Answered(_) = fate {
            self.bench.observer.on_answer(controller, &FirstAnswer { frame, code, error, inputs }, at);
        }
        if let Fate::Answered(ReplyCode::Running) = fate {
            self.bench.health.on_ack(controller, frame, at);
        }
        self.take_refusals();
    }
}
