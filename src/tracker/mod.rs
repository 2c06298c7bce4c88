//! The fate of every frame: from sends and replies it keeps the account of each controller and the latency of its
//! acks. Ack thread; pure: the time is an argument, and all memory is allocated at the start.
//!
//! A frame that asks for a reply ends in exactly one account: acked, refused, lost or withdrawn. A reply ends in exactly one as
//! well: acked, refused, duplicate, stale or stray.

mod account;
mod books;
mod counts;
mod in_flight;
mod latency;

use std::time::Duration;

pub(crate) use books::Ledger;
pub use books::{Books, Reply};
pub use counts::Counts;
pub(crate) use counts::Fate;
pub use in_flight::KEPT;
pub use latency::{Histogram, histogram};

use crate::time::MonoTime;
use crate::wire::{FrameNo, ReplyCode};
use account::Account;

/// A frame without a reply this long after its send is lost.
pub const ACK_TIMEOUT: Duration = Duration::from_secs(1);

/// The books of all controllers, counted from 0 in the order of their lanes.
///
/// Of each controller the fates of its last [`KEPT`] frames are remembered. Every method that takes a controller panics
/// if there is none of that number.
#[derive(Debug)]
pub struct Tracker {
    accounts: Vec<Account>,
    /// Controllers below are on the network, those from there on are on links.
    stations: usize,
    /// Of the acks of all on the network, and of all on links.
    latencies: [Histogram; 2],
}

impl Tracker {
    /// Empty books for a number of controllers whose first frames have the number [`FrameNo::FIRST`]. A reply is asked
    /// for in each of `ack_every` frames, as [`FrameNo::asks`] has it; 0 never asks.
    #[must_use]
    pub(crate) fn new(controllers: usize, ack_every: u32) -> Self {
        Self::starting_at(&vec![FrameNo::FIRST; controllers], ack_every)
    }

    /// Empty books for one controller per element, whose next frame has that number.
    #[must_use]
    pub fn starting_at(first: &[FrameNo], ack_every: u32) -> Self {
        Self {
            accounts: first.iter().map(|&first| Account::new(first, ack_every)).collect(),
            stations: first.len(),
            latencies: [histogram(), histogram()],
        }
    }

    /// The last of the controllers, so many, are seats on links: their acks say that drives have what a frame leads to, which is much later
    /// than that it was received.
    pub(crate) fn set_on_links(&mut self, controllers: usize) {
        self.stations = self.accounts.len().saturating_sub(controllers);
    }

    /// What was before a frame of a controller is not known, and its accounts begin with it.
    pub(crate) fn begin_at(&mut self, controller: usize, first: FrameNo) {
        self.accounts[controller].begin_at(first);
    }

    /// A frame is about to be handed to the kernel at `at`; `asked` says whether it requests a reply.
    ///
    /// Records come in the order of sending. Numbers left out are frames whose records were dropped: they count as sent,
    /// at an unknown time not later than `at`, and as asked where their numbers are those that ask. A frame already on
    /// record is left as it is.
    pub fn on_sent(&mut self, controller: usize, frame: FrameNo, asked: bool, at: MonoTime) {
        self.accounts[controller].on_sent(frame, asked, at);
    }

    /// The kernel did not take a frame after all: it was not sent, and asked for nothing.
    ///
    /// A frame without a record gets one, as do those before it. One that was answered, or is too old to be remembered,
    /// is left as it is.
    pub fn on_send_failed(&mut self, controller: usize, frame: FrameNo) {
        self.accounts[controller].on_send_failed(frame);
    }

    /// The next frame of a controller has the number `next`, and none has those before it that are not on record: they count as nothing.
    pub(crate) fn on_skipped(&mut self, controller: usize, next: FrameNo) {
        self.accounts[controller].on_skipped(next);
    }

    /// `last` was the last frame of the show, sent or not, at `at` at the latest: frames up to it of which no record came
    /// count as [`Tracker::on_sent`] has it.
    pub fn on_last(&mut self, controller: usize, last: FrameNo, at: MonoTime) {
        self.accounts[controller].on_last(last, at);
    }

