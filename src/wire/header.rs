//! The 12 bytes that open every message but the status report (SMC manual 2.2.1 and 2.2.2.1), and the codes in them.

use std::fmt;

use super::WireError;
use super::bytes::{put_u16, u16_at};

mod field {
    pub(super) const CONFIRM: usize = 0; // u16
    pub(super) const PASS: usize = 2; // u16, always 0
    pub(super) const FUNCTION: usize = 4; // u16
    pub(super) const SLOT: usize = 6; // u16: object channel, servo or error number
    pub(super) const ACCEPT: usize = 8; // u16
    pub(super) const REPLY: usize = 10; // u16
}

/// Bytes of the header.
pub(super) const LEN: usize = 12;
/// Where the object channel, servo or error number stands.
pub(super) const SLOT: usize = field::SLOT;

/// Opens messages to and from the controller itself.
pub(super) const CONFIRM_CONTROLLER: u16 = 0x55aa;
/// Opens messages about servo drives, and the status report.
pub(super) const CONFIRM_SERVO: u16 = 0x33cc;

/// Who a message is for, or who shall answer: a column (the third byte of a station's address) and a row (the last
/// byte), each `ff` for all of them (SMC manual 2.2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Code(pub u16);

impl Code {
    /// Every station.
    pub const ALL: Self = Self(0xffff);
    /// Nobody.
    pub const NONE: Self = Self(0);

    /// The code of the station at an IPv4 address: its last two bytes (PA12, PA13).
    #[must_use]
    pub const fn station(ip: [u8; 4]) -> Self {
        Self(u16::from_be_bytes([ip[2], ip[3]]))
    }

    /// True if this code means `station`.
    #[must_use]
    pub(crate) const fn matches(self, station: Self) -> bool {
        let ([column, row], [own_column, own_row]) = (self.0.to_be_bytes(), station.0.to_be_bytes());
        self.0 != 0 && (column == 0xff || column == own_column) && (row == 0xff || row == own_row)
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04x}", self.0)
    }
}

/// What a reply says, by the low byte of its function code (SMC manual 2.2.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[repr(u8)]
pub enum ReplyCode {
    /// x = 2: the controller runs normally.
    #[default]
    Running = 2,
    /// x = 3: the controller runs with an error; MBOX: its buffer is full.
    Fault = 3,
    /// x = 4: an emergency stop is in effect; MBOX: the frame was too short.
    EmergencyStop = 4,
    /// x = 5: the command was wrong, or the controller is.
    Command = 5,
}

impl ReplyCode {
    /// The reply code of a function's low byte; none for requests and unknown values.
    #[must_use]
    pub const fn from_byte(byte: u8) -> Option<Self> {
        match byte {
            2 => Some(Self::Running),
            3 => Some(Self::Fault),
            4 => Some(Self::EmergencyStop),
            5 => Some(Self::Command),
            _ => None,
        }
    }

    /// True if the frame was refused (x = 3, 4, 5).
    #[must_use]
    pub(crate) const fn refused(self) -> bool {
        !matches!(self, Self::Running)
    }
}

/// Which family of controllers is spoken to; IMAX controllers are of that of MBOX. It decides where errors stand, the word
/// order of positions and what channel 0 of a register write means; motion is the same for both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Dialect {
    /// SMC, by its manual.
    #[default]
    Smc,
    /// MBOX, as public programs use it.
    Mbox,
}

/// The first 12 bytes of a message, pass code and confirm code checked; tells whom even a message is for that is
/// broken after them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Header {
    /// High byte: the function; low byte: 1 for a request or report, else the reply code.
    pub(crate) function: u16,
    /// Object channel, servo number, or the error number of an SMC reply with x over 2.
    pub(crate) slot: u16,
    /// Who is meant.
    pub(crate) accept: Code,
    /// Who shall answer.
    pub(crate) reply: Code,
}

impl Header {
    /// Reads the header at the front of `bytes`; functions that do not exist pass.
    ///
    /// # Errors
    /// [`WireError::Short`], [`WireError::Confirm`] or [`WireError::Pass`].
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, WireError> {
        if bytes.len() < LEN {
            return Err(WireError::Short { len: bytes.len(), need: LEN });
        }
        let function = function_at(bytes)?;
        Ok(Self {
            function,
            slot: u16_at(bytes, field::SLOT),
            accept: Code(u16_at(bytes, field::ACCEPT)),
            reply: Code(u16_at(bytes, field::REPLY)),
        })
    }

