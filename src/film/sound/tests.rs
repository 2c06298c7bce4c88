use std::sync::{Arc, OnceLock};

use super::ear::{EarState, HeardPlace, SoundEar};
use super::index::{IndexMaker, SoundIndex};
use super::kernel::Resampler;
use crate::film::follower::tests::tries;

const RATE: usize = 8_000;
const FILM_S: usize = 40;

/// The dice of a test, which are the same each time.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / (1 << 24) as f32
    }

    fn noise(&mut self) -> f32 {
        self.next() + self.next() + self.next() - 1.5
    }
}

/// Adds notes, each with some overtones, for as long as the sound is: music, where they are long, or something like speech.
fn add_notes(sound: &mut [f32], dice: &mut Dice, level: f32, longest_s: f32) {
    let mut at = 0;
    while at < sound.len() {
        let length = ((0.1 + longest_s * dice.next()) * RATE as f32) as usize;
        let end = (at + length).min(sound.len());
        let base = 90.0 * (dice.next() * 1.8).exp2();
        for overtone in [1.0, 2.0, 3.0, 5.0, 8.0, 12.0] {
            let turn = std::f32::consts::TAU * base * overtone * (1.0 + 0.01 * dice.next()) / RATE as f32;
            let loud = level * dice.next() / overtone.sqrt();
            for (n, sample) in sound[at..end].iter_mut().enumerate() {
                let fade = 1.0 - n as f32 / length as f32;
                *sample += loud * fade * (turn * n as f32).sin();
            }
        }
        at += length * if dice.next() < 0.3 { 2 } else { 1 };
    }
}

/// The music and noises of a film, and its dialogue.
fn film(seed: u64) -> [Vec<f32>; 2] {
    film_of(seed, FILM_S)
}

fn film_of(seed: u64, seconds: usize) -> [Vec<f32>; 2] {
    let mut dice = Dice(seed * 0x9e37_79b9 + 1);
    let mut low = 0.0;
    let mut effects: Vec<f32> = (0..seconds * RATE)
        .map(|_| {
            low += 0.1 * (dice.noise() - low);
            0.05 * low
        })
        .collect();
    add_notes(&mut effects, &mut dice, 0.05, 0.9);
    let mut speech = vec![0.0; seconds * RATE];
    add_notes(&mut speech, &mut dice, 0.08, 0.25);
    [effects, speech]
}

fn sum(one: &[f32], other: &[f32]) -> Vec<f32> {
    one.iter().zip(other).map(|(one, other)| one + other).collect()
}

fn index(name: &str, sound: &[f32]) -> SoundIndex {
    let mut maker = IndexMaker::new(RATE as u32);
    sound.chunks(4_096).for_each(|block| maker.push(block));
    maker.finish(name)
}

/// The parts of a film, the whole of it, and its index.
type PlayedFilm = ([Vec<f32>; 2], Vec<f32>, Arc<[SoundIndex]>);

/// The film that most tests play.
fn the_film() -> &'static PlayedFilm {
    static FILM: OnceLock<PlayedFilm> = OnceLock::new();
    FILM.get_or_init(|| {
        let parts = film(1);
        let whole = sum(&parts[0], &parts[1]);
        let index = Arc::from([index("The Storm", &whole)]);
        (parts, whole, index)
    })
}

/// What an ear makes of a line.
struct Listened {
    places: Vec<HeardPlace>,
    /// States in the order in which they came.
    states: Vec<EarState>,
    /// When the first place was told, seconds: it may be one of before.
    told_s: f64,
}

fn listen(films: &Arc<[SoundIndex]>, line: &[f32]) -> Listened {
    let mut ear = SoundEar::new(Arc::clone(films), RATE as u32);
    let mut heard = Listened { places: Vec::new(), states: Vec::new(), told_s: f64::INFINITY };
    for (block, so_far_s) in line.chunks(80).zip(1..) {
        ear.hear(block, &mut |place| heard.places.push(place));
        if !heard.places.is_empty() {
            heard.told_s = heard.told_s.min(f64::from(so_far_s) * 0.01);
        }
        if heard.states.last() != Some(&ear.state()) {
            heard.states.push(ear.state());
        }
    }
    heard
}

