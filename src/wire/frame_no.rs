//! The number of a frame, which counts round.

use std::fmt;
use std::ops::Range;

/// The number of a frame: counted from 1 for each controller, round through 0 after 4,294,967,295. Only this type
/// compares frame numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FrameNo(pub u32);

impl FrameNo {
    /// The number of the first frame.
    pub const FIRST: Self = Self(1);

    /// The number after this one.
    #[must_use]
    pub const fn next(self) -> Self {
        Self(self.0.wrapping_add(1))
    }

    /// True if this is one of the frames that ask, where each `every`-th does from the first on; where 0, none does.
    /// It hangs on nothing but the number, so that whoever missed the frame knows it too.
    #[must_use]
    pub(crate) const fn asks(self, every: u32) -> bool {
        every > 0 && self.0.wrapping_sub(1).is_multiple_of(every)
    }

    /// The first from this one on that asks; this one where none does.
    #[must_use]
    pub(crate) fn that_asks(self, every: u32) -> Self {
        let mut later = (0..every).map(|later| Self(self.0.wrapping_add(later)));
        later.find(|frame| frame.asks(every)).unwrap_or(self)
    }

    /// How many of the `count` frames from this one on ask, where each `every`-th does.
    #[must_use]
    pub(crate) fn asking(self, count: u32, every: u32) -> u32 {
        const ROUND: u64 = 1 << 32;
        let first = u64::from(self.0.wrapping_sub(1));
        let end = first + u64::from(count);
        // The count goes round to 0, and asking begins anew with it.
        let asking = multiples(every, first..end.min(ROUND)) + multiples(every, 0..end.saturating_sub(ROUND));
        u32::try_from(asking).expect("no more than there are frames")
    }

    /// How many numbers this one is after `other`; below 0 where it is before it. Right as long as they are less
    /// than 2,147,483,648 apart.
    #[must_use]
    pub(crate) const fn since(self, other: Self) -> i32 {
        self.0.wrapping_sub(other.0).cast_signed()
    }
}

/// How many numbers in `range` are multiples of `of`; `None` if that is 0.
fn multiples(of: u32, range: Range<u64>) -> u64 {
    if of == 0 { 0 } else { range.end.div_ceil(of.into()) - range.start.div_ceil(of.into()) }
}

impl fmt::Display for FrameNo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_goes_on_where_the_count_goes_round() {
        assert_eq!(FrameNo(u32::MAX).next(), FrameNo(0));
        assert_eq!(FrameNo(3).since(FrameNo(u32::MAX)), 4);
        assert_eq!(FrameNo(u32::MAX).since(FrameNo(3)), -4);
        assert_eq!(FrameNo::FIRST.since(FrameNo::FIRST), 0);
    }

    #[test]
    fn each_nth_frame_asks_from_the_first_on() {
        let asks = |every| (1..=7).filter(|&number| FrameNo(number).asks(every)).collect::<Vec<_>>();
        assert_eq!((asks(1), asks(3), asks(0)), (vec![1, 2, 3, 4, 5, 6, 7], vec![1, 4, 7], vec![]));
        let next = |first, every| FrameNo(first).that_asks(every).0;
        assert_eq!([next(4, 3), next(5, 3), next(6, 3), next(5, 1), next(5, 0)], [4, 7, 7, 5, 5]);
        assert_eq!(next(u32::MAX, 4), 1, "the count goes round");
    }

    #[test]
    fn those_that_ask_are_counted_as_they_would_be_one_by_one() {
        for first in [1, 2, 9, u32::MAX - 25, u32::MAX, 0] {
            for every in [0, 1, 3, 10, 1_000] {
                let mut asking = 0;
                let mut frame = FrameNo(first);
                for count in 0..60 {
                    assert_eq!(FrameNo(first).asking(count, every), asking, "{count} from {first}, {every}");
                    asking += u32::from(frame.asks(every));
                    frame = frame.next();
                }
            }
        }
    }
}
