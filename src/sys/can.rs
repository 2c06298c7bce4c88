//! CAN buses by SocketCAN: frames with an identifier of eleven bits and eight octets, out and in, each call with an absolute deadline.
//! The bit rate is the system's. Threads of links.
//!
//! A frame that was handed over waits in the interface until somebody on the bus acknowledges it, however long that takes, and nobody can
//! take it back: so a master reads its own frames too, which come back once they have left.

use std::fs;
use std::io;
use std::num::NonZeroU32;
use std::os::fd::{AsRawFd as _, OwnedFd};
use std::path::Path;

use rustix::io::Errno;
use rustix::net::netdevice::name_to_index;
use rustix::net::{
    AddressFamily, Protocol, SocketAddrUnix, SocketFlags, SocketType, bind, socket_with, sockopt,
};

use super::serial::{CanError, OctetLine, PortFault, QUEUE};
use crate::time::MonoTime;

/// Octets of a frame as the kernel has it: identifier and flags, length, three of nothing, data.
const FRAME_LEN: usize = 16;
/// Octets of data: frames of any other length are none of ours.
const DATA_LEN: u8 = 8;
/// Nobody waits for a socket, and no other program gets it.
const FLAGS: SocketFlags = SocketFlags::NONBLOCK.union(SocketFlags::CLOEXEC);
/// Where interfaces tell how they are.
const INTERFACES: &str = "/sys/class/net";

/// Which identifiers are read, the others stay in the kernel: those that are `id` in the bits of `mask`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CanIds {
    /// Their bits.
    pub(crate) id: u16,
    /// Which bits.
    pub(crate) mask: u16,
}

/// A frame: its identifier, and its octets.
pub(crate) type Framed = (u16, [u8; DATA_LEN as usize]);

/// A bus that no other kinocue of this machine sends on until this is dropped.
#[derive(Debug)]
pub(crate) struct CanSocket {
    line: OctetLine,
    /// Taken in the name of the bus: the kernel gives it to one socket alone.
    _name: Option<OwnedFd>,
}

impl CanSocket {
    /// Opens the bus of an interface.
    ///
    /// # Errors
    /// A [`CanError`] that says what to do.
    pub(crate) fn open(interface: &Path, ids: CanIds) -> Result<Self, CanError> {
        let refused = |errno| CanError::of(interface, errno);
        let fd = bus(interface, ids, true)?;
        let lock = socket_with(AddressFamily::UNIX, SocketType::DGRAM, FLAGS, None).map_err(refused)?;
        let name = format!("kinocue-{}", interface.to_string_lossy());
        let name = SocketAddrUnix::new_abstract_name(name.as_bytes()).map_err(refused)?;
        bind(&lock, &name).map_err(refused)?;
        is_fit(Path::new(INTERFACES), interface)?;
        Ok(Self { line: OctetLine(fd), _name: Some(lock) })
    }

    /// The bus as a unit on it has it, beside its master.
    #[cfg(test)]
    pub(crate) fn join(interface: &Path, ids: CanIds) -> Result<Self, CanError> {
        Ok(Self { line: OctetLine(bus(interface, ids, false)?), _name: None })
    }

    /// Two ends of a bus that is none: what is sent on one is received on the other.
    #[cfg(test)]
    pub(crate) fn pair() -> io::Result<(Self, Self)> {
        let (near, far) = rustix::net::socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, FLAGS, None)?;
        let [near, far] = [near, far].map(|fd| Self { line: OctetLine(fd), _name: None });
        Ok((near, far))
    }

    /// Hands a frame over, where there is room by then; false where there is none.
    ///
    /// # Errors
    /// A [`PortFault`] where the bus is gone, or its queue is full.
    pub(crate) fn send(&self, (id, octets): Framed, deadline: MonoTime) -> Result<bool, PortFault> {
        let mut frame = [0; FRAME_LEN];
        frame[..4].copy_from_slice(&u32::from(id).to_ne_bytes());
        frame[4] = DATA_LEN;
        frame[8..].copy_from_slice(&octets);
        Ok(self.line.write(&frame, deadline)? == FRAME_LEN)
    }

    /// The next frame that is one of ours by its form, waited for until `deadline`; a deadline that is past takes what is there already.
    ///
    /// # Errors
    /// A [`PortFault`] where the interface is gone or down, or its controller has left the bus.
    pub(crate) fn receive(&self, deadline: MonoTime) -> Result<Option<Framed>, PortFault> {
        let mut frame = [0; FRAME_LEN];
        loop {
            match self.line.read(&mut frame, deadline)? {
                0 => return Ok(None),
                FRAME_LEN => {}
                _ => continue,
            }
            let ([a, b, c, d, length, _, _, _], octets) = split(frame);
            let id = u32::from_ne_bytes([a, b, c, d]);
            if id & libc::CAN_ERR_FLAG != 0 && id & libc::CAN_ERR_BUSOFF != 0 {
                return Err(PortFault::Vanished);
            }
            // Flags are in bits above those of an identifier.
            if let Ok(id) = u16::try_from(id)
                && length == DATA_LEN
            {
                return Ok(Some((id, octets)));
            }
        }
    }
}

