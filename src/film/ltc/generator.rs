//! Labels into the sound of LTC: for tests, and for technicians who have no other generator.

use super::Timecode;
use super::word::{BITS, LtcWord};

/// Makes the samples of LTC, frame after frame, either way and at any speed.
#[derive(Debug, Clone)]
pub(crate) struct LtcGenerator {
    samples_per_s: f64,
    level: f64,
    speed: f64,
    frame: Timecode,
    word: LtcWord,
    /// Half cells of the frame that are behind.
    halves: u32,
    sign: f64,
    /// From here to the next half cell's end, samples.
    left: f64,
    /// Samples so far, and when the newest frame ended.
    made: f64,
    ended: Option<(Timecode, f64)>,
}

impl LtcGenerator {
    /// A generator that begins with that frame; `level` is of full scale.
    pub(crate) fn new(frame: Timecode, samples_per_s: u32, level: f64) -> Self {
        let mut generator = Self {
            samples_per_s: f64::from(samples_per_s),
            level,
            speed: 1.0,
            frame,
            word: LtcWord::of(frame.label(), frame.rate()),
            halves: 0,
            sign: 1.0,
            left: 0.0,
            made: 0.0,
            ended: None,
        };
        generator.left = generator.half_cell();
        generator
    }

    /// How many times as fast as the film it runs from the next half cell on; below zero, backwards from the next frame on.
    #[cfg(test)]
    pub(crate) const fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
    }

    /// The frame that ended in the newest sample, and when, samples since the first.
    #[cfg(test)]
    pub(crate) const fn take_ended(&mut self) -> Option<(Timecode, f64)> {
        self.ended.take()
    }

    fn half_cell(&self) -> f64 {
        let halves_per_s = self.frame.rate().frames_per_second() * f64::from(2 * BITS) * self.speed.abs();
        self.samples_per_s / halves_per_s.max(1.0)
    }

    /// The next sample. An edge within it is in its height: so is the time of it, to a fraction of a sample.
    #[expect(clippy::cast_possible_truncation, reason = "a saturating cast is what is wanted")]
    pub(crate) fn sample(&mut self) -> i16 {
        let (mut rest, mut sum) = (1.0, 0.0);
        while self.left <= rest {
            sum += self.sign * self.left;
            rest -= self.left;
            self.end_half(self.made + 1.0 - rest);
        }
        self.left -= rest;
        self.made += 1.0;
        ((sum + self.sign * rest) * self.level * 32_767.0).round() as i16
    }

    fn end_half(&mut self, at: f64) {
        self.halves += 1;
        let (is_whole, is_backwards) = (self.halves.is_multiple_of(2), self.speed < 0.0);
        let index = (self.halves - 1) / 2;
        let bit = self.word.bit(if is_backwards { BITS - 1 - index } else { index });
        // Biphase mark: each cell begins with an edge, and a 1 has one more in its middle.
        if is_whole || bit {
            self.sign = -self.sign;
        }
        if self.halves == 2 * BITS {
            self.ended = Some((self.frame, at));
            self.frame = self.frame.plus(if is_backwards { -1 } else { 1 });
            self.word = LtcWord::of(self.frame.label(), self.frame.rate());
            self.halves = 0;
        }
        self.left = self.half_cell();
    }
}
