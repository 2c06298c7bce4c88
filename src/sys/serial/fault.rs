//! What can be wrong with a serial line, in words with what to do.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustix::io::Errno;

use crate::plain;

/// Why a line cannot be opened, and what to do.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum SerialError {
    /// Nothing is there.
    #[error(
        "{}: there is no such port; plug the adapter in, and use its link in /dev/serial/by-id",
        plain::path(.0)
    )]
    Missing(PathBuf),
    /// Another program has it open.
    #[error("{}: another program has it; end that program: two masters on one line garble each other", plain::path(.0))]
    Taken(PathBuf),
    /// The system refuses it to this user.
    #[error(
        "{}: not allowed to open it; add the user to the group dialout, and give the service the drop-in \
         kinocue-drives.conf",
        plain::path(.0)
    )]
    Forbidden(PathBuf),
    /// It is something else.
    #[error("{}: it is not a serial line; use the adapter's link in /dev/serial/by-id", plain::path(.0))]
    NoLine(PathBuf),
    /// It was there a moment ago.
    #[error("{}: the port has vanished; check the plug and the power of the adapter", plain::path(.0))]
    Vanished(PathBuf),
    /// The adapter makes another rate.
    #[error(
        "{}: the adapter makes {made} baud instead of {wanted}, more than 2 % off; set a baud that it can make, or use \
         another adapter",
        plain::path(path)
    )]
    Baud {
        /// The port.
        path: PathBuf,
        /// What was asked for.
        wanted: u32,
        /// What the driver says it makes.
        made: u32,
    },
    /// The adapter makes other octets.
    #[error("{}: the adapter cannot make these stop bits; set stop_bits = {can}", plain::path(path))]
    StopBits {
        /// The port.
        path: PathBuf,
        /// What it makes.
        can: u8,
    },
    /// The driver took RS-485 and did not keep it.
    #[error(
        "{}: the driver does not switch the direction of RS-485 although it takes the setting; use an adapter that \
         switches by itself",
        plain::path(.0)
    )]
    Rs485(PathBuf),
    /// It is a bus.
    #[error(transparent)]
    Can(#[from] CanError),
    /// Anything else that the system says.
    #[error("{}: cannot set up the line; check the adapter and its driver", plain::path(path))]
    System {
        /// The port.
        path: PathBuf,
        /// What it says.
        source: Arc<io::Error>,
    },
}

impl SerialError {
    pub(crate) fn of(path: &Path, errno: Errno) -> Self {
        let path = path.to_owned();
        match errno {
            Errno::NOENT | Errno::NOTDIR => Self::Missing(path),
            Errno::BUSY | Errno::WOULDBLOCK => Self::Taken(path),
            Errno::ACCESS | Errno::PERM => Self::Forbidden(path),
            Errno::NOTTY | Errno::ISDIR => Self::NoLine(path),
            Errno::NODEV | Errno::NXIO | Errno::IO => Self::Vanished(path),
            errno => Self::System { path, source: Arc::new(errno.into()) },
        }
    }
}

/// Frames that the interface of a bus has to take at once, more than the motors on it are told in a slice. One without a queue of its own (0) takes
/// any number.
pub(in crate::sys) const QUEUE: u32 = 64;

/// Why a bus cannot be had, and what to do.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum CanError {
    /// The kernel, or the service's sandbox, knows none.
    #[error(
        "{at}: this system opens no CAN bus; load the kernel's module can-raw, give the service the drop-in kinocue-drives.conf, or put the \
         units on a serial line",
        at = plain::path(.0)
    )]
    NoCan(PathBuf),
    /// Nothing has that name.
    #[error("{at}: there is no such interface; plug the adapter in, and look for its name by `ip link`", at = plain::path(.0))]
    Missing(PathBuf),
    /// It is a network of another kind.
    #[error("{at}: it is no CAN bus; name the interface of the adapter, such as can0", at = plain::path(.0))]
    Other(PathBuf),
    /// Nobody has brought it up.
    #[error(
        "{at}: the interface is down; `ip link set {at} up type can bitrate N`, with the bit rate of the units",
        at = plain::path(.0)
    )]
    Down(PathBuf),
    /// Its controller has made too many faults to take part.
    #[error(
        "{at}: its controller has left the bus (bus-off); check wiring, terminating resistors and bit rate, then \
         `ip link set {at} type can restart`",
        at = plain::path(.0)
    )]
    Off(PathBuf),
    /// Nobody acknowledges what is sent.
    #[error(
        "{at}: nobody on the bus acknowledges what is sent; check plug, terminating resistors, bit rate and the power of the units",
        at = plain::path(.0)
    )]
    Unheard(PathBuf),
    /// A stop could find no room behind what waits.
    #[error("{at}: the interface queues {count} frames, {QUEUE} are needed; `ip link set {at} txqueuelen {QUEUE}`", at = plain::path(.0), count = .1)]
    ShortQueue(PathBuf, u32),
    /// Another play has it.
    #[error("{at}: another kinocue has it; end that program: two masters on one bus move each other's seats", at = plain::path(.0))]
    Taken(PathBuf),
    /// Anything else that the system says.
    #[error("{}: cannot open the bus; check the adapter and its driver", plain::path(path))]
    System {
        /// The interface.
        path: PathBuf,
        /// What it says.
        source: Arc<io::Error>,
    },
}

impl CanError {
    pub(in crate::sys) fn of(interface: &Path, errno: Errno) -> Self {
        let path = interface.to_owned();
        match errno {
            Errno::AFNOSUPPORT | Errno::PROTONOSUPPORT => Self::NoCan(path),
            Errno::NODEV | Errno::NXIO | Errno::INVAL => Self::Missing(path),
            Errno::NETDOWN => Self::Down(path),
            Errno::ADDRINUSE => Self::Taken(path),
            errno => Self::System { path, source: Arc::new(errno.into()) },
        }
    }
}

/// What ends reading and writing. Made without allocating.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum PortFault {
    /// The adapter was unplugged, or whoever was at the other end of a pseudo-terminal is gone.
    #[error("the port has vanished; look at the plug and the power of the adapter")]
    Vanished,
    /// What else the system says.
    #[error("the system refuses to read or write the port ({0}); check the adapter and its driver")]
    System(Errno),
}

impl From<Errno> for PortFault {
    fn from(errno: Errno) -> Self {
        match errno {
            Errno::IO | Errno::NODEV | Errno::NXIO => Self::Vanished,
            errno => Self::System(errno),
        }
    }
}
