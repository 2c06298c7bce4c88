//! The language of a SilverMax: lines of ASCII on a serial line, as host and as drive (command reference, pages 10 to 16).
//!
//! ```text
//!  Request --emit--> "@16 12 1\r"              octets --LineCollector--> line --AnyRequest::parse--> the drive
//!  Reply::parse <--LineCollector-- octets      "# 10 000C 0005 06A3\r" <--emit-- Reply
//! ```
//!
//! What is sent and what is read are two types: a [`Request`] is what may be sent, and nothing else can be written; an
//! [`AnyRequest`] is whatever a line may hold. Requests are decimal, replies hexadecimal, so that unit 16 answers as `10`.
//! No line carries a sum: a flipped digit is another number. Any thread; nothing allocates or panics.

mod command;
mod line;
mod nine_bit;
pub(crate) mod register;
mod reply;
#[cfg_attr(not(test), expect(dead_code, reason = "links of drives send in the next step"))]
mod request;
mod status;
#[cfg(test)]
mod tests;

pub(crate) use command::{Class, command};
pub(crate) use line::{Collected, LineCollector, LineError, MAX_LINE};
pub(crate) use nine_bit::NineBit;
pub(crate) use reply::{NakReason, Reply, Words};
pub(crate) use request::{AnyRequest, Request, StopOn};
pub(crate) use status::{Internal, Io, Poll, StatusWord, conditions, kill_bits, kill_names};

/// All units at once; like a group they obey and never answer (command reference, IDT, page 54).
pub(crate) const ALL_UNITS: u8 = 255;
