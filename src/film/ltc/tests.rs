//! Each kind of damage that a line can do to LTC: every frame that is read was sent, and ended when it is said to have.

use std::time::Duration;

use super::*;
use crate::film::follower::tests::tries;
use crate::film::observation::{FilmWord, Observation};
use crate::film::timecode::FrameRate;
use crate::film::tracker::{SourceKind, SourceTracker};
use crate::harness::shown::{Luck, TrueFilm, mono};
use crate::time::MonoTime;

const SAMPLES: u32 = 48_000;
/// `KINOCUE_FILM_TRIES` makes it that many times as long.
fn seconds() -> f64 {
    2.5 * f64::from(tries(1))
}

/// What was read of what was sent.
#[derive(Debug)]
struct Found {
    sent: usize,
    read: usize,
    wrong: usize,
    /// Mean of how much later than sent frames were said to end, and the greatest difference from it, samples.
    bias: f64,
    off: f64,
}

fn frame(text: &str, rate: FrameRate) -> Timecode {
    Timecode::parse(text, rate).expect("there is such a frame")
}

/// Sends from a frame on, at a speed that may change, through a line, and reads.
fn through(
    from: Timecode,
    level: f64,
    mut speed: impl FnMut(f64) -> f64,
    line: impl FnOnce(&mut Vec<f64>, &mut Luck),
) -> Found {
    let mut luck = Luck::new(0x17c);
    let mut generator = LtcGenerator::new(from, SAMPLES, level);
    let (mut sound, mut sent) = (Vec::new(), Vec::new());
    for n in 0..(seconds() * f64::from(SAMPLES)) as u32 {
        generator.set_speed(speed(f64::from(n) / f64::from(SAMPLES)));
        sound.push(f64::from(generator.sample()) / 32_768.0);
        sent.extend(generator.take_ended());
    }
    line(&mut sound, &mut luck);
    let mut decoder = LtcDecoder::new(SAMPLES);
    decoder.set_rate(from.rate());
    let sample = |value: f64| (value * 32_768.0).round() as i16;
    let read: Vec<LtcFrame> = sound.into_iter().filter_map(|value| decoder.push(sample(value))).collect();
    judge(&sent, &read, decoder.bit_samples())
}

/// Holds each frame that was read against the one that was sent with its label nearest in time.
fn judge(sent: &[(Timecode, f64)], read: &[LtcFrame], cell: f64) -> Found {
    let is_it = |frame: &LtcFrame, sent: &(Timecode, f64)| {
        sent.0.label() == frame.label && (sent.1 - frame.end).abs() < 40.0 * cell.max(24.0)
    };
    let late: Vec<f64> = read
        .iter()
        .filter_map(|frame| sent.iter().find(|sent| is_it(frame, sent)).map(|sent| frame.end - sent.1))
        .collect();
    let bias = late.iter().sum::<f64>() / late.len().max(1) as f64;
    let off = late.iter().map(|late| (late - bias).abs()).fold(0.0, f64::max);
    Found { sent: sent.len(), read: read.len(), wrong: read.len() - late.len(), bias, off }
}

/// Reads what a damage leaves, prints it, and holds it to: nothing wrong, so many of a hundred found, ends within so many samples.
fn holds(what: &str, found: &Found, least_percent: usize, off: f64) {
    let Found { sent, read, wrong, bias, off: worst } = found;
    println!("{what:<28} {read:>4} of {sent:>4}, wrong {wrong}, end {bias:+.2} ±{worst:.2} samples");
    assert_eq!(*wrong, 0, "{what}");
    assert!(100 * (read + 4) >= least_percent * sent, "{what}: {read} of {sent}");
    assert!(*worst <= off, "{what}: {worst} samples");
}

const START: &str = "00:59:57:00";

fn at_25() -> Timecode {
    frame(START, FrameRate::F25)
}

fn plain(_: &mut Vec<f64>, _: &mut Luck) {}