/// When the first place was heard, seconds, and the greatest error of all, milliseconds, where the film was at `begin_s` and ran at `speed`.
fn judge(heard: &Listened, begin_s: f64, speed: f64) -> (f64, f64) {
    let off_ms = |place: &HeardPlace| (place.media_s - begin_s - speed * place.line_s).abs() * 1e3;
    let first = heard.places.first().map_or(f64::INFINITY, |place| place.line_s);
    (first, heard.places.iter().map(off_ms).fold(0.0, f64::max))
}

fn at_speed(sound: &[f32], speed: f64) -> Vec<f32> {
    let mut out = Vec::new();
    Resampler::new(speed, 0.9).push(sound, &mut out);
    out
}

fn loudness(sound: &[f32]) -> f32 {
    (sound.iter().map(|sample| sample * sample).sum::<f32>() / sound.len() as f32).sqrt()
}

#[test]
fn a_place_is_found_from_anywhere_and_held_whatever_was_done_to_the_sound() {
    let ([effects, speech], whole, index) = the_film();
    let mut dice = Dice(99);
    let (at, end) = (23 * RATE + 1_234, 28 * RATE);
    let plain = &whole[at..end];
    let loud = loudness(plain);
    let noise: Vec<f32> = plain.iter().map(|_| dice.noise() * 1.41 * loud).collect();
    let mut talk = vec![0.0; plain.len()];
    add_notes(&mut talk, &mut dice, 0.08, 0.25);
    let mut low = 0.0;
    let toned = |sample: &f32| {
        low += 0.3 * (sample - low);
        0.4 * low + 1.5 * (sample - low)
    };
    let cases = [
        ("as it is", plain.to_vec(), 1.0),
        ("soft", plain.iter().map(|sample| 0.03 * sample).collect(), 1.0),
        ("with other tone controls", plain.iter().map(toned).collect(), 1.0),
        ("under noise", sum(plain, &noise), 1.0),
        ("under talk", sum(plain, &talk), 1.0),
        (
            "of the centre",
            effects[at..end].iter().zip(&speech[at..end]).map(|(e, s)| 0.3 * e + s).collect(),
            1.0,
        ),
        ("dubbed", sum(&effects[at..end], &talk), 1.0),
        ("a pull-down slower", at_speed(plain, 0.999), 0.999),
        ("at 25 frames a second", at_speed(plain, 25.0 / 24.0), 25.0 / 24.0),
    ];
    for (case, line, speed) in cases {
        let heard = listen(index, &line);
        let (first_s, worst_ms) = judge(&heard, at as f64 / RATE as f64, speed);
        assert!(first_s < 4.0 && worst_ms < 2.0, "{case}: {first_s} s, {worst_ms} ms");
        assert!(heard.places.len() > 15, "{case}: {}", heard.places.len());
    }
}

#[test]
fn another_film_is_never_taken_for_it_and_is_named_where_its_index_is_there() {
    let (_, whole, index) = the_film();
    let [effects, speech] = film(2);
    let other = sum(&effects, &speech);
    let heard = listen(index, &other[..8 * RATE]);
    assert!(heard.places.is_empty() && heard.states == [EarState::Unknown], "{:?}", heard.states);
    let both: Arc<[SoundIndex]> = Arc::from([index[0].clone(), self::index("Trailer", &other)]);
    let line = [&other[10 * RATE..14 * RATE], &whole[20 * RATE..24 * RATE]].concat();
    let films: Vec<EarState> =
        listen(&both, &line).states.into_iter().filter(|state| matches!(state, EarState::Film(_))).collect();
    assert_eq!(films, [EarState::Film(1), EarState::Film(0)]);
}

