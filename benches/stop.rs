//! How long a stop takes to reach the seats: from the request to the first decelerating frame of every one of 64
//! controllers, at 100 and 1,000 Hz in real time on loopback, under a flood of everything else that a show can be told.
//!
//! `cargo bench --bench stop -- [--rounds N] [--stops N]`
//!
//! Each stop ends a play of its own. The first decelerating frame is told by its outputs: a stop takes the effects away in
//! that very frame, and what a deceleration has gone after a millisecond is less than a pulse. That the seats do come to
//! rest is held to as well.

mod common {
    pub(crate) mod spread;
}
#[expect(dead_code, reason = "of the senders, only the controllers that answer them are wanted here")]
mod senders {
    pub(super) mod again;
    pub(super) mod children;
    pub(super) mod outcome;
    pub(super) mod peer;
}
mod stops {
    pub(super) mod flood;
    pub(super) mod play;
    pub(super) mod watch;
}

use std::time::Duration;

use common::spread::{Spread, verdict};
use senders::children::Peer;
use senders::peer;
use stops::play::{Stop, stop};

const CONTROLLERS: usize = 64;
const RATES_HZ: [f64; 2] = [100.0, 1000.0];
/// What may come on top of one period.
const ALLOWANCE_MS: f64 = 1.0;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    if let ["peer", count] = words[..] {
        return peer::run(count.parse().expect("a number of controllers"));
    }
    let (rounds, stops) = (option(&words, "--rounds").unwrap_or(5), option(&words, "--stops").unwrap_or(12));
    let peers = Peer::start(CONTROLLERS);
    println!(
        "request to first decelerating frame, {CONTROLLERS} controllers, {rounds} rounds of {stops} stops: \
         median of the rounds (least..most)"
    );
    for rate_hz in RATES_HZ {
        let mut chance = 1;
        let mut stops_of_a_round = || -> Vec<Stop> {
            let each = std::iter::repeat_with(|| stop(rate_hz, &peers.addresses, somewhen(&mut chance)));
            each.flatten().take(stops).collect()
        };
        let rounds: Vec<Vec<Stop>> = (0..rounds).map(|_| stops_of_a_round()).collect();
        tell(rate_hz, &rounds);
    }
}

/// An instant after tick 0 with the seats on their way, anywhere in a period.
fn somewhen(chance: &mut u64) -> Duration {
    // Knuth's linear congruence: the same instants in every run.
    *chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    Duration::from_millis(400) + Duration::from_nanos((*chance >> 11) % 200_000_000)
}

fn tell(rate_hz: f64, rounds: &[Vec<Stop>]) {
    let period_ms = 1e3 / rate_hz;
    let all: Vec<&Stop> = rounds.iter().flatten().collect();
    println!("\n{rate_hz} Hz: tick thread {}, goal {} ms", all[0].policy, period_ms + ALLOWANCE_MS);
    println!("{:<22} {:>24} {:>24} {:>24}", "", "p50 ms", "p90 ms", "greatest ms");
    let line = |name: &str, took: fn(&Stop) -> f64| {
        let columns = [50, 90, 100].map(|share| spread(rounds, share, took));
        let [p50, p90, most] = columns.map(|spread| spread.to_string());
        println!("{name:<22} {p50:>24} {p90:>24} {most:>24}");
        columns
    };
    line("first controller", |stop| stop.first_ms);
    let last = line("last controller", |stop| stop.last_ms);
    let goal = period_ms + ALLOWANCE_MS;
    println!(
        "last controller, in periods: p50 {:.2}, greatest {:.2}; greatest <= {goal} ms: {}; {} of {} stops later",
        last[0].median / period_ms,
        last[2].median / period_ms,
        verdict(last[2], goal),
        all.iter().filter(|stop| stop.last_ms > goal).count(),
        all.len(),
    );
    let sum = |count: fn(&Stop) -> u64| all.iter().map(|stop| count(stop)).sum::<u64>();
    println!(
        "flood: {} commands taken, {} found the mailbox full, {} settings; {} of {} ticks missed",
        sum(|stop| stop.flood.taken),
        sum(|stop| stop.flood.full),
        sum(|stop| stop.flood.settings),
        sum(|stop| stop.missed),
        sum(|stop| stop.missed + stop.ticks),
    );
}

/// One percentile of each round.
fn spread(rounds: &[Vec<Stop>], share: usize, took: fn(&Stop) -> f64) -> Spread {
    Spread::of(rounds.iter().map(|stops| {
        let mut took: Vec<f64> = stops.iter().map(took).collect();
        took.sort_by(f64::total_cmp);
        took[(took.len() * share / 100).min(took.len() - 1)]
    }))
}

fn option(words: &[&str], name: &str) -> Option<usize> {
    let value = words.iter().skip_while(|word| **word != name).nth(1)?;
    Some(value.parse().unwrap_or_else(|_| panic!("{value:?} is not a number that can be used here")))
}
