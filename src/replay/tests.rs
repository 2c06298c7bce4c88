use std::io::Cursor;

use proptest::prelude::*;

use super::*;
use crate::belief::Fall;
use crate::health::{Continuity, HealthInput, HealthState, Identity, Sighting};
use crate::motion::{Pulses, SeatType, Slot, Window};
use crate::net::{Delivery, Origin};
use crate::record::{
    About, Asked, EntryMaker, FrameKind, Intake, Judging, Opening, RecordedSeat, Recorder, Recording,
    SAMPLE_HZ, Taps, TickHead,
};
use crate::time::{MonoTime, Rate, ShowTime};
use crate::tracker::{Fate, Reply};
use crate::wire::{Analogue, Code, MAX_LEN, Motion, ReplyCode, Timing, VibrationPort};

const MS: u64 = 1_000_000;

fn at(ms: u64) -> MonoTime {
    MonoTime::from_nanos(1_000 * MS + ms * MS)
}

fn frame_of(tick: u64) -> FrameNo {
    FrameNo(u32::try_from(tick + 1).expect("few"))
}

/// What a play of 300 ticks, 10 ms apart, of which each frame is acked after 2 ms, is recorded as; `records` says what the ack thread
/// takes after a tick.
fn recorded(records: impl Fn(u64) -> Vec<AckRecord<'static>>) -> Vec<u8> {
    recorded_by(|_| true, records)
}

/// The same where the recorder takes what is there only after some ticks.
fn recorded_by(takes: impl Fn(u64) -> bool, records: impl Fn(u64) -> Vec<AckRecord<'static>>) -> Vec<u8> {
    recorded_for(300, takes, records)
}

/// The same of so many ticks.
fn recorded_for(
    ticks_of_it: u64,
    takes: impl Fn(u64) -> bool,
    records: impl Fn(u64) -> Vec<AckRecord<'static>>,
) -> Vec<u8> {
    let seat = SeatType::bench3(3);
    let window = Window::new((0..3).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect());
    let seats = vec![RecordedSeat::new("F4", &window, FrameKind::Datagram(VibrationPort::Two))];
    let judging: Judging = serde_json::from_str(
        r#"{"ack_every":1,"is_hall":false,"controllers":[{"group":0,"dialect":"smc","estop_inputs":0,"station":[1,1],"acked_after_ns":0}]}"#,
    )
    .expect("a hall");
    let (rate, clocks) = (Rate::from_hz(100.0), (MonoTime::default(), 0));
    let opening = Opening::new(&About::of_hall("hall", rate, clocks), &seats).judged(&judging);
    let file = Recording::open(Cursor::default(), &opening, EntryMaker::new(1, clocks)).expect("memory");
    let (Taps { mut ticks, mut acks }, intake) = Intake::new(seats, rate, SAMPLE_HZ);
    let mut recorder = Recorder::new(intake.in_full(), file);
    for tick in 0..ticks_of_it {
        let motion = Motion {
            timing: Timing::Relative,
            channel: 0,
            accept: Code(0x101),
            reply: Code(0x101),
            frame: frame_of(tick),
            time_ms: 10,
            positions: &[Pulses(1_000); 3],
            outputs: 0,
            analogue: Analogue::default(),
            vibration: None,
        };
        ticks.asked(Asked::of([0.0; crate::motion::MAX_AXES], 3));
        ticks.frame(0, motion.emit(&mut [0; MAX_LEN]), at(10 * tick), Delivery::Sent);
        let film = ShowTime::from_millis((10 * tick).cast_signed());
        ticks.tick(&TickHead { film, ..TickHead::of(tick, at(10 * tick)) });
        records(tick).iter().for_each(|record| acks.take(record));
        acks.drained(at(10 * tick + 5));
        if takes(tick) {
            recorder.take().expect("memory");
        }
    }
    recorder.take().expect("memory");
    recorder.finish(None).expect("memory").into_inner()
}

/// What the ack thread takes after a tick where all is well.
fn well(tick: u64) -> Vec<AckRecord<'static>> {
    let (frame, code) = (frame_of(tick), ReplyCode::Running);
    let reply = Reply { controller: 0, frame, code, error: 0, inputs: 0, at: at(10 * tick + 2) };
    let begin = [AckRecord::First(0, frame), AckRecord::Watched];
    let begin = begin.into_iter().filter(|_| tick == 0);
    let of_frame = [
        AckRecord::Reply(reply),
        AckRecord::Posted(1, 0, frame),
        AckRecord::Fate(0, frame, Fate::Answered(code), 2_000_000),
    ];
    let end = (tick == 0).then_some(AckRecord::Standing(0, HealthState::Ok));
    begin.chain(of_frame).chain(end).collect()
}