#[test]
fn a_loop_is_nowhere_and_a_clock_that_there_was_goes_on_in_it() {
    let (_, whole, _) = the_film();
    let again = &whole[..4 * RATE];
    let looped = [&whole[20 * RATE..24 * RATE], again, again, again, again].concat();
    let index = Arc::from([index("Loop", &looped)]);
    let heard = listen(&index, &looped[12 * RATE..]);
    assert!(heard.places.is_empty(), "{:?}", heard.places.first());
    assert!(heard.states.iter().any(|state| matches!(state, EarState::Ambiguous(2..))), "{:?}", heard.states);
    let heard = listen(&index, &looped);
    let (_, worst_ms) = judge(&heard, 0.0, 1.0);
    assert!(worst_ms < 2.0 && heard.places.last().is_some_and(|place| place.line_s > 19.5), "{worst_ms} ms");
}

#[test]
fn a_film_that_is_cut_off_is_silent_and_one_that_is_quiet_there_is_not_missed() {
    let (_, whole, _) = the_film();
    let quiet = vec![0.0; 2 * RATE];
    let mut sound = whole[..20 * RATE].to_vec();
    sound[10 * RATE..12 * RATE].fill(0.0);
    let index = Arc::from([index("Quiet", &sound)]);
    let heard = listen(&index, &sound[4 * RATE..16 * RATE]);
    assert!(!heard.states.contains(&EarState::Silent), "{:?}", heard.states);
    assert!(heard.states.contains(&EarState::Quiet), "{:?}", heard.states);
    assert!(judge(&heard, 4.0, 1.0).1 < 2.0);
    let stopped = [&sound[4 * RATE..9 * RATE], &quiet].concat();
    let heard = listen(&index, &stopped);
    assert_eq!(heard.states[heard.states.len() - 2..], [EarState::Film(0), EarState::Silent]);
    let last = heard.places.last().expect("it was heard").line_s;
    assert!(last < 5.6, "told until {last} s of a line that ends at 5 s");
}

#[test]
fn where_another_dialogue_is_all_that_is_heard_nothing_is_told_and_the_clock_of_before_is_heard_again_within_a_second()
 {
    let ([effects, _], _, index) = the_film();
    let (at, seconds) = (12 * RATE, 11);
    let mut line = effects[at..at + seconds * RATE].to_vec();
    line[4 * RATE..8 * RATE].fill(0.0);
    add_notes(&mut line, &mut Dice(5), 0.08, 0.25);
    let heard = listen(index, &line);
    let (first_s, worst_ms) = judge(&heard, 12.0, 1.0);
    assert!(first_s < 4.0 && worst_ms < 2.0, "{first_s} s, {worst_ms} ms");
    let told = |from_s: f64, to_s: f64| {
        heard.places.iter().filter(|place| (from_s..to_s).contains(&place.line_s)).count()
    };
    assert_eq!(told(4.7, 8.0), 0, "nobody knows whether it runs");
    assert!(told(8.0, 9.0) > 0 && told(9.0, 11.0) > 15, "{:?}", heard.places);
    assert!(heard.states.contains(&EarState::Unknown), "{:?}", heard.states);
}

#[test]
fn a_film_that_is_wound_is_found_where_it_is_then() {
    let (_, whole, index) = the_film();
    let line = [&whole[5 * RATE..9 * RATE], &whole[30 * RATE..35 * RATE]].concat();
    let heard = listen(index, &line);
    let after = |place: &&HeardPlace| place.line_s > 8.0;
    let late: Vec<&HeardPlace> = heard.places.iter().filter(after).collect();
    assert!(late.len() > 8 && late.iter().all(|place| (place.media_s - place.line_s - 26.0).abs() < 0.002));
    let wrong =
        |place: &&HeardPlace| place.line_s > 4.7 && (place.media_s - place.line_s - 26.0).abs() > 0.002;
    assert_eq!(heard.places.iter().find(wrong), None);
}

#[test]
fn sound_of_any_rate_is_made_into_that_of_another_without_a_delay() {
    for (from, to) in [(44_100.0, 8_000.0), (48_000.0, 8_000.0), (8_000.0, 1_600.0), (11_025.0, 8_000.0)] {
        let wave = |at_s: f64| (std::f64::consts::TAU * 300.0 * at_s).sin() as f32;
        let sound: Vec<f32> = (0..20_000).map(|n| wave(f64::from(n) / from)).collect();
        let (mut out, mut resampler) = (Vec::new(), Resampler::new(from / to, 0.8 * to / from));
        sound.chunks(77).for_each(|block| resampler.push(block, &mut out));
        let off = |(n, sample): (usize, &f32)| (sample - wave(n as f64 / to)).abs();
        let worst = out.iter().enumerate().skip(50).map(off).fold(0.0, f32::max);
        assert!(worst < 0.02 && out.len() > 500, "{from} to {to}: {worst}");
    }
}

