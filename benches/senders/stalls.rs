//! Stalls of a tick thread: wake-ups so late that ticks were missed.

use std::cell::Cell;
use std::time::Duration;

use kinocue::time::{Clock, MonoTime};
use serde::{Deserialize, Serialize};

/// How long the kernel's real-time throttle takes the processor away, about: what is left of a second behind 950 ms.
const THROTTLED: std::ops::RangeInclusive<Duration> = Duration::from_millis(40)..=Duration::from_millis(60);

/// What there was of them.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Stalls {
    /// Wake-ups a period late, or later.
    pub(crate) count: u64,
    /// Of these, those as late as the throttle makes them.
    pub(crate) throttled: u64,
    /// The latest wake-up, µs.
    pub(crate) longest_us: f64,
}

/// A clock that notes how late it woke its thread.
pub(crate) struct Watching<'a, C> {
    clock: &'a C,
    period: Duration,
    stalls: Cell<Stalls>,
}

impl<'a, C: Clock> Watching<'a, C> {
    pub(crate) fn new(clock: &'a C, period: Duration) -> Self {
        Self { clock, period, stalls: Cell::default() }
    }

    pub(crate) fn stalls(&self) -> Stalls {
        self.stalls.get()
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
        stalls.count += u64::from(late >= self.period);
        stalls.throttled += u64::from(THROTTLED.contains(&late));
        stalls.longest_us = stalls.longest_us.max(late.as_secs_f64() * 1e6);
        self.stalls.set(stalls);
    }
}
