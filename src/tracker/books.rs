//! Replies and records, brought into the one order in which they can be matched.

use crate::time::MonoTime;
use crate::wire::{FrameNo, ReplyCode};

use super::{ACK_TIMEOUT, Tracker};

/// Replies put by at most before they are matched.
const ROOM: usize = 4_096;

/// A reply to a frame, as it was received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reply {
    /// The controller it came from.
    pub controller: usize,
    /// The frame it answers.
    pub frame: FrameNo,
    /// What it says.
    pub code: ReplyCode,
    /// When the kernel received it.
    pub at: MonoTime,
}

/// A [`Tracker`] and the replies that wait to be matched.
///
/// The record of a send is posted before the send, so whoever reads a reply first and the records after it has the
/// record of every frame that the reply can be to. Therefore replies are put by as they are read, and the records are
/// read (by the closure that each method takes, which passes all that have come to the tracker) before any is matched.
#[derive(Debug)]
pub struct Books {
    tracker: Tracker,
    waiting: Vec<Reply>,
}

impl Books {
    /// Books that go on from a tracker.
    #[must_use]
    pub fn new(tracker: Tracker) -> Self {
        Self { tracker, waiting: Vec::with_capacity(ROOM) }
    }

    /// The accounts as they stand.
    #[must_use]
    pub const fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// The tracker, to tell it of datagrams that are no replies and of closed ports.
    pub const fn tracker_mut(&mut self) -> &mut Tracker {
        &mut self.tracker
    }

    /// Puts a reply by; where there is no more room, those before it are matched first.
    pub fn on_reply(&mut self, reply: Reply, records: impl FnOnce(&mut Tracker)) {
        if self.waiting.len() == ROOM {
            records(&mut self.tracker);
            self.match_all(reply.at);
            // Replies to frames that nobody sent must not fill the room.
            if self.waiting.len() > ROOM / 2 {
                self.give_up_waiting();
            }
        }
        self.waiting.push(reply);
    }

    /// Ends a drain that began at `began`: matches all replies, then expires the frames that are too old.
    pub fn settle(&mut self, began: MonoTime, records: impl FnOnce(&mut Tracker)) {
        records(&mut self.tracker);
        self.match_all(began);
        self.tracker.expire(began);
    }

    /// Ends the show: there will be no more replies, and every frame that asked for one meets its fate.
    pub fn finish(&mut self, records: impl FnOnce(&mut Tracker)) {
        records(&mut self.tracker);
        self.give_up_waiting();
        self.tracker.finish();
    }

    /// A reply to a frame newer than every record is kept for a while: its record may have been dropped, which the next
    /// one will tell.
    fn match_all(&mut self, now: MonoTime) {
        let tracker = &mut self.tracker;
        self.waiting.retain(|reply| {
            let early = !tracker.recorded(reply.controller, reply.frame);
            if early && now.since(reply.at) <= ACK_TIMEOUT {
                return true;
            }
            tracker.on_reply(reply.controller, reply.frame, reply.code, reply.at);
            false
        });
    }

    fn give_up_waiting(&mut self) {
        for reply in self.waiting.drain(..) {
            self.tracker.on_reply(reply.controller, reply.frame, reply.code, reply.at);
        }
    }
}
