//! Reads all that arrived since the last drain, each datagram with the instant at which the kernel received it. Ack thread:
//! never blocks, never allocates.

use std::fmt;
use std::io::ErrorKind;
use std::net::SocketAddrV4;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use socket2::Socket;

use super::ready::Ready;
use super::{Lane, Network, Reach};
use crate::sys::batch::{Batch, SLOTS};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::time::{Clock, MonoTime};

/// Batches read from one socket in one drain, at most: 4,096 datagrams, so that a flood cannot hold the thread.
const BATCHES_PER_DRAIN: usize = 4_096 / SLOTS;

/// Who sent a datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// The controller of this lane, counted from 0 in the order in which they were opened.
    Controller(usize),
    /// Anyone else.
    Stranger(SocketAddrV4),
}

/// The receiving half of [`Ports`](super::Ports), or of a [`Network`].
#[derive(Debug)]
pub struct Receiver(Way);

/// Where datagrams come from.
#[derive(Debug)]
enum Way {
    Kernel(Box<Sockets>),
    Network(Arc<dyn Network>),
}

/// The sockets of all lanes, read in batches.
struct Sockets {
    lanes: Arc<[Lane]>,
    stray: Socket,
    /// Which of them have something, the strangers' last.
    ready: Ready,
    batch: Batch,
    /// Per socket, the strangers' last: an instant before it was last found empty. What is read next came after.
    emptied: Box<[MonoTime]>,
    reach: Option<Reach>,
}

impl fmt::Debug for Sockets {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sockets").field("lanes", &self.lanes).finish_non_exhaustive()
    }
}

impl Receiver {
    /// Sockets from which nothing that came before `quiet` can be read any more.
    pub(super) fn new(
        lanes: Arc<[Lane]>,
        stray: Socket,
        ready: Ready,
        (quiet, reach): (MonoTime, Option<Reach>),
    ) -> Self {
        let emptied = vec![quiet; lanes.len() + 1].into_boxed_slice();
        Self(Way::Kernel(Box::new(Sockets { lanes, stray, ready, batch: Batch::new(), emptied, reach })))
    }

    pub(super) const fn over(network: Arc<dyn Network>) -> Self {
        Self(Way::Network(network))
    }

    /// How many controllers there are.
    #[must_use]
    pub(crate) fn lanes(&self) -> usize {
        match &self.0 {
            Way::Kernel(sockets) => sockets.lanes.len(),
            Way::Network(network) => network.lanes(),
        }
    }

    /// Gives every waiting datagram to `on`, with its sender and the instant at which the kernel received it; socket by
    /// socket, the strangers' last, in the order of arrival within each.
    ///
    /// Returns the instant at which the drain began: unless a flood left datagrams behind, all that arrived before it
    /// has been given.
    pub(crate) fn drain(&mut self, mut on: impl FnMut(Origin, &[u8], MonoTime)) -> MonoTime {
        match &mut self.0 {
            Way::Kernel(sockets) => sockets.drain(&mut on),
            Way::Network(network) => network.drain(&mut on),
        }
    }

    /// How often the kernel has reported so far that the port of controller `lane` is closed, to either half.
    ///
    /// # Panics
    /// If there is no such lane.
    #[must_use]
    pub(crate) fn port_closed(&self, lane: usize) -> u64 {
        match &self.0 {
            Way::Kernel(sockets) => sockets.lanes[lane].refusals.load(Ordering::Relaxed),
            Way::Network(network) => network.port_closed(lane),
        }
    }
}

impl Sockets {
    fn drain(&mut self, on: &mut impl FnMut(Origin, &[u8], MonoTime)) -> MonoTime {
        let began = Monotonic.now();
        let mut now = began;
        self.ready.look();
        for index in 0..=self.lanes.len() {
            if self.ready.is(index) {
                now = self.drain_one(index, now, on);
            } else {
                self.emptied[index] = began;
            }
        }
        if let Some(reach) = &mut self.reach {
            reach.look(&self.lanes, &mut self.batch, &mut self.emptied, began);
        }
        began
    }

    /// Drains one socket; takes and gives the latest reading of the clock.
    fn drain_one(
        &mut self,
        index: usize,
        mut now: MonoTime,
        on: &mut impl FnMut(Origin, &[u8], MonoTime),
    ) -> MonoTime {
        let lane = self.lanes.get(index);
        for _ in 0..BATCHES_PER_DRAIN {
            let before = now;
            let count = match self.batch.receive(lane.map_or(&self.stray, |lane| &lane.socket)) {
                Ok(count) => count,
                Err(e) if e.kind() == ErrorKind::WouldBlock => 0,
                Err(e) => {
                    // An earlier datagram's error, gone now that it is read.
                    if let Some(lane) = lane.filter(|_| e.kind() == ErrorKind::ConnectionRefused) {
                        lane.refusals.fetch_add(1, Ordering::Relaxed);
                    }
                    continue;
                }
            };
            // In this order: being stopped in between makes a datagram younger, and so no latency negative.
            let wall_ns = wall_now_ns();
            now = Monotonic.now();
            for datagram in self.batch.datagrams() {
                let at = received_at(datagram.stamp_ns, wall_ns, now, self.emptied[index]);
                let lane = lane.filter(|lane| !lane.away.load(Ordering::Relaxed));
                let origin = lane.map_or(Origin::Stranger(datagram.from), |_| Origin::Controller(index));
                if let (Some(_), Some(reach)) = (lane, &mut self.reach) {
                    reach.hears(index, now);
                }
                on(origin, datagram.bytes, at);
            }
            if count < SLOTS {
                self.emptied[index] = before;
                break;
            }
        }
        now
    }
}

/// The kernel stamps with the wall clock, which may step; so only the age of a datagram is taken from it, and that only
/// as far as it can be true: not from the future, and not older than the instant at which the socket was last empty.
fn received_at(stamp_ns: Option<u64>, wall_ns: u64, now: MonoTime, emptied: MonoTime) -> MonoTime {
    let age_ns = stamp_ns.map_or(0, |stamp_ns| wall_ns.saturating_sub(stamp_ns));
    now.before(Duration::from_nanos(age_ns)).max(emptied)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_datagram_came_its_age_ago_but_never_before_the_socket_was_last_empty() {
        let at = |ms: u64| MonoTime::from_nanos(ms * 1_000_000);
        let received = |stamp_ms: u64, wall_ms: u64| {
            received_at(Some(stamp_ms * 1_000_000), wall_ms * 1_000_000, at(100), at(95))
        };
        assert_eq!(received(70_000, 70_003), at(97));
        assert_eq!(received(70_000, 69_000), at(100), "the wall clock was set back");
        assert_eq!(received(70_000, 3_670_000), at(95), "the wall clock was set forward");
        assert_eq!(received_at(None, 70_003, at(100), at(95)), at(100));
    }
}
