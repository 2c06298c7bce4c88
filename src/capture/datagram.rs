//! IPv4 packets to the UDP datagrams in them (RFC 791, RFC 768). Checksums are not looked at: a packet that the
//! sending machine captured of itself seldom has them.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::source::array_at;

mod field {
    pub(super) const VERSION_AND_LEN: usize = 0; // u8
    pub(super) const TOTAL_LEN: usize = 2; // u16
    pub(super) const FRAGMENT: usize = 6; // u16: 3 flags, then the offset in units of 8 bytes
    pub(super) const PROTOCOL: usize = 9; // u8
    pub(super) const SOURCE: usize = 12; // u32
    pub(super) const DESTINATION: usize = 16; // u32
    pub(super) const LEAST_LEN: usize = 20;

    pub(super) const UDP_SOURCE: usize = 0; // u16
    pub(super) const UDP_DESTINATION: usize = 2; // u16
    pub(super) const UDP_LEN: usize = 4; // u16, then u16 the checksum
    pub(super) const UDP_PAYLOAD: usize = 8;
}

const UDP: u8 = 17;
const MORE_FRAGMENTS: u16 = 0x2000;
const FRAGMENT_OFFSET: u16 = 0x1fff;

/// What a captured packet carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Content<'a> {
    /// A whole UDP datagram over IPv4, or as much of it as the capture kept.
    Datagram(Datagram<'a>),
    /// One part of a UDP datagram that was sent in several. They are not put together: no message of the protocol is
    /// so long.
    Fragment(Fragment),
    /// Anything else, also what is too damaged to tell.
    Other,
    /// A packet of a link type that is not read here.
    UnknownLink(u16),
}

/// A UDP datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Datagram<'a> {
    /// Who sent it.
    pub(crate) source: SocketAddrV4,
    /// For whom.
    pub(crate) destination: SocketAddrV4,
    /// What it carries, as far as it was captured.
    pub(crate) payload: &'a [u8],
    /// Bytes that the payload had on the wire; more than were captured where the capture cut it.
    pub(crate) payload_len: usize,
}

impl Datagram<'_> {
    /// True if the capture kept only a part of it.
    #[must_use]
    pub(crate) const fn is_cut(&self) -> bool {
        self.payload.len() < self.payload_len
    }
}

/// A part of a UDP datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fragment {
    /// Who sent it.
    pub(crate) source: Ipv4Addr,
    /// For whom.
    pub(crate) destination: Ipv4Addr,
    /// Source and destination port; only the first part has them.
    pub(crate) ports: Option<(u16, u16)>,
    /// Where it belongs in the whole, bytes.
    pub(crate) offset: u16,
}

/// What an IPv4 packet carries.
pub(super) fn content(packet: &[u8]) -> Content<'_> {
    read(packet).unwrap_or(Content::Other)
}

fn read(packet: &[u8]) -> Option<Content<'_>> {
    let [version_and_len] = array_at(packet, field::VERSION_AND_LEN)?;
    let header_len = usize::from(version_and_len & 0x0f) * 4;
    let [protocol] = array_at(packet, field::PROTOCOL)?;
    if version_and_len >> 4 != 4 || header_len < field::LEAST_LEN || protocol != UDP {
        return None;
    }
    let source = Ipv4Addr::from(array_at::<4>(packet, field::SOURCE)?);
    let destination = Ipv4Addr::from(array_at::<4>(packet, field::DESTINATION)?);
    let fragment = u16::from_be_bytes(array_at(packet, field::FRAGMENT)?);
    let body = packet.get(header_len..)?;
    let ports = udp_ports(body);
    if fragment & (MORE_FRAGMENTS | FRAGMENT_OFFSET) != 0 {
        let offset = (fragment & FRAGMENT_OFFSET) * 8;
        return Some(Content::Fragment(Fragment {
            source,
            destination,
            ports: ports.filter(|_| offset == 0),
            offset,
        }));
    }
    let (source_port, destination_port) = ports?;
    let room =
        usize::from(u16::from_be_bytes(array_at(packet, field::TOTAL_LEN)?)).checked_sub(header_len)?;
    let udp_len = usize::from(u16::from_be_bytes(array_at(body, field::UDP_LEN)?));
    let payload_len = udp_len.checked_sub(field::UDP_PAYLOAD).filter(|_| udp_len <= room)?;
    let captured = body.get(field::UDP_PAYLOAD..)?; // what an Ethernet frame is padded with may follow
    Some(Content::Datagram(Datagram {
        source: SocketAddrV4::new(source, source_port),
        destination: SocketAddrV4::new(destination, destination_port),
        payload: &captured[..payload_len.min(captured.len())],
        payload_len,
    }))
}

fn udp_ports(body: &[u8]) -> Option<(u16, u16)> {
    let source = u16::from_be_bytes(array_at(body, field::UDP_SOURCE)?);
    Some((source, u16::from_be_bytes(array_at(body, field::UDP_DESTINATION)?)))
}
