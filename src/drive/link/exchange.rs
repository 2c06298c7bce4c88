//! What a conversation with the drives of a link is reckoned by, whatever they speak.

use std::time::Duration;

use crate::config::Link;
use crate::config::link::LinkWiring;
use crate::time::MonoTime;

/// What a line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TalkTerms {
    /// Bits a second.
    pub(crate) baud: u32,
    /// Bits of an octet with start and stop.
    pub(crate) octet_bits: u32,
    /// The adapter returns what is sent.
    pub(crate) has_echo: bool,
    /// All share two wires: only one may speak at a time.
    pub(crate) is_two_wires: bool,
}

impl TalkTerms {
    /// Those of a link.
    pub(crate) fn of(link: &Link) -> Self {
        let (octet_bits, is_two_wires) = (9 + u32::from(link.stop_bits), link.wiring == LinkWiring::Rs485);
        Self { baud: link.baud, octet_bits, has_echo: link.has_echo, is_two_wires }
    }
}

/// What came over a line, counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct TalkCounts {
    /// Requests that wait for an answer.
    pub(crate) asked: u64,
    /// Those that got one in time.
    pub(crate) answered: u64,
    /// Answers that came after their time.
    pub(crate) late: u64,
    /// Answers where none was waited for any more.
    pub(crate) doubled: u64,
    /// Lines that are no answer, and octets that are no line.
    pub(crate) malformed: u64,
    /// Answers of a unit, or to a command, that was not asked.
    pub(crate) foreign: u64,
    /// The echo was not what was sent.
    pub(crate) echo_differs: u64,
}

impl TalkCounts {
    /// What was counted since these were.
    #[must_use]
    pub(crate) const fn since(self, before: Self) -> Self {
        Self {
            asked: self.asked - before.asked,
            answered: self.answered - before.answered,
            late: self.late - before.late,
            doubled: self.doubled - before.doubled,
            malformed: self.malformed - before.malformed,
            foreign: self.foreign - before.foreign,
            echo_differs: self.echo_differs - before.echo_differs,
        }
    }
}

/// When an exchange happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Moment {
    /// The last octet of the request had left.
    pub(crate) sent: MonoTime,
    /// The first octet of the answer began to arrive.
    pub(crate) answered: MonoTime,
}

impl Moment {
    /// How long the answer took to begin.
    pub(crate) const fn delay(&self) -> Duration {
        self.answered.since(self.sent)
    }
}
