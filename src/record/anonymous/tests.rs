//! What an anonymous cut still says.

use std::io::Cursor;
use std::net::SocketAddrV4;

use crate::container::{Trouble, each_sound};
use crate::motion::Pulses;
use crate::net::{Delivery, Origin};
use crate::record::tests::{MS, asked, frame, head, window};
use crate::record::*;
use crate::time::{MonoTime, Rate, ShowTime};
use crate::wire::{
    Access, Code, MAX_LEN, PerAxis, RegisterReply, RegisterReport, ReplyCode, Status, VibrationPort, Words,
};

/// The address of a controller, its station, and a second of the wall clock, of a hall that nobody is to know.
const ADDRESS: [u8; 4] = [10, 177, 166, 155];
const STATION: Code = Code(0xa69b);
const WALL_S: u64 = 1_769_123_456;

/// Texts and octets by which a hall is known: each is in the recording of [`in_secret`], none in a cut of it.
fn secrets() -> Vec<Vec<u8>> {
    let texts = [
        "Hall Odeon",
        "Gravity",
        "gravity.csv",
        "d1ge57",
        "c0f1",
        "F4-left",
        "10.177.166.155",
        "Mallory",
        "17691234",
    ];
    let texts = texts.into_iter().map(|text| text.as_bytes().to_vec());
    let registers = ADDRESS.into_iter().flat_map(|octet| [0, octet]).collect();
    // In a time of messages, nanoseconds of 64 bits.
    let wall = (WALL_S * 1_000_000_000).to_le_bytes()[5..].to_vec();
    texts.chain([ADDRESS.to_vec(), registers, wall]).collect()
}

/// What controllers and others send to a hall, with what names them.
fn heard() -> Vec<(Origin, Vec<u8>)> {
    let from = |ip: [u8; 4]| Origin::Stranger(SocketAddrV4::new(ip.into(), 7_777));
    let mut buf = [0; MAX_LEN];
    let (positions, forces, servo_errors) =
        (PerAxis::new(&[Pulses(7); 3]), PerAxis::default(), PerAxis::default());
    let status =
        Status { station: STATION, positions, forces, servo_errors, error: 0, outputs: 0, inputs: 1 };
    let status = status.emit(&mut buf).to_vec();
    let address = ADDRESS.map(u16::from);
    let data = Words::from(&address[..]);
    let registers = RegisterReply {
        access: Access::Read,
        code: ReplyCode::Running,
        channel: 1,
        error: 0,
        start: 0x10,
        num: 4,
        data,
    };
    let registers = registers.emit(&mut buf).to_vec();
    let report = RegisterReport { channel: 1, accept: STATION, reply: STATION, start: 0x10, data };
    let report = report.emit(&mut buf).to_vec();
    let own = Origin::Controller(0);
    vec![
        (own, status.clone()),
        (from(ADDRESS), status),
        (own, registers),
        (own, report.clone()),
        (from(ADDRESS), report),
        (own, b"Mallory".to_vec()),
        (from([10, 177, 166, 9]), b"Mallory".to_vec()),
    ]
}

