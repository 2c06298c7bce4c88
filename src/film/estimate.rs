//! Place and rate of a film from samples of it: a Kalman filter of two states, which learns how noisy its source is.

use std::time::Duration;

use crate::time::MonoTime;

/// How far the rate of a clock wanders, per root of a second: crystals drift 1 to 3 ppm a minute. A greater one follows jitter.
const RATE_WANDERS: f64 = 2e-6;
/// How far off the rate may be at first: a pull-down is 1,000 ppm.
pub(super) const RATE_SIGMA: f64 = 1e-3;
/// How far off it may be once the innovations lean to one side: a rate changes by less than that without anybody telling.
const RATE_LEANS: f64 = 3e-4;
/// Samples over which the noise is learned in the long run; before as many came, all of them count the same.
const NOISE_SAMPLES: f64 = 50.0;
/// A source is never thought to be better than this part of what its kind is known for: silence in the noise is luck.
const NOISE_FLOOR: f64 = 1.0 / 20.0;
/// A source of which most samples miss the gate is thought to be noisier with each, up to this, seconds: broken devices of
/// players step by 20 ms.
const NOISE_MOST_S: f64 = 0.020;
/// What misses the gate is left out, but nothing is that misses by less than this, seconds: a filter that is sure of itself must
/// not throw away a film that was cut by a few milliseconds.
const GATE_LEAST_S: f64 = 0.004;
const GATE_SIGMAS: f64 = 4.0;
/// One in so many innovations makes up their mean. Its deviation is a fifth of theirs, so that 1 is five of its own.
const LEAN_SHARE: f64 = 1.0 / 12.0;
const LEAN_MOST: f64 = 1.0;

/// Where a film is, how fast it runs, and how far off both may be.
#[derive(Debug, Clone)]
pub(super) struct Estimate {
    at: MonoTime,
    media_s: f64,
    rate: f64,
    /// Covariance: of the place, of place and rate, of the rate.
    place_2: f64,
    mixed: f64,
    rate_2: f64,
    /// Variance of one sample.
    noise_2: f64,
    least_noise_2: f64,
    /// Mean of the innovations, as multiples of what was to be expected.
    lean: f64,
    samples: f64,
}

impl Estimate {
    /// A film that is there and runs as the clock does, as far as one sample tells; `sigma_s` is what its kind is known for.
    pub(super) fn new(at: MonoTime, media_s: f64, sigma_s: f64) -> Self {
        let noise_2 = sigma_s * sigma_s;
        let least_noise_2 = noise_2 * NOISE_FLOOR * NOISE_FLOOR;
        Self {
            at,
            media_s,
            rate: 1.0,
            place_2: noise_2,
            mixed: 0.0,
            rate_2: RATE_SIGMA * RATE_SIGMA,
            noise_2,
            least_noise_2,
            lean: 0.0,
            samples: 1.0,
        }
    }

    /// Begins anew elsewhere with what is known of the noise; of the rate as well, if nothing makes that doubtful.
    pub(super) fn move_to(&mut self, at: MonoTime, media_s: f64) {
        (self.at, self.media_s) = (at, media_s);
        // How far off the rate is says nothing any more of how far off the place is.
        (self.place_2, self.mixed, self.lean) = (self.noise_2, 0.0, 0.0);
        // Another place may be another reel: its pull-down has to be found again.
        self.rate_2 = self.rate_2.max(RATE_SIGMA * RATE_SIGMA);
    }

    /// Runs at that rate from here on, which is known well.
    pub(super) const fn set_rate(&mut self, rate: f64, sigma: f64) {
        (self.rate, self.mixed, self.rate_2) = (rate, 0.0, sigma * sigma);
    }

    pub(super) const fn rate(&self) -> f64 {
        self.rate
    }

    pub(super) fn rate_sigma(&self) -> f64 {
        self.rate_2.sqrt()
    }

    /// Deviation of one sample, seconds.
    pub(super) fn noise_s(&self) -> f64 {
        self.noise_2.sqrt()
    }

