//! What a homing by this program tells, whatever drives it leads.

use crate::sys::file::random;
use std::io;

use sha2::{Digest as _, Sha256};

/// What a homing does, for whoever watches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// An axis, from 0, is disarmed and held where it is.
    Held(usize),
    /// It moves off its switch.
    OffSwitch(usize),
    /// It looks for its zero.
    Searching(usize),
    /// It knows where it is.
    Found(usize),
    /// All go to park.
    Parking,
    /// Its settings are written and read back.
    Set(usize),
}

/// A seat whose line leads to another one that was homed before, and has drives of the same numbers.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "its drives were homed as {0}: adapters or plugs have changed places; put them back; where the seats \
     themselves have got other names, switch its drives off and on, then home it"
)]
pub(crate) struct HomedAs(pub(crate) String);

/// A number that is another once what a seat is set to, in words, is: nothing else can be read back of much of it.
pub(crate) fn sum_of(settings: &str) -> u64 {
    Sha256::digest(settings).iter().take(8).fold(0, |sum, octet| sum << 8 | u64::from(*octet))
}

/// A number that stands in no register by itself.
///
/// # Errors
/// Where the system gives no chance.
pub(crate) fn canary() -> io::Result<i32> {
    // 0 is what a unit has after a reset.
    Ok(match i32::from_le_bytes(random()?) {
        0 => 1,
        number => number,
    })
}
