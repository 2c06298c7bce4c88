//! How evenly frames leave, and what each costs: kinocue's tick loop against the same loop without kinocue, 1,000 times a
//! second to 1, 16 and 64 controllers on loopback that answer every frame.
//!
//! `cargo bench --bench jitter -- [--rounds N] [--seconds S] [--controllers N] [--quick]`
//!
//! Each sender runs in a process of its own, so that what it got of the system is its own; the controllers of all of
//! them are in further processes. Rounds are interleaved: whatever else the machine does meets both alike.

mod common {
    pub(crate) mod spread;
}
mod senders {
    pub(super) mod again;
    pub(super) mod bare;
    pub(super) mod children;
    pub(super) mod ours;
    pub(super) mod outcome;
    pub(super) mod peer;
    pub(super) mod table;
}

use std::net::SocketAddrV4;

use kinocue::harness::sys::clock::Monotonic;
use senders::again::sender;
use senders::children::Peer;
use senders::outcome::Outcome;
use senders::table::Kind;
use senders::{bare, ours, peer, table};

/// How many controllers there are in turn, unless told otherwise.
const COUNTS: [usize; 3] = [1, 16, 64];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["peer", count] => peer::run(number(count)),
        ["ours", seconds, ref to @ ..] => {
            finish(&ours::run(&Monotonic, number(seconds), &addresses(to), false))
        }
        ["bare", seconds, ref to @ ..] => finish(&bare::run(number(seconds), &addresses(to))),
        _ => compare(&words),
    }
}

/// The sender's process ends with its outcome on stdout.
fn finish(outcome: &Outcome) {
    println!("{}", serde_json::to_string(outcome).expect("an outcome has only names and numbers"));
}

fn compare(words: &[&str]) {
    let quick = words.contains(&"--quick");
    let rounds: usize = option(words, "--rounds").unwrap_or(if quick { 2 } else { 5 });
    let seconds: u32 = option(words, "--seconds").unwrap_or(if quick { 2 } else { 6 });
    let counts = option(words, "--controllers").map_or(COUNTS.to_vec(), |count| vec![count]);
    let peers: Vec<Peer> = counts.iter().map(|&count| Peer::start(count)).collect();
    table::heading(rounds, seconds);
    let mut pairs: Vec<Vec<[Outcome; 2]>> = vec![Vec::new(); counts.len()];
    for round in 0..rounds {
        for (peer, pairs) in peers.iter().zip(&mut pairs) {
            pairs.push(pair(round, seconds, peer));
        }
    }
    for (count, pairs) in counts.iter().zip(&pairs) {
        table::summary(*count, pairs);
    }
}

/// Both senders, one after the other, every other round in the other order; ours first in the result.
fn pair(round: usize, seconds: u32, peer: &Peer) -> [Outcome; 2] {
    let run = |kind: Kind| {
        let outcome = sender(&[kind.name(), &seconds.to_string()], &peer.addresses);
        table::line(round, peer.addresses.len(), kind, &outcome);
        outcome
    };
    if round.is_multiple_of(2) {
        [Kind::Ours, Kind::Bare].map(run)
    } else {
        let [bare, ours] = [Kind::Bare, Kind::Ours].map(run);
        [ours, bare]
    }
}

fn option<N: std::str::FromStr>(words: &[&str], name: &str) -> Option<N> {
    let value = words.iter().skip_while(|word| **word != name).nth(1)?;
    Some(number(value))
}

fn number<N: std::str::FromStr>(word: &str) -> N {
    word.parse().unwrap_or_else(|_| panic!("{word:?} is not a number that can be used here"))
}

fn addresses(words: &[&str]) -> Vec<SocketAddrV4> {
    words.iter().map(|word| word.parse().expect("the addresses of controllers")).collect()
}
