//! What an operator sets for a seat, beside where it goes.

use crate::channel::{ChannelId, LevelRule, PartKind, Sample};
use crate::timeline::EffectSet;

/// What one lane makes of the cue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mix {
    /// How much of its motion about the neutral pose, 0 to 1.
    pub motion: f64,
    /// How much of its vibration, 0 to 1.
    pub vibration: f64,
    /// Which of its effects may be on, bit by bit in the order of the cue's names; a raw output word needs all of them.
    pub effects: u32,
    /// Which parts of channels may be on, bit by bit in the order of `channel::switches`.
    pub switches: u32,
    /// Whether the seat takes part at all.
    pub on: bool,
}

impl Mix {
    /// All of the cue.
    pub const FULL: Self =
        Self { motion: 1.0, vibration: 1.0, effects: u32::MAX, switches: u32::MAX, on: true };
    /// No vibration, no effects, all outputs off.
    pub(crate) const STILL: Self = Self { motion: 1.0, vibration: 0.0, effects: 0, switches: 0, on: true };

    /// What is left of what the cue says on a channel.
    #[must_use]
    pub(crate) fn sample(&self, channel: ChannelId, cue: Sample) -> Sample {
        let mut left = cue;
        let row = channel.row();
        for ((index, part), value) in (0..).zip(row.parts).zip(&mut left.0) {
            match row.level {
                LevelRule::Scale if part.kind == PartKind::Amplitude => *value *= self.vibration,
                LevelRule::Switch if self.switches >> (row.first_switch() + index) & 1 == 0 => *value = 0.0,
                LevelRule::Scale | LevelRule::Switch => {}
            }
        }
        left
    }

    /// The effects that are left of the cue's.
    #[must_use]
    pub(crate) const fn effects(&self, cue: EffectSet) -> EffectSet {
        match cue {
            EffectSet::Named(on) => EffectSet::Named(on & self.effects),
            // A raw word has no names to tell its bits apart by: with one effect off, all of it is off.
            EffectSet::Word(word) if self.effects == u32::MAX => EffectSet::Word(word),
            EffectSet::Word(_) => EffectSet::Word(0),
        }
    }
}