fn split(frame: [u8; FRAME_LEN]) -> ([u8; 8], [u8; 8]) {
    let halves = frame.as_chunks::<8>().0;
    (halves[0], halves[1])
}

/// A socket of the bus of an interface, which may read what it sends itself.
fn bus(interface: &Path, ids: CanIds, reads_own: bool) -> Result<OwnedFd, CanError> {
    let refused = |errno| CanError::of(interface, errno);
    let raw = NonZeroU32::new(libc::CAN_RAW.unsigned_abs()).map(Protocol::from_raw);
    let fd = socket_with(AddressFamily::CAN, SocketType::RAW, FLAGS, raw).map_err(refused)?;
    let index = name_to_index(&fd, &interface.to_string_lossy()).map_err(refused)?;
    limit(&fd, ids, reads_own).map_err(refused)?;
    bind_to(&fd, index).map_err(|errno| match errno {
        Errno::NODEV => CanError::Other(interface.to_owned()),
        errno => refused(errno),
    })?;
    // One that is down is bound all the same.
    sockopt::socket_error(&fd).and_then(|error| error).map_err(refused)?;
    Ok(fd)
}

/// Of what there is on the bus only frames with those identifiers are read, maybe those that the socket sends itself, and that the
/// controller has left it.
fn limit(fd: &OwnedFd, ids: CanIds, reads_own: bool) -> Result<(), Errno> {
    let flags = libc::CAN_EFF_FLAG | libc::CAN_RTR_FLAG;
    let filter = libc::can_filter { can_id: ids.id.into(), can_mask: u32::from(ids.mask) | flags };
    set(fd, libc::CAN_RAW_FILTER, &filter)?;
    set(fd, libc::CAN_RAW_ERR_FILTER, &libc::CAN_ERR_BUSOFF)?;
    set(fd, libc::CAN_RAW_RECV_OWN_MSGS, &i32::from(reads_own))
}

#[expect(unsafe_code, reason = "no library of ours has options of CAN")]
fn set<T: Copy>(fd: &OwnedFd, option: libc::c_int, value: &T) -> Result<(), Errno> {
    let length = libc::socklen_t::try_from(size_of::<T>()).map_err(|_| Errno::INVAL)?;
    let from = std::ptr::from_ref(value).cast();
    // SAFETY: the kernel reads so many octets of the value, and keeps none of it.
    let done = unsafe { libc::setsockopt(fd.as_raw_fd(), libc::SOL_CAN_RAW, option, from, length) };
    told(done)
}

#[expect(unsafe_code, reason = "no library of ours has addresses of CAN")]
fn bind_to(fd: &OwnedFd, index: u32) -> Result<(), Errno> {
    // SAFETY: all of its fields are numbers, which may be 0.
    let mut address: libc::sockaddr_can = unsafe { std::mem::zeroed() };
    address.can_family = libc::sa_family_t::try_from(libc::AF_CAN).map_err(|_| Errno::INVAL)?;
    address.can_ifindex = libc::c_int::try_from(index).map_err(|_| Errno::NODEV)?;
    let length = libc::socklen_t::try_from(size_of_val(&address)).map_err(|_| Errno::INVAL)?;
    // SAFETY: the kernel reads that address, and keeps none of it.
    told(unsafe { libc::bind(fd.as_raw_fd(), (&raw const address).cast(), length) })
}

fn told(done: libc::c_int) -> Result<(), Errno> {
    if done == 0 {
        Ok(())
    } else {
        Err(Errno::from_io_error(&io::Error::last_os_error()).unwrap_or(Errno::IO))
    }
}

