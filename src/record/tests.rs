//! From frames to the file that is read back.

use std::io::{self, Cursor, Seek, Write};

use mcap::MessageStream;
use proptest::prelude::*;
use serde_json::Value;

use super::ack_columns::unpacked;
use super::chunk::{ChunkWriter, Handed, SentFrame};
use super::*;
use crate::health::HealthState;
use crate::motion::{MAX_AXES, SeatType, Slot, Window};
use crate::net::{Delivery, Origin, SendFault};
use crate::state::{PlayMode, State};
use crate::time::{MonoTime, Rate, ShowTime};
use crate::tracker::Fate;
use crate::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, PerAxis, ReplyCode, Timing, VibrationPort};

pub(super) const MS: u64 = 1_000_000;
const PLAYING: State = State::Playing(PlayMode::Following);

pub(super) fn window() -> Window {
    let seat = SeatType::bench3(3);
    Window::new((0..3).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect())
}

pub(super) fn seat() -> RecordedSeat {
    RecordedSeat::new("A1", &window(), FrameKind::Datagram(VibrationPort::Two))
}

pub(super) fn head(ms: u64) -> TickHead {
    let film = ShowTime::from_millis(ms.cast_signed());
    let deadline = MonoTime::from_nanos(ms * MS);
    TickHead { index: ms, deadline, late_ns: 1_000 * ms, missed: 0, film, state: PLAYING }
}

pub(super) fn asked(place: f64) -> Asked {
    Asked { pose: [place; MAX_AXES], slots: 3, level: 1.0, clamps: 0 }
}

/// A frame that sends all axes to that fraction of the stroke.
pub(super) fn frame(place: f64, buf: &mut [u8; MAX_LEN]) -> &[u8] {
    let positions = [0, 1, 2].map(|slot| window().slots()[slot].pulses(place));
    let motion = Motion {
        timing: Timing::Relative,
        channel: 0,
        accept: Code(0xffff),
        reply: Code::NONE,
        frame: FrameNo(1),
        time_ms: 10,
        positions: &positions,
        outputs: 0,
        analogue: Analogue::default(),
        vibration: None,
    };
    motion.emit(buf)
}

pub(super) fn about() -> About {
    About {
        hall: "hall".to_owned(),
        cue: "ride.csv".to_owned(),
        title: String::new(),
        cue_sha256: "00".to_owned(),
        rate_hz: 100.0,
        mode: Mode::Sampled,
        clocks: (MonoTime::from_nanos(0), 1_000_000 * MS),
    }
}

/// What a play of these ticks, each of a place asked for and one sent, comes to as a file; ticks 10 ms apart.
fn recorded(ticks: impl Iterator<Item = (f64, f64)>) -> Vec<u8> {
    recorded_as(Mode::Sampled, ticks)
}

pub(crate) fn recorded_as(mode: Mode, ticks: impl Iterator<Item = (f64, f64)>) -> Vec<u8> {
    recorded_falling(mode, ticks, |_| None)
}

/// The same of a seat whose group stands otherwise from some ticks on, and gets no frame where it may not move.
pub(crate) fn recorded_falling(
    mode: Mode,
    ticks: impl Iterator<Item = (f64, f64)>,
    standing: impl Fn(u64) -> Option<HealthState>,
) -> Vec<u8> {
    recorded_of(mode, ticks.map(|(wanted, sent)| (wanted, sent, None)), standing, |tick| 10 * tick)
}

/// The same of ticks at which the film was there, ms.
pub(crate) fn recorded_filmed(
    mode: Mode,
    ticks: impl Iterator<Item = (f64, f64)>,
    film_ms: impl Fn(u64) -> u64,
) -> Vec<u8> {
    recorded_of(mode, ticks.map(|(wanted, sent)| (wanted, sent, None)), |_| None, film_ms)
}

/// The same of ticks of places sent, at which the seat was measured to be elsewhere.
pub(crate) fn recorded_measured(ticks: impl Iterator<Item = (f64, Option<f64>)>) -> Vec<u8> {
    let ticks = ticks.map(|(sent, measured)| (sent, sent, measured));
    recorded_of(Mode::Sampled, ticks, |_| None, |tick| 10 * tick)
}

