//! The next generation format: blocks, of which only those that describe sections, interfaces and packets matter here.

use std::io::Read;
use std::ops::Range;
use std::time::Duration;

use super::source::{ByteOrder, Source, array_at};
use super::{CaptureError, MAX_PACKET, Record};

/// Opens a section, and so the file.
pub(super) const MAGIC: [u8; 4] = [0x0a, 0x0d, 0x0d, 0x0a];

mod kind {
    pub(super) const INTERFACE: u32 = 1;
    pub(super) const OLD_PACKET: u32 = 2;
    pub(super) const SIMPLE_PACKET: u32 = 3;
    pub(super) const ENHANCED_PACKET: u32 = 6;
    pub(super) const SECTION: u32 = u32::from_be_bytes(super::MAGIC); // the same in either order
}

mod field {
    pub(super) const LINK: usize = 0; // u16 of an interface; then u16, u32 the most bytes of a packet, options
    pub(super) const SNAP_LEN: usize = 4;
    pub(super) const OPTIONS: usize = 8;

    pub(super) const INTERFACE: usize = 0; // u32 of a packet; u16 of an old one, then u16 of drops
    pub(super) const TIME_HIGH: usize = 4; // u32
    pub(super) const TIME_LOW: usize = 8; // u32
    pub(super) const KEPT: usize = 12; // u32, then u32 bytes there were
    pub(super) const DATA: usize = 20;

    pub(super) const SIMPLE_LEN: usize = 0; // u32 bytes there were
    pub(super) const SIMPLE_DATA: usize = 4;
}

mod option {
    pub(super) const END: u16 = 0;
    pub(super) const RESOLUTION: u16 = 9; // u8
    pub(super) const OFFSET: u16 = 14; // i64, seconds
}

/// Bytes of a block about its content: kind and length before it, the length again after it.
const FRAME_LEN: u32 = 12;
/// The longest block that is read; longer ones, unless they are packets, are passed over.
const MAX_BLOCK: u32 = MAX_PACKET + 65_536;
/// The most interfaces that a section may describe.
const MAX_INTERFACES: usize = 65_536;

/// Reads packets.
#[derive(Debug)]
pub(super) struct PcapNg {
    order: ByteOrder,
    interfaces: Vec<Interface>,
}

#[derive(Debug, Clone, Copy)]
struct Interface {
    link: u16,
    /// The most bytes that are kept of a packet; 0 for all.
    snap_len: u32,
    steps_per_second: u64,
    offset_s: i64,
}

impl PcapNg {
    /// Reads the section header that the file opens with, its kind having been read.
    pub(super) fn open<R: Read>(source: &mut Source<R>) -> Result<Self, CaptureError> {
        let mut read = Self { order: ByteOrder::Big, interfaces: Vec::new() };
        read.section(source)?;
        Ok(read)
    }

    /// Reads on to the next packet, into the source's block.
    pub(super) fn record<R: Read>(&mut self, source: &mut Source<R>) -> Result<Option<Record>, CaptureError> {
        loop {
            let at = source.at();
            let Some(kind) = source.array_or_end()? else { return Ok(None) };
            let kind = self.order.u32(kind);
            if kind == kind::SECTION {
                self.section(source)?;
                continue;
            }
            let len = self.block_len(at, source)?;
            let wanted = matches!(
                kind,
                kind::INTERFACE | kind::OLD_PACKET | kind::SIMPLE_PACKET | kind::ENHANCED_PACKET
            );
            if !wanted {
                source.skip(len - 8)?; // kind and length are read already
                continue;
            }
            if len > MAX_BLOCK {
                return Err(CaptureError::PacketLength { at, found: len, max: MAX_PACKET });
            }
            self.body(at, len, source)?;
            if kind == kind::INTERFACE {
                self.interface(at, len, source.block())?;
            } else {
                return self.packet(at, kind, source.block()).map(Some);
            }
        }
    }

    /// Starts a section over: its order of bytes, and no interfaces.
    fn section<R: Read>(&mut self, source: &mut Source<R>) -> Result<(), CaptureError> {
        let at = source.at() - 4;
        let len = source.array()?;
        let mark = source.array()?;
        self.order = match u32::from_be_bytes(mark) {
            0x1a2b_3c4d => ByteOrder::Big,
            0x4d3c_2b1a => ByteOrder::Little,
            _ => return Err(CaptureError::ByteOrder { at: at + 8, found: mark }),
        };
        self.interfaces.clear();
        let found = self.order.u32(len);
        check_len(at, found, FRAME_LEN + 16)?; // the mark, the version and the length of the section
        source.skip(found - 12)
    }

    fn block_len<R: Read>(&self, at: u64, source: &mut Source<R>) -> Result<u32, CaptureError> {
        let found = self.order.u32(source.array()?);
        check_len(at, found, FRAME_LEN)?;
        Ok(found)
    }

    /// Reads what a block of `len` bytes holds, and its length again.
    fn body<R: Read>(&self, at: u64, len: u32, source: &mut Source<R>) -> Result<(), CaptureError> {
        source.fill(len - FRAME_LEN)?;
        let again = self.order.u32(source.array()?);
        if again != len {
            return Err(CaptureError::BlockLength { at, found: len, why: "its end gives another length" });
        }
        Ok(())
    }