    /// Seconds from the instant of the last sample; below zero before it.
    fn until(&self, at: MonoTime) -> f64 {
        at.since(self.at).as_secs_f64() - self.at.since(at).as_secs_f64()
    }

    /// Where the film is at an instant, seconds.
    pub(super) fn media_s(&self, at: MonoTime) -> f64 {
        self.media_s + self.rate * self.until(at)
    }

    /// How far off that may be, seconds.
    pub(super) fn sigma_s(&self, at: MonoTime) -> f64 {
        let dt = self.until(at).max(0.0);
        let wander = RATE_WANDERS * RATE_WANDERS * dt * dt * dt / 3.0;
        (self.place_2 + 2.0 * dt * self.mixed + dt * dt * self.rate_2 + wander).max(0.0).sqrt()
    }

    /// Goes on to an instant.
    pub(super) fn predict(&mut self, at: MonoTime) {
        let dt = self.until(at);
        self.media_s += self.rate * dt;
        // A rate that wanders at random: its variance grows by dt, and integrated that of the place by dt³/3, of both by dt²/2.
        let wander = RATE_WANDERS * RATE_WANDERS * dt.abs();
        self.place_2 += 2.0 * dt * self.mixed + dt * dt * self.rate_2 + wander * dt * dt / 3.0;
        // After the place, and before the rate: each goes by what the next one was before.
        self.mixed += dt * self.rate_2 + wander * dt / 2.0;
        self.rate_2 += wander;
        self.at = at;
    }

    /// How far a sample of this instant may miss without being thought wrong, seconds.
    pub(super) fn gate_s(&self, bound: Duration) -> f64 {
        (GATE_SIGMAS * (self.place_2 + self.noise_of(bound)).sqrt()).max(GATE_LEAST_S)
    }

    /// Variance of a sample whose instant is known no better than within a bound.
    fn noise_of(&self, bound: Duration) -> f64 {
        // An instant anywhere in ±b has the variance b²/3.
        self.noise_2 + bound.as_secs_f64().powi(2) / 3.0
    }

    /// Takes up a sample of this instant that is `missed` seconds ahead of the estimate.
    pub(super) fn take_up(&mut self, missed: f64, bound: Duration) {
        let noise_2 = self.noise_of(bound);
        // The gain is the share of what was missed that is the estimate's fault, and not the sample's.
        let expected_2 = self.place_2 + noise_2;
        let (gain, rate_gain) = (self.place_2 / expected_2, self.mixed / expected_2);
        self.media_s += gain * missed;
        self.rate += rate_gain * missed;
        self.rate_2 -= rate_gain * self.mixed;
        self.mixed *= 1.0 - gain;
        self.place_2 *= 1.0 - gain;
        self.samples += 1.0;
        // What is left of a sample beside the estimate that took it up, and how far off that may be, are together its noise;
        // unlike the innovation less the covariance, this is never below zero.
        let left = (1.0 - gain) * missed;
        self.learn(left * left + self.place_2 - (noise_2 - self.noise_2));
        self.lean += (missed / expected_2.sqrt() - self.lean) * LEAN_SHARE;
        if self.lean.abs() > LEAN_MOST {
            // Too many on one side are no chance: the film was cut inside the gate, or its rate changed.
            self.place_2 += self.noise_2 / 2.0;
            self.rate_2 += RATE_LEANS * RATE_LEANS;
            self.lean = 0.0;
        }
    }

    fn learn(&mut self, noise_2: f64) {
        // A fixed share would keep the guess of its kind for the first two seconds of timecode.
        let share = (1.0 / self.samples).max(1.0 / NOISE_SAMPLES);
        self.noise_2 = (self.noise_2 + share * (noise_2 - self.noise_2)).max(self.least_noise_2);
    }

    /// Learns from a sample that missed the gate, as from one that just did: most do, so that the gate is too narrow.
    pub(super) fn widen(&mut self, missed: f64) {
        self.learn(missed.abs().min(NOISE_MOST_S).powi(2));
    }
}
