//! In place of the kernel's sockets: a network that somebody else makes, as tests of whole halls do in virtual time.

use std::fmt;
use std::sync::Arc;

use super::{Delivery, Origin, Receiver, SendFault, Sender};
use crate::time::MonoTime;

/// A network and its clock.
pub trait Network: fmt::Debug + Send + Sync {
    /// How many controllers it leads to.
    fn lanes(&self) -> usize;

    /// Takes a datagram to a controller, or does not.
    fn send(&self, lane: usize, datagram: &[u8]) -> Delivery;

    /// Takes a datagram to all of the network that is sent to as a whole, or does not.
    fn send_to_all(&self, _datagram: &[u8]) -> Delivery {
        Delivery::Failed(SendFault::of(libc::EOPNOTSUPP))
    }

    /// Gives every datagram that has arrived; as [`Receiver::drain`].
    fn drain(&self, on: &mut dyn FnMut(Origin, &[u8], MonoTime)) -> MonoTime;

    /// How often it was found so far that a controller's port is closed.
    fn port_closed(&self, lane: usize) -> u64;
}

/// The two halves of it.
#[must_use]
pub fn over(network: Arc<dyn Network>) -> (Sender, Receiver) {
    (Sender::over(Arc::clone(&network)), Receiver::over(network))
}