/// The same of all of these.
pub(crate) fn recorded_of(
    mode: Mode,
    ticks: impl Iterator<Item = (f64, f64, Option<f64>)>,
    standing: impl Fn(u64) -> Option<HealthState>,
    film_ms: impl Fn(u64) -> u64,
) -> Vec<u8> {
    let seats = [seat()];
    let (Taps { ticks: mut tap, mut acks }, intake) =
        Intake::new(seats.to_vec(), Rate::from_hz(100.0), SAMPLE_HZ);
    let intake = if mode == Mode::Full { intake.in_full() } else { intake };
    let about = About { mode, ..about() };
    let file = Recording::begin(Cursor::new(Vec::new()), &about, &seats).unwrap();
    let mut recorder = Recorder::new(intake, file);
    let mut may_move = true;
    for (tick, (wanted, sent, measured)) in (0_u64..).zip(ticks) {
        let mut buf = [0; MAX_LEN];
        if let Some(standing) = standing(tick) {
            may_move = standing.may_move();
            acks.take(&AckRecord::Standing(0, standing));
        }
        if may_move {
            tap.asked(asked(wanted));
            tap.frame(0, frame(sent, &mut buf), MonoTime::from_nanos(tick * 10 * MS), Delivery::Sent);
        }
        tap.tick(&TickHead { film: head(film_ms(tick)).film, ..head(tick * 10) });
        // Every second frame is acked, 2 ms after it was sent.
        if tick % 2 == 0 {
            let fate = Fate::Answered(ReplyCode::Running);
            acks.take(&AckRecord::Fate(0, FrameNo(u32::try_from(tick).unwrap()), fate, 2_000_000));
        }
        if let Some(place) = measured {
            let at = MonoTime::from_nanos((tick * 10 + 3) * MS);
            let pulses = PerAxis::from_fn(3, |slot| window().slots()[slot].pulses(place));
            acks.take(&AckRecord::Measured(0, at, pulses));
        }
        acks.drained(MonoTime::from_nanos((tick * 10 + 5) * MS));
        recorder.take().unwrap();
    }
    recorder.finish(Some(b"{}")).unwrap().into_inner()
}

fn messages(file: &[u8]) -> Vec<(String, u64, Value)> {
    let message = |message: mcap::Message<'_>| {
        let value = serde_json::from_slice(&message.data).unwrap();
        (message.channel.topic.clone(), message.log_time, value)
    };
    MessageStream::new(file).unwrap().map(|one| message(one.unwrap())).collect()
}

#[test]
fn what_is_heard_of_a_seat_without_frames_is_told_of_the_show_time_then() {
    let ticks = (0..200).map(|_| (0.5, 0.5));
    let file = recorded_falling(Mode::Sampled, ticks, |tick| match tick {
        0 => Some(HealthState::Ok),
        100 => Some(HealthState::Lost),
        _ => None,
    });
    let seats = messages(&file).into_iter().filter(|(topic, ..)| topic == "/seat/A1");
    let late: Vec<_> = seats.filter(|(.., sample)| sample["sent"] == 0).collect();
    assert!(!late.is_empty(), "acks went on");
    for (_, at, sample) in late {
        let film_s = sample["film_s"].as_f64().unwrap();
        assert!((1.0..2.0).contains(&film_s), "at {at}: {sample}");
    }
}

#[test]
fn a_seat_that_falls_out_is_told_in_that_window_though_nothing_more_is_heard_of_it() {
    let (Taps { ticks: mut tap, mut acks }, mut intake) =
        Intake::new(vec![seat()], Rate::from_hz(100.0), SAMPLE_HZ);
    let mut told = Vec::new();
    for tick in 0..60 {
        let mut buf = [0; MAX_LEN];
        match tick {
            0 => acks.take(&AckRecord::Standing(0, HealthState::Ok)),
            20 => acks.take(&AckRecord::Standing(0, HealthState::Lost)),
            _ => {}
        }
        if tick < 18 {
            tap.asked(asked(0.5));
            tap.frame(0, frame(0.5, &mut buf), MonoTime::from_nanos(10 * tick * MS), Delivery::Sent);
        }
        tap.tick(&head(10 * tick));
        acks.drained(MonoTime::from_nanos((10 * tick + 5) * MS));
        intake.take(&mut |at, message| {
            if let Message::Seat(_, sample) = message {
                told.push((at, sample));
            }
        });
    }
    let mut falls = Falls::default();
    told.iter().for_each(|(at, sample)| falls.take(*at, &sample.sum()));
    let SeatFall { out: (_, film_s), standing, still, .. } = falls.first.expect("it fell out");
    assert!(standing == HealthState::Lost && (0.2..0.25).contains(&film_s), "{film_s}");
    let (_, still_s) = still.expect("it was sent somewhere before");
    assert!((0.15..0.18).contains(&still_s), "{still_s}: it stood still before it was found to be out");
    let [at, late] = [20 * 10, 500].map(|ms| MonoTime::from_nanos(ms * MS));
    assert!(falls.distance(at) < falls.distance(late), "it is nearer to when it did");
    assert_eq!(told.iter().filter(|(_, sample)| sample.sent == 0).count(), 1, "and once");
}