/// Whether an interface that is up takes part on its bus, and has room for what may wait; what it does not tell is no fault.
fn is_fit(interfaces: &Path, interface: &Path) -> Result<(), CanError> {
    let number = |file: &str| -> Option<u32> {
        fs::read_to_string(interfaces.join(interface).join(file)).ok()?.trim().parse().ok()
    };
    if number("carrier") == Some(0) {
        return Err(CanError::Off(interface.to_owned()));
    }
    match number("tx_queue_len") {
        Some(queue @ 1..QUEUE) => Err(CanError::ShortQueue(interface.to_owned(), queue)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::sys::clock::Monotonic;
    use crate::time::Clock as _;

    const EIGHTS: CanIds = CanIds { id: 0, mask: 7 };

    fn soon() -> MonoTime {
        Monotonic.now() + Duration::from_secs(10)
    }

    fn past() -> MonoTime {
        MonoTime::from_nanos(0)
    }

    #[test]
    fn a_frame_is_laid_out_as_the_kernel_has_it_and_only_ours_are_read() {
        let (near, far) = CanSocket::pair().unwrap();
        assert_eq!(near.send((0x008, [1, 2, 3, 4, 5, 6, 7, 8]), soon()), Ok(true));
        let mut frame = [0xa5; 17];
        assert_eq!(far.line.read(&mut frame, soon()), Ok(FRAME_LEN));
        assert_eq!(frame[..4], 8_u32.to_ne_bytes());
        assert_eq!(frame[4..16], [8, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
        let put = |id: u32, length: u8| {
            let mut frame = [7; FRAME_LEN];
            frame[..4].copy_from_slice(&id.to_ne_bytes());
            frame[4] = length;
            assert_eq!(far.line.write(&frame, soon()), Ok(FRAME_LEN));
        };
        put(0x7f8 | libc::CAN_EFF_FLAG, 8);
        put(0x7f8 | libc::CAN_RTR_FLAG, 8);
        put(libc::CAN_ERR_FLAG | 4, 8);
        put(0x7f8, 7);
        put(0x7f8, 8);
        assert_eq!(near.receive(soon()), Ok(Some((0x7f8, [7; 8]))));
        assert_eq!(near.receive(past()), Ok(None));
        put(libc::CAN_ERR_FLAG | libc::CAN_ERR_BUSOFF, 8);
        assert_eq!(near.receive(soon()), Err(PortFault::Vanished));
        drop(far);
        assert_eq!(near.receive(soon()), Err(PortFault::Vanished));
    }

    #[test]
    fn what_is_no_bus_is_named_with_its_remedy() {
        let said = |errno| CanError::of(Path::new("can0"), errno).to_string();
        assert!(said(Errno::AFNOSUPPORT).contains("can-raw") && said(Errno::AFNOSUPPORT).contains("drop-in"));
        assert!(said(Errno::NODEV).starts_with("can0: there is no such interface; plug the adapter in"));
        assert!(said(Errno::NETDOWN).contains("`ip link set can0 up type can bitrate N`"));
        assert!(said(Errno::ADDRINUSE).contains("another kinocue has it; end that program"));
        // Without CAN in the kernel that comes first.
        let none = CanSocket::open(Path::new("no-such-bus"), EIGHTS).unwrap_err();
        assert!(matches!(none, CanError::Missing(_) | CanError::NoCan(_)), "{none:?}");
        let other = CanSocket::open(Path::new("lo"), EIGHTS).unwrap_err();
        assert!(matches!(other, CanError::Other(_) | CanError::NoCan(_)), "{other:?}");
    }

    #[test]
    fn an_interface_that_has_left_its_bus_or_has_no_room_for_a_stop_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let can0 = folder.path().join("can0");
        fs::create_dir(&can0).unwrap();
        let fit = |carrier: &str, queue: &str| {
            fs::write(can0.join("carrier"), carrier).unwrap();
            fs::write(can0.join("tx_queue_len"), queue).unwrap();
            is_fit(folder.path(), Path::new("can0")).map_err(|error| error.to_string())
        };
        assert_eq!([fit("1\n", "64\n"), fit("1\n", "0\n")], [Ok(()), Ok(())]);
        assert!(fit("0\n", "64\n").unwrap_err().contains("(bus-off); check wiring"));
        assert!(fit("1\n", "10\n").unwrap_err().ends_with("`ip link set can0 txqueuelen 64`"));
        assert!(is_fit(folder.path(), Path::new("can1")).is_ok(), "what nobody tells is no fault");
    }
}
