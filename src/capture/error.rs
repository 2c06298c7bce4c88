//! Why a capture cannot be read, or not further.

use std::io;

/// Why bytes are no capture, or no more of one; places are counted from 0 at the start of the capture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum CaptureError {
    /// It opens like no capture.
    #[error("byte 0: {} opens neither pcap nor pcapng", hex(found))]
    Magic {
        /// What it opens with.
        found: [u8; 4],
    },
    /// It ends where more must follow, as after a capture that was cut off.
    #[error("byte {at}: the capture ends inside a packet or header")]
    Ends {
        /// Bytes there are.
        at: u64,
    },
    /// A packet that is longer than any can be.
    #[error("byte {at}: a packet of {found} bytes; at most {max} are possible")]
    PacketLength {
        /// Where its block begins.
        at: u64,
        /// The length that stands there.
        found: u32,
        /// The most there can be.
        max: u32,
    },
    /// A block of pcapng that cannot have this length.
    #[error("byte {at}: a block of {found} bytes, where {why}")]
    BlockLength {
        /// Where the block begins.
        at: u64,
        /// The length that stands there.
        found: u32,
        /// What is wrong with that.
        why: &'static str,
    },
    /// A section of pcapng whose byte-order mark is none.
    #[error("byte {at}: {} is not a byte-order mark of pcapng", hex(found))]
    ByteOrder {
        /// Where the mark stands.
        at: u64,
        /// What stands there.
        found: [u8; 4],
    },
    /// A packet of an interface that pcapng has not described.
    #[error("byte {at}: packet refers to interface {found}; {known} described")]
    Interface {
        /// Where its block begins.
        at: u64,
        /// The interface that it names.
        found: u32,
        /// How many there are.
        known: usize,
    },
    /// The system cannot read it.
    #[error("cannot read the capture")]
    Io(#[source] io::Error),
}

fn hex(bytes: &[u8; 4]) -> String {
    format!("{:08x}", u32::from_be_bytes(*bytes))
}