#[test]
fn a_sample_is_the_worst_of_its_window_and_its_counts_are_of_all() {
    // For one tick of the second window the seat was asked for 15 mm more than it was sent.
    let file = recorded((0..10).map(|tick| (if tick == 7 { 0.6 } else { 0.5 }, 0.5)));
    let all = messages(&file);
    let seats: Vec<_> = all.iter().filter(|(topic, ..)| topic == "/seat/A1").collect();
    assert_eq!(seats.len(), 2);
    let (_, at, sample) = seats[1];
    assert_eq!(*at, (1_000_000 + 70) * MS, "it is of the tick in which they differed");
    assert_eq!((&sample["film_s"], &sample["sent"]), (&Value::from(0.07), &Value::from(5)));
    let (acked, ack_us) = (&sample["acked"], &sample["ack_max_us"]);
    assert_eq!((acked, ack_us), (&Value::from(2), &Value::from(2_000.0)), "its acks are of the same window");
    assert_eq!((&sample["asked_mm"][2], &sample["sent_mm"][2]), (&Value::from(90.0), &Value::from(75.0)));
    let ticks: Vec<_> = all.iter().filter(|(topic, ..)| topic == "/tick").collect();
    assert_eq!((ticks.len(), &ticks[1].2["ticks"], &ticks[1].2["late_max_us"]), (2, &5.into(), &90.0.into()));
    let states: Vec<_> = all.iter().filter(|(topic, ..)| topic == "/hall").collect();
    assert_eq!(states.len(), 1, "a state is told when it changes");
}

#[test]
fn what_found_no_room_before_the_threads_let_go_of_their_taps_is_counted_in_the_file() {
    let seats = [seat()];
    let (Taps { ticks: mut tap, mut acks }, intake) =
        Intake::new(seats.to_vec(), Rate::from_hz(100.0), SAMPLE_HZ);
    let file = Recording::begin(Cursor::new(Vec::new()), &about(), &seats).unwrap();
    let mut recorder = Recorder::new(intake, file);
    // Nobody takes anything for five seconds; the taps hold two.
    for tick in 0..500 {
        let mut buf = [0; MAX_LEN];
        tap.asked(asked(0.5));
        tap.frame(0, frame(0.5, &mut buf), MonoTime::from_nanos(10 * tick * MS), Delivery::Sent);
        tap.tick(&head(10 * tick));
        acks.take(&AckRecord::Heard(Origin::Controller(0), MonoTime::default(), &[0; 1_400]));
        acks.drained(MonoTime::from_nanos((10 * tick + 5) * MS));
    }
    drop((tap, acks));
    recorder.take().unwrap();
    let file = recorder.finish(None).unwrap().into_inner();
    let (contents, summary) = summarize(file.as_slice()).unwrap();
    assert!(summary.dropped > 200 && summary.ticks + summary.dropped == 500, "{summary:?}");
    assert_eq!(contents.end["dropped"], summary.dropped.to_string());
    assert!(contents.end["dropped_records"].parse::<u32>().unwrap() > 300, "{:?}", contents.end);
}

#[test]
fn a_file_says_what_it_is_of_first_and_what_it_came_to_last() {
    let file = recorded((0..10).map(|_| (0.5, 0.5)));
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    let names: Vec<_> = summary.metadata_indexes.iter().map(|one| one.name.as_str()).collect();
    assert_eq!((names, summary.attachment_indexes.len()), (vec!["kinocue", "kinocue.end"], 1));
    let end = mcap::read::metadata(&file, &summary.metadata_indexes[1]).unwrap().metadata;
    let counts = ["ticks", "frames", "dropped", "acked", "refused", "dropped_records"].map(|key| &*end[key]);
    assert_eq!(counts, ["10", "10", "0", "5", "0", "0"]);
}

