//! Datagrams of one sender who is named: anybody in a network can send some, and an address is what tells them apart.

use std::io;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use socket2::{Domain, Socket, Type};

use super::WordSink;
use crate::sys::batch::{Batch, stamp_arrivals};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::sys::listen;
use crate::time::{Clock as _, MonoTime};

/// How often it is looked whether anybody still listens.
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 250_000_000 };
/// A kernel's stamp that is older was made by another time of the day.
const OLDEST: Duration = Duration::from_millis(100);

/// Opens the port. Others on this machine may have it open as well: a network's timecode is for all.
pub(super) fn open(bind: SocketAddrV4) -> io::Result<Socket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, None)?;
    socket.set_reuse_address(true)?;
    socket.set_nonblocking(true)?;
    listen::free(&socket, (*bind.ip()).into())?; // its address may come later
    socket.bind(&bind.into())?;
    stamp_arrivals(&socket)?;
    Ok(socket)
}

/// Hands each datagram of the one who is named to `hear`, with the instant at which the kernel had it, until nobody listens. Another
/// who sends such as `is_one` says that they are is noted.
pub(super) fn read(
    socket: &Socket,
    named: Ipv4Addr,
    told: &WordSink,
    is_one: impl Fn(&[u8]) -> bool,
    mut hear: impl FnMut(&[u8], MonoTime),
) {
    let mut batch = Batch::new();
    while !told.is_over() {
        let mut wanted = [PollFd::new(socket, PollFlags::IN)];
        // Whatever this says, the socket says it again.
        let _ = poll(&mut wanted, Some(&LOOK));
        if batch.receive(socket).is_err() {
            continue;
        }
        let (now, wall_ns) = (Monotonic.now(), wall_now_ns());
        for datagram in batch.datagrams() {
            let age = datagram.stamp_ns.map_or(0, |stamp| wall_ns.saturating_sub(stamp));
            let age = Some(Duration::from_nanos(age)).filter(|age| *age < OLDEST).unwrap_or_default();
            let from = *datagram.from.ip();
            if (from == named || is_one(datagram.bytes)) && told.hears(named, from.into()) {
                hear(datagram.bytes, now.before(age));
            }
        }
    }
}
