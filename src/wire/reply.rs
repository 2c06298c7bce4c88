//! What replies about registers have in common, be they of the controller or of a drive behind it.

use super::header::{Header, reply_function};
use super::words::{self, Words};
use super::{Access, Code, MAX_LEN, ReplyCode, WireError};

/// A reply about registers.
pub(super) struct ReplyParts<'a> {
    pub(super) access: Access,
    pub(super) code: ReplyCode,
    /// Whose registers they are (x = 2), else the error number.
    pub(super) slot: u16,
    pub(super) start: u16,
    pub(super) num: u16,
    pub(super) data: Words<'a>,
}

impl<'a> ReplyParts<'a> {
    /// Writes the reply to the front of `buf` and returns it; `families` are those of reads and of writes.
    pub(super) fn emit<'b>(&self, [read, write]: [u8; 2], buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let family = match self.access {
            Access::Read => read,
            Access::Write => write,
        };
        let function = reply_function(family, self.code);
        Header { function, slot: self.slot, accept: Code::NONE, reply: Code::NONE }.emit(buf);
        words::emit_some(buf, self.start, self.num, self.data)
    }

    /// Reads a reply, x = 2 to 5; bytes after it are let pass.
    ///
    /// # Errors
    /// [`WireError::Length`] where words are missing from a reply with x = 2, [`WireError::Count`] for more than 256,
    /// and those of a broken header or another function.
    pub(super) fn parse(bytes: &'a [u8], [read, write]: [u8; 2]) -> Result<Self, WireError> {
        let header = Header::parse(bytes)?;
        let access = match header.family() {
            family if family == read => Access::Read,
            family if family == write => Access::Write,
            _ => return Err(header.foreign()),
        };
        let code = header.reply_code().ok_or(header.foreign())?;
        let (start, num, data) = match code {
            ReplyCode::Running => words::answer(bytes)?,
            _ => words::refusal(bytes)?,
        };
        Ok(Self { access, code, slot: header.slot, start, num, data })
    }
}