    /// A reply that the kernel received at `at`. To be told only once the record of every frame sent before has been;
    /// [`Books`] sees to that.
    ///
    /// A reply later than [`ACK_TIMEOUT`] after its frame is stale, and the frame lost, whenever this is told; one in
    /// time counts, however late it is told, unless [`Tracker::expire`] came first.
    pub fn on_reply(&mut self, controller: usize, frame: FrameNo, code: ReplyCode, at: MonoTime) -> Fate {
        let latencies = &mut self.latencies[usize::from(controller >= self.stations)];
        self.accounts[controller].on_reply(frame, code, at, latencies)
    }

    /// A seat was told to stop and does not execute the frames from the one to the other, as far as nothing is known of them: they are not lost.
    pub(crate) fn withdraw(&mut self, controller: usize, first: FrameNo, last: FrameNo) {
        self.accounts[controller].withdraw(first, last);
    }

    /// A reply that was there before the record of its frame: it is to one that this program sent before it was started anew, unless the
    /// record itself was dropped.
    fn on_early_reply(&mut self, reply: &Reply) -> Fate {
        let Reply { controller, frame, code, at, .. } = *reply;
        if !self.accounts[controller].is_timed(frame) {
            return self.on_reply(controller, frame, code, at);
        }
        self.on_stray(controller);
        Fate::Stray
    }

    /// When a frame of a controller was sent, at the latest; `None` where it is not remembered.
    fn sent_at(&self, controller: usize, frame: FrameNo) -> Option<MonoTime> {
        self.accounts[controller].sent_at(frame)
    }

    /// A datagram from a controller that is no reply to a frame.
    pub(crate) fn on_stray(&mut self, controller: usize) {
        self.accounts[controller].counts.stray += 1;
    }

    /// How often, in all, the kernel has reported that the controller's port is closed.
    pub(crate) fn on_port_closed(&mut self, controller: usize, total: u64) {
        self.accounts[controller].counts.port_closed = total;
    }

    /// Gives up the frames that were sent more than [`ACK_TIMEOUT`] before `now`, an instant up to which every reply has
    /// been told.
    pub fn expire(&mut self, now: MonoTime) {
        for account in &mut self.accounts {
            account.expire(now);
        }
    }

    /// Gives up every frame that is still unanswered: there will be no more replies.
    pub(crate) fn finish(&mut self) {
        for account in &mut self.accounts {
            account.finish();
        }
    }

    /// True if a record of this frame, or of one after it, has come.
    #[must_use]
    pub(crate) fn recorded(&self, controller: usize, frame: FrameNo) -> bool {
        self.accounts[controller].recorded(frame)
    }

    /// The accounts of one controller.
    #[must_use]
    pub fn counts(&self, controller: usize) -> Counts {
        self.accounts[controller].counts
    }

    /// Ack latencies of one controller in nanoseconds, from send to the kernel's receive time; of acked frames whose
    /// time of sending is known.
    #[must_use]
    pub fn latency(&self, controller: usize) -> &Histogram {
        &self.accounts[controller].latency
    }

    /// The same of all controllers on the network together, and of all seats on links.
    #[must_use]
    pub(crate) const fn latencies(&self) -> &[Histogram; 2] {
        &self.latencies
    }

    /// The newest frame that was acked, and when its ack was received.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn last_ack(&self, controller: usize) -> Option<(FrameNo, MonoTime)> {
        self.accounts[controller].last_ack
    }

    /// True if the controller was lost when the sending ended: it was asked, and acked none of the frames of the last
    /// second that asked, or of the last ten that did if those are more. A frame that the kernel did not take was not acked either, and a
    /// refusal is no ack. To be asked after [`Tracker::finish`].
    #[must_use]
    pub fn lost_at_end(&self, controller: usize) -> bool {
        self.accounts[controller].lost_at_end()
    }
}

#[cfg(test)]
mod tests;