/// When a place is told first, seconds, the soonest first; of `all` tries of 12 s each from anywhere in a film of so many.
fn first_told_s(
    all: u32,
    (film_s, index): (usize, &Arc<[SoundIndex]>),
    mut damage: impl FnMut(&mut Dice, std::ops::Range<usize>) -> Vec<f32>,
) -> Vec<f64> {
    let mut dice = Dice(0x50_1d);
    let (mut places, mut off, seconds) = (0, 0, 12);
    let mut found: Vec<f64> = (0..all)
        .map(|_| {
            let at = (f64::from(dice.next()) * ((film_s - seconds) * RATE) as f64) as usize;
            let heard = listen(index, &damage(&mut dice, at..at + seconds * RATE));
            let begin_s = at as f64 / RATE as f64;
            let is_off = |place: &&HeardPlace| (place.media_s - begin_s - place.line_s).abs() > 0.002;
            places += heard.places.len();
            off += heard.places.iter().filter(is_off).count();
            heard.told_s
        })
        .collect();
    println!("{off} of {places} places are off by more than 2 ms");
    assert!(50 * off <= places, "a tracker leaves out what does not fit");
    found.sort_by(f64::total_cmp);
    found
}

/// What another cinema's line does: noise as loud as the film, somebody who talks, and tone controls.
fn badly_damaged(dice: &mut Dice, plain: &[f32]) -> Vec<f32> {
    let loud = loudness(plain);
    let mut line: Vec<f32> = plain.iter().map(|sample| sample + dice.noise() * 1.41 * loud).collect();
    add_notes(&mut line, dice, 0.08, 0.25);
    let mut low = 0.0;
    line.iter_mut().for_each(|sample| {
        low += 0.3 * (*sample - low);
        *sample = 1.5 * *sample - 1.1 * low;
    });
    line
}

/// Of as many seconds as `KINOCUE_FILM_SECONDS` says: what of a film is no dialogue, all of it, and its index.
fn a_film() -> ([Vec<f32>; 2], Arc<[SoundIndex]>) {
    let seconds = std::env::var("KINOCUE_FILM_SECONDS").ok().and_then(|seconds| seconds.parse().ok());
    let seconds = seconds.unwrap_or(FILM_S);
    let [effects, speech] = film_of(1, seconds);
    let whole = sum(&effects, &speech);
    let made = index("The Storm", &whole);
    let octets = made.to_octets().len();
    assert!(octets as f64 / seconds as f64 * 7_200.0 < 8e6, "{octets} octets for {seconds} s");
    ([effects, whole], Arc::from([made]))
}

/// `KINOCUE_FILM_TRIES=80` tries often enough for a figure, and `KINOCUE_FILM_SECONDS=7200` in a film of two hours.
#[test]
fn most_places_are_found_within_four_seconds_under_noise_talk_and_tone_controls_at_once_or_another_dialogue()
{
    let ([effects, whole], films) = a_film();
    let seconds = effects.len() / RATE;
    let damaged = first_told_s(tries(5), (seconds, &films), |dice, span| badly_damaged(dice, &whole[span]));
    let dubbed = first_told_s(tries(5), (seconds, &films), |dice, span| {
        let mut line = effects[span].to_vec();
        add_notes(&mut line, dice, 0.08, 0.25);
        line
    });
    let at = |all: &[f64], percent: usize| all[(all.len() - 1) * percent / 100];
    for (what, all) in [("damaged", &damaged), ("dubbed", &dubbed)] {
        println!("{what}: median {:.2} s, p95 {:.2} s, of {}", at(all, 50), at(all, 95), all.len());
    }
    assert!(at(&damaged, 50) <= 4.0 && at(&dubbed, 50) <= 4.0);
}

