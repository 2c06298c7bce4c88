//! The last limiter: what it costs where it lets all pass, and whether anything gets past it that should not, or is held that
//! should pass.
//!
//! `cargo bench --bench limiter -- [--sequences N] [--from N] [--sound N] [--rounds N] [--quick]`

mod common {
    pub(crate) mod spread;
}

use std::hint::black_box;
use std::time::Duration;

use common::spread::{Spread, verdict};
use kinocue::harness::asked::{Sound, Trial, Wild, sound, standing, wild};
use kinocue::harness::limiter::{Admitted, Limiter, Provenance};
use kinocue::harness::motion::{MAX_AXES, Pose, SeatType, Slot, Window};
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, Rate};

/// What an axis may cost in a tick, ns.
const GOAL_NS: f64 = 25.0;
/// Lanes that are served in turns, so that their memory is used as in a hall.
const LANES: usize = 64;
const AXES: usize = 6;
const TICKS: u32 = 4_000;

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let usual = |full: u64, short: u64| if quick { short } else { full };
    cost(argument("--rounds").unwrap_or_else(|| usual(15, 3)));
    pass_sound(argument("--sound").unwrap_or_else(|| usual(20_000, 500)));
    let sequences = argument("--sequences").unwrap_or_else(|| usual(1_000_000, 2_000));
    hold_wild(argument("--from").unwrap_or(1), sequences);
}

fn argument(name: &str) -> Option<u64> {
    let given = std::env::args().skip_while(|argument| argument != name).nth(1);
    given.map(|count| count.parse().expect("a whole number follows"))
}

/// Times ticks that all pass, against a loop that copies the same poses to where a limiter would keep them.
fn cost(rounds: u64) {
    println!(
        "passing {LANES} lanes of {AXES} axes at 1,000 Hz, median of {rounds} rounds (least..greatest)\n\
         {:<24} {:>24} {:>24} {:>24}  goal",
        "of all ticks", "limiter, ns per axis", "bare copy, ns per axis", "limiter / copy"
    );
    let rows = [
        ("in the middle: median", Swing { about: 0.5, apart: 0.3 }, 0.5, Some(GOAL_NS)),
        ("at an end: p99", Swing { about: 0.0, apart: 0.3 }, 0.99, None),
        // As before and after a cue: all come from there and go there together.
        ("all at an end: p99", Swing { about: 0.0, apart: 0.0 }, 0.99, None),
    ];
    for (what, swing, share, goal) in rows {
        let rounds: Vec<[f64; 2]> = (0..rounds.max(1)).map(|_| round(swing, share)).collect();
        let [ours, bare] = [0, 1].map(|place: usize| Spread::of(rounds.iter().map(|round| round[place])));
        let ratio = Spread::of(rounds.iter().map(|[ours, bare]| ours / bare));
        let goal = goal.map_or(String::new(), |goal| format!("<= {goal} ns: {}", verdict(ours, goal)));
        let [ours, bare, ratio] = [ours, bare, ratio].map(|spread| format!("{spread:.1}"));
        println!("{what:<24} {ours:>24} {bare:>24} {ratio:>24}  {goal}");
    }
}

/// ns for each axis in the tick that as large a share of all is quicker than: of the limiters, and of the bare loop.
fn round(swing: Swing, share: f64) -> [f64; 2] {
    let window = Window::new(
        (0..AXES).map(|axis| Slot::new(&SeatType::bench3(AXES), axis, Some(axis), 1.0)).collect(),
    );
    let mut limiters: Vec<Limiter> =
        (0..LANES).map(|_| standing(&window, Rate::from_hz(1000.0), wave(0, swing))).collect();
    let mut kept = vec![[0.0; MAX_AXES]; LANES];
    let (mut ours, mut bare) = (Vec::new(), Vec::new());
    for tick in 0..TICKS {
        let pose = wave(tick, swing);
        ours.push(timed(|| {
            for limiter in &mut limiters {
                let mut pose = black_box(pose);
                let verdict = limiter.admit(&mut pose, u64::from(tick), Provenance::Proved);
                assert_eq!(verdict, Admitted::Passed);
                black_box(&pose);
            }
        }));
        bare.push(timed(|| {
            for kept in &mut kept {
                *kept = black_box(pose);
                black_box(&kept);
            }
        }));
    }
    [ours, bare].map(|ticks| quantile(ticks, share))
}