#[test]
fn acks_that_come_after_the_last_tick_are_in_samples_and_drains_as_they_are_in_the_counts() {
    let (Taps { ticks: mut tap, mut acks }, intake) =
        Intake::new(vec![seat()], Rate::from_hz(100.0), SAMPLE_HZ);
    let mut intake = intake.in_full();
    let (mut acked, mut fates) = (0, 0);
    let mut tell = |_, message| match message {
        Message::Seat(0, sample) => acked += sample.acked,
        Message::Drains(drains) => {
            let drains = unpacked(&drains).expect("they are ours");
            let mut rest = drains.as_slice();
            while let Some((chunk, behind)) = AckChunk::parse(rest) {
                fates += chunk.records().filter(|one| matches!(one, AckRecord::Fate(..))).count();
                rest = behind;
            }
        }
        _ => {}
    };
    let mut ack = |frame, ms| {
        acks.take(&AckRecord::Fate(0, FrameNo(frame), Fate::Answered(ReplyCode::Running), 2_000_000));
        acks.drained(MonoTime::from_nanos(ms * MS));
    };
    let mut buf = [0; MAX_LEN];
    tap.asked(asked(0.5));
    tap.frame(0, frame(0.5, &mut buf), MonoTime::from_nanos(0), Delivery::Sent);
    tap.tick(&head(0));
    ack(1, 5);
    intake.take(&mut tell);
    // One file ends here, and the next has no tick any more.
    intake.close(&mut tell);
    ack(2, 200);
    intake.take(&mut tell);
    intake.close(&mut tell);
    intake.close(&mut tell);
    assert_eq!((acked, fates, intake.counts().acked), (2, 2, 2));
}

#[test]
fn of_a_tick_that_finds_no_room_nothing_is_kept_and_the_next_says_so() {
    let (mut tap, mut ring) = tap(&[seat()], Rate::from_hz(1.0));
    let mut buf = [0; MAX_LEN];
    let octets = frame(0.5, &mut buf);
    for tick in 0..5 {
        tap.frame(0, octets, MonoTime::from_nanos(tick), Delivery::Sent);
        tap.tick(&head(tick));
    }
    let mut held = vec![0; ring.slots()];
    ring.pop_entire_slice(&mut held).unwrap();
    let (first, rest) = Chunk::parse(&held).unwrap();
    let (second, rest) = Chunk::parse(rest).unwrap();
    assert_eq!(([first.head, second.head], rest.len()), ([head(0), head(1)], 0));
    tap.tick(&head(5));
    let mut held = vec![0; ring.slots()];
    ring.pop_entire_slice(&mut held).unwrap();
    let (next, _) = Chunk::parse(&held).unwrap();
    assert_eq!((next.head.index, next.dropped, next.frames().count()), (5, 3, 0));
}

#[test]
fn what_the_kernel_did_not_take_is_counted_apart() {
    let mut fold = Sampled::new(vec![seat()], SAMPLE_HZ);
    let (mut tap, mut ring) = tap(&[seat(), seat(), seat()], Rate::from_hz(100.0));
    let mut buf = [0; MAX_LEN];
    let octets = frame(0.5, &mut buf);
    for delivery in
        [Delivery::Sent, Delivery::SentAfterRefusal, Delivery::Failed(SendFault::of(libc::EAGAIN))]
    {
        tap.asked(asked(0.5));
        tap.frame(0, octets, MonoTime::from_nanos(0), delivery);
    }
    tap.tick(&head(0));
    let mut held = vec![0; ring.slots()];
    ring.pop_entire_slice(&mut held).unwrap();
    let mut samples = Vec::new();
    fold.take(&Chunk::parse(&held).unwrap().0, &mut |_, message| samples.push(message));
    fold.close(&mut |_, message| samples.push(message));
    let counts = samples.iter().find_map(|message| match message {
        Message::Seat(0, sample) => Some((sample.sent, sample.unsent)),
        _ => None,
    });
    assert_eq!(counts, Some((2, 1)));
}

/// A disk that takes so many octets and no more.
struct Full(Cursor<Vec<u8>>, usize);