fn judged(file: &[u8]) -> ReplayVerdict {
    replay(file).expect("a recording").1
}

#[test]
fn a_recording_of_a_play_is_judged_as_it_was_from_its_start() {
    let verdict = judged(&recorded(well));
    assert_eq!(verdict.differences, []);
    assert_eq!((verdict.frames, verdict.fates, verdict.gaps, verdict.from_the_start), (300, 300, 0, true));
    let seat = &verdict.seats[0];
    // Histograms have three digits.
    assert!(
        seat.frames.acked == 300 && seat.ack_us.max_us.is_some_and(|us| (us - 2_000.0).abs() < 2.0),
        "{seat:?}"
    );
}

#[test]
fn what_a_controller_counted_while_ticks_found_no_room_is_not_held_against_the_frames_that_are_there() {
    // For four seconds nobody takes anything: there is room for two of ticks, and for all replies.
    let takes = |tick: u64| !(100..500).contains(&tick);
    let file = recorded_for(1_000, takes, |tick| {
        let mut records = well(tick);
        // It is looked at in the gap, and twice behind it.
        if [350, 600, 800].contains(&tick) {
            let identity = Identity { version: 7, minor_version: 8, work_mode: 2, axes: 3 };
            let counted = u16::try_from(tick + 1).expect("few");
            let continuity = Continuity::Packets(counted);
            let sighting = Sighting { identity, error: 0, alarm: 0, continuity, homed: true };
            let look = [HealthInput::ReadSent(0, 1), HealthInput::Seen(0, sighting, at(10 * tick + 4))];
            records.extend(look.map(AckRecord::Health));
        }
        records
    });
    let verdict = judged(&file);
    assert_eq!(verdict.differences, []);
    assert!(verdict.gaps == 1 && (700..900).contains(&verdict.frames), "{verdict:?}");
}

#[test]
fn a_reply_that_was_taken_otherwise_is_told_with_its_seat_and_its_show_time() {
    let verdict = judged(&recorded(|tick| {
        let mut records = well(tick);
        if tick == 100 {
            records[2] = AckRecord::Fate(0, frame_of(100), Fate::Stale, 2_000_000);
        }
        records
    }));
    let first = &verdict.differences[0];
    assert_eq!((first.seat.as_deref(), first.what.as_str()), (Some("F4"), "the reply to frame 101"));
    assert_eq!((first.film_s, first.wall_ns), (1.0, at(1_005).as_nanos()));
    assert!(first.recorded.starts_with("Stale") && first.replayed.starts_with("Answered"), "{first:?}");
    assert!(verdict.differences.iter().any(|one| one.what == "acks in its samples"), "{verdict:?}");
}

#[test]
fn a_latency_that_is_another_is_told() {
    let verdict = judged(&recorded(|tick| {
        let mut records = well(tick);
        if tick == 100 {
            records[2] = AckRecord::Fate(0, frame_of(100), Fate::Answered(ReplyCode::Running), 2_001_000);
        }
        records
    }));
    let [only] = &verdict.differences[..] else { panic!("{verdict:?}") };
    assert!(only.recorded.contains("2001") && only.replayed.contains("2000"), "{only:?}");
}

#[test]
fn a_frame_that_was_lost_and_is_recorded_as_none_is_told() {
    let lost = |tells: bool| {
        judged(&recorded(move |tick| {
            let mut records = well(tick);
            if tick == 100 {
                records.retain(|one| matches!(one, AckRecord::Posted(..)));
            }
            // More than a second after it was sent.
            records.extend((tells && tick == 200).then_some(AckRecord::Lost(0, 1)));
            records
        }))
    };
    assert_eq!(lost(true).differences, []);
    let verdict = lost(false);
    assert_eq!(verdict.differences[0].what, "frames lost so far", "{verdict:?}");
}

#[test]
fn a_seat_that_stood_otherwise_is_told_once() {
    let verdict = judged(&recorded(|tick| {
        let mut records = well(tick);
        records.extend((tick == 150).then_some(AckRecord::Standing(0, HealthState::Lost)));
        records
    }));
    let [only] = &verdict.differences[..] else { panic!("{verdict:?}") };
    assert_eq!((only.what.as_str(), only.film_s), ("how it stands", 1.5));
}

