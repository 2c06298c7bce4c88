//! What is counted of the last while, for the status.

use std::collections::VecDeque;
use std::time::Duration;

use super::act::{Act, Feature, SupervisorEvent};
use super::hall::HallContext;
use super::strangers::Strangers;
use crate::rt::Row;
use crate::time::MonoTime;

/// Over how long the rate of acks is counted.
const RATED: Duration = Duration::from_secs(1);

/// What is counted of the last while.
#[derive(Debug, Default)]
pub(super) struct Figures {
    pub(super) rates: Rates,
    pub(super) strangers: Strangers,
}

impl Feature for Figures {
    fn on(&mut self, event: &SupervisorEvent<'_>, hall: &HallContext, _out: &mut Vec<Act>) {
        if let SupervisorEvent::Round(table) = event {
            self.rates.note(table, hall.now);
            self.strangers.note(table, hall.now);
        }
    }
}

/// What was counted of the last second.
#[derive(Debug, Default)]
pub(super) struct Rates {
    /// Asked and acked by controller, oldest first.
    counted: VecDeque<(MonoTime, Vec<(u64, u64)>)>,
}

impl Rates {
    /// Notes what is counted now.
    fn note(&mut self, table: &[Row], now: MonoTime) {
        let counted = |row: &Row| (row.counts.asked - row.counts.in_flight(), row.counts.acked);
        self.counted.push_back((now, table.iter().map(counted).collect()));
        while self.counted.len() > 1 && self.counted.front().is_some_and(|(at, _)| now.since(*at) > RATED) {
            self.counted.pop_front();
        }
    }

    /// Acks over frames whose fate is known, of the last second; `None` if there were none.
    pub(super) fn of(&self, controller: usize) -> Option<f64> {
        let (_, first) = self.counted.front()?;
        let (_, last) = self.counted.back()?;
        let (before, now) = (first.get(controller)?, last.get(controller)?);
        let asked = now.0.saturating_sub(before.0);
        #[expect(clippy::cast_precision_loss, reason = "at most some thousand")]
        (asked > 0).then(|| now.1.saturating_sub(before.1) as f64 / asked as f64)
    }
}