/// What so large a share of them is below.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "some thousands"
)]
fn quantile(mut of: Vec<f64>, share: f64) -> f64 {
    of.sort_by(f64::total_cmp);
    of[(share * (of.len() - 1) as f64).round() as usize]
}

/// How seats swing: up from there, strokes, and by how much each axis is slower than the one before it.
#[derive(Clone, Copy)]
struct Swing {
    about: f64,
    apart: f64,
}

/// A swell of 30 mm in 2 s and more.
fn wave(tick: u32, Swing { about, apart }: Swing) -> Pose {
    let t = f64::from(tick) * 1e-3;
    let mut pose = [0.0; MAX_AXES];
    for (axis, position) in (0_u8..).zip(&mut pose[..AXES]) {
        *position = about + 0.1 * (1.0 - (t * (3.0 - f64::from(axis) * apart)).cos());
    }
    pose
}

/// ns for each axis that some work took.
fn timed(work: impl FnOnce()) -> f64 {
    let start = Monotonic.now();
    work();
    let axes = f64::from(u32::try_from(LANES * AXES).expect("some hundreds"));
    Monotonic.now().since(start).div_duration_f64(Duration::from_nanos(1)) / axes
}

/// What was found in sequences of one sort.
#[derive(Clone, Copy, Default)]
struct Found {
    sequences: u64,
    wrong: u64,
    worst: f64,
    looked: f64,
    ticks: f64,
}

impl Found {
    #[expect(clippy::cast_precision_loss, reason = "some thousands")]
    fn add(&mut self, trial: &Trial, wrong: bool, ticks: usize) {
        self.sequences += 1;
        self.wrong += u64::from(wrong);
        self.worst = self.worst.max(trial.share);
        self.looked += trial.counts.looked as f64;
        self.ticks += ticks as f64;
    }
}

/// Motion that keeps the limits: it must pass, bit for bit. Those that take less than nine tenths of them apart.
fn pass_sound(sequences: u64) {
    let mut found = [[Found::default(); 2]; sound::SORTS.len()];
    for seed in 1..=sequences {
        let sound = Sound::new(seed);
        let trial = Trial::of_sound(&sound);
        found[sound.sort][usize::from(sound.share > 0.9)].add(&trial, !trial.unchanged, sound.frames.len());
    }
    println!(
        "\nmotion that keeps the limits: sequences, of them held anywhere, ticks that a way to rest was looked for"
    );
    println!(
        "{:<28} {:>9} {:>6} {:>7}   {:>9} {:>6} {:>7}",
        "", "up to 0.9", "held", "looked", "up to 1", "held", "looked"
    );
    for (sort, [gentle, full]) in sound::SORTS.iter().zip(found) {
        let [gentle, full] = [gentle, full].map(|of| {
            format!("{:>9} {:>6} {:>6.1}%", of.sequences, of.wrong, 100.0 * of.looked / of.ticks.max(1.0))
        });
        println!("{sort:<28} {gentle}   {full}");
    }
}

/// Anything: what is sent must keep the limits.
fn hold_wild(from: u64, sequences: u64) {
    let mut found = [Found::default(); wild::SORTS.len()];
    for seed in from..from + sequences {
        let mut wild = Wild::new(seed);
        let trial = Trial::of_wild(&mut wild);
        if trial.is_broken() {
            println!("sequence {seed}, {}, {} Hz: {}", wild::SORTS[wild.sort], wild.rate.hz(), trial.share);
        }
        found[wild.sort].add(&trial, trial.is_broken(), wild.frames);
    }
    println!("\nanything: sequences, of them beyond a limit, greatest share of a limit (1.001 is allowed)");
    for (sort, of) in wild::SORTS.iter().zip(found) {
        println!("{sort:<28} {:>9} {:>6} {:>9.6}", of.sequences, of.wrong, of.worst);
    }
    let total = found.iter().map(|of| of.wrong).sum::<u64>();
    println!("{:<28} {sequences:>9} {total:>6}", "all");
}
