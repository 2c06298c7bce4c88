//! Messages as the IMAX manual prints them: motion without a frame number and with four bytes of outputs (2.2.2.6,
//! 2.2.2.7), registers of 32 bits (2.3). They are only read: to put a capture in words, and to know a controller that speaks so,
//! to which our frames would mean other positions and times.

use super::bytes::{i32_at, u32_at};
use super::header::{self, Header};
use super::{Access, Code, PerAxis, ReplyCode, Timing, WireError, register, words};
use crate::motion::{MAX_AXES, Pulses};

mod field {
    pub(super) const TIME: usize = 12; // u32, ms
    pub(super) const POSITIONS: usize = 16; // n x i32; then Port u32, PlayDAC u32
    pub(super) const TAIL_LEN: usize = 8;
}

/// A motion frame, or the reply to one, of the literal IMAX layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImaxMotion {
    /// What `time_ms` counts from.
    pub timing: Timing,
    /// What became of the frame; none in the frame itself.
    pub code: Option<ReplyCode>,
    /// Object channel, kept in every reply.
    pub channel: u16,
    /// Who shall obey.
    pub(crate) accept: Code,
    /// Who shall answer.
    pub(crate) reply: Code,
    /// Time to reach the positions, ms.
    pub time_ms: u32,
    /// Where each axis shall be.
    pub positions: PerAxis<Pulses>,
    /// Outputs of a frame, inputs of a reply; bit 0 = Y01 or X01.
    pub port: u32,
    /// Analogue outputs.
    pub dac: u32,
}

impl ImaxMotion {
    /// Reads 0x1301, 0x1401 and their replies.
    ///
    /// # Errors
    /// [`WireError::Axes`], [`WireError::Length`] or [`WireError::Surplus`] unless channel and length agree exactly,
    /// and those of a broken header or another function.
    pub fn parse(bytes: &[u8]) -> Result<Self, WireError> {
        let header = Header::parse(bytes)?;
        let timing = match header.family() {
            0x13 => Timing::Absolute,
            0x14 => Timing::Relative,
            _ => return Err(header.foreign()),
        };
        let code = header.reply_code();
        if code.is_none() && !header.is_request() {
            return Err(header.foreign());
        }
        let axes = axes(header.slot, bytes.len())?;
        WireError::unless_exactly(Self::len(axes), bytes)?;
        let port = field::POSITIONS + 4 * axes;
        Ok(Self {
            timing,
            code,
            channel: header.slot,
            accept: header.accept,
            reply: header.reply,
            time_ms: u32_at(bytes, field::TIME),
            positions: PerAxis::from_fn(axes, |axis| Pulses(i32_at(bytes, field::POSITIONS + 4 * axis))),
            port: u32_at(bytes, port),
            dac: u32_at(bytes, port + 4),
        })
    }

    /// Bytes for `axes` axes: 36 for three, 48 for six.
    #[must_use]
    pub(crate) const fn len(axes: usize) -> usize {
        field::POSITIONS + 4 * axes + field::TAIL_LEN
    }
}

/// True if a controller that speaks as the IMAX manual prints sent that: no message of another layout has such a length.
#[must_use]
pub fn is_printed_imax(bytes: &[u8]) -> bool {
    ImaxRegisters::parse(bytes).is_ok_and(|reply| reply.is_wide() || reply.has_wide_error())
        || ImaxMotion::parse(bytes).is_ok_and(|motion| motion.code.is_some())
}

fn axes(channel: u16, bytes: usize) -> Result<usize, WireError> {
    match channel {
        0 => Ok(3),
        1 => Ok(6),
        2 => Ok((bytes.saturating_sub(ImaxMotion::len(0)) / 4).clamp(1, MAX_AXES)),
        found => Err(WireError::Axes { at: header::SLOT, found }),
    }
}

/// A reply about registers with words of 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImaxRegisters<'a> {
    /// What it answers.
    pub(crate) access: Access,
    /// What became of the request.
    pub(crate) code: ReplyCode,
    /// Object channel, kept in every reply.
    pub(crate) channel: u16,
    /// The first register.
    pub(crate) start: u16,
    /// How many were asked for.
    pub(crate) num: u16,
    data: &'a [u8],
}

impl<'a> ImaxRegisters<'a> {
    /// Reads 0x110x and 0x120x.
    ///
    /// # Errors
    /// [`WireError::Length`] or [`WireError::Surplus`] unless x = 2 has four bytes for each register, and those of a
    /// broken header or another function.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        let header = Header::parse(bytes)?;
        let access = match header.family() {
            register::READ => Access::Read,
            register::WRITE => Access::Write,
            _ => return Err(header.foreign()),
        };
        let code = header.reply_code().ok_or(header.foreign())?;
        let (start, num) = words::ask(bytes)?;
        if code == ReplyCode::Running {
            WireError::unless_exactly(words::HEAD_LEN + 4 * usize::from(num), bytes)?;
        }
        let data = &bytes[words::HEAD_LEN..];
        Ok(Self { access, code, channel: header.slot, start, num, data })
    }

    /// True if it tells registers, each of 32 bits: no reply with words of 16 has that length.
    #[must_use]
    pub fn is_wide(&self) -> bool {
        self.code == ReplyCode::Running && self.num > 0
    }

    /// True for a refusal with an error number of 32 bits, where one of 16 would have no room for it.
    fn has_wide_error(&self) -> bool {
        self.code.refused() && self.num <= 1 && self.data.len() == 4
    }

    /// The registers in order; with x = 3 the error number.
    pub fn values(&self) -> impl Iterator<Item = u32> + use<'a> {
        self.data.chunks_exact(4).map(|word| u32_at(word, 0))
    }
}
