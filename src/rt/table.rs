//! How each controller stands, as the ack thread tells it ten times a second.

use std::time::Duration;

use crate::drive::LeftOn;
use crate::health::{HealthState, Why};
use crate::observe::ControllerState;
use crate::time::MonoTime;
use crate::tracker::{Counts, Tracker};

/// Controllers whose percentiles are looked up in one telling; the others keep theirs until it is their turn.
const AT_A_TIME: usize = 32;

/// One controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Its accounts since the program started.
    pub counts: Counts,
    /// Latency of its acks, ns; none where there were none.
    pub(crate) ack_ns: Option<AckTimes>,
    /// How its group stands.
    pub standing: HealthState,
    /// Why.
    pub why: Why,
    /// What it said of itself.
    pub(crate) state: ControllerState,
    /// Whether it knows its position; none where it never told.
    pub(crate) homed: Option<bool>,
    /// What may be on there, by its own word where it told.
    pub left_on: LeftOn,
    /// Since when something may be that nobody asks for; none where frames say what is on, or nothing is.
    pub(crate) left_since: Option<MonoTime>,
    /// When this was told.
    pub at: MonoTime,
}

impl Row {
    /// True if something may have been on for that long that nobody asks for.
    #[must_use]
    pub fn is_left_on_for(&self, long: Duration) -> bool {
        self.left_since.is_some_and(|since| self.at.since(since) >= long)
    }
}

/// Percentiles of ack latency, ns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct AckTimes {
    /// Half of them are no longer.
    pub(crate) p50: u64,
    /// 99 of 100.
    pub(crate) p99: u64,
}

/// Whose percentiles are looked up next.
#[derive(Debug, Default)]
pub(super) struct Turns(usize);

impl Turns {
    /// Brings the percentiles of the next few controllers up to date.
    pub(super) fn look_up(&mut self, rows: &mut [Row], tracker: &Tracker) {
        for _ in 0..rows.len().min(AT_A_TIME) {
            self.0 = (self.0 + 1) % rows.len();
            let latency = tracker.latency(self.0);
            rows[self.0].ack_ns = (!latency.is_empty()).then(|| AckTimes {
                p50: latency.value_at_quantile(0.5),
                p99: latency.value_at_quantile(0.99),
            });
        }
    }
}
