//! Registers of the servo drives behind a controller: 0x2101 reads, 0x2201 writes (SMC manual 2.2.2.13 and
//! 2.2.2.14). The manual has no table for the replies; they are taken to be like those of the controller's own.

use super::header::Header;
use super::reply::ReplyParts;
use super::words::{self, Words};
use super::{Access, Code, MAX_LEN, ReplyCode, WireError};

pub(super) const READ: u8 = 0x21;
pub(super) const WRITE: u8 = 0x22;

/// The most registers of a drive that one message may read.
pub(crate) const MAX_SERVO_READ: u16 = 6;

/// Host to controller, 0x2101: what stands in these registers of a drive?
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServoRead {
    /// The drive, counted from 1.
    pub servo: u16,
    /// Who shall receive it.
    pub accept: Code,
    /// Who shall answer.
    pub reply: Code,
    /// The first register: the drive's parameter number, 508 for PA508.
    pub start: u16,
    /// How many; at most [`MAX_SERVO_READ`] are answered.
    pub num: u16,
}

impl ServoRead {
    /// Writes the request to the front of `buf` and returns it.
    pub(crate) fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        Header::request(READ, self.servo, self.accept, self.reply).emit(buf);
        words::emit_ask(buf, self.start, self.num)
    }

    /// Reads a request; bytes after it are let pass.
    ///
    /// # Errors
    /// [`WireError::Length`] where it ends before its count, and those of a broken header or another function.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, WireError> {
        let Header { slot: servo, accept, reply, .. } = Header::parse_request(bytes, READ)?;
        let (start, num) = words::ask(bytes)?;
        Ok(Self { servo, accept, reply, start, num })
    }
}

/// Host to controller, 0x2201: put these words into registers of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServoWrite<'a> {
    /// The drive, counted from 1.
    pub servo: u16,
    /// Who shall obey.
    pub accept: Code,
    /// Who shall answer.
    pub reply: Code,
    /// The first register: the drive's parameter number, 508 for PA508.
    pub start: u16,
    /// A word for each register; at most 256.
    pub data: Words<'a>,
}

impl<'a> ServoWrite<'a> {
    /// Writes the request to the front of `buf` and returns it.
    pub(crate) fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        Header::request(WRITE, self.servo, self.accept, self.reply).emit(buf);
        words::emit_all(buf, self.start, self.data)
    }

    /// Reads a request; bytes after it are let pass.
    ///
    /// # Errors
    /// [`WireError::Length`] where it ends before its last word, [`WireError::Count`] for more than 256, and those of
    /// a broken header or another function.
    pub(crate) fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let Header { slot: servo, accept, reply, .. } = Header::parse_request(bytes, WRITE)?;
        let (start, data) = words::all(bytes)?;
        Ok(Self { servo, accept, reply, start, data })
    }
}

/// Controller to host, 0x210x and 0x220x.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ServoReply<'a> {
    /// What it answers.
    pub access: Access,
    /// What became of the request.
    pub code: ReplyCode,
    /// The drive (x = 2 only, else 0).
    pub servo: u16,
    /// The error number (x over 2 only, else 0).
    pub error: u16,
    /// The first register.
    pub start: u16,
    /// How many were asked for.
    pub num: u16,
    /// A word for each register; may be fewer, or none, with x over 2.
    pub data: Words<'a>,
}

impl<'a> ServoReply<'a> {
    /// Writes the reply to the front of `buf` and returns it.
    pub(crate) fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let Self { access, code, start, num, data, .. } = *self;
        let slot = if code == ReplyCode::Running { self.servo } else { self.error };
        ReplyParts { access, code, slot, start, num, data }.emit([READ, WRITE], buf)
    }

    /// Reads a reply, x = 2 to 5; bytes after it are let pass.
    ///
    /// # Errors
    /// [`WireError::Length`] where words are missing from a reply with x = 2, [`WireError::Count`] for more than 256,
    /// and those of a broken header or another function.
    pub(crate) fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let ReplyParts { access, code, slot, start, num, data } = ReplyParts::parse(bytes, [READ, WRITE])?;
        let running = code == ReplyCode::Running;
        let (servo, error) = if running { (slot, 0) } else { (0, slot) };
        Ok(Self { access, code, servo, error, start, num, data })
    }
}