/// `KINOCUE_FILMS=0..1250` listens to so many other films, each in eight passages, so that processes can share them; and
/// `KINOCUE_FILM_SECONDS=7200` holds them against two hours.
#[test]
fn no_passage_of_another_film_is_ever_taken_for_one_of_this() {
    let asked = std::env::var("KINOCUE_FILMS").unwrap_or_else(|_| "0..1".to_owned());
    let numbers: Vec<u64> = asked.split("..").filter_map(|number| number.parse().ok()).collect();
    let [from, to] = numbers[..] else { panic!("KINOCUE_FILMS is {asked}, not like 0..1250") };
    let (_, films) = a_film();
    let (mut passages, mut wrong) = (0, 0);
    for seed in from..to {
        let [effects, speech] = film(1_000 + seed);
        for passage in sum(&effects, &speech).chunks(5 * RATE) {
            passages += 1;
            wrong += u32::from(!listen(&films, passage).places.is_empty());
        }
        println!("{wrong} of {passages} passages of the films {from}..={seed} were taken for the film");
    }
    assert_eq!(wrong, 0);
}

mod file {
    use super::super::file::IndexFault;
    use super::*;

    fn small() -> (SoundIndex, Vec<u8>) {
        let (_, whole, _) = the_film();
        let index = index("Der Sturm", &whole[..3 * RATE]);
        let octets = index.to_octets();
        (index, octets)
    }

    #[test]
    fn an_index_is_read_back_as_it_was_made_and_is_small() {
        let (index, octets) = small();
        assert_eq!(SoundIndex::of_octets(&octets), Ok(index.clone()));
        let a_second = octets.len() as f64 / index.seconds();
        assert!(a_second * 7_200.0 < 8e6, "{a_second} octets a second");
        assert!(!index.landmarks.is_empty());
    }

    #[test]
    fn an_index_that_is_cut_short_or_changed_anywhere_is_refused_with_the_cause() {
        let (_, octets) = small();
        for length in (0..octets.len()).step_by(7) {
            let fault = SoundIndex::of_octets(&octets[..length]).expect_err("it is cut short");
            assert!(matches!(fault, IndexFault::Foreign | IndexFault::Length { .. }), "{length}: {fault}");
        }
        for at in (0..octets.len()).step_by(97) {
            let mut changed = octets.clone();
            changed[at] ^= 0x10;
            SoundIndex::of_octets(&changed).expect_err("it was changed");
        }
        let with = |at: usize, octet: u8| {
            let mut changed = octets.clone();
            changed[at] = octet;
            SoundIndex::of_octets(&changed).expect_err("it is another").to_string()
        };
        assert!(with(0, b'X').contains("kinocue sync index"));
        assert!(with(8, 2).contains("version 2"));
        assert!(with(octets.len() - 1, !octets[octets.len() - 1]).contains("damaged"));
        assert_eq!(SoundIndex::of_octets(&vec![b'x'; 1 << 20]), Err(IndexFault::Foreign));
    }
}

mod reader {
    use super::super::reader::SoundReader;
    use super::*;
    use crate::film::observation::FilmWord;
    use crate::film::point::FilmState;
    use crate::film::tracker::{SourceKind, SourceTracker};
    use crate::harness::shown::mono;
    use crate::time::ShowTime;

    /// What a tracker makes of a line: each state that it came to, and when, seconds; and where it thinks that the film is at the end.
    fn track(films: &Arc<[SoundIndex]>, line: &[f32]) -> (Vec<(FilmState, f64)>, f64, SoundReader) {
        let mut tracker = SourceTracker::new(SourceKind::Sound, 0.0015, mono(0.0));
        let begin = ShowTime::from_secs_f64(2.0);
        let mut reader =
            SoundReader::new(RATE as u32, std::time::Duration::from_millis(20), begin, Arc::clone(films));
        let mut states = vec![(tracker.state(), 0.0)];
        let mut now_s = 0.0;
        for block in line.chunks(80) {
            now_s += block.len() as f64 / RATE as f64;
            let samples: Vec<i16> = block.iter().map(|sample| (sample * 32_768.0) as i16).collect();
            reader.hear(&samples, mono(now_s), &mut |told| tracker.hear(&told));
            tracker.poll(mono(now_s));
            if states.last().is_some_and(|(state, _)| *state != tracker.state()) {
                states.push((tracker.state(), now_s));
            }
        }
        (states, tracker.point(mono(now_s)).media.as_secs_f64() - now_s, reader)
    }

