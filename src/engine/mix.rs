//! What an operator sets for a seat, beside where it goes.

use crate::cue::Vibration;
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
    /// Whether the seat takes part at all.
    pub on: bool,
}

impl Mix {
    /// All of the cue.
    pub const FULL: Self = Self { motion: 1.0, vibration: 1.0, effects: u32::MAX, on: true };
    /// No vibration and no effects.
    pub const STILL: Self = Self { motion: 1.0, vibration: 0.0, effects: 0, on: true };

    /// The vibration that is left of the cue's.
    #[must_use]
    pub fn vibration(&self, cue: Vibration) -> Vibration {
        Vibration { amplitude: cue.amplitude * self.vibration, ..cue }
    }

    /// The effects that are left of the cue's.
    #[must_use]
    pub const fn effects(&self, cue: EffectSet) -> EffectSet {
        match cue {
            EffectSet::Named(on) => EffectSet::Named(on & self.effects),
            EffectSet::Word(word) if self.effects == u32::MAX => EffectSet::Word(word),
            EffectSet::Word(_) => EffectSet::Word(0),
        }
    }
}
