//! Machine time and show time, which cannot be mixed by accident; the grid of ticks; times as a person types them.
//!
//! Pure code is told the time; only `rt`, `net` and `sim` ask for it, through [`Clock`].

mod grid;
mod typed;

pub use grid::{Rate, Tick, TickGrid};
pub(crate) use typed::{
    TRIM_FRAMES, TRIM_MS, TrimChange, is_second_60, parse_duration, parse_time, parse_trim, parse_trim_change,
};

use std::fmt;
use std::ops::{Add, AddAssign, Sub};
use std::time::Duration;

/// A reading of the monotonic clock, in nanoseconds. Never a wall time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct MonoTime(u64);

impl MonoTime {
    /// The instant `ns` nanoseconds after the clock's zero.
    #[must_use]
    pub const fn from_nanos(ns: u64) -> Self {
        Self(ns)
    }

    /// Nanoseconds since the clock's zero.
    #[must_use]
    pub const fn as_nanos(self) -> u64 {
        self.0
    }

    /// The last whole microsecond of the clock that is not after this instant: as recordings have times of frames and of replies.
    #[must_use]
    pub(crate) const fn whole_micros(self) -> Self {
        Self(self.0 - self.0 % 1_000)
    }

    /// How long after `earlier` this is; zero where it is before.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }

    /// The instant `span` before this one; the clock's zero where that lies before it.
    #[must_use]
    pub fn before(self, span: Duration) -> Self {
        Self(self.0.saturating_sub(nanos(span)))
    }
}

impl Add<Duration> for MonoTime {
    type Output = Self;

    fn add(self, span: Duration) -> Self {
        Self(self.0.saturating_add(nanos(span)))
    }
}

/// What the wall clock shows at an instant of the machine's clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct WallAt {
    /// The instant.
    pub(crate) at: MonoTime,
    /// Nanoseconds since 1970.
    pub(crate) wall_ns: u64,
}

impl WallAt {
    /// What it shows at the zero of the machine's clock, ns since 1970; the same until somebody sets it.
    pub(crate) fn epoch_ns(&self) -> i128 {
        i128::from(self.wall_ns) - i128::from(self.at.as_nanos())
    }

    /// The instant at which it shows that, as it is set now, ns since 1970; the clock's zero where that lies before it.
    pub(crate) fn instant(&self, wall_ns: i128) -> MonoTime {
        MonoTime(u64::try_from((wall_ns - self.epoch_ns()).max(0)).unwrap_or(u64::MAX))
    }
}

/// A position in a cue, in nanoseconds from its first sample. Negative before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct ShowTime(i64);

impl ShowTime {
    /// The first sample of the cue.
    pub const ZERO: Self = Self(0);

    /// The position `ns` nanoseconds after the first sample.
    #[must_use]
    pub const fn from_nanos(ns: i64) -> Self {
        Self(ns)
    }

    /// The position `ms` milliseconds after the first sample.
    #[must_use]
    pub const fn from_millis(ms: i64) -> Self {
        Self(ms.saturating_mul(1_000_000))
    }

    /// Nanoseconds from the first sample.
    #[must_use]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// Seconds from the first sample.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "exact for 104 days")]
    pub const fn as_secs_f64(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// How far it is after `start`; negative before it.
    #[must_use]
    pub(crate) const fn since(self, start: Self) -> Self {
        Self(self.0.saturating_sub(start.0))
    }

    /// The position nearest to `seconds`; not-a-number gives zero, what lies outside the range its end.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a saturating cast is what is wanted")]
    pub fn from_secs_f64(seconds: f64) -> Self {
        Self((seconds * 1e9).round() as i64)
    }
}

impl Add<Duration> for ShowTime {
    type Output = Self;

    fn add(self, span: Duration) -> Self {
        Self(self.0.saturating_add_unsigned(nanos(span)))
    }
}

impl AddAssign<Duration> for ShowTime {
    fn add_assign(&mut self, span: Duration) {
        *self = *self + span;
    }
}

impl Sub<Duration> for ShowTime {
    type Output = Self;

    fn sub(self, span: Duration) -> Self {
        Self(self.0.saturating_sub_unsigned(nanos(span)))
    }
}

impl fmt::Display for ShowTime {
    /// `[-][HH:]MM:SS.mmm`, rounded down to the millisecond.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ms = self.0.unsigned_abs() / 1_000_000;
        let (h, m, s, ms) = (ms / 3_600_000, ms / 60_000 % 60, ms / 1_000 % 60, ms % 1_000);
        let sign = if self.0 < 0 { "-" } else { "" };
        if h > 0 {
            write!(f, "{sign}{h:02}:{m:02}:{s:02}.{ms:03}")
        } else {
            write!(f, "{sign}{m:02}:{s:02}.{ms:03}")
        }
    }
}

/// Nanoseconds of a span, saturating after 584 years.
#[must_use]
pub fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}

/// Who knows what time it is: the machine's clock in the program, a hand-turned one in tests.
pub trait Clock {
    /// The present instant.
    fn now(&self) -> MonoTime;

    /// Returns once `now() >= deadline`; a past deadline returns at once.
    fn sleep_until(&self, deadline: MonoTime);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn show_time_reads_as_a_person_writes_it() {
        assert_eq!(ShowTime::from_millis(83_250).to_string(), "01:23.250");
        assert_eq!(ShowTime::from_millis(-1_500).to_string(), "-00:01.500");
        assert_eq!(ShowTime::from_millis(7_200_000).to_string(), "02:00:00.000");
    }

    #[test]
    fn an_earlier_instant_is_no_time_ago() {
        let (a, b) = (MonoTime::from_nanos(10), MonoTime::from_nanos(30));
        assert_eq!(b.since(a), Duration::from_nanos(20));
        assert_eq!(a.since(b), Duration::ZERO);
    }
}
