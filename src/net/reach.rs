//! The ways to controllers, as they come and change after the sockets were opened: a network that is not there yet, an address of this
//! machine that it gets later, or another one than it had. Ack thread; never blocks, allocates nothing once it is made.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::sync::atomic::Ordering;
use std::time::Duration;

use rustix::net::connect_unspec;

use super::open::{local_address, quiet};
use super::{Lane, route};
use crate::sys::batch::Batch;
use crate::time::MonoTime;

/// From one look to the next.
const EVERY: Duration = Duration::from_secs(1);
/// A controller that was heard less long ago has its way.
const SILENT: Duration = Duration::from_secs(2);

/// Looks for the ways to silent controllers.
#[derive(Debug)]
pub(super) struct Reach {
    bind: Ipv4Addr,
    peers: Box<[SocketAddrV4]>,
    heard: Box<[MonoTime]>,
    looked: MonoTime,
}

impl Reach {
    /// Of sockets that were opened then.
    pub(super) fn new(bind: Ipv4Addr, peers: &[SocketAddrV4], opened: MonoTime) -> Self {
        Self { bind, peers: peers.into(), heard: vec![opened; peers.len()].into(), looked: opened }
    }

    /// A controller was heard.
    pub(super) fn hears(&mut self, lane: usize, now: MonoTime) {
        self.heard[lane] = now;
    }

    /// Connects those anew, once a second, to which another way leads than they have, or one where there was none. What came until then is
    /// read away: anyone could have sent it.
    pub(super) fn look(
        &mut self,
        lanes: &[Lane],
        batch: &mut Batch,
        emptied: &mut [MonoTime],
        now: MonoTime,
    ) {
        if now.since(self.looked) < EVERY {
            return;
        }
        self.looked = now;
        for (index, (lane, peer)) in lanes.iter().zip(&self.peers).enumerate() {
            let is_heard = !lane.away.load(Ordering::Relaxed) && now.since(self.heard[index]) < SILENT;
            if !is_heard && lane.connects_anew(self.bind, *peer) {
                quiet(batch, &lane.socket);
                (emptied[index], self.heard[index]) = (now, now);
                lane.away.store(false, Ordering::Release);
            }
        }
    }
}

impl Lane {
    /// Connects it to its controller.
    pub(super) fn connect(&self, peer: SocketAddrV4) -> io::Result<()> {
        self.socket.connect(&SocketAddr::V4(peer).into())
    }

    /// True if it was connected by another way than it had; its `away` is set then. Without a way to the controller it is left as it is.
    fn connects_anew(&self, bind: Ipv4Addr, peer: SocketAddrV4) -> bool {
        let Ok(way) = route(bind, peer) else { return false };
        let has_it = !self.away.load(Ordering::Relaxed)
            && local_address(&self.socket).is_ok_and(|local| *local.ip() == way.local);
        if has_it {
            return false;
        }
        self.away.store(true, Ordering::Release);
        // As long as it is connected, the kernel keeps the address that it sends from.
        let _ = connect_unspec(&self.socket);
        self.connect(peer).is_ok()
    }
}
