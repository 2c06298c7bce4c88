//! From the file back to what was played.

use std::io::Cursor;

use proptest::prelude::*;

use super::block::Block;
use super::chunk::{ChunkWriter, Handed, SentFrame};
use super::full::{motions, unpack};
use super::tests::{MS, about, asked, frame, head, recorded_as, seat, window};
use super::*;
use crate::motion::Pulses;
use crate::time::{MonoTime, ShowTime};
use crate::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, Timing, Vibration, VibrationPort};

/// A way up and down again: ticks 10 ms apart.
fn swing(ticks: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..ticks).map(|tick| {
        let place = 0.5 + 0.2 * (f64::from(tick) * 0.04).sin();
        (place, place)
    })
}

/// Lane, instant, fate and octets of a frame.
type Frame = (usize, MonoTime, Handed, Vec<u8>);

/// The heads and the frames of some chunks.
fn told(octets: &[u8]) -> Vec<(TickHead, u32, Vec<Frame>)> {
    let mut all = Vec::new();
    each_chunk(octets, |chunk| {
        let frames = chunk.frames().map(|one| (one.lane, one.at, one.handed, one.datagram.to_vec()));
        all.push((chunk.head, chunk.dropped, frames.collect()));
    });
    all
}

#[test]
fn a_whole_recording_gives_back_every_datagram() {
    let file = recorded_as(Mode::Full, swing(333));
    let mut datagrams = Vec::new();
    let contents = read(file.as_slice(), Wanted::ALL, &mut |_, _, one| {
        if let Told::Chunks(chunks) = one {
            told(&chunks)
                .into_iter()
                .for_each(|(.., frames)| datagrams.extend(frames.into_iter().map(|one| one.3)));
        }
    });
    let contents = contents.unwrap();
    let sent: Vec<Vec<u8>> = swing(333).map(|(_, sent)| frame(sent, &mut [0; MAX_LEN]).to_vec()).collect();
    assert_eq!(datagrams, sent);
    assert_eq!((contents.trouble, contents.faults), (None, vec![]));
    assert_eq!(contents.messages["/full/sent"], 7, "blocks of half a second");
}

#[test]
fn what_came_nearest_to_its_limit_is_the_same_measured_again() {
    let (contents, summary) = summarize(recorded_as(Mode::Full, swing(400)).as_slice()).unwrap();
    assert_eq!(contents.most(), summary.most);
    let speed = summary.most.iter().find(|one| one.quantity == Quantity::Speed).unwrap();
    // 0.2 of 150 mm at 4 rad/s, between two ticks a little less.
    assert!((119.0..=120.1).contains(&speed.value), "{speed:?}");
    let (contents, sampled) = summarize(recorded_as(Mode::Sampled, swing(400)).as_slice()).unwrap();
    assert_eq!(sampled.most, summary.most, "{:?}", contents.end);
    assert_eq!((summary.ticks, summary.seats[0].sent, summary.seats[0].name.as_str()), (400, 400, "A1"));
}

/// What a file tells, and what came of reading it.
fn told_of(file: &[u8], is_ahead: bool) -> (Vec<(MonoTime, String)>, Result<Contents, String>) {
    let mut all = Vec::new();
    let mut take = |_: &Contents, at, told: Told<'_>| all.push((at, format!("{told:?}")));
    let wanted = Wanted::ALL;
    let read = if is_ahead { read_ahead(file, wanted, &mut take) } else { read(file, wanted, &mut take) };
    (all, read.map_err(|error| error.to_string()))
}

#[test]
fn nothing_is_told_of_a_chunk_that_was_changed_on_the_disk() {
    let file = recorded_as(Mode::Full, swing(333));
    let told = |file: &[u8]| {
        let [one, ahead] = [false, true].map(|is_ahead| told_of(file, is_ahead));
        assert_eq!(one, ahead);
        (one.0, one.1.unwrap().trouble)
    };
    let (whole, _) = told(&file);
    for chunk in mcap::Summary::read(&file).unwrap().unwrap().chunk_indexes {
        let (since, len) = (chunk.compressed_data_offset().unwrap(), chunk.compressed_size);
        for at in (since..since + len).step_by(41) {
            let mut changed = file.clone();
            changed[usize::try_from(at).unwrap()] ^= 4;
            let (some, trouble) = told(&changed);
            assert!(
                trouble.is_some() && whole.starts_with(&some),
                "octet {at}: {} of {}",
                some.len(),
                whole.len()
            );
        }
    }
}

