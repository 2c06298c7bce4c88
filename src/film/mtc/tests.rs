use super::*;
use crate::film::point::FilmState;
use crate::film::tracker::{SourceKind, SourceTracker};
use crate::harness::shown::{Luck, TrueFilm, mono};
use crate::time::ShowTime;

fn start() -> Label {
    "01:00:00:00".parse().expect("it is a label")
}

fn frame(text: &str, rate: FrameRate) -> Timecode {
    Timecode::parse(text, rate).expect("there is such a frame")
}

/// The bytes of so many sets from a frame on, each with the time at which it is sent.
fn sent(from: Timecode, sets: i64, backwards: bool) -> Vec<(f64, [u8; 2])> {
    let quarter = 0.25 / from.rate().frames_per_second();
    let step = if backwards { -2 } else { 2 };
    let mut all = Vec::new();
    for set in 0..sets {
        let mut pieces = quarter_frames(from.plus(set * step));
        if backwards {
            pieces.reverse();
        }
        all.extend(pieces.into_iter().map(|bytes| (all.len() as f64, bytes)).collect::<Vec<_>>());
        let begun = all.len() - 8;
        for (nth, piece) in all[begun..].iter_mut().enumerate() {
            piece.0 = quarter * (begun + nth) as f64;
        }
    }
    all
}

fn heard(reader: &mut MtcReader, bytes: &[(f64, [u8; 2])]) -> Vec<Observation> {
    let mut told = Vec::new();
    for (t, pair) in bytes {
        pair.iter().for_each(|byte| reader.hear(&[*byte], mono(*t), &mut |heard| told.push(heard)));
    }
    told.retain(|told| told.word != FilmWord::Unplaced);
    told
}

/// How far a position is from what it has to be at its time, seconds.
fn off(told: &Observation, film: &TrueFilm) -> f64 {
    let FilmWord::Position(media) = told.word else { panic!("{told:?}") };
    media.as_secs_f64() - film.media_s(told.at.since(mono(0.0)).as_secs_f64())
}

#[test]
fn every_quarter_says_where_the_film_is_at_every_rate_both_ways_once_two_sets_agree() {
    for rate in FrameRate::ALL {
        for backwards in [false, true] {
            let from = frame("01:00:59:22", rate);
            let bytes = sent(from, 40, backwards);
            let told = heard(&mut MtcReader::new(Some(rate), start()), &bytes);
            assert_eq!(told.len(), 38 * 8, "{rate}, {backwards}");
            let begins = from.media_since(frame("01:00:00:00", rate)).as_secs_f64();
            // Of a set that runs backwards the eighth quarter comes first.
            let first = if backwards { 1.75 / rate.frames_per_second() } else { 0.0 };
            let film = TrueFilm::new(begins + first, if backwards { -1.0 } else { 1.0 });
            let worst = told.iter().map(|told| off(told, &film).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-6, "{rate}, {backwards}: {worst} s");
        }
    }
}

#[test]
fn a_set_that_was_put_together_across_a_second_places_nobody_elsewhere() {
    let from = frame("01:00:00:00", FrameRate::F25);
    let mut bytes = sent(from, 100, false);
    // Senders fill pieces from a counter that runs: seconds of the next second with the frames of the last.
    for set in [20, 45, 70] {
        for piece in 2..4 {
            bytes[8 * set + piece].1[1] ^= 0x5;
        }
    }
    let told = heard(&mut MtcReader::new(Some(FrameRate::F25), start()), &bytes);
    let film = TrueFilm::new(0.0, 1.0);
    assert!(told.iter().all(|told| off(told, &film).abs() < 1e-6));
    assert!(told.len() >= 60 * 8, "{}", told.len());
}

#[test]
fn a_jump_is_believed_when_two_sets_agree() {
    let mut bytes = sent(frame("01:00:00:00", FrameRate::F25), 20, false);
    let begun = bytes[bytes.len() - 1].0 + 0.01;
    bytes.extend(sent(frame("01:10:00:00", FrameRate::F25), 20, false).iter().map(|(t, b)| (t + begun, *b)));
    let told = heard(&mut MtcReader::new(Some(FrameRate::F25), start()), &bytes);
    let (before, after) = (TrueFilm::new(0.0, 1.0), TrueFilm::new(600.0 - begun, 1.0));
    assert!(told.iter().all(|told| off(told, &before).abs() < 1e-6 || off(told, &after).abs() < 1e-6));
    assert_eq!(told.iter().filter(|told| off(told, &after).abs() < 1e-6).count(), 18 * 8);
}

#[test]
fn realtime_bytes_and_other_messages_between_are_no_trouble() {
    let bytes = sent(frame("01:00:00:00", FrameRate::F30), 10, false);
    let (mut reader, mut told) = (MtcReader::new(Some(FrameRate::F30), start()), Vec::new());
    for (t, pair) in &bytes {
        let between =
            [0xf8, pair[0], 0xfe, pair[1], 0x33, 0x90, 0x3c, 0x40, 0x3c, 0x00, 0xf0, 0x7e, 0x01, 0xf7];
        between.iter().for_each(|byte| reader.hear(&[*byte], mono(*t), &mut |heard| told.push(heard)));
    }
    told.retain(|told| told.word != FilmWord::Unplaced);
    assert_eq!(told.len(), 8 * 8);
}

