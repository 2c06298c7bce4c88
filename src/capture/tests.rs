use proptest::prelude::*;

use super::source::ByteOrder;
use super::*;

/// A UDP datagram in an IPv4 packet, 10.0.0.1:8410 to 10.0.0.2:7408, with the flags and offset of a fragment.
fn ipv4(payload: &[u8], fragment: u16) -> Vec<u8> {
    let bytes = |n: usize| u16::try_from(n).unwrap().to_be_bytes();
    let mut packet = vec![0x45, 0];
    packet.extend(bytes(28 + payload.len()));
    packet.extend([0, 0]);
    packet.extend(fragment.to_be_bytes());
    packet.extend([64, 17, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2]);
    packet.extend(8410_u16.to_be_bytes());
    packet.extend(7408_u16.to_be_bytes());
    packet.extend(bytes(8 + payload.len()));
    packet.extend([0, 0]);
    packet.extend(payload);
    packet
}

fn behind(header: &[u8], payload: &[u8]) -> Vec<u8> {
    [header, &ipv4(payload, 0)].concat()
}

fn content(link: u16, bytes: &[u8]) -> Content<'_> {
    Packet { number: 1, at: None, link, bytes }.content()
}

/// Numbers in the order of a capture.
fn put(order: ByteOrder, numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| if order == BIG { n.to_be_bytes() } else { n.to_le_bytes() }).collect()
}

const BIG: ByteOrder = ByteOrder::Big;
const LITTLE: ByteOrder = ByteOrder::Little;

fn pcap(order: ByteOrder, magic: u32, packets: &[(u32, u32, &[u8])]) -> Vec<u8> {
    let version = if order == BIG { 0x0002_0004 } else { 0x0004_0002 };
    let mut file = put(order, &[magic, version, 0, 0, 65_535, 101]);
    for &(seconds, fraction, bytes) in packets {
        let len = u32::try_from(bytes.len()).unwrap();
        file.extend(put(order, &[seconds, fraction, len, len]));
        file.extend(bytes);
    }
    file
}

fn block(order: ByteOrder, kind: u32, body: &[u8]) -> Vec<u8> {
    let padded = [body, &[0; 4][..body.len().next_multiple_of(4) - body.len()]].concat();
    let len = u32::try_from(padded.len() + 12).unwrap();
    [put(order, &[kind, len]), padded, put(order, &[len])].concat()
}

fn section(order: ByteOrder) -> Vec<u8> {
    block(order, 0x0a0d_0d0a, &put(order, &[0x1a2b_3c4d, 1, u32::MAX, u32::MAX]))
}

/// An interface of raw IP, keeping at most `snap_len` bytes.
fn interface(order: ByteOrder, snap_len: u32, options: &[u8]) -> Vec<u8> {
    let link = if order == BIG { 101 << 16 } else { 101 };
    block(order, 1, &[&put(order, &[link, snap_len])[..], options].concat())
}

fn enhanced(order: ByteOrder, interface: u32, time: [u32; 2], bytes: &[u8]) -> Vec<u8> {
    let len = u32::try_from(bytes.len()).unwrap();
    block(order, 6, &[&put(order, &[interface, time[0], time[1], len, len])[..], bytes].concat())
}

type Seen = (Option<Duration>, Vec<u8>);

/// All packets, and what ended the capture.
fn read(file: &[u8]) -> (Vec<Seen>, Result<(), CaptureError>) {
    let mut seen = Vec::new();
    let mut capture = match Capture::open(file) {
        Ok(capture) => capture,
        Err(error) => return (seen, Err(error)),
    };
    loop {
        match capture.packet() {
            Ok(Some(packet)) => seen.push((packet.at, packet.bytes.to_vec())),
            Ok(None) => return (seen, Ok(())),
            Err(error) => return (seen, Err(error)),
        }
    }
}

fn whole(file: &[u8]) -> Vec<Seen> {
    let (seen, end) = read(file);
    end.unwrap();
    seen
}

#[test]
fn every_link_type_leads_to_the_same_datagram() {
    let ethernet = [&[0; 12][..], &[8, 0]].concat();
    let vlan = [&[0; 12][..], &[0x88, 0xa8, 0, 7, 0x81, 0, 0, 9, 8, 0]].concat();
    let cooked = [&[0; 14][..], &[8, 0]].concat();
    let cooked_2 = [&[8, 0][..], &[0; 18]].concat();
    let headers: [(u16, &[u8]); 9] = [
        (0, &[2, 0, 0, 0]),
        (0, &[0, 0, 0, 2]),
        (1, &ethernet),
        (1, &vlan),
        (101, &[]),
        (108, &[0, 0, 0, 2]),
        (113, &cooked),
        (228, &[]),
        (276, &cooked_2),
    ];
    for (link, header) in headers {
        let bytes = behind(header, b"frame");
        let Content::Datagram(datagram) = content(link, &bytes) else { panic!("{link}: no datagram") };
        assert_eq!(datagram.payload, b"frame", "{link}");
        assert_eq!(datagram.source, "10.0.0.1:8410".parse().unwrap(), "{link}");
        assert_eq!(datagram.destination, "10.0.0.2:7408".parse().unwrap(), "{link}");
    }
    assert_eq!(content(127, &[0; 60]), Content::UnknownLink(127));
}

