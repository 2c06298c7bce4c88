//! Many datagrams from a socket in one system call, each with the instant at which the kernel received it.

use std::io;
use std::mem;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};
use std::ptr;

/// The most datagrams that one call takes.
pub const SLOTS: usize = 32;

/// Bytes kept of each datagram; the protocol's longest is far shorter, and a longer one is marked as truncated.
pub(crate) const DATAGRAM_LEN: usize = 2_048;

/// Room for the one control message asked for, a `timespec`, twice over.
const CONTROL_LEN: usize = 64;

/// Aligned as `cmsghdr`, which the kernel writes into it.
#[derive(Clone, Copy)]
#[repr(C, align(8))]
struct Control([u8; CONTROL_LEN]);

/// One datagram of a [`Batch`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Datagram<'a> {
    /// Who sent it.
    pub from: SocketAddrV4,
    /// What was sent; the first [`DATAGRAM_LEN`] bytes where there were more.
    pub bytes: &'a [u8],
    /// True if bytes past [`DATAGRAM_LEN`] were thrown away.
    pub(crate) truncated: bool,
    /// Wall clock at which the kernel received it, nanoseconds since 1970; only from a socket given to
    /// [`stamp_arrivals`].
    pub stamp_ns: Option<u64>,
}

/// What the kernel said about one filled slot.
#[derive(Clone, Copy)]
struct Arrival {
    from: SocketAddrV4,
    len: usize,
    truncated: bool,
    stamp_ns: Option<u64>,
}

impl Arrival {
    const NONE: Self =
        Self { from: SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 0), len: 0, truncated: false, stamp_ns: None };
}

/// Memory for [`SLOTS`] datagrams, made once and filled again and again.
pub struct Batch {
    buffers: Box<[[u8; DATAGRAM_LEN]]>,
    arrivals: [Arrival; SLOTS],
    filled: usize,
}

impl Default for Batch {
    fn default() -> Self {
        Self::new()
    }
}

impl Batch {
    /// An empty batch; the only place that allocates.
    #[must_use]
    pub fn new() -> Self {
        Self {
            buffers: vec![[0; DATAGRAM_LEN]; SLOTS].into_boxed_slice(),
            arrivals: [Arrival::NONE; SLOTS],
            filled: 0,
        }
    }

    /// Takes what waits in an IPv4 socket, up to [`SLOTS`] datagrams, instead of what was held before; returns how
    /// many. Never blocks, never allocates. Fewer than [`SLOTS`] means that no more were waiting.
    ///
    /// # Errors
    /// What the socket has to report, `WouldBlock` if nothing waits. An error that comes after some datagrams is
    /// reported by the next call.
    pub fn receive(&mut self, socket: impl AsFd) -> io::Result<usize> {
        self.filled = 0;
        self.filled = receive(socket.as_fd(), &mut self.buffers, &mut self.arrivals)?;
        Ok(self.filled)
    }

    /// What the last [`Batch::receive`] took, in the order of arrival.
    pub fn datagrams(&self) -> impl Iterator<Item = Datagram<'_>> {
        self.arrivals[..self.filled].iter().zip(&self.buffers).map(|(arrival, buffer)| Datagram {
            from: arrival.from,
            bytes: &buffer[..arrival.len.min(DATAGRAM_LEN)],
            truncated: arrival.truncated,
            stamp_ns: arrival.stamp_ns,
        })
    }
}

