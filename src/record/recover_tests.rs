//! What is saved of a damaged file, and what is said of the rest, whatever is damaged.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::ops::Range;

use mcap::records::{MessageHeader, Metadata};
use mcap::{MessageStream, Summary, Writer};
use proptest::prelude::*;
use proptest::sample::Index;

use super::tests::recorded_as;
use super::*;

/// A message as it stands in a file.
type Kept = (String, u64, Vec<u8>);

fn kept(message: &mcap::Message<'_>) -> Kept {
    (message.channel.topic.clone(), message.log_time, message.data.to_vec())
}

fn all(file: &[u8]) -> Vec<Kept> {
    MessageStream::new(file).unwrap().map(|message| kept(&message.unwrap())).collect()
}

/// Chunks of a whole file: where each is, and its messages.
fn chunks(file: &[u8]) -> Vec<(Range<usize>, Vec<Kept>)> {
    let summary = Summary::read(file).unwrap().unwrap();
    let place = |octets: u64| usize::try_from(octets).unwrap();
    let of = |index: &mcap::records::ChunkIndex| {
        let messages = summary.stream_chunk(file, index).unwrap().map(|one| kept(&one.unwrap())).collect();
        let at = place(index.chunk_start_offset);
        (at..at + place(index.chunk_length), messages)
    };
    summary.chunk_indexes.iter().map(of).collect()
}

fn whole() -> Vec<u8> {
    thread_local!(static WHOLE: Vec<u8> = recorded_as(Mode::Full, (0..700).map(|tick| {
        let place = 0.5 + 0.2 * (f64::from(tick) * 0.04).sin();
        (place, place)
    })));
    WHOLE.with(Clone::clone)
}

fn recovered(file: &[u8]) -> (Recovered, Vec<u8>) {
    let (recovered, out) = recover(Cursor::new(file), Cursor::new(Vec::new())).unwrap();
    (recovered, out.into_inner())
}

/// What happens to files.
#[derive(Debug, Clone)]
enum Damage {
    Bit(Index, u8),
    Zeros(Index, usize),
    Cut(Index),
    /// Of the index at the end.
    End(Index),
}

impl Damage {
    /// Does it behind the first octets.
    fn on(&self, file: &mut Vec<u8>, first: usize) {
        let len = file.len();
        let place = |at: &Index| first + at.index(len - first);
        match self {
            Self::Bit(at, bit) => file[place(at)] ^= 1 << bit,
            Self::Zeros(at, count) => file[place(at)..len.min(place(at) + count)].fill(0),
            Self::Cut(at) => file.truncate(place(at)),
            Self::End(at) => file[len - 1 - at.index(28)] ^= 0x40,
        }
    }
}

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        4 => (any::<Index>(), 0..8_u8).prop_map(|(at, bit)| Damage::Bit(at, bit)),
        3 => (any::<Index>(), prop_oneof![Just(512_usize), Just(4_096), 1..20_000_usize])
            .prop_map(|(at, count)| Damage::Zeros(at, count)),
        1 => any::<Index>().prop_map(Damage::Cut),
        2 => any::<Index>().prop_map(Damage::End),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn whatever_is_damaged_all_outside_the_damaged_chunks_is_saved_and_the_loss_that_is_said_is_the_loss(
        damages in prop::collection::vec(damage(), 1..4),
    ) {
        let whole = whole();
        let chunks = chunks(&whole);
        let mut file = whole.clone();
        let first = chunks[0].0.start;
        for damage in &damages {
            if file.len() > first + 100 {
                damage.on(&mut file, first);
            }
        }
        let (recovered, out) = recovered(&file);
        let saved = all(&out);
        let words = recovered.in_words();
        // A chunk is whole where none of its octets was changed.
        let is_sound = |place: &Range<usize>| file.get(place.clone()) == Some(&whole[place.clone()]);
        for message in chunks.iter().filter(|(place, _)| is_sound(place)).flat_map(|(_, messages)| messages) {
            prop_assert!(saved.contains(message), "{} at {} is not saved: {words}", message.0, message.1);
        }
        let total: Vec<&Kept> = chunks.iter().flat_map(|(_, messages)| messages).collect();
        prop_assert!(saved.iter().all(|message| total.contains(&message)), "nothing is made up: {words}");
        let lost: Vec<&&Kept> = total.iter().filter(|message| !saved.contains(message)).collect();
        if let Some(count) = recovered.lost_messages() {
            prop_assert_eq!(count, lost.len() as u64, "{}", words);
        }
        prop_assert!(lost.is_empty() || !recovered.loses_nothing(), "{} are lost: {words}", lost.len());
        for (topic, at, _) in lost {
            let is_in = |one: &crate::container::LostStretch| {
                let (from, until) = one.span;
                from.is_none_or(|from| from <= *at) && until.is_none_or(|until| *at <= until)
            };
            prop_assert!(recovered.salvaged.lost.iter().any(is_in), "{topic} at {at}: {words}");
        }
    }
}

