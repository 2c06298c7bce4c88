//! The Times of the frames of a rate, without a division for each.

use crate::time::Rate;

/// Where a frame is on the grid of its rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameTimes {
    rate: Rate,
    millihertz: u64,
    /// A period, whole milliseconds, and what it leaves over.
    period: (u32, u64),
    /// The frame that comes next, as far as is known.
    frame: u64,
    /// What the sum of all Times before that frame leaves over when it is rounded, in shares of a millisecond.
    over: u64,
}

impl FrameTimes {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1,000 to 1,000,000")]
    pub(super) fn new(rate: Rate) -> Self {
        let millihertz = (rate.hz() * 1000.0).round() as u64;
        let period = ((1_000_000 / millihertz) as u32, 1_000_000 % millihertz);
        let mut times = Self { rate, millihertz, period, frame: 0, over: 0 };
        times.seek(0);
        times
    }

    fn seek(&mut self, frame: u64) {
        // In whole numbers: a sum of seconds would drift against the Times that are sent.
        let over =
            (u128::from(frame) * 1_000_000 + u128::from(self.millihertz / 2)) % u128::from(self.millihertz);
        self.over = u64::try_from(over).expect("less than what it was divided by");
        self.frame = frame;
    }

    /// The Time of `frame`, ms: that of [`Rate::time_ms`].
    #[inline]
    pub(super) fn of(&mut self, frame: u64) -> u32 {
        if frame != self.frame {
            self.seek(frame);
        }
        self.next()
    }

    /// The Time of the frame after the last one that was asked for, ms.
    #[inline]
    pub(super) fn next(&mut self) -> u32 {
        self.frame += 1;
        // The remainder wraps at each frame that is a millisecond longer; no sum grows with the frames.
        self.over += self.period.1;
        if self.over < self.millihertz {
            return self.period.0;
        }
        self.over -= self.millihertz;
        self.period.0 + 1
    }

    /// True if all frames have the same Time.
    pub(super) const fn are_even(&self) -> bool {
        1_000_000_u64.is_multiple_of(self.millihertz)
    }

    /// Seconds from tick to tick.
    pub(super) fn period(&self) -> f64 {
        1.0 / self.rate.hz()
    }

    /// The Time that most frames have, ms.
    pub(super) fn usual_ms(&self) -> u32 {
        // The first Time is the period rounded to the nearest, which at least half of the frames have.
        self.rate.time_ms(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_those_of_the_rate_whichever_frame_is_asked_for() {
        for hz in [1.0, 23.976, 50.0, 60.0, 119.88, 333.0, 999.0, 1000.0] {
            let rate = Rate::from_hz(hz);
            let mut times = FrameTimes::new(rate);
            for frame in (0..500).chain([70_000_000_000, 70_000_000_001, 3]) {
                assert_eq!(times.of(frame), rate.time_ms(frame), "{hz} Hz, frame {frame}");
            }
        }
    }
}
