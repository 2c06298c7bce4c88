//! Serial lines with virtual drives at their far end.
//!
//! ```text
//!  host --octets--> SerialLine --an octet at its time--> Bus      drives of one dialect
//!       <----------  faults    <--an octet at its time---
//! ```
//!
//! Bus and line are told the time: whole shows run in virtual time. [`PtyLoop`] runs them on a pseudo-terminal, which has no
//! baud rate of its own, so that the line paces the octets.

mod faults;
mod line;
mod pty;
#[cfg(test)]
mod tests;

pub(crate) use faults::LineFaults;
pub(crate) use line::SerialLine;
pub(crate) use pty::{Deed, PtyError, PtyLoop};

use crate::time::MonoTime;

/// What hangs at the far end of a serial line, in virtual time: octets in, octets out.
pub(crate) trait Bus {
    /// An octet has wholly arrived.
    fn on_octet(&mut self, octet: u8, now: MonoTime);

    /// The host sent a break.
    fn on_break(&mut self, now: MonoTime);

    /// Motion, timeouts and delays up to now.
    fn advance(&mut self, now: MonoTime);

    /// The next octet to send, once the earliest time for it is there (reply delay, ADL), taken from the bus. The line paces
    /// it to the baud rate.
    fn take_octet(&mut self, now: MonoTime) -> Option<u8>;

    /// When it wants to be advanced next, if anything is under way.
    fn next(&self) -> Option<MonoTime>;

    /// The baud rate at which it listens and speaks now.
    fn baud(&self) -> u32;
}
