//! Shows that chase a film, in virtual time: whatever the film does, the seat keeps its limits, and is where the film is.

use kinocue::harness::engine::Ending;
use kinocue::harness::film::point::FilmState;
use kinocue::harness::rt::News;
use kinocue::harness::state::{Cause, PlayMode, State, Transition};
use kinocue::harness::time::ShowTime;
use kinocue::harness::{Event, ORIGIN, Played, Virtual};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// How long the cue is, s.
const LENGTH: i32 = 30;

/// A cue of one wave every five seconds about the middle of the stroke, from rest to rest.
fn wave() -> String {
    let row = |ms: i32| {
        let turn = f64::from(ms) / 5_000.0 * std::f64::consts::TAU;
        format!("{ms},{:.7}\n", 0.5 - 0.25 * turn.cos())
    };
    let rows: String = (0..=LENGTH * 50).map(|row_of| row(20 * row_of)).collect();
    format!("time_ms,a1\n{rows}")
}

fn chasing() -> Virtual {
    Virtual { chases: true, at_most: 20_000, ..Virtual::new(wave()) }
}

/// The film is said to be there at that time of the show, both in seconds.
fn film(at_s: f64, media_s: f64, rate: f64, state: FilmState) -> (u64, Event) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousands")]
    let tick = (at_s * 100.0) as u64;
    (tick, Event::Film(ShowTime::from_secs_f64(media_s), rate, state))
}

fn play(script: Vec<(u64, Event)>) -> Played {
    let played = Virtual { script, ..chasing() }.play();
    assert_eq!(played.clamps[0].clamps, 0, "the limiter had nothing to do");
    let worst = played.worst();
    assert!(
        worst.velocity <= 1.01 && worst.acceleration <= 1.01 && worst.jerk <= 1.01,
        "the seat's limits: {worst:?}"
    );
    played
}

fn states(played: &Played) -> Vec<(State, Cause)> {
    let entered = |news: &News| match news {
        News::Entered { state, cause, .. } => Some((*state, *cause)),
        _ => None,
    };
    played.news.iter().filter_map(entered).collect()
}

/// How far the seat is from where it should be at an instant of the film, mm, at the end of each frame from `from_s` to `to_s`.
fn errors_mm(played: &Played, from_s: f64, to_s: f64, media_s: impl Fn(f64) -> f64) -> f64 {
    let mm = played.positions_mm(0, 0);
    let off = played.frames.iter().zip(mm).filter_map(|(frame, mm)| {
        let end_s = frame.at.since(ORIGIN).as_secs_f64() + 0.01;
        let wanted = 150.0 * (0.5 - 0.25 * (media_s(end_s) / 5.0 * std::f64::consts::TAU).cos());
        (from_s..to_s).contains(&end_s).then_some((mm - wanted).abs())
    });
    off.fold(0.0, f64::max)
}

#[test]
fn the_seat_waits_at_park_joins_the_film_where_that_is_follows_it_and_parks_at_the_cues_end() {
    let played = play(vec![film(2.0, 7.0, 1.0, FilmState::Locked)]);
    let first = played.frames[0].at.since(ORIGIN).as_secs_f64();
    assert!(
        (2.5..2.7).contains(&first),
        "no frame before the film was followable for half a second: {first}"
    );
    // 7 s of film at 2 s: the wave's greatest speed is 47 mm/s, so 0.05 mm are a millisecond.
    assert!(errors_mm(&played, 6.0, 24.0, |at| at + 5.0) < 0.05);
    assert_eq!(
        (played.ended.ending, played.frames.last().unwrap().request.positions[0].0),
        (Ending::Completed, 0)
    );
    let states: Vec<State> = states(&played).into_iter().map(|(state, _)| state).collect();
    let playing = [PlayMode::Waiting, PlayMode::Joining, PlayMode::Following].map(State::Playing);
    assert_eq!(
        states,
        [&[State::Playing(PlayMode::Waiting)], &playing[..], &[State::Parking, State::Parked]].concat()
    );
}

#[test]
fn a_film_at_another_speed_is_followed_at_that() {
    // Outside the band that is known of films 5 ms are what keeps the pace at it.
    for (rate, ms) in [(0.99, 5.0), (0.9985, 1.0), (0.999, 1.0), (1.001, 1.0), (1.0015, 1.0), (1.01, 5.0)] {
        let played = play(vec![film(0.5, 0.5, rate, FilmState::Locked)]);
        let off = errors_mm(&played, 12.0, 24.0, |at| 0.5 + rate * (at - 0.5));
        assert!(off < 0.05 * ms, "at {rate} of its speed: {off} mm");
    }
}