#[test]
fn every_rate_is_read_both_ways_but_for_the_first_two_frames() {
    for rate in FrameRate::ALL {
        holds(&format!("{rate}"), &through(frame(START, rate), 0.5, |_| 1.0, plain), 100, 0.7);
        let back = through(frame("01:00:03:00", rate), 0.5, |_| -1.0, plain);
        holds(&format!("{rate} backwards"), &back, 100, 0.7);
    }
}

#[test]
fn every_speed_from_a_tenth_to_the_quadruple_is_read_and_a_tape_that_wows() {
    for speed in [0.1, 0.5, 0.9, 1.1, 2.0, 4.0, -0.5, -4.0] {
        holds(&format!("speed {speed}"), &through(at_25(), 0.5, |_| speed, plain), 98, 1.5);
    }
    let wow = |t: f64| 1.0 + 0.05 * (std::f64::consts::TAU * 4.0 * t).sin();
    holds("wow of 5 %", &through(at_25(), 0.5, wow, plain), 100, 1.0);
    let jog = |t: f64| 0.3 + 1.2 * (t / seconds());
    holds("jog 0.3 to 1.5", &through(at_25(), 0.5, jog, plain), 97, 1.5);
}

#[test]
fn levels_down_to_50_db_below_full_scale_are_read() {
    for db in [0, -20, -30, -40, -50] {
        let level = 10_f64.powf(f64::from(db) / 20.0);
        holds(&format!("{db} dBFS"), &through(at_25(), level, |_| 1.0, plain), 98, 1.2);
    }
}

#[test]
fn noise_and_filters_cost_frames_and_make_none_wrong() {
    for (db, least) in [(26, 100), (20, 100), (14, 97), (10, 60), (6, 0), (0, 0)] {
        let sigma = 0.3 * 10_f64.powf(-f64::from(db) / 20.0);
        let noise = |sound: &mut Vec<f64>, luck: &mut Luck| {
            sound.iter_mut().for_each(|v| *v += sigma * luck.normal())
        };
        holds(&format!("noise, SNR {db} dB"), &through(at_25(), 0.3, |_| 1.0, noise), least, 6.0);
    }
    for hz in [12_000.0, 6_000.0, 4_000.0] {
        let keeps = (-std::f64::consts::TAU * hz / f64::from(SAMPLES)).exp();
        let dull = |sound: &mut Vec<f64>, _: &mut Luck| {
            let mut last = 0.0;
            sound.iter_mut().for_each(|value| {
                last = keeps * last + (1.0 - keeps) * *value;
                *value = last;
            });
        };
        holds(&format!("low-pass {hz} Hz"), &through(at_25(), 0.5, |_| 1.0, dull), 98, 1.2);
    }
}

/// Adds a tone.
fn tone(hz: f64, height: f64) -> impl FnOnce(&mut Vec<f64>, &mut Luck) {
    move |sound, _| {
        for (n, value) in sound.iter_mut().enumerate() {
            *value += height * (std::f64::consts::TAU * hz * n as f64 / f64::from(SAMPLES)).sin();
        }
    }
}

#[test]
fn hum_as_loud_as_the_signal_and_tones_beside_it_are_no_trouble() {
    holds("50 Hz at 0 dB", &through(at_25(), 0.4, |_| 1.0, tone(50.0, 0.4)), 98, 3.0);
    holds("60 Hz at -6 dB", &through(at_25(), 0.4, |_| 1.0, tone(60.0, 0.2)), 98, 3.0);
    holds("440 Hz at -20 dB", &through(at_25(), 0.4, |_| 1.0, tone(440.0, 0.04)), 98, 3.0);
    holds("440 Hz at 0 dB", &through(at_25(), 0.4, |_| 1.0, tone(440.0, 0.4)), 0, 40.0);
    holds("15.6 kHz at -12 dB", &through(at_25(), 0.4, |_| 1.0, tone(15_625.0, 0.1)), 98, 3.0);
}

