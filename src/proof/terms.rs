//! What a proof is about: which cue, on which seats, with which effects, at which rate and level.

use std::ops::Range;
use std::sync::Arc;

use super::Digest;
use crate::config::{Config, Controller, EffectLimit};
use crate::motion::SeatType;
use crate::time::Rate;

/// Axes of the cue, and the seat type that takes them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Part {
    /// The seat type.
    pub(crate) seat: Arc<SeatType>,
    /// The cue's axes, from 0; the first of them is the seat's first.
    pub(crate) axes: Range<usize>,
}

/// An effect with limits.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LimitedEffect {
    /// Its limits.
    pub(crate) limit: EffectLimit,
    /// Its output, as a bit of the Port Out word.
    pub(crate) output: u16,
}

/// What a cue is proved for. Two that are equal need one proof.
#[derive(Debug, Clone, PartialEq)]
pub struct Terms {
    /// The cue.
    pub(crate) cue: Digest,
    /// The different parts of the hall; seats of one type that take the same axes are one.
    pub(crate) parts: Vec<Part>,
    /// The effects whose times are limited.
    pub(crate) effects: Vec<LimitedEffect>,
    /// Frames a second.
    pub(crate) rate: Rate,
    /// Level of motion and vibration, 0 to 1.
    pub(crate) level: f64,
}

impl Terms {
    /// The terms of a play in a hall.
    #[must_use]
    pub(crate) fn of_hall(config: &Config, cue: Digest, rate: Rate, level: f64) -> Self {
        let mut parts: Vec<Part> = Vec::new();
        let part = |one: &Controller| Part { seat: Arc::clone(&one.seat), axes: one.window() };
        for part in config.controllers.iter().map(part) {
            if !parts.contains(&part) {
                parts.push(part);
            }
        }
        let effect = |limit: &EffectLimit| {
            let known = config.effects.iter().find(|effect| effect.name == limit.name);
            LimitedEffect { limit: limit.clone(), output: known.map_or(0, |effect| effect.word()) }
        };
        let effects = config.effect_limits.iter().map(effect).collect();
        Self { cue, parts, effects, rate, level }
    }

    /// The terms of a seat type by itself, which takes so many axes.
    #[must_use]
    pub fn of_seat(seat: Arc<SeatType>, axes: usize, cue: Digest, rate: Rate, level: f64) -> Self {
        Self { cue, parts: vec![Part { seat, axes: 0..axes }], effects: Vec::new(), rate, level }
    }

    /// True if what is proved for these terms holds for `other`: all is the same, but the level may be lower. Motion and
    /// vibration shrink in proportion to the level, about a pose inside the stroke.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn cover(&self, other: &Self) -> bool {
        let same = Self { level: self.level, ..other.clone() } == *self;
        same && (0.0..=self.level).contains(&other.level)
    }
}
