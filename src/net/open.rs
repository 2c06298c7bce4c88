//! Opens the sockets in the one order that keeps every other program off the port.

use std::collections::HashSet;
use std::io;
use std::net::SocketAddrV4;
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use socket2::{Domain, Protocol, Socket, Type};

use super::ready::Ready;
use super::way::way;
use super::{Lane, NetError, Ports, Whole};
use crate::sys::batch::{Batch, stamp_arrivals};
use crate::sys::clock::Monotonic;
use crate::sys::listen;
use crate::time::Clock;

/// Bytes of replies that may wait in a socket; the kernel cuts it to what it allows. Generous, so that an ack thread
/// kept from running for a while finds them all.
const RECEIVE_BUFFER_LEN: usize = 1 << 20;

/// Batches read from a socket at most to quiet it. A receive buffer holds far fewer.
const QUIET_BATCHES: usize = 1_024;

/// The socket for strangers binds first and alone, which fails if anyone has the port. Only then may the port be
/// shared, and only until all of ours are bound: a permission left on any socket would let another program in.
pub(super) fn open(
    bind: SocketAddrV4,
    peers: &[SocketAddrV4],
    network: Option<&Whole>,
    may_come: bool,
) -> Result<Ports, NetError> {
    check(peers)?;
    let at_bind = |cause| NetError::refused("bind UDP address", bind, cause);
    let stray = socket(may_come).map_err(at_bind)?;
    stray.bind(&bind.into()).map_err(at_bind)?;
    let local = local_address(&stray).map_err(at_bind)?;
    stray.set_reuse_address(true).map_err(at_bind)?;
    stamp_arrivals(&stray).map_err(at_bind)?;

    let lanes = peers.iter().map(|&peer| lane(local, peer, may_come)).collect::<Result<Vec<_>, _>>()?;
    let whole = network.map(|network| whole(local, network, peers, &lanes)).transpose()?;

    for socket in lanes.iter().chain(&whole).map(|lane| &lane.socket).chain([&stray]) {
        socket.set_reuse_address(false).map_err(at_bind)?;
    }
    let quiet_from = Monotonic.now();
    let mut batch = Batch::new();
    for socket in lanes.iter().map(|lane| &lane.socket).chain([&stray]) {
        quiet(&mut batch, socket);
    }
    let ready = Ready::of(lanes.iter().map(|lane| &lane.socket).chain([&stray])).map_err(at_bind)?;
    Ok(Ports { local, lanes, whole, stray, ready, quiet: quiet_from, reach: None })
}

fn check(peers: &[SocketAddrV4]) -> Result<(), NetError> {
    let mut seen = HashSet::new();
    for &peer in peers {
        let ip = peer.ip();
        if ip.is_unspecified() || ip.is_multicast() || ip.is_broadcast() || peer.port() == 0 {
            return Err(NetError::NotUnicast(peer));
        }
        if !seen.insert(peer) {
            return Err(NetError::Twice(peer));
        }
    }
    Ok(())
}

/// A socket, whose address may come later.
fn socket(may_come: bool) -> io::Result<Socket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_nonblocking(true)?;
    socket.set_freebind_v4(may_come)?;
    Ok(socket)
}

pub(super) fn local_address(socket: &Socket) -> io::Result<SocketAddrV4> {
    socket.local_addr()?.as_socket_ipv4().ok_or_else(|| io::ErrorKind::AddrNotAvailable.into())
}

/// The socket of a controller; where the way to it may come, it is there without.
fn lane(local: SocketAddrV4, peer: SocketAddrV4, may_come: bool) -> Result<Lane, NetError> {
    let lane = bound(local, may_come, |_| Ok(()))?;
    match lane.connect(peer) {
        Err(cause) if may_come && is_missing(&cause, local) => lane.away.store(true, Ordering::Relaxed),
        connected => connected.map_err(|cause| NetError::refused("reach the controller", peer, cause))?,
    }
    Ok(lane)
}

/// True if there is no way because an address or a network of this machine is not there, which may change by itself.
fn is_missing(cause: &io::Error, local: SocketAddrV4) -> bool {
    match cause.raw_os_error() {
        Some(libc::ENETUNREACH | libc::EHOSTUNREACH | libc::ENETDOWN | libc::EADDRNOTAVAIL) => true,
        // From an address that is here, it is one that never leads there.
        Some(libc::EINVAL) => !listen::is_here((*local.ip()).into()),
        _ => false,
    }
}

/// The socket of a network that is sent to as a whole. What it sends has to go to where its controllers are, and nowhere else: no router
/// carries it on, whatever becomes of the routes. And it has to come from where they answer to.
fn whole(
    local: SocketAddrV4,
    network: &Whole,
    peers: &[SocketAddrV4],
    lanes: &[Lane],
) -> Result<Lane, NetError> {
    let Whole { address, bits, lanes: members } = network;
    let at = |cause| NetError::refused("broadcast to", *address, cause);
    let to_all = way(*local.ip(), *address.ip()).map_err(at)?;
    if !to_all.is_broadcast {
        return Err(NetError::NoBroadcast(*address));
    }
    let set = |socket: &Socket| socket.set_broadcast(true).and_then(|()| socket.set_ttl_v4(1));
    let whole = bound(local, false, set)?;
    whole.connect(*address).map_err(at)?;
    let from = *local_address(&whole.socket).map_err(at)?.ip();
    for member in members {
        let to_one = way(*local.ip(), *peers[*member].ip()).map_err(at)?;
        if to_one.is_carried_on || to_one.bits != *bits || to_one.interface != to_all.interface {
            return Err(NetError::OffTheWire { network: *address, bits: *bits, controller: peers[*member] });
        }
        let other = *local_address(&lanes[*member].socket).map_err(at)?.ip();
        if other != from {
            return Err(NetError::OtherWay { network: *address, from, other });
        }
    }
    Ok(whole)
}

fn bound(
    local: SocketAddrV4,
    may_come: bool,
    set: impl Fn(&Socket) -> io::Result<()>,
) -> Result<Lane, NetError> {
    let at_bind = |cause| NetError::refused("bind UDP address", local, cause);
    let socket = socket(may_come).map_err(at_bind)?;
    prepare(&socket).and_then(|()| set(&socket)).map_err(at_bind)?;
    socket.bind(&local.into()).map_err(at_bind)?;
    Ok(Lane { socket, refusals: AtomicU64::new(0), away: AtomicBool::new(false) })
}

fn prepare(socket: &Socket) -> io::Result<()> {
    socket.set_reuse_address(true)?;
    // The kernel's minimum: after a cable cut, what waits for the wire is thrown away rather than delivered late in one
    // burst.
    socket.set_send_buffer_size(1)?;
    socket.set_recv_buffer_size(RECEIVE_BUFFER_LEN)?;
    stamp_arrivals(socket)
}

/// Reads away what came while the socket was bound but not yet connected: anyone could have sent that.
pub(super) fn quiet(batch: &mut Batch, socket: impl AsFd) {
    for _ in 0..QUIET_BATCHES {
        // Any other error is an earlier datagram's, and gone once read.
        if batch.receive(socket.as_fd()).is_err_and(|e| e.kind() == io::ErrorKind::WouldBlock) {
            return;
        }
    }
}
