//! What a controller may send, told apart once for each datagram.

use super::{Message, MotionReply, RegisterReply, RegisterReport, Status, VibrationPort, is_printed_imax};

/// A datagram of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FromController<'a> {
    /// The reply to a frame.
    Reply(MotionReply),
    /// The answer to a request for registers.
    Registers(RegisterReply<'a>),
    /// An answer in the layout that the IMAX manual prints: registers of 32 bits (2.3), motion without a frame number (2.2.2.7).
    PrintedImax,
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
            Err(_) if is_printed_imax(bytes) => Self::PrintedImax,
            Ok(_) | Err(_) => Self::Other,
        }
    }
}
