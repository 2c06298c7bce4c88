//! What a limiter must let pass: motion of every sort that keeps the limits by the measure, up to the last thousandth.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use super::chance::Chance;
use super::judge::Judge;
use crate::cue::{Source, read};
use crate::motion::{AxisGeometry, Limits};
use crate::time::{Rate, ShowTime};
use crate::timeline::{Hint, Timeline};

/// Rates that are tried more often than others.
const RATES: [f64; 8] = [50.0, 60.0, 100.0, 120.0, 200.0, 333.0, 500.0, 1000.0];
/// Seconds of each.
const SECONDS: u32 = 3;
/// Milliseconds of rest before a curve begins.
const REST_MS: u32 = 400;

/// The sorts of motion, by name.
pub const SORTS: [&str; 6] = ["spline", "monotone", "linear", "waves", "from end to end", "jerk by chance"];

/// A motion that keeps the limits.
pub struct Sound {
    pub rate: Rate,
    pub limits: Limits,
    pub start: f64,
    pub sort: usize,
    /// Greatest share of a limit.
    pub share: f64,
    pub frames: Vec<(f64, u32)>,
}

impl Sound {
    /// Motion number `seed`.
    pub fn new(seed: u64) -> Self {
        let mut chance = Chance::new(seed);
        let hz = if chance.once_in(4) { chance.between(50.0, 1000.0) } else { chance.one_of(&RATES) };
        let rate = Rate::from_hz(hz);
        let limits = Limits::of(&AxisGeometry::BENCH);
        let sort = chance.below(SORTS.len());
        let times = times(rate);
        let mut at = 0;
        let at: Vec<f64> = times
            .iter()
            .map(|&ms| {
                at += ms;
                f64::from(at) * 1e-3
            })
            .collect();
        let curve = match sort {
            0..=2 => from_rows(&mut chance, sort, &at),
            3 => waves(&mut chance, &at),
            4 => at.iter().map(|&t| end_to_end(t - 0.1, limits)).collect(),
            _ => by_jerk(&mut chance, &at, limits),
        };
        let share = chance.one_of(&[1.0009, 1.0, 0.95, 0.8, 0.5]);
        let start = curve[0];
        let frames: Vec<(f64, u32)> = curve.into_iter().zip(times).collect();
        fit(&mut chance, Self { rate, limits, start, sort, share, frames })
    }
}

/// Scales a motion to its share of the limits, and puts it into the stroke, often up to one of its ends.
fn fit(chance: &mut Chance, mut sound: Sound) -> Sound {
    let Sound { rate, limits, start, .. } = sound;
    let worst = Judge::worst(limits, rate.hz(), start, &sound.frames);
    let most = worst.velocity.max(worst.step).max(worst.acceleration).max(worst.jerk);
    let (low, high) =
        sound.frames.iter().fold((start, start), |(low, high), of| (low.min(of.0), high.max(of.0)));
    let full = sound.sort == 4 && sound.share >= 1.0;
    let scale = if full { 1.0 } else { (sound.share / most).min(1.0 / (high - low)) * chance.sign() };
    sound.share = most * scale.abs();
    let reach = (high - low) * scale.abs();
    let least = [(low - start) * scale, (high - start) * scale].into_iter().fold(0.0, f64::min);
    let room = (1.0 - reach).max(0.0);
    let place = chance.one_of(&[0.0, room, chance_between(room)]);
    let begin = (place - least).clamp(0.0, 1.0);
    for (position, _) in &mut sound.frames {
        *position = (begin + scale * (*position - start)).clamp(0.0, 1.0);
    }
    sound.start = begin;
    sound
}

fn chance_between(room: f64) -> f64 {
    0.37 * room
}

fn times(rate: Rate) -> Vec<u32> {
    let mut left = SECONDS * 1000;
    (0..)
        .map(|frame| rate.time_ms(frame))
        .take_while(|&ms| {
            left = left.saturating_sub(ms);
            left > 0
        })
        .collect()
}

/// A curve through rows by chance, after some at rest.
fn from_rows(chance: &mut Chance, sort: usize, at: &[f64]) -> Vec<f64> {
    let apart = chance.one_of(&[10, 20, 40, 50, 100, 200]);
    let mut text = format!("# interpolation: {}\ntime_ms,a1\n", SORTS[sort]);
    let rough = chance.of_any_size(0.003, 0.3);
    let mut value = 0.5;
    for ms in (0..=SECONDS * 1000).step_by(apart) {
        if (REST_MS..SECONDS * 1000 - REST_MS).contains(&ms) {
            value = (value + rough * chance.between(-0.1, 0.1)).clamp(0.3, 0.7);
        }
        writeln!(text, "{ms},{value:.9}").expect("a string takes all");
    }
    let cue =
        read(Path::new("rows.csv"), text.as_bytes(), &Source::Native).expect("the rows are well formed");
    let (timeline, mut hint) = (Timeline::new(cue), Hint::default());
    at.iter().map(|&t| timeline.sample(ShowTime::from_secs_f64(t), &mut hint)[0]).collect()
}

