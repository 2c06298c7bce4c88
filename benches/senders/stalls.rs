//! Stalls of a tick thread: wake-ups so late that ticks were missed, and whose doing they were.

use std::cell::Cell;
use std::time::Duration;

use kinocue::harness::time::{Clock, MonoTime};
use serde::{Deserialize, Serialize};

/// How long the kernel's real-time throttle takes the processor away, about: what is left of a second behind 950 ms.
const THROTTLED: std::ops::RangeInclusive<Duration> = Duration::from_millis(40)..=Duration::from_millis(60);

/// What there was of them.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Stalls {
    /// Wake-ups a period late, or later.
    pub(crate) count: u64,
    /// Of these, those through which the thread was ready for the most part and the kernel ran others. The rest were slept
    /// or stopped from outside: a virtual machine's processor can be taken away. What a thread waited in small pieces since
    /// the stall before counts with it, so of stalls of a millisecond too many are here.
    pub(crate) waiting: u64,
    /// Of those again, the ones as long as the throttle makes them.
    pub(crate) throttled: u64,
    /// The latest wake-up, µs.
    pub(crate) longest_us: f64,
}

/// A clock that notes how late it woke its thread.
pub(crate) struct Watching<'a, C> {
    clock: &'a C,
    period: Duration,
    stalls: Cell<Stalls>,
    /// How long the thread had been kept waiting for a processor when that was last looked at.
    waited: Cell<Duration>,
}

impl<'a, C: Clock> Watching<'a, C> {
    /// For the calling thread.
    pub(crate) fn new(clock: &'a C, period: Duration) -> Self {
        Self { clock, period, stalls: Cell::default(), waited: Cell::new(waited()) }
    }

    pub(crate) fn stalls(&self) -> Stalls {
        self.stalls.get()
    }

    fn stalled(&self, late: Duration, stalls: &mut Stalls) {
        let before = self.waited.replace(waited());
        let waiting = self.waited.get().saturating_sub(before) >= late / 2;
        stalls.count += 1;
        stalls.waiting += u64::from(waiting);
        stalls.throttled += u64::from(waiting && THROTTLED.contains(&late));
    }
}

impl<C: Clock> Clock for Watching<'_, C> {
    fn now(&self) -> MonoTime {
        self.clock.now()
    }

    fn sleep_until(&self, deadline: MonoTime) {
        self.clock.sleep_until(deadline);
        let late = self.clock.now().since(deadline);
        let mut stalls = self.stalls.get();
        stalls.longest_us = stalls.longest_us.max(late.as_secs_f64() * 1e6);
        if late >= self.period {
            self.stalled(late, &mut stalls);
        }
        self.stalls.set(stalls);
    }
}

/// How long the calling thread was ready so far, and not run.
fn waited() -> Duration {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let ns = text.split_whitespace().nth(1).and_then(|ns| ns.parse().ok());
    Duration::from_nanos(ns.unwrap_or(0))
}

/// How long a hypervisor has run others on our processors so far, all of them together, where it tells.
pub(crate) fn stolen() -> Duration {
    let text = std::fs::read_to_string("/proc/stat").unwrap_or_default();
    let ticks = text.split_whitespace().nth(8).and_then(|ticks| ticks.parse().ok());
    // In hundredths of a second, whatever the kernel's own tick (proc(5), USER_HZ).
    Duration::from_millis(10 * ticks.unwrap_or(0))
}
