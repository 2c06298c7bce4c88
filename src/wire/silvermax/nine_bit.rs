//! The binary form in nine bits, which is read and never sent: its octets need their parity switched one by one. Layout by a
//! public program; the command reference has its name alone (PRO, page 67).
//!
//! Address (ninth bit 1), length, command, parameters with the high octet first, and the octet with which all sum up to 0.
//! A length of 0 is a poll, and of 0x80 an ack.

use super::command::command;
use super::request::Parameters;
use super::{AnyRequest, LineError, Reply, Words};

/// A message in nine bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NineBit {
    /// From a host.
    Request(AnyRequest),
    /// From a drive.
    Reply(Reply),
}

/// The length that an ack has in place of one.
const ACK: u8 = 0x80;

impl NineBit {
    /// Reads what a host sent: one message, whole.
    ///
    /// # Errors
    /// A [`LineError`] where it is none, or of a command whose parameters nobody has told.
    pub(crate) fn request(octets: &[u8]) -> Result<Self, LineError> {
        let (unit, body) = parts(octets)?;
        let mut request = AnyRequest { unit, number: 0, parameters: Parameters::default() };
        let Some((number, mut rest)) = body.split_first() else { return Ok(Self::Request(request)) };
        request.number = *number;
        let unknown = LineError::Number { at: 2, what: "command whose parameters are known" };
        for parameter in command(*number).ok_or(unknown)?.parameters {
            let (value, behind) = parameter.read(rest).ok_or_else(|| length(octets))?;
            let _ = request.parameters.push(value); // no command has more than fit
            rest = behind;
        }
        if rest.is_empty() { Ok(Self::Request(request)) } else { Err(length(octets)) }
    }

    /// Reads what a drive answered: one message, whole.
    ///
    /// # Errors
    /// A [`LineError`] where it is none.
    pub(crate) fn reply(octets: &[u8]) -> Result<Self, LineError> {
        if let [unit, ACK, _] = octets {
            sum(octets)?;
            return Ok(Self::Reply(Reply::Ack { unit: *unit }));
        }
        let (unit, body) = parts(octets)?;
        let Some((command, words)) = body.split_first() else { return Err(length(octets)) };
        if words.len() % 2 != 0 || words.len() > 16 {
            return Err(length(octets));
        }
        let mut kept = [0; 8];
        for (kept, pair) in kept.iter_mut().zip(words.chunks_exact(2)) {
            *kept = u16::from_be_bytes([pair[0], pair[1]]);
        }
        let words = Words::of(&kept[..words.len() / 2]);
        Ok(Self::Reply(Reply::Data { unit, command: (*command).into(), words }))
    }
}

/// Address and what is between length and sum.
fn parts(octets: &[u8]) -> Result<(u8, &[u8]), LineError> {
    let [unit, said, body @ .., _] = octets else { return Err(length(octets)) };
    if body.len() != usize::from(*said) {
        return Err(length(octets));
    }
    sum(octets)?;
    Ok((*unit, body))
}

fn sum(octets: &[u8]) -> Result<(), LineError> {
    let found = octets.iter().fold(0, |sum: u8, octet| sum.wrapping_add(*octet));
    if found == 0 { Ok(()) } else { Err(LineError::Sum { found }) }
}

fn length(octets: &[u8]) -> LineError {
    let said = octets.get(1).map_or(0, |length| usize::from(*length));
    LineError::Length { found: octets.len(), said: said + 3 }
}
