//! What a drive answers: `* 10`, `# 10 000C 0005 06A3`, `! 10 0019 0006`, in hexadecimal (command reference, pages 16, 19, 96).

use std::fmt::{self, Write as _};

use super::line::{Cursor, LineWriter};
use super::{LineError, MAX_LINE};

/// Words that an answer holds at most: those of the longest read of the program buffer (RPB, page 22).
const MAX_WORDS: usize = 8;

/// The answer of one unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reply {
    /// Taken; to a poll: nothing to tell. It does not say which command it is for.
    Ack {
        /// Who answers.
        unit: u8,
    },
    /// What was asked for.
    Data {
        /// Who answers.
        unit: u8,
        /// The number of the command that asked.
        command: u16,
        /// The data.
        words: Words,
    },
    /// Not taken.
    Nak {
        /// Who answers.
        unit: u8,
        /// The number of the command that was not taken.
        command: u16,
        /// Why.
        reason: NakReason,
    },
}

/// Up to eight words of 16 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Words {
    words: [u16; MAX_WORDS],
    count: usize,
}

/// Why a command was not taken. The numbers are those of a public program, and 6 also of IMW, page 96.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NakReason {
    /// 1: there is no such command.
    Command,
    /// 2: it moves, or runs a program, and this command has to wait for the end of that.
    Busy,
    /// 5: a parameter is missing, too many, or out of range.
    Format,
    /// 6: no room for another segment; the same is to be sent again.
    QueueFull,
    /// 7: a wrong address.
    Address,
    /// 10: a wrong sum.
    Checksum,
    /// What nobody has told the meaning of.
    Other(u16),
}

impl Words {
    /// The first eight of these.
    pub(crate) fn of(words: &[u16]) -> Self {
        let mut kept = Self { count: words.len().min(MAX_WORDS), ..Self::default() };
        kept.words[..kept.count].copy_from_slice(&words[..kept.count]);
        kept
    }

    /// A register of 32 bits, its upper word first.
    pub(crate) fn of_value(value: i32) -> Self {
        let [a, b, c, d] = value.to_be_bytes();
        Self::of(&[u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d])])
    }

    /// All of them.
    pub(crate) fn as_slice(&self) -> &[u16] {
        &self.words[..self.count]
    }

    /// The register of 32 bits that two words are.
    pub(crate) fn value(&self) -> Option<i32> {
        match *self.as_slice() {
            [high, low] => Some((u32::from(high) << 16 | u32::from(low)).cast_signed()),
            _ => None,
        }
    }

    /// The one word that there is.
    pub(crate) fn word(&self) -> Option<u16> {
        match *self.as_slice() {
            [word] => Some(word),
            _ => None,
        }
    }
}

impl NakReason {
    /// What a number means.
    pub(crate) const fn of(number: u16) -> Self {
        match number {
            1 => Self::Command,
            2 => Self::Busy,
            5 => Self::Format,
            6 => Self::QueueFull,
            7 => Self::Address,
            10 => Self::Checksum,
            other => Self::Other(other),
        }
    }

    /// Its number.
    pub(crate) const fn number(self) -> u16 {
        match self {
            Self::Command => 1,
            Self::Busy => 2,
            Self::Format => 5,
            Self::QueueFull => 6,
            Self::Address => 7,
            Self::Checksum => 10,
            Self::Other(number) => number,
        }
    }
}

impl fmt::Display for NakReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Command => f.write_str("no such command"),
            Self::Busy => f.write_str("busy"),
            Self::Format => f.write_str("bad parameters"),
            Self::QueueFull => f.write_str("queue full"),
            Self::Address => f.write_str("bad address"),
            Self::Checksum => f.write_str("bad checksum"),
            Self::Other(number) => write!(f, "reason {number}"),
        }
    }
}

impl Reply {
    /// Who answers.
    pub(crate) const fn unit(&self) -> u8 {
        match *self {
            Self::Ack { unit } | Self::Data { unit, .. } | Self::Nak { unit, .. } => unit,
        }
    }

    /// Which command it is for; an ack does not say.
    pub(crate) const fn command(&self) -> Option<u16> {
        match *self {
            Self::Ack { .. } => None,
            Self::Data { command, .. } | Self::Nak { command, .. } => Some(command),
        }
    }

    /// Reads a line without its carriage return.
    ///
    /// # Errors
    /// A [`LineError`] where it is no answer.
    pub(crate) fn parse(line: &[u8]) -> Result<Self, LineError> {
        let Some(opening @ (b'*' | b'#' | b'!')) = line.first() else { return Err(LineError::Opening) };
        let mut cursor = Cursor::after_opening(line);
        cursor.blank()?;
        let unit = cursor.hex("unit of two digits", 2)?;
        let unit = u8::try_from(unit).map_err(|_| LineError::Opening)?;
        if *opening == b'*' {
            return cursor.end().map(|()| Self::Ack { unit });
        }
        cursor.blank()?;
        let command = cursor.hex("command of four digits", 4)?;
        let words = Self::words(&mut cursor)?;
        if *opening == b'#' {
            return Ok(Self::Data { unit, command, words });
        }
        let reason = words.word().ok_or(LineError::Number { at: cursor.at, what: "one reason" })?;
        Ok(Self::Nak { unit, command, reason: NakReason::of(reason) })
    }

    fn words(cursor: &mut Cursor<'_>) -> Result<Words, LineError> {
        let mut words = Words::default();
        while !cursor.is_done() {
            if words.count == MAX_WORDS {
                return Err(LineError::Many { at: cursor.at, what: "words", most: MAX_WORDS });
            }
            cursor.blank()?;
            words.words[words.count] = cursor.hex("word of four digits", 4)?;
            words.count += 1;
        }
        Ok(words)
    }

    /// Writes the whole line, with its carriage return, to the front of `buf` and returns it.
    pub(crate) fn emit<'b>(&self, buf: &'b mut [u8; MAX_LINE]) -> &'b [u8] {
        let mut line = LineWriter::new(buf);
        // Writing to a line cannot fail.
        let _ = match self {
            Self::Ack { unit } => write!(line, "* {unit:02X}"),
            Self::Nak { unit, command, reason } => {
                write!(line, "! {unit:02X} {command:04X} {:04X}", reason.number())
            }
            Self::Data { unit, command, words } => {
                let head = write!(line, "# {unit:02X} {command:04X}");
                head.and_then(|()| words.as_slice().iter().try_for_each(|word| write!(line, " {word:04X}")))
            }
        };
        line.end()
    }
}
