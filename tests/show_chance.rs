//! Shows by chance: any gentle cue, any rate, gaps, stalls, a slow planner and a stop, in virtual time. Whatever happens, the
//! seat is never asked for more than its limits.

mod common;

use std::fmt::Write as _;
use std::time::Duration;

use common::{Event, Played, Virtual, Worst};
use kinocue::engine::Ending;
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
        1 => Just(Event::Stop),
    ]
}

/// What the seat was made to do between the stalls: after each the controller stands at the last pose.
fn worst(played: &Played) -> Worst {
    let period = played.rate.period();
    let tick = |frame: &common::Frame| {
        (frame.at.since(common::ORIGIN) + Duration::from_nanos(50)).div_duration_f64(period).floor()
    };
    let stalled = |pair: &[common::Frame]| {
        let missed = tick(&pair[1]) - tick(&pair[0]) - 1.0;
        period.mul_f64(missed.max(0.0)) > period.max(Duration::from_millis(50))
    };
    let mut starts: Vec<usize> = played
        .frames
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| stalled(pair))
        .map(|(at, _)| at + 1)
        .collect();
    starts.push(played.frames.len());
    let mut worst = played.worst_until(starts[0]);
    for part in starts.windows(2) {
        worst = worst.max(played.worst_from_rest(part[0], part[1]));
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_the_seat_stays_within_its_limits(
        waves in waves(),
        rate in prop_oneof![Just(50.0), Just(100.0), Just(120.0), Just(333.0), Just(1000.0)],
        events in prop::collection::vec((0.0..1.1_f64, event()), 0..6),
        absolute in any::<bool>(),
        plays in 1..3_u32,
    ) {
        let mut show = Virtual::new(waves.cue()).at_rate(rate);
        show.timing = if absolute { Timing::Absolute } else { Timing::Relative };
        show.plays = plays;
        for (share, event) in events {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousands")]
            let wake_up = (share * f64::from(waves.seconds) * rate) as u64;
            show = show.with(wake_up, event);
        }
        let played = show.play();
        if played.frames.is_empty() {
            prop_assert_eq!(played.ended.ending, Ending::Stopped, "stopped before anything was sent");
            return Ok(());
        }
        let Worst { velocity, acceleration, jerk, step } = worst(&played);
        prop_assert!(
            velocity <= 1.01 && acceleration <= 1.01 && jerk <= 1.01 && step <= 1.01,
            "{velocity} {acceleration} {jerk} {step}"
        );
        prop_assert!(played.ended.ending != Ending::Fault);
        let last = played.frames.last().expect("there are frames");
        prop_assert_eq!((last.request.positions[0].0, last.request.outputs), (0, 0), "it ends parked");
        // One frame for each tick that sent, each with the next number.
        prop_assert_eq!(played.frames.len() as u64, played.ended.ticks);
        prop_assert!(played.frames.iter().zip(1..).all(|(frame, number)| frame.request.frame.0 == number));
    }
}
