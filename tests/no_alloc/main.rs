//! The tick thread allocates and frees nothing: the real loop over real sockets, ten thousand ticks and more in virtual
//! time with acks arriving, from the join through laps, missed ticks, a stall and all that it can be told, into park,
//! under an allocator that counts each thread's calls.

mod counting;
mod stage;

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use counting::Calls;
use kinocue::harness::config::LossPolicy;
use kinocue::harness::engine::{Ending, Mix};
use kinocue::harness::film::chase::{Chase, ChaseInput, ChaseRules, ChaseVerdict, FilmLeave};
use kinocue::harness::film::point::{ChasedFilm, FilmPoint, FilmState, PublishedPoint};
use kinocue::harness::health::{Groups, HealthTable, Notice};
use kinocue::harness::motion::MAX_AXES;
use kinocue::harness::rt::{Alarm, News};
use kinocue::harness::state::{Event, Machine, PlayMode, State, Transition, Why};
use kinocue::harness::time::{MonoTime, ShowTime, Tick};
use kinocue::wire::FrameNo;
use stage::{CONTROLLERS, Deed, Outcome, PERIOD, play};

const NOTHING: Calls = Calls { allocations: 0, frees: 0, held: 0 };

/// Plays ten thousand ticks with that spin, in which `missed` are missed.
fn assert_quiet(spin: Duration, missed: u64) {
    // A lag that is slewed away, and one after which the lanes hold and join again.
    let script = [(3_000, Deed::Oversleep(3)), (5_000, Deed::Oversleep(80)), (10_000, Deed::Leave)];
    let Outcome { ended, calls, laps, accounts, .. } = play(&script, false, spin);
    assert_eq!(calls, NOTHING);
    assert!(ended.ticks > 10_000 && laps >= 3, "{ended:?}, {laps} laps");
    assert_eq!((ended.missed, ended.ending, ended.unposted), (missed, Ending::Stopped, 0));
    for controller in 0..CONTROLLERS {
        let counts = accounts.books.tracker().counts(controller);
        assert_eq!((counts.sent, counts.asked, counts.acked), (ended.ticks, ended.ticks, ended.ticks));
        assert_eq!((counts.refused(), counts.lost, counts.duplicate, counts.stray), (0, 0, 0, 0));
    }
    assert_eq!(accounts.lateness.len(), ended.ticks);
}

#[test]
fn ten_thousand_ticks_neither_allocate_nor_free() {
    assert_quiet(Duration::ZERO, 83);
}

#[test]
fn nor_do_they_where_the_rest_of_each_wait_is_spun() {
    // Who oversleeps from before the deadline on misses one tick less.
    assert_quiet(Duration::from_micros(100), 81);
}

/// Everything that the tick thread can be told, each with time to do it.
fn everything() -> Vec<(u64, Deed)> {
    let ask = Deed::Ask;
    let mut found = [0.0; MAX_AXES];
    found[..3].copy_from_slice(&[0.2, 0.5, 0.3]);
    vec![
        (1_700, ask(Transition::Pause)),
        (2_100, Deed::Seek(ShowTime::from_millis(1_000))),
        (2_200, ask(Transition::Resume)),
        (2_300, ask(Transition::Pause)), // in the middle of the join
        (2_700, ask(Transition::Resume)),
        (4_500, Deed::Seek(ShowTime::from_millis(500))),
        (4_600, Deed::Seek(ShowTime::from_millis(200))),
        (6_400, Deed::Mix(0, Mix { motion: 0.4, vibration: 0.5, ..Mix::FULL })),
        (6_500, Deed::Trim(60)),
        (6_600, Deed::Mix(1, Mix { on: false, ..Mix::FULL })),
        (9_000, Deed::Mix(1, Mix::FULL)),
        (9_010, Deed::Found(1, [0.0; MAX_AXES])),
        (9_100, Deed::Trim(-500)),
        (11_500, Deed::See(Alarm::Leave(1))),
        (12_000, Deed::Found(1, found)),
        (14_500, Deed::See(Alarm::Cut(1))),
        (14_600, Deed::Found(1, found)),
        (17_000, Deed::Oversleep(80)),
        (17_010, Deed::Stop),
        (17_500, ask(Transition::Resume)), // refused: a stop is latched
        (17_550, Deed::Load),
        (17_600, ask(Transition::Clear)),
        (17_700, Deed::See(Alarm::Event(Event::PositionsRead))),
        (17_800, ask(Transition::Park)),
    ]
}

#[test]
fn commands_alarms_levels_and_a_stop_neither_allocate_nor_free_on_the_tick_thread() {
    let Outcome { ended, calls, accounts, news, .. } = play(&everything(), true, Duration::ZERO);
    assert_eq!(calls, NOTHING);
    assert_eq!((ended.missed, ended.unposted), (80, 0), "{ended:?}");
    let states: Vec<State> = news.iter().filter_map(entered).collect();
    let following = State::Playing(PlayMode::Following);
    for state in [following, State::Paused, State::Stopping, State::Stopped, State::Recovering, State::Parked]
    {
        assert!(states.contains(&state), "{state:?} of {states:?}");
    }
    let refused: Vec<Why> = news.iter().filter_map(refusal).collect();
    assert_eq!(refused, [Why::Latched]);
    let counts = [0, 1].map(|controller| accounts.books.tracker().counts(controller));
    assert!(counts[1].sent + 200 < counts[0].sent, "the second was away for a while: {counts:?}");
    for counts in counts {
        assert_eq!((counts.sent, counts.asked), (counts.acked, counts.acked));
    }
}