#[test]
fn a_file_that_is_no_recording_is_refused() {
    assert!(matches!(read(&b""[..], Wanted::ALL, &mut |_, _, _| ()), Err(ReadError::File(_))));
    let cue = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/cues/storm.mcap")).unwrap();
    assert!(matches!(read(cue.as_slice(), Wanted::ALL, &mut |_, _, _| ()), Err(ReadError::Foreign)));
    assert!(matches!(beginning(Cursor::new(&cue)), Err(ReadError::Foreign)));
}

#[test]
fn of_a_cut_file_all_that_is_complete_is_written_anew_with_an_index() {
    let seats = [seat()];
    let (Taps { ticks: mut tap, .. }, intake) =
        Intake::new(seats.to_vec(), crate::time::Rate::from_hz(100.0), SAMPLE_HZ);
    let about = About { mode: Mode::Full, ..about() };
    let file = Recording::begin(Cursor::new(Vec::new()), &about, &seats).unwrap();
    let mut recorder = Recorder::new(intake.in_full(), file);
    for (tick, (wanted, sent)) in (0_u64..).zip(swing(300)) {
        tap.asked(asked(wanted));
        tap.frame(
            0,
            frame(sent, &mut [0; MAX_LEN]),
            MonoTime::from_nanos(tick * 10 * MS),
            crate::net::Delivery::Sent,
        );
        tap.tick(&head(tick * 10));
        recorder.take().unwrap();
        if tick % 50 == 0 {
            recorder.flush().unwrap();
        }
    }
    let whole = recorder.finish(Some(b"{}")).unwrap().into_inner();
    let cut = &whole[..whole.len() * 2 / 3];
    let before = read(cut, Wanted::ALL, &mut |_, _, _| ()).unwrap();
    assert!(before.trouble.is_some() && before.messages["/tick"] > 10, "{:?}", before.messages);
    assert_eq!(mcap::Summary::read(cut).ok().flatten().map(|_| ()), None, "viewers have no index of it");
    let (recovered, out) = recover(Cursor::new(cut), Cursor::new(Vec::new())).unwrap();
    let saved = out.into_inner();
    let after = read(saved.as_slice(), Wanted::ALL, &mut |_, _, _| ()).unwrap();
    assert_eq!(
        (&after.messages, &after.messages, after.trouble),
        (&before.messages, &recovered.messages, None)
    );
    let summary = mcap::Summary::read(&saved).unwrap().unwrap();
    let names: Vec<_> = summary.metadata_indexes.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, ["kinocue", "kinocue.recovered"]);
}

#[test]
fn a_cut_with_its_scene_has_a_cube_for_each_seat_once_and_where_it_is_twenty_times_a_second() {
    let whole = recorded_as(Mode::Full, swing(300));
    let stretch = Stretch { from: ShowTime::ZERO, until: ShowTime::from_millis(1_999), seat: None };
    let manner = CutManner { scene: true, ..CutManner::default() };
    let file = cut(whole.as_slice(), &stretch, manner, Cursor::new(Vec::new())).unwrap().0.into_inner();
    let all = |topic: &str| -> Vec<serde_json::Value> {
        let messages = mcap::MessageStream::new(&file).unwrap().map(Result::unwrap);
        let of_topic = messages.filter(|one| one.channel.topic == topic);
        of_topic.map(|one| serde_json::from_slice(&one.data).unwrap()).collect()
    };
    let [scene] = &all("/scene")[..] else { panic!("once") };
    assert_eq!(
        (&scene["entities"][0]["id"], &scene["entities"][0]["frame_locked"]),
        (&"A1".into(), &true.into())
    );
    let transforms = all("/tf");
    assert_eq!(transforms.len(), 40, "two seconds");
    for (tick, (place, _)) in (0..40).zip(swing(200).step_by(5)) {
        let one = &transforms[tick]["transforms"][0];
        assert_eq!(one["child_frame_id"], scene["entities"][0]["frame_id"]);
        // Metres of a stroke of 150 mm, to the pulse.
        assert!((one["translation"]["z"].as_f64().unwrap() - place * 0.150).abs() < 1e-5, "{one}");
    }
    let contents = read(file.as_slice(), Wanted::ALL, &mut |_, _, _| ()).unwrap();
    assert!(contents.faults.is_empty() && contents.trouble.is_none(), "{contents:?}");
}