#[test]
fn what_begins_in_the_middle_is_judged_from_where_enough_is_known() {
    let verdict = judged(&recorded(|tick| {
        let mut records = well(tick);
        records.retain(|one| !matches!(one, AckRecord::First(..) | AckRecord::Watched));
        if tick == 0 {
            // Replies to frames that left before.
            let before =
                |frame| AckRecord::Fate(0, FrameNo(frame), Fate::Answered(ReplyCode::Running), 2_000_000);
            records.splice(0..0, [AckRecord::Posted(7, 0, FrameNo(4_000_000_000)), before(4_000_000_000)]);
        }
        records
    }));
    assert_eq!((&verdict.differences[..], verdict.from_the_start), (&[][..], false));
    assert!(verdict.fates > 290, "{verdict:?}");
}

#[test]
fn where_ticks_found_no_room_it_is_judged_anew_from_behind_them() {
    // Two seconds of ticks are held.
    let verdict = judged(&recorded_by(|tick| !(20..250).contains(&tick), well));
    assert_eq!(verdict.differences, []);
    assert!(verdict.gaps > 0 && (200..290).contains(&verdict.fates), "{verdict:?}");
}

#[test]
fn a_sampled_recording_and_one_of_an_earlier_program_are_refused_in_words() {
    let sampled = crate::record::recorded_as(crate::record::Mode::Sampled, (0..10).map(|_| (0.5, 0.5)));
    assert!(matches!(replay(&sampled[..]), Err(ReplayError::NoReplies)));
    let earlier = crate::record::recorded_as(crate::record::Mode::Full, (0..10).map(|_| (0.5, 0.5)));
    assert!(matches!(replay(&earlier[..]), Err(ReplayError::NoJudging)));
}

fn any_record() -> impl Strategy<Value = AckRecord<'static>> {
    let time = (0..4_000_u64).prop_map(at);
    let (controller, frame) = (0..3_usize, any::<u32>().prop_map(|number| FrameNo(number >> (number % 32))));
    (controller, frame, time, 0..15_u8).prop_map(|(controller, frame, time, kind)| match kind {
        0 => AckRecord::First(controller, frame),
        1 => AckRecord::Posted(frame.0, controller, frame),
        2 => AckRecord::Failed(controller, frame),
        3 => AckRecord::Joined(controller),
        4 => AckRecord::FellOut(controller, Fall::Gap, 0.0),
        5 => AckRecord::Unread(controller),
        6 => AckRecord::Confirmed(controller, FrameNo(1), frame),
        13 => AckRecord::Withdrawn(controller, FrameNo(1), frame),
        7 => AckRecord::Fate(controller, frame, Fate::Stray, frame.0),
        8 => AckRecord::Heard(Origin::Controller(controller), time, b"\x33\xcc"),
        9 => AckRecord::Health(HealthInput::LookAnew(controller)),
        10 => AckRecord::Health(HealthInput::Count(controller, 7)),
        11 => AckRecord::Code(controller, ReplyCode::EmergencyStop, time),
        12 => AckRecord::Lost(controller, frame.0.into()),
        _ => AckRecord::Standing(controller, HealthState::Excluded),
    })
}

proptest! {
    #[test]
    fn no_recording_panics(odd in prop::collection::vec((0..300_u64, any_record()), 0..40)) {
        let file = recorded(|tick| {
            let mut records = well(tick);
            records.extend(odd.iter().filter(|(when, _)| *when == tick).map(|(_, record)| *record));
            records
        });
        judged(&file);
    }
}

/// Recordings of virtual halls, without names (`kinocue record cut --anonymous --whole`): frames that were lost; in the middle of a show, a seat
/// that came back by a look that was asked for before the file, and a refusal of a frame from before it.
#[test]
fn recordings_that_are_kept_are_judged_as_they_were_when_they_were_recorded() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/recordings");
    for (name, from_the_start) in [("lost-frames", true), ("came-back", false), ("refused", false)] {
        let file = std::fs::File::open(format!("{folder}/{name}.mcap")).expect("it is there");
        let (contents, verdict) = replay(file).expect("a recording");
        assert_eq!(verdict.differences, [], "{name}");
        assert_eq!((verdict.gaps, verdict.from_the_start), (0, from_the_start), "{name}");
        assert!(contents.trouble.is_none() && contents.faults.is_empty(), "{name}: {:?}", contents.faults);
        assert!(verdict.frames > 20 && verdict.fates > 20, "{name}: {verdict:?}");
        assert_eq!(verdict.unjudged > 0, name == "came-back", "{name}");
    }
}
