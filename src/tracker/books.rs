//! Replies and records, brought into the one order in which they can be matched.

use crate::time::MonoTime;
use crate::wire::{FrameNo, ReplyCode};

use super::{ACK_TIMEOUT, Fate, Tracker};

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
    /// The error number that came with it; 0 for none.
    pub error: u16,
    /// The inputs that came with it, bit 0 = X01.
    pub inputs: u16,
    /// When the kernel received it.
    pub at: MonoTime,
}

/// Where the records of sends come from, and who hears what became of replies.
pub trait Ledger {
    /// Passes every record that has come to the tracker.
    fn bring_up_to_date(&mut self, tracker: &mut Tracker);

    /// Hears, once, of a reply that is there before any record of its frame, and waits for that.
    fn on_early(&mut self, _reply: &Reply) {}

    /// Hears what a reply turned out to be, and when its frame was sent, as far as that is known.
    fn on_fate(&mut self, _reply: &Reply, _fate: Fate, _sent_at: Option<MonoTime>) {}
}

/// What passes the records on, for nobody who wants to know.
impl<F: FnMut(&mut Tracker)> Ledger for F {
    fn bring_up_to_date(&mut self, tracker: &mut Tracker) {
        self(tracker);
    }
}

/// A [`Tracker`] and the replies that wait to be matched.
///
/// The record of a send is posted before the send, so whoever reads a reply first and the records after it has the
/// record of every frame that the reply can be to. Therefore replies are put by as they are read, and the records are
/// read (from the ledger that each method takes) before any is matched.
#[derive(Debug)]
pub struct Books {
    tracker: Tracker,
    /// Each, and whether it was there before the record of its frame.
    waiting: Vec<(Reply, bool)>,
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
    pub fn on_reply(&mut self, reply: Reply, ledger: &mut impl Ledger) {
        if self.waiting.len() == ROOM {
            self.match_all(reply.at, ledger);
            // Replies to frames that nobody sent must not fill the room.
            if self.waiting.len() > ROOM / 2 {
                self.give_up_waiting(ledger);
            }
        }
        self.waiting.push((reply, false));
    }

    /// Matches the replies that wait and whose frames are recorded; the others go on waiting.
    pub(crate) fn catch_up(&mut self, ledger: &mut impl Ledger) {
        self.match_all(MonoTime::default(), ledger);
    }

    /// Ends a drain that began at `began`: matches all replies, then expires the frames that are too old.
    pub fn settle(&mut self, began: MonoTime, ledger: &mut impl Ledger) {
        self.match_all(began, ledger);
        self.tracker.expire(began);
    }

    /// Ends the show: there will be no more replies, and every frame that asked for one meets its fate.
    pub fn finish(&mut self, ledger: &mut impl Ledger) {
        ledger.bring_up_to_date(&mut self.tracker);
        self.give_up_waiting(ledger);
        self.tracker.finish();
    }

    /// A reply to a frame newer than every record is kept for a while: its record may have been dropped, which the next
    /// one will tell.
    fn match_all(&mut self, now: MonoTime, ledger: &mut impl Ledger) {
        let tracker = &mut self.tracker;
        ledger.bring_up_to_date(tracker);
        self.waiting.retain_mut(|(reply, is_early)| {
            let early = !tracker.recorded(reply.controller, reply.frame);
            if early && now.since(reply.at) <= ACK_TIMEOUT {
                if !std::mem::replace(is_early, true) {
                    ledger.on_early(reply);
                }
                return true;
            }
            let fate = if *is_early {
                tracker.on_early_reply(reply)
            } else {
                tracker.on_reply(reply.controller, reply.frame, reply.code, reply.at)
            };
            ledger.on_fate(reply, fate, tracker.sent_at(reply.controller, reply.frame));
            false
        });
    }