#[test]
fn a_film_that_is_a_frame_off_is_slewed_and_one_that_jumps_is_joined() {
    let lead =
        |media_s| vec![film(0.5, 0.5, 1.0, FilmState::Locked), film(10.0, media_s, 1.0, FilmState::Locked)];
    let slewed = play(lead(10.03));
    assert!(errors_mm(&slewed, 16.0, 24.0, |at| at + 0.03) < 0.05);
    let waits = |played: &Played| {
        states(played).iter().skip(2).filter(|(state, _)| *state == State::Playing(PlayMode::Waiting)).count()
    };
    assert_eq!(waits(&slewed), 0, "30 ms are no reason to rest");
    for media_s in [3.0, 10.1, 20.0] {
        let joined = play(lead(media_s));
        assert_eq!(waits(&joined), 1, "to {media_s} s");
        assert!(errors_mm(&joined, 15.0, 19.0, |at| at - 10.0 + media_s) < 0.05, "to {media_s} s");
    }
}

#[test]
fn a_film_that_jumps_about_is_joined_no_sixth_time_before_a_person_resumes() {
    let jumps = [(0.5, 0.5), (3.0, 5.0), (5.0, 3.0), (7.0, 9.0), (9.0, 7.0), (11.0, 13.0)];
    let about = || jumps.map(|(at_s, media_s)| film(at_s, media_s, 1.0, FilmState::Locked)).to_vec();
    let left = play([about(), vec![(2_500, Event::Leave)]].concat());
    let waits = |(state, cause): &(State, Cause)| {
        *state == State::Playing(PlayMode::Waiting) && cause.to_string().contains("resume")
    };
    assert!(states(&left).iter().any(waits), "{:?}", states(&left));
    assert!(left.frames.iter().all(|frame| !(13.0..25.0).contains(&frame.at.since(ORIGIN).as_secs_f64())));
    let resumed = play([about(), vec![(1_600, Event::Ask(Transition::Resume))]].concat());
    assert!(errors_mm(&resumed, 20.0, 26.0, |at| at + 2.0) < 0.05);
}

#[test]
fn the_seat_rests_while_the_film_stands_and_joins_it_where_it_goes_on() {
    let played = play(vec![
        film(0.5, 0.5, 1.0, FilmState::Locked),
        film(8.0, 8.0, 0.0, FilmState::Stopped),
        film(14.0, 8.0, 1.0, FilmState::Acquiring),
        film(14.3, 8.3, 1.0, FilmState::Locked),
    ]);
    let sent = |from_s: f64, to_s: f64| {
        let at =
            |frame: &&kinocue::harness::Frame| (from_s..to_s).contains(&frame.at.since(ORIGIN).as_secs_f64());
        played.frames.iter().filter(at).count()
    };
    assert!(sent(8.0, 8.5) > 10, "it slows down by frames");
    assert_eq!(sent(9.0, 14.2), 0, "and nothing goes to it while it rests");
    assert!(errors_mm(&played, 18.0, 30.0, |at| at - 6.0) < 0.05);
    assert_eq!(played.ended.ending, Ending::Completed);
}

/// When frames were sent, seconds, and where each led, pulses.
fn sent(played: &Played, from_s: f64, to_s: f64) -> Vec<(f64, i32)> {
    let sent = played.frames.iter().map(|frame| {
        let at_s = frame.at.since(ORIGIN).as_secs_f64();
        (at_s, frame.request.positions[0].0)
    });
    sent.filter(|(at_s, _)| (from_s..to_s).contains(at_s)).collect()
}

#[test]
fn frames_hold_the_seat_through_a_seek_of_the_film_until_it_is_found_and_then_it_joins() {
    let played = play(vec![
        film(0.5, 0.5, 1.0, FilmState::Locked),
        film(8.0, 8.0, 1.0, FilmState::Jumped),
        film(11.0, 16.0, 1.0, FilmState::Locked),
    ]);
    let all = sent(&played, 7.0, 13.0);
    let longest = all.windows(2).map(|two| two[1].0 - two[0].0).fold(0.0, f64::max);
    assert!(longest < 0.0105, "{longest} s without a frame");
    let held = sent(&played, 8.5, 11.0);
    assert!(held.len() >= 249 && held.iter().all(|(_, at)| *at == held[0].1), "{} frames", held.len());
    assert!(errors_mm(&played, 15.0, 24.0, |at| at + 5.0) < 0.05);
}

