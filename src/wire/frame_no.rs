//! The number of a frame, which counts round.

use std::fmt;

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

    /// How many numbers this one is after `other`; below 0 where it is before it. Right as long as they are less
    /// than 2,147,483,648 apart.
    #[must_use]
    pub const fn since(self, other: Self) -> i32 {
        self.0.wrapping_sub(other.0).cast_signed()
    }
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
}
