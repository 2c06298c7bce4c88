//! How long a seek is planned: from anywhere in a two-hour cue to anywhere else in it, for one seat and for a hall.
//!
//! `cargo bench --bench seek`. The goal is on the time itself, 5 ms at p99, because a person waits for it; the ratio to a
//! sample of the cue tells machines apart.

mod common {
    pub(crate) mod spread;
}

use std::hint::black_box;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use common::spread::{Spread, verdict};
use kinocue::harness::plan::{Curve, From, LaneScene, Place, Request, Scene, To};
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::Clock as _;
use kinocue::harness::timeline::Hint;
use kinocue::harness::{ride, stage};

const HOURS: u32 = 2;
const SEEKS: u32 = 300;
const ROUNDS: usize = 5;
/// Goal of p99, milliseconds.
const GOAL_MS: f64 = 5.0;

fn main() {
    println!("{SEEKS} seeks in a cue of {HOURS} h, six axes; median of {ROUNDS} rounds (least..most)");
    println!("{:<8} {:>22} {:>22} {:>26}", "seats", "p50 ms", "p99 ms", "p50 over 1,000 samples");
    for seats in [1, 64] {
        let rounds: Vec<[f64; 3]> = (0..ROUNDS).map(|round| seeks(seats, round)).collect();
        let [p50, p99, ratio] = [0, 1, 2].map(|place: usize| Spread::of(rounds.iter().map(|of| of[place])));
        let columns = [p50, p99, ratio].map(|spread| spread.to_string());
        let [p50, p99_text, ratio] = columns;
        println!(
            "{seats:<8} {p50:>22} {p99_text:>22} {ratio:>26}  p99 <= {GOAL_MS}: {}",
            verdict(p99, GOAL_MS)
        );
    }
}

/// p50 and p99 of the seeks of one round, and p50 over what 1,000 samples of the cue take.
fn seeks(seats: u16, round: usize) -> [f64; 3] {
    let to: Vec<SocketAddrV4> =
        (0..seats).map(|seat| SocketAddrV4::new(Ipv4Addr::LOCALHOST, 20_000 + seat)).collect();
    let (staged, _) = stage(ride(HOURS * 3_600, 0.1, &[]), 1000.0, &to, false);
    let settled = staged.course.settled();
    let (_, lanes, mut planner, timeline) = staged.split();
    let pose = |at| timeline.sample(at, &mut Hint::default());
    let curve = Curve { pose: &pose, end: timeline.duration() };
    let on_course = LaneScene { place: Place::OnCourse, level: 1.0, out: false };
    let anywhere = (timeline.duration().as_nanos() - settled.as_nanos() - 20_000_000_000).unsigned_abs();
    let mut chance = round as u64 + 1;
    let mut somewhere = || {
        // Knuth's linear congruence: the same seeks in every run.
        chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        settled + Duration::from_nanos((chance >> 11) % anywhere)
    };
    let mut took: Vec<f64> = Vec::new();
    for _ in 0..SEEKS {
        let (at, start) = (somewhere(), somewhere());
        let scene = Box::new(Scene { lanes: vec![on_course; lanes.len()] });
        let from = From::Course { serial: 1, at, pace: 1.0 };
        // Always from the first course: it leads everywhere.
        let request = Request { from, to: To::Cue, start, serial: 2, scene };
        took.push(timed(|| drop(black_box(planner.plan(&request, &curve).expect("the ride is gentle")))));
    }
    took.sort_by(f64::total_cmp);
    let samples = timed(|| {
        (0..1_000).for_each(|_| {
            black_box(pose(somewhere()));
        })
    });
    let at = |share: usize| took[took.len() * share / 100];
    [at(50), at(99), at(50) / samples]
}

/// Milliseconds.
fn timed(work: impl FnOnce()) -> f64 {
    let began = Monotonic.now();
    work();
    Monotonic.now().since(began).as_secs_f64() * 1e3
}