#[test]
fn a_seat_that_is_held_for_a_seek_is_let_rest_once_the_film_is_stopped_or_lost_and_is_not_held_anew() {
    for state in [FilmState::Stopped, FilmState::Lost, FilmState::Unusable] {
        let played = play(vec![
            film(0.5, 0.5, 1.0, FilmState::Locked),
            film(8.0, 8.0, 1.0, FilmState::Jumped),
            film(9.0, 8.0, 0.0, state),
            film(12.0, 8.0, 0.0, FilmState::Jumped),
            film(14.0, 8.0, 1.0, FilmState::Locked),
        ]);
        assert!(sent(&played, 8.5, 9.0).len() >= 49, "{state:?}");
        assert_eq!(
            sent(&played, 9.2, 13.9).len(),
            0,
            "a frame would take back what was moved by hand: {state:?}"
        );
        assert!(errors_mm(&played, 18.0, 30.0, |at| at - 6.0) < 0.05, "{state:?}");
    }
}

#[test]
fn a_film_that_ends_parks_the_seats_and_a_show_that_it_never_led_moves_none() {
    for (ends_s, ending) in [(8.0, Ending::Stopped), (29.0, Ending::Completed)] {
        let played =
            play(vec![film(0.5, 0.5, 1.0, FilmState::Locked), film(ends_s, ends_s, 0.0, FilmState::Ended)]);
        let parked = played.frames.last().unwrap().request.positions[0].0;
        assert_eq!((played.ended.ending, parked), (ending, 0), "it ends at {ends_s} s of {LENGTH}");
    }
    let absent = Virtual { script: vec![(900, Event::Leave)], ..chasing() }.play();
    assert_eq!((absent.frames.len(), absent.ended.ending), (0, Ending::Stopped));
    let lost = play(vec![
        film(0.5, 0.5, 1.0, FilmState::Locked),
        film(8.0, 8.0, 1.0, FilmState::Lost),
        (1_500, Event::Leave),
    ]);
    assert_eq!(lost.frames.last().unwrap().request.positions[0].0, 0, "it parks from where it rests");
}

fn any_state() -> impl Strategy<Value = FilmState> {
    prop_oneof![
        6 => Just(FilmState::Locked),
        1 => prop::sample::select(FilmState::ALL.to_vec()),
    ]
}

fn any_film() -> impl Strategy<Value = (f64, f64, f64, FilmState)> {
    let rate = prop_oneof![4 => 0.998..1.002_f64, 1 => -2.0..3.0_f64, 1 => Just(f64::NAN)];
    (0.0..40.0_f64, -15.0..40.0_f64, rate, any_state())
}

fn anybody() -> impl Strategy<Value = Event> {
    prop_oneof![
        2 => (1..1_500_u64).prop_map(|ms| Event::Late(std::time::Duration::from_millis(ms))),
        1 => (0..60_u32).prop_map(Event::SlowPlanner),
        1 => Just(Event::Ask(Transition::Pause)),
        2 => Just(Event::Ask(Transition::Resume)),
        1 => (0..30_000_i64).prop_map(|ms| Event::Seek(ShowTime::from_millis(ms))),
        2 => (-500..500_i32).prop_map(Event::Trim),
        1 => Just(Event::Stop),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn whatever_is_said_of_the_film_and_whoever_leads_beside_it_the_limiter_has_nothing_to_do(
        films in prop::collection::vec(any_film(), 1..8),
        others in prop::collection::vec((0..4_000_u64, anybody()), 0..4),
    ) {
        let mut script: Vec<(u64, Event)> = films
            .into_iter()
            .map(|(at_s, media_s, rate, state)| film(at_s, media_s, rate, state))
            .chain(others)
            .chain([(5_000, Event::Ask(Transition::Park)), (6_500, Event::Leave)])
            .collect();
        script.sort_by_key(|(at, _)| *at);
        let played = Virtual { script, ..chasing() }.play();
        prop_assert_eq!(played.clamps[0].worst, None);
        prop_assert!(played.ended.ending != Ending::Fault);
    }
}
