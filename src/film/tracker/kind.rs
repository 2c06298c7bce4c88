//! What is known of each kind of source before it is heard.

use std::time::Duration;

use super::{SAMPLES, SAMPLES_AGAIN};

/// A kind of source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum SourceKind {
    /// LTC, by the clock of its samples.
    Ltc,
    /// The film's own sound, by the clock of its samples.
    Sound,
    /// mpv: `audio-pts`, or `time-pos` less a frame where a film has no sound.
    Mpv,
    /// MTC quarter frames.
    Mtc,
    /// Art-Net timecode.
    ArtNet,
    /// Positions by OSC or HTTP.
    Message,
    /// A clock of the day.
    WallClock,
}

/// What a kind is known for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Traits {
    /// Deviation of one sample, seconds; where learning begins.
    pub(super) sigma_s: f64,
    /// Whether its samples can only be late. What is polled, or stamped by the other end, can be early as well: the quickest of
    /// these are no better than the others.
    pub(super) late_only: bool,
    /// Whether it may take a whole second for a sample, and be off by tens of milliseconds.
    pub(super) coarse: bool,
    /// How long the estimate may run on while nothing at all is heard: the estimate would be good for much longer, but nobody
    /// knows if the film still runs.
    pub(super) silent_for: Duration,
}

impl Traits {
    /// Positions that have to fit before a lock of which nothing is known from before.
    pub(super) const fn samples(self) -> u32 {
        if self.coarse { SAMPLES_AGAIN } else { SAMPLES }
    }
}

impl SourceKind {
    pub(super) const fn traits(self) -> Traits {
        let (sigma_ms, late_only, coarse) = match self {
            Self::Ltc => (0.05, false, false),
            Self::Sound => (0.3, false, false),
            Self::Mpv => (0.2, false, false),
            Self::Mtc => (0.5, true, false),
            Self::ArtNet => (4.0, true, false),
            Self::Message => (10.0, false, true),
            Self::WallClock => (0.02, false, false),
        };
        Traits { sigma_s: sigma_ms * 1e-3, late_only, coarse, silent_for: Duration::from_secs(2) }
    }
}