fn motion(
    window: &crate::motion::Window,
    place: f64,
    number: u32,
    shakes: bool,
    buf: &mut [u8; MAX_LEN],
) -> Vec<u8> {
    let positions: Vec<Pulses> = window.slots().iter().map(|slot| slot.pulses(place)).collect();
    let vibration = [Vibration { period: 80, amplitude: 200 }; 3];
    let motion = Motion {
        timing: Timing::Relative,
        channel: 0,
        accept: Code(0xffff),
        reply: if number.is_multiple_of(4) { Code(1) } else { Code::NONE },
        frame: FrameNo(number),
        time_ms: 10 + number % 3,
        positions: &positions,
        outputs: 5,
        analogue: Analogue::default(),
        vibration: shakes.then_some(&vibration),
    };
    motion.emit_as(VibrationPort::Two, buf).to_vec()
}

proptest! {
    #[test]
    fn a_block_gives_back_its_chunks(
        ticks in prop::collection::vec((0.0_f64..1.0, 0.0_f64..1.0, any::<u32>(), 0_u32..3, prop::collection::vec(any::<u8>(), 0..80), 0_u8..4), 1..60),
    ) {
        let seats = [seat(), seat()];
        let window = window();
        let (mut block, mut octets) = (Block::default(), Vec::new());
        for (at, (wanted, sent, number, dropped, noise, kind)) in (0_u64..).zip(&ticks) {
            let mut writer = ChunkWriter::with_room(2_000);
            for lane in 0..2 {
                let datagram = match kind {
                    0 => noise.clone(),
                    kind => motion(&window, *sent, *number, *kind == 1, &mut [0; MAX_LEN]),
                };
                let handed = Handed::ALL[usize::from(kind % 3)];
                let at = MonoTime::from_nanos(at * 7 * MS + u64::from(number % 900) * 1_000);
                let asked = Asked { clamps: (number % 7).into(), level: 0.5, ..asked(*wanted) };
                writer.frame(&SentFrame { lane, at, handed, asked, datagram: &datagram });
            }
            let head = TickHead { film: ShowTime::from_nanos(i64::from(*number) - 9), missed: u64::from(number % 2), ..head(at * 7) };
            octets.extend_from_slice(writer.close(&head, *dropped).unwrap());
        }
        let mut packed = Vec::new();
        each_chunk(&octets, |chunk| packed.extend(block.add(chunk, &seats)));
        packed.extend(block.close());
        let back: Vec<u8> = packed.iter().flat_map(|(_, block)| unpack(block, &seats, None).expect("it is ours")).collect();
        prop_assert_eq!(told(&back), told(&octets));
        // What is measured of its motions is what is measured of its frames.
        let [mut of_frames, mut of_motions] = [(); 2].map(|()| Margins::new(&seats, crate::time::Rate::from_hz(100.0)));
        each_chunk(&back, |chunk| of_frames.take(chunk, &seats, &mut |_, _, _| ()));
        packed.iter().for_each(|(_, block)| of_motions.take_motions(&motions(block, &seats).expect("it is ours"), &seats));
        prop_assert_eq!(of_frames.most(&seats), of_motions.most(&seats));
        let mut places = (Vec::new(), Vec::new());
        let places_of = |chunk: &Chunk<'_>, to: &mut Vec<f64>| chunk.frames().for_each(|one| to.extend_from_slice(&seats[one.lane].asked(&one.asked)));
        each_chunk(&octets, |chunk| places_of(chunk, &mut places.0));
        each_chunk(&back, |chunk| places_of(chunk, &mut places.1));
        prop_assert!(places.0.iter().zip(&places.1).all(|(one, other)| (one - other).abs() <= 0.5001 * seats[0].axes()[0].pulse));
        prop_assert_eq!(places.0.len(), places.1.len());
    }

    #[test]
    fn no_octets_are_a_block_that_panics(octets in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = unpack(&octets, &[seat()], None);
    }

    #[test]
    fn a_block_with_wrong_octets_is_refused_or_read(at in any::<prop::sample::Index>(), octet in any::<u8>()) {
        let mut block = Block::default();
        let mut writer = ChunkWriter::with_room(500);
        for tick in 0..40 {
            writer.frame(&SentFrame { lane: 0, at: MonoTime::from_nanos(tick), handed: Handed::Taken, asked: asked(0.3), datagram: frame(0.3, &mut [0; MAX_LEN]) });
            let octets = writer.close(&head(tick * 10), 0).unwrap().to_vec();
            block.add(&Chunk::parse(&octets).unwrap().0, &[seat()]);
            writer.clear();
        }
        let (_, mut packed) = block.close().unwrap();
        let at = at.index(packed.len());
        packed[at] = octet;
        let _ = unpack(&packed, &[seat()], None);
    }

    #[test]
    fn no_damage_to_a_file_panics(
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in prop::option::of(any::<prop::sample::Index>()),
    ) {
        thread_local!(static WHOLE: Vec<u8> = recorded_as(Mode::Full, swing(120)));
        let mut file = WHOLE.with(Clone::clone);
        for (at, octet) in damage {
            let at = at.index(file.len());
            file[at] = octet;
        }
        if let Some(cut) = cut {
            file.truncate(cut.index(file.len()));
        }
        let [one, ahead] = [false, true].map(|is_ahead| told_of(&file, is_ahead).0);
        // Of a chunk that goes on behind the end of the file one tells nothing, the other what was there.
        prop_assert!(one.starts_with(&ahead));
        let _ = summarize(file.as_slice());
        let _ = beginning(Cursor::new(&file));
        let _ = recover(Cursor::new(file.as_slice()), Cursor::new(Vec::new()));
    }
}

