//! Where an axis really was, judged by the measure that judges cues.

use crate::motion::{Measure, Spacing};
use crate::time::ShowTime;

use super::TICK_NS;

/// Ticks from one sample to the next: 1.2 ms.
const SAMPLE: u64 = 10;
/// Samples that say that it stood still before: more than the measure looks back.
const REST: u64 = 90;

/// What an axis executed: places in counts from the lower stop, seconds of its own crystal.
#[derive(Debug, Clone)]
pub(crate) struct Executed {
    /// The lowest place.
    pub(crate) lowest: f64,
    /// The highest.
    pub(crate) highest: f64,
    /// The greatest speed, counts a second.
    pub(crate) velocity: f64,
    /// The greatest acceleration, counts a second squared.
    pub(crate) acceleration: f64,
    /// The greatest jerk, counts a second cubed.
    pub(crate) jerk: f64,
    /// How often it jumped: with the driver switched on elsewhere than at its target, or aligned.
    pub(crate) jumps: u32,
    /// The farthest of those, counts.
    pub(crate) farthest_jump: f64,
    measure: Measure,
    sampled: Option<u64>,
}

impl Executed {
    /// One that has seen a place and nothing else.
    pub(crate) fn at(place: f64) -> Self {
        Self {
            lowest: place,
            highest: place,
            velocity: 0.0,
            acceleration: 0.0,
            jerk: 0.0,
            jumps: 0,
            farthest_jump: 0.0,
            measure: measure(),
            sampled: None,
        }
    }

    /// Where it is at a tick; ticks in which it did not move may be left out.
    pub(super) fn see(&mut self, tick: u64, place: f64) {
        self.lowest = self.lowest.min(place);
        self.highest = self.highest.max(place);
        let last = self.sampled.unwrap_or(tick);
        if self.sampled.is_some() && tick < last + SAMPLE {
            return;
        }
        if self.sampled.is_none() || tick > last + SAMPLE {
            self.rest(tick, place);
        }
        let readings = self.measure.push(time(tick + REST * SAMPLE), place);
        self.velocity = self.velocity.max(readings.velocity.value.abs());
        self.acceleration = self.acceleration.max(readings.acceleration.value.abs());
        self.jerk = self.jerk.max(readings.jerk.value.abs());
        self.sampled = Some(tick);
    }

    /// It was pulled from one place to another at once.
    pub(super) fn jump(&mut self, from: f64, to: f64) {
        if from != to {
            self.jumps += 1;
            self.farthest_jump = self.farthest_jump.max((to - from).abs());
            self.sampled = None;
        }
    }

    /// It stood there for long before.
    fn rest(&mut self, tick: u64, place: f64) {
        self.measure = measure();
        for back in (1..REST).rev() {
            self.measure.push(time(tick + (REST - back) * SAMPLE), place);
        }
    }
}

fn measure() -> Measure {
    Measure::new(Spacing::at_rate(1e9 / (f64::from(TICK_NS) * 10.0)))
}

fn time(tick: u64) -> ShowTime {
    ShowTime::from_nanos(i64::try_from(tick.saturating_mul(TICK_NS.into())).unwrap_or(i64::MAX))
}