#[test]
fn holes_clicks_and_bent_samples_cost_frames_and_make_none_wrong() {
    let holes = |sound: &mut Vec<f64>, luck: &mut Luck| {
        for _ in 0..sound.len() / 9_600 {
            let (at, length) = (luck.below(sound.len() - 500), 24 + luck.below(456));
            sound[at..at + length].fill(0.0);
        }
    };
    holds("holes of 0.5 to 10 ms", &through(at_25(), 0.5, |_| 1.0, holes), 75, 4.0);
    let clicks = |sound: &mut Vec<f64>, luck: &mut Luck| {
        for _ in 0..sound.len() / 4_800 {
            let (at, length) = (luck.below(sound.len() - 10), 1 + luck.below(5));
            let height = luck.between(-1.0, 1.0);
            sound[at..at + length].fill(height);
        }
    };
    holds("10 clicks a second", &through(at_25(), 0.5, |_| 1.0, clicks), 70, 4.0);
    let silence = |sound: &mut Vec<f64>, _: &mut Luck| sound[48_000..96_000].fill(0.0);
    holds("silence of 1 s", &through(at_25(), 0.5, |_| 1.0, silence), 45, 1.0);
    let upside_down =
        |sound: &mut Vec<f64>, _: &mut Luck| sound.iter_mut().for_each(|value| *value = -*value);
    holds("polarity", &through(at_25(), 0.5, |_| 1.0, upside_down), 100, 1.0);
    let offset = |sound: &mut Vec<f64>, _: &mut Luck| sound.iter_mut().for_each(|value| *value += 0.4);
    holds("offset of 40 %", &through(at_25(), 0.5, |_| 1.0, offset), 98, 1.0);
    let clipped =
        |sound: &mut Vec<f64>, _: &mut Luck| sound.iter_mut().for_each(|v| *v = (*v * 9.0).clamp(-1.0, 0.99));
    holds("clipped", &through(at_25(), 0.5, |_| 1.0, clipped), 100, 1.0);
    let coarse =
        |sound: &mut Vec<f64>, _: &mut Luck| sound.iter_mut().for_each(|v| *v = (*v * 8.0).round() / 8.0);
    holds("3 bits", &through(at_25(), 0.5, |_| 1.0, coarse), 98, 1.5);
    let fades = |sound: &mut Vec<f64>, _: &mut Luck| {
        for (n, value) in sound.iter_mut().enumerate() {
            *value *= 0.5 + 0.45 * (n as f64 / 3_000.0).sin();
        }
    };
    holds("fades of 26 dB", &through(at_25(), 0.5, |_| 1.0, fades), 95, 2.0);
}

#[test]
fn what_is_no_timecode_makes_no_frame() {
    let noise =
        |sound: &mut Vec<f64>, luck: &mut Luck| sound.iter_mut().for_each(|v| *v = 0.3 * luck.normal());
    let only = |hz: f64| {
        move |sound: &mut Vec<f64>, luck: &mut Luck| {
            sound.fill(0.0);
            tone(hz, 0.5)(sound, luck);
        }
    };
    for found in [
        through(at_25(), 0.0, |_| 1.0, noise),
        through(at_25(), 0.0, |_| 1.0, plain),
        through(at_25(), 0.0, |_| 1.0, only(1_000.0)),
        through(at_25(), 0.0, |_| 1.0, only(2_000.0)),
    ] {
        assert_eq!(found.read, 0, "{found:?}");
    }
}

#[test]
fn a_cut_to_another_place_is_read_after_three_frames_and_never_between() {
    let mut luck = Luck::new(6);
    let mut decoder = LtcDecoder::new(SAMPLES);
    decoder.set_rate(FrameRate::F24);
    let mut pieces = Vec::new();
    for _ in 0..40 {
        let from = Timecode::at_index(FrameRate::F24, luck.below(2_000_000) as i64);
        let mut generator = LtcGenerator::new(from, SAMPLES, 0.5);
        for _ in 0..luck.below(2_000) {
            generator.sample();
        }
        let length = 8_000 + luck.below(24_000);
        let mut read = Vec::new();
        for _ in 0..length {
            read.extend(decoder.push(generator.sample()));
        }
        let frames = length / 2_000;
        assert!(read.len() + 5 >= frames, "{} of {frames}", read.len());
        pieces.push((from, read));
    }
    for (from, read) in pieces {
        let far = |frame: &&LtcFrame| {
            !(0..=16).contains(&Timecode::of(frame.label, FrameRate::F24).expect("it is one").since(from))
        };
        assert_eq!(read.iter().find(far), None, "from {from}");
    }
}

