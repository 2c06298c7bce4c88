use super::*;
use crate::harness::shown::{Luck, mono};
use crate::time::ShowTime;

/// As `ola_timecode` sends 01:02:03:04 of type 1.
const GOLDEN: [u8; 19] = [
    0x41, 0x72, 0x74, 0x2d, 0x4e, 0x65, 0x74, 0x00, 0x00, 0x97, 0x00, 0x0e, 0x00, 0x00, 0x04, 0x03, 0x02,
    0x01, 0x01,
];

fn reader() -> ArtNetReader {
    ArtNetReader::new(Some(FrameRate::F25), "01:00:00:00".parse().expect("it is a label"))
}

#[test]
fn the_bytes_of_others_are_read_and_ours_are_as_theirs() {
    let label = "01:02:03:04".parse().expect("it is a label");
    assert_eq!(ArtTimecode::parse(&GOLDEN), Some(ArtTimecode { label, labels: 25 }));
    assert_eq!(ArtTimecode::emit(label, FrameRate::F25), GOLDEN);
    for rate in FrameRate::ALL {
        let label = Label { drops: rate.drops(), ..label };
        let read = ArtTimecode::parse(&ArtTimecode::emit(label, rate)).expect("it is one");
        assert_eq!((read.label, read.labels), (label, rate.labels()));
    }
}

#[test]
fn what_is_short_or_of_another_kind_is_no_timecode() {
    for length in 0..GOLDEN.len() {
        assert_eq!(ArtTimecode::parse(&GOLDEN[..length]), None);
    }
    for (index, value) in [(0, 0x42), (8, 0x01), (9, 0x50), (11, 13), (14, 25), (18, 4)] {
        let mut bytes = GOLDEN;
        bytes[index] = value;
        assert_eq!(ArtTimecode::parse(&bytes), None, "byte {index}");
    }
    assert!(
        ArtTimecode::parse(&[&GOLDEN[..], &[0; 500]].concat()).is_some(),
        "padding is none of our business"
    );
}

#[test]
fn a_datagram_says_where_the_film_is_and_what_is_none_is_counted() {
    let (mut reader, mut heard) = (reader(), Vec::new());
    reader.hear(&GOLDEN, mono(1.0), &mut |told| heard.push(told));
    reader.hear(b"what", mono(2.0), &mut |told| heard.push(told));
    let media = ShowTime::from_millis(123_160);
    assert_eq!(heard, [Observation::new(mono(1.0), FilmWord::Position(media))]);
    assert_eq!(reader.garbage(), 1);
}

#[test]
fn no_datagram_makes_the_reader_panic() {
    let (mut luck, mut reader) = (Luck::new(5), reader());
    for _ in 0..5_000 {
        let mut bytes = [GOLDEN, GOLDEN].concat();
        for _ in 0..luck.below(4) {
            bytes[luck.below(38)] = luck.bits() as u8;
        }
        bytes.truncate(luck.below(39));
        reader.hear(&bytes, MonoTime::from_nanos(luck.bits()), &mut |_| ());
    }
}
