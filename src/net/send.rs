//! Hands datagrams to the kernel. Tick thread: never blocks, never allocates, no failure stops the next controller.

use std::fmt;
use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use rustix::io::Errno;
use rustix::net::SendFlags;

use super::{Lane, Lead, Network};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// What became of a datagram on its way into the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivery {
    /// The kernel has it.
    Sent,
    /// The kernel has it, after reporting that an earlier datagram met a closed port.
    SentAfterRefusal,
    /// The kernel did not take it, and it will not be sent.
    Failed(SendFault),
}

/// Why the kernel did not take a datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SendFault {
    errno: i32,
}

impl SendFault {
    /// Kept back, because what it belongs to was called off.
    pub(crate) const CALLED_OFF: Self = Self { errno: libc::ECANCELED };
    /// Kept back, because this machine does not lead its hall, or not any more.
    pub(crate) const NOT_LEADING: Self = Self { errno: libc::EOWNERDEAD };

    /// That of a system's error number.
    #[must_use]
    pub const fn of(errno: i32) -> Self {
        Self { errno }
    }

    /// The system's error number.
    #[must_use]
    #[cfg(test)]
    pub(crate) const fn errno(self) -> i32 {
        self.errno
    }

    /// True if the controller's port is closed: it is restarting, or nothing listens there.
    #[must_use]
    #[cfg(test)]
    pub(crate) const fn refused(self) -> bool {
        self.errno == libc::ECONNREFUSED
    }

    const fn remedy(self) -> &'static str {
        match self.errno {
            libc::ECONNREFUSED => {
                "nothing listens on the controller's port: is it starting, is the port right?"
            }
            libc::EAGAIN => {
                "earlier frames still wait for the wire: is the controller on, is its address right?"
            }
            libc::ENETUNREACH | libc::EHOSTUNREACH | libc::ENETDOWN => {
                "no route to it: check the cable and this machine's address"
            }
            libc::ECANCELED => "it was cancelled",
            libc::EOWNERDEAD => "the other show machine of the hall may lead it: look there",
            libc::EPERM | libc::EACCES => "a firewall of this machine blocks it",
            _ => "the system is out of some resource; see its log",
        }
    }
}

impl fmt::Display for SendFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", io::Error::from_raw_os_error(self.errno), self.remedy())
    }
}

/// The sending half of [`Ports`](super::Ports), or of a [`Network`]. Clones send by the same sockets.
#[derive(Debug, Clone)]
pub struct Sender {
    way: SendWay,
    /// Until when it sends, where that may end.
    lead: Option<Arc<Lead>>,
}

/// Where datagrams go.
#[derive(Debug, Clone)]
enum SendWay {
    Kernel { lanes: Arc<[Lane]>, whole: Option<Arc<Lane>> },
    Network(Arc<dyn Network>),
}

impl Sender {
    pub(super) const fn new(lanes: Arc<[Lane]>, whole: Option<Arc<Lane>>) -> Self {
        Self { way: SendWay::Kernel { lanes, whole }, lead: None }
    }

    pub(super) const fn over(network: Arc<dyn Network>) -> Self {
        Self { way: SendWay::Network(network), lead: None }
    }

    /// The same for as long as that lasts; without it, for ever.
    #[must_use]
    pub fn led_by(self, lead: Option<Arc<Lead>>) -> Self {
        Self { lead, ..self }
    }

    /// How long it sends, where that may end.
    #[must_use]
    pub(crate) fn lead(&self) -> Option<Arc<Lead>> {
        self.lead.clone()
    }

    /// True if nothing may leave any more.
    fn is_over(&self) -> bool {
        self.lead.as_ref().is_some_and(|lead| lead.is_over(Monotonic.now()))
    }

    /// Sends one datagram to controller `lane`, counted from 0 in the order in which they were opened.
    ///
    /// The kernel reports a closed port by failing a *later* call, without having sent that one's datagram; so it is
    /// sent once more, at once. There is no other retry: late motion is worse than none. Each time the lead is looked at right
    /// before: a thread may have been held up anywhere until then.
    ///
    /// # Panics
    /// If there is no such lane.
    pub(crate) fn send(&self, lane: usize, datagram: &[u8]) -> Delivery {
        if self.is_over() {
            return Delivery::Failed(SendFault::NOT_LEADING);
        }
        let lane = match &self.way {
            SendWay::Kernel { lanes, .. } => &lanes[lane],
            SendWay::Network(network) => return network.send(lane, datagram),
        };
        self.send_by(lane, datagram)
    }

    /// Sends one datagram to all of the network that is sent to as a whole; as [`Sender::send`].
    ///
    /// # Panics
    /// If none was opened.
    pub(crate) fn send_to_all(&self, datagram: &[u8]) -> Delivery {
        if self.is_over() {
            return Delivery::Failed(SendFault::NOT_LEADING);
        }
        match &self.way {
            SendWay::Kernel { whole, .. } => {
                self.send_by(whole.as_ref().expect("its network was opened"), datagram)
            }
            SendWay::Network(network) => network.send_to_all(datagram),
        }
    }

    fn send_by(&self, lane: &Lane, datagram: &[u8]) -> Delivery {
        if lane.away.load(Ordering::Acquire) {
            return failed(Errno::NETUNREACH);
        }
        match lane.send(datagram) {
            Ok(()) => Delivery::Sent,
            Err(Errno::CONNREFUSED) if self.is_over() => Delivery::Failed(SendFault::NOT_LEADING),
            Err(Errno::CONNREFUSED) => match lane.send(datagram) {
                Ok(()) => Delivery::SentAfterRefusal,
                Err(errno) => failed(errno),
            },
            Err(errno) => failed(errno),
        }
    }
}

fn failed(errno: Errno) -> Delivery {
    Delivery::Failed(SendFault::of(errno.raw_os_error()))
}

impl Lane {
    fn send(&self, datagram: &[u8]) -> Result<(), Errno> {
        let sent = rustix::net::send(&self.socket, datagram, SendFlags::DONTWAIT | SendFlags::NOSIGNAL);
        if sent == Err(Errno::CONNREFUSED) {
            self.refusals.fetch_add(1, Ordering::Relaxed);
        }
        sent.map(|_bytes| ())
    }
}
