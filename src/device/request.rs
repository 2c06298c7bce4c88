//! What is asked of a controller, as bytes; and by what its answer is known.

use std::fmt;

use super::address::CONTROL;
use super::{Address, Endpoint};
use crate::wire::{
    Access, Dialect, MAX_LEN, MAX_SERVO_READ, ReadRequest, ServoRead, ServoWrite, Words, WriteRequest,
};

/// The most registers of a controller that one request reads: a reply of 80 bytes. The manuals set no limit, but
/// public programs ask for a few at a time, and nobody has shown a controller that answers many.
pub(crate) const MAX_READ: u16 = 32;

/// Object channels of reads (SMC manual 2.2.2.1).
const READ_DP: u16 = 0;
const READ_PA: u16 = 1;
/// DPF2 restarts the controller (SMC manual 2.3.3).
const REBOOT: u8 = 0xf2;
/// The object channel of writes to DPF0 and on (both manuals' programs agree).
const WRITE_CONTROL: u16 = 2;

/// One request to a controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Request {
    /// What stands in these registers? At most [`MAX_READ`] of a controller, 6 of a drive.
    Read {
        /// The first one.
        first: Address,
        /// How many, at least 1.
        count: u16,
    },
    /// Put a value into a register.
    Write {
        /// Which one.
        address: Address,
        /// The value.
        value: u16,
        /// True if an MBOX controller keeps it over a power cycle, which it does by another object channel; SMC
        /// controllers keep nothing until PA0f = 2.
        keep: bool,
    },
}

impl Request {
    /// A read of one register.
    #[must_use]
    pub(crate) const fn read(address: Address) -> Self {
        Self::Read { first: address, count: 1 }
    }

    /// A write that a power cycle undoes, unless PA0f = 2 follows.
    #[must_use]
    pub(crate) const fn write(address: Address, value: u16) -> Self {
        Self::Write { address, value, keep: false }
    }

    /// The first register it is about.
    #[must_use]
    pub(crate) const fn first(&self) -> Address {
        match self {
            Self::Read { first, .. } => *first,
            Self::Write { address, .. } => *address,
        }
    }

    /// How often it may be sent where it is not answered, `most` being what patience allows. A reboot is asked for once:
    /// its answer may be lost in it, and a second one would begin it anew.
    pub(super) const fn tries(&self, most: u32) -> u32 {
        match self {
            Self::Write { address: Address::Dp(REBOOT), .. } => 1,
            _ => most,
        }
    }

    /// By what the answer is known; `None` if a controller of this dialect has no way to be asked for it.
    pub(super) fn id(&self, dialect: Dialect) -> Option<RequestId> {
        let (access, num) = match *self {
            Self::Read { count, .. } => (Access::Read, count),
            Self::Write { .. } => (Access::Write, 1),
        };
        let (servo, channel, start) = match (self.first(), self) {
            (Address::Servo { servo, number }, _) if dialect == Dialect::Smc => (true, servo, number),
            (Address::Servo { .. }, _) => return None, // the SMC manual alone has these messages
            (Address::Pa(number), Self::Read { .. }) => (false, READ_PA, number.into()),
            (Address::Dp(number), Self::Read { .. }) => (false, READ_DP, number.into()),
            (Address::Pa(number), Self::Write { keep, .. }) => {
                (false, parameter_channel(dialect, *keep), number.into())
            }
            (Address::Dp(number @ CONTROL..), Self::Write { .. }) => {
                (false, WRITE_CONTROL, (number - CONTROL).into())
            }
            (Address::Dp(number), Self::Write { .. }) => match dialect {
                Dialect::Smc => (false, 0, number.into()),
                Dialect::Mbox => return None, // channel 0 would write PA of that number
            },
        };
        Some(RequestId { servo, access, channel, start, num })
    }

    /// Writes the request to the front of `buf` and returns it.
    pub(super) fn emit<'b>(&self, id: RequestId, peer: &Endpoint, buf: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let RequestId { servo, channel, start, num, .. } = id;
        let (accept, reply) = (peer.code, peer.code);
        match *self {
            Self::Read { .. } if servo => ServoRead { channel, accept, reply, start, num }.emit(buf),
            Self::Read { .. } => ReadRequest { channel, accept, reply, start, num }.emit(buf),
            Self::Write { value, .. } => {
                let words = [value];
                let data = Words::from(&words[..]);
                if servo {
                    ServoWrite { channel, accept, reply, start, data }.emit(buf)
                } else {
                    WriteRequest { channel, accept, reply, start, data }.emit(buf)
                }
            }
        }
    }
}

/// The object channel of a write to a parameter. SMC: 1. The IMAX manual has 0 alone; MBOX programs use 0 for what a
/// power cycle undoes and 1 for what it does not.
const fn parameter_channel(dialect: Dialect, keep: bool) -> u16 {
    match dialect {
        Dialect::Smc => 1,
        Dialect::Mbox => keep as u16,
    }
}

impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Read { first, count: 1 } => write!(f, "read {first}"),
            Self::Read { first, count } => write!(f, "read {count} registers from {first}"),
            Self::Write { address, value, .. } => write!(f, "write {value} to {address}"),
        }
    }
}

