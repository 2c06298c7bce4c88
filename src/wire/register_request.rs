//! The requests about registers, and the report of some: they differ by their function alone, which is part of their type.

use super::header::Header;
use super::words::{self, Words};
use super::{Code, MAX_LEN, WireError};

/// What stands in these registers?
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegisterAsk<const FAMILY: u8> {
    /// Object channel: 0 DP, 1 PA; for the registers of a servo drive its number, from 1.
    pub channel: u16,
    /// Who shall receive it.
    pub accept: Code,
    /// Who shall answer.
    pub reply: Code,
    /// The first register; of a drive its parameter number, 508 for PA508.
    pub start: u16,
    /// Number of registers.
    pub num: u16,
}

impl<const FAMILY: u8> RegisterAsk<FAMILY> {
    /// Writes the request to the front of `buf` and returns it.
    pub fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        Header::request(FAMILY, self.channel, self.accept, self.reply).emit(buf);
        words::emit_ask(buf, self.start, self.num)
    }

    /// Reads a request; bytes after it are let pass ("extra data").
    ///
    /// # Errors
    /// [`WireError::Length`] where it ends before its count, and those of a broken header or another function.
    pub fn parse(bytes: &[u8]) -> Result<Self, WireError> {
        let Header { slot: channel, accept, reply, .. } = Header::parse_request(bytes, FAMILY)?;
        let (start, num) = words::ask(bytes)?;
        Ok(Self { channel, accept, reply, start, num })
    }
}

/// These words for these registers: to be written there, or found there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RegisterWords<'a, const FAMILY: u8> {
    /// Object channel, as the function means it; for the registers of a servo drive its number, from 1.
    pub channel: u16,
    /// Who shall obey.
    pub accept: Code,
    /// Who shall answer.
    pub reply: Code,
    /// The first register; of a drive its parameter number, 508 for PA508.
    pub start: u16,
    /// A word for each register; at most 256.
    pub data: Words<'a>,
}

impl<'a, const FAMILY: u8> RegisterWords<'a, FAMILY> {
    /// Writes the message to the front of `buf` and returns it.
    pub fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        Header::request(FAMILY, self.channel, self.accept, self.reply).emit(buf);
        words::emit_all(buf, self.start, self.data)
    }

    /// Reads a message; bytes after it are let pass.
    ///
    /// # Errors
    /// [`WireError::Length`] where it ends before its last word, [`WireError::Count`] for more than 256, and those of
    /// a broken header or another function.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let Header { slot: channel, accept, reply, .. } = Header::parse_request(bytes, FAMILY)?;
        let (start, data) = words::all(bytes)?;
        Ok(Self { channel, accept, reply, start, data })
    }
}
