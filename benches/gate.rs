//! The last gate: what it costs where it lets all pass, and whether anything gets past it.
//!
//! `cargo bench --bench gate -- [--sequences N] [--rounds N]`

mod asked {
    pub(crate) mod chance;
    pub(crate) mod judge;
    pub(crate) mod sound;
    pub(crate) mod wild;
}

use asked::judge::Judge;
use asked::sound::{self, Sound};
use asked::wild::{SORTS, Wild};
use kinocue::gate::Gate;
use kinocue::motion::{MAX_AXES, Slot, Window};

/// What was found in sequences of one sort.
#[derive(Debug, Clone, Copy, Default)]
struct Found {
    sequences: u64,
    frames: u64,
    bad: u64,
    worst: f64,
    worst_seed: u64,
    beyond: u64,
    held: u64,
}

fn argument(name: &str, usual: u64) -> u64 {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let given = arguments.iter().skip_while(|argument| *argument != name).nth(1);
    given.map_or(usual, |count| count.parse().expect("a number"))
}

fn window(limits: kinocue::motion::Limits) -> Window {
    Window::new(vec![Slot {
        axis: Some(0),
        to_stroke: 1.0,
        shift: 0.0,
        park: 0.0,
        stroke_pulses: 300_000.0,
        stroke_mm: 150.0,
        limits,
    }])
}

fn run(seed: u64, found: &mut [Found], trace: bool) {
    let mut wild = Wild::new(seed);
    let hz = wild.rate.hz();
    let mut pose = [0.0; MAX_AXES];
    pose[0] = wild.start;
    let mut gate = Gate::new(&window(wild.limits), wild.rate, pose);
    let mut judge = Judge::new(wild.limits, hz, wild.start);
    let mut worst = 0.0_f64;
    let mut ms = 0_u64;
    for k in 0..wild.frames {
        let time_ms = wild.rate.time_ms(k as u64);
        ms += u64::from(time_ms);
        let asked = wild.next(k, ms as f64 * 1e-3, time_ms, &mut judge);
        pose[0] = asked;
        gate.admit(&mut pose, k as u64);
        let shown = judge.push(pose[0], time_ms);
        if trace {
            println!("{k} {time_ms} asked {asked} sent {} {:?} {shown:?}", pose[0], gate.counts());
        }
        worst = worst.max(shown.share());
    }
    if worst > 1.001 * 1.000_001 && std::env::var("LIST").is_ok() {
        println!("BAD seed {seed} {} rate {hz} worst {worst} limits {:?} beyond {}", SORTS[wild.sort], wild.limits, gate.counts().beyond);
    }
    let found = &mut found[wild.sort];
    found.sequences += 1;
    found.frames += wild.frames as u64;
    found.bad += u64::from(worst > 1.001 * 1.000_001);
    if worst > found.worst {
        found.worst = worst;
        found.worst_seed = seed;
    }
    found.beyond += gate.counts().beyond;
    found.held += gate.counts().held_ticks;
}

fn pass(seed: u64, found: &mut [Found], trace: bool) {
    let sound = Sound::new(seed);
    let worst = Judge::worst(sound.limits, sound.rate.hz(), sound.start, &sound.frames).share();
    if worst > 1.001 {
        return;
    }
    let mut pose = [0.0; MAX_AXES];
    pose[0] = sound.start;
    let mut gate = Gate::new(&window(sound.limits), sound.rate, pose);
    let mut kept = true;
    for (index, &(position, _)) in (0..).zip(&sound.frames) {
        pose[0] = position;
        gate.admit(&mut pose, index);
        if trace {
            println!("{index} asked {position} sent {} {:?}", pose[0], gate.counts());
        }
        kept &= pose[0].to_bits() == position.to_bits();
    }
    if !kept && std::env::var("LIST").is_ok() {
        println!("HELD seed {seed} {} rate {} share {worst} {:?}", sound::SORTS[sound.sort], sound.rate.hz(), gate.counts());
    }
    let found = &mut found[sound.sort];
    found.sequences += 1;
    found.frames += sound.frames.len() as u64;
    found.bad += u64::from(!kept);
    found.held += gate.counts().looked;
    found.worst = found.worst.max(worst);
}

fn main() {
    let mut kept = [Found::default(); sound::SORTS.len()];
    let one = argument("--sound", 0);
    if one > 0 {
        return pass(one, &mut kept, true);
    }
    for seed in 1..=argument("--sounds", 10_000) {
        pass(seed, &mut kept, false);
    }
    for (sort, found) in sound::SORTS.iter().zip(kept) {
        println!("{sort:<28} {found:?}");
    }
    let sequences = argument("--sequences", 1_000_000);
    let mut found = [Found::default(); SORTS.len()];
    let one = argument("--seed", 0);
    if one > 0 {
        run(one, &mut found, true);
        return;
    }
    let began = std::time::SystemTime::now();
    for seed in 1..=sequences {
        run(seed, &mut found, false);
    }
    for (sort, found) in SORTS.iter().zip(found) {
        println!("{sort:<28} {found:?}");
    }
    println!("bad {} of {sequences}, {:?}", found.iter().map(|f| f.bad).sum::<u64>(), began.elapsed());
}
