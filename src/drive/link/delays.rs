//! How long units take to answer: what nearly all answers take, of the last ones.

use std::time::Duration;

/// How many answers are looked back on: some seconds of a play.
const KEPT: usize = 256;
/// Before the first answers; a USB adapter whose latency timer is 16 ms still passes.
const AT_FIRST: Duration = Duration::from_millis(17);
/// How many answers are needed to know better.
const ENOUGH: usize = 16;

/// Reply delays, from the last octet of a request to the first of its answer.
#[derive(Debug, Clone)]
pub(crate) struct Delays {
    last: [Duration; KEPT],
    count: usize,
}

impl Delays {
    /// None yet.
    pub(crate) const fn new() -> Self {
        Self { last: [Duration::ZERO; KEPT], count: 0 }
    }

    /// One more.
    pub(crate) fn push(&mut self, delay: Duration) {
        self.last[self.count % KEPT] = delay;
        self.count += 1;
    }

    /// What 99 of 100 did not exceed; a guess on the safe side before there were enough.
    pub(crate) fn p99(&self) -> Duration {
        if self.count < ENOUGH { AT_FIRST } else { self.most_of(99).unwrap_or(AT_FIRST) }
    }

    /// What so many of 100 did not exceed; none where there are none.
    pub(crate) fn most_of(&self, percent: usize) -> Option<Duration> {
        let mut known = self.last;
        let known = &mut known[..self.count.min(KEPT)];
        let at = (known.len() * percent / 100).min(known.len().checked_sub(1)?);
        Some(*known.select_nth_unstable(at).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slow_answer_of_a_hundred_does_not_count_and_old_ones_are_forgotten() {
        let mut delays = Delays::new();
        assert_eq!(delays.p99(), AT_FIRST);
        for index in 0..1_000_u64 {
            let slow = if index < 700 { 50 } else { 1 };
            delays.push(Duration::from_millis(if index % 200 == 0 { 90 } else { slow }));
        }
        assert_eq!(delays.p99(), Duration::from_millis(1));
    }
}