#[test]
fn a_page_of_zeros_costs_the_chunk_that_it_is_in_and_no_more_with_an_index_or_without() {
    let whole = whole();
    let chunks = chunks(&whole);
    let place = chunks[3].0.clone();
    let mut file = whole.clone();
    // The end of one record and the head of the next.
    file[place.start - 20..place.start + 40].fill(0);
    let total = all(&whole).len() as u64;
    let lost = chunks[3].1.len() as u64;
    for has_index in [true, false] {
        if !has_index {
            let end = file.len() - 10;
            file[end] ^= 1;
        }
        let (recovered, out) = recovered(&file);
        let words = recovered.in_words();
        assert_eq!(all(&out).len() as u64, total - lost, "{words}");
        assert_eq!(recovered.lost_messages(), has_index.then_some(lost), "{words}");
        assert_eq!(recovered.salvaged.lost.len(), 1, "{words}");
        assert!(!recovered.loses_nothing() && words.contains(" s from "), "{words}");
    }
}

#[test]
fn where_only_the_index_is_damaged_nothing_is_lost_and_where_a_record_between_is_that_is_said() {
    let whole = whole();
    let mut file = whole.clone();
    let end = file.len() - 30;
    file[end] ^= 1;
    let (one, out) = recovered(&file);
    assert!(one.loses_nothing() && one.in_words() == "is damaged: the index at its end", "{one:?}");
    assert_eq!(all(&out), all(&whole));
    // The description of the file, in which no sum is but that of all.
    let mut file = whole.clone();
    let name = file.windows(2).position(|two| two == b"A1").unwrap();
    file[name] = b'B';
    let words = recovered(&file).0.in_words();
    assert!(words.starts_with("is damaged: something outside of its chunks"), "{words}");
    assert_eq!(recovered(&whole).0.in_words(), "was whole");
}

#[test]
fn a_file_whose_schemas_and_channels_are_lost_is_saved_by_what_it_says_of_itself() {
    let whole = whole();
    let chunks = chunks(&whole);
    let mut file = whole.clone();
    // The first chunk has them, and so has the index.
    file[chunks[0].0.clone()].fill(0);
    let end = file.len() - 30;
    file[end] ^= 1;
    let (one, out) = recovered(&file);
    let saved: Vec<Kept> = chunks[1..].iter().flat_map(|(_, messages)| messages.clone()).collect();
    assert_eq!(all(&out), saved, "{}", one.in_words());
    let summary = Summary::read(&out).unwrap().unwrap();
    assert!(summary.channels.values().all(|channel| channel.schema.is_some()));
}

