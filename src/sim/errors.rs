//! The errors that stand in a virtual controller (chapter 6 of both manuals), and what clears them.

use std::time::Duration;

use crate::time::MonoTime;

/// The play began with too long a time.
pub(super) const FIRST_TIME: u16 = 17;
/// More datagrams than the memory holds.
pub(super) const UDP_MEMORY: u16 = 20;
/// More commands than the queue holds.
pub(super) const QUEUE: u16 = 21;

/// No connection to a drive, or another model than was set: there as long as its cause.
const CAUSE: u32 = bits(&[1, 2, 3, 4, 5, 6, 7]);
/// Alarms of drives: there until the power goes.
const ALARM: u32 = bits(&[10, 11, 12, 13, 14, 15]);
/// There until a reset or until the power goes.
const PLAY: u32 = bits(&[FIRST_TIME, QUEUE]);
const PASSING: u32 = bits(&[UDP_MEMORY]);

const fn bits(numbers: &[u16]) -> u32 {
    let mut all = 0;
    let mut index = 0;
    while index < numbers.len() {
        all |= 1 << numbers[index];
        index += 1;
    }
    all
}

/// A set of errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Errors(u32);

impl Errors {
    /// True if the manuals know an error of this number.
    pub(super) fn is_one(number: u16) -> bool {
        number < 32 && (CAUSE | ALARM | PLAY | PASSING) >> number & 1 == 1
    }

    /// True if none stands.
    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// True if one stands that stops the play: any but a full memory.
    pub(super) const fn stop_play(self) -> bool {
        self.0 & !PASSING != 0
    }

    /// The lowest that stands; 0 for none. There is room for one in a message.
    pub(super) fn shown(self) -> u16 {
        if self.is_empty() { 0 } else { u16::try_from(self.0.trailing_zeros()).expect("below 32") }
    }

    /// Adds an error; says whether it is one, and new.
    pub(super) fn insert(&mut self, number: u16) -> bool {
        let new = Self::is_one(number) && self.0 >> number & 1 == 0;
        if new {
            self.0 |= 1 << number;
        }
        new
    }

    /// The cause of an error is gone.
    pub(super) const fn remove(&mut self, number: u16) {
        self.0 &= !(1 << number);
    }

    /// A reset clears what it may.
    pub(super) const fn reset(&mut self) {
        self.0 &= !PLAY;
    }

    /// A power cycle clears all whose cause is not still there.
    pub(super) const fn restart(&mut self) {
        self.0 &= CAUSE;
    }

    /// All causes are gone, and all errors.
    pub(super) const fn clear(&mut self) {
        self.0 = 0;
    }

    /// True if a drive cannot be spoken to, `axis` counted from 0.
    pub(super) const fn unreachable(self, axis: usize) -> bool {
        axis < 6 && self.0 >> (axis + 1) & 1 == 1
    }

    /// True if a drive has an alarm, `axis` counted from 0.
    pub(super) const fn alarm(self, axis: usize) -> bool {
        axis < 6 && self.0 >> (axis + 10) & 1 == 1
    }
}

/// The UDP memory, which too many datagrams at once fill (Err20).
#[derive(Debug, Clone, Copy)]
pub(super) struct UdpMemory {
    limit: u32,
    window: MonoTime,
    count: u32,
}

impl UdpMemory {
    /// How long datagrams are counted, and how long it takes to get over too many of them.
    pub(super) const WINDOW: Duration = Duration::from_millis(100);

    pub(super) const fn new(limit: u32) -> Self {
        Self { limit, window: MonoTime::from_nanos(0), count: 0 }
    }

    /// Takes a datagram; says whether it was one too many.
    pub(super) fn overflows(&mut self, at: MonoTime) -> bool {
        if at.since(self.window) >= Self::WINDOW {
            (self.window, self.count) = (at, 0);
        }
        self.count += 1;
        self.count > self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_error_is_cleared_by_its_own_event() {
        let all = || {
            let mut errors = Errors::default();
            for number in 0..40 {
                errors.insert(number);
            }
            errors
        };
        let standing = |errors: Errors| (0..32).filter(|n| errors.0 >> n & 1 == 1).collect::<Vec<u16>>();
        assert_eq!(standing(all()), [1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13, 14, 15, 17, 20, 21]);
        let mut errors = all();
        errors.reset();
        assert_eq!(standing(errors), [1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13, 14, 15, 20]);
        errors.restart();
        assert_eq!((standing(errors), errors.shown()), ((1..=7).collect(), 1));
        errors.clear();
        assert_eq!(errors.shown(), 0);
    }

    #[test]
    fn an_error_is_new_once() {
        let mut errors = Errors::default();
        assert_eq!([12, 12, 8, 33].map(|number| errors.insert(number)), [true, false, false, false]);
        assert!(errors.alarm(2) && !errors.alarm(3) && !errors.unreachable(2));
    }

    #[test]
    fn the_memory_overflows_within_a_window_only() {
        let mut memory = UdpMemory::new(2);
        let ms = |ms: u64| MonoTime::from_nanos(ms * 1_000_000);
        let seen = [1_000, 1_050, 1_099, 1_100, 1_150].map(|at| memory.overflows(ms(at)));
        assert_eq!(seen, [false, false, true, false, false]);
    }
}
