//! What a limiter had to do: plain data.

use crate::plain;

// Chosen: one is an accident, three in a second have a cause that will make more of them.
/// Clamps within a second that make a fault.
const FAULT: usize = 3;
/// The second they have to fall into, ms; also how long a single clamp may last before it is one.
const FAULT_MS: u64 = 1000;

/// Which limit was in the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// The ends of the stroke, or a position that is no number.
    Position,
    /// Distance over Time.
    Velocity,
    /// Change of velocity from one frame to the next.
    Step,
    /// Twice the second divided difference, over one of the two distances.
    Acceleration,
    /// Six times the third divided difference, over one of the two distances.
    Jerk,
    /// None yet, but no way to rest within the limits was found from there.
    WayOut,
}

plain::displayed!(Limit {
    Self::Position => "position",
    Self::Velocity => "velocity",
    Self::Step => "change of velocity from frame to frame",
    Self::Acceleration => "acceleration",
    Self::Jerk => "jerk",
    Self::WayOut => "a way to rest",
});

/// A pose that was not let pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clamp {
    /// Place in the frame, counted from 0.
    pub axis: usize,
    /// What was asked for, fraction of the stroke; may be anything, not-a-number included.
    pub asked: f64,
    /// What was sent instead, fraction of the stroke.
    pub allowed: f64,
    /// The limit that was in the way; of several the one exceeded most.
    pub limit: Limit,
    /// How many times the limit it was: above 1, infinite where a position is outside the stroke or no number.
    pub(crate) times: f64,
}

/// Counts of one lane since the limiter was made.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Counts {
    /// Times that a pose was not let pass; such ticks in a row, on any axes, are one.
    pub clamps: u64,
    /// Ticks on which at least one axis was sent something else than was asked, ways back included.
    pub(crate) held_ticks: u64,
    /// Poses sent beyond a limit because no way within all of them was found.
    pub beyond: u64,
    /// Poses after which a way to rest was looked for: those that come near a limit.
    pub looked: u64,
    /// The clamp that exceeded its limit most.
    pub worst: Option<Clamp>,
    /// True if three clamps ever began within a second, or one lasted as long.
    pub fault: bool,
}

/// Counts clamps and sees when there are too many.
#[derive(Debug, Clone, Default)]
pub(super) struct Counter {
    pub(super) counts: Counts,
    at_ms: u64,
    /// When the latest clamps began, newest first.
    began: [Option<u64>; FAULT],
    clamping: bool,
}

impl Counter {
    /// Hears of a tick's end: whether a pose was refused on it, and whether something else was sent than asked.
    pub(super) fn tick(&mut self, time_ms: u32, refused: bool, held: bool) {
        // By the Times of frames: while none goes out no seat is held back from anything.
        self.at_ms += u64::from(time_ms);
        self.counts.held_ticks += u64::from(held);
        // By beginnings: the same clamp has ten times the frames at ten times the rate.
        if refused && !self.clamping {
            self.counts.clamps += 1;
            self.began.rotate_right(1);
            self.began[0] = Some(self.at_ms);
            let earliest = self.began[FAULT - 1];
            self.counts.fault |= earliest.is_some_and(|began| self.at_ms - began <= FAULT_MS);
        } else if refused {
            // One that lasts is no better than three: the seat is not where the show is.
            self.counts.fault |= self.began[0].is_some_and(|began| self.at_ms - began >= FAULT_MS);
        }
        self.clamping = refused;
    }

    /// Hears of a refused pose.
    pub(super) fn refused(&mut self, clamp: Clamp) {
        if self.counts.worst.is_none_or(|worst| clamp.times > worst.times) {
            self.counts.worst = Some(clamp);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clamp_that_lasts_a_second_is_a_fault_and_one_that_ends_a_frame_before_is_none() {
        let mut counter = Counter::default();
        (0..100).for_each(|_| counter.tick(10, true, true));
        assert_eq!((counter.counts.clamps, counter.counts.fault), (1, false));
        counter.tick(10, true, true);
        assert_eq!((counter.counts.clamps, counter.counts.fault), (1, true));
    }
}
