//! Whatever comes in at a door, nothing panics: true messages and files, and each with a few octets wrong. `fuzz/run.sh` searches on from
//! the same beginnings.

#![allow(clippy::unwrap_used, reason = "whatever fails here fails the test")]

use std::fs;
use std::path::{Path, PathBuf};

use kinocue::harness::doors::DOORS;
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::Clock as _;
use sha2::{Digest as _, Sha256};

/// Wrong copies of each beginning.
const WRONG: usize = 60;

fn file(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn octets(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex.bytes().filter(u8::is_ascii_hexdigit).collect();
    let pair = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks_exact(2).map(pair).collect()
}

/// All strings of hexadecimal digits in a file.
fn hex_of(name: &str) -> Vec<Vec<u8>> {
    let text = String::from_utf8(file(name)).unwrap();
    let words = text.split(|sign: char| !sign.is_ascii_hexdigit());
    words.filter(|word| word.len() >= 16 && word.len() % 2 == 0).map(octets).collect()
}

/// The lines of a text that a whole file is too long for.
fn head(name: &str, lines: usize) -> Vec<u8> {
    let text = file(name);
    let end = text.iter().enumerate().filter(|(_, octet)| **octet == b'\n').nth(lines);
    end.map_or(&text[..], |(at, _)| &text[..=at]).to_vec()
}

/// What is true at a door.
fn beginnings(door: &str) -> Vec<Vec<u8>> {
    let text = |texts: &[&str]| texts.iter().map(|text| text.as_bytes().to_vec()).collect();
    match door {
        "controller" | "message" => {
            [hex_of("tests/golden/wire.json"), hex_of("tests/golden/show.hex")].concat()
        }
        "silvermax" => {
            text(&["*10\r", "# 10 000C 0000 0005\r", "! 10 0019 0006\r", "@16 12 1\r* 10\r", "@16\r"])
        }
        "sixpack2" => vec![octets("00015000000000000000 00012601020304050607 c8011400000000000000 0003")],
        "cue-csv" => vec![head("cues/bench-ride.csv", 40), head("cues/voyage.csv", 20)],
        "cue-mcap" => vec![file("cues/storm.mcap")],
        "cue-spreadsheet" => text(&[
            "sep=;\n\"# units: mm, deg\";;\nTime_ms;A1;A2\n0;0,5;1\n10;0,75;2\n;;\n",
            "# units: mm\ntime_s,a1\n0,0\n\"0,5\",\"1,25\"\n",
        ]),
        "cue-rows" => text(&["1,20,0,0,0,0,0,0\n2,20,1,1,1,0,0,0\n3,20,0,0,0,0,0,0\n"]),
        "cue-u8" => vec![vec![0; 30], (0..90).collect()],
        "config" => [
            "tests/data/config/hall.toml",
            "tests/data/config/drives.toml",
            "tests/data/config/every_fault.toml",
        ]
        .map(file)
        .into(),
        "playlist" => text(&[
            "title = \"Today\"\n[[entry]]\ncue = \"coaster\"\nat = \"19:00\"\nthen = \"go\"\nlevel = 0.8\n",
        ]),
        "settings" => text(&["[levels]\n"]),
        "registers" => text(&["controller,register,value\n"]),
        "journal" => vec![file("tests/data/journal.jsonl")],
        "label" => text(&["01:02:03:04", "23:59:59;29"]),
        "osc" => vec![
            b"/kinocue/go\0,f\0\0\x3f\x80\0\0".to_vec(),
            b"#bundle\0\0\0\0\0\0\0\0\x01\0\0\0\x10/kinocue/stop\0\0\0".to_vec(),
        ],
        "text" => text(&["go", "level 60%", "seek 01:02:03", "stop"]),
        "ntp" => {
            let packet = |head: [u8; 4]| [&head[..], &[0; 20], &[7; 8], &[9; 16]].concat();
            vec![packet([0x24, 2, 0, 0]), packet([0x24, 0, 0, 0]), packet([0xe4, 16, 0, 0])]
        }
        "letter" => {
            let body = r#"{\"id\":\"1\",\"to\":\"a.b\",\"word\":\"levels\",\"args\":{\"motion\":0.5},\"sent_ms\":1}"#;
            vec![format!("{{\"key\":\"U\",\"sig\":\"AA==\",\"body\":\"{body}\"}}").into_bytes()]
        }
        "order" => text(&[
            r#"{"id":"1","to":"berlin.h3","word":"levels","args":{"motion":0.5},"sent_ms":2000}"#,
            r#"{"id":"2","to":"berlin.h3","word":"load","args":{"cue":"ride"},"sent_ms":1500}"#,
            r#"{"id":"3","to":"berlin.h3","word":"trim","args":{"ms":-40},"sent_ms":2000}"#,
            r#"{"id":"4","to":"berlin.h3","word":"park","sent_ms":2000}"#,
        ]),
        "told" => text(&[
            r#"{"format":2,"hall":"Hall 1","state":"playing","moving":true,"seats":{"total":3,"taking_part":3,"lost":0},"show":{"cue":"ride","length_s":12.5}}"#,
            r#"{"n":7,"told":{"kinocue-2026-11-20-000.jsonl":3},"file":"kinocue-2026-11-20-000.jsonl","line":3,"record":{"kind":"start"}}"#,
        ]),
        "http" => requests(),
        "tracker" => vec![
            [&[1, 0, 0, 0, 1][..], &[0, 4, 0, 0, 0, 5, 9, 6].repeat(30)].concat(),
            vec![3, 0xff, 0xff, 0xff, 0xf0, 2, 40, 4, 1, 0, 7, 5, 230, 6],
        ],
        "health" => vec![
            [
                &[0, 1, 9, 1][..],
                &[0, 1, 0, 0, 1, 1, 0, 1, 2, 0, 6, 10, 7].repeat(40),
                &[6, 240, 7, 3, 0, 1, 2, 1, 0, 0, 0, 1, 7],
            ]
            .concat(),
        ],
        // Found parked, ready, armed, on the cue, late, and parked by a person.
        "hall" => vec![vec![
            1, 11, 1, 1, 0, 1, 13, 0, 0, 1, 0, 4, 1, 3, 3, 0, 2, 1, 4, 1, 2, 1, 3, 0, 9, 1, 7, 0, 8,
        ]],
        "wish" => {
            let digest = "5f".repeat(32);
            let body = format!(
                r#"{{\"to\":\"a.b\",\"rev\":7,\"cues\":{{\"storm\":{{\"sha256\":\"{digest}\",\"bytes\":9}}}}}}"#
            );
            let report = format!(
                r#"{{"rev":7,"cues":{{"storm":{{"sha256":"{digest}","bytes":9,"state":"fetching","percent":61}}}}}}"#
            );
            vec![
                format!("{{\"key\":\"U\",\"sig\":\"AA==\",\"body\":\"{body}\"}}").into_bytes(),
                report.into_bytes(),
            ]
        }
        "buttons" => vec![[[0; 16], [1, 0, 2, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0, 0, 0, 0]].concat(), vec![0; 48]],
        "ltc" => vec![
            [0].into_iter()
                .chain([[0_u8, 0x20].repeat(20), [0, 0xe0].repeat(20)].concat().repeat(40))
                .collect(),
        ],
        "mtc" => vec![(0..8).flat_map(|piece| [0xf1, piece << 4]).collect(), octets("f07f7f0101610203 04f7")],
        "artnet" => vec![[&b"\x13Art-Net\0\0\x97\0\x0e\0\0"[..], &[4, 3, 2, 1, 1]].concat().repeat(3)],
        "mpv" => text(&[
            "{\"event\":\"property-change\",\"id\":1,\"name\":\"pause\",\"data\":false}\n{\"request_id\":1,\"error\":\"success\",\"data\":12.5}\n",
        ]),
        "film-wav" => {
            let header = b"RIFF\x34\0\0\0WAVEfmt \x10\0\0\0\x01\0\x02\0\x80\xbb\0\0\0\xee\x02\0\x04\0\x10\0data\x10\0\0\0";
            vec![[&header[..], &[7; 16]].concat(), vec![1, 2, 3, 4, 5]]
        }
        "film-relay" => {
            let at = Monotonic.now().as_nanos().to_le_bytes();
            vec![[&b"kinocue relay 1 ltc\n"[..], &at, b"\x04\0abcd", &at, b"\x02\0ef"].concat()]
        }
        "film-position" => [
            text(&["{\"media_ms\": 61500.0, \"rate\": 1.001, \"playing\": true, \"age_ms\": 20}"]),
            vec![b"/kinocue/sync\0\0\0,hTd\0\0\0\0\0\0\0\0\0\0\xf0\x3c\x3f\xf0\0\0\0\0\0\0".to_vec()],
        ]
        .concat(),
        "film-index" => {
            let (blocks, marks) = (2_u32.to_le_bytes(), 2_u32.to_le_bytes());
            let content =
                [&b"KINOKIDX\x01\0\x03\0one"[..], &blocks, &marks, &[9; 130], &[1; 6], &[2; 6]].concat();
            vec![[&content[..], &Sha256::digest(&content)].concat()]
        }
        "recording" | "replay" => ["refused", "came-back", "lost-frames"]
            .map(|name| file(&format!("tests/data/recordings/{name}.mcap")))
            .into(),
        "capture" => vec![octets(
            "d4c3b2a1020004000000000000000000ffff000001000000 00000000000000000e0000000e000000 ffffffffffffffffffffffff0800",
        )],
        "latency" => text(&["#[StartTime: 1.0 (seconds since epoch)]\n"]),
        other => panic!("nothing is known to be true at {other}"),
    }
}

/// Requests to the API, one on each connection.
fn requests() -> Vec<Vec<u8>> {
    let asked = |line: &str, token: &str, body: &str| {
        let head = format!("{line} HTTP/1.1\r\nHost: hall\r\nConnection: close\r\n");
        let token =
            if token.is_empty() { String::new() } else { format!("Authorization: Bearer {token}\r\n") };
        let len = if body.is_empty() { String::new() } else { format!("Content-Length: {}\r\n", body.len()) };
        let kind = if body.is_empty() { "" } else { "Content-Type: application/json\r\n" };
        format!("{head}{token}{kind}{len}\r\n{body}").into_bytes()
    };
    vec![
        asked("GET /api/v1/status", "guest-token", ""),
        asked("POST /api/v1/show/stop", "guest-token", ""),
        asked("POST /api/v1/show/pause", "tablet-token", ""),
        asked("POST /api/v1/show/pause", "", ""),
        asked("POST /api/v1/show/arm", "booth-token", "{\"seats_empty\": false}"),
        asked("POST /api/v1/show/load", "tablet-token", "{\"cue\": \"ride\"}"),
        asked("POST /api/v1/show/seek", "tablet-token", "{\"position_s\": 12.5}"),
        asked("PUT /api/v1/levels", "tablet-token", "{\"motion\": 0.5, \"effects\": {\"air\": false}}"),
        asked("PUT /api/v1/cues/ride", "booth-token", "time_ms,a1\n0,0\n10,0\n"),
        asked("GET /api/v1/cues/ride/curve?points=10", "guest-token", ""),
        asked("GET /", "", ""),
        asked("GET /metrics", "guest-token", ""),
    ]
}

/// What a search has left in the repository: of each door the smallest octets that reach all of its code that was ever reached.
fn kept(door: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(door);
    let files = fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = files.collect();
    files.sort();
    files.into_iter().map(|path| fs::read(path).unwrap()).collect()
}

/// Octets with a few of them wrong, lost or doubled, by chance.
fn wrong(octets: &[u8], seed: &mut u64) -> Vec<u8> {
    let mut next = |below: usize| {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 33) as usize % below.max(1)
    };
    let mut octets = octets.to_vec();
    for _ in 0..=next(6) {
        let at = next(octets.len());
        match next(5) {
            0 if at < octets.len() => octets[at] ^= 1 << next(8),
            1 if at < octets.len() => octets[at] = [0, 0xff, 0x7f, 0x80, b'-'][next(5)],
            2 => octets.truncate(at),
            3 => {
                let piece = octets[at..(at + next(40)).min(octets.len())].to_vec();
                octets.splice(at..at, piece);
            }
            _ => drop(octets.drain(at..(at + next(8)).min(octets.len()))),
        }
    }
    octets
}

