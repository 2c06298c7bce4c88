//! The way to a controller as the kernel would choose it.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};

/// The way to a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Route {
    /// The address of this machine that the controller sees.
    pub(crate) local: Ipv4Addr,
    /// The largest IP packet that goes there in one piece, bytes.
    pub(crate) mtu: u32,
}

/// The way from `bind`, which may be unspecified, to `peer`. Sends nothing.
///
/// # Errors
/// If the system knows no way, or `bind` is no address of this machine.
pub(crate) fn route(bind: Ipv4Addr, peer: SocketAddrV4) -> io::Result<Route> {
    let socket = UdpSocket::bind(SocketAddrV4::new(bind, 0))?;
    socket.connect(peer)?;
    let mtu = rustix::net::sockopt::ip_mtu(&socket)?;
    match socket.local_addr()? {
        SocketAddr::V4(local) => Ok(Route { local: *local.ip(), mtu }),
        SocketAddr::V6(_) => Err(io::ErrorKind::AddrNotAvailable.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_machine_is_reached_from_itself() {
        let peer = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 7_408);
        let route = route(Ipv4Addr::UNSPECIFIED, peer).unwrap();
        assert_eq!(route.local, Ipv4Addr::LOCALHOST);
        assert!(route.mtu >= 1_280, "{route:?}");
    }

    #[test]
    fn an_address_of_nobody_here_is_no_place_to_send_from() {
        let peer = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 7_408);
        assert!(route(Ipv4Addr::new(192, 0, 2, 1), peer).is_err());
    }
}
