//! The way that the kernel has to an address, as its tables say it (`rtnetlink(7)`). Sends nothing to the network.

use std::io::{self, Read};
use std::net::Ipv4Addr;

use socket2::{Domain, Protocol, Socket, Type};

/// The way to an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Way {
    /// The interface that it leaves by; none where there are several.
    pub(super) interface: Option<u32>,
    /// Whether it goes to all who are there.
    pub(super) is_broadcast: bool,
    /// Whether another machine carries it on.
    pub(super) is_carried_on: bool,
    /// How many bits the addresses that go the same way have in common.
    pub(super) bits: u8,
}

const GET_ROUTE: u16 = 26;
const NEW_ROUTE: u16 = 24;
const REQUEST: u16 = 1;
/// Asks for the entry of the table, not for what was made of it for this one address.
const FIB_MATCH: u32 = 0x2000;
const INTERFACE: u16 = 4;
const GATEWAY: u16 = 5;
const VIA: u16 = 18;
/// Before the attributes: the header of any message, and that of a route.
const HEADER_LEN: usize = 16;
const ATTRIBUTES_AT: usize = HEADER_LEN + 12;

/// The way to `to` for what comes from `from`, which may be unspecified.
///
/// # Errors
/// If the kernel has none, or `from` is no address of this machine.
pub(super) fn way(from: Ipv4Addr, to: Ipv4Addr) -> io::Result<Way> {
    let mut socket =
        Socket::new(Domain::from(libc::AF_NETLINK), Type::RAW, Some(Protocol::from(libc::NETLINK_ROUTE)))?;
    socket.send(&question(from, to))?;
    let mut answer = [0; 4_096];
    let len = socket.read(&mut answer)?;
    read(&answer[..len])
}

fn question(from: Ipv4Addr, to: Ipv4Addr) -> Vec<u8> {
    let from = Some(from).filter(|from| !from.is_unspecified());
    let addresses: Vec<(u16, Ipv4Addr)> =
        [Some((1, to)), from.map(|from| (2, from))].into_iter().flatten().collect();
    let len = u32::try_from(ATTRIBUTES_AT + 8 * addresses.len()).expect("at most two");
    let mut octets = Vec::new();
    octets.extend_from_slice(&len.to_ne_bytes());
    octets.extend([GET_ROUTE, REQUEST].iter().flat_map(|word| word.to_ne_bytes()));
    octets.extend_from_slice(&[0; 8]);
    let family = u8::try_from(libc::AF_INET).expect("it is 2");
    octets.extend_from_slice(&[family, 32, if from.is_some() { 32 } else { 0 }, 0, 0, 0, 0, 0]);
    octets.extend_from_slice(&FIB_MATCH.to_ne_bytes());
    for (kind, address) in addresses {
        octets.extend([8, kind].iter().flat_map(|word: &u16| word.to_ne_bytes()));
        octets.extend_from_slice(&address.octets());
    }
    octets
}

fn read(octets: &[u8]) -> io::Result<Way> {
    let word = |at: usize| octets.get(at..at + 2).map(|two| u16::from_ne_bytes([two[0], two[1]]));
    let long =
        |at: usize| Some(octets.get(at..at + 4)?.try_into().map(u32::from_ne_bytes).expect("they are four"));
    if word(4) != Some(NEW_ROUTE) {
        // Of an error, which is all else there is, the number is next.
        let errno = long(HEADER_LEN).map_or(libc::EPROTO, |errno| errno.cast_signed().wrapping_neg());
        return Err(io::Error::from_raw_os_error(errno));
    }
    let is_broadcast = octets.get(HEADER_LEN + 7) == Some(&libc::RTN_BROADCAST);
    let bits = octets.get(HEADER_LEN + 1).copied().unwrap_or(0);
    let mut way = Way { interface: None, is_broadcast, is_carried_on: false, bits };
    let mut at = ATTRIBUTES_AT;
    while let (Some(len), Some(kind)) = (word(at), word(at + 2)) {
        match kind {
            INTERFACE => way.interface = long(at + 4),
            GATEWAY | VIA => way.is_carried_on = true,
            _ => {}
        }
        at += usize::from(len).next_multiple_of(4).max(4);
    }
    Ok(way)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_tells_the_way_to_this_machine_and_to_all_who_are_on_it() {
        let (one, all) = (Ipv4Addr::new(127, 0, 0, 2), Ipv4Addr::new(127, 255, 255, 255));
        let to_one = way(Ipv4Addr::UNSPECIFIED, one).unwrap();
        assert_eq!((to_one.is_broadcast, to_one.is_carried_on, to_one.bits), (false, false, 8));
        let to_all = way(Ipv4Addr::LOCALHOST, all).unwrap();
        assert!(to_all.is_broadcast && to_all.interface.is_some() && to_all.interface == to_one.interface);
        assert!(way(Ipv4Addr::new(192, 0, 2, 1), one).is_err(), "from an address of nobody here");
    }

    #[test]
    fn an_answer_that_is_cut_off_anywhere_is_taken_for_no_way_that_it_does_not_tell() {
        let mut whole = vec![0; 16];
        whole[4..6].copy_from_slice(&NEW_ROUTE.to_ne_bytes());
        whole.extend_from_slice(&[2, 24, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0]);
        for (kind, value) in [(GATEWAY, [10, 0, 0, 1]), (INTERFACE, 7_u32.to_ne_bytes())] {
            whole.extend([8, kind].iter().flat_map(|word: &u16| word.to_ne_bytes()));
            whole.extend_from_slice(&value);
        }
        let way = Way { interface: Some(7), is_broadcast: false, is_carried_on: true, bits: 24 };
        assert_eq!(read(&whole).unwrap(), way);
        for len in 0..whole.len() {
            assert!(
                read(&whole[..len]).is_err() || read(&whole[..len]).unwrap().interface.is_none(),
                "{len}"
            );
        }
        // A length of 0 is no step.
        whole[28] = 0;
        whole[29] = 0;
        assert!(read(&whole).is_ok());
    }
}
