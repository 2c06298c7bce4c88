//! Ticks on a grid of absolute deadlines, and Times in whole milliseconds that never leave it.

use std::time::Duration;

use super::MonoTime;

/// Frames per second to every controller, to a thousandth: 1 to 1,000 Hz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate {
    millihertz: u64,
}

impl Rate {
    /// The nearest rate to `hz`, taken into 1 to 1,000 Hz; not-a-number is 1 Hz.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "1,000 to 1,000,000 after the clamp"
    )]
    pub fn from_hz(hz: f64) -> Self {
        Self { millihertz: ((hz.clamp(1.0, 1000.0) * 1000.0).round() as u64).max(1000) }
    }

    /// Ticks per second.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "at most 1,000,000")]
    pub fn hz(self) -> f64 {
        self.millihertz as f64 / 1000.0
    }

    /// From one tick to the next, rounded down to the nanosecond.
    #[must_use]
    pub const fn period(self) -> Duration {
        Duration::from_nanos(1_000_000_000_000 / self.millihertz)
    }

    /// From the origin to tick `index`, exact to the nanosecond however far.
    #[must_use]
    pub fn offset(self, index: u64) -> Duration {
        let ns = u128::from(index) * 1_000_000_000_000 / u128::from(self.millihertz);
        Duration::from_nanos(u64::try_from(ns).unwrap_or(u64::MAX))
    }

    /// How many whole periods there are in a span, each to the nanosecond: the newest tick that is due so long after the origin.
    pub(crate) fn periods_in(self, elapsed: Duration) -> u64 {
        // Offsets are rounded down, so a tick is due within the nanosecond before its exact instant.
        let parts = (elapsed.as_nanos() + 1) * u128::from(self.millihertz);
        u64::try_from((parts - 1) / 1_000_000_000_000).unwrap_or(u64::MAX)
    }

    /// The Time of frame `index`, counted from 0: whole milliseconds, never 0. The sum over all frames before it stays
    /// within half a millisecond of the exact grid.
    #[must_use]
    pub(crate) fn time_ms(self, index: u64) -> u32 {
        self.span_ms(index, 1)
    }

    /// The Times of so many frames together, from frame `index` on.
    ///
    /// # Panics
    /// Where they are longer than 49 days.
    #[must_use]
    pub(crate) fn span_ms(self, index: u64, frames: u32) -> u32 {
        let span = self.sum_ms(index + u64::from(frames)) - self.sum_ms(index);
        u32::try_from(span).expect("a period is at most a second, and no Time is longer than days")
    }

    fn sum_ms(self, frames: u64) -> u128 {
        let half = u128::from(self.millihertz / 2);
        (u128::from(frames) * 1_000_000 + half) / u128::from(self.millihertz)
    }
}

/// A tick that is due now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tick {
    /// Its place on the grid; tick 0 is at the origin.
    pub index: u64,
    /// When it was due.
    pub deadline: MonoTime,
    /// How long ago that was.
    pub late: Duration,
    /// Ticks that were slept through since the one before.
    pub missed: u64,
}

/// The grid of one play.
#[derive(Debug, Clone)]
pub struct TickGrid {
    origin: MonoTime,
    rate: Rate,
    next: u64,
}

impl TickGrid {
    /// A grid whose tick 0 is due at `origin`.
    #[must_use]
    pub const fn new(origin: MonoTime, rate: Rate) -> Self {
        Self { origin, rate, next: 0 }
    }

    /// Its rate.
    #[must_use]
    pub(crate) const fn rate(&self) -> Rate {
        self.rate
    }

    /// When the next tick is due.
    #[must_use]
    pub fn next_deadline(&self) -> MonoTime {
        self.origin + self.rate.offset(self.next)
    }

    /// The first tick that is due at that instant or later, and when: its index, its deadline.
    #[must_use]
    pub(crate) fn first_from(&self, at: MonoTime) -> (u64, MonoTime) {
        let newest = self.rate.periods_in(at.since(self.origin));
        let due = |index: u64| self.origin + self.rate.offset(index);
        let index = if due(newest) < at { newest + 1 } else { newest };
        (index, due(index))
    }

    /// The newest tick due at `now`, which is not before [`Self::next_deadline`]; those slept through are counted, never
    /// served.
    pub(crate) fn take(&mut self, now: MonoTime) -> Tick {
        let index = self.rate.periods_in(now.since(self.origin)).max(self.next);
        let deadline = self.origin + self.rate.offset(index);
        let tick = Tick { index, deadline, late: now.since(deadline), missed: index - self.next };
        self.next = index + 1;
        tick
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn us(us: u64) -> MonoTime {
        MonoTime::from_nanos(us * 1000)
    }

    #[test]
    fn a_late_wakeup_takes_the_newest_slot_and_counts_the_rest() {
        let mut grid = TickGrid::new(us(0), Rate::from_hz(1000.0));
        assert_eq!(grid.take(us(10)).index, 0);
        let tick = grid.take(us(3500)); // slept through 1 and 2
        assert_eq!((tick.index, tick.missed, tick.late), (3, 2, Duration::from_micros(500)));
    }

    #[test]
    fn the_first_tick_from_an_instant_on_is_the_one_that_is_due_there_or_the_next() {
        for hz in [1.0, 3.0, 23.976, 60.0, 999.999, 1000.0] {
            let grid = TickGrid::new(us(77), Rate::from_hz(hz));
            for index in [0, 1, 2, 1_000, 3_153_600_000] {
                let due = us(77) + grid.rate().offset(index);
                assert_eq!(grid.first_from(due), (index, due), "{hz} Hz");
                let next = us(77) + grid.rate().offset(index + 1);
                assert_eq!(grid.first_from(due + Duration::from_nanos(1)), (index + 1, next), "{hz} Hz");
            }
            assert_eq!(grid.first_from(us(3)), (0, us(77)));
        }
    }

    #[test]
    fn every_tick_is_taken_once_when_woken_on_the_deadline() {
        for hz in [1.0, 3.0, 23.976, 60.0, 600.0, 999.999, 1000.0] {
            let mut grid = TickGrid::new(us(77), Rate::from_hz(hz));
            for index in 0..5_000 {
                let due = grid.next_deadline();
                assert_eq!(
                    grid.take(due),
                    Tick { index, deadline: due, late: Duration::ZERO, missed: 0 },
                    "{hz} Hz"
                );
            }
        }
    }

    #[test]
    fn times_are_whole_never_zero_and_their_sum_stays_on_the_grid() {
        for hz in [1.0, 7.0, 23.976, 59.94, 60.0, 600.0, 700.0, 999.0, 1000.0] {
            let rate = Rate::from_hz(hz);
            let mut sum = 0.0;
            for frame in 0..20_000 {
                let time = rate.time_ms(frame);
                assert!(time > 0, "{hz} Hz");
                sum += f64::from(time);
                let exact = rate.offset(frame + 1).as_secs_f64() * 1e3;
                assert!((sum - exact).abs() <= 0.5001, "{hz} Hz: {sum} ms against {exact} ms");
            }
        }
        let sixty: Vec<u32> = (0..3).map(|frame| Rate::from_hz(60.0).time_ms(frame)).collect();
        assert_eq!(sixty, [17, 16, 17]);
    }

    #[test]
    fn ten_years_of_ticks_do_not_drift() {
        let rate = Rate::from_hz(1000.0);
        let ten_years = 315_360_000_000;
        assert_eq!(rate.offset(ten_years), Duration::from_secs(315_360_000));
        assert_eq!(rate.time_ms(ten_years), 1);
    }
}
