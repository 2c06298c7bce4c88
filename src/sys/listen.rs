//! Sockets on addresses that this machine may not have yet, as before a slow switch or a DHCP server has given them: the kernel serves them
//! from when the address is there (`IP_FREEBIND` in ip(7)).

use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener, UdpSocket};

use socket2::{Domain, Socket, Type};

/// Connections that wait to be taken.
const WAITING: i32 = 128;

/// Lets a socket be bound to an address that this machine does not have.
///
/// # Errors
/// If the system refuses.
pub(crate) fn free(socket: &Socket, address: IpAddr) -> io::Result<()> {
    match address {
        IpAddr::V4(_) => socket.set_freebind_v4(true),
        IpAddr::V6(_) => socket.set_freebind_v6(true),
    }
}

/// A port that takes connections, as soon as its address is there.
///
/// # Errors
/// If the system does not give it, as where another program has it.
pub(crate) fn tcp(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = Socket::new(Domain::for_address(address), Type::STREAM, None)?;
    socket.set_reuse_address(true)?; // connections of a program that has ended hold nobody up
    free(&socket, address.ip())?;
    socket.bind(&address.into())?;
    socket.listen(WAITING)?;
    socket.set_nonblocking(true)?;
    Ok(socket.into())
}

/// A port that takes datagrams, as soon as its address is there.
///
/// # Errors
/// If the system does not give it, as where another program has it.
pub(crate) fn udp(address: SocketAddr) -> io::Result<UdpSocket> {
    let socket = Socket::new(Domain::for_address(address), Type::DGRAM, None)?;
    free(&socket, address.ip())?;
    socket.bind(&address.into())?;
    socket.set_nonblocking(true)?;
    Ok(socket.into())
}

/// True unless no network interface of this machine has the address.
pub(crate) fn is_here(address: IpAddr) -> bool {
    let bound = UdpSocket::bind((address, 0));
    !bound.is_err_and(|error| error.kind() == io::ErrorKind::AddrNotAvailable)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An address of documentation, which no machine should have (RFC 5737, RFC 3849).
    const NOWHERE: [&str; 2] = ["198.51.100.1:0", "[2001:db8::1]:0"];

    #[test]
    fn an_address_that_is_not_here_yet_is_bound_and_known_to_be_missing() {
        for address in NOWHERE {
            let address: SocketAddr = address.parse().unwrap();
            assert_eq!(tcp(address).unwrap().local_addr().unwrap().ip(), address.ip());
            assert_eq!(udp(address).unwrap().local_addr().unwrap().ip(), address.ip());
            assert!(!is_here(address.ip()));
        }
        assert!(is_here(IpAddr::from([127, 0, 0, 1])) && is_here(IpAddr::from([0, 0, 0, 0])));
    }

    #[test]
    fn a_port_that_another_has_is_refused() {
        let held = tcp("127.0.0.1:0".parse().unwrap()).unwrap().local_addr().unwrap();
        let holder = tcp(held).unwrap();
        assert_eq!(tcp(held).unwrap_err().kind(), io::ErrorKind::AddrInUse);
        let other = udp(held).unwrap();
        assert_eq!(udp(held).unwrap_err().kind(), io::ErrorKind::AddrInUse);
        drop((holder, other));
    }
}