#[test]
fn what_an_ethernet_frame_is_padded_with_is_not_payload() {
    let bytes = [ipv4(b"ab", 0), vec![0; 30]].concat();
    let Content::Datagram(datagram) = content(101, &bytes) else { panic!("no datagram") };
    assert_eq!((datagram.payload, datagram.is_cut()), (&b"ab"[..], false));
}

#[test]
fn a_datagram_that_the_capture_cut_says_how_long_it_was() {
    let bytes = ipv4(&[7; 100], 0);
    let Content::Datagram(datagram) = content(101, &bytes[..68]) else { panic!("no datagram") };
    assert_eq!((datagram.payload, datagram.payload_len), (&[7; 40][..], 100));
    assert!(datagram.is_cut());
}

#[test]
fn fragments_are_named_and_only_the_first_has_ports() {
    let first = ipv4(&[0; 8], 0x2000);
    let Content::Fragment(fragment) = content(101, &first) else { panic!("no fragment") };
    assert_eq!((fragment.ports, fragment.offset), (Some((8410, 7408)), 0));
    let last = ipv4(&[0; 8], 185);
    let Content::Fragment(fragment) = content(101, &last) else { panic!("no fragment") };
    assert_eq!((fragment.ports, fragment.offset), (None, 1480));
}

#[test]
fn other_protocols_and_lying_lengths_are_something_else() {
    let mut tcp = ipv4(b"frame", 0);
    tcp[9] = 6;
    let mut ipv6 = ipv4(b"frame", 0);
    ipv6[0] = 0x65;
    let mut short_header = ipv4(b"frame", 0);
    short_header[0] = 0x44;
    let mut long_datagram = ipv4(b"frame", 0);
    long_datagram[25] += 1;
    for bytes in [tcp, ipv6, short_header, long_datagram, vec![0x45]] {
        assert_eq!(content(101, &bytes), Content::Other, "{bytes:02x?}");
    }
}

#[test]
fn pcap_is_read_in_both_orders_and_both_resolutions() {
    for order in [BIG, LITTLE] {
        let micro = whole(&pcap(order, 0xa1b2_c3d4, &[(5, 250_000, b"one"), (6, 0, b"")]));
        let at = |ms| Some(Duration::from_millis(ms));
        assert_eq!(micro, [(at(5_250), b"one".to_vec()), (at(6_000), Vec::new())]);
        let nano = whole(&pcap(order, 0xa1b2_3c4d, &[(5, 250_000_000, b"one")]));
        assert_eq!(nano[0].0, at(5_250));
    }
}

#[test]
fn pcapng_is_read_in_both_orders_and_over_sections() {
    for order in [BIG, LITTLE] {
        let other = if order == BIG { LITTLE } else { BIG };
        let file = [
            section(order),
            interface(order, 0, &[]),
            block(order, 0x0bad, b"skipped"),
            enhanced(order, 0, [1, 2], b"first"),
            section(other),
            interface(other, 4, &[]),
            block(other, 3, &[&put(other, &[6])[..], b"simple"].concat()),
        ]
        .concat();
        let us = (1 << 32) + 2;
        let expected = [(Some(Duration::from_micros(us)), b"first".to_vec()), (None, b"simp".to_vec())];
        assert_eq!(whole(&file), expected);
    }
}

#[test]
fn the_old_packet_block_names_its_interface_with_half_a_word() {
    for (order, drops) in [(BIG, 9), (LITTLE, 9 << 16)] {
        let body = [&put(order, &[drops, 0, 7, 3, 3])[..], b"old"].concat();
        let file = [section(order), interface(order, 0, &[]), block(order, 2, &body)].concat();
        assert_eq!(whole(&file), [(Some(Duration::from_micros(7)), b"old".to_vec())]);
    }
}

