//! What spinning before each tick brings and costs: kinocue's tick loop at 1,000 ticks a second, spinning for 0, 100 and 900
//! µs, to 1 and 64 controllers on loopback that take frames and say nothing.
//!
//! `cargo bench --bench spin -- [--rounds N] [--seconds S] [--quick]`: interleaved rounds, each spin against none of the same
//! round.
//!
//! `cargo bench --bench spin -- --throttle [--seconds S]`: whether the kernel's real-time throttle, which takes the
//! processor away for 50 ms, bites at 900 µs: 60 s with 1 and with 64 controllers, and every longer stall counted.
//!
//! Each sender runs in a process of its own, so that what it got of the system is its own.

mod common {
    pub(crate) mod spread;
}
mod senders {
    pub(super) mod again;
    pub(super) mod ours;
    pub(super) mod outcome;
    pub(super) mod stalls;
}

use std::net::{SocketAddr, SocketAddrV4, UdpSocket};
use std::time::Duration;

use common::spread::{Spread, verdict};
use kinocue::harness::rt::Spinning;
use kinocue::harness::sys::clock::Monotonic;
use senders::again::sender;
use senders::ours;
use senders::outcome::Outcome;
use senders::stalls::{Stalls, Watching, stolen};
use serde::{Deserialize, Serialize};

const PERIOD: Duration = Duration::from_millis(1);
/// How many controllers there are in turn.
const COUNTS: [usize; 2] = [1, 64];
/// How long is spun, µs; the first is what the others are held against.
const SPINS: [u64; 3] = [0, 100, 900];
/// With 100 µs, the 99th percentile over that without, and the share of a processor, %, at most.
const P99_GOAL: f64 = 0.5;
const SHARE_GOAL: f64 = 12.0;

/// What a spinning sender came back with.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Spun {
    outcome: Outcome,
    stalls: Stalls,
    /// What was left of the spin, µs, in the mean of all ticks.
    granted_us: f64,
    /// What the tick thread took of a processor, %.
    share: f64,
    /// What a hypervisor took away from all processors together meanwhile, ms.
    stolen_ms: f64,
}

type Figure = fn(&Spun) -> f64;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["spinning", spin_us, seconds, ref to @ ..] => spin(number(spin_us), number(seconds), to),
        _ if words.contains(&"--throttle") => throttle(option(&words, "--seconds").unwrap_or(60)),
        _ => compare(&words),
    }
}

/// The sender's process ends with what it found on stdout.
fn spin(spin_us: u64, seconds: u32, to: &[&str]) {
    let to: Vec<SocketAddrV4> = to.iter().map(|word| word.parse().expect("addresses")).collect();
    let spinning = Spinning::new(&Monotonic, Duration::from_micros(spin_us), PERIOD);
    let watching = Watching::new(&spinning, PERIOD);
    let stolen_before = stolen();
    let outcome = ours::run(&watching, seconds, &to, true);
    let stolen_ms = stolen().saturating_sub(stolen_before).as_secs_f64() * 1e3;
    let granted_us = spinning.spun().granted.as_secs_f64() * 1e6;
    #[expect(clippy::cast_precision_loss, reason = "a few million frames and ticks")]
    let share = {
        let ticked_us = (outcome.ticks + outcome.missed) as f64 * PERIOD.as_secs_f64() * 1e6;
        100.0 * outcome.send_us * outcome.sent as f64 / ticked_us
    };
    let spun = Spun { outcome, stalls: watching.stalls(), granted_us, share, stolen_ms };
    println!("{}", serde_json::to_string(&spun).expect("it has only names and numbers"));
}

/// Controllers that take frames and say nothing; nobody reads what waits in them, which costs the sender the same.
fn mute(count: usize) -> (Vec<UdpSocket>, Vec<SocketAddrV4>) {
    let sockets: Vec<_> =
        (0..count).map(|_| UdpSocket::bind("127.0.0.1:0").expect("loopback has a free port")).collect();
    let address = |socket: &UdpSocket| match socket.local_addr() {
        Ok(SocketAddr::V4(address)) => address,
        other => unreachable!("bound to an IPv4 address, not {other:?}"),
    };
    let addresses = sockets.iter().map(address).collect();
    (sockets, addresses)
}

fn spun(spin_us: u64, seconds: u32, to: &[SocketAddrV4]) -> Spun {
    sender(&["spinning", &spin_us.to_string(), &seconds.to_string()], to)
}

