//! How often somebody may have a moment marked, or what the flight recorder holds written out. Pure: told the time.

use std::time::Duration;

use crate::time::MonoTime;

/// So many may be asked for one after the other, and one more in each [`REFILL`]: some 180 in a show of two hours.
const ROOM: u32 = 60;
const REFILL: Duration = Duration::from_secs(60);
/// One stands for all that are asked for so soon after it.
const APART: Duration = Duration::from_secs(1);

/// Which of them are granted, so that a key that is held or a program that repeats itself fills no file and no disk.
#[derive(Debug, Default)]
pub(crate) struct AskBudget {
    /// Places that are taken.
    used: u32,
    /// Since when the next place is on its way.
    since: MonoTime,
    last: Option<MonoTime>,
    /// Those that were refused since somebody asked how many.
    more: u64,
}

/// Why one is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TooOften {
    /// Another was granted within the last second.
    Same,
    /// There were too many; the next may be granted after so long.
    TooMany(Duration),
}

impl AskBudget {
    /// Grants one.
    ///
    /// # Errors
    /// Why it is one too many: it is counted.
    pub(crate) fn take(&mut self, now: MonoTime) -> Result<(), TooOften> {
        while self.used > 0 && now.since(self.since) >= REFILL {
            self.used -= 1;
            self.since = self.since + REFILL;
        }
        let is_same = self.last.is_some_and(|last| now.since(last) < APART);
        if is_same || self.used >= ROOM {
            self.more += 1;
            let wait = REFILL.saturating_sub(now.since(self.since));
            return Err(if is_same { TooOften::Same } else { TooOften::TooMany(wait) });
        }
        if self.used == 0 {
            self.since = now;
        }
        self.used += 1;
        self.last = Some(now);
        Ok(())
    }

    /// How many were refused since this was asked last.
    pub(crate) fn take_more(&mut self) -> u64 {
        std::mem::take(&mut self.more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn a_key_that_is_held_for_two_hours_is_some_marks_and_a_count_of_the_rest() {
        let mut budget = AskBudget::default();
        let kept: Vec<u64> =
            (0..2 * 3_600_000).step_by(33).filter(|ms| budget.take(at(*ms)).is_ok()).collect();
        assert!(kept.windows(2).all(|pair| pair[1] - pair[0] >= 1_000), "one a second");
        assert_eq!(kept.len(), 60 + 119, "a minute of them, and one a minute");
        let asked = (0..2 * 3_600_000).step_by(33).count();
        assert_eq!(budget.take_more() + kept.len() as u64, asked as u64, "none is kept and none forgotten");
        assert_eq!(budget.take_more(), 0, "they are told once");
    }

    #[test]
    fn whoever_marks_scene_by_scene_is_never_refused_and_who_was_is_told_how_long_to_wait() {
        let mut budget = AskBudget::default();
        assert!((0..1_000).all(|scene| budget.take(at(scene * 60_000)).is_ok()));
        let later = 2_000 * 60_000;
        assert!((0..60).all(|second| budget.take(at(later + second * 1_000)).is_ok()));
        let refused = budget.take(at(later + 60_000 - 1));
        assert_eq!(refused, Err(TooOften::Same));
        let full = |budget: &mut AskBudget, ms| budget.take(at(later + ms));
        assert_eq!(full(&mut budget, 60_000), Ok(()), "the first has made room");
        assert_eq!(full(&mut budget, 61_500), Err(TooOften::TooMany(Duration::from_millis(58_500))));
        assert_eq!(full(&mut budget, 120_000), Ok(()));
    }
}