#[test]
fn a_show_that_chases_a_film_neither_allocates_nor_frees_on_the_tick_thread() {
    let film =
        |at: u64, media_ms: i64, rate, state| (at, Deed::Film(ShowTime::from_millis(media_ms), rate, state));
    let script = [
        film(100, -5_000, 1.000_3, FilmState::Locked), // seats join, and wait for the cue
        film(3_100, -1_965, 1.000_3, FilmState::Locked), // a frame off: slewed
        (5_000, Deed::Trim(40)),
        film(6_000, 900, 0.0, FilmState::Stopped),
        film(7_000, 900, 1.0, FilmState::Locked),
        film(9_500, 500, 1.0, FilmState::Locked), // it jumps: they hold, and join
        (10_500, Deed::Oversleep(3)),
        (11_000, Deed::Oversleep(80)),
        film(12_000, 2_900, 1.0, FilmState::Ended),
    ];
    let Outcome { ended, calls, news, .. } = play(&script, false, Duration::ZERO);
    assert_eq!(calls, NOTHING);
    let states: Vec<State> = news.iter().filter_map(entered).collect();
    let of = |mode| states.iter().filter(|state| **state == State::Playing(mode)).count();
    assert!(of(PlayMode::Joining) >= 3 && of(PlayMode::Following) >= 1, "{states:?}");
    assert!(
        ended.ticks > 10_000 && states.ends_with(&[State::Parking, State::Parked]),
        "{ended:?}, {states:?}"
    );
}

fn entered(news: &News) -> Option<State> {
    match news {
        News::Entered { state, .. } => Some(*state),
        _ => None,
    }
}

fn refusal(news: &News) -> Option<Why> {
    match news {
        News::Refused(refusal) => Some(refusal.why),
        _ => None,
    }
}

#[test]
fn the_allocator_counts_its_own_thread_and_no_other() {
    let before = Calls::so_far();
    drop(std::hint::black_box(Box::new(1)));
    assert_eq!(Calls::so_far().since(before), Calls { allocations: 1, frees: 1, held: 0 });
    let there = thread::spawn(|| {
        let before = Calls::so_far();
        let mut grown = std::hint::black_box(vec![1_u8; 1]);
        grown.reserve_exact(100);
        Calls::so_far().since(before)
    });
    let here = Calls::so_far();
    while !there.is_finished() {
        thread::yield_now();
    }
    assert_eq!(Calls::so_far(), here);
    assert_eq!(there.join().unwrap(), Calls { allocations: 2, frees: 1, held: 101 });
}

#[test]
fn the_state_of_the_hall_and_the_health_of_its_groups_need_no_memory_after_the_start() {
    let mut now = MonoTime::default() + PERIOD;
    let mut hall = Machine::new(now);
    let mut health = HealthTable::new(Groups::named(["A", "A", "B"]), LossPolicy::Park, 1, PERIOD);
    let mut notices = 0;
    let before = Calls::so_far();
    for tick in 1..=10_000_u32 {
        now = now + PERIOD;
        for controller in 0..3 {
            health.on_sent(controller, FrameNo(tick), true, now);
            if tick < 5_000 && tick % 7 > 0 {
                health.on_ack(controller, FrameNo(tick), now);
            }
        }
        health.tick(now, &mut |notice| {
            notices += 1;
            if let Notice::Hall(event) = notice {
                hall.event(event, now);
            }
        });
        hall.event(Event::Late, now);
        let _refused = hall.request(Transition::Go, now);
        hall.tick(now);
    }
    assert_eq!(Calls::so_far().since(before), Calls { allocations: 0, frees: 0, held: 0 });
    assert!(notices > 2, "groups were lost");
}

#[test]
fn what_leads_seats_by_a_film_allocates_nothing() {
    let published = Arc::new(PublishedPoint::default());
    let mut clock = ChasedFilm::new(Arc::clone(&published));
    let frame = Duration::from_millis(10);
    let mut chase = Chase::new(ChaseRules::until(ShowTime::from_millis(600_000)), MonoTime::default());
    let (mut followed, mut held) = (0, 0);
    let before = Calls::so_far();
    for index in 0..10_000_u32 {
        let deadline = MonoTime::default() + frame * (index + 1);
        // Now and then it is stopped, and each time it goes on it is a little off.
        let state = if index % 2_000 < 100 { FilmState::Stopped } else { FilmState::Locked };
        let media = ShowTime::ZERO + frame * index + Duration::from_millis(u64::from(index % 30));
        published.publish(&FilmPoint { at: deadline, media, rate: 1.000_3, epoch: index / 2_000, state });
        let tick = Tick { index: index.into(), deadline, late: Duration::ZERO, missed: 0 };
        let point = clock.at(&tick);
        match chase.tick(&ChaseInput { tick: &tick, frame, point, trim_ms: 40, leave: FilmLeave::Lead }) {
            ChaseVerdict::Follow { .. } => followed += 1,
            ChaseVerdict::Hold(_) => held += 1,
            ChaseVerdict::Wait | ChaseVerdict::Park(_) => {}
        }
    }
    assert_eq!(Calls::so_far().since(before), NOTHING);
    assert!(followed > 9_000 && held > 300, "{followed} followed, {held} held");
}
