//! Why the sockets of a show cannot be opened.

use std::io;
use std::net::{Ipv4Addr, SocketAddrV4};

use crate::sys::file::want_of_files;

/// What keeps the sockets from being opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetError {
    /// Two controllers with one address: their replies could not be told apart.
    #[error("the controller address {0} is given twice; each controller needs its own")]
    Twice(SocketAddrV4),

    /// An address that is no single controller's.
    #[error("{0} is not the address of one controller; give its own IPv4 address and a port from 1 to 65535")]
    NotUnicast(SocketAddrV4),

    /// A broadcast would not come from where its controllers answer to.
    #[error(
        "what is broadcast to {network} would leave from {from}, and what goes to its controllers alone from {other}; bind that \
         address in [show], or take the [broadcast] table out"
    )]
    OtherWay {
        /// The broadcast address.
        network: SocketAddrV4,
        /// From where it would leave.
        from: Ipv4Addr,
        /// From where the rest does.
        other: Ipv4Addr,
    },

    /// A broadcast would go to no network of this machine.
    #[error(
        "{0} is the broadcast address of no network of this machine; correct the network in [broadcast], or this machine's address and mask"
    )]
    NoBroadcast(SocketAddrV4),

    /// A controller is not where a broadcast goes.
    #[error(
        "{controller} is not reached by the network of {bits} bits that {network} goes to; correct the network in [broadcast], or the \
         addresses, masks and routes of this machine"
    )]
    OffTheWire {
        /// The broadcast address.
        network: SocketAddrV4,
        /// How many bits the addresses of its network have in common.
        bits: u8,
        /// The controller.
        controller: SocketAddrV4,
    },

    /// The system refused.
    #[error("cannot {attempt} {address}; {remedy}")]
    Refused {
        /// What was attempted, in words that lead to the address.
        attempt: &'static str,
        /// Where: the local address, or the controller's.
        address: SocketAddrV4,
        /// What a person can do about it.
        remedy: &'static str,
        /// What the system said.
        #[source]
        cause: io::Error,
    },
}

impl NetError {
    /// The refusal of `attempt` at `address`, with the remedy that fits its cause.
    pub(super) fn refused(attempt: &'static str, address: SocketAddrV4, cause: io::Error) -> Self {
        let of_errno = || match cause.raw_os_error() {
            Some(libc::EADDRINUSE) => {
                "another program holds the port, perhaps a second kinocue: end it, or bind another port"
            }
            Some(libc::EADDRNOTAVAIL) => "no network interface has this address: bind one of this machine's",
            Some(libc::EACCES | libc::EPERM) => {
                "ports below 1024 and broadcast addresses are not allowed: use another"
            }
            Some(libc::ENETUNREACH | libc::EHOSTUNREACH) => {
                "no route to it: check the cable and this machine's address and mask"
            }
            Some(libc::EINVAL) => {
                "the local address that is bound does not lead there: give --bind (or bind under [show]) this \
                 machine's address in the controllers' network, or 0.0.0.0"
            }
            _ => "check the network settings of this machine",
        };
        let remedy = want_of_files(&cause).unwrap_or_else(of_errno);
        Self::Refused { attempt, address, remedy, cause }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_address_that_leads_nowhere_is_named_as_what_to_change() {
        let cause = io::Error::from_raw_os_error(libc::EINVAL);
        let peer = "192.168.15.201:7408".parse().unwrap();
        let error = NetError::refused("reach the controller", peer, cause).to_string();
        assert!(error.starts_with("cannot reach the controller 192.168.15.201:7408; "), "{error}");
        assert!(error.contains("--bind (or bind under [show])"), "{error}");
    }
}
