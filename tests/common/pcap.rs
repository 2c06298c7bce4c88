//! A writer of classic captures, as small as it gets: Ethernet, IPv4, UDP.

#![allow(dead_code, unreachable_pub, reason = "each test file uses its own part")]

use std::net::SocketAddrV4;
use std::time::Duration;

/// A capture in the making.
pub struct Pcap(Vec<u8>);

impl Pcap {
    pub fn new() -> Self {
        let mut file = Vec::new();
        for number in [0xa1b2_c3d4_u32, 0x0004_0002, 0, 0, 262_144, 1] {
            file.extend(number.to_le_bytes());
        }
        Self(file)
    }

    /// A datagram, captured whole.
    pub fn datagram(&mut self, at: Duration, from: SocketAddrV4, to: SocketAddrV4, payload: &[u8]) {
        self.packet(at, &ethernet(from, to, payload, 0), usize::MAX);
    }

    /// A packet of which at most `kept` bytes were captured.
    pub fn packet(&mut self, at: Duration, bytes: &[u8], kept: usize) {
        let kept = &bytes[..kept.min(bytes.len())];
        let number = |n: usize| u32::try_from(n).expect("a small number");
        let seconds = u32::try_from(at.as_secs()).expect("a small number");
        for number in [seconds, at.subsec_micros(), number(kept.len()), number(bytes.len())] {
            self.0.extend(number.to_le_bytes());
        }
        self.0.extend(kept);
    }

    pub fn bytes(&self) -> &[u8] {
        &self.0
    }
}

/// A datagram as it stands on the wire, with the flags and offset of a fragment.
pub fn ethernet(from: SocketAddrV4, to: SocketAddrV4, payload: &[u8], fragment: u16) -> Vec<u8> {
    let len = |more: usize| u16::try_from(payload.len() + more).expect("a datagram is short").to_be_bytes();
    let mut packet = vec![2, 0, 0, 0, 0, 2, 2, 0, 0, 0, 0, 1, 8, 0, 0x45, 0];
    packet.extend(len(28));
    packet.extend([0, 1]);
    packet.extend(fragment.to_be_bytes());
    packet.extend([64, 17, 0, 0]);
    packet.extend(from.ip().octets());
    packet.extend(to.ip().octets());
    packet.extend(from.port().to_be_bytes());
    packet.extend(to.port().to_be_bytes());
    packet.extend(len(8));
    packet.extend([0, 0]);
    packet.extend(payload);
    packet
}
