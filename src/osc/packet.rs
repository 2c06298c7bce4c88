//! Datagrams into messages: bundles are taken apart, and their times looked at.

use rosc::{OscMessage, OscPacket, OscTime, decoder};

/// The longest datagram that is looked at, bytes. It also bounds how deep bundles nest, as each costs 20.
pub(super) const MOST: usize = 1536;

/// From 1900, which OSC counts from, to 1970 (RFC 5905).
const UNIX_EPOCH_S: u64 = 2_208_988_800;

/// A message, and whether its bundle asks to be done later.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Timed {
    pub(super) message: OscMessage,
    pub(super) early: bool,
}

/// The messages of a datagram in their order; `None` if it is not OSC from its first byte to its last. `wall_ns` is the
/// wall clock, since 1970.
pub(super) fn read(datagram: &[u8], wall_ns: u64) -> Option<Vec<Timed>> {
    let (rest, packet) = decoder::decode_udp(datagram).ok()?;
    let mut messages = Vec::new();
    take_apart(packet, false, ntp(wall_ns), &mut messages);
    rest.is_empty().then_some(messages)
}

fn take_apart(packet: OscPacket, early: bool, now: u64, into: &mut Vec<Timed>) {
    match packet {
        OscPacket::Message(message) => into.push(Timed { message, early }),
        OscPacket::Bundle(bundle) => {
            let early = early || is_later(bundle.timetag, now);
            bundle.content.into_iter().for_each(|packet| take_apart(packet, early, now, into));
        }
    }
}

/// True if a time tag lies after `now`; one without seconds means "at once".
fn is_later(tag: OscTime, now: u64) -> bool {
    let tag_time = u64::from(tag.seconds) << 32 | u64::from(tag.fractional);
    // Seconds wrap in 2036: what is less than half the range ahead is later.
    tag.seconds != 0 && tag_time.wrapping_sub(now).cast_signed() > 0
}

/// A wall time as OSC writes it: seconds since 1900, modulo 2^32, and their fraction.
fn ntp(wall_ns: u64) -> u64 {
    let (seconds, nanos) = (wall_ns / 1_000_000_000, wall_ns % 1_000_000_000);
    ((seconds + UNIX_EPOCH_S) << 32) | ((nanos << 32) / 1_000_000_000)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rosc::{OscBundle, encoder};

    use super::*;

    /// 2027 or so.
    const NOW_NS: u64 = 1_800_000_000_500_000_000;
    const NOW_S: u32 = 4_008_988_800;

    fn message(addr: &str) -> OscPacket {
        OscPacket::Message(OscMessage { addr: addr.to_owned(), args: Vec::new() })
    }

    fn bundle(seconds: u32, fractional: u32, content: Vec<OscPacket>) -> OscPacket {
        OscPacket::Bundle(OscBundle { timetag: OscTime { seconds, fractional }, content })
    }

    fn early(packet: &OscPacket) -> Vec<(String, bool)> {
        let read = read(&encoder::encode(packet).unwrap(), NOW_NS).expect("it is OSC");
        read.into_iter().map(|timed| (timed.message.addr, timed.early)).collect()
    }

    #[test]
    fn a_bundle_for_now_or_before_is_not_early_and_one_for_later_is() {
        for (seconds, fractional, is_early) in [
            (0, 1, false),
            (0, 0, false),
            (NOW_S - 1, 0, false),
            (NOW_S, 1 << 31, false),
            (NOW_S, (1 << 31) + 9, true),
            (NOW_S + 3_600, 0, true),
        ] {
            let packet = bundle(seconds, fractional, vec![message("/a")]);
            assert_eq!(early(&packet), [("/a".to_owned(), is_early)], "{seconds}.{fractional}");
        }
    }

    #[test]
    fn what_is_inside_a_bundle_for_later_is_early_whatever_it_says_itself() {
        let inner = bundle(0, 1, vec![message("/b")]);
        let packet = bundle(NOW_S + 1, 0, vec![message("/a"), inner]);
        assert_eq!(early(&packet), [("/a".to_owned(), true), ("/b".to_owned(), true)]);
    }

    #[test]
    fn seconds_that_wrap_are_later_than_those_before_it() {
        let just_before = ((1_u64 << 32) - UNIX_EPOCH_S - 1) * 1_000_000_000;
        assert!(is_later(OscTime { seconds: 1, fractional: 0 }, ntp(just_before)));
        let just_after = just_before + 3_000_000_000;
        assert!(!is_later(OscTime { seconds: u32::MAX, fractional: 0 }, ntp(just_after)));
    }

    #[test]
    fn bytes_after_the_message_are_no_osc() {
        let mut bytes = encoder::encode(&message("/kinocue/go")).unwrap();
        assert!(read(&bytes, NOW_NS).is_some());
        bytes.extend([0; 4]);
        assert!(read(&bytes, NOW_NS).is_none());
        assert!(read(&[], NOW_NS).is_none());
    }

    #[test]
    fn bundles_nested_as_deep_as_a_datagram_allows_are_read() {
        let mut bytes = encoder::encode(&message("/a")).unwrap();
        while bytes.len() + 20 <= MOST {
            let length = u32::try_from(bytes.len()).unwrap().to_be_bytes();
            bytes = [b"#bundle\0\0\0\0\0\0\0\0\x01".as_slice(), &length, &bytes].concat();
        }
        assert_eq!(read(&bytes, NOW_NS).unwrap().len(), 1);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = read(&bytes, NOW_NS);
            let _ = read(&[b"/kinocue/a\0\0".as_slice(), &bytes].concat(), NOW_NS);
            let _ = read(&[b"#bundle\0".as_slice(), &bytes].concat(), NOW_NS);
        }

        #[test]
        fn no_type_tags_panic(tags in "[ifsbtdTFNIcrm\\[\\]]{0,40}", bytes in proptest::collection::vec(any::<u8>(), 0..80)) {
            let mut text = format!(",{tags}\0").into_bytes();
            text.resize(text.len().next_multiple_of(4), 0);
            let _ = read(&[b"/a\0\0".as_slice(), &text, &bytes].concat(), NOW_NS);
        }
    }
}