/// Has the kernel note the wall clock at which each datagram of this socket arrives (`SO_TIMESTAMPNS`).
///
/// # Errors
/// If the kernel refuses.
#[expect(unsafe_code, reason = "no safe wrapper of this option exists among our dependencies")]
pub fn stamp_arrivals(socket: impl AsFd) -> io::Result<()> {
    let on: libc::c_int = 1;
    let len = libc::socklen_t::try_from(size_of_val(&on)).expect("four bytes");
    // SAFETY: the descriptor is borrowed and so open; the option's value is a live `int` of the length told.
    let answer = unsafe {
        libc::setsockopt(
            socket.as_fd().as_raw_fd(),
            libc::SOL_SOCKET,
            libc::SO_TIMESTAMPNS,
            (&raw const on).cast(),
            len,
        )
    };
    if answer < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// The headers are built anew for each call: they point into the buffers, and a pointer kept from call to call would
/// have to outlive every borrow of them.
#[expect(unsafe_code, reason = "no safe wrapper of recvmmsg exists among our dependencies")]
fn receive(
    socket: BorrowedFd<'_>,
    buffers: &mut [[u8; DATAGRAM_LEN]],
    arrivals: &mut [Arrival; SLOTS],
) -> io::Result<usize> {
    // SAFETY: all three are plain C structures of integers and pointers, for which all-zero bytes are a valid value.
    let (mut headers, mut names, mut vectors): (
        [libc::mmsghdr; SLOTS],
        [libc::sockaddr_in; SLOTS],
        [libc::iovec; SLOTS],
    ) = unsafe { mem::zeroed() };
    let mut controls = [Control([0; CONTROL_LEN]); SLOTS];

    let slots = headers.iter_mut().zip(&mut names).zip(&mut vectors).zip(&mut controls).zip(buffers);
    for ((((header, name), vector), control), buffer) in slots {
        vector.iov_base = buffer.as_mut_ptr().cast();
        vector.iov_len = buffer.len();
        header.msg_hdr.msg_name = ptr::from_mut(name).cast();
        header.msg_hdr.msg_namelen = NAME_LEN;
        header.msg_hdr.msg_iov = vector;
        header.msg_hdr.msg_iovlen = 1;
        header.msg_hdr.msg_control = control.0.as_mut_ptr().cast();
        header.msg_hdr.msg_controllen = CONTROL_LEN;
    }

    // SAFETY: the descriptor is borrowed and so open. Each of the `SLOTS` headers points to a name, one vector, its
    // buffer and a control buffer with their true lengths; all of them live in this frame or in the exclusively
    // borrowed `buffers` and are not touched while the kernel writes. A null timeout is allowed.
    let count = unsafe {
        libc::recvmmsg(socket.as_raw_fd(), headers.as_mut_ptr(), VLEN, libc::MSG_DONTWAIT, ptr::null_mut())
    };
    let count = usize::try_from(count).map_err(|_| io::Error::last_os_error())?;
    for ((arrival, header), name) in arrivals.iter_mut().zip(&headers).zip(&names).take(count) {
        *arrival = Arrival {
            from: SocketAddrV4::new(
                Ipv4Addr::from(u32::from_be(name.sin_addr.s_addr)),
                u16::from_be(name.sin_port),
            ),
            len: usize::try_from(header.msg_len).unwrap_or(DATAGRAM_LEN),
            truncated: header.msg_hdr.msg_flags & libc::MSG_TRUNC != 0,
            stamp_ns: stamp(&header.msg_hdr),
        };
    }
    Ok(count)
}

const VLEN: libc::c_uint = 32;
const NAME_LEN: libc::socklen_t = 16;
const _: () = assert!(SLOTS == VLEN as usize && size_of::<libc::sockaddr_in>() == NAME_LEN as usize);

/// The stamp among the control messages of a header that [`receive`] filled.
#[expect(unsafe_code, reason = "control messages can be walked with pointers only")]
fn stamp(header: &libc::msghdr) -> Option<u64> {
    // SAFETY: `receive` gave the header a control buffer that is alive and aligned for `cmsghdr`, and the kernel has
    // set `msg_controllen` to what it wrote there; the CMSG macros do not leave that range, so `message` is null or
    // points to a whole `cmsghdr`.
    let mut message = unsafe { libc::CMSG_FIRSTHDR(header) };
    while !message.is_null() {
        // SAFETY: not null, so a whole control message within the buffer, as above.
        let (level, kind, len) =
            unsafe { ((*message).cmsg_level, (*message).cmsg_type, (*message).cmsg_len) };
        // SAFETY: CMSG_LEN only computes.
        let whole = len >= unsafe { libc::CMSG_LEN(TIMESPEC_LEN) } as usize;
        if level == libc::SOL_SOCKET && kind == libc::SCM_TIMESTAMPNS && whole {
            // SAFETY: the message is long enough for a `timespec` (just checked); its data may be unaligned.
            let at = unsafe { ptr::read_unaligned(libc::CMSG_DATA(message).cast::<libc::timespec>()) };
            let (seconds, ns) = (u64::try_from(at.tv_sec).ok()?, u64::try_from(at.tv_nsec).ok()?);
            return Some(seconds.saturating_mul(1_000_000_000).saturating_add(ns));
        }
        // SAFETY: `message` is a control message of this header, as above.
        message = unsafe { libc::CMSG_NXTHDR(header, message) };
    }
    None
}

const TIMESPEC_LEN: libc::c_uint = 16;
const _: () = assert!(size_of::<libc::timespec>() == TIMESPEC_LEN as usize);

#[cfg(test)]
mod tests {
    use std::net::{SocketAddr, UdpSocket};
    use std::time::Duration;

    use super::*;
    use crate::sys::clock::wall_now_ns;

    fn pair() -> (UdpSocket, UdpSocket) {
        let socket = || UdpSocket::bind("127.0.0.1:0").unwrap();
        let (a, b) = (socket(), socket());
        a.connect(b.local_addr().unwrap()).unwrap();
        (a, b)
    }

    /// Receives until `count` datagrams have come, and gives what `look` made of each.
    fn take<T>(socket: &UdpSocket, count: usize, mut look: impl FnMut(Datagram<'_>) -> T) -> Vec<T> {
        socket.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let (mut batch, mut got) = (Batch::new(), Vec::new());
        while got.len() < count {
            socket.peek(&mut [0; 1]).unwrap(); // waits
            assert!(batch.receive(socket).unwrap() <= SLOTS);
            got.extend(batch.datagrams().map(&mut look));
        }
        got
    }

    #[test]
    fn a_batch_holds_source_bytes_and_stamp_of_each_datagram() {
        let (a, b) = pair();
        stamp_arrivals(&b).unwrap();
        let before = wall_now_ns();
        a.send(b"one").unwrap();
        a.send(b"").unwrap();
        let got = take(&b, 2, |datagram| {
            assert_eq!(SocketAddr::V4(datagram.from), a.local_addr().unwrap());
            assert!(!datagram.truncated);
            let stamp = datagram.stamp_ns.unwrap();
            assert!(before <= stamp && stamp <= wall_now_ns(), "{before} {stamp}");
            datagram.bytes.to_vec()
        });
        assert_eq!(got, [&b"one"[..], b""]);
    }

    #[test]
    fn a_datagram_too_long_is_cut_and_says_so() {
        let (a, b) = pair();
        a.send(&[7; DATAGRAM_LEN + 1]).unwrap();
        let got = take(&b, 1, |datagram| (datagram.bytes.len(), datagram.truncated, datagram.stamp_ns));
        assert_eq!(got, [(DATAGRAM_LEN, true, None)]);
    }

    #[test]
    fn an_empty_socket_would_block_and_leaves_the_batch_empty() {
        let (a, b) = pair();
        let mut batch = Batch::new();
        a.send(b"x").unwrap();
        b.peek(&mut [0; 1]).unwrap();
        batch.receive(&b).unwrap();
        assert_eq!(batch.receive(&b).unwrap_err().kind(), io::ErrorKind::WouldBlock);
        assert_eq!(batch.datagrams().count(), 0);
    }

    #[test]
    fn what_does_not_fit_into_one_batch_comes_with_the_next() {
        let (a, b) = pair();
        for n in 0..=SLOTS {
            a.send(&[u8::try_from(n).unwrap()]).unwrap();
        }
        let got = take(&b, SLOTS + 1, |datagram| usize::from(datagram.bytes[0]));
        assert!(got.into_iter().eq(0..=SLOTS));
    }
}