    fn when(states: &[(FilmState, f64)], wanted: FilmState) -> f64 {
        states.iter().find(|(state, _)| *state == wanted).map_or(f64::INFINITY, |(_, at_s)| *at_s)
    }

    #[test]
    fn a_chase_locks_within_four_seconds_and_knows_latency_and_the_cues_begin() {
        let (_, whole, index) = the_film();
        let (states, ahead_s, reader) = track(index, &whole[9 * RATE..15 * RATE]);
        let locked_s = when(&states, FilmState::Locked);
        assert!(
            locked_s < 4.0 && states.last().is_some_and(|last| last.0 == FilmState::Locked),
            "{states:?}"
        );
        // The cue begins 2 s into the film, and what is heard now was at the line 20 ms ago.
        assert!((ahead_s - (9.0 - 2.0 + 0.02)).abs() < 0.002, "{ahead_s}");
        assert_eq!((reader.film(), reader.refused()), (Some("The Storm"), None));
    }

    #[test]
    fn a_line_that_falls_silent_is_lost_within_a_second_and_another_film_at_once_when_it_is_known() {
        let (_, whole, index) = the_film();
        let cut = [&whole[9 * RATE..13 * RATE], &vec![0.0; 2 * RATE]].concat();
        let (states, _, _) = track(index, &cut);
        let lost_s = when(&states, FilmState::Lost);
        assert!((4.0..5.0).contains(&lost_s), "{states:?}");
        let [effects, speech] = film(3);
        let other = sum(&effects, &speech);
        let films: Arc<[SoundIndex]> = Arc::from([index[0].clone(), self::index("Trailer", &other)]);
        let (states, _, reader) =
            track(&films, &[&whole[9 * RATE..13 * RATE], &other[9 * RATE..13 * RATE]].concat());
        assert!(when(&states, FilmState::Locked) < 4.0 && when(&states, FilmState::Lost) < 7.5, "{states:?}");
        assert!(states.last().is_some_and(|last| last.0 == FilmState::Lost), "{states:?}");
        let why = reader.refused().expect("it is another film");
        assert!(why.contains("Trailer is playing") && why.contains("The Storm"), "{why}");
    }

    #[test]
    fn a_film_at_another_speed_is_known_and_leads_nobody() {
        let (_, whole, index) = the_film();
        let (states, _, reader) = track(index, &at_speed(&whole[9 * RATE..16 * RATE], 25.0 / 24.0));
        assert_eq!(when(&states, FilmState::Locked), f64::INFINITY, "{states:?}");
        assert_eq!(reader.film(), Some("The Storm"));
    }

    #[test]
    fn noise_square_waves_and_nothing_say_nothing_of_any_film() {
        let (_, _, index) = the_film();
        let mut dice = Dice(5);
        let mut noise = |_| 0.3 * dice.noise();
        let lines: [Vec<f32>; 3] = [
            (0..6 * RATE).map(&mut noise).collect(),
            (0..6 * RATE).map(|n| if n / 20 % 2 == 0 { 0.99 } else { -0.99 }).collect(),
            vec![0.0; 6 * RATE],
        ];
        for line in lines {
            let mut reader =
                SoundReader::new(RATE as u32, std::time::Duration::ZERO, ShowTime::ZERO, Arc::clone(index));
            for (n, block) in line.chunks(80).enumerate() {
                let samples: Vec<i16> = block.iter().map(|sample| (sample * 32_768.0) as i16).collect();
                reader.hear(&samples, mono(n as f64 / 100.0), &mut |told| {
                    assert!(!matches!(told.word, FilmWord::Position(_)), "{told:?}");
                });
            }
        }
    }
}
