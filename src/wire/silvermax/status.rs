//! The three status words, their bits by name.

/// A status word: which bits have which names.
pub(crate) trait StatusWord: Copy {
    /// Bits and names, from the highest bit down.
    const NAMES: &'static [(u16, &'static str)];

    /// As it came.
    fn word(self) -> u16;

    /// True if all these bits are 1.
    fn has(self, bits: u16) -> bool {
        self.word() & bits == bits
    }

    /// The names of the bits that are 1.
    fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES.iter().filter(move |(bit, _)| self.has(*bit)).map(|(_, name)| *name)
    }
}

/// What happened since it was told and cleared (POL, pages 17 to 19). Bits 7, 4, 2, 1 and 0 by a public program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Poll(pub(crate) u16);

impl Poll {
    pub(crate) const IMMEDIATE_DONE: u16 = 1 << 15;
    pub(crate) const IMMEDIATE_ERROR: u16 = 1 << 14;
    pub(crate) const DONE: u16 = 1 << 13;
    /// A program ended by an error, or the timed queue ran dry (page 92).
    pub(crate) const PROGRAM_ERROR: u16 = 1 << 12;
    pub(crate) const ENDED_BY_SENSOR: u16 = 1 << 11;
    pub(crate) const VOLTAGE: u16 = 1 << 10;
    pub(crate) const HOLDING_ERROR: u16 = 1 << 9;
    pub(crate) const MOVING_ERROR: u16 = 1 << 8;
    pub(crate) const OVERFLOW: u16 = 1 << 7;
    pub(crate) const CHECKED: u16 = 1 << 6;
    pub(crate) const TOO_LONG: u16 = 1 << 5;
    pub(crate) const FRAMING: u16 = 1 << 4;
    pub(crate) const KILLED: u16 = 1 << 3;
    pub(crate) const SOFT_LIMIT: u16 = 1 << 2;
    pub(crate) const CHECKSUM: u16 = 1 << 1;
    pub(crate) const ABORTED: u16 = 1 << 0;
}

impl StatusWord for Poll {
    const NAMES: &'static [(u16, &'static str)] = &[
        (Self::IMMEDIATE_DONE, "immediate command done"),
        (Self::IMMEDIATE_ERROR, "immediate command failed"),
        (Self::DONE, "done"),
        (Self::PROGRAM_ERROR, "program error or dry queue"),
        (Self::ENDED_BY_SENSOR, "ended by a sensor"),
        (Self::VOLTAGE, "low or high voltage"),
        (Self::HOLDING_ERROR, "holding error"),
        (Self::MOVING_ERROR, "moving error"),
        (Self::OVERFLOW, "receiver overflow"),
        (Self::CHECKED, "status check met"),
        (Self::TOO_LONG, "message too long"),
        (Self::FRAMING, "framing error"),
        (Self::KILLED, "killed"),
        (Self::SOFT_LIMIT, "soft limit"),
        (Self::CHECKSUM, "checksum error"),
        (Self::ABORTED, "packet aborted"),
    ];

    fn word(self) -> u16 {
        self.0
    }
}

/// The internal status word (RIS, page 21).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Internal(pub(crate) u16);

impl Internal {
    pub(crate) const LOW_VOLTAGE: u16 = 1 << 14;
    pub(crate) const HIGH_VOLTAGE: u16 = 1 << 13;
    pub(crate) const DELAY_OVER: u16 = 1 << 12;
    /// An input ended a motion.
    pub(crate) const INPUT_FOUND: u16 = 1 << 11;
    pub(crate) const HALTED: u16 = 1 << 10;
    pub(crate) const HOLDING_ERROR: u16 = 1 << 9;
    pub(crate) const MOVING_ERROR: u16 = 1 << 8;
    /// 0 where it is too hot.
    pub(crate) const COOL: u16 = 1 << 7;

    /// True if it is too hot.
    pub(crate) const fn is_hot(self) -> bool {
        self.0 & Self::COOL == 0
    }
}

impl StatusWord for Internal {
    const NAMES: &'static [(u16, &'static str)] = &[
        (Self::LOW_VOLTAGE, "low voltage"),
        (Self::HIGH_VOLTAGE, "high voltage"),
        (Self::DELAY_OVER, "delay over"),
        (Self::INPUT_FOUND, "input found"),
        (Self::HALTED, "halted"),
        (Self::HOLDING_ERROR, "holding error"),
        (Self::MOVING_ERROR, "moving error"),
        (Self::COOL, "not hot"),
        (1 << 6, "input 3"),
        (1 << 5, "input 2"),
        (1 << 4, "input 1"),
        (1 << 3, "negative result"),
        (1 << 2, "positive result"),
        (1 << 1, "zero result"),
        (1 << 0, "index"),
    ];

    fn word(self) -> u16 {
        self.0
    }
}

/// Inputs and conditions as they are (RIO, page 20).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Io(pub(crate) u16);

impl Io {
    pub(crate) const DELAYING: u16 = 1 << 10;
    pub(crate) const HOLDING_ERROR: u16 = 1 << 9;
    pub(crate) const MOVING_ERROR: u16 = 1 << 8;
    /// 0 where it is too hot.
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
    const NAMES: &'static [(u16, &'static str)] = &[
        (1 << 15, "input 7"),
        (1 << 14, "input 6"),
        (1 << 13, "input 5"),
        (1 << 12, "input 4"),
        (Self::DELAYING, "delay"),
        (Self::HOLDING_ERROR, "holding error"),
        (Self::MOVING_ERROR, "moving error"),
        (Self::COOL, "not hot"),
        (1 << 6, "input 3"),
        (1 << 5, "input 2"),
        (1 << 4, "input 1"),
        (Self::MOVING, "moving"),
        (1 << 2, "external index"),
        (1 << 1, "internal index"),
        (1 << 0, "index"),
    ];

    fn word(self) -> u16 {
        self.0
    }
}
