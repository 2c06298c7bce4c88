//! Shows by chance: any gentle cue, any rate, gaps, stalls, a slow planner and a stop, in virtual time. Whatever happens, the
//! seat is never asked for more than its limits.

mod common;

use std::fmt::Write as _;
use std::time::Duration;

use common::{Event, Played, Virtual, Worst};
use kinocue::engine::{Ending, Mix};
use kinocue::motion::MAX_AXES;
use kinocue::rt::Order;
use kinocue::time::ShowTime;
use kinocue::wire::Timing;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Two waves about the middle of the stroke, each with its share of what the seat can do.
#[derive(Debug, Clone)]
struct Waves {
    seconds: u32,
    /// Frequency, Hz, phase in turns, and share of the greatest swing at that frequency.
    waves: [(f64, f64, f64); 2],
}

impl Waves {
    fn cue(&self) -> String {
        let mut text = "time_ms,a1\n".to_owned();
        for row in 0..=50 * self.seconds {
            let t = f64::from(row) * 0.02;
            let at = |(hz, phase, share): (f64, f64, f64)| {
                share * greatest_swing(hz) * ((t * hz + phase) * std::f64::consts::TAU).sin()
            };
            let sum: f64 = self.waves.into_iter().map(at).sum();
            writeln!(text, "{},{:.7}", row * 20, 0.5 + sum).expect("a String takes what is written to it");
        }
        text
    }
}

/// The swing of a sine at which a bench seat reaches its first limit, fraction of the stroke.
fn greatest_swing(hz: f64) -> f64 {
    let w = hz * std::f64::consts::TAU;
    (240.0 / w).min(3_000.0 / (w * w)).min(60_000.0 / (w * w * w)).min(75.0) / 150.0
}

fn waves() -> impl Strategy<Value = Waves> {
    let wave = (0.1..1.5_f64, 0.0..1.0_f64, 0.05..0.45_f64);
    (3..12_u32, [wave.clone(), wave]).prop_map(|(seconds, waves)| Waves { seconds, waves })
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        4 => (1..45_u64).prop_map(|ms| Event::Late(Duration::from_millis(ms))),
        1 => (51..3_000_u64).prop_map(|ms| Event::Late(Duration::from_millis(ms))),
        1 => (0..60_u32).prop_map(Event::SlowPlanner),
        1 => Just(Event::Leave),
    ]
}

/// What operators, and those who watch the controllers, may do at any instant.
fn lead() -> impl Strategy<Value = Event> {
    let pose = |place: f64| [place; MAX_AXES];
    prop_oneof![
        1 => Just(Event::Stop),
        2 => Just(Event::Order(Order::Pause)),
        3 => Just(Event::Order(Order::Resume)),
        1 => Just(Event::Order(Order::Park)),
        3 => (0..14_000_i64).prop_map(|ms| Event::Order(Order::Seek(ShowTime::from_millis(ms)))),
        3 => (-600..600_i32).prop_map(Event::Trim),
        4 => (0.0..1.0_f64).prop_map(|motion| Event::Mix(0, Mix { motion, ..Mix::FULL })),
        1 => any::<bool>().prop_map(|on| Event::Mix(0, Mix { on, ..Mix::FULL })),
        1 => Just(Event::Order(Order::Leave(0))),
        1 => Just(Event::Order(Order::Cut(0))),
        2 => (0.0..1.0_f64).prop_map(move |place| Event::Order(Order::ComeBack(0, pose(place)))),
    ]
}

/// What the seat was made to do between the gaps: after each the controller stands at the last pose, or, where it is back,
/// where it was read, mm.
fn worst(played: &Played, back: &[f64]) -> Worst {
    let mm = played.positions_mm(0, 0);
    let period = played.rate.period();
    let tick = |frame: &common::Frame| {
        (frame.at.since(common::ORIGIN) + Duration::from_nanos(50)).div_duration_f64(period).floor()
    };
    let is_gap = |pair: &[common::Frame]| {
        let missed = tick(&pair[1]) - tick(&pair[0]) - 1.0;
        period.mul_f64(missed.max(0.0)) > period.max(Duration::from_millis(50))
    };
    let mut worst = Worst::default();
    let (mut start, mut rest) = (0, 0.0);
    for (at, _) in played.frames.windows(2).enumerate().filter(|(_, pair)| is_gap(pair)) {
        worst = worst.max(played.worst_from_rest_at(rest, start, at + 1));
        let (last, next) = (mm[at], mm[at + 1]);
        // Nearest of those it may stand at; it has hardly begun to move.
        let near = |a: &f64, b: &f64| (a - next).abs().total_cmp(&(b - next).abs());
        rest = back.iter().copied().chain([last]).min_by(near).unwrap_or(last);
        start = at + 1;
    }
    worst.max(played.worst_from_rest_at(rest, start, mm.len()))
}