#[test]
fn other_sample_rates_are_read() {
    for samples in [44_100, 96_000] {
        let mut generator = LtcGenerator::new(at_25(), samples, 0.5);
        let mut decoder = LtcDecoder::new(samples);
        let read = (0..samples).filter_map(|_| decoder.push(generator.sample())).count();
        assert!(read >= 20, "{read} at {samples}");
    }
}

/// A minute of LTC through a pipe that gives its blocks late: the observations, and the film that was sent.
fn piped(
    seconds: f64,
    rate: Option<FrameRate>,
    sent: FrameRate,
    stops_at: f64,
) -> (Vec<Observation>, TrueFilm) {
    let mut luck = Luck::new(12);
    let mut generator = LtcGenerator::new(frame("01:00:05:00", sent), SAMPLES, 0.5);
    let start = "01:00:00:00".parse().expect("it is a label");
    let mut reader = LtcReader::new(SAMPLES, Duration::from_millis(10), rate, start);
    let mut told = Vec::new();
    let (mut block, mut made) = (Vec::new(), 0_u32);
    while f64::from(made) < seconds * f64::from(SAMPLES) {
        block.clear();
        let is_on = f64::from(made) < stops_at * f64::from(SAMPLES);
        block.extend((0..512).map(|_| if is_on { generator.sample() } else { 0 }));
        made += 512;
        // The line takes 10 ms, the pipe up to 6 more. The sound card's crystal is 60 ppm off.
        let read = f64::from(made) / (f64::from(SAMPLES) * 1.000_06) + 0.010 + luck.between(0.0, 0.006);
        reader.hear(&block, mono(read), &mut |heard| told.push(heard));
    }
    (told, TrueFilm::new(5.0 * f64::from(sent.labels()) / sent.frames_per_second(), 1.000_06))
}

#[test]
fn through_a_pipe_that_is_late_the_film_is_known_within_half_a_millisecond() {
    let (told, film) = piped(20.0, Some(FrameRate::F25), FrameRate::F25, f64::MAX);
    let mut tracker = SourceTracker::new(SourceKind::Ltc, 0.0015, mono(0.0));
    let (mut errors, mut locked) = (Vec::new(), None);
    for observation in &told {
        tracker.hear(observation);
        let t = observation.at.since(mono(0.0)).as_secs_f64();
        if tracker.state().may_lead() {
            locked.get_or_insert(t - told[0].at.since(mono(0.0)).as_secs_f64());
            errors.push((tracker.point(observation.at).media.as_secs_f64() - film.media_s(t)) * 1e3);
        }
    }
    let late = &mut errors[100..];
    let bias = late.iter().sum::<f64>() / late.len() as f64;
    late.iter_mut().for_each(|error| *error = (*error - bias).abs());
    late.sort_by(f64::total_cmp);
    let p99 = late[(late.len() - 1) * 99 / 100];
    let locked = locked.expect("it locks");
    println!("pipe: lock {locked:.2} s, p99 {p99:.3} ms, bias {bias:.3} ms");
    assert!(locked <= 1.0 && p99 <= 0.5 && bias.abs() <= 1.0, "{locked} s, {p99} ms, {bias} ms");
}

