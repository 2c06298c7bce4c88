//! What a limiter may be asked for: anything.

use std::f64::consts::TAU;

use super::chance::Chance;
use super::judge::Judge;
use crate::motion::{AxisGeometry, Limits};
use crate::time::Rate;

/// Rates that are tried more often than others.
const RATES: [f64; 10] = [50.0, 60.0, 100.0, 120.0, 200.0, 250.0, 333.0, 500.0, 700.0, 1000.0];

/// The sorts of orders, by name.
pub const SORTS: [&str; 13] = [
    "steps",
    "noise",
    "no numbers",
    "cut off",
    "alternating",
    "wiggles",
    "into the end",
    "freezes",
    "jerk by chance",
    "lines",
    "full jerk",
    "at the edge of the measure",
    "edges by turns",
];

/// A sequence of orders to one axis at rest.
pub struct Wild {
    pub rate: Rate,
    pub limits: Limits,
    pub start: f64,
    pub frames: usize,
    pub sort: usize,
    waves: [(f64, f64, f64); 3],
    centre: f64,
    size: f64,
    span: usize,
    /// Frames of a wiggle.
    wiggle: f64,
    state: [f64; 4],
    left: usize,
    pub chance: Chance,
}

impl Wild {
    /// Sequence number `seed`.
    pub fn new(seed: u64) -> Self {
        let mut chance = Chance::new(seed);
        let hz = if chance.once_in(4) { chance.between(50.0, 1000.0) } else { chance.one_of(&RATES) };
        let rate = Rate::from_hz(hz);
        let limits = limits(&mut chance);
        let sort = chance.below(SORTS.len());
        let centre = chance.between(0.2, 0.8);
        let waves = [(); 3].map(|()| {
            let hz = chance.of_any_size(0.1, 6.0);
            (hz, chance.between(0.0, TAU), chance.between(0.0, 0.6) * swing(hz, limits))
        });
        let size = match sort {
            4 => chance.one_of(&[1.5 / 150.0, 0.25 / 150.0, 0.0_f64]).max(chance.of_any_size(1e-6, 0.1)),
            _ => chance.of_any_size(1e-6, 0.5),
        };
        let mut wild = Self {
            rate,
            limits,
            start: 0.0,
            frames: 40 + chance.below(280),
            sort,
            waves,
            centre,
            size,
            span: 1 + chance.below(80),
            wiggle: chance.between(1.0, 80.0).round(),
            state: [0.0; 4],
            left: 0,
            chance,
        };
        wild.start = match sort {
            6 | 8 | 10 | 11 | 12 | 0 => wild.chance.one_of(&[0.0, 0.5, 1.0, centre]),
            _ => wild.wave(0.0).clamp(0.0, 1.0),
        };
        wild.state[0] = wild.start;
        wild
    }

    /// A gentle motion: waves that swell from rest.
    fn wave(&self, t: f64) -> f64 {
        let swell = (t / 0.5).min(1.0);
        let swell = swell * swell * swell * (10.0 + swell * (6.0 * swell - 15.0));
        let sum: f64 = self.waves.iter().map(|(hz, phase, size)| size * (TAU * hz * t + phase).sin()).sum();
        self.centre + swell * sum
    }

