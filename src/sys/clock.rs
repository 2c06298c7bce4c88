//! The machine's clocks: monotonic time for every decision, wall time only to read the kernel's stamps.

use std::time::Duration;

use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};
use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

use crate::time::{Clock, MonoTime, WallAt};

const NANOS_PER_SECOND: u64 = 1_000_000_000;

/// The machine's clock since it booted (`CLOCK_BOOTTIME`): never set, never steps. It goes on while the machine is suspended: a
/// show must find itself late then, and an armed hall lapse, where by `CLOCK_MONOTONIC` no time would have passed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Monotonic;

impl Clock for Monotonic {
    fn now(&self) -> MonoTime {
        MonoTime::from_nanos(read(ClockId::Boottime))
    }

    /// Sleeps in the kernel until the absolute instant, so that no work before it adds to it; a signal does not end it.
    fn sleep_until(&self, deadline: MonoTime) {
        let deadline = timespec(deadline);
        while clock_nanosleep_absolute(ClockId::Boottime, &deadline) == Err(Errno::INTR) {}
    }
}

/// The wall clock (`CLOCK_REALTIME`) in nanoseconds since 1970. It may step at any time; good for nothing but the age
/// of a stamp that the kernel took with the same clock.
#[must_use]
pub fn wall_now_ns() -> u64 {
    read(ClockId::Realtime)
}

/// Readings of both clocks of which the best is taken.
const READINGS: usize = 5;

/// What the wall clock shows now: of some readings between two of the machine's clock the one with the least time between.
#[must_use]
pub(crate) fn wall_at() -> WallAt {
    let readings = (0..READINGS).map(|_| {
        let (before, wall_ns, after) = (Monotonic.now(), wall_now_ns(), Monotonic.now());
        let width = after.since(before);
        (width, WallAt { at: before + width / 2, wall_ns })
    });
    readings.min_by_key(|(width, _)| *width).map(|(_, reading)| reading).unwrap_or_default()
}

/// The wall clock in the machine's time zone, for people: schedules, journals, reports. It may step at any time.
#[must_use]
pub(crate) fn local_now() -> Zoned {
    let now = Timestamp::from_nanosecond(i128::from(wall_now_ns())).unwrap_or(Timestamp::UNIX_EPOCH);
    now.to_zoned(TimeZone::system())
}

/// The zone of a time as people know it: its name in the IANA database, or its offset where it has none.
#[must_use]
pub(crate) fn zone_name(at: &Zoned) -> String {
    let name = at.time_zone().iana_name().filter(|name| *name != "Etc/Unknown");
    name.map_or_else(|| at.strftime("%:z").to_string(), str::to_owned)
}

/// Processor time that the calling thread has used so far, in user code and in the kernel.
#[must_use]
pub fn thread_cpu_time() -> Duration {
    Duration::from_nanos(read(ClockId::ThreadCPUTime))
}

fn read(clock: ClockId) -> u64 {
    let now = clock_gettime(clock);
    unsigned(now.tv_sec).saturating_mul(NANOS_PER_SECOND).saturating_add(unsigned(now.tv_nsec))
}

/// A wall clock may stand before 1970; such a reading is of no use and counts as zero.
fn unsigned(part: i64) -> u64 {
    u64::try_from(part).unwrap_or(0)
}

fn timespec(at: MonoTime) -> Timespec {
    let ns = at.as_nanos();
    Timespec {
        tv_sec: i64::try_from(ns / NANOS_PER_SECOND).expect("2^64 nanoseconds are fewer than 2^63 seconds"),
        tv_nsec: i64::try_from(ns % NANOS_PER_SECOND).expect("less than a second of nanoseconds"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sleep_ends_at_or_after_its_deadline_and_a_past_one_at_once() {
        let start = Monotonic.now();
        Monotonic.sleep_until(start + Duration::from_millis(2));
        assert!(Monotonic.now().since(start) >= Duration::from_millis(2));
        Monotonic.sleep_until(MonoTime::from_nanos(0));
        Monotonic.sleep_until(start);
    }

    #[test]
    fn both_clocks_are_read_together() {
        let (before, reading, after) = (Monotonic.now(), wall_at(), Monotonic.now());
        assert!((before..=after).contains(&reading.at) && reading.wall_ns > 0);
        assert_eq!(reading.instant(i128::from(reading.wall_ns) + 7), reading.at + Duration::from_nanos(7));
        assert_eq!(reading.instant(-1), MonoTime::from_nanos(0), "before the machine was started");
    }

    #[test]
    fn an_instant_is_split_into_seconds_and_nanoseconds() {
        let at = timespec(MonoTime::from_nanos(3_000_000_007));
        assert_eq!((at.tv_sec, at.tv_nsec), (3, 7));
    }

    #[test]
    fn processor_time_of_a_thread_only_grows() {
        let before = thread_cpu_time();
        assert!(thread_cpu_time() >= before);
    }
}