    fn give_up_waiting(&mut self, ledger: &mut impl Ledger) {
        for (reply, _) in self.waiting.drain(..) {
            let fate = self.tracker.on_reply(reply.controller, reply.frame, reply.code, reply.at);
            ledger.on_fate(&reply, fate, self.tracker.sent_at(reply.controller, reply.frame));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    fn reply(frame: u32, at: MonoTime) -> Reply {
        Reply { controller: 0, frame: FrameNo(frame), code: ReplyCode::Running, error: 0, inputs: 0, at }
    }

    fn books() -> Books {
        Books::new(Tracker::new(1, 1))
    }

    #[test]
    fn a_reply_that_overtakes_the_record_of_its_frame_is_matched() {
        let mut books = books();
        books.on_reply(reply(1, ms(3)), &mut |_: &mut Tracker| panic!("there is room"));
        books.settle(ms(4), &mut |tracker: &mut Tracker| tracker.on_sent(0, FrameNo(1), true, ms(1)));
        assert_eq!((books.tracker().counts(0).acked, books.tracker().counts(0).stray), (1, 0));
    }

    #[test]
    fn a_reply_in_time_counts_though_it_is_drained_late() {
        let mut books = books();
        books.on_reply(reply(1, ms(900)), &mut |_: &mut Tracker| ());
        books.settle(ms(3_000), &mut |tracker: &mut Tracker| tracker.on_sent(0, FrameNo(1), true, ms(1)));
        assert_eq!((books.tracker().counts(0).acked, books.tracker().counts(0).lost), (1, 0));
    }

    #[test]
    fn a_reply_to_a_frame_whose_record_was_dropped_waits_for_the_next_record() {
        let mut books = books();
        books.on_reply(reply(1, ms(3)), &mut |_: &mut Tracker| ());
        books.settle(ms(5), &mut |_: &mut Tracker| ());
        assert_eq!(books.tracker().counts(0), crate::tracker::Counts::default());
        books.settle(ms(15), &mut |tracker: &mut Tracker| tracker.on_sent(0, FrameNo(2), true, ms(11)));
        let counts = books.tracker().counts(0);
        assert_eq!((counts.asked, counts.acked, counts.stray), (2, 1, 0));
    }

    #[test]
    fn a_reply_that_came_before_its_frame_was_sent_is_to_none_of_these() {
        let mut books = books();
        let sent = &mut |tracker: &mut Tracker| tracker.on_sent(0, FrameNo(1), true, ms(500));
        books.on_reply(reply(1, ms(3)), &mut |_: &mut Tracker| ());
        books.settle(ms(5), &mut |_: &mut Tracker| ());
        books.settle(ms(501), sent);
        assert_eq!((books.tracker().counts(0).acked, books.tracker().counts(0).stray), (0, 1));
        books.on_reply(reply(1, ms(501)), &mut |_: &mut Tracker| ());
        books.settle(ms(502), &mut |_: &mut Tracker| ());
        assert_eq!((books.tracker().counts(0).acked, books.tracker().counts(0).stray), (1, 1));
    }

    #[test]
    fn a_reply_to_a_frame_that_is_never_recorded_is_stray_after_a_second_or_at_the_end() {
        let mut books = books();
        books.on_reply(reply(7, ms(3)), &mut |_: &mut Tracker| ());
        books.settle(ms(1_003), &mut |_: &mut Tracker| ());
        assert_eq!(books.tracker().counts(0).stray, 0);
        books.settle(ms(1_004), &mut |_: &mut Tracker| ());
        assert_eq!(books.tracker().counts(0).stray, 1);
        books.on_reply(reply(8, ms(1_005)), &mut |_: &mut Tracker| ());
        books.finish(&mut |_: &mut Tracker| ());
        assert_eq!(books.tracker().counts(0).stray, 2);
    }

    #[test]
    fn more_replies_than_there_is_room_for_are_matched_early_after_their_records() {
        let mut books = books();
        let room = u32::try_from(ROOM).unwrap();
        let mut reads = 0;
        for frame in 1..=room + 5 {
            books.on_reply(reply(frame, ms(500)), &mut |tracker: &mut Tracker| {
                reads += 1;
                (1..=room).for_each(|sent| tracker.on_sent(0, FrameNo(sent), true, ms(1)));
            });
        }
        assert_eq!((reads, books.tracker().counts(0).acked), (1, u64::from(room)));
    }

    #[test]
    fn replies_to_nothing_cannot_fill_the_room() {
        let mut books = books();
        let flood = u32::try_from(3 * ROOM).unwrap();
        for _ in 0..flood {
            books.on_reply(reply(9, ms(1)), &mut |_: &mut Tracker| ());
        }
        assert!(books.waiting.capacity() == ROOM && books.waiting.len() <= ROOM);
        books.finish(&mut |_: &mut Tracker| ());
        assert_eq!(books.tracker().counts(0).stray, u64::from(flood));
    }
}
