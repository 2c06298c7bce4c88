//! Before a play's first frame: whether somebody else sends to its controllers, by their count of datagrams (DP34).

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::config::Controller;
use crate::drive::{Evidence, EvidenceList, Lane, Need, Peer};
use crate::net::{Delivery, Sender};
use crate::rt::AckLoop;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

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
pub(super) struct Company<'a> {
    pub(super) sender: &'a Sender,
    pub(super) acks: &'a mut AckLoop,
    pub(super) controllers: &'a [Controller],
    pub(super) lanes: &'a [Lane],
    /// Read throughout: somebody wants the show to stop.
    pub(super) stop: &'a AtomicBool,
}

/// A count, and what was sent from here before it and since.
#[derive(Debug, Clone, Copy, Default)]
struct SentCount {
    told: Option<u16>,
    /// Reads that went out while it was asked for.
    sent: u16,
}

impl Company<'_> {
    /// The controllers that got datagrams which were not sent from here, and how many. Nothing else may be sent meanwhile. One
    /// that does not tell its count, or has none, is none of them.
    pub(super) fn look(&mut self) -> Vec<(usize, u16)> {
        let first = self.counts();
        let until = Monotonic.now() + BETWEEN;
        while self.has_slept_before(until) {
            self.acks.drain(&mut |_, _| false);
        }
        let second = self.counts();
        let surplus = |lane: usize| {
            let grown = second[lane].told?.wrapping_sub(first[lane].told?);
            // Each count may have been told before or after the reads that were repeated for it.
            let ours = first[lane].sent + second[lane].sent;
            (grown > ours + TOLERATED).then(|| (lane, grown - ours))
        };
        (0..self.lanes.len()).filter_map(surplus).collect()
    }

    fn counts(&mut self) -> Vec<SentCount> {
        let ends = self.controllers.iter().zip(self.lanes);
        let mut peers: Vec<_> =
            ends.map(|(controller, lane)| (Peer::new(controller, lane), SentCount::default())).collect();
        for _ in 0..TRIES {
            let now = Monotonic.now();
            for (lane, (peer, count)) in peers.iter_mut().enumerate() {
                if count.told.is_none() && !self.stop.load(Ordering::Relaxed) {
                    let mut send =
                        |datagram: &[u8]| !matches!(self.sender.send(lane, datagram), Delivery::Failed(_));
                    count.sent += u16::from(peer.poll(Need::Count, now, &mut send) > 0);
                }
            }
            // Of one that has no counter nothing is asked.
            let is_open = |(_, count): &(Peer, SentCount)| count.told.is_none() && count.sent > 0;
            while peers.iter().any(is_open) && self.has_slept_before(now + WAIT) {
                self.acks.drain(&mut |lane: usize, arrival| {
                    let (peer, count) = &mut peers[lane];
                    let mut evidence = EvidenceList::new();
                    peer.receive(arrival, &mut evidence);
                    let is_answer = !evidence.is_empty();
                    let told = |one| if let Evidence::Count(packets) = one { Some(packets) } else { None };
                    count.told = count.told.or(evidence.into_iter().find_map(told));
                    is_answer
                });
            }
        }
        peers.into_iter().map(|(_, count)| count).collect()
    }

    /// Sleeps for a moment; false once it is too late for that, or somebody wants the show to stop.
    fn has_slept_before(&self, until: MonoTime) -> bool {
        let now = Monotonic.now();
        let may_sleep = now < until && !self.stop.load(Ordering::Relaxed);
        if may_sleep {
            Monotonic.sleep_until((now + LOOK).min(until));
        }
        may_sleep
    }
}
