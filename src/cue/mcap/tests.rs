use std::io::Cursor;
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use proptest::prelude::*;

use super::*;
use crate::container::MAGIC;
use crate::cue::{self, Cue, CueFaults, Interpolation, Problem, Source, Unit};
use crate::time::ShowTime;

const CUE: &str = "# title: Störm\n# units: mm\n# interpolation: monotone\n\
    time_ms,a1,a2,v2_hz,v2_amp,fx_water,fx_air\n\
    0,0.1,150,0,0,1,0\n16.666667,0.30000000000000004,5e-324,20,1.5,1,1\n33.3,1,2,20,1.5,0,0\n";

fn csv(text: &str) -> Cue {
    cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native)
        .unwrap_or_else(|faults| panic!("{faults}"))
}

fn mcap_of(cue: &Cue) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    write(cue, &mut file).unwrap();
    file.into_inner()
}

fn csv_of(cue: &Cue) -> String {
    let mut text = Vec::new();
    cue::write_csv(cue, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

fn load(bytes: &[u8]) -> Result<Cue, CueFaults> {
    cue::read(Path::new("t.mcap"), bytes, &Source::Native)
}

fn faults(bytes: &[u8]) -> String {
    load(bytes).expect_err("no fault was found").to_string().replace("t.mcap: ", "")
}

/// A file made by hand: metadata, then messages of topic, log time and JSON.
fn file(metadata: &[(&str, &str)], messages: &[(&str, u64, &str)]) -> Vec<u8> {
    file_packed(Some(Compression::Lz4), metadata, messages)
}

fn file_packed(
    compression: Option<Compression>,
    metadata: &[(&str, &str)],
    messages: &[(&str, u64, &str)],
) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer =
        WriteOptions::new().compression(compression).compression_threads(0).create(&mut out).unwrap();
    let empty = std::collections::BTreeMap::new();
    for (topic, log_time, json) in messages {
        let channel_id = writer.add_channel(0, topic, "json", &empty).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: *log_time, publish_time: 0 };
        writer.write_to_known_channel(&header, json.as_bytes()).unwrap();
    }
    if !metadata.is_empty() {
        let metadata = metadata.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        writer.write_metadata(&mcap::records::Metadata { name: METADATA.to_owned(), metadata }).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    out.into_inner()
}

const FRACTION: &[(&str, &str)] = &[("version", "1"), ("units", "fraction")];
const ROWS: [(&str, u64, &str); 2] =
    [("/cue/axes", 0, r#"{"a":[0,0.5]}"#), ("/cue/axes", 10, r#"{"a":[1,1]}"#)];

/// The faults of a file with good rows and these messages behind them.
fn faults_behind_rows(messages: &[(&str, u64, &str)]) -> String {
    faults(&file(FRACTION, &[&ROWS, messages].concat()))
}

#[test]
fn csv_to_mcap_to_csv_keeps_every_value() {
    let first = csv(CUE);
    let second = load(&mcap_of(&first)).unwrap();
    assert_eq!((second.title(), second.units().of(0)), (Some("Störm"), Unit::Millimetre));
    assert_eq!(second.interpolation(), Interpolation::Monotone);
    assert_eq!((second.times(), second.positions()), (first.times(), first.positions()));
    assert_eq!((second.tracks(), second.effects()), (first.tracks(), first.effects()));
    assert_eq!(csv_of(&second), csv_of(&first));
    assert_eq!(csv_of(&csv(&csv_of(&first))), csv_of(&first));
    let words = csv("time_ms,a1,io\n0,0,0x5\n1,1,4095\n");
    assert_eq!(csv_of(&load(&mcap_of(&words)).unwrap()), csv_of(&words));
}

#[test]
fn metadata_may_stand_behind_the_messages() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let metadata = [("version", "1"), ("units", "percent"), ("interpolation", "hold")];
        let messages = [
            ("/cue/axes", 0, r#"{"a":[0,50]}"#),
            ("/other", 0, "anything"),
            ("/cue/marker", 5, r#"{"name":"drop"}"#),
            ("/cue/io", 5, r#"{"effects":{"wind":1,"air":0}}"#),
            ("/cue/io", 7, r#"{"effects":{"air":1}}"#),
            ("/cue/axes", 10, r#"{ "a" : [1e2, 0] }"#),
        ];
        let cue = load(&file_packed(compression, &metadata, &messages)).unwrap();
        assert_eq!((cue.units().of(0), cue.positions()), (Unit::Fraction, &[0.0, 0.5, 1.0, 0.0][..]));
        assert_eq!((cue.markers().len(), cue.markers()[0].at), (1, ShowTime::from_nanos(5)));
        let cue::Effects::Named { names, steps } = cue.effects() else { panic!("named effects") };
        assert_eq!((names.join(" "), steps.at(cue.duration(), &mut 0)), ("wind air".to_owned(), 0b11));
        let error = cue::write_csv(&cue, Vec::new()).unwrap_err().to_string();
        assert!(error.starts_with("an effect changes at 00:00.000, between two rows"), "{error}");
    }
}

#[test]
fn faults_are_placed_by_topic_message_and_log_time() {
    let at = |n: u64, ns: u64| format!("/cue/axes message {n}, log_time {ns} ns: ");
    assert_eq!(
        faults_behind_rows(&[("/cue/axes", 20, r#"{"a":[0.5,1.5]}"#)]),
        at(3, 20) + "a2: 1.5 is outside the stroke, 0 to 1"
    );
    assert_eq!(
        faults_behind_rows(&[("/cue/axes", 10, r#"{"a":[0,0]}"#)]),
        at(3, 10) + "00:00.000 is not after 00:00.000, the time before it"
    );
    assert_eq!(
        faults_behind_rows(&[("/cue/axes", 20, r#"{"a":[0]}"#)]),
        at(3, 20) + "1 axes, but the first message has 2"
    );
    assert_eq!(
        faults_behind_rows(&[("/cue/vibration", 0, r#"{"axis":3,"hz":1,"amp":0}"#)]),
        "/cue/vibration message 1, log_time 0 ns: axis: the cue has no axis 3; its axes are 1 to 2"
    );
    assert_eq!(
        faults_behind_rows(&[("/cue/vibration", 3, r#"{"axis":1,"hz":0.01,"amp":2}"#)]),
        "/cue/vibration message 1, log_time 3 ns: hz: 0.01 Hz is neither 0 nor within 0.1221 to 8000 Hz\n\
         /cue/vibration message 1, log_time 3 ns: amp: an amplitude of 2 is outside 0 to 1"
    );
}

#[test]
fn messages_that_are_not_what_they_should_be_are_refused() {
    for (json, expected) in [
        (
            r#"{"dac1":0.5,"dac2":1.5}"#,
            "dac2: a level of 1.5 is outside 0 to 1, the full range of the output",
        ),
        (r#"{"dac1":0.33777,"dac2":0.67111}"#, "dac1 and dac2 make 0x5678abcd"),
        (r#"{"dac1":0}"#, "not the JSON of its topic: missing field `dac2`"),
        (r#"{"axis":1,"dac1":0,"dac2":0}"#, "not the JSON of its topic: unknown field `axis`"),
        (r#"{"dac1":0,"dac1":0,"dac2":0}"#, "not the JSON of its topic: duplicate field `dac1`"),
    ] {
        let told = faults_behind_rows(&[("/cue/analogue", 3, json)]);
        assert!(told.starts_with(&format!("/cue/analogue message 1, log_time 3 ns: {expected}")), "{told}");
    }
    for (topic, json, expected) in [
        ("/cue/axes", r#"{"a":["x",1]}"#, "not the JSON of its topic: invalid type: string"),
        ("/cue/axes", r#"{"a":[1e999,1]}"#, "not the JSON of its topic: number out of range"),
        ("/cue/axes", r#"{"a":[NaN,1]}"#, "not the JSON of its topic: expected value"),
        ("/cue/axes", r#"{"b":[0,1]}"#, "not the JSON of its topic: unknown field `b`"),
        ("/cue/axes", "\u{0}", "not the JSON of its topic"),
        ("/cue/vibration", r#"{"axis":1,"hz":1}"#, "not the JSON of its topic: missing field `amp`"),
        ("/cue/io", r#"{"effects":{"air":2}}"#, "\"2\" is neither 0 nor 1"),
        ("/cue/io", r#"{"effects":{"Air":1}}"#, "an effect's name may only have"),
        ("/cue/io", r#"{"word":65536}"#, "not the JSON of its topic: invalid value"),
        ("/cue/io", r#"{"word":4096}"#, "\"4096\" is not an output word; 0 to 4095"),
        ("/cue/io", r#"{"word":1,"effects":{"air":1}}"#, "the raw output word and named effects exclude"),
        ("/cue/io", "{}", "not the JSON of its topic: neither effects nor word"),
    ] {
        let told = faults_behind_rows(&[(topic, 20, json)]);
        let number = if topic == "/cue/axes" { 3 } else { 1 };
        assert!(told.starts_with(&format!("{topic} message {number}, log_time 20 ns: {expected}")), "{told}");
    }
    let late =
        faults_behind_rows(&[("/cue/marker", 20, r#"{"name":""}"#), ("/cue/marker", 19, r#"{"name":""}"#)]);
    assert_eq!(late, "/cue/marker message 2, log_time 19 ns: comes 1 ns before the message before it");
    let both =
        faults_behind_rows(&[("/cue/io", 1, r#"{"effects":{"air":1}}"#), ("/cue/io", 2, r#"{"word":1}"#)]);
    assert!(
        both.ends_with("log_time 2 ns: the raw output word and named effects exclude each other"),
        "{both}"
    );
    let long = format!(r#"{{"a":[0,0{}]}}"#, " ".repeat(70_000));
    assert!(faults_behind_rows(&[("/cue/axes", 20, &long)]).ends_with("longer than 65536 bytes, the limit"));
    let end = faults_behind_rows(&[("/cue/axes", u64::MAX, r#"{"a":[0,0]}"#)]);
    assert!(
        end.ends_with("18446744073709551615 ns is after 24:00:00.000, the latest time of a cue"),
        "{end}"
    );
}

#[test]
fn foreign_files_are_refused() {
    assert_eq!(faults(b""), "is empty; a cue needs at least two rows");
    assert_eq!(faults(b"time_ms,a1\n0,0\n1,0\n"), "not an MCAP cue: it does not begin as MCAP files do");
    assert_eq!(faults(&file(&[], &ROWS)), "not an MCAP cue: it has no metadata record \"kinocue\"");
    assert_eq!(faults(&file(FRACTION, &[])), "number of rows: 0; a cue needs at least two");
    assert_eq!(
        faults_behind_rows(&[("/cue/smell", 0, "{}")]),
        "unknown topic \"/cue/smell\"; a cue has /cue/axes, /cue/vibration, /cue/analogue, /cue/io and /cue/marker"
    );
    assert_eq!(
        faults(&file(&[("version", "2"), ("interpolation", "sine")], &ROWS)),
        "version: \"2\" is not known; this program reads version 1\n\
         units: \"\" is not known; units are fraction, percent, u8, mm, deg or pulse\n\
         interpolation: \"sine\" is not known; interpolations are spline, monotone, linear or hold"
    );
    assert!(
        faults(&file(&[("kind", "recording"), ("version", "2")], &[])).contains("--take sent` makes a cue")
    );
    assert!(
        faults(&file(FRACTION, &[("/cue/axes", 1, r#"{"a":[0]}"#)]))
            .ends_with("the first time is 1 ns and must be 0")
    );
}

#[test]
fn an_mcap_is_known_by_its_first_bytes_whatever_its_name() {
    let bytes = mcap_of(&csv(CUE));
    assert!(cue::read(Path::new("storm.dat"), bytes.as_slice(), &Source::Native).is_ok());
}

#[test]
fn a_cut_file_is_refused_for_play_and_its_complete_messages_are_saved() {
    let rows: String =
        (0..5000).map(|k| format!("{},{}\n", k * 10, (f64::from(k) * 0.618).fract())).collect();
    let whole = csv(&format!("time_ms,a1\n{rows}"));
    let bytes = mcap_of(&whole);
    assert!(
        recover(Path::new("t"), bytes.as_slice())
            .is_ok_and(|(cue, lost)| lost.is_none() && cue.rows() == 5000)
    );
    let cut = &bytes[..bytes.len() / 2];
    assert!(faults(cut).starts_with("the file is cut short; `kinocue convert --recover`"));
    let (saved, lost) = recover(Path::new("t"), cut).unwrap();
    assert_eq!(lost, Some(Problem::CutShort));
    assert!((1000..4999).contains(&saved.rows()), "{}", saved.rows());
    assert_eq!(saved.positions(), &whole.positions()[..saved.rows()]);
}

#[test]
fn every_cut_is_refused_and_none_panics() {
    let bytes = mcap_of(&csv(CUE));
    for length in 0..bytes.len() {
        assert!(load(&bytes[..length]).is_err(), "{length}");
        let _ = recover(Path::new("t"), &bytes[..length]);
    }
}

#[test]
fn every_changed_byte_is_survived() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let bytes = file_packed(compression, FRACTION, &ROWS);
        for at in 0..bytes.len() {
            for flip in [0x01, 0x80, 0xff] {
                let mut changed = bytes.clone();
                changed[at] ^= flip;
                let _ = load(&changed);
                let _ = recover(Path::new("t"), changed.as_slice());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn nothing_from_outside_panics(bytes in proptest::collection::vec(any::<u8>(), 0..2048)) {
        let _ = load(&[MAGIC, &bytes].concat());
    }

    #[test]
    fn any_cue_survives_the_way_there_and_back(
        rows in proptest::collection::vec((1_u64..1_000_000_000, 0.0..=1.0, 0.0..=1.0), 2..50),
    ) {
        let mut ns = 0;
        let text: String = rows.iter().enumerate().map(|(n, (gap, a, b))| {
            ns += if n == 0 { 0 } else { *gap };
            format!("{}.{:09},{a},{b}\n", ns / 1_000_000_000, ns % 1_000_000_000)
        }).collect();
        let first = csv(&format!("time_s,a1,a2\n{text}"));
        prop_assert_eq!(first.duration().as_nanos().unsigned_abs(), ns);
        let second = load(&mcap_of(&first)).unwrap();
        prop_assert_eq!(first.positions(), second.positions());
        let third = csv(&csv_of(&second));
        prop_assert_eq!((first.times(), first.positions()), (third.times(), third.positions()));
    }
}

/// A record as it stands in a file.
fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], (body.len() as u64).to_le_bytes().as_slice(), body].concat()
}

/// A chunk that says that it unpacks to so many bytes.
fn chunk(compression: &str, unpacked: u64, packed: &[u8]) -> Vec<u8> {
    let name = u32::try_from(compression.len()).unwrap().to_le_bytes();
    let front =
        [&[0; 16], unpacked.to_le_bytes().as_slice(), &[0; 4], &name, compression.as_bytes()].concat();
    record(0x06, &[&front, (packed.len() as u64).to_le_bytes().as_slice(), packed].concat())
}

/// A file of these records; the footer is none of ours.
fn file_of(records: &[&[u8]], summary: u64, offsets: u64) -> Vec<u8> {
    let footer = [&summary.to_le_bytes()[..], &offsets.to_le_bytes(), &[0; 4]].concat();
    let header = record(0x01, &[0; 8]);
    let end = [record(0x0f, &[0; 4]), record(0x02, &footer)].concat();
    [MAGIC, &header, &records.concat(), &end, MAGIC].concat()
}

#[test]
fn a_chunk_that_unpacks_to_more_than_any_cue_is_refused_before_it_is_unpacked() {
    struct Counting<'a>(&'a [u8], u64);
    impl std::io::Read for Counting<'_> {
        fn read(&mut self, space: &mut [u8]) -> std::io::Result<usize> {
            let bytes = self.0.read(space)?;
            self.1 += bytes as u64;
            Ok(bytes)
        }
    }
    let packed = vec![0; 1 << 20];
    for (compression, unpacked) in [("zstd", 2 << 30), ("lz4", 1 << 40), ("zstd", u64::MAX), ("", 1 << 40)] {
        let bytes = file_of(&[&chunk(compression, unpacked, &packed)], 0, 0);
        let mut input = Counting(&bytes, 0);
        let told = cue::read(Path::new("t.mcap"), &mut input, &Source::Native).unwrap_err().to_string();
        assert!(told.starts_with("t.mcap: byte 25: damaged: a chunk "), "{told}");
        assert!(told.contains(&unpacked.to_string()), "{told}");
        assert!(input.1 < 1 << 20, "{} bytes were read of it", input.1);
    }
}

#[test]
fn records_that_are_none_are_refused_at_the_first() {
    let bytes = file_of(&[&[0; 90]], 0, 0);
    assert!(faults(&bytes).starts_with("byte 25: damaged: a record has opcode 0"), "{}", faults(&bytes));
    let zeros = chunk("", 90, &[0; 90]);
    let told = faults(&file_of(&[&zeros], 0, 0));
    assert!(told.starts_with("byte 25: damaged: a record has opcode 0"), "{told}");
}

#[test]
fn a_footer_that_points_past_itself_is_refused_with_its_place() {
    let whole = mcap_of(&csv(CUE));
    let footer = whole.len() - MAGIC.len() - 29;
    assert_eq!(whole[footer], 0x02);
    for (field, what) in [(9, "summary"), (17, "summary offsets")] {
        for at in [footer as u64 + 1, 1 << 40, u64::MAX, 3] {
            let mut bytes = whole.clone();
            bytes[footer + field..][..8].copy_from_slice(&at.to_le_bytes());
            bytes[footer + 25..][..4].fill(0); // its sum is not to be looked at
            assert_eq!(
                faults(&bytes),
                format!(
                    "byte {footer}: damaged: a footer that looks for the {what} at byte {at}, and stands at {footer} \
                     itself; `kinocue convert --recover` saves the complete messages before the damage"
                )
            );
            let (saved, lost) = recover(Path::new("t"), bytes.as_slice()).unwrap();
            assert!(lost.is_some() && saved.rows() == 3, "all messages stand before it");
        }
    }
}

#[test]
fn a_channel_whose_schema_is_missing_is_refused_with_its_place() {
    let text = |text: &str| [&u32::try_from(text.len()).unwrap().to_le_bytes(), text.as_bytes()].concat();
    let channel = |schema: u16, topic| {
        let body = [&1_u16.to_le_bytes()[..], &schema.to_le_bytes(), &text(topic), &text("json"), &[0; 4]];
        record(0x04, &body.concat())
    };
    let schema = record(
        0x03,
        &[&7_u16.to_le_bytes()[..], &text("cue.axes"), &text("jsonschema"), &text("{}")].concat(),
    );
    let missing = file_of(&[&schema, &channel(8, "/cue/axes")], 0, 0);
    let at = 25 + schema.len();
    let told = faults(&missing);
    assert!(
        told.starts_with(&format!("byte {at}: damaged: /cue/axes has schema 8, which does not")),
        "{told}"
    );
    for good in [channel(7, "/cue/axes"), channel(0, "/cue/axes"), channel(8, "/somebody/else")] {
        let told = faults(&file_of(&[&schema, &good], 0, 0));
        assert_eq!(told, "not an MCAP cue: it has no metadata record \"kinocue\"");
    }
}

#[test]
fn rows_that_repeat_for_an_hour_are_no_bomb() {
    let rows: String = (0..40_000).map(|k| format!("{},0.5,0.5,0.5,0.5,0.5,0.5\n", k * 10)).collect();
    let cue = csv(&format!("time_ms,a1,a2,a3,a4,a5,a6\n{rows}"));
    for chunk_size in [64 << 10, 1 << 20, 64 << 20] {
        let mut out = Cursor::new(Vec::new());
        let mut writer = WriteOptions::new()
            .compression(Some(Compression::Zstd))
            .compression_threads(0)
            .chunk_size(Some(chunk_size))
            .create(&mut out)
            .unwrap();
        let metadata = FRACTION.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        writer.write_metadata(&mcap::records::Metadata { name: METADATA.to_owned(), metadata }).unwrap();
        let channel_id = writer.add_channel(0, "/cue/axes", "json", &Default::default()).unwrap();
        for time in cue.times() {
            let log_time = time.as_nanos().unsigned_abs();
            let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, br#"{"a":[0.5,0.5,0.5,0.5,0.5,0.5]}"#).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        let bytes = out.into_inner();
        assert_eq!(load(&bytes).unwrap().rows(), cue.rows(), "{chunk_size} in {} bytes", bytes.len());
    }
}

/// A frame of zstd (RFC 8878) that holds these bytes, in blocks of at most so many.
fn frame(bytes: &[u8], longest: usize, checksum: bool) -> Vec<u8> {
    let mut packed = [&[0x28, 0xb5, 0x2f, 0xfd, u8::from(checksum) << 2][..], &[0]].concat(); // a window of 1 KiB
    let blocks = bytes.len().div_ceil(longest);
    for (n, block) in bytes.chunks(longest).enumerate() {
        let repeated = block.iter().all(|byte| *byte == block[0]);
        let (kind, content) = if repeated { (1, &block[..1]) } else { (0, block) };
        let header = u32::from(n + 1 == blocks) | kind << 1 | u32::try_from(block.len()).unwrap() << 3;
        packed.extend_from_slice(&header.to_le_bytes()[..3]);
        packed.extend_from_slice(content);
    }
    if checksum {
        packed.extend_from_slice(&[0; 4]); // nobody looks: the chunk has a checksum of its own
    }
    packed
}

#[test]
fn a_chunk_may_be_of_several_zstd_frames_with_some_between_that_hold_nothing() {
    let text = |text: &str| [&u32::try_from(text.len()).unwrap().to_le_bytes(), text.as_bytes()].concat();
    let pairs: Vec<u8> = FRACTION.iter().flat_map(|(key, value)| [text(key), text(value)].concat()).collect();
    let length = u32::try_from(pairs.len()).unwrap().to_le_bytes();
    let metadata = record(0x0c, &[&text("kinocue")[..], &length, &pairs].concat());
    let channel = [&1_u16.to_le_bytes()[..], &[0; 2], &text("/cue/axes"), &text("json"), &[0; 4]].concat();
    let row = |at: u64, json: &str| {
        let at = at.to_le_bytes();
        record(0x05, &[&1_u16.to_le_bytes()[..], &[0; 4], &at, &at, json.as_bytes()].concat())
    };
    let spaces = " ".repeat(4000);
    let rows = [row(0, &format!("{{\"a\":{spaces}[0,0.5]}}")), row(10, "{\"a\":[1,1]}")].concat();
    let records = [record(0x04, &channel), rows].concat();
    let nothing = [&[0x50, 0x2a, 0x4d, 0x18, 5, 0, 0, 0][..], &[9; 5]].concat();
    for (longest, checksum) in [(7, false), (7, true), (1024, false), (1024, true)] {
        let (front, back) = records.split_at(2000);
        let frames = [frame(front, longest, checksum), nothing.clone(), frame(back, longest, !checksum)];
        let packed = [&nothing[..], &frames.concat()].concat();
        let chunk = |packed: &[u8]| chunk("zstd", records.len() as u64, packed);
        let cue = load(&file_of(&[&metadata, &chunk(&packed)], 0, 0)).unwrap();
        assert_eq!(cue.positions(), &[0.0, 0.5, 1.0, 1.0], "blocks of {longest}, checksum {checksum}");
        for length in 0..packed.len() - 10 {
            let told = load(&file_of(&[&metadata, &chunk(&packed[..length])], 0, 0)).unwrap_err().to_string();
            assert!(told.contains("damaged"), "{length}: {told}");
        }
    }
}