fn compare(words: &[&str]) {
    let quick = words.contains(&"--quick");
    let rounds: usize = option(words, "--rounds").unwrap_or(if quick { 2 } else { 5 });
    let seconds: u32 = option(words, "--seconds").unwrap_or(if quick { 2 } else { 8 });
    println!("1,000 ticks a second for {seconds} s, {rounds} interleaved rounds; all times in us");
    heading();
    for count in COUNTS {
        let (_open, to) = mute(count);
        let mut found: [Vec<Spun>; SPINS.len()] = Default::default();
        for round in 0..rounds {
            // Each is the first, the second and the last in turn.
            for place in (0..SPINS.len()).map(|step| (round + step) % SPINS.len()) {
                let one = spun(SPINS[place], seconds, &to);
                line(&(round + 1).to_string(), count, SPINS[place], &one);
                found[place].push(one);
            }
        }
        summary(count, &found);
    }
}

fn heading() {
    println!(
        "round    n spin granted |  lateness p50    p99  p99.9    max | missed stalls waiting longest steal, ms | cpu, % of a core"
    );
}

fn line(round: &str, count: usize, spin_us: u64, spun: &Spun) {
    let Spun { outcome, stalls, granted_us, share, stolen_ms } = spun;
    let Outcome { lateness, missed, policy, .. } = outcome;
    println!(
        "{round:>5} {count:>4} {spin_us:>4} {granted_us:>7.1} | {:>13.1} {:>6.1} {:>6.0} {:>6.0} | {missed:>6} {:>6} {:>7} {:>7.0} \
         {stolen_ms:>9.0} | {share:>6.1}  {policy}",
        lateness.p50,
        lateness.p99,
        lateness.p999,
        lateness.max,
        stalls.count,
        stalls.waiting,
        stalls.longest_us
    );
}

fn summary(count: usize, found: &[Vec<Spun>; SPINS.len()]) {
    println!("\n{count} controllers, median of the rounds (least..greatest)");
    let figures: [(&str, Figure); 3] = [
        ("lateness p50", |one| one.outcome.lateness.p50),
        ("lateness p99", |one| one.outcome.lateness.p99),
        ("lateness p99.9", |one| one.outcome.lateness.p999),
    ];
    for (spin_us, rounds) in SPINS.iter().zip(found) {
        let share = Spread::of(rounds.iter().map(|one| one.share));
        let missed: u64 = rounds.iter().map(|one| one.outcome.missed).sum();
        println!("spin {spin_us:<4} {:>22} % of a core, {missed} ticks missed", format!("{share:.1}"));
        for (name, figure) in figures {
            let us = Spread::of(rounds.iter().map(figure));
            let ratio =
                Spread::of(rounds.iter().zip(&found[0]).map(|(one, none)| figure(one) / figure(none)));
            println!("  {name:<16} {:>24}   / without {ratio:.2}", format!("{us:.1}"));
        }
        if (*spin_us, count) == (100, 1) {
            let p99 = rounds.iter().zip(&found[0]).map(|(one, none)| figures[1].1(one) / figures[1].1(none));
            println!("  goal: p99 / without <= {P99_GOAL}: {}", verdict(Spread::of(p99), P99_GOAL));
            println!("  goal: at most {SHARE_GOAL} % of a core: {}", verdict(share, SHARE_GOAL));
        }
    }
    println!();
}

fn throttle(seconds: u32) {
    println!("1,000 ticks a second, spinning for 900 us, for {seconds} s; all times in us");
    heading();
    let mut bitten = 0;
    for count in COUNTS {
        let (_open, to) = mute(count);
        let one = spun(900, seconds, &to);
        line("-", count, 900, &one);
        bitten += one.stalls.throttled;
    }
    let words = if bitten == 0 { "no tick was lost to it" } else { "MISSED" };
    println!(
        "stalls of 40 to 60 ms in which the kernel kept the thread waiting, as the throttle does: {bitten}; {words}"
    );
}

fn option<N: std::str::FromStr>(words: &[&str], name: &str) -> Option<N> {
    let value = words.iter().skip_while(|word| **word != name).nth(1)?;
    Some(number(value))
}

fn number<N: std::str::FromStr>(word: &str) -> N {
    word.parse().unwrap_or_else(|_| panic!("{word:?} is not a number that can be used here"))
}