    /// The header of a request of `family`, or of a report.
    pub(super) const fn request(family: u8, slot: u16, accept: Code, reply: Code) -> Self {
        Self { function: request_function(family), slot, accept, reply }
    }

    /// Reads the header of a request of `family`, or of a report.
    ///
    /// # Errors
    /// Those of a broken header or another function.
    pub(super) fn parse_request(bytes: &[u8], family: u8) -> Result<Self, WireError> {
        let header = Self::parse(bytes)?;
        if header.family() == family && header.is_request() { Ok(header) } else { Err(header.foreign()) }
    }

    /// Writes the header to the front of `bytes`.
    pub(super) fn emit(self, bytes: &mut [u8]) {
        open(bytes, self.function);
        put_u16(bytes, field::SLOT, self.slot);
        put_u16(bytes, field::ACCEPT, self.accept.0);
        put_u16(bytes, field::REPLY, self.reply.0);
    }

    /// The function without its low byte.
    pub(super) const fn family(self) -> u8 {
        self.function.to_be_bytes()[0]
    }

    /// The reply code, where the message is a reply.
    pub(super) const fn reply_code(self) -> Option<ReplyCode> {
        ReplyCode::from_byte(self.function.to_be_bytes()[1])
    }

    /// True if the message is a request, or a report.
    pub(super) const fn is_request(self) -> bool {
        self.function.to_be_bytes()[1] == 1
    }

    /// The refusal of a message that some other parser may know.
    pub(super) const fn foreign(self) -> WireError {
        WireError::Function { found: self.function }
    }
}

/// Writes the six bytes that open every message.
pub(super) fn open(bytes: &mut [u8], function: u16) {
    put_u16(bytes, field::CONFIRM, confirm_of(function));
    put_u16(bytes, field::PASS, 0);
    put_u16(bytes, field::FUNCTION, function);
}

/// The function code, with the six bytes that open every message checked; `bytes` holds at least those.
pub(super) fn function_at(bytes: &[u8]) -> Result<u16, WireError> {
    let confirm = u16_at(bytes, field::CONFIRM);
    if confirm != CONFIRM_CONTROLLER && confirm != CONFIRM_SERVO {
        return Err(WireError::Confirm { found: confirm, expected: CONFIRM_CONTROLLER });
    }
    let pass = u16_at(bytes, field::PASS);
    if pass != 0 {
        return Err(WireError::Pass { found: pass });
    }
    let function = u16_at(bytes, field::FUNCTION);
    let expected = confirm_of(function);
    if confirm != expected {
        return Err(WireError::Confirm { found: confirm, expected });
    }
    Ok(function)
}

const fn confirm_of(function: u16) -> u16 {
    match function >> 8 {
        0x21 | 0x22 | 0x31 => CONFIRM_SERVO,
        _ => CONFIRM_CONTROLLER,
    }
}

/// The function code of a reply.
pub(super) const fn reply_function(family: u8, code: ReplyCode) -> u16 {
    u16::from_be_bytes([family, code as u8])
}

/// The function code of a request or report.
pub(super) const fn request_function(family: u8) -> u16 {
    u16::from_be_bytes([family, 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_code_means_a_column_a_row_a_station_all_or_nobody() {
        let station = Code::station([192, 168, 15, 201]);
        assert_eq!(station, Code(0x0fc9));
        for code in [0xffff, 0x0fff, 0xffc9, 0x0fc9] {
            assert!(Code(code).matches(station), "{code:04x}");
        }
        for code in [0x0000, 0x00ff, 0x0fc8, 0x0ec9, 0xff00, 0x0f00] {
            assert!(!Code(code).matches(station), "{code:04x}");
        }
    }

    #[test]
    fn a_station_of_column_and_row_zero_cannot_be_named_alone() {
        assert!(!Code::NONE.matches(Code::station([10, 0, 0, 0])));
    }
}
