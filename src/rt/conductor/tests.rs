use std::collections::BTreeSet;

use super::*;
use crate::film::chase::ChaseRules;
use crate::film::point::FilmState;
use crate::harness::{Event as Act, Played, Virtual, swell};

#[test]
fn a_signal_to_end_is_left_to_the_keeper_for_half_a_second_and_then_heeded_without_one() {
    let ms = |ms: u64| MonoTime::from_nanos(ms * 1_000_000);
    let mut conductor = Conductor::of_a_hall(ms(0));
    let asked = [(100, false), (1_000, true), (1_499, true), (1_500, true)];
    let heard = asked.map(|(at, asked)| {
        let first = asked && conductor.hears_first_of_the_end();
        (first, conductor.is_ended(asked, ms(at)))
    });
    let first_heard = [(false, false), (true, false), (false, false), (false, true)];
    assert_eq!(heard, first_heard, "whoever leads the hall is woken once");
}

/// The states that a play was in, each since when.
fn states(played: &Played) -> Vec<(State, Cause, MonoTime)> {
    let entered = |news: &News| match news {
        News::Entered { state, cause, at, .. } => Some((*state, *cause, *at)),
        _ => None,
    };
    played.news.iter().filter_map(entered).collect()
}

fn film(tick: u64, media_s: f64, rate: f64, state: FilmState) -> (u64, Act) {
    (tick, Act::Film(ShowTime::from_secs_f64(media_s), rate, state))
}

/// A show that chases a film: that comes, is lost, jumps, stands and goes on; a late tick, a pause, and the way to park.
fn chased() -> Virtual {
    let script = vec![
        film(150, 5.0, 1.0, FilmState::Locked),
        (500, Act::Late(Duration::from_millis(150))),
        film(700, 30.0, 1.0, FilmState::Acquiring),
        film(730, 30.3, 1.0, FilmState::Locked),
        film(1_000, 33.0, 0.0, FilmState::Stopped),
        film(1_300, 33.0, 1.0, FilmState::Locked),
        (1_550, Act::Ask(Transition::Pause)),
        (1_700, Act::Ask(Transition::Resume)),
        (1_900, Act::Ask(Transition::Park)),
    ];
    Virtual { chases: true, script, at_most: 3_000, ..Virtual::new(swell(3, 60, 20.0, 0.1)) }
}

/// A show that is let go: a slow planner, a seek, a late tick, a pause, and the way to park.
fn let_go() -> Virtual {
    let script = vec![
        (100, Act::Ask(Transition::Go)),
        (400, Act::SlowPlanner(40)),
        (410, Act::Seek(ShowTime::from_secs_f64(30.0))),
        (700, Act::Late(Duration::from_millis(150))),
        (900, Act::Ask(Transition::Pause)),
        (1_000, Act::Ask(Transition::Resume)),
        (1_300, Act::Ask(Transition::Park)),
    ];
    Virtual { armed: true, script, at_most: 3_000, ..Virtual::new(swell(3, 60, 20.0, 0.1)) }
}

/// Of each of these shows, with that act at every thirtieth tick of it: in which state it met the hall, which the hall was in at the end,
/// and how long after the act that came.
fn at_each_tick(act: Act, ends: State) -> Vec<(State, Duration)> {
    let mut met = Vec::new();
    for (show, of) in [(chased as fn() -> Virtual, 2_000), (let_go, 1_400)] {
        for tick in (1..of).step_by(30) {
            let mut show = show();
            show.script.retain(|(at, _)| *at < tick);
            let played = show.with(tick, act).with(tick + 800, Act::Leave).play();
            let asked = played.happened.iter().rfind(|(_, had)| !matches!(had, Act::Leave));
            let Some((asked, _)) = asked.filter(|(_, had)| format!("{had:?}") == format!("{act:?}")) else {
                continue;
            };
            let states = states(&played);
            let before = states.iter().rfind(|(.., since)| since < asked).map_or(State::Armed, |of| of.0);
            let end = states.iter().find(|(state, _, since)| *state == ends && since >= asked);
            let took = end.map(|(.., since)| since.since(*asked));
            met.push((before, took.unwrap_or_else(|| panic!("at tick {tick}, {before}: {states:?}"))));
        }
    }
    met
}

const MET: [&str; 7] = ["armed", "waiting", "joining", "playing", "holding", "paused", "parking"];

#[test]
fn a_stop_or_a_park_at_any_moment_of_a_show_is_over_when_its_seats_rest_and_not_when_its_time_is() {
    for (act, ends, most_s) in
        [(Act::Stop, State::Stopped, 2), (Act::Ask(Transition::Park), State::Parked, 20)]
    {
        let met = at_each_tick(act, ends);
        for (before, took) in &met {
            assert!(*took < Duration::from_secs(most_s), "{act:?} while {before} took {took:?}");
        }
        let states: BTreeSet<_> = met.iter().map(|(before, ..)| before.word()).collect();
        assert_eq!(states, BTreeSet::from(MET));
    }
}

#[test]
fn seats_whose_first_frame_is_still_to_leave_are_stopped_or_parked_at_once_and_none_leaves() {
    for asked in [Transition::Stop, Transition::Park] {
        let now = MonoTime::from_nanos(1);
        let film = FilmLead::new(Arc::default(), ChaseRules::until(ShowTime::ZERO), now);
        for film in [None, Some(film)] {
            let mut engine = Virtual::new(swell(3, 60, 20.0, 0.1)).engine();
            let mut conductor = Conductor::of_a_play(now, true).chasing(film);
            engine.obey(Directive::Play); // as a show is that waits for its seats to be read
            conductor.request(asked, &mut engine, now).unwrap();
            conductor.watch(&mut engine, true, false, now);
            let ended = if asked == Transition::Stop { State::Stopped } else { State::Parked };
            assert_eq!(conductor.machine().state(), ended);
            assert!(engine.sends_nothing());
        }
    }
}
