//! Files of all kinds, damaged by chance: whatever a reader is given it ends, says in plain lines what is wrong, and what it
//! takes is what a seat can follow.

#![allow(clippy::unwrap_used, reason = "whatever fails here fails the test")]

use std::io::Cursor;
use std::path::Path;

use kinocue::cue::{self, Source};
use kinocue::harness::config;
use kinocue::harness::device::settings;
use kinocue::harness::doors::{assert_read, is_plain};
use kinocue::harness::playlist::Playlist;
use proptest::prelude::*;

const CUE: &str = "# title: Störm\n# units: mm\ntime_ms,a1,a2,v1_hz,v1_amp,dac1,dac2,fx_air,fx_water\n\
    0,0.1,150,0,0,0,1,1,0\n16.6,0.3,5e-3,20,1.5,0.25,1,1,1\n33.3,1,2,20,1.5,5e-3,0,0,0\n50,,2,,,,,,\n";
const HALL: &str = include_str!("data/config/hall.toml");
const DAY: &str = "title = \"Saturday\"\ntimezone = \"UTC\"\n\n[[entry]]\ncue = \"seat-demo\"\npreset = \"kids\"\nthen = \"go\"\n\n\
    [[entry]]\ncue = \"storm\"\nlevel = \"60%\"\ntrim_ms = -40\neffects = { water = false }\nat = \"19:00\"\n\
    days = [\"fri\", \"sat\"]\n";
const SETTINGS: &str = "kinocue_settings = 1\n[controller.A1]\naddress = \"10.0.0.1:7408\"\ndialect = \"smc\"\n\
    [controller.A1.parameters]\nPA07 = 3000\nPA0b = 3000\n";

/// What damages a text: what ends lines, cells and numbers, and what a terminal obeys.
const NASTY: [&[u8]; 28] = [
    b"\x1b]0;x\x07",
    b"\x1b[2J",
    b"\x7f",
    "\u{9b}".as_bytes(),
    "\u{202e}".as_bytes(),
    "\u{2028}".as_bytes(),
    b"\0",
    b"\r",
    b"\n",
    b"\r\n",
    b"\t",
    b",",
    b"\"",
    b"\"\"\"",
    b"'",
    b"#",
    b"[",
    b"]]",
    b"{",
    b"=",
    b".",
    b"-",
    b"1e999",
    b"nan",
    b"\\u001b",
    b"\xff",
    b"99999999999999999999",
    b"\xef\xbb\xbf",
];

/// One damage, at a place in the file as a share of its length.
#[derive(Debug, Clone)]
enum Damage {
    Put(usize),
    Byte(u8),
    Cut(usize),
    Twice(usize),
    End,
}

fn damages() -> impl Strategy<Value = Vec<(f64, Damage)>> {
    let damage = prop_oneof![
        6 => (0..NASTY.len()).prop_map(Damage::Put),
        4 => any::<u8>().prop_map(Damage::Byte),
        3 => (1_usize..40).prop_map(Damage::Cut),
        3 => (1_usize..200).prop_map(Damage::Twice),
        1 => Just(Damage::End),
    ];
    prop::collection::vec((0.0..1.0, damage), 1..6)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a place"
)]
fn damaged(whole: &[u8], damages: &[(f64, Damage)]) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for (share, damage) in damages {
        let at = (bytes.len() as f64 * share) as usize;
        let end = |most: usize| (at + most).min(bytes.len());
        match damage {
            Damage::Put(which) => drop(bytes.splice(at..at, NASTY[*which].iter().copied())),
            Damage::Byte(byte) => bytes.iter_mut().skip(at).take(1).for_each(|there| *there = *byte),
            Damage::Cut(most) => drop(bytes.drain(at..end(*most))),
            Damage::Twice(most) => {
                let again = bytes[at..end(*most)].to_vec();
                bytes.splice(at..at, again);
            }
            Damage::End => bytes.truncate(at),
        }
    }
    bytes
}

