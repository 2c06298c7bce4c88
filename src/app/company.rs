//! Before a play's first frame: whether somebody else sends to its controllers, by their count of datagrams (DP34).

use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::config::Controller;
use crate::drive::{Evidence, EvidenceList, Incoming, Lane, Need, Peer};
use crate::net::{Delivery, Sender};
use crate::rt::AckLoop;
use crate::time::{Clock, MonoTime};

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
        let (ends, sender) = (self.controllers.iter().zip(self.lanes), self.sender);
        let peers = ends.map(|(controller, lane)| (Peer::new(controller, lane), Count::default()));
        let counts = RefCell::new(peers.collect::<Vec<_>>());
        // Of one that has no counter nothing is asked.
        let enough = || counts.borrow().iter().all(|(_, count)| count.told.is_some() || count.sent == 0);
        for _ in 0..TRIES {
            let now = self.clock.now();
            for (lane, (peer, count)) in counts.borrow_mut().iter_mut().enumerate() {
                if count.told.is_none() && !self.is_stopped() {
                    let mut send =
                        |datagram: &[u8]| !matches!(sender.send(lane, datagram), Delivery::Failed(_));
                    count.sent += u16::from(peer.poll(Need::Count, now, &mut send) > 0);
                }
            }
            let mut take = |lane: usize, arrival: Incoming<'_>| {
                let (peer, count) = &mut counts.borrow_mut()[lane];
                let mut evidence = EvidenceList::new();
                peer.receive(arrival, &mut evidence);
                let is_answer = !evidence.is_empty();
                let told = |one| if let Evidence::Count(packets) = one { Some(packets) } else { None };
                count.told = count.told.or(evidence.into_iter().find_map(told));
                is_answer
            };
            self.wait_until(now + WAIT, &mut take, &enough);
        }
        counts.into_inner().into_iter().map(|(_, count)| count).collect()
    }

    fn wait_until(
        &mut self,
        until: MonoTime,
        take: &mut dyn FnMut(usize, Incoming<'_>) -> bool,
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