/// Where the chunks of a file are, and the log times of each.
fn chunks(file: &[u8]) -> Vec<(std::ops::Range<usize>, (u64, u64))> {
    let indexes = mcap::Summary::read(file).unwrap().unwrap().chunk_indexes;
    let place = |octets: u64| usize::try_from(octets).unwrap();
    let chunk = |one: &mcap::records::ChunkIndex| {
        let begin = place(one.compressed_data_offset().unwrap());
        (begin..begin + place(one.compressed_size), (one.message_start_time, one.message_end_time))
    };
    indexes.iter().map(chunk).collect()
}

#[test]
fn of_a_file_with_one_chunk_damaged_all_others_are_saved_and_what_is_lost_is_said() {
    let file = recorded_as(Mode::Full, swing(500));
    let whole = read(file.as_slice(), Wanted::ALL, &mut |_, _, _| ()).unwrap();
    let total: u64 = whole.messages.values().sum();
    assert!(chunks(&file).len() >= 5, "{:?}", chunks(&file));
    for (place, span) in chunks(&file) {
        let mut changed = file.clone();
        changed[place.start + place.len() / 2] ^= 4;
        let (recovered, out) = recover(Cursor::new(&changed), Cursor::new(Vec::new())).unwrap();
        let lost = &recovered.salvaged.lost;
        assert!(recovered.salvaged.trouble.is_none() && lost.len() == 1, "{recovered:?}");
        assert_eq!(lost[0].span, (Some(span.0), Some(span.1)));
        let saved = out.into_inner();
        let after = read(saved.as_slice(), Wanted::ALL, &mut |_, _, _| ()).unwrap();
        let count: u64 = after.messages.values().sum();
        assert!(count < total && count * 4 > total * 3, "{count} of {total}, without {span:?}");
        assert_eq!(recovered.lost_messages(), Some(total - count));
        assert_eq!((&after.messages, &after.end), (&recovered.messages, &whole.end), "and what is behind it");
        let flaws = after.flaws();
        assert!(flaws[0].starts_with("recovered from a file that is damaged; lost "), "{flaws:?}");
    }
}

#[test]
fn no_chunk_is_longer_than_a_second_even_where_all_is_written_at_once() {
    let maker = EntryMaker::new(1, about().clocks);
    let mut file =
        Recording::open(Cursor::new(Vec::new()), &Opening::new(&about(), &[seat()]), maker).unwrap();
    for ms in (0..60_000).step_by(50) {
        let note = EventNote { kind: "standing", seat: "A1".to_owned(), text: ms.to_string() };
        file.write(MonoTime::from_nanos(ms * MS), &Message::Note(Note::Event(note))).unwrap();
    }
    let file = file.finish(&[], None).unwrap().into_inner();
    let chunks = chunks(&file);
    assert!((60..70).contains(&chunks.len()), "{}", chunks.len());
    assert!(chunks.iter().all(|(_, (from, until))| until - from < 1_000 * MS), "{chunks:?}");
}

