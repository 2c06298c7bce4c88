//! A bare tick loop on the real clock, scheduled as a play is, alone or against busy threads of our own. The calling thread
//! measures: it may be the only one that may be real-time.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use super::lateness::{LatenessRun, MachineLoad, RATE_HZ};
use crate::sys::clock::Monotonic;
use crate::sys::realtime;
use crate::time::{Clock, MonoTime, Rate, TickGrid, nanos};
use crate::tracker::{Histogram, histogram};

/// From the request to the first tick: time for the busy threads to start.
const RUN_UP: Duration = Duration::from_millis(20);
/// Beyond the end of the run a busy thread ends by itself.
const OVERRUN: Duration = Duration::from_millis(100);

/// Measures for `span`, and counts the ticks in `done` meanwhile. The calling thread stays real-time afterwards, where that
/// was granted, and the memory locked, as in a play.
#[must_use]
pub(crate) fn measure(load: MachineLoad, span: Duration, done: &AtomicU64) -> LatenessRun {
    let mut lateness = histogram();
    let policy = realtime::request().policy;
    let origin = Monotonic.now() + RUN_UP;
    let over = AtomicBool::new(false);
    let (ticks, missed) = thread::scope(|scope| {
        for _ in 0..busy_threads(load) {
            scope.spawn(|| burn(&over, origin + span + OVERRUN));
        }
        let counts = tick(&Monotonic, origin, span, &mut lateness, done);
        over.store(true, Ordering::Relaxed);
        counts
    });
    LatenessRun { load, policy, ticks, missed, lateness }
}

fn busy_threads(load: MachineLoad) -> usize {
    match load {
        MachineLoad::Idle => 0,
        MachineLoad::Loaded => thread::available_parallelism().map_or(1, NonZeroUsize::get),
    }
}

/// Takes processor time at ordinary priority until told to end, but never past `latest`.
fn burn(over: &AtomicBool, latest: MonoTime) {
    // A thread that would be real-time must not burn: it would hold off the ticks, and everybody else.
    if realtime::normal_priority().is_err() {
        return;
    }
    while !over.load(Ordering::Relaxed) && Monotonic.now() < latest {
        std::hint::spin_loop();
    }
}

/// Sleeps from deadline to deadline for `span` and records how late each wake-up was; returns ticks and missed ones.
fn tick(
    clock: &impl Clock,
    origin: MonoTime,
    span: Duration,
    lateness: &mut Histogram,
    done: &AtomicU64,
) -> (u64, u64) {
    let mut grid = TickGrid::new(origin, Rate::from_hz(RATE_HZ));
    let (mut ticks, mut missed) = (0, 0);
    while grid.next_deadline() < origin + span {
        let deadline = grid.next_deadline();
        clock.sleep_until(deadline);
        let now = clock.now();
        lateness.saturating_record(nanos(now.since(deadline)));
        ticks += 1;
        missed += grid.take(now).missed;
        done.store(ticks + missed, Ordering::Relaxed);
    }
    (ticks, missed)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// A clock that wakes each sleeper 7 µs late, except once.
    struct Late {
        now: Cell<MonoTime>,
        sleeps: Cell<u32>,
        once: (u32, Duration),
    }

    impl Clock for Late {
        fn now(&self) -> MonoTime {
            self.now.get()
        }

        fn sleep_until(&self, deadline: MonoTime) {
            let late = if self.sleeps.get() == self.once.0 { self.once.1 } else { Duration::from_micros(7) };
            self.sleeps.set(self.sleeps.get() + 1);
            self.now.set(deadline.max(self.now.get()) + late);
        }
    }

    #[test]
    fn a_stall_shows_whole_and_its_ticks_count_as_missed() {
        let start = MonoTime::from_nanos(5_000_000_000);
        let clock =
            Late { now: Cell::new(start), sleeps: Cell::new(0), once: (10, Duration::from_micros(3_400)) };
        let (mut lateness, done) = (histogram(), AtomicU64::new(0));
        let counts = tick(&clock, start, Duration::from_secs(1), &mut lateness, &done);
        assert_eq!(counts, (997, 3));
        assert_eq!((lateness.len(), done.into_inner()), (997, 1_000));
        assert!(lateness.max().abs_diff(3_400_000) < 3_400, "{}", lateness.max());
        assert!(lateness.value_at_quantile(0.99).abs_diff(7_000) < 100);
    }

    #[test]
    fn busy_threads_end_with_the_run_and_by_themselves_where_it_does_not() {
        let (over, not_over) = (AtomicBool::new(true), AtomicBool::new(false));
        burn(&over, MonoTime::from_nanos(u64::MAX));
        burn(&not_over, MonoTime::from_nanos(0));
    }
}
