//! Sound into the instants at which it changes sign, finer than its samples.

/// Below this there is hum and hiss and no timecode, of full scale: -60 dB.
const SILENT: f32 = 0.001;
/// The share of the signal's height that a change of sign has to pass. Noise of a third of the signal does not.
const PASSES: f32 = 0.35;
/// How much the height that is known may grow with a sample: a click of a few samples makes it no greater, and a signal that sets
/// in is known after 3 ms.
const GROWS: f32 = 1.05;
/// In this time a height that was is forgotten, seconds: a few bits, so that a hole of a millisecond does not let noise in.
const SHRINKS_IN_S: f32 = 0.02;
/// What is slower is hum and drift: LTC at a tenth of its speed still has its edges, and 50 Hz as loud as the signal is a third.
const HIGH_PASS_HZ: f32 = 150.0;

/// Finds the edges of a signal.
#[derive(Debug, Clone)]
pub(super) struct LtcEdges {
    keeps: f32,
    shrinks: f32,
    /// The newest sample, as it came and filtered.
    raw: f32,
    sound: f32,
    height: f32,
    is_high: bool,
    /// When the sound was at zero for the last time, samples.
    crossed: f64,
    /// Samples so far.
    count: u64,
}

impl LtcEdges {
    pub(super) fn new(samples_per_s: f32) -> Self {
        Self {
            keeps: 1.0 / (1.0 + std::f32::consts::TAU * HIGH_PASS_HZ / samples_per_s),
            shrinks: (-1.0 / (SHRINKS_IN_S * samples_per_s)).exp(),
            raw: 0.0,
            sound: 0.0,
            height: 0.0,
            is_high: false,
            crossed: 0.0,
            count: 0,
        }
    }

    pub(super) const fn count(&self) -> u64 {
        self.count
    }

    /// The height of the signal, of full scale.
    pub(super) const fn height(&self) -> f32 {
        self.height
    }

    /// Takes a sample of -1 to 1. The instant of an edge that it makes sure of, samples since the first.
    #[expect(clippy::cast_precision_loss, reason = "exact for 5,000 years")]
    pub(super) fn push(&mut self, raw: f32) -> Option<f64> {
        // One pole: a second one would ring after each edge, and shift the next.
        let before = self.sound;
        self.sound = self.keeps * (self.sound + raw - self.raw);
        self.raw = raw;
        let here = self.count as f64;
        self.count += 1;
        self.height =
            (self.height * self.shrinks).max(self.sound.abs().min((self.height * GROWS).max(SILENT / 2.0)));
        // Between two samples sound is a straight line, near enough: the rest is a constant part of a sample.
        if (before < 0.0) != (self.sound < 0.0) {
            self.crossed = here - f64::from(self.sound / (self.sound - before));
        }
        let passes = (PASSES * self.height).max(SILENT / 2.0);
        let turned = if self.is_high { self.sound < -passes } else { self.sound > passes };
        self.is_high ^= turned;
        turned.then_some(self.crossed)
    }
}
