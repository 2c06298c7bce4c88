//! Why a controller did not do what it was asked, in words.

use std::fmt;
use std::time::Duration;

use super::Request;
use crate::net::SendFault;
use crate::wire::{DeviceError, Dialect, ReplyCode, WireError};

/// Why a request came to nothing. Nothing was changed by it, as far as the controller tells.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// No valid answer came in time.
    #[error("cannot {request}: no answer in {tries} tries of {} ms{}", timeout.as_millis(), behind(request, odd.as_ref()))]
    Silent {
        /// What was asked.
        request: Request,
        /// How often.
        tries: u32,
        /// How long each waited.
        timeout: Duration,
        /// What came, or happened, instead.
        odd: Option<Odd>,
    },
    /// The controller answered that it will not.
    #[error("cannot {request}: refused, {}", refusal(*code, *error, *dialect))]
    Refused {
        /// What was asked.
        request: Request,
        /// Its reply code.
        code: ReplyCode,
        /// Its error number.
        error: DeviceError,
        /// By which the code is to be read.
        dialect: Dialect,
    },
    /// What it answered is in the layout that the IMAX manual prints, which says nothing of the controller's state to a reader of
    /// another.
    #[error("cannot {request}: {PRINTED}")]
    Foreign {
        /// What was asked.
        request: Request,
    },
    /// No message of the controller's dialect says this.
    #[error("cannot {request}: mbox controllers have no message for it")]
    NoWay {
        /// What should have been asked.
        request: Request,
    },
    /// It was not asked, because an earlier request had no answer, or one that cannot be read.
    #[error("cannot {request}: not sent, as an earlier request had no answer that can be read")]
    Unasked {
        /// What should have been asked.
        request: Request,
    },
}

/// What a controller does that speaks as the IMAX manual prints.
pub(crate) const PRINTED: &str = "the controller answers as the IMAX manual prints (registers of 32 bits, motion without frame numbers), which \
                                  is neither smc nor mbox; do not play to it";

impl Fault {
    /// True if the controller answered in a layout that nothing here writes.
    #[must_use]
    pub(crate) const fn is_foreign(&self) -> bool {
        matches!(self, Self::Foreign { .. })
    }

    /// True if the controller answered, but would not.
    #[must_use]
    pub(crate) const fn refused(&self) -> bool {
        matches!(self, Self::Refused { .. } | Self::NoWay { .. })
    }
}

/// What came, or happened, where an answer was waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Odd {
    /// A datagram that is no message.
    Malformed(WireError),
    /// An answer to something else.
    Foreign {
        /// The first register it is about.
        start: u16,
        /// How many it counts.
        num: u16,
    },
    /// The kernel would not send.
    Unsent(SendFault),
    /// The kernel reported a closed port.
    Closed,
}

impl fmt::Display for Odd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed(error) => write!(f, "the last reply was broken, {error}"),
            Self::Foreign { start, num } => {
                write!(f, "the last reply was to another request ({num} registers from {start:02x})")
            }
            Self::Unsent(fault) => write!(f, "{fault}"),
            Self::Closed => {
                f.write_str("nothing listens on the controller's port: is it starting, is the port right?")
            }
        }
    }
}

/// The odd thing, or what to look at where nothing came at all.
fn behind(request: &Request, odd: Option<&Odd>) -> String {
    let why = odd.map_or_else(
        || "check power, cable and address, PA15 = 1, PA20 to PA24".to_owned(),
        ToString::to_string,
    );
    match request {
        Request::Read { .. } => format!("; {why}"),
        Request::Write { .. } => format!(", and it may have been written nevertheless; {why}"),
    }
}

/// What a reply code other than 2 says, by the controller's dialect (SMC manual 2.2.1 and chapter 6; MBOX as public
/// programs read it).
#[must_use]
pub(crate) fn refusal(code: ReplyCode, error: DeviceError, dialect: Dialect) -> String {
    let x = code as u8;
    let words = match (dialect, code) {
        (_, ReplyCode::Running) => "the controller runs normally",
        (Dialect::Smc, ReplyCode::Fault) => "the controller runs with an error",
        (Dialect::Smc, ReplyCode::EmergencyStop) => "an emergency stop is in effect",
        (Dialect::Smc, ReplyCode::Command) => "the command was wrong, or the controller is",
        (Dialect::Mbox, ReplyCode::Fault) => "the controller says that the request is wrong",
        (Dialect::Mbox, ReplyCode::EmergencyStop) => "the controller says that the request is too short",
        (Dialect::Mbox, ReplyCode::Command) => "for a reason that no mbox program knows",
    };
    if error.0 == 0 { format!("{words} (x = {x})") } else { format!("{words} (x = {x}, {error})") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Address;

    #[test]
    fn a_reply_code_is_read_by_the_dialect() {
        let words = |code, error, dialect| refusal(code, DeviceError(error), dialect);
        let (smc, mbox) = (Dialect::Smc, Dialect::Mbox);
        assert!(words(ReplyCode::Fault, 12, smc).contains("Err12: alarm of the servo of axis 3"));
        assert_eq!(words(ReplyCode::EmergencyStop, 0, smc), "an emergency stop is in effect (x = 4)");
        assert!(words(ReplyCode::EmergencyStop, 0, mbox).contains("too short (x = 4)"));
        assert!(words(ReplyCode::Command, 0, smc).starts_with("the command was wrong"));
    }

    #[test]
    fn silence_says_what_to_check_or_what_came_instead() {
        let silent = |odd| {
            let request = Request::read(Address::Pa(2));
            Fault::Silent { request, tries: 3, timeout: Duration::from_millis(300), odd }.to_string()
        };
        let plain = silent(None);
        assert!(
            plain.starts_with("cannot read PA02: no answer in 3 tries of 300 ms; check power"),
            "{plain}"
        );
        let broken = silent(Some(Odd::Malformed(WireError::Length { len: 17, need: 18 })));
        assert!(broken.ends_with("byte 17: ends after 17 bytes; this message takes 18"), "{broken}");
        let other = silent(Some(Odd::Foreign { start: 0x96, num: 1 }));
        assert!(other.ends_with("was to another request (1 registers from 96)"), "{other}");
    }
}