/// The show of these waves at which the events happen, each at its share of the cue's length.
fn show(waves: &Waves, rate: f64, events: Vec<(f64, Event)>) -> Virtual {
    let mut show = Virtual::new(waves.cue()).at_rate(rate);
    for (share, event) in events {
        show = show.with(wake_up(waves, rate, share), event);
    }
    show
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousands")]
fn wake_up(waves: &Waves, rate: f64, share: f64) -> u64 {
    (share * f64::from(waves.seconds) * rate) as u64
}

fn rate() -> impl Strategy<Value = f64> {
    prop_oneof![Just(50.0), Just(100.0), Just(120.0), Just(333.0), Just(1000.0)]
}

fn is_within(worst: Worst) -> bool {
    let Worst { velocity, acceleration, jerk, step } = worst;
    velocity <= 1.01 && acceleration <= 1.01 && jerk <= 1.01 && step <= 1.01
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_the_seat_stays_within_its_limits(
        waves in waves(),
        rate in rate(),
        events in prop::collection::vec((0.0..1.1_f64, event()), 0..6),
        absolute in any::<bool>(),
        plays in 1..3_u32,
    ) {
        let mut show = show(&waves, rate, events);
        show.timing = if absolute { Timing::Absolute } else { Timing::Relative };
        show.plays = plays;
        let played = show.play();
        if played.frames.is_empty() {
            prop_assert_eq!(played.ended.ending, Ending::Stopped, "stopped before anything was sent");
            return Ok(());
        }
        prop_assert!(is_within(worst(&played, &[])), "{:?}", worst(&played, &[]));
        prop_assert!(played.ended.ending != Ending::Fault);
        let last = played.frames.last().expect("there are frames");
        prop_assert_eq!((last.request.positions[0].0, last.request.outputs), (0, 0), "it ends parked");
        // One frame for each tick that sent, each with the next number.
        prop_assert_eq!(played.frames.len() as u64, played.ended.ticks);
        prop_assert!(played.frames.iter().zip(1..).all(|(frame, number)| frame.request.frame.0 == number));
    }

    #[test]
    fn whoever_leads_it_however_the_seat_stays_within_its_limits_and_can_be_parked(
        waves in waves(),
        rate in rate(),
        events in prop::collection::vec((0.0..1.2_f64, prop_oneof![3 => lead(), 1 => event()]), 0..12),
    ) {
        let has = |what: fn(&Event) -> bool| events.iter().any(|(_, event)| what(event));
        let given_up = has(|event| matches!(event, Event::Order(Order::Leave(_) | Order::Cut(_))))
            || has(|event| matches!(event, Event::Stop)) && has(|event| matches!(event, Event::Leave));
        let read = |(_, event): &(f64, Event)| match event {
            Event::Order(Order::ComeBack(_, pose)) => Some(150.0 * pose[0]),
            _ => None,
        };
        let back: Vec<f64> = events.iter().filter_map(read).chain([75.0]).collect();
        let mut show = show(&waves, rate, events);
        // Whatever state that left it in: back, and parked.
        let end = [1.3, 1.31, 1.8, 1.9].map(|share| wake_up(&waves, rate, share));
        show = show
            .with(end[0], Event::Order(Order::ComeBack(0, [0.5; MAX_AXES])))
            .with(end[1], Event::Order(Order::Park))
            .with(end[2], Event::Order(Order::Resume))
            .with(end[3], Event::Order(Order::Park));
        let played = show.play();
        if played.frames.is_empty() {
            return Ok(());
        }
        prop_assert!(is_within(worst(&played, &back)), "{:?}", worst(&played, &back));
        prop_assert!(played.ended.ending != Ending::Fault);
        let last = played.frames.last().expect("there are frames");
        prop_assert_eq!(last.request.outputs, 0);
        // A controller that was given up, or stopped before the play was left, stands where it was.
        if !given_up {
            prop_assert_eq!(last.request.positions[0].0, 0, "it ends parked");
        }
        prop_assert!(played.frames.iter().zip(1..).all(|(frame, number)| frame.request.frame.0 == number));
    }
}
