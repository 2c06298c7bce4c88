//! When a controller is read, and if an answer is waited for.

use std::time::Duration;

use crate::time::MonoTime;

/// While nothing moves, what a controller is and whether it knows its zero is read this often: nobody sees it being reset.
const LOOK_AGAIN: Duration = Duration::from_secs(1);
/// From one read to the next: 5 Hz.
const READ_EVERY: Duration = Duration::from_millis(200);

/// The reads of one controller.
#[derive(Debug, Clone, Default)]
pub(super) struct Reads {
    /// One was sent that nothing came of yet.
    is_open: bool,
    /// When the last one began.
    last: MonoTime,
    /// It is to be read though all is well.
    again: bool,
    next: Option<MonoTime>,
}

impl Reads {
    /// True if it is time for a read; if so, the next one is due a while later.
    pub(super) fn begins_now(&mut self, now: MonoTime) -> bool {
        let due = self.next.is_none_or(|next| now >= next);
        if due {
            self.next = Some(now + READ_EVERY);
            // Not again before the next beat: none goes out while somebody counts datagrams.
            (self.last, self.again) = (now, false);
        }
        due
    }

    /// It was sent; gives when it began.
    pub(super) const fn on_sent(&mut self) -> MonoTime {
        self.is_open = true;
        self.last
    }

    /// Something came of one; false where none is open that it could answer.
    pub(super) const fn on_sighting(&mut self) -> bool {
        std::mem::replace(&mut self.is_open, false)
    }

    /// A beat was sent to one that has to say again and again whether it knows its zero, or need not.
    pub(super) fn on_beat_sent(&mut self, must_be_home: bool, at: MonoTime) {
        self.again = must_be_home && self.is_old(at);
    }

    /// What is under way does not count.
    pub(super) const fn forget_open(&mut self) {
        self.is_open = false;
    }

    /// Nor when the next one is due: it is at once.
    pub(super) const fn forget(&mut self) {
        (self.is_open, self.next) = (false, None);
    }

    /// True if it is to be read though all is well.
    pub(super) const fn again(&self) -> bool {
        self.again
    }

    /// True if the last one is a while ago.
    pub(super) fn is_old(&self, now: MonoTime) -> bool {
        now.since(self.last) >= LOOK_AGAIN
    }
}