#[test]
fn a_full_message_and_machine_control_say_stop_and_play() {
    let said = |bytes: &[u8]| {
        let (mut reader, mut told) = (MtcReader::new(Some(FrameRate::F25), start()), Vec::new());
        bytes.iter().for_each(|byte| reader.hear(&[*byte], mono(1.0), &mut |heard| told.push(heard.word)));
        told
    };
    let there = FilmWord::Position(ShowTime::from_millis(62_120));
    assert_eq!(said(&[0xf0, 0x7f, 0x7f, 1, 1, 0x21, 1, 2, 3, 0xf7]), [FilmWord::Stop, there]);
    assert_eq!(said(&[0xf0, 0x7f, 0x7f, 6, 1, 0xf7]), [FilmWord::Stop]);
    assert_eq!(said(&[0xf0, 0x7f, 0x00, 6, 2, 0xf7]), [FilmWord::Play]);
    assert_eq!(
        said(&[0xf0, 0x7f, 0x7f, 6, 9, 0xf7, 0xf0, 0x7f, 0x7f, 6, 3, 0xf7]),
        [FilmWord::Stop, FilmWord::Play]
    );
    assert_eq!(said(&[0xf0, 0x7f, 0x7f, 6, 1, 0, 0xf7]), [], "longer than it may be");
    assert_eq!(said(&[0xf0, 0x7f, 0x7f, 6, 1, 0x90, 0xf7]), [], "broken off");
}

#[test]
fn a_rate_that_the_bits_do_not_name_is_found_and_the_film_locked() {
    let bytes = sent(frame("01:00:00:00", FrameRate::F23_976), 120, false);
    let mut reader = MtcReader::new(None, start());
    let told = heard(&mut reader, &bytes);
    assert_eq!(reader.labels.rate(), Some(FrameRate::F23_976));
    let mut tracker = SourceTracker::new(SourceKind::Mtc, 0.0015, mono(0.0));
    told.iter().for_each(|told| tracker.hear(told));
    assert!(tracker.state().may_lead());
    let error = off(told.last().expect("there are some"), &TrueFilm::new(0.0, 1.0));
    assert!(error.abs() < 1e-6, "{error}");
}

#[test]
fn no_bytes_make_the_reader_panic_and_chance_is_no_timecode() {
    let mut luck = Luck::new(4);
    let (mut reader, mut told) = (MtcReader::new(Some(FrameRate::F25), start()), 0);
    for n in 0..200_000 {
        let byte = if luck.is(0.4) { QUARTER } else { luck.bits() as u8 };
        reader.hear(&[byte], mono(f64::from(n) * 0.001), &mut |heard| {
            told += u32::from(matches!(heard.word, FilmWord::Position(_)));
        });
    }
    assert_eq!(told, 0);
}

/// The bytes of a player that sends what is due in each block of sound at its end, in one piece, with a full message each second if that is
/// wanted; and when they come.
fn by_block(from: Timecode, seconds: f64, block_s: f64, full: bool) -> Vec<(f64, Vec<u8>)> {
    let sets = (seconds * from.rate().frames_per_second() / 2.0) as i64;
    let mut blocks: Vec<(f64, Vec<u8>)> = Vec::new();
    for (n, (t, pair)) in sent(from, sets, false).into_iter().enumerate() {
        let at = ((t / block_s).floor() + 1.0) * block_s;
        if blocks.last().is_none_or(|last| last.0 < at - 1e-9) {
            blocks.push((at, Vec::new()));
        }
        let bytes = &mut blocks.last_mut().expect("one was begun").1;
        bytes.extend(pair);
        let quarters_of_a_second = 4 * from.rate().labels() as usize;
        if full && n % quarters_of_a_second == quarters_of_a_second - 1 {
            let label = from.plus((n / 4) as i64).label();
            let hours = label.hours | bits_of(from.rate()) << 5;
            bytes.extend([0xf0, 0x7f, 0x7f, 1, 1, hours, label.minutes, label.seconds, label.frames, 0xf7]);
        }
    }
    blocks
}

