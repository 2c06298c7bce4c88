//! The inputs X01 to X12 of a virtual controller: polarity (PA04) and filter (PA93).

use std::time::Duration;

use crate::time::MonoTime;

/// Inputs that there are.
pub(super) const INPUTS: usize = 12;
const ALL: u16 = (1 << INPUTS) - 1;

/// Switches, and what the controller makes of them. Masks have bit 0 for X01.
#[derive(Debug, Clone)]
pub(super) struct Inputs {
    closed: u16,
    active: u16,
    /// What the filter has let through.
    filtered: u16,
    /// Since when each is as it is.
    since: [MonoTime; INPUTS],
}

impl Inputs {
    /// All switches open, and have been for long.
    pub(super) const fn new(low_active: bool) -> Self {
        let active = active(0, low_active);
        Self { closed: 0, active, filtered: active, since: [MonoTime::from_nanos(0); INPUTS] }
    }

    /// Those that are active at this instant.
    pub(super) const fn active(&self) -> u16 {
        self.active
    }

    /// True if all of `mask` have been active for as long as the filter asks; never for none.
    pub(super) const fn all(&self, mask: u16) -> bool {
        mask != 0 && self.filtered & mask == mask
    }

    /// Closes these switches and opens the others.
    pub(super) fn switch(&mut self, closed: u16, low_active: bool, at: MonoTime) {
        self.closed = closed & ALL;
        self.polarity(low_active, at);
    }

    /// The switches that are closed.
    pub(super) const fn closed(&self) -> u16 {
        self.closed
    }

    /// An open input is high, a closed switch pulls it low (SMC manual 5.6); PA04 says which of the two is active.
    pub(super) fn polarity(&mut self, low_active: bool, at: MonoTime) {
        let active = active(self.closed, low_active);
        for (input, since) in self.since.iter_mut().enumerate() {
            if (active ^ self.active) >> input & 1 == 1 {
                *since = at;
            }
        }
        self.active = active;
    }

    /// When the filter lets the next change through, where one waits.
    pub(super) fn next_change(&self, filter: Duration) -> Option<MonoTime> {
        self.waiting().map(|input| self.since[input] + filter).min()
    }

    /// Lets through what has stood long enough.
    pub(super) fn settle(&mut self, filter: Duration, at: MonoTime) {
        let due = self.waiting().filter(|&input| self.since[input] + filter <= at);
        self.filtered = due.fold(self.filtered, |filtered, input| filtered ^ 1 << input);
    }

    fn waiting(&self) -> impl Iterator<Item = usize> + '_ {
        let differ = self.active ^ self.filtered;
        (0..INPUTS).filter(move |input| differ >> input & 1 == 1)
    }
}

const fn active(closed: u16, low_active: bool) -> u16 {
    if low_active { closed } else { !closed & ALL }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILTER: Duration = Duration::from_millis(200);

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    #[test]
    fn a_change_counts_once_it_has_stood_for_the_filter_and_a_bounce_does_not() {
        let mut inputs = Inputs::new(true);
        inputs.switch(0b01, true, ms(1_000));
        assert_eq!((inputs.active(), inputs.all(1), inputs.next_change(FILTER)), (1, false, Some(ms(1_200))));
        inputs.settle(FILTER, ms(1_199));
        assert!(!inputs.all(1));
        inputs.switch(0b00, true, ms(1_199));
        inputs.switch(0b11, true, ms(1_250));
        inputs.settle(FILTER, ms(1_449));
        assert!(!inputs.all(1));
        inputs.settle(FILTER, ms(1_450));
        assert!(inputs.all(0b11) && !inputs.all(0b111) && !inputs.all(0));
        inputs.switch(0b10, true, ms(1_500));
        inputs.settle(FILTER, ms(1_699));
        assert!(inputs.all(0b11), "a release is filtered, too");
        inputs.settle(FILTER, ms(1_700));
        assert_eq!((inputs.all(0b11), inputs.all(0b10), inputs.next_change(FILTER)), (false, true, None));
    }

    #[test]
    fn an_open_input_is_high_which_is_active_where_pa04_is_0() {
        let mut inputs = Inputs::new(false);
        assert_eq!((inputs.active(), inputs.all(0xfff)), (0xfff, true));
        inputs.switch(0xf001, false, ms(5));
        assert_eq!((inputs.active(), inputs.closed()), (0xffe, 1));
        inputs.polarity(true, ms(10));
        assert_eq!(inputs.active(), 1);
    }
}
