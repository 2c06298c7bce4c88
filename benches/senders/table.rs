//! What is printed: a line for each sender of each round, then ours against bare.

use super::outcome::{Outcome, Quantiles};
use crate::common::spread::{Spread, verdict};

/// Ours over bare, at most: for the 99th percentiles, and for the sending thread's processor time a datagram.
const P99_GOAL: f64 = 1.5;
const SEND_GOAL: f64 = 1.3;
/// The number of controllers for which the latter is a goal.
const SEND_GOAL_AT: usize = 64;

/// Which sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// kinocue's engine, lanes, sockets and tick loop.
    Ours,
    /// The same loop without kinocue.
    Bare,
}

impl Kind {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::Bare => "bare",
        }
    }
}

/// Opens the table of rounds.
pub(crate) fn heading(rounds: usize, seconds: u32) {
    println!("1,000 ticks a second for {seconds} s, {rounds} interleaved rounds; all times in us");
    println!(
        "round    n        lateness p50    p99  p99.9    max |  ack p50    p99  p99.9    max | missed acked |  cpu send receive"
    );
}

/// One sender of one round.
pub(crate) fn line(round: usize, count: usize, kind: Kind, outcome: &Outcome) {
    let Outcome { lateness, ack, missed, sent, acked, send_us, receive_us, policy, .. } = outcome;
    let locked = if outcome.locked { "locked" } else { "not locked" };
    #[expect(clippy::cast_precision_loss, reason = "a few million frames")]
    let acked = 100.0 * *acked as f64 / *sent as f64;
    println!(
        "{:>5} {count:>4} {} {} | {} | {missed:>6} {acked:>4.0}% | {send_us:>8.2} {receive_us:>7.2}  {policy}, {locked}",
        round + 1,
        kind.name(),
        columns(lateness, 14),
        columns(ack, 8),
    );
}

fn columns(quantiles: &Quantiles, first: usize) -> String {
    let Quantiles { p50, p99, p999, max } = quantiles;
    format!("{p50:>first$.1} {p99:>6.1} {p999:>6.0} {max:>6.0}")
}

type Figure = fn(&Outcome) -> f64;

/// Ours against bare for one number of controllers, as medians of all rounds.
pub(crate) fn summary(count: usize, pairs: &[[Outcome; 2]]) {
    println!("\n{count} controllers{:>27} {:>26} {:>22}  goal", "ours", "bare", "ours / bare");
    let p99 = Some(P99_GOAL);
    let send = (count == SEND_GOAL_AT).then_some(SEND_GOAL);
    let rows: [(&str, Figure, Option<f64>); 10] = [
        ("lateness p50", |of| of.lateness.p50, None),
        ("lateness p99", |of| of.lateness.p99, p99),
        ("lateness p99.9", |of| of.lateness.p999, None),
        ("lateness max", |of| of.lateness.max, None),
        ("ack p50", |of| of.ack.p50, None),
        ("ack p99", |of| of.ack.p99, p99),
        ("ack p99.9", |of| of.ack.p999, None),
        ("ack max", |of| of.ack.max, None),
        ("cpu, sending", |of| of.send_us, send),
        ("cpu, receiving", |of| of.receive_us, None),
    ];
    for (name, figure, goal) in rows {
        let of = |which: usize| Spread::of(pairs.iter().map(|pair| figure(&pair[which])));
        let ratio = Spread::of(pairs.iter().map(|[ours, bare]| figure(ours) / figure(bare)));
        let goal = goal.map_or(String::new(), |goal| format!("<= {goal}: {}", verdict(ratio, goal)));
        let [ours, bare] = [0, 1].map(|which| format!("{:.1}", of(which)));
        println!("{name:<16} {ours:>24} {bare:>26} {:>22}  {goal}", format!("{ratio:.2}"));
    }
    let [ours, bare] = [0, 1].map(|which: usize| missed(pairs, which));
    println!("missed ticks     {ours:>24} {bare:>26}");
}

fn missed(pairs: &[[Outcome; 2]], which: usize) -> String {
    let missed: u64 = pairs.iter().map(|pair| pair[which].missed).sum();
    let ticks: u64 = pairs.iter().map(|pair| pair[which].ticks).sum();
    format!("{missed} of {}", missed + ticks)
}
