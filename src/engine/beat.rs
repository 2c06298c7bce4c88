//! What a tick does, and what its frames have in common.

use super::phase::FIRST_ABSOLUTE_MS;
use crate::channel::Samples;
use crate::timeline::EffectSet;
use crate::wire::Timing;

/// What the frames of one tick have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beat {
    /// Which kind of Time they carry.
    pub(crate) timing: Timing,
    /// The Time field.
    pub(crate) time_ms: u32,
    /// How long the frame takes, ms: what a relative one says, and the difference to the one before of an absolute one.
    pub lasts_ms: u32,
    /// What the cue's channels say, in its unit.
    pub(crate) samples: Samples,
    /// The effects that are on.
    pub(crate) effects: EffectSet,
}

impl Beat {
    /// Frames with all channels and effects off.
    #[must_use]
    pub(crate) fn still(timing: Timing, time_ms: u32) -> Self {
        let (samples, effects) = (Samples::REST, EffectSet::Named(0));
        Self { timing, time_ms, lasts_ms: time_ms, samples, effects }
    }

    /// How long a controller takes for the frame where a later one came first, ms: one whose running sum is less than the last has
    /// no Time of its own, and is taken for the first of another sum.
    #[must_use]
    pub(crate) fn at_most_ms(&self) -> u32 {
        match self.timing {
            Timing::Relative => self.lasts_ms,
            Timing::Absolute => self.lasts_ms.max(FIRST_ABSOLUTE_MS),
        }
    }

    /// The same for a frame that takes so many milliseconds, whatever its Time says.
    #[must_use]
    pub(crate) const fn lasting(self, lasts_ms: u32) -> Self {
        Self { lasts_ms, ..self }
    }
}

/// What a tick does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Frames go out ([`super::Engine::beat_of`]).
    Send,
    /// None does: the lanes rest, and have been told so.
    Quiet,
    /// The play has ended.
    Over,
}
