use super::*;
use crate::film::point::FilmState;
use crate::harness::shown::{Luck, mono};

fn point(t: f64, media_s: f64, rate: f64) -> FilmPoint {
    FilmPoint {
        at: mono(t),
        media: ShowTime::from_secs_f64(media_s),
        rate,
        epoch: 0,
        state: FilmState::Locked,
    }
}

/// How far the playhead is behind a film that is `ahead_s` further on than it, tick by tick, milliseconds.
fn taken_back(limits: PaceLimits, hz: f64, ahead_s: f64, trim_ms: i32, seconds: f64) -> Vec<f64> {
    let frame = Duration::from_secs_f64(1.0 / hz);
    let mut follower = Follower::new(limits);
    follower.join(&point(0.0, 0.0, 1.0), mono(0.0), 0);
    let film = point(0.0, ahead_s, 1.0);
    let mut errors = Vec::new();
    for tick in 0..(seconds * hz) as u32 {
        let end = mono(f64::from(tick + 1) / hz);
        follower.follow(&film, end, frame, trim_ms);
        let behind = film.media_at(end).as_nanos() - follower.playhead().as_nanos();
        errors.push(ShowTime::from_nanos(behind).as_secs_f64() * 1e3 - f64::from(trim_ms));
    }
    errors
}

fn within_s(errors: &[f64], hz: f64, ms: f64) -> f64 {
    errors.iter().rposition(|error| error.abs() > ms).map_or(0.0, |last| (last + 1) as f64 / hz)
}

#[test]
fn a_step_is_taken_back_to_the_goal_and_never_passed() {
    for hz in [24.0, 50.0, 100.0, 1_000.0] {
        for (step_ms, to_ms, goal_s) in
            [(10.0, 2.0, 1.4), (20.0, 2.0, 2.4), (40.0, 20.0, 3.0), (40.0, 5.0, 4.5)]
        {
            for sign in [1.0, -1.0] {
                let errors = taken_back(PaceLimits::default(), hz, sign * step_ms * 1e-3, 0, 12.0);
                let took = within_s(&errors, hz, to_ms);
                let over = errors.iter().map(|error| -sign * error).fold(0.0, f64::max);
                println!("{hz} Hz: {step_ms} ms to {to_ms} ms in {took:.2} s, over by {over:.4} ms");
                assert!(took <= goal_s, "{hz} Hz: {step_ms} ms to {to_ms} ms in {took} s");
                assert!(over <= 0.05, "{hz} Hz: over by {over} ms");
                assert!(errors[errors.len() - 1].abs() < 0.000_5, "it gets there: {:?}", errors.last());
            }
        }
    }
}

#[test]
fn a_trim_of_many_frames_is_slewed_in_within_the_same_pace() {
    for trim_ms in [40, -500] {
        let errors = taken_back(PaceLimits::default(), 100.0, 0.0, trim_ms, 70.0);
        let took = within_s(&errors, 100.0, 2.0);
        println!("trim {trim_ms} ms in {took:.1} s");
        let least = f64::from(trim_ms.abs()) * 1e-3 / 0.01;
        assert!(took < 1.3 * least + 1.0, "{took} s");
    }
}

#[test]
fn an_undisturbed_film_of_the_ticks_is_followed_to_the_nanosecond() {
    let frame = Duration::from_millis(10);
    let mut follower = Follower::new(PaceLimits::default());
    follower.join(&point(0.0, 5.0, 1.0), mono(0.0), 0);
    for tick in 1..=1_000_u64 {
        let at = mono(0.0) + frame * u32::try_from(tick).expect("few");
        let film = FilmPoint { at, ..point(0.0, 5.0 + tick as f64 * 0.01, 1.0) };
        follower.follow(&film, at, frame, 0);
        assert_eq!(follower.playhead(), film.media);
        assert_eq!(follower.pace(), 1.0);
    }
}

#[test]
fn a_film_at_any_rate_of_the_band_is_followed_without_a_remaining_error() {
    for rate in [0.9985, 0.999, 1.001, 1.0015] {
        let mut follower = Follower::new(PaceLimits::default());
        let film = point(0.0, 0.0, rate);
        follower.join(&film, mono(0.0), 0);
        let frame = Duration::from_millis(10);
        for tick in 1..3_000_u32 {
            follower.follow(&film, mono(0.0) + tick * frame, frame, 0);
        }
        let behind = film.media_at(mono(0.0) + 2_999 * frame).as_nanos() - follower.playhead().as_nanos();
        assert!(behind.abs() < 1_000, "{rate}: {behind} ns");
    }
}

/// How often the chance tests try: `KINOCUE_FILM_TRIES` times as often as a run of all tests has time for.
pub(in crate::film) fn tries(normally: u32) -> u32 {
    let times = std::env::var("KINOCUE_FILM_TRIES").ok().and_then(|times| times.parse::<u32>().ok());
    normally * times.unwrap_or(1)
}

#[test]
fn whatever_the_points_say_pace_and_its_changes_keep_their_limits() {
    for seed in 0..tries(200) {
        let mut luck = Luck::new(seed.into());
        let limits = PaceLimits { slew: luck.between(0.005, 0.02), ..PaceLimits::default() };
        let hz = [24.0, 60.0, 100.0, 1_000.0][luck.below(4)];
        let frame = Duration::from_secs_f64(1.0 / hz);
        let mut follower = Follower::new(limits);
        let (mut pace, mut change) = (follower.pace(), 0.0);
        let mut film = point(0.0, 0.0, 1.0);
        let mut end = mono(0.0);
        for _ in 0..1_000 {
            end = end + frame;
            if luck.is(0.1) {
                let any = [f64::NAN, f64::INFINITY, -1.0, 0.0, luck.between(0.9, 1.1), 1e300];
                film.rate = any[luck.below(6)];
                film.media = ShowTime::from_nanos((luck.bits() >> luck.below(64)).cast_signed());
                film.at = MonoTime::from_nanos(luck.bits() >> luck.below(64));
                film.epoch = film.epoch.wrapping_add(1);
            }
            let before = follower.playhead();
            follower.follow(&film, end, frame, [0, 500, -500][luck.below(3)]);
            let most = limits.change_per_s();
            let changed = (follower.pace() - pace) * hz;
            assert!(
                (follower.pace() - 1.0).abs() <= limits.band + limits.slew + 1e-12,
                "{}",
                follower.pace()
            );
            assert!(changed.abs() <= most + 1e-9, "{changed} of {most}");
            // Where the playhead is on the film to a nanosecond its pace is set to the film's: four billionths at the most.
            let set = 4e-9 * hz * hz * 2.0;
            assert!((changed - change).abs() * hz <= 10.0 * most + set + 1e-6, "{changed} after {change}");
            let moved = follower.playhead().as_nanos() - before.as_nanos();
            assert!((moved as f64 - frame.as_nanos() as f64 * follower.pace()).abs() <= 1.0, "{moved}");
            (pace, change) = (follower.pace(), changed);
        }
    }
}
