//! What a frame says of time: its own duration, or a running sum of all durations since a discontinuity.

use crate::wire::Timing;

/// The Time field of the frames of one play.
#[derive(Debug, Clone)]
pub(super) struct Stamps {
    timing: Timing,
    sum_ms: u32,
    bridge: bool,
}

impl Stamps {
    /// Stamps of a play: an absolute sum starts at one period with the first frame.
    #[must_use]
    pub(super) const fn new(timing: Timing) -> Self {
        Self { timing, sum_ms: 0, bridge: false }
    }

    /// The next frame does not go on from the last: it is relative, and the sum starts again after it.
    pub(super) fn break_off(&mut self) {
        self.bridge = true;
    }

    /// The next frame holds a pose: it is relative, and a sum starts after it.
    pub(super) fn hold(&mut self) {
        (self.bridge, self.sum_ms) = (true, 0);
    }

    /// How the next frame, of `time_ms`, is sent: the timing it uses and the Time it says.
    pub(super) fn next(&mut self, time_ms: u32) -> (Timing, u32) {
        let sum = self.sum_ms.checked_add(time_ms);
        match (self.timing, sum) {
            (Timing::Relative, _) => (Timing::Relative, time_ms),
            (Timing::Absolute, Some(sum)) if !self.bridge => {
                self.sum_ms = sum;
                (Timing::Absolute, sum)
            }
            // After 49.7 days the sum is full: a discontinuity like any other.
            (Timing::Absolute, _) => {
                (self.bridge, self.sum_ms) = (false, 0);
                (Timing::Relative, time_ms)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absolute_time_starts_at_one_period_and_again_so_after_a_relative_frame() {
        let mut stamps = Stamps::new(Timing::Absolute);
        assert_eq!([stamps.next(10), stamps.next(10)], [(Timing::Absolute, 10), (Timing::Absolute, 20)]);
        stamps.break_off();
        assert_eq!([stamps.next(10), stamps.next(10)], [(Timing::Relative, 10), (Timing::Absolute, 10)]);
    }

    #[test]
    fn a_full_millisecond_counter_is_bridged_by_a_relative_frame() {
        let mut stamps = Stamps { timing: Timing::Absolute, sum_ms: u32::MAX - 5, bridge: false };
        assert_eq!([stamps.next(10), stamps.next(10)], [(Timing::Relative, 10), (Timing::Absolute, 10)]);
    }
}
