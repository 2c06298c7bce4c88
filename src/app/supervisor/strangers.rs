//! Answers to frames that were not sent from here. A controller answers to the machine that its settings name, whoever asked;
//! so they are the sign of another machine that sends to the same seat.

use std::collections::VecDeque;
use std::time::Duration;

use crate::rt::Row;
use crate::time::MonoTime;

/// Over how long they are counted.
const COUNTED: Duration = Duration::from_secs(60);
/// How often a count is kept.
const EVERY: Duration = Duration::from_secs(1);
/// As many may be a doubled or belated datagram of a network in trouble.
const TOLERATED: u64 = 10;

/// What was counted of the last minute.
#[derive(Debug, Default)]
pub(super) struct Strangers {
    /// Answers to nothing, by controller, oldest first.
    counted: VecDeque<(MonoTime, Vec<u64>)>,
    newest: Vec<u64>,
}

impl Strangers {
    /// Notes what is counted now.
    pub(super) fn note(&mut self, table: &[Row], now: MonoTime) {
        // Nothing to count from has been told yet.
        if table.is_empty() {
            return;
        }
        self.newest = table.iter().map(|row| row.counts.stray + row.counts.duplicate).collect();
        if self.counted.back().is_none_or(|(at, _)| now.since(*at) >= EVERY) {
            self.counted.push_back((now, self.newest.clone()));
        }
        while self.counted.len() > 1 && self.counted.front().is_some_and(|(at, _)| now.since(*at) > COUNTED) {
            self.counted.pop_front();
        }
    }

    /// How many answers of the last minute make another machine likely; `None` if too few came.
    pub(super) fn of(&self, controller: usize) -> Option<u64> {
        let before = self.counted.front()?.1.get(controller)?;
        let grown = self.newest.get(controller)?.saturating_sub(*before);
        (grown > TOLERATED).then_some(grown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::health::{HealthState, Why};
    use crate::tracker::Counts;

    const SECOND: Duration = Duration::from_secs(1);

    fn row(stray: u64, duplicate: u64) -> Row {
        Row {
            counts: Counts { stray, duplicate, ..Counts::default() },
            ack_ns: None,
            standing: HealthState::Ok,
            why: Why::Acked,
            left_on: crate::drive::LeftOn::default(),
            left_since: None,
            state: crate::observe::ControllerState::default(),
            homed: None,
            at: MonoTime::default(),
        }
    }

    #[test]
    fn many_answers_to_nothing_within_a_minute_tell_of_another_machine_until_they_have_stopped_for_one() {
        let mut strangers = Strangers::default();
        let mut at = MonoTime::default();
        strangers.note(&[row(0, 0), row(500, 0)], at);
        assert_eq!((strangers.of(0), strangers.of(1)), (None, None), "what came before is not new");
        at = at + SECOND;
        strangers.note(&[row(10, 0), row(500, 0)], at);
        assert_eq!(strangers.of(0), None, "a network in trouble may double some");
        strangers.note(&[row(30, 12), row(500, 0)], at);
        assert_eq!((strangers.of(0), strangers.of(1)), (Some(42), None));
        for _ in 0..62 {
            assert_eq!(strangers.of(1), None);
            at = at + SECOND;
            strangers.note(&[row(30, 12), row(500, 0)], at);
        }
        assert_eq!(strangers.of(0), None);
    }

    #[test]
    fn they_are_told_in_the_first_minute_as_well() {
        let mut strangers = Strangers::default();
        strangers.note(&[], MonoTime::default());
        strangers.note(&[row(0, 0)], MonoTime::default() + SECOND);
        strangers.note(&[row(40, 0)], MonoTime::default() + 2 * SECOND);
        assert_eq!(strangers.of(0), Some(40));
    }

    #[test]
    fn a_controller_of_which_nothing_was_counted_has_none() {
        assert_eq!(Strangers::default().of(3), None);
    }
}