impl Write for Full {
    fn write(&mut self, octets: &[u8]) -> io::Result<usize> {
        self.1 = self.1.checked_sub(octets.len()).ok_or(io::ErrorKind::StorageFull)?;
        self.0.write(octets)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Full {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn a_disk_that_is_full_ends_the_recording_and_not_the_ticks() {
    let seats = [seat()];
    let (Taps { ticks: mut tap, .. }, intake) = Intake::new(seats.to_vec(), Rate::from_hz(100.0), SAMPLE_HZ);
    let file = Recording::begin(Full(Cursor::default(), 4_000), &about(), &seats).unwrap();
    let mut recorder = Recorder::new(intake, file);
    let ended = (0..1_000).find_map(|tick| {
        let mut buf = [0; MAX_LEN];
        tap.asked(asked(0.5));
        tap.frame(0, frame(0.5, &mut buf), MonoTime::from_nanos(tick), Delivery::Sent);
        tap.tick(&head(10 * tick));
        recorder.take().and_then(|()| recorder.flush()).err()
    });
    assert!(ended.is_some());
    drop(recorder);
    // Nobody reads any more: ticks go on to be dropped.
    (0..1_000).for_each(|tick| tap.tick(&head(tick)));
}

#[test]
fn what_was_flushed_is_read_of_a_file_whose_writer_was_killed() {
    let on_disk = tempfile::NamedTempFile::new().unwrap();
    let seats = [seat()];
    let (Taps { ticks: mut tap, .. }, intake) = Intake::new(seats.to_vec(), Rate::from_hz(100.0), SAMPLE_HZ);
    let out = io::BufWriter::new(on_disk.reopen().unwrap());
    let file = Recording::begin(out, &about(), &seats).unwrap();
    let mut recorder = Recorder::new(intake, file);
    for tick in 0..100 {
        tap.tick(&head(10 * tick));
    }
    recorder.take().unwrap();
    recorder.flush().unwrap();
    let file = std::fs::read(on_disk.path()).unwrap();
    let stream = MessageStream::new_with_options(&file, mcap::read::Options::IgnoreEndMagic.into()).unwrap();
    // Twenty windows of 50 ms, of which the last is not over, and the one before waits for what is told late; and one state.
    assert_eq!(stream.map_while(Result::ok).count(), 18 + 1);
}

#[test]
fn schemas_keep_to_what_viewers_draw() {
    let file = recorded((0..10).map(|_| (0.5, 0.5)));
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.schemas.len(), 2 + 6, "seats, ticks and what the service tells");
    let all = messages(&file);
    for channel in summary.channels.values() {
        let Some(schema) = &channel.schema else { continue };
        let schema: Value = serde_json::from_slice(&schema.data).unwrap();
        assert_eq!(schema["type"], "object");
        let properties = schema["properties"].as_object().unwrap();
        for kind in properties.values() {
            assert!(kind["type"].is_string(), "{kind}");
            let item = &kind["items"]["type"];
            assert!(kind["type"] != "array" || item == "number" || item == "string", "{kind}");
        }
        let named: Vec<&String> = properties.keys().collect();
        for (_, _, value) in all.iter().filter(|(topic, ..)| *topic == channel.topic) {
            let fields: Vec<&String> = value.as_object().unwrap().keys().collect();
            assert!(fields.iter().all(|field| named.contains(field)), "{fields:?} of {named:?}");
            let required = schema["required"].as_array().unwrap();
            assert!(required.iter().all(|key| value.get(key.as_str().unwrap()).is_some()), "{value}");
            assert!(value.as_object().unwrap().values().all(|field| !field.is_null()));
        }
    }
}

proptest! {
    #[test]
    fn a_frame_reads_as_it_was_written(
        lane in 0_usize..64,
        at in any::<u64>(),
        slots in 0_usize..=MAX_AXES,
        place in -2.0_f64..2.0,
        clamps in any::<u32>(),
        datagram in prop::collection::vec(any::<u8>(), 0..300),
    ) {
        let mut pose = [0.0; MAX_AXES];
        pose[..slots].fill(place);
        let asked = Asked { pose, slots, level: 0.5, clamps: clamps.into() };
        let at = MonoTime::from_nanos(at);
        let written = SentFrame { lane, at, handed: Handed::Refused, asked, datagram: &datagram };
        let mut chunk = ChunkWriter::with_room(1_000);
        chunk.frame(&written);
        let octets = chunk.close(&head(7), 3).expect("there is room");
        let (read, rest) = Chunk::parse(octets).expect("it is whole");
        prop_assert_eq!((read.head, read.dropped, rest.len()), (head(7), 3, 0));
        prop_assert_eq!(read.frames().collect::<Vec<_>>(), [written]);
    }

    #[test]
    fn no_octets_panic(octets in prop::collection::vec(any::<u8>(), 0..300)) {
        if let Some((chunk, _)) = Chunk::parse(&octets) {
            chunk.frames().count();
        }
    }
}
