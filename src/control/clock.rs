//! How far the wall clock of this machine may be off a time server's, as the link of the fleet has measured it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::ClockStatus;
use crate::time::{MonoTime, WallAt};

/// A measurement that is older says nothing of now: the link makes one each 16 s.
const OLDEST: Duration = Duration::from_secs(40);
/// What a clock may be off by since it was measured, ns per second: 50 ppm, as the crystals of machines are.
const DRIFT_NS_PER_S: f64 = 50_000.0;
/// The longest name of a server.
const LONGEST: usize = 255;
/// A round trip that is longer measures nothing.
const LONGEST_TRIP: Duration = Duration::from_secs(1);

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ClockReading {
    server: String,
    /// How far the wall clock was ahead of the server's, ns.
    offset_ns: i64,
    /// Half of how long the question and its answer were under way, ns.
    half_trip_ns: u64,
    /// When it was.
    at: MonoTime,
    /// What the wall clock showed when the machine's clock showed zero, ns: another once it was set.
    epoch_ns: i128,
}

/// Where the newest measurement stands.
#[derive(Debug, Clone, Default)]
pub(crate) struct SharedClock(Arc<Mutex<Option<ClockReading>>>);

impl ClockReading {
    /// What was measured so long ago; why that is nothing.
    pub(crate) fn of(
        server: String,
        offset_ns: i64,
        trip_ns: u64,
        age: Duration,
        now: &WallAt,
    ) -> Result<Self, String> {
        if server.is_empty() || server.len() > LONGEST || server.chars().any(char::is_control) {
            return Err(format!("a time server has a name of 1 to {LONGEST} characters"));
        }
        if Duration::from_nanos(trip_ns) > LONGEST_TRIP || age > OLDEST {
            return Err(format!(
                "{trip_ns} ns under way, {:.1} s ago: at most {} s and {} s say anything",
                age.as_secs_f64(),
                LONGEST_TRIP.as_secs(),
                OLDEST.as_secs()
            ));
        }
        let half_trip_ns = trip_ns.div_ceil(2);
        Ok(Self { server, offset_ns, half_trip_ns, at: now.at.before(age), epoch_ns: now.epoch_ns() })
    }

    /// How far the clock may be off now; none where it was measured too long ago. Where it was set since, by that much more.
    #[expect(clippy::cast_precision_loss, reason = "for people, and to the microsecond")]
    pub(crate) fn status(&self, now: &WallAt, start_bound: Duration) -> Option<ClockStatus> {
        let age = now.at.since(self.at);
        if age > OLDEST {
            return None;
        }
        let set_ns = (now.epoch_ns() - self.epoch_ns).unsigned_abs() as f64;
        let measured_ns = self.offset_ns.unsigned_abs() as f64 + self.half_trip_ns as f64;
        let bound_ns = measured_ns + set_ns + DRIFT_NS_PER_S * age.as_secs_f64();
        Some(ClockStatus {
            server: self.server.clone(),
            offset_us: self.offset_ns as f64 / 1e3,
            bound_us: bound_ns / 1e3,
            start_bound_us: start_bound.as_secs_f64() * 1e6,
            age_s: age.as_secs_f64(),
        })
    }
}

impl SharedClock {
    /// Has this from now on.
    pub(crate) fn set(&self, reading: ClockReading) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(reading);
    }

    /// How far the clock may be off now; none where nobody knows.
    pub(crate) fn status(&self, now: &WallAt, start_bound: Duration) -> Option<ClockStatus> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).as_ref()?.status(now, start_bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: u64) -> WallAt {
        let at = MonoTime::from_nanos(1_000_000_000_000) + Duration::from_secs(seconds);
        WallAt { at, wall_ns: 1_795_306_800_000_000_000 + seconds * 1_000_000_000 }
    }

    fn bound_us(reading: &ClockReading, now: &WallAt) -> Option<f64> {
        reading.status(now, Duration::from_millis(2)).map(|status| status.bound_us)
    }

    #[test]
    fn a_bound_grows_with_its_age_and_is_none_once_it_is_old() {
        let of = |offset_ns| ClockReading::of("ntp".to_owned(), offset_ns, 300_000, Duration::ZERO, &at(0));
        for offset_ns in [100_000, -100_000] {
            let reading = of(offset_ns).unwrap();
            assert_eq!(bound_us(&reading, &at(0)), Some(250.0), "the offset, and half of the way");
            assert_eq!(bound_us(&reading, &at(16)), Some(250.0 + 800.0));
            assert_eq!(bound_us(&reading, &at(40)), Some(250.0 + 2_000.0));
            assert_eq!(bound_us(&reading, &at(41)), None);
        }
        let late = ClockReading::of("ntp".to_owned(), 0, 0, Duration::from_secs(39), &at(0)).unwrap();
        assert_eq!(bound_us(&late, &at(2)), None, "it was old when it came");
        for (server, trip_ns, age_s) in
            [("", 0, 0), ("a\nb", 0, 0), ("ntp", 1_000_000_001, 0), ("ntp", 0, 41)]
        {
            let server = server.to_owned();
            let age = Duration::from_secs(age_s);
            assert!(ClockReading::of(server.clone(), 0, trip_ns, age, &at(0)).is_err(), "{server:?}");
        }
    }

    #[test]
    fn a_clock_that_is_set_after_it_was_measured_is_off_by_that_much_more() {
        let reading = ClockReading::of("ntp".to_owned(), 0, 0, Duration::ZERO, &at(0)).unwrap();
        for step_ns in [5_000_000_i64, -5_000_000] {
            let set = WallAt { wall_ns: at(0).wall_ns.saturating_add_signed(step_ns), ..at(0) };
            assert_eq!(bound_us(&reading, &set), Some(5_000.0));
        }
    }
}