#[test]
fn a_file_whose_disk_was_full_in_the_middle_of_a_chunk_is_cut_short_and_not_damaged() {
    let file = recorded_as(Mode::Full, swing(300));
    let [.., (last, _)] = &chunks(&file)[..] else { panic!("it has chunks") };
    // Up to its record: opcode and length, and a head of 40 octets and the name lz4.
    let mut cut = file[..last.start - 9 - 40 - 3].to_vec();
    cut.extend([[6, 255, 255, 255, 255, 255, 255, 255, 255].as_slice(), &[0; 16], &[255; 12]].concat());
    cut.extend(
        [[3, 0, 0, 0].as_slice(), b"lz4", &[255; 8], &file[last.start..last.end / 2 + last.start / 2]]
            .concat(),
    );
    let contents = read(cut.as_slice(), Wanted::ALL, &mut |_, _, _| ()).unwrap();
    assert_eq!(contents.trouble.map(|trouble| trouble.to_string()).as_deref(), Some("is cut short"));
    let (recovered, _) = recover(Cursor::new(&cut), Cursor::new(Vec::new())).unwrap();
    let words = recovered.in_words();
    assert!(
        words.starts_with("is cut short; lost are messages, how many is not known; what came after "),
        "{words}"
    );
    assert!(recovered.messages["/tick"] > 10 && !recovered.loses_nothing(), "{recovered:?}");
}

/// Viewers take the least log time of all chunks for that of the file, and a chunk without messages has 0.
#[test]
fn no_chunk_is_of_1970_whenever_the_first_message_comes_and_none_of_a_copy_is() {
    let maker = EntryMaker::new(1, about().clocks);
    let mut file =
        Recording::open(Cursor::new(Vec::new()), &Opening::new(&about(), &[seat()]), maker).unwrap();
    file.flush().unwrap();
    file.attach("configuration.toml", "text/plain", b"[show]").unwrap();
    for ms in (600..3_000).step_by(50) {
        let note = EventNote { kind: "standing", seat: "A1".to_owned(), text: ms.to_string() };
        file.write(MonoTime::from_nanos(ms * MS), &Message::Note(Note::Event(note))).unwrap();
    }
    let file = file.finish(&[], None).unwrap().into_inner();
    let first = |file: &[u8]| chunks(file).into_iter().map(|(_, (from, _))| from).min().unwrap();
    assert_eq!(first(&file), (1_000_000 + 600) * MS);
    let mut changed = file.clone();
    let (second, _) = chunks(&file)[1].clone();
    changed[second.start + second.len() / 2] ^= 4;
    for of in [&file, &changed] {
        let copy = recover(Cursor::new(of), Cursor::new(Vec::new())).unwrap().1.into_inner();
        assert_eq!(first(&copy), (1_000_000 + 600) * MS);
        let attached = mcap::Summary::read(&copy).unwrap().unwrap().attachment_indexes;
        assert_eq!(
            (attached[0].media_type.as_str(), attached[0].name.as_str()),
            ("text/plain", "configuration.toml")
        );
    }
}