#[test]
fn nothing_that_comes_in_at_a_door_panics() {
    for (name, door) in DOORS {
        let begun = [beginnings(name), kept(name)].concat();
        assert!(!begun.is_empty(), "{name}");
        let (mut seed, copies) = (20_261_126, WRONG * 20 / begun.len().clamp(4, 200));
        for octets in &begun {
            door(octets);
            let copies = if octets.len() > 100_000 { 20 } else { copies };
            (0..copies).for_each(|_| door(&wrong(octets, &mut seed)));
        }
    }
}

/// Where the search begins, written out for it.
#[test]
fn each_door_has_beginnings_and_none_is_kept_for_a_door_that_is_not_there() {
    let written = std::env::var_os("KINOCUE_SEEDS").map(PathBuf::from);
    for (name, _) in DOORS {
        for (number, octets) in beginnings(name).iter().enumerate() {
            let Some(folder) = &written else { continue };
            fs::create_dir_all(folder.join(name)).unwrap();
            fs::write(folder.join(name).join(number.to_string()), octets).unwrap();
        }
    }
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let mut octets = 0;
    for entry in fs::read_dir(kept).into_iter().flatten() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(DOORS.iter().any(|(door, _)| *door == name), "{name}");
        let files = fs::read_dir(&path).unwrap().map(|file| file.unwrap().metadata().unwrap().len());
        octets += files.sum::<u64>();
    }
    assert!(octets < 300_000, "{octets} octets are kept; keep fewer (fuzz/keep.sh)");
}
