//! Registers that an IMAX or MBOX controller reports unasked when something is wrong, 0x1001 (IMAX manual 2.2.2.1).

use super::header::Header;
use super::words::{self, Words};
use super::{Code, MAX_LEN, WireError};

/// High byte of the function.
pub(super) const FAMILY: u8 = 0x10;

/// The monitor register DPFE: which alarm the drives of an IMAX or MBOX controller have, 0 for none. On SMC it is the minor
/// version (2.3.3 of both manuals).
pub(crate) const DPFE: u16 = 0xfe;

/// Controller to host: what stands in these registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Report<'a> {
    /// Object channel: 0 DP.
    pub channel: u16,
    /// Who is meant: 0, the host.
    pub accept: Code,
    /// Who shall answer: nobody.
    pub reply: Code,
    /// The first register.
    pub start: u16,
    /// A word for each register; at most 256.
    pub data: Words<'a>,
}

impl<'a> Report<'a> {
    /// Writes the report to the front of `buf` and returns it.
    pub(crate) fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        Header::request(FAMILY, self.channel, self.accept, self.reply).emit(buf);
        words::emit_all(buf, self.start, self.data)
    }

    /// Reads a report; bytes after it are let pass.
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
