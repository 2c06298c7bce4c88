//! The protocol of the IMAX, SMC and MBOX controllers: bytes to messages and back, as host and as controller. Any
//! thread; neither way allocates, writing cannot fail, and reading takes any bytes without a panic.
//!
//! Numbers are big-endian throughout; one message is one datagram. Sources are the SMC manual (2.2 and 2.3) and the
//! IMAX manual (2.2 and 2.3); where they are silent or disagree, what public programs send. What serial drives speak has a
//! folder of its own each: [`silvermax`], [`sixpack2`].

mod analogue;
mod bytes;
mod error;
mod frame_no;
mod from_controller;
mod header;
mod imax;
mod motion;
mod per_axis;
mod position;
mod register;
mod register_request;
mod reply;
mod report;
mod servo;
pub(crate) mod silvermax;
pub(crate) mod sixpack2;
mod status;
mod vibration;
mod word_order;
mod words;

pub use analogue::Analogue;
pub(crate) use error::DeviceError;
pub use error::WireError;
pub use frame_no::FrameNo;
pub use from_controller::FromController;
pub(crate) use header::Header;
pub use header::{Code, Dialect, ReplyCode};
pub use imax::{ImaxMotion, ImaxRegisters, is_printed_imax};
pub use motion::{Motion, MotionReply, MotionRequest, Timing};
pub(crate) use motion::{motion_channel_and_slots, motion_len};
pub use per_axis::PerAxis;
pub(crate) use position::{
    AXES_PER_BLOCK, DP_INPUTS, DP_OUTPUTS, DP_POSITIONS, position_parts, position_reads, positions,
};
pub use position::{position, position_words};
pub(crate) use register::Space;
pub use register::{Access, ReadRequest, RegisterReply, WriteRequest};
pub use register_request::{RegisterAsk, RegisterWords};
pub(crate) use report::DPFE;
pub use report::RegisterReport;
pub(crate) use servo::MAX_SERVO_READ;
pub use servo::{ServoRead, ServoReply, ServoWrite};
pub use status::Status;
pub use vibration::{Vibration, VibrationPort};
pub(crate) use word_order::{WordOrder, in_other_order, word_order};
pub(crate) use words::MAX_WORDS;
pub use words::Words;

/// Bytes that hold any message we write; the longest carries a whole table of registers.
pub const MAX_LEN: usize = words::HEAD_LEN + 2 * MAX_WORDS;

/// Any message of the protocol, read from a datagram.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Message<'a> {
    /// 0x1301, 0x1401, 0x1801, 0x1901.
    Motion(MotionRequest),
    /// 0x130x, 0x140x, 0x180x, 0x190x.
    MotionReply(MotionReply),
    /// 0x1101.
    Read(ReadRequest),
    /// 0x1201.
    Write(WriteRequest<'a>),
    /// 0x110x, 0x120x.
    RegisterReply(RegisterReply<'a>),
    /// 0x2101.
    ServoRead(ServoRead),
    /// 0x2201.
    ServoWrite(ServoWrite<'a>),
    /// 0x210x, 0x220x.
    ServoReply(ServoReply<'a>),
    /// 0x3101.
    Status(Status),
    /// 0x1001.
    Report(RegisterReport<'a>),
}

impl<'a> Message<'a> {
    /// Reads any message of the SMC and MBOX layout.
    ///
    /// # Errors
    /// At which byte, and why, these bytes are none.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, WireError> {
        Self::parse_as(VibrationPort::Two, bytes)
    }

    /// The same where Port Out is so in vibration frames.
    ///
    /// # Errors
    /// As [`Message::parse`].
    pub fn parse_as(port: VibrationPort, bytes: &'a [u8]) -> Result<Self, WireError> {
        if bytes.len() < header::SLOT {
            return Err(WireError::Short { len: bytes.len(), need: header::LEN });
        }
        let found = header::function_at(bytes)?;
        let [family, low] = found.to_be_bytes();
        match (family, low) {
            (family, 1) if motion::is_motion(family) => {
                MotionRequest::parse_as(port, bytes).map(Self::Motion)
            }
            (family, _) if motion::is_motion(family) => {
                MotionReply::parse_as(port, bytes).map(Self::MotionReply)
            }
            (register::READ, 1) => ReadRequest::parse(bytes).map(Self::Read),
            (register::WRITE, 1) => WriteRequest::parse(bytes).map(Self::Write),
            (register::READ | register::WRITE, _) => RegisterReply::parse(bytes).map(Self::RegisterReply),
            (servo::READ, 1) => ServoRead::parse(bytes).map(Self::ServoRead),
            (servo::WRITE, 1) => ServoWrite::parse(bytes).map(Self::ServoWrite),
            (servo::READ | servo::WRITE, _) => ServoReply::parse(bytes).map(Self::ServoReply),
            (status::FAMILY, _) => Status::parse(bytes).map(Self::Status),
            (report::FAMILY, _) => RegisterReport::parse(bytes).map(Self::Report),
            _ => Err(WireError::Function { found }),
        }
    }

    /// Writes the message to the front of `buf` and returns it; nothing of what was there is kept.
    pub fn emit<'b>(&self, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        match self {
            Self::Motion(message) => message.emit(buf),
            Self::MotionReply(message) => message.emit(buf),
            Self::Read(message) => message.emit(buf),
            Self::Write(message) => message.emit(buf),
            Self::RegisterReply(message) => message.emit(buf),
            Self::ServoRead(message) => message.emit(buf),
            Self::ServoWrite(message) => message.emit(buf),
            Self::ServoReply(message) => message.emit(buf),
            Self::Status(message) => message.emit(buf),
            Self::Report(message) => message.emit(buf),
        }
    }
}