/// How long after the first byte a film leads that comes so, for how long of 30 s from then on, how far off it is at the most, seconds, and
/// what it was taken for before.
fn followed(rate: FrameRate, blocks: &[(f64, Vec<u8>)]) -> (f64, f64, f64, Vec<FilmState>) {
    let mut reader = MtcReader::new(None, start());
    let mut tracker = SourceTracker::new(SourceKind::Mtc, 0.0015, mono(0.0));
    let film = TrueFilm::new(0.0, 1.0);
    let (mut lead, mut led, mut worst, mut states, mut blocks) =
        (f64::MAX, 0.0_f64, 0.0_f64, Vec::new(), blocks.iter().peekable());
    let first = blocks.peek().expect("there are some").0;
    for tick in 0..3_500 {
        let t = f64::from(tick) / 100.0;
        while let Some((at, bytes)) = blocks.next_if(|block| block.0 <= t) {
            reader.hear(bytes, mono(*at), &mut |told| tracker.hear(&told));
        }
        if tick % 5 == 0 {
            tracker.poll(mono(t));
        }
        if states.last() != Some(&tracker.state()) {
            states.push(tracker.state());
        }
        if tracker.state().may_lead() {
            lead = lead.min(t - first);
            led += 0.01;
            worst = worst.max((tracker.point(mono(t)).media.as_secs_f64() - film.media_s(t)).abs());
        }
    }
    println!("{rate}: leads after {lead:.2} s, for {led:.1} s, off by {worst:.4} s, {states:?}");
    (lead, led, worst, states)
}

#[test]
fn timecode_by_the_block_of_sound_is_followed_within_seconds_with_a_full_message_each_second_too() {
    for rate in [FrameRate::F24, FrameRate::F25, FrameRate::F29_97Drop, FrameRate::F30] {
        for block_s in [0.010_7, 0.021_3, 0.046_4, 0.092_9] {
            for full in [false, true] {
                let blocks = by_block(frame("01:00:00:00", rate), 40.0, block_s, full);
                let (lead, led, worst, states) = followed(rate, &blocks);
                assert!(
                    lead < 6.0 && led > 28.0,
                    "{rate}, {block_s} s, {full}: {lead} s, {led} s, {states:?}"
                );
                assert!(worst < 0.045, "{rate}, {block_s} s, {full}: {worst} s");
                assert!(
                    !states.contains(&FilmState::Stopped) && states[0] == FilmState::Absent,
                    "{states:?}"
                );
                assert!(!states[1..].contains(&FilmState::Absent), "{states:?}");
            }
        }
    }
}

#[test]
fn a_machine_that_stops_where_it_says_that_it_is_stands_within_a_third_of_a_second() {
    let from = frame("01:00:00:00", FrameRate::F25);
    let mut blocks = by_block(from, 10.0, 0.021_3, false);
    let label = from.plus(250).label();
    let end = blocks.last().expect("there are some").0;
    let full =
        [0xf0, 0x7f, 0x7f, 1, 1, label.hours | 1 << 5, label.minutes, label.seconds, label.frames, 0xf7];
    blocks.push((end + 0.005, full.to_vec()));
    let (mut reader, mut tracker) =
        (MtcReader::new(None, start()), SourceTracker::new(SourceKind::Mtc, 0.0015, mono(0.0)));
    for (at, bytes) in &blocks {
        reader.hear(bytes, mono(*at), &mut |told| tracker.hear(&told));
        tracker.poll(mono(*at));
    }
    assert!(tracker.state().may_lead(), "{:?}", tracker.state());
    let stands = (0..100).map(|n| end + f64::from(n) * 0.05).find(|t| {
        tracker.poll(mono(*t));
        tracker.state() == FilmState::Stopped
    });
    assert!(stands.is_some_and(|t| t - end <= 0.35), "{stands:?}");
    // Wound elsewhere it stands at once.
    let mut reader = MtcReader::new(None, start());
    let mut told = Vec::new();
    blocks.pop();
    blocks.iter().for_each(|(at, bytes)| reader.hear(bytes, mono(*at), &mut drop));
    reader.hear(&[0xf0, 0x7f, 0x7f, 1, 1, 0x21, 30, 0, 0, 0xf7], mono(end + 0.01), &mut |heard| {
        told.push(heard.word)
    });
    assert_eq!(told[0], FilmWord::Stop);
}

#[test]
fn timecode_without_a_rate_is_another_thing_than_silence() {
    // Labels that come three times as fast as at any rate.
    let bytes = sent(frame("01:00:00:00", FrameRate::F30), 600, false);
    let (mut reader, mut tracker) =
        (MtcReader::new(None, start()), SourceTracker::new(SourceKind::Mtc, 0.0015, mono(0.0)));
    let mut states = Vec::new();
    for (t, pair) in &bytes {
        reader.hear(pair, mono(t / 3.0), &mut |told| tracker.hear(&told));
        tracker.poll(mono(t / 3.0));
        if states.last() != Some(&tracker.state()) {
            states.push(tracker.state());
        }
    }
    assert_eq!(states, [FilmState::Acquiring, FilmState::Unusable], "it is never absent, nor lost");
    let why = reader.labels().refused().expect("it says what to do").to_string();
    assert!(why.contains("--film-fps"), "{why}");
    let end = bytes.last().expect("there are some").0 / 3.0;
    tracker.poll(mono(end + 2.1));
    assert_eq!(tracker.state(), FilmState::Lost);
}
