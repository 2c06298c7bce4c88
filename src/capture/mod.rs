//! Captures of network traffic: bytes of a pcap or pcapng file to packets, and packets to the UDP datagrams in them.
//! Helper threads; reads as a stream, holds one packet at a time, and takes any bytes without a panic.
//!
//! Sources are the IETF drafts of both formats (draft-ietf-opsawg-pcap, draft-ietf-opsawg-pcapng) and the list of link
//! types of tcpdump.org.

mod datagram;
mod error;
mod link;
mod pcap;
mod pcapng;
mod source;
#[cfg(test)]
mod tests;

use std::io::Read;
use std::time::Duration;

pub(crate) use datagram::{Content, Datagram, Fragment};
pub(crate) use error::CaptureError;

use pcap::Pcap;
use pcapng::PcapNg;
use source::Source;

/// The longest packet that is taken, bytes: what tcpdump and Wireshark write at most.
pub(crate) const MAX_PACKET: u32 = 262_144;

/// Bytes that tell a capture from anything else.
pub(crate) const MAGIC_LEN: usize = 4;

/// True if a file that opens with these bytes is a capture.
#[must_use]
pub(crate) fn is_capture(magic: [u8; MAGIC_LEN]) -> bool {
    magic == pcapng::MAGIC || pcap::Layout::of(magic).is_some()
}

/// A packet as it was captured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Packet<'a> {
    /// Counted from 1, as Wireshark does.
    pub(crate) number: u64,
    /// When it was captured, since 1970-01-01 UTC; `None` if the capture does not say.
    pub(crate) at: Option<Duration>,
    /// The link type, which says what its bytes begin with.
    pub(crate) link: u16,
    /// Its bytes, as many as the capture kept.
    pub(crate) bytes: &'a [u8],
}

impl<'a> Packet<'a> {
    /// What it carries.
    #[must_use]
    pub(crate) fn content(&self) -> Content<'a> {
        match link::ipv4(self.link, self.bytes) {
            Ok(Some(packet)) => datagram::content(packet),
            Ok(None) => Content::Other,
            Err(link::UnknownLink) => Content::UnknownLink(self.link),
        }
    }
}

/// A capture being read.
#[derive(Debug)]
pub(crate) struct Capture<R> {
    source: Source<R>,
    format: Format,
    packets: u64,
}

#[derive(Debug)]
enum Format {
    Pcap(Pcap),
    PcapNg(PcapNg),
}

impl<R: Read> Capture<R> {
    /// Reads what comes before the first packet. Give it a buffered reader.
    ///
    /// # Errors
    /// [`CaptureError::Magic`] where it is no capture, and those of [`Capture::packet`].
    pub(crate) fn open(reader: R) -> Result<Self, CaptureError> {
        let mut source = Source::new(reader);
        let magic: [u8; MAGIC_LEN] = source.array()?;
        let format = if magic == pcapng::MAGIC {
            Format::PcapNg(PcapNg::open(&mut source)?)
        } else {
            let layout = pcap::Layout::of(magic).ok_or(CaptureError::Magic { found: magic })?;
            Format::Pcap(Pcap::open(layout, &mut source)?)
        };
        Ok(Self { source, format, packets: 0 })
    }

    /// The next packet; none at the end of the capture.
    ///
    /// # Errors
    /// If the capture ends inside a packet, where it is damaged, and where reading fails. What is left of it cannot
    /// be read then.
    pub(crate) fn packet(&mut self) -> Result<Option<Packet<'_>>, CaptureError> {
        let record = match &mut self.format {
            Format::Pcap(pcap) => pcap.record(&mut self.source)?,
            Format::PcapNg(pcapng) => pcapng.record(&mut self.source)?,
        };
        let Some(Record { at, link, bytes }) = record else { return Ok(None) };
        self.packets += 1;
        Ok(Some(Packet { number: self.packets, at, link, bytes: &self.source.block()[bytes] }))
    }
}

/// Where a packet stands in the block that was read last.
#[derive(Debug)]
struct Record {
    at: Option<Duration>,
    link: u16,
    bytes: std::ops::Range<usize>,
}
