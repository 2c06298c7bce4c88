//! Limits the log to one line a second for each cause; the time is an argument.

use std::collections::HashMap;
use std::time::Duration;

use super::Line;
use crate::time::MonoTime;

/// How often a cause gets a line.
const EVERY: Duration = Duration::from_secs(1);
/// Causes that are told apart; those that come on top share one.
const CAUSES: usize = 256;
/// Their name.
const OTHERS: &str = "others";

/// Holds lines back, but never the newest of a cause for longer than a second.
#[derive(Debug, Default)]
pub(super) struct RateLimiter {
    causes: HashMap<String, CauseSeen>,
}

#[derive(Debug)]
struct CauseSeen {
    /// When a line of it passed.
    passed: MonoTime,
    /// The newest since.
    held: Option<Line>,
    /// Those since that were pushed out by a newer one.
    more: u64,
}

impl RateLimiter {
    /// The line if it may pass, with a word about those held back before; else it is held back.
    pub(super) fn offer(&mut self, mut line: Line, now: MonoTime) -> Option<Line> {
        let cause = self.place(&line.cause, now);
        let seen = self.causes.get_mut(&cause)?;
        if now.since(seen.passed) < EVERY {
            seen.more += u64::from(seen.held.replace(line).is_some());
            return None;
        }
        let unsaid = seen.more + u64::from(seen.held.take().is_some());
        (seen.passed, seen.more) = (now, 0);
        add(&mut line, unsaid);
        Some(line)
    }

    /// The newest lines of causes that were held back and fell silent.
    pub(super) fn due(&mut self, now: MonoTime) -> Vec<Line> {
        let due = |seen: &mut CauseSeen| {
            let mut line = seen.held.take_if(|_| now.since(seen.passed) >= EVERY)?;
            add(&mut line, seen.more);
            (seen.passed, seen.more) = (now, 0);
            Some(line)
        };
        self.causes.values_mut().filter_map(due).collect()
    }

    /// When [`Self::due`] has something to give, if nothing else comes.
    pub(super) fn next(&self) -> Option<MonoTime> {
        self.causes.values().filter(|seen| seen.held.is_some()).map(|seen| seen.passed + EVERY).min()
    }

    /// Everything held back, whatever the time: the program ends.
    pub(super) fn rest(&mut self) -> Vec<Line> {
        let rest = |(_, mut seen): (String, CauseSeen)| {
            let mut line = seen.held.take()?;
            add(&mut line, seen.more);
            Some(line)
        };
        self.causes.drain().filter_map(rest).collect()
    }

    /// The cause under which a line is counted, with a place of its own if there is one.
    fn place(&mut self, cause: &str, now: MonoTime) -> String {
        if !self.causes.contains_key(cause) && self.causes.len() >= CAUSES {
            self.causes.retain(|_, seen| seen.held.is_some() || now.since(seen.passed) < EVERY);
        }
        let full = !self.causes.contains_key(cause) && self.causes.len() >= CAUSES;
        let cause = if full { OTHERS } else { cause };
        if !self.causes.contains_key(cause) {
            let passed = now.before(EVERY);
            self.causes.insert(cause.to_owned(), CauseSeen { passed, held: None, more: 0 });
        }
        cause.to_owned()
    }
}

/// Adds how many went unsaid.
fn add(line: &mut Line, unsaid: u64) {
    if unsaid > 0 {
        line.message.push_str(&format!(" (and {unsaid} more)"));
    }
}

#[cfg(test)]
mod tests {
    use super::super::Priority;
    use super::*;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(10_000_000_000) + Duration::from_millis(ms)
    }

    fn line(cause: &'static str, message: impl Into<String>) -> Line {
        Line::new(Priority::Info, cause, message)
    }

    fn words(lines: impl IntoIterator<Item = Line>) -> Vec<String> {
        lines.into_iter().map(|line| line.message).collect()
    }

    #[test]
    fn a_cause_gets_a_line_a_second_and_the_next_says_how_many_went_unsaid() {
        let mut limiter = RateLimiter::default();
        assert_eq!(words(limiter.offer(line("stranger", "from 1"), ms(0))), ["from 1"]);
        for at in 1..1_000 {
            assert_eq!(limiter.offer(line("stranger", "again"), ms(at)), None);
        }
        assert_eq!(words(limiter.offer(line("stranger", "from 2"), ms(1_000))), ["from 2 (and 999 more)"]);
    }

    #[test]
    fn the_newest_line_of_a_cause_that_falls_silent_is_said_a_second_after_the_last() {
        let mut limiter = RateLimiter::default();
        let _ = limiter.offer(line("state", "stopping"), ms(0));
        assert_eq!(limiter.next(), None);
        assert_eq!(limiter.offer(line("state", "stopped"), ms(300)), None);
        assert_eq!(limiter.next(), Some(ms(1_000)));
        assert!(limiter.due(ms(999)).is_empty());
        assert_eq!(words(limiter.due(ms(1_000))), ["stopped"]);
        assert_eq!(limiter.next(), None);
        assert_eq!(limiter.offer(line("state", "parked"), ms(1_500)), None, "that line counts as well");
    }

    #[test]
    fn causes_do_not_hold_each_other_back() {
        let mut limiter = RateLimiter::default();
        let _ = limiter.offer(line("stranger", "a"), ms(0));
        assert!(limiter.offer(line("stop", "stop asked for"), ms(1)).is_some());
    }

    #[test]
    fn a_flood_of_causes_takes_bounded_room_and_few_lines() {
        let mut limiter = RateLimiter::default();
        let mut passed = 0;
        for n in 0..10_000 {
            let flood = Line::new(Priority::Info, format!("cause {n}"), "x");
            passed += usize::from(limiter.offer(flood, ms(n / 100)).is_some());
        }
        assert!(passed <= CAUSES + 1 && limiter.causes.len() <= CAUSES + 1, "{passed}");
        assert!(limiter.offer(line("new", "x"), ms(5_000)).is_some(), "room is made of what fell silent");
    }

    #[test]
    fn at_the_end_nothing_that_was_held_back_is_lost() {
        let mut limiter = RateLimiter::default();
        for n in 0..4 {
            let _ = limiter.offer(line("a", format!("{n}")), ms(n));
        }
        assert_eq!(words(limiter.rest()), ["3 (and 2 more)"]);
    }
}
