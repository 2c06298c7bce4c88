//! Registers of the servo drives behind a controller: 0x2101 reads, 0x2201 writes (SMC manual 2.2.2.13 and
//! 2.2.2.14). The manual has no table for the replies; they are taken to be like those of the controller's own.

use super::register_request::{RegisterAsk, RegisterWords};
use super::reply::ReplyParts;
use super::words::Words;
use super::{Access, MAX_LEN, ReplyCode, WireError};

pub(super) const READ: u8 = 0x21;
pub(super) const WRITE: u8 = 0x22;

/// The most registers of a drive that one message may read.
pub(crate) const MAX_SERVO_READ: u16 = 6;

/// Host to controller, 0x2101: what stands in these registers of a drive? At most [`MAX_SERVO_READ`] are answered.
pub type ServoRead = RegisterAsk<READ>;
/// Host to controller, 0x2201: put these words into registers of a drive.
pub type ServoWrite<'a> = RegisterWords<'a, WRITE>;

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