/// By what a reply is known: the protocol gives register messages no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RequestId {
    /// True if it is about a drive.
    pub(super) servo: bool,
    /// Read or write.
    pub(super) access: Access,
    /// The object channel, or the drive.
    pub(super) channel: u16,
    /// The first register.
    pub(super) start: u16,
    /// How many.
    pub(super) num: u16,
}

impl RequestId {
    /// True if a reply to the one could pass for a reply to the other: with x over 2 an SMC controller puts its error
    /// number where channel or drive stood, and may leave out the words.
    pub(super) fn confusable(self, other: Self) -> bool {
        self.servo == other.servo && self.access == other.access && self.start == other.start
    }
}

/// The fewest reads that tell `addresses`; runs of consecutive registers share one, up to [`MAX_READ`] of a controller
/// and 6 of a drive.
#[must_use]
pub fn reads(addresses: &[Address]) -> Vec<Request> {
    let mut sorted = addresses.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    let mut reads: Vec<Request> = Vec::new();
    for address in sorted {
        if let Some(Request::Read { first, count }) = reads.last_mut() {
            let most = if first.is_servo() { MAX_SERVO_READ } else { MAX_READ };
            if first.after(*count) == Some(address) && *count < most {
                *count += 1;
                continue;
            }
        }
        reads.push(Request::read(address));
    }
    reads
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Code, Message};

    fn bytes(request: &Request, dialect: Dialect) -> Option<String> {
        let peer = Endpoint { dialect, code: Code::ALL };
        let id = request.id(dialect)?;
        let mut buf = [0xa5; MAX_LEN];
        let bytes = request.emit(id, &peer, &mut buf);
        assert!(Message::parse(bytes).is_ok());
        Some(
            bytes
                .chunks(2)
                .map(|pair| format!("{:02x}{:02x}", pair[0], pair[1]))
                .collect::<Vec<_>>()
                .join(" "),
        )
    }

    #[test]
    fn reads_name_dp_by_channel_0_and_pa_by_channel_1() {
        let read = |first, count| bytes(&Request::Read { first, count }, Dialect::Smc).unwrap();
        assert_eq!(read(Address::Dp(6), 6), "55aa 0000 1101 0000 ffff ffff 0006 0006");
        assert_eq!(read(Address::Pa(0x95), 1), "55aa 0000 1101 0001 ffff ffff 0095 0001");
        assert_eq!(read(Address::Dp(0xf0), 1), "55aa 0000 1101 0000 ffff ffff 00f0 0001");
        let servo = Address::Servo { servo: 2, number: 508 };
        assert_eq!(bytes(&Request::read(servo), Dialect::Mbox), None);
        assert_eq!(read(servo, 6), "33cc 0000 2101 0002 ffff ffff 01fc 0006");
    }

    #[test]
    fn the_channel_of_a_write_follows_the_dialect() {
        let write = |address, keep, dialect| bytes(&Request::Write { address, value: 5, keep }, dialect);
        let of = |channel: u16, start: u16| {
            Some(format!("55aa 0000 1201 {channel:04x} ffff ffff {start:04x} 0001 0005"))
        };
        let parameter = Address::Pa(0x90);
        assert_eq!(write(parameter, false, Dialect::Smc), of(1, 0x90));
        assert_eq!(write(parameter, true, Dialect::Smc), of(1, 0x90));
        assert_eq!(write(parameter, false, Dialect::Mbox), of(0, 0x90));
        assert_eq!(write(parameter, true, Dialect::Mbox), of(1, 0x90));
        assert_eq!(write(Address::Dp(0xf1), false, Dialect::Mbox), of(2, 1));
        assert_eq!(write(Address::Dp(0x34), false, Dialect::Smc), of(0, 0x34));
        assert_eq!(write(Address::Dp(0x34), false, Dialect::Mbox), None, "it would write PA34");
    }

    #[test]
    fn the_reset_is_the_one_that_was_captured_in_the_field() {
        let reset = bytes(&Request::write(Address::Dp(0xf0), 0), Dialect::Mbox).unwrap();
        assert_eq!(reset, "55aa 0000 1201 0002 ffff ffff 0000 0001 0000");
    }

    #[test]
    fn consecutive_registers_share_a_read_up_to_its_limit() {
        let pa = |numbers: &[u8]| numbers.iter().map(|number| Address::Pa(*number)).collect::<Vec<_>>();
        let read = |first, count| Request::Read { first: Address::Pa(first), count };
        assert_eq!(reads(&pa(&[2, 0, 1, 5, 1])), [read(0, 3), read(5, 1)]);
        assert_eq!(reads(&pa(&(0..40).collect::<Vec<_>>())), [read(0, 32), read(32, 8)]);
        let servo: Vec<_> = (508..516).map(|number| Address::Servo { servo: 1, number }).collect();
        let counts: Vec<_> = reads(&servo).iter().map(ToString::to_string).collect();
        assert_eq!(counts, ["read 6 registers from servo 1 508", "read 2 registers from servo 1 514"]);
        assert_eq!(reads(&[Address::Pa(0xff), Address::Dp(0)]).len(), 2);
    }
}
