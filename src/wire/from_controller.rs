//! What a controller may send, told apart once for each datagram.

use super::{ImaxRegisters, Message, MotionReply, RegisterReply, RegisterReport, Status, VibrationPort};

/// A datagram of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FromController<'a> {
    /// The reply to a frame.
    Reply(MotionReply),
    /// The answer to a request for registers.
    Registers(RegisterReply<'a>),
    /// An answer with registers of 32 bits, as the IMAX manual has them (2.3) and no program that is known.
    WideRegisters,
    /// Its state, sent unasked by an SMC controller.
    Status(Status),
    /// Registers, sent unasked by an IMAX or MBOX controller.
    Report(RegisterReport<'a>),
    /// Anything else, be it no message at all.
    Other,
}

impl<'a> FromController<'a> {
    /// Reads a datagram of a controller that has Port Out so in vibration frames.
    #[must_use]
    pub fn parse(port: VibrationPort, bytes: &'a [u8]) -> Self {
        match Message::parse_as(port, bytes) {
            Ok(Message::MotionReply(reply)) => Self::Reply(reply),
            Ok(Message::RegisterReply(reply)) => Self::Registers(reply),
            Ok(Message::Status(status)) => Self::Status(status),
            Ok(Message::Report(report)) => Self::Report(report),
            Err(_) if ImaxRegisters::parse(bytes).is_ok_and(|reply| reply.is_wide()) => Self::WideRegisters,
            Ok(_) | Err(_) => Self::Other,
        }
    }
}
