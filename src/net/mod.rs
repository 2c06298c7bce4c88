//! Datagrams to and from the controllers: one connected socket each, all on one local port, and one more for whoever
//! else writes to that port. The tick thread has the [`Sender`], the ack thread the [`Receiver`].
//!
//! Why not one socket for all: the frames to a controller that is switched off wait for its hardware address and fill
//! the send buffer, and then the live ones starve. Connected sockets also leave it to the kernel that a reply is taken
//! from its own controller only.

mod cost;
mod error;
mod lead;
mod network;
mod open;
mod reach;
mod ready;
mod recv;
mod route;
mod schedule;
mod send;
#[cfg(test)]
mod tests;
mod way;

use std::net::SocketAddrV4;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

use socket2::Socket;

use crate::time::MonoTime;
use reach::Reach;
use ready::Ready;

pub(crate) use cost::SendCost;
pub(crate) use error::NetError;
pub use lead::Lead;
pub use network::{Network, over};
pub use recv::Origin;
pub(crate) use recv::Receiver;
pub(crate) use route::{Route, route};
pub use schedule::DrainGrid;
pub use send::{Delivery, SendFault, Sender};

/// The sockets of one show, opened and quiet: nothing that was sent before they were connected can be read from them.
#[derive(Debug)]
pub struct Ports {
    local: SocketAddrV4,
    lanes: Vec<Lane>,
    /// That of the network that is sent to as a whole, where there is one.
    whole: Option<Lane>,
    stray: Socket,
    /// Which of the lanes and the strangers' socket have something.
    ready: Ready,
    /// Nothing that came before this can be read.
    quiet: MonoTime,
    /// What looks for ways to controllers that are silent; `None` where all had to be there from the beginning.
    reach: Option<Reach>,
}

/// A network that is sent to as a whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Whole {
    /// Its broadcast address.
    pub(crate) address: SocketAddrV4,
    /// How many bits all addresses of it have in common.
    pub(crate) bits: u8,
    /// The controllers in it, by their places among the peers.
    pub(crate) lanes: Vec<usize>,
}

/// One controller's socket, and how often the kernel reported that its port is closed, be it to the sender or to the
/// receiver.
#[derive(Debug)]
struct Lane {
    socket: Socket,
    refusals: AtomicU64,
    /// Where there is no way to the controller yet, so that its socket is not connected: nothing is sent by it, and whoever it hears is a
    /// stranger.
    away: AtomicBool,
}

impl Ports {
    /// Opens a socket on `bind` for each of `peers`, in their order, and one for strangers. Port 0 takes a free port,
    /// the same one for all.
    ///
    /// While they live, no other program can bind the port, not even one that asks to share it.
    ///
    /// # Errors
    /// [`NetError::Twice`] and [`NetError::NotUnicast`] for peers that cannot have a socket of their own;
    /// [`NetError::Refused`] where the system refuses, even if another program has the port.
    pub fn open(bind: SocketAddrV4, peers: &[SocketAddrV4]) -> Result<Self, NetError> {
        Self::open_with(bind, peers, None, false)
    }

    /// The same, with a socket that sends to all of a network at its broadcast address, and hears nothing: whoever answers does so to the
    /// socket of its own address.
    ///
    /// # Errors
    /// As [`Ports::open`]; [`NetError::NoBroadcast`] and [`NetError::OffTheWire`] where a broadcast would not go to the controllers of the
    /// network and no farther; [`NetError::OtherWay`] where it would leave from another address than what goes to a controller alone:
    /// its reply would not be taken for that controller's.
    ///
    /// Where `may_come` says so neither the local address nor a way to any controller has to be there yet: what is missing is looked for
    /// again and again as long as the sockets live. That of a network that is sent to as a whole has to be.
    pub(crate) fn open_with(
        bind: SocketAddrV4,
        peers: &[SocketAddrV4],
        whole: Option<&Whole>,
        may_come: bool,
    ) -> Result<Self, NetError> {
        let ports = open::open(bind, peers, whole, may_come)?;
        let reach = may_come.then(|| Reach::new(*ports.local.ip(), peers, ports.quiet));
        Ok(Self { reach, ..ports })
    }

    /// The local address, with the port that was taken.
    #[must_use]
    pub const fn local(&self) -> SocketAddrV4 {
        self.local
    }

    /// The two halves, for two threads; the sockets are closed with the last of them.
    #[must_use]
    pub fn split(self) -> (Sender, Receiver) {
        let lanes: Arc<[Lane]> = self.lanes.into();
        let sender = Sender::new(Arc::clone(&lanes), self.whole.map(Arc::new));
        (sender, Receiver::new(lanes, self.stray, self.ready, (self.quiet, self.reach)))
    }
}
