//! When to drain replies: often enough to keep the accounts current, never when a tick is due.

use std::time::Duration;

use crate::time::{MonoTime, nanos};

/// The longest time between two drains: an emergency stop is known by then.
const LONGEST: Duration = Duration::from_millis(5);
/// About how long a show that asks for no replies leaves between two drains; its records wait for two seconds.
const RARE: Duration = Duration::from_millis(100);

/// The instants at which replies are drained.
///
/// A period of the show is cut into equal parts of at most 5 ms; a drain falls into the middle of each: as far from the ticks as it can be,
/// and before the next of them, so that an emergency stop that is told within half a period has no frame go out any more. Replies are not
/// waited for, so their number wakes nobody, and the kernel stamps them, so that they may wait.
#[derive(Debug, Clone, Copy)]
pub struct DrainGrid {
    origin: MonoTime,
    period_ns: i128,
    parts: i128,
}

impl DrainGrid {
    /// Drains between the ticks at `origin` and every `period` from there, in both directions.
    ///
    /// # Panics
    /// If the period is zero.
    #[must_use]
    pub fn new(origin: MonoTime, period: Duration) -> Self {
        assert!(!period.is_zero(), "ticks have a period");
        let parts = nanos(period).div_ceil(nanos(LONGEST));
        Self { origin, period_ns: i128::from(nanos(period)), parts: i128::from(parts) }
    }

    /// Drains of a show that asks for no replies: rare, and in the middle between two ticks as well.
    ///
    /// # Panics
    /// If the period is zero.
    #[must_use]
    pub fn rare(origin: MonoTime, period: Duration) -> Self {
        assert!(!period.is_zero(), "ticks have a period");
        let period_ns = i128::from(nanos(period));
        // The middle of an odd number of periods is the middle of one.
        let odd = i128::from(nanos(RARE)).div_euclid(period_ns) | 1;
        Self { origin, period_ns: odd * period_ns, parts: 1 }
    }

    /// The first drain later than `now`.
    #[must_use]
    pub fn next_after(&self, now: MonoTime) -> MonoTime {
        let elapsed = i128::from(now.as_nanos()) - i128::from(self.origin.as_nanos());
        // The part in which `now` lies; its drain may be past already.
        let part = (elapsed * self.parts).div_euclid(self.period_ns);
        let middle = Some(self.middle_of(part)).filter(|&middle| middle > elapsed);
        let next = middle.unwrap_or_else(|| self.middle_of(part + 1)) + i128::from(self.origin.as_nanos());
        MonoTime::from_nanos(u64::try_from(next.max(0)).unwrap_or(u64::MAX))
    }

    /// Nanoseconds from the origin to the middle of a part, rounded down.
    fn middle_of(&self, part: i128) -> i128 {
        ((2 * part + 1) * self.period_ns).div_euclid(2 * self.parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn us(us: u64) -> MonoTime {
        MonoTime::from_nanos(us * 1_000)
    }

    fn drains(grid: DrainGrid, from: MonoTime, count: usize) -> Vec<u64> {
        let next = |at: &MonoTime| Some(grid.next_after(*at));
        std::iter::successors(Some(from), next).skip(1).take(count).map(|at| at.as_nanos() / 1_000).collect()
    }

    #[test]
    fn a_short_period_is_drained_once_in_its_middle() {
        let grid = DrainGrid::new(us(10_000), Duration::from_millis(1));
        assert_eq!(drains(grid, us(10_000), 3), [10_500, 11_500, 12_500]);
        assert_eq!(drains(DrainGrid::new(us(0), Duration::from_millis(2)), us(0), 2), [1_000, 3_000]);
        assert_eq!(drains(DrainGrid::new(us(0), Duration::from_millis(5)), us(0), 2), [2_500, 7_500]);
    }

    #[test]
    fn a_long_period_is_drained_at_least_every_five_milliseconds_off_its_ticks() {
        let grid = DrainGrid::new(us(0), Duration::from_millis(10));
        assert_eq!(drains(grid, us(0), 4), [2_500, 7_500, 12_500, 17_500]);
        let grid = DrainGrid::new(us(0), Duration::from_nanos(16_666_667));
        assert_eq!(drains(grid, us(0), 5), [2_083, 6_250, 10_416, 14_583, 18_750]);
    }

    #[test]
    fn without_replies_drains_are_rare_and_still_off_the_ticks() {
        let millis = |ms| DrainGrid::rare(us(0), Duration::from_millis(ms));
        assert_eq!(drains(millis(1), us(0), 2), [50_500, 151_500]);
        assert_eq!(drains(millis(10), us(0), 2), [55_000, 165_000]);
        assert_eq!(drains(millis(1_000), us(0), 2), [500_000, 1_500_000]);
    }

    #[test]
    fn the_next_drain_is_later_than_now_wherever_now_is() {
        let period = Duration::from_nanos(1_000_000_000 / 59);
        let grid = DrainGrid::new(us(1_000_000), period);
        for start in [0, 3, 999_999, 1_000_000, 1_000_001, 7_654_321] {
            let mut at = us(start);
            for _ in 0..200 {
                let next = grid.next_after(at);
                assert!(next > at && next.since(at) <= LONGEST, "{at:?} {next:?}");
                assert_eq!(grid.next_after(MonoTime::from_nanos(next.as_nanos() - 1)), next);
                at = next;
            }
        }
    }
}