#[test]
fn a_recording_within_an_attachment_is_not_taken_for_part_of_the_file_that_it_is_attached_to() {
    let inner = whole();
    let mut file =
        Recording::begin(Cursor::new(Vec::new()), &super::tests::about(), &[super::tests::seat()]).unwrap();
    let note = |ms: u64| {
        let note = EventNote { kind: "standing", seat: "A1".to_owned(), text: ms.to_string() };
        (crate::time::MonoTime::from_nanos(ms * 1_000_000), Message::Note(Note::Event(note)))
    };
    (0..10).map(note).for_each(|(at, message)| file.write(at, &message).unwrap());
    file.flush().unwrap();
    file.attach("cue.mcap", "application/octet-stream", &inner).unwrap();
    (10..20).map(note).for_each(|(at, message)| file.write(at, &message).unwrap());
    let mut file = file.finish(&[], None).unwrap().into_inner();
    let total = all(&file);
    let head = file.windows(8).position(|octets| octets == b"cue.mcap").unwrap();
    // Its length, and the index at the end.
    file[head - 4 - 16 - 8] ^= 1;
    let end = file.len() - 30;
    file[end] ^= 1;
    let (one, out) = recovered(&file);
    assert_eq!(all(&out), total, "{}", one.in_words());
    assert!(!one.loses_nothing());
}

/// The same recording with its records in another order.
fn in_order_of(file: &[u8], metadata_first: bool, key: impl Fn(usize, &Kept) -> u64) -> Vec<u8> {
    let summary = Summary::read(file).unwrap().unwrap();
    let metadata: Vec<Metadata> =
        (summary.metadata_indexes.iter()).map(|index| mcap::read::metadata(file, index).unwrap()).collect();
    let mut writer = Writer::new(Cursor::new(Vec::new())).unwrap();
    let put =
        |writer: &mut Writer<_>| metadata.iter().try_for_each(|one| writer.write_metadata(one)).unwrap();
    if metadata_first {
        put(&mut writer);
    }
    let mut messages: Vec<_> = MessageStream::new(file).unwrap().map(Result::unwrap).enumerate().collect();
    messages.sort_by_cached_key(|(number, message)| key(*number, &kept(message)));
    for (_, message) in messages {
        let schema = message.channel.schema.as_ref().unwrap();
        let schema = writer.add_schema(&schema.name, &schema.encoding, &schema.data).unwrap();
        let (topic, encoding) = (&message.channel.topic, &message.channel.message_encoding);
        let channel_id = writer.add_channel(schema, topic, encoding, &BTreeMap::new()).unwrap();
        let log_time = message.log_time;
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, &message.data).unwrap();
    }
    if !metadata_first {
        put(&mut writer);
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

fn refused(file: &[u8]) -> bool {
    let read_ahead = read_ahead(file, Wanted::ALL, &mut |_, _, _| ());
    let [one, ahead] = [read(file, Wanted::ALL, &mut |_, _, _| ()), read_ahead].map(|read| match read {
        Err(error @ ReadError::Order(_)) => {
            error.to_string().ends_with("which kinocue record recover puts right")
        }
        _ => false,
    });
    one && ahead
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_recording_in_another_order_is_refused_with_a_remedy_that_gives_back_every_message_at_its_time(
        metadata_first in any::<bool>(),
        keys in prop::collection::vec(any::<u64>(), 40),
        by_channel in any::<bool>(),
    ) {
        let whole = whole();
        let file = in_order_of(&whole, metadata_first, |number, (topic, ..)| {
            if by_channel { topic.len() as u64 } else { keys[number % keys.len()] }
        });
        prop_assert!(refused(&file));
        let (recovered, out) = recovered(&file);
        prop_assert!(recovered.loses_nothing(), "{}", recovered.in_words());
        let (mut before, mut after) = (all(&whole), all(&out));
        prop_assert!(after.is_sorted_by_key(|(_, at, _)| *at));
        before.sort();
        after.sort();
        prop_assert_eq!(before, after);
        let [one, other] = [whole, out].map(|file| read(file.as_slice(), Wanted::ALL, &mut |_, _, _| ()).unwrap());
        prop_assert_eq!((one.begin, one.end, one.messages), (other.begin, other.end, other.messages));
    }
}

#[test]
fn a_recording_that_has_its_metadata_at_its_end_is_no_foreign_file() {
    let file = in_order_of(&whole(), false, |number, _| number as u64);
    assert!(refused(&file) && matches!(beginning(Cursor::new(&file)), Err(ReadError::Order(_))));
    assert_eq!(recovered(&file).0.in_words(), "has its records in another order than that of time");
}