/// A recording of three seconds in full, with a mark in its middle.
fn marked() -> Vec<u8> {
    let seats = [seat()];
    let (Taps { ticks: mut tap, mut acks }, intake) =
        Intake::new(seats.to_vec(), crate::time::Rate::from_hz(100.0), SAMPLE_HZ);
    let mut intake = intake.in_full();
    let about = About { mode: Mode::Full, ..about() };
    let mut file = Recording::begin(Cursor::new(Vec::new()), &about, &seats).unwrap();
    acks.take(&AckRecord::Standing(0, crate::health::HealthState::Ok));
    for (tick, (wanted, sent)) in (0_u32..).zip(swing(300)) {
        let at = MonoTime::from_nanos(u64::from(tick) * 10 * MS);
        tap.asked(asked(wanted));
        tap.frame(0, frame(sent, &mut [0; MAX_LEN]), at, crate::net::Delivery::Sent);
        tap.tick(&head(u64::from(tick) * 10));
        let running = crate::tracker::Fate::Answered(crate::wire::ReplyCode::Running);
        match tick % 10 {
            9 => acks.take(&AckRecord::Lost(0, u64::from(tick / 10 + 1))),
            _ => acks.take(&AckRecord::Fate(0, FrameNo(tick), running, 2_000_000)),
        }
        acks.drained(at + std::time::Duration::from_millis(5));
        intake.take(&mut |at, message| file.write(at, &message).unwrap());
        if tick == 150 {
            let mark = MarkNote { film_s: 1.5, text: "it jerked".to_owned(), who: "operator".to_owned() };
            file.write(at, &Message::Note(Note::Mark(mark))).unwrap();
        }
    }
    intake.close(&mut |at, message| file.write(at, &message).unwrap());
    file.finish(&[], None).unwrap().into_inner()
}

/// The cut of a stretch of it, and its messages: topic, log time, and what it says as JSON.
fn cut_of(from_ms: i64, manner: CutManner) -> (Vec<u8>, Vec<(String, u64, serde_json::Value)>) {
    let until = ShowTime::from_millis(2_995);
    let stretch = Stretch { from: ShowTime::from_millis(from_ms), until, seat: None };
    let file = cut(marked().as_slice(), &stretch, manner, Cursor::new(Vec::new())).unwrap().0.into_inner();
    let messages = mcap::MessageStream::new(&file).unwrap().map(Result::unwrap);
    let all = messages.map(|one| {
        let said = serde_json::from_slice(&one.data).unwrap_or_default();
        (one.channel.topic.clone(), one.log_time, said)
    });
    let all = all.collect();
    (file, all)
}

#[test]
fn a_cut_has_what_became_of_its_frames_and_what_people_said_meanwhile() {
    for anonymous in [false, true] {
        let (_, all) = cut_of(0, CutManner { anonymous, ..CutManner::default() });
        let seat: Vec<_> = all.iter().filter(|(topic, ..)| topic.starts_with("/seat/")).collect();
        let sum = |key: &str| seat.iter().map(|(.., sample)| sample[key].as_u64().unwrap()).sum::<u64>();
        assert_eq!([sum("sent"), sum("acked"), sum("lost")], [300, 270, 30], "anonymous: {anonymous}");
        assert!(seat.iter().any(|(.., sample)| sample["standing"] == 0 && sample["ack_us"] == 2_000.0));
        let marks = all.iter().filter(|(topic, _, mark)| topic == "/mark" && mark["text"] == "it jerked");
        assert_eq!(marks.count(), usize::from(!anonymous));
    }
}

#[test]
fn a_cut_by_the_film_begins_where_its_stretch_does() {
    let (_, all) = cut_of(1_000, CutManner { film_time: true, ..CutManner::default() });
    let times: Vec<u64> = all.iter().map(|(_, at, _)| *at).collect();
    assert_eq!((times.iter().min(), times.iter().max()), (Some(&(1_000 * MS)), Some(&(2_990 * MS))));
}

#[test]
fn all_of_a_cut_stands_in_the_order_of_its_times() {
    for anonymous in [false, true] {
        let (file, all) = cut_of(0, CutManner { whole: true, anonymous, ..CutManner::default() });
        assert!(all.iter().is_sorted_by_key(|(_, at, _)| *at), "anonymous: {anonymous}");
        let contents = read(file.as_slice(), Wanted::ALL, &mut |_, _, _| ()).unwrap();
        assert!(contents.faults.is_empty() && contents.trouble.is_none(), "{contents:?}");
    }
}

#[test]
fn a_line_of_the_log_has_its_time_as_viewers_want_it() {
    let line = LogNote { level: 3, message: "late".to_owned(), name: "supervisor".to_owned() };
    let entry = EntryMaker::new(1, about().clocks)
        .entry(MonoTime::from_nanos(5 * MS), &Message::Note(Note::Log(line)))
        .unwrap();
    let told: serde_json::Value = serde_json::from_slice(&entry.data).unwrap();
    assert_eq!(told["timestamp"], serde_json::json!({"sec": 1_000, "nsec": 5 * MS}));
    assert_eq!((&told["level"], &told["message"]), (&3.into(), &"late".into()));
}