/// A recording in full of a hall that is known by all of [`secrets`].
fn in_secret() -> Vec<u8> {
    let [hall, cue, title, cue_sha256] =
        ["Hall Odeon", "gravity.csv", "Gravity", "d1ge57"].map(str::to_owned);
    let clocks = (MonoTime::default(), WALL_S * 1_000_000_000);
    let about = About { hall, cue, title, cue_sha256, rate_hz: 100.0, mode: Mode::Full, clocks };
    let seats = [RecordedSeat::new("F4-left", &window(), FrameKind::Datagram(VibrationPort::Two))
        .at("10.177.166.155:7408".to_owned())];
    let judging = r#"{"ack_every": 4, "is_hall": true, "controllers":
        [{"group": 0, "dialect": "smc", "estop_inputs": 0, "station": [166, 155], "acked_after_ns": 0}]}"#;
    let opening = Opening::new(&about, &seats)
        .judged(&serde_json::from_str(judging).unwrap())
        .with("config_sha256", "c0f1");
    let mut file = Recording::open(Cursor::new(Vec::new()), &opening, EntryMaker::new(1, clocks)).unwrap();
    let mark = MarkNote { film_s: 0.1, text: "F4-left jerked".to_owned(), who: "Mallory".to_owned() };
    file.write(MonoTime::default(), &Message::Note(Note::Mark(mark))).unwrap();
    file.attach("gravity.csv", "text/csv", b"Gravity").unwrap();
    let (Taps { ticks: mut tap, mut acks }, intake) =
        Intake::new(seats.to_vec(), Rate::from_hz(100.0), SAMPLE_HZ);
    let mut recorder = Recorder::new(intake.in_full(), file);
    let mut buf = [0; MAX_LEN];
    for tick in 0..100 {
        tap.asked(asked(0.5));
        let mut octets = frame(0.5, &mut buf).to_vec();
        octets[8..12].copy_from_slice(&[0xa6, 0x9b, 0xa6, 0x9b]);
        tap.frame(0, &octets, MonoTime::from_nanos(tick * 10 * MS), Delivery::Sent);
        tap.tick(&head(tick * 10));
        let at = MonoTime::from_nanos((tick * 10 + 5) * MS);
        heard().iter().for_each(|(origin, octets)| acks.take(&AckRecord::Heard(*origin, at, octets)));
        acks.drained(at);
        recorder.take().unwrap();
    }
    recorder.finish(Some(br#"{"cue": "gravity.csv", "seats": ["F4-left"]}"#)).unwrap().into_inner()
}

/// The octets of a file, of its records once unpacked, and of its ticks and drains; and those of its datagrams.
fn told_whole(file: &[u8]) -> (Vec<u8>, Vec<Vec<u8>>) {
    let (mut all, mut datagrams) = (file.to_vec(), Vec::new());
    let take = |_, body: &[u8]| {
        all.extend_from_slice(body);
        Ok::<_, Trouble>(())
    };
    each_sound(file, u64::MAX, take).unwrap();
    let take = &mut |_: &Contents, _, one: Told<'_>| match one {
        Told::Chunks(octets) => {
            each_chunk(&octets, |chunk| datagrams.extend(chunk.frames().map(|one| one.datagram.to_vec())));
            all.extend(octets);
        }
        Told::Drains(octets) => {
            let mut rest = octets.as_slice();
            while let Some((chunk, behind)) = AckChunk::parse(rest) {
                rest = behind;
                for record in chunk.records() {
                    if let AckRecord::Heard(_, _, heard) = record {
                        datagrams.push(heard.to_vec());
                    }
                }
            }
            all.extend(octets);
        }
        _ => {}
    };
    read(file, Wanted::ALL, take).unwrap();
    (all, datagrams)
}

#[test]
fn an_anonymous_cut_holds_nothing_that_its_hall_its_cue_or_its_day_is_known_by() {
    let has = |octets: &[u8], secret: &[u8]| octets.windows(secret.len()).any(|part| part == secret);
    let file = in_secret();
    let (all, datagrams) = told_whole(&file);
    for secret in secrets() {
        assert!(has(&all, &secret), "it is in the recording: {}", secret.escape_ascii());
    }
    let station = STATION.0.to_be_bytes();
    assert!(datagrams.iter().any(|one| has(one, &station)));
    let stretch = Stretch { from: ShowTime::ZERO, until: ShowTime::from_millis(900), seat: None };
    for (whole, scene) in [(true, false), (true, true), (false, true)] {
        let manner = CutManner { anonymous: true, whole, scene, film_time: false };
        let cut = cut(file.as_slice(), &stretch, manner, Cursor::new(Vec::new())).unwrap().0.into_inner();
        let (all, datagrams) = told_whole(&cut);
        for secret in secrets() {
            assert!(!has(&all, &secret), "{manner:?}: {} is in it", secret.escape_ascii());
        }
        assert!(!datagrams.iter().any(|one| has(one, &station)), "{manner:?}");
        // What is judged is there all the same.
        let statuses =
            datagrams.iter().filter(|one| Status::parse(one).is_ok_and(|one| one.inputs == 1)).count();
        assert_eq!(statuses, if whole { 2 * 91 } else { 0 });
    }
}
