//! OSC over UDP: messages of show-control gear in, asks of the hall out, and feedback to whoever subscribed. Control plane.
//!
//! A datagram proves nothing about who sent it, so that it may never arm, home or clear: whoever forges one plays at worst
//! what a person has armed, or stops it. Off unless the configuration has `[osc]`.
//!
//! ```text
//!  in   /kinocue/go   /kinocue/pause   /kinocue/resume   /kinocue/stop   /kinocue/park
//!       /kinocue/seek f(s)   /kinocue/trim f(ms)   /kinocue/nudge i(frames)   /kinocue/level/motion f   /kinocue/level/vibration f
//!       /kinocue/effect/NAME i   /kinocue/row/ROW/level f   /kinocue/seat/NAME/enable i
//!       /kinocue/subscribe i(port) i(s)
//!  out  /kinocue/state s   /kinocue/position f(s)   /kinocue/warning is   /kinocue/heartbeat i(s)
//! ```

mod counts;
mod feedback;
mod order;
mod packet;
mod port;
mod repeats;
mod subscribers;
#[cfg(test)]
mod tests;

use std::io;
use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::Arc;

pub(crate) use counts::Counts;

use crate::config::OscPort;
use crate::control::Handle;
use crate::sys::listen;
use port::OscPortState;

/// Why the port cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("{address} cannot be had for OSC: {cause}")]
#[non_exhaustive]
pub(crate) struct OscError {
    /// Where it was to listen.
    pub(crate) address: SocketAddrV4,
    /// What the system said.
    #[source]
    pub(crate) cause: io::Error,
}

/// The port, open but not yet served.
#[derive(Debug)]
pub(crate) struct Osc {
    socket: UdpSocket,
    config: OscPort,
    hall: Handle,
    counts: Arc<Counts>,
}

/// Opens the port that the configuration names; its address may come later. What comes is counted.
///
/// # Errors
/// [`OscError`] where the system does not give it.
pub(crate) fn open(config: &OscPort, hall: Handle, counts: Arc<Counts>) -> Result<Osc, OscError> {
    let refused = |cause| OscError { address: config.listen, cause };
    let socket = listen::udp(SocketAddr::V4(config.listen)).map_err(refused)?;
    Ok(Osc { socket, config: config.clone(), hall, counts })
}

impl Osc {
    /// Where it listens.
    ///
    /// # Errors
    /// If the system does not say.
    #[cfg(test)]
    pub(crate) fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Serves the port until its future is dropped. To be awaited within a tokio runtime with time and network.
    ///
    /// # Errors
    /// If the socket fails; it never ends otherwise.
    pub(crate) async fn serve(self) -> io::Result<std::convert::Infallible> {
        let incoming = tokio::net::UdpSocket::from_std(self.socket.try_clone()?)?;
        OscPortState::new(self.socket, self.config, self.hall, self.counts).serve(&incoming).await
    }
}

/// What any datagram asks of a hall that allows whatever can be allowed.
#[cfg(feature = "harness")]
pub(crate) fn try_datagram(datagram: &[u8]) -> Vec<crate::control::Command> {
    let all = crate::config::GearWord::ALL.map(|(_, word)| word);
    let messages = packet::read(datagram, 0).into_iter().flatten();
    let orders = messages.filter_map(|timed| order::order(&timed.message, &all).ok());
    let commands = orders.filter_map(|order| match order {
        order::OscOrder::Command(command) => Some(command),
        order::OscOrder::Subscribe { .. } | order::OscOrder::Released => None,
    });
    commands.collect()
}