/// Waves that swell from rest.
fn waves(chance: &mut Chance, at: &[f64]) -> Vec<f64> {
    let waves = [(); 3].map(|()| {
        let hz = chance.of_any_size(0.2, 5.0);
        (hz, chance.between(0.0, TAU), chance.between(0.0, 1.0) / (hz * hz))
    });
    at.iter()
        .map(|&t| {
            let u = (t / 0.8).min((f64::from(SECONDS) - t) / 0.8).clamp(0.0, 1.0);
            let swell = u * u * u * (10.0 + u * (6.0 * u - 15.0));
            0.01 * swell
                * waves.iter().map(|(hz, phase, size)| size * (TAU * hz * t + phase).sin()).sum::<f64>()
        })
        .collect()
}

/// Over the whole stroke in the shortest time that the limits leave.
fn end_to_end(t: f64, limits: Limits) -> f64 {
    let Limits { velocity, acceleration, jerk } = limits;
    let rise = acceleration / jerk;
    let hold = velocity / acceleration - rise;
    let cruise = 1.0 / velocity - hold - 2.0 * rise;
    let phases =
        [(jerk, rise), (0.0, hold), (-jerk, rise), (0.0, cruise), (-jerk, rise), (0.0, hold), (jerk, rise)];
    run(phases, t.max(0.0), 0.0, 0.0, 0.0)
}

/// Where phases of constant jerk lead in `t` seconds from a position, a velocity and an acceleration.
fn run(phases: impl IntoIterator<Item = (f64, f64)>, t: f64, mut x: f64, mut v: f64, mut a: f64) -> f64 {
    let mut left = t;
    for (jerk, seconds) in phases {
        let dt = left.min(seconds);
        x += dt * (v + dt * (a / 2.0 + dt * jerk / 6.0));
        v += dt * (a + dt * jerk / 2.0);
        a += dt * jerk;
        left -= dt;
    }
    x
}

/// The phases that lead to rest in the shortest time.
fn to_rest(v: f64, a: f64, limits: Limits) -> [(f64, f64); 3] {
    let Limits { acceleration, jerk, .. } = limits;
    let sign = (v + a * a.abs() / (2.0 * jerk)).signum();
    let (v, a) = (sign * v, sign * a);
    let peak = (jerk * v + a * a / 2.0).max(0.0).sqrt().min(acceleration).max(-a);
    let hold = if peak > 0.0 { ((v + a * a / (2.0 * jerk)) / peak - peak / jerk).max(0.0) } else { 0.0 };
    [(-sign * jerk, (a + peak) / jerk), (0.0, hold), (sign * jerk, peak / jerk)]
}

/// Full jerk one way or the other, turned back before a limit is passed.
fn by_jerk(chance: &mut Chance, at: &[f64], limits: Limits) -> Vec<f64> {
    let (mut x, mut v, mut a, mut jerk, mut left, mut before) = (0.0, 0.0_f64, 0.0_f64, 0.0, 0.0, 0.0);
    let mut stop: Option<(f64, [(f64, f64); 3])> = None;
    at.iter()
        .map(|&t| {
            let dt = t - before;
            if before > f64::from(SECONDS) - 0.6 {
                let (since, phases) = *stop.get_or_insert_with(|| (before, to_rest(v, a, limits)));
                return run(phases, t - since, x, v, a);
            }
            before = t;
            if left <= 0.0 {
                left = chance.of_any_size(0.005, 0.3);
                jerk = limits.jerk * chance.one_of(&[-1.0, 0.0, 1.0]);
            }
            left -= dt;
            let wish: f64 = if v + a * a.abs() / (2.0 * limits.jerk) > limits.velocity {
                -limits.jerk
            } else if v + a * a.abs() / (2.0 * limits.jerk) < -limits.velocity {
                limits.jerk
            } else {
                jerk
            };
            let next = (a + wish * dt).clamp(-limits.acceleration, limits.acceleration);
            let jerk = (next - a) / dt;
            x += dt * (v + dt * (a / 2.0 + dt * jerk / 6.0));
            v += dt * (a + next) / 2.0;
            a = next;
            x
        })
        .collect()
}