#[test]
fn resolution_and_offset_of_an_interface_are_heeded() {
    let at = |resolution: u8, offset: i64, low| {
        let mut options = [9_u16.to_be_bytes(), 1_u16.to_be_bytes()].concat();
        options.extend([resolution, 0, 0, 0, 0, 14, 0, 8]);
        options.extend(offset.to_be_bytes());
        let file = [section(BIG), interface(BIG, 0, &options), enhanced(BIG, 0, [0, low], b"")].concat();
        whole(&file)[0].0
    };
    assert_eq!(at(9, 0, 1_500), Some(Duration::from_nanos(1_500)));
    assert_eq!(at(3, 100, 1_500), Some(Duration::from_millis(101_500)));
    assert_eq!(at(0x80 | 10, 0, 512), Some(Duration::from_millis(500)));
    assert_eq!(at(0, -5, 4), None, "before 1970");
    assert_eq!(at(120, 0, 7), Some(Duration::from_micros(7)), "no such resolution");
}

#[test]
fn a_capture_cut_off_gives_its_whole_packets_first() {
    let file = pcap(LITTLE, 0xa1b2_c3d4, &[(1, 0, b"one"), (2, 0, b"two")]);
    for missing in [1, 2, 10] {
        let (seen, end) = read(&file[..file.len() - missing]);
        assert_eq!(seen.len(), 1);
        assert!(matches!(end, Err(CaptureError::Ends { at }) if at == (file.len() - missing) as u64));
    }
}

#[test]
fn damage_is_named_with_its_place() {
    let told = |file: &[u8]| read(file).1.unwrap_err().to_string();
    assert_eq!(told(b"GIF89a"), "byte 0: 47494638 opens neither pcap nor pcapng");
    let mut file = pcap(BIG, 0xa1b2_c3d4, &[(1, 0, b"one")]);
    file[32..36].copy_from_slice(&u32::MAX.to_be_bytes());
    assert_eq!(told(&file), "byte 24: a packet of 4294967295 bytes; at most 262144 are possible");
    let start = [section(BIG), interface(BIG, 0, &[])].concat();
    let stray = [start.clone(), enhanced(BIG, 3, [0, 0], b"")].concat();
    assert_eq!(told(&stray), "byte 48: packet refers to interface 3; 1 described");
    let odd = [start.clone(), put(BIG, &[6, 33])].concat();
    assert_eq!(told(&odd), "byte 48: a block of 33 bytes, where only multiples of 4 are possible");
    let mut liar = [start.clone(), enhanced(BIG, 0, [0, 0], b"")].concat();
    *liar.last_mut().unwrap() = 0;
    assert_eq!(told(&liar), "byte 48: a block of 32 bytes, where its end gives another length");
    let mut marked = section(BIG);
    marked[8] = 0;
    assert_eq!(told(&marked), "byte 8: 002b3c4d is not a byte-order mark of pcapng");
}

#[test]
fn captures_are_told_by_their_first_bytes() {
    assert!(is_capture([0xa1, 0xb2, 0xc3, 0xd4]) && is_capture([0x4d, 0x3c, 0xb2, 0xa1]));
    assert!(is_capture([0x0a, 0x0d, 0x0d, 0x0a]));
    assert!(!is_capture(*b"55aa"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn any_bytes_after_any_opening_come_to_an_end(
        opening in 0..4_usize,
        rest in proptest::collection::vec(any::<u8>(), 0..600),
    ) {
        let openings =
            [pcap(BIG, 0xa1b2_c3d4, &[]), pcap(LITTLE, 0xa1b2_3c4d, &[]), section(LITTLE), Vec::new()];
        let file = [openings[opening].clone(), rest].concat();
        let (seen, _) = read(&file);
        prop_assert!(seen.len() * 12 <= file.len(), "a packet takes a header");
    }

    #[test]
    fn a_capture_with_any_byte_changed_comes_to_an_end(at in any::<prop::sample::Index>(), to in any::<u8>()) {
        let packet = ipv4(b"frame", 0);
        let files = [
            pcap(LITTLE, 0xa1b2_c3d4, &[(1, 0, &packet), (2, 0, &packet)]),
            [section(BIG), interface(BIG, 0, &[]), enhanced(BIG, 0, [0, 1], &packet)].concat(),
        ];
        for mut file in files {
            let at = at.index(file.len());
            file[at] = to;
            for (_, bytes) in read(&file).0 {
                content(101, &bytes);
            }
        }
    }

    #[test]
    fn any_packet_of_any_link_type_is_taken(
        link in prop::sample::select(&[0, 1, 12, 14, 101, 108, 113, 228, 276, 999_u16][..]),
        bytes in proptest::collection::vec(any::<u8>(), 0..80),
        at in 0..80_usize,
    ) {
        content(link, &bytes);
        let mut packet = ipv4(&bytes, 0);
        packet.truncate(at);
        content(101, &packet);
    }
}