#[test]
fn a_line_that_falls_silent_says_so_once_and_a_rate_that_nobody_configured_is_found() {
    for sent in [FrameRate::F24, FrameRate::F23_976, FrameRate::F29_97Drop] {
        let (told, film) = piped(4.0, None, sent, 3.0);
        let is_of_frames =
            |told: &&Observation| matches!(told.word, FilmWord::Position(_) | FilmWord::Unplaced);
        let words: Vec<&Observation> = told.iter().filter(|told| !is_of_frames(told)).collect();
        assert!(matches!(words[..], [Observation { word: FilmWord::Silence, .. }]), "{words:?}");
        let silent = words[0].at.since(mono(3.0)).as_secs_f64();
        assert!(silent < 0.035, "{sent}: after {silent} s");
        let last = told[told.len() - 2];
        let FilmWord::Position(media) = last.word else { panic!("{last:?}") };
        let error = media.as_secs_f64() - film.media_s(last.at.since(mono(0.0)).as_secs_f64());
        assert!(error.abs() < 0.003, "{sent}: {error} s");
    }
}

#[test]
fn a_sender_that_repeats_its_frame_in_a_pause_says_stop_and_positions_again_when_it_goes_on() {
    let mut reader = LtcReader::new(SAMPLES, Duration::ZERO, Some(FrameRate::F25), Label::default());
    let mut words = Vec::new();
    let mut block = Vec::new();
    for n in 0..60 {
        // A second that runs, half of one that stands, and on.
        let frame = at_25().plus(if n < 25 { n } else { (n - 12).max(25) });
        let mut generator = LtcGenerator::new(frame, SAMPLES, 0.5);
        block.clear();
        block.extend((0..1_920).map(|_| generator.sample()));
        reader.hear(&block, mono((n + 1) as f64 * 0.04), &mut |heard| words.push((n, heard.word)));
    }
    let is_stop = |word: &&(i64, FilmWord)| word.1 == FilmWord::Stop;
    let stops: Vec<i64> = words.iter().filter(is_stop).map(|(n, _)| *n).collect();
    let after_s = (stops[0] - 25) as f64 * 0.04;
    assert!(after_s <= 0.13, "it is told after {after_s} s");
    assert!(
        words.iter().all(|(_, word)| matches!(word, FilmWord::Stop | FilmWord::Position(_))),
        "{words:?}"
    );
    let moved = words
        .iter()
        .filter(|(n, word)| *n > 30 && *word != FilmWord::Stop)
        .map(|(n, _)| *n)
        .collect::<Vec<_>>();
    assert!(moved[0] > 37 && moved[0] <= 42 && moved.len() >= 18, "{moved:?}");
}

#[test]
fn noise_on_the_line_is_dirt() {
    let mut reader = LtcReader::new(SAMPLES, Duration::ZERO, None, Label::default());
    let mut generator = LtcGenerator::new(at_25(), SAMPLES, 0.5);
    let (mut luck, mut words) = (Luck::new(2), Vec::new());
    for n in 1..200 {
        let block: Vec<i16> =
            (0..480).map(|_| if n < 100 { generator.sample() } else { luck.bits() as i16 }).collect();
        reader.hear(&block, mono(f64::from(n) * 0.01), &mut |heard| words.push(heard.word));
    }
    words.retain(|word| !matches!(word, FilmWord::Position(_) | FilmWord::Unplaced));
    assert_eq!(words, [FilmWord::Dirt]);
}

#[test]
fn no_samples_at_any_time_make_the_reader_panic() {
    let mut luck = Luck::new(31);
    let mut reader = LtcReader::new(SAMPLES, Duration::from_millis(3), None, Label::default());
    for _ in 0..300 {
        let kind = luck.below(4);
        let block: Vec<i16> = (0..luck.below(600))
            .map(|n| match kind {
                0 => luck.bits() as i16,
                1 => {
                    if n / 12 % 2 == 0 {
                        i16::MAX
                    } else {
                        i16::MIN
                    }
                }
                2 => 0,
                _ => {
                    if luck.is(0.05) {
                        i16::MIN
                    } else {
                        0
                    }
                }
            })
            .collect();
        reader.hear(&block, MonoTime::from_nanos(luck.bits() >> luck.below(64)), &mut |_| ());
    }
}
