//! Before a play's first frame: whether somebody else sends to its controllers, by their count of datagrams (DP34).

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::config::Controller;
use crate::fanout::Lane;
use crate::net::{Delivery, Sender};
use crate::rt::AckLoop;
use crate::time::{Clock, MonoTime};
use crate::wire::{Access, Dialect, FromController, MAX_LEN, ReadRequest, ReplyCode};

/// DP34: datagrams received; SMC alone.
const PACKETS: u16 = 0x34;
/// From the first count to the second: whoever asks at rest does so four times a second.
const BETWEEN: Duration = Duration::from_millis(800);
/// Reads of each count, and how long each is waited for.
const TRIES: u32 = 2;
const WAIT: Duration = Duration::from_millis(100);
/// How often replies are looked for meanwhile.
const LOOK: Duration = Duration::from_millis(2);
/// A network may double one datagram.
const TOLERATED: u16 = 1;

/// Everything that looking needs.
pub(super) struct Company<'a, C> {
    pub(super) clock: &'a C,
    pub(super) sender: &'a Sender,
    pub(super) acks: &'a mut AckLoop,
    pub(super) controllers: &'a [Controller],
    pub(super) lanes: &'a [Lane],
    /// Read throughout: somebody wants the show to stop.
    pub(super) stop: &'a AtomicBool,
}

/// A count, and what was sent from here before it and since.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    told: Option<u16>,
    /// Reads that went out while it was asked for.
    sent: u16,
}

impl<C: Clock> Company<'_, C> {
    /// The controllers that got datagrams which were not sent from here, and how many. Nothing else may be sent meanwhile. One
    /// that does not tell its count, or has none, is none of them.
    pub(super) fn look(&mut self) -> Vec<(usize, u16)> {
        let first = self.counts();
        self.wait_until(self.clock.now() + BETWEEN, &mut |_, _| false, &|| false);
        let second = self.counts();
        let surplus = |lane: usize| {
            let grown = second[lane].told?.wrapping_sub(first[lane].told?);
            // Each count may have been told before or after the reads that were repeated for it.
            let ours = first[lane].sent + second[lane].sent;
            (grown > ours + TOLERATED).then(|| (lane, grown - ours))
        };
        (0..self.lanes.len()).filter_map(surplus).collect()
    }

    fn counts(&mut self) -> Vec<Count> {
        let mut counts = vec![Count::default(); self.lanes.len()];
        for _ in 0..TRIES {
            let smc = |lane: &usize| self.controllers[*lane].dialect == Dialect::Smc;
            let open: Vec<usize> =
                (0..counts.len()).filter(smc).filter(|lane| counts[*lane].told.is_none()).collect();
            if open.is_empty() || self.is_stopped() {
                break;
            }
            for lane in open {
                counts[lane].sent += u16::from(self.ask(lane));
            }
            let until = self.clock.now() + WAIT;
            let told = std::cell::RefCell::new(&mut counts);
            let mut take = |lane: usize, message: &FromController<'_>| {
                let count = count_of(message);
                let mut told = told.borrow_mut();
                told[lane].told = told[lane].told.or(count);
                count.is_some()
            };
            let dialects = self.controllers.iter().map(|one| one.dialect);
            let mbox: Vec<bool> = dialects.map(|dialect| dialect != Dialect::Smc).collect();
            let enough =
                || told.borrow().iter().zip(&mbox).all(|(count, mbox)| *mbox || count.told.is_some());
            self.wait_until(until, &mut take, &enough);
        }
        counts
    }

    fn ask(&self, lane: usize) -> bool {
        let code = self.lanes[lane].code;
        let read = ReadRequest { channel: 0, accept: code, reply: code, start: PACKETS, num: 1 };
        !matches!(self.sender.send(lane, read.emit(&mut [0; MAX_LEN])), Delivery::Failed(_))
    }

    fn wait_until(
        &mut self,
        until: MonoTime,
        take: &mut dyn FnMut(usize, &FromController<'_>) -> bool,
        enough: &dyn Fn() -> bool,
    ) {
        while self.clock.now() < until && !self.is_stopped() && !enough() {
            self.clock.sleep_until((self.clock.now() + LOOK).min(until));
            self.acks.drain(take);
        }
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// The count that an answer tells; with x over 2 it does not say its channel.
fn count_of(message: &FromController<'_>) -> Option<u16> {
    let FromController::Registers(reply) = message else { return None };
    let is_ours = reply.access == Access::Read
        && (reply.start, reply.num) == (PACKETS, 1)
        && (reply.channel == 0 || reply.code != ReplyCode::Running);
    reply.data.get(0).filter(|_| is_ours)
}
