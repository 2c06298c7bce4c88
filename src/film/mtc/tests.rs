use super::*;
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
        pair.iter().for_each(|byte| reader.hear(*byte, mono(*t), &mut |heard| told.push(heard)));
    }
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
        between.iter().for_each(|byte| reader.hear(*byte, mono(*t), &mut |heard| told.push(heard)));
    }
    assert_eq!(told.len(), 8 * 8);
}

#[test]
fn a_full_message_and_machine_control_say_stop_and_play() {
    let said = |bytes: &[u8]| {
        let (mut reader, mut told) = (MtcReader::new(Some(FrameRate::F25), start()), Vec::new());
        bytes.iter().for_each(|byte| reader.hear(*byte, mono(1.0), &mut |heard| told.push(heard.word)));
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
        reader.hear(byte, mono(f64::from(n) * 0.001), &mut |heard| {
            told += u32::from(matches!(heard.word, FilmWord::Position(_)));
        });
    }
    assert_eq!(told, 0);
}
