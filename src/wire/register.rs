//! Registers of the controller: 0x1101 reads, 0x1201 writes, and their replies (SMC manual 2.2.2.1 to 2.2.2.4).

use super::header::Header;
use super::register_request::{RegisterAsk, RegisterWords};
use super::reply::ReplyParts;
use super::words::{self, Words};
use super::{Dialect, MAX_LEN, ReplyCode, WireError};

pub(super) const READ: u8 = 0x11;
pub(super) const WRITE: u8 = 0x12;

/// A table of registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Space {
    /// DP00 to DPFF: what the controller sees and does.
    Monitor,
    /// PA00 to PAFF: its parameters.
    Parameter,
    /// DPF0 to DPFF, counted from DPF0: reset, outputs, reboot.
    Control,
}

impl Space {
    /// The table that an object channel means in a read.
    #[must_use]
    pub(crate) const fn of_read(channel: u16) -> Option<Self> {
        match channel {
            0 => Some(Self::Monitor),
            1 => Some(Self::Parameter),
            _ => None,
        }
    }

    /// The table that an object channel means in a write. Channel 0 is parameters that are not kept over a power
    /// cycle on MBOX.
    #[must_use]
    pub(crate) const fn of_write(channel: u16, dialect: Dialect) -> Option<Self> {
        match (channel, dialect) {
            (0, Dialect::Smc) => Some(Self::Monitor),
            (0, Dialect::Mbox) | (1, _) => Some(Self::Parameter),
            (2, _) => Some(Self::Control),
            _ => None,
        }
    }
}

/// Host to controller, 0x1101: what stands in these registers?
pub type ReadRequest = RegisterAsk<READ>;
/// Host to controller, 0x1201: put these words into registers; [`Space::of_write`] is what the object channel means.
pub type WriteRequest<'a> = RegisterWords<'a, WRITE>;

/// What a register reply answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Access {
    /// A read.
    Read,
    /// A write.
    Write,
}

/// Controller to host, 0x110x and 0x120x.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegisterReply<'a> {
    /// What it answers.
    pub access: Access,
    /// What became of the request.
    pub code: ReplyCode,
    /// The object channel (x = 2 only, else 0).
    pub channel: u16,
    /// The error number (x over 2 only, else 0); MBOX controllers leave the object channel there.
    pub error: u16,
    /// The first register.
    pub start: u16,
    /// How many were asked for.
    pub num: u16,
    /// A word for each register; may be fewer, or none, with x over 2.
    pub data: Words<'a>,
}

impl<'a> RegisterReply<'a> {
    /// The answer to a request that is broken, but not before its count ends. None for anything else.
    #[must_use]
    pub(crate) fn to_broken(bytes: &[u8], code: ReplyCode, error: u16) -> Option<Self> {
        let header = Header::parse(bytes).ok().filter(|header| header.is_request())?;
        let access = match header.family() {
            READ => Access::Read,
            WRITE => Access::Write,
            _ => return None,
        };
        let (start, num) = words::ask(bytes).ok()?;
        Some(Self { access, code, channel: 0, error, start, num, data: Words::EMPTY })
    }

    /// Writes the reply to the front of `buf` and returns it.
    pub fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let Self { access, code, start, num, data, .. } = *self;
        let slot = if code == ReplyCode::Running { self.channel } else { self.error };
        ReplyParts { access, code, slot, start, num, data }.emit([READ, WRITE], buf)
    }

    /// The registers that it tells. A refusal of an MBOX controller tells none: what stands there is an error number (IMAX
    /// manual 2.2.2.3). SMC controllers answer in every state, and x over 2 says which.
    #[must_use]
    pub(crate) fn values(&self, dialect: Dialect) -> Words<'a> {
        match dialect {
            Dialect::Mbox if self.code.refused() => Words::EMPTY,
            _ => self.data,
        }
    }

    /// Reads a reply, x = 2 to 5. Nothing may follow its words: a reply with registers of 32 bits, as the IMAX manual has
    /// them (2.3), would else be read as values that nobody sent.
    ///
    /// # Errors
    /// [`WireError::Length`] where words are missing from a reply with x = 2, [`WireError::Surplus`] where it goes on,
    /// [`WireError::Count`] for more than 256 words, and those of a broken header or another function.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let ReplyParts { access, code, slot, start, num, data } = ReplyParts::parse(bytes, [READ, WRITE])?;
        let running = code == ReplyCode::Running;
        // A refusal may bring an error number in place of its words.
        let need = words::HEAD_LEN + 2 * usize::from(if running { num } else { num.max(1) });
        if bytes.len() > need {
            return Err(WireError::Surplus { len: bytes.len(), need });
        }
        let (channel, error) = if running { (slot, 0) } else { (0, slot) };
        Ok(Self { access, code, channel, error, start, num, data })
    }
}