    fn interface(&mut self, at: u64, len: u32, block: &[u8]) -> Result<(), CaptureError> {
        let short = CaptureError::BlockLength { at, found: len, why: "an interface takes more" };
        let (Some(link), Some(snap_len)) = (array_at(block, field::LINK), array_at(block, field::SNAP_LEN))
        else {
            return Err(short);
        };
        if self.interfaces.len() == MAX_INTERFACES {
            return Err(CaptureError::BlockLength {
                at,
                found: len,
                why: "there are 65536 interfaces already",
            });
        }
        let mut interface = Interface {
            link: self.order.u16(link),
            snap_len: self.order.u32(snap_len),
            steps_per_second: 1_000_000,
            offset_s: 0,
        };
        interface.options(self.order, block.get(field::OPTIONS..).unwrap_or_default());
        self.interfaces.push(interface);
        Ok(())
    }

    fn packet(&self, at: u64, kind: u32, block: &[u8]) -> Result<Record, CaptureError> {
        let number = |place| number(self.order, at, block, place);
        if kind == kind::SIMPLE_PACKET {
            let interface = self.of(at, 0)?;
            let kept = match (number(field::SIMPLE_LEN)?, interface.snap_len) {
                (there, 0) => there,
                (there, most) => there.min(most),
            };
            let bytes = packet_range(at, block, field::SIMPLE_DATA, kept)?;
            return Ok(Record { at: None, link: interface.link, bytes });
        }
        let named = match array_at(block, field::INTERFACE) {
            Some(bytes) if kind == kind::OLD_PACKET => u32::from(self.order.u16(bytes)),
            _ => number(field::INTERFACE)?,
        };
        let interface = self.of(at, named)?;
        let steps = u64::from(number(field::TIME_HIGH)?) << 32 | u64::from(number(field::TIME_LOW)?);
        let bytes = packet_range(at, block, field::DATA, number(field::KEPT)?)?;
        Ok(Record { at: interface.time(steps), link: interface.link, bytes })
    }

    /// The interface that a packet names.
    fn of(&self, at: u64, named: u32) -> Result<Interface, CaptureError> {
        let known = self.interfaces.len();
        let index = usize::try_from(named).unwrap_or(usize::MAX);
        self.interfaces.get(index).copied().ok_or(CaptureError::Interface { at, found: named, known })
    }
}

impl Interface {
    /// Takes the resolution and the offset of its times from its options; damaged ones count for nothing.
    fn options(&mut self, order: ByteOrder, mut options: &[u8]) {
        while let (Some(code), Some(len)) = (array_at(options, 0), array_at(options, 2)) {
            let (code, len) = (order.u16(code), usize::from(order.u16(len)));
            let Some(value) = options.get(4..4 + len) else { return };
            match (code, value) {
                (option::END, _) => return,
                (option::RESOLUTION, &[resolution]) => {
                    self.steps_per_second = steps_per_second(resolution).unwrap_or(self.steps_per_second);
                }
                (option::OFFSET, _) => {
                    let offset = array_at(value, 0).map(|bytes| order.u64(bytes).cast_signed());
                    self.offset_s = offset.unwrap_or(self.offset_s);
                }
                _ => {}
            }
            options = options.get(4 + len.next_multiple_of(4)..).unwrap_or_default();
        }
    }

    /// The time since 1970 that so many steps mean; `None` if that is before it.
    fn time(&self, steps: u64) -> Option<Duration> {
        let seconds =
            u64::try_from(i128::from(steps / self.steps_per_second) + i128::from(self.offset_s)).ok()?;
        let rest = u128::from(steps % self.steps_per_second);
        let nanos = rest * 1_000_000_000 / u128::from(self.steps_per_second);
        Some(Duration::new(seconds, u32::try_from(nanos).ok()?))
    }
}

/// 10 or, with the top bit set, 2 to the power of the rest; `None` if that is more than 64 bits hold.
fn steps_per_second(resolution: u8) -> Option<u64> {
    let power = u32::from(resolution & 0x7f);
    if resolution & 0x80 == 0 { 10_u64.checked_pow(power) } else { 2_u64.checked_pow(power) }
}

fn check_len(at: u64, found: u32, least: u32) -> Result<(), CaptureError> {
    if found < least {
        return Err(CaptureError::BlockLength { at, found, why: "it takes more" });
    }
    if !found.is_multiple_of(4) {
        return Err(CaptureError::BlockLength { at, found, why: "only multiples of 4 are possible" });
    }
    Ok(())
}

/// A number of a packet's block.
fn number(order: ByteOrder, at: u64, block: &[u8], place: usize) -> Result<u32, CaptureError> {
    array_at(block, place).map(|bytes| order.u32(bytes)).ok_or_else(|| short_packet(at, block))
}

/// Where `kept` bytes from `start` on stand in a packet's block.
fn packet_range(at: u64, block: &[u8], start: usize, kept: u32) -> Result<Range<usize>, CaptureError> {
    if kept > MAX_PACKET {
        return Err(CaptureError::PacketLength { at, found: kept, max: MAX_PACKET });
    }
    let end = start + usize::try_from(kept).expect("a packet's length fits a usize");
    if end > block.len() {
        return Err(short_packet(at, block));
    }
    Ok(start..end)
}

fn short_packet(at: u64, block: &[u8]) -> CaptureError {
    let found = u32::try_from(block.len()).unwrap_or(u32::MAX).saturating_add(FRAME_LEN);
    CaptureError::BlockLength { at, found, why: "its packet takes more" }
}