#[test]
fn what_is_damaged_here_is_whole_before() {
    assert_read(cue::read(Path::new("t.csv"), CUE.as_bytes(), &Source::Native));
    for bytes in [mcap(), bare_mcap()] {
        assert!(cue::read(Path::new("t.mcap"), bytes.as_slice(), &Source::Native).is_ok());
    }
    assert!(Playlist::parse(Path::new("d.toml"), DAY).is_ok() && settings::parse(SETTINGS).is_ok());
}

fn mcap() -> Vec<u8> {
    let cue = cue::read(Path::new("t.csv"), CUE.as_bytes(), &Source::Native).unwrap();
    let mut file = Cursor::new(Vec::new());
    cue::write_mcap(&cue, &mut file).unwrap();
    file.into_inner()
}

/// The same without packing and without sums, so that damage inside reaches the messages.
fn bare_mcap() -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new()
        .use_chunks(false)
        .compression(None)
        .calculate_chunk_crcs(false)
        .calculate_data_section_crc(false)
        .calculate_summary_section_crc(false)
        .create(&mut file)
        .unwrap();
    let metadata = [("version", "1"), ("title", "Storm"), ("units", "fraction")];
    let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
    writer.write_metadata(&mcap::records::Metadata { name: "kinocue".to_owned(), metadata }).unwrap();
    let messages = [
        ("/cue/axes", 0, r#"{"a":[0,0.5]}"#),
        ("/cue/vibration", 0, r#"{"axis":1,"hz":20.0,"amp":0.01}"#),
        ("/cue/io", 5, r#"{"effects":{"wind":1,"air":0}}"#),
        ("/cue/marker", 5, r#"{"name":"drop"}"#),
        ("/cue/axes", 10, r#"{"a":[1,0.25]}"#),
        ("/cue/axes", 20, r#"{"a":[1e-2,0]}"#),
    ];
    for (topic, log_time, json) in messages {
        let channel_id = writer.add_channel(0, topic, "json", &Default::default()).unwrap();
        let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time, publish_time: 0 };
        writer.write_to_known_channel(&header, json.as_bytes()).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}

fn assert_faults_plain(faults: Result<(), String>) {
    if let Err(faults) = faults {
        assert!(is_plain(&faults), "{faults:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_damaged_csv_is_a_sound_cue_or_faults_in_plain_words(damages in damages()) {
        let bytes = damaged(CUE.as_bytes(), &damages);
        assert_read(cue::read(Path::new("t.csv"), bytes.as_slice(), &Source::Native));
    }

    #[test]
    fn damaged_rows_of_an_editor_are_a_sound_cue_or_faults_in_plain_words(damages in damages()) {
        let rows = b"line,time_ms,x,y,z\n1,1000,1,2,3\n2,500,7,8,9\n3,20,,8,9\n";
        let source = Source::Rows { unit: "mm".parse().unwrap() };
        assert_read(cue::read(Path::new("t.csv"), damaged(rows, &damages).as_slice(), &source));
    }

    #[test]
    fn a_damaged_mcap_is_a_sound_cue_or_faults_in_plain_words(damages in damages(), packed in any::<bool>()) {
        let bytes = damaged(&if packed { mcap() } else { bare_mcap() }, &damages);
        assert_read(cue::read(Path::new("t.mcap"), bytes.as_slice(), &Source::Native));
        assert_read(cue::recover(Path::new("t.mcap"), bytes.as_slice()).map(|(cue, _)| cue));
    }

    #[test]
    fn a_damaged_configuration_playlist_or_settings_file_has_faults_in_plain_words(damages in damages()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hall.toml");
        std::fs::write(&path, damaged(HALL.as_bytes(), &damages)).unwrap();
        assert_faults_plain(config::load(&path).map(drop).map_err(|faults| faults.to_string()));
        if let Ok(text) = String::from_utf8(damaged(DAY.as_bytes(), &damages)) {
            assert_faults_plain(Playlist::parse(Path::new("d.toml"), &text).map(drop).map_err(|faults| faults.to_string()));
        }
        if let Ok(text) = String::from_utf8(damaged(SETTINGS.as_bytes(), &damages)) {
            let _ = settings::parse(&text); // its one fault is shown by the commands, which escape it
        }
    }
}
