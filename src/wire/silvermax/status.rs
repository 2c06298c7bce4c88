//! The three status words, their bits by name.

/// From bit 15 down what a bit is called in [`Poll`], [`Internal`] and [`Io`]; nothing where it says nothing.
const NAMES: [[&str; 3]; 16] = [
    ["immediate command done", "", "input 7"],
    ["immediate command failed", "low voltage", "input 6"],
    ["done", "high voltage", "input 5"],
    ["program error or dry queue", "delay over", "input 4"],
    ["ended by a sensor", "input found", ""],
    ["low or high voltage", "halted", "delay"],
    ["holding error", "holding error", "holding error"],
    ["moving error", "moving error", "moving error"],
    ["receiver overflow", "not hot", "not hot"],
    ["status check met", "input 3", "input 3"],
    ["message too long", "input 2", "input 2"],
    ["framing error", "input 1", "input 1"],
    ["killed", "negative result", "moving"],
    ["soft limit", "positive result", "external index"],
    ["checksum error", "zero result", "internal index"],
    ["packet aborted", "index", "index"],
];

/// A status word: which bits have which names.
pub(crate) trait StatusWord: Copy {
    /// The same bit in all of them.
    const HOLDING_ERROR: u16 = 1 << 9;
    /// The same bit in all of them.
    const MOVING_ERROR: u16 = 1 << 8;
    /// Which of the names of a bit are its.
    const COLUMN: usize;

    /// As it came.
    fn word(self) -> u16;

    /// True if all these bits are 1.
    fn has(self, bits: u16) -> bool {
        self.word() & bits == bits
    }

    /// The names of the bits that are 1, from the highest bit down.
    fn names(self) -> impl Iterator<Item = &'static str> {
        let bits = (0..16).rev().zip(NAMES).filter(move |(bit, _)| self.has(1 << bit));
        bits.map(|(_, names)| names[Self::COLUMN]).filter(|name| !name.is_empty())
    }
}

/// The conditions of register 211 by name: the bits that killed stand in its upper word.
pub(crate) fn kill_names(register: i32) -> String {
    conditions(kill_bits(register))
}

/// The bits of register 211 that killed.
pub(crate) const fn kill_bits(register: i32) -> u16 {
    let [.., low, high] = register.to_le_bytes();
    u16::from_le_bytes([low, high])
}

/// Conditions that killed, by name: bits of the internal status word (KMC, page 57).
pub(crate) fn conditions(bits: u16) -> String {
    let names = Internal(bits).names().map(|name| if name == "not hot" { "heat" } else { name });
    let names: Vec<_> = names.collect();
    if names.is_empty() { "what it does not say".to_owned() } else { names.join(", ") }
}

/// What happened since it was told and cleared (POL, pages 17 to 19). Bits 7, 4, 2, 1 and 0 by a public program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Poll(pub(crate) u16);

impl Poll {
    pub(crate) const DONE: u16 = 1 << 13;
    /// A program ended by an error, or the timed queue ran dry (page 92).
    pub(crate) const PROGRAM_ERROR: u16 = 1 << 12;
    pub(crate) const ENDED_BY_SENSOR: u16 = 1 << 11;
    pub(crate) const TOO_LONG: u16 = 1 << 5;
    pub(crate) const KILLED: u16 = 1 << 3;
    pub(crate) const SOFT_LIMIT: u16 = 1 << 2;
}

impl StatusWord for Poll {
    const COLUMN: usize = 0;

    fn word(self) -> u16 {
        self.0
    }
}

/// The internal status word (RIS, page 21).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Internal(pub(crate) u16);

impl Internal {
    /// An input ended a motion.
    pub(crate) const INPUT_FOUND: u16 = 1 << 11;
    pub(crate) const HALTED: u16 = 1 << 10;

    /// True if it is too hot.
    pub(crate) const fn is_hot(self) -> bool {
        self.0 & Io::COOL == 0
    }
}

impl StatusWord for Internal {
    const COLUMN: usize = 1;

    fn word(self) -> u16 {
        self.0
    }
}

/// Inputs and conditions as they are (RIO, page 20).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Io(pub(crate) u16);

impl Io {
    pub(crate) const DELAYING: u16 = 1 << 10;
    /// 0 where it is too hot; the same bit in the internal status word.
    pub(crate) const COOL: u16 = 1 << 7;
    /// The trajectory generator is at work.
    pub(crate) const MOVING: u16 = 1 << 3;

    /// The bit of an input, 1 to 7; no bit for others.
    pub(crate) const fn input_bit(input: u8) -> u16 {
        match input {
            1..=3 => 1 << (input + 3),
            4..=7 => 1 << (input + 8),
            _ => 0,
        }
    }
}

impl StatusWord for Io {
    const COLUMN: usize = 2;

    fn word(self) -> u16 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_killed_is_named_as_the_internal_status_word_has_it() {
        let names = ["low voltage", "high voltage", "delay over", "input found", "halted"];
        for (bit, name) in (10..=14).rev().zip(names) {
            assert_eq!(kill_names(1 << (16 + bit)), name);
        }
        assert_eq!(conditions(1 << 9 | 1 << 7 | 1 << 4), "holding error, heat, input 1");
        assert_eq!(conditions(0), "what it does not say");
    }
}