    /// Order number `k`, due `t` after the start, a frame of `time_ms` after the last; `judge` knows what was sent before.
    pub fn next(&mut self, k: usize, t: f64, time_ms: u32, judge: &mut Judge) -> f64 {
        let wave = self.wave(t);
        let seconds = f64::from(time_ms) * 1e-3;
        match self.sort {
            0 => {
                if self.turn() {
                    self.state[0] =
                        if self.chance.once_in(2) { self.chance.between(-0.2, 1.2) } else { self.start };
                }
                self.state[0]
            }
            1 => wave + self.size * self.chance.between(-1.0, 1.0),
            2 if self.chance.once_in(self.span) => {
                self.chance.one_of(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300])
            }
            2 => wave,
            3 if k < self.frames / 2 => {
                self.state[0] = wave;
                wave
            }
            3 => [self.state[0], self.start, f64::NAN, 0.0][self.span % 4],
            4 => wave + if k.is_multiple_of(2) { self.size } else { -self.size },
            5 => wave + self.size * (TAU * t * self.rate.hz() / self.wiggle).sin(),
            6 => self.run_on(seconds),
            7 => {
                if self.turn() {
                    self.state[1] = wave;
                }
                if self.left.is_multiple_of(2) { self.state[1] } else { wave }
            }
            8 | 10 => self.jerk_on(seconds),
            9 => {
                if self.turn() {
                    self.state[1] = self.limits.velocity * self.chance.between(-1.1, 1.1);
                }
                self.state[0] = (self.state[0] + self.state[1] * seconds).clamp(0.0, 1.0);
                self.state[0]
            }
            _ => self.edge(time_ms, judge),
        }
    }

    /// Whether something new begins.
    fn turn(&mut self) -> bool {
        if self.left == 0 {
            self.left = self.chance.below(2 * self.span + 2);
            return true;
        }
        self.left -= 1;
        false
    }

    /// Gathers speed within the limits, and keeps it to the end of the stroke and past it.
    fn run_on(&mut self, seconds: f64) -> f64 {
        let [_, velocity, acceleration, _] = self.state;
        let sign = if self.start > 0.5 { -1.0 } else { 1.0 };
        let Limits { velocity: most, acceleration: pull, jerk } = self.limits;
        let left = most - sign * velocity;
        let wish = sign * (2.0 * jerk * left.max(0.0)).sqrt().min(pull);
        self.state[2] = acceleration + (wish - acceleration).clamp(-jerk * seconds, jerk * seconds);
        self.state[1] = (velocity + 0.5 * (acceleration + self.state[2]) * seconds).clamp(-most, most);
        self.state[0] += 0.5 * (velocity + self.state[1]) * seconds;
        self.state[0]
    }

    /// Jerk by chance or full, without a thought for what comes of it.
    fn jerk_on(&mut self, seconds: f64) -> f64 {
        if self.turn() {
            let full = self.sort == 10;
            self.state[3] = self.limits.jerk
                * if full { self.chance.one_of(&[-1.0, 1.0, 0.0]) } else { self.chance.between(-1.2, 1.2) };
        }
        let [position, velocity, acceleration, jerk] = self.state;
        let most = self.limits.acceleration;
        self.state[2] = (acceleration + jerk * seconds).clamp(-most, most);
        self.state[1] = (velocity + 0.5 * (acceleration + self.state[2]) * seconds)
            .clamp(-self.limits.velocity, self.limits.velocity);
        self.state[0] = position + 0.5 * (velocity + self.state[1]) * seconds;
        if !(0.0..=1.0).contains(&self.state[0]) {
            self.state = [self.state[0].clamp(0.0, 1.0), 0.0, 0.0, -jerk];
        }
        self.state[0]
    }

    /// Always as far as the measure lets the very next frame go, with no thought for the one after.
    fn edge(&mut self, time_ms: u32, judge: &mut Judge) -> f64 {
        let (low, high) = judge.room(time_ms);
        if self.turn() {
            self.state[1] = if self.sort == 11 {
                self.chance.between(-0.2, 1.2).clamp(0.0, 1.0)
            } else {
                1.0 - self.state[1].round()
            };
        }
        let share = if self.chance.once_in(8) { self.chance.between(0.0, 1.0) } else { self.state[1] };
        low + (high - low) * share
    }
}

/// Those of the bench seat, or any that a seat might have.
fn limits(chance: &mut Chance) -> Limits {
    let seat = Limits::of(&AxisGeometry::BENCH);
    if !chance.once_in(4) {
        return seat;
    }
    let [velocity, acceleration, jerk] =
        [seat.velocity, seat.acceleration, seat.jerk].map(|limit| limit * chance.of_any_size(0.3, 2.0));
    Limits { velocity, acceleration, jerk }
}

/// The swing of a sine at which an axis reaches its first limit.
fn swing(hz: f64, limits: Limits) -> f64 {
    let w = TAU * hz;
    (limits.velocity / w).min(limits.acceleration / (w * w)).min(limits.jerk / (w * w * w)).min(0.5)
}
