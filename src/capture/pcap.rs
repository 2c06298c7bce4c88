//! The classic format: a header for the file, then a header and the bytes of each packet.

use std::io::Read;
use std::time::Duration;

use super::source::{ByteOrder, Source, array_at};
use super::{CaptureError, MAX_PACKET, Record};

mod field {
    pub(super) const LINK: usize = 16; // u32 after the magic number; the low half is the link type
    pub(super) const FILE_LEN: usize = 20; // after the magic number

    pub(super) const SECONDS: usize = 0; // u32 since 1970
    pub(super) const FRACTION: usize = 4; // u32, microseconds or nanoseconds
    pub(super) const KEPT: usize = 8; // u32, bytes that follow; then u32, bytes that there were
    pub(super) const PACKET_LEN: usize = 16;
}

const MICROSECONDS: u32 = 0xa1b2_c3d4;
const NANOSECONDS: u32 = 0xa1b2_3c4d;

/// What the magic number says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    order: ByteOrder,
    /// Nanoseconds of one step of a time's fraction.
    step_ns: u32,
}

impl Layout {
    /// The layout of a file that opens with `magic`.
    pub(super) fn of(magic: [u8; 4]) -> Option<Self> {
        [ByteOrder::Big, ByteOrder::Little].into_iter().find_map(|order| match order.u32(magic) {
            MICROSECONDS => Some(Self { order, step_ns: 1_000 }),
            NANOSECONDS => Some(Self { order, step_ns: 1 }),
            _ => None,
        })
    }
}

/// Reads packets.
#[derive(Debug)]
pub(super) struct Pcap {
    layout: Layout,
    link: u16,
}

impl Pcap {
    /// Reads the rest of the file's header.
    pub(super) fn open<R: Read>(layout: Layout, source: &mut Source<R>) -> Result<Self, CaptureError> {
        let header: [u8; field::FILE_LEN] = source.array()?;
        let link = number(layout.order, &header, field::LINK);
        Ok(Self { layout, link: (link & 0xffff) as u16 })
    }

    /// Reads the next packet into the source's block.
    pub(super) fn record<R: Read>(&self, source: &mut Source<R>) -> Result<Option<Record>, CaptureError> {
        let at = source.at();
        let Some(header) = source.array_or_end::<{ field::PACKET_LEN }>()? else { return Ok(None) };
        let value = |place| number(self.layout.order, &header, place);
        let kept = value(field::KEPT);
        if kept > MAX_PACKET {
            return Err(CaptureError::PacketLength { at, found: kept, max: MAX_PACKET });
        }
        source.fill(kept)?;
        let fraction_ns = u64::from(value(field::FRACTION)) * u64::from(self.layout.step_ns);
        let time = Duration::from_secs(u64::from(value(field::SECONDS))) + Duration::from_nanos(fraction_ns);
        Ok(Some(Record { at: Some(time), link: self.link, bytes: 0..source.block().len() }))
    }
}

/// A number of a header that was read whole.
fn number(order: ByteOrder, header: &[u8], at: usize) -> u32 {
    order.u32(array_at(header, at).expect("the place is inside the header"))
}
