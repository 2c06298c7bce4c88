//! Shows by chance: any gentle cue, any rate, gaps, stalls, a slow planner and a stop, in virtual time. Whatever happens, the
//! seat is never asked for more than its limits.

use std::fmt::Write as _;
use std::time::Duration;

use kinocue::harness::engine::{Ending, Mix};
use kinocue::harness::motion::MAX_AXES;
use kinocue::harness::rt::Alarm;
use kinocue::harness::state::{self, Transition};
use kinocue::harness::time::{MonoTime, ShowTime};
use kinocue::harness::{Event, Played, Virtual, Worst};
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
        // After a longer one somebody has to resume.
        1 => (51..1_900_u64).prop_map(|ms| Event::Late(Duration::from_millis(ms))),
        1 => (0..60_u32).prop_map(Event::SlowPlanner),
        1 => Just(Event::Leave),
    ]
}

/// What operators, and those who watch the controllers, may do at any instant.
fn lead() -> impl Strategy<Value = Event> {
    prop_oneof![
        1 => Just(Event::Stop),
        2 => Just(Event::Ask(Transition::Pause)),
        3 => Just(Event::Ask(Transition::Resume)),
        1 => Just(Event::Ask(Transition::Park)),
        3 => (0..14_000_i64).prop_map(|ms| Event::Seek(ShowTime::from_millis(ms))),
        3 => (-600..600_i32).prop_map(Event::Trim),
        4 => (0.0..1.0_f64).prop_map(|motion| Event::Mix(0, Mix { motion, ..Mix::FULL })),
        1 => any::<bool>().prop_map(|on| Event::Mix(0, Mix { on, ..Mix::FULL })),
    ]
}

/// What the seat was made to do between the gaps: after each the controller stands at the last pose or, where it was back
/// meanwhile, where it was read.
fn worst(played: &Played) -> Worst {
    let mm = played.positions_mm(0, 0);
    let period = played.rate.period();
    let tick = |frame: &kinocue::harness::Frame| {
        (frame.at.since(kinocue::harness::ORIGIN) + Duration::from_nanos(50)).div_duration_f64(period).floor()
    };
    let is_gap = |first: usize| {
        let missed = tick(&played.frames[first]) - tick(&played.frames[first - 1]) - 1.0;
        period.mul_f64(missed.max(0.0)) > period.max(Duration::from_millis(50))
    };
    let read_before = |first: usize| {
        let since = first.checked_sub(1).map_or(MonoTime::default(), |last| played.frames[last].at);
        let between = |at: MonoTime| at > since && at <= played.frames[first].at;
        played.happened.iter().find_map(|(at, event)| match event {
            Event::Found(_, pose) if between(*at) => Some(150.0 * pose[0]),
            _ => None,
        })
    };
    let mut worst = Worst::default();
    let (mut start, mut rest) = (0, read_before(0).unwrap_or(0.0));
    for first in (1..mm.len()).filter(|&first| is_gap(first)) {
        worst = worst.max(played.worst_from_rest_at(rest, start, first));
        (start, rest) = (first, read_before(first).unwrap_or(mm[first - 1]));
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
        prop_assert!(is_within(worst(&played)), "{:?}", worst(&played));
        prop_assert_eq!(played.clamps[0].worst, None, "the limiter has nothing to do");
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
        loss in prop::option::of((0.0..0.9_f64, any::<bool>(), 0.0..1.0_f64)),
    ) {
        let has = |what: fn(&Event) -> bool| events.iter().any(|(_, event)| what(event));
        let is_left = has(|event| matches!(event, Event::Leave));
        let is_stopped = has(|event| matches!(event, Event::Stop));
        let mut show = show(&waves, rate, events);
        if let Some((share, at_once, place)) = loss {
            let order = if at_once { Alarm::Cut(0) } else { Alarm::Leave(0) };
            show = show.with(wake_up(&waves, rate, share), Event::Alarm(order));
            let back = Event::Found(0, [place; MAX_AXES]);
            show = show.with(wake_up(&waves, rate, share + 0.35), back);
        }
        // Whatever state that left it in, a person clears it, and parks.
        let read = Event::Alarm(Alarm::Event(state::Event::PositionsRead));
        show = show
            .with(wake_up(&waves, rate, 1.31), Event::Ask(Transition::Park))
            .with(wake_up(&waves, rate, 1.4), Event::Ask(Transition::Clear))
            .with(wake_up(&waves, rate, 1.45), read)
            .with(wake_up(&waves, rate, 1.5), Event::Ask(Transition::Park))
            .with(wake_up(&waves, rate, 1.8), Event::Ask(Transition::Resume))
            .with(wake_up(&waves, rate, 1.9), Event::Ask(Transition::Park));
        let played = show.play();
        if played.frames.is_empty() {
            return Ok(());
        }
        prop_assert!(is_within(worst(&played)), "{:?}", worst(&played));
        prop_assert_eq!(played.clamps[0].worst, None, "the limiter has nothing to do");
        prop_assert!(played.ended.ending != Ending::Fault);
        let last = played.frames.last().expect("there are frames");
        prop_assert_eq!(last.request.outputs, 0);
        // Given up until after the end, or stopped and then left, it stands where it was.
        if loss.is_none() && !(is_left && is_stopped) {
            prop_assert_eq!(last.request.positions[0].0, 0, "it ends parked");
        }
        prop_assert!(played.frames.iter().zip(1..).all(|(frame, number)| frame.request.frame.0 == number));
    }
}
