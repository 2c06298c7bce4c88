//! The seam between procedures and a line: a real one, or one in virtual time.

use std::time::Duration;

use crate::sys::serial::SerialError;
use crate::time::MonoTime;

/// The host's end of a serial line.
pub(crate) trait LinkPort {
    /// The present instant.
    fn now(&self) -> MonoTime;

    /// Sends all of it; the line is busy for its octets.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault>;

    /// What arrives up to then, at least one octet; none at the deadline.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault>;

    /// Drops what came unasked, says how much.
    fn flush(&mut self) -> usize;

    /// Holds the line at 0 for so long, by which whoever listens forgets what it has of a message. All that was sent has to have left
    /// by then.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault>;

    /// Sends and listens at so many bits a second from now on.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone, or cannot make that rate.
    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault>;

    /// Tries to have it again where it is gone, once, by then.
    ///
    /// # Errors
    /// Why it cannot be had, with what to do.
    fn mend(&mut self, until: MonoTime) -> Result<(), SerialError> {
        self.sleep_until(until);
        Ok(())
    }

    /// Returns then; at once where that is past.
    fn sleep_until(&mut self, at: MonoTime);
}

impl<P: LinkPort + ?Sized> LinkPort for Box<P> {
    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault> {
        (**self).send_break(span)
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        (**self).set_baud(baud)
    }

    fn now(&self) -> MonoTime {
        (**self).now()
    }

    fn mend(&mut self, until: MonoTime) -> Result<(), SerialError> {
        (**self).mend(until)
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault> {
        (**self).send(octets)
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        (**self).receive(buf, deadline)
    }

    fn flush(&mut self) -> usize {
        (**self).flush()
    }

    fn sleep_until(&mut self, at: MonoTime) {
        (**self).sleep_until(at);
    }
}

/// The port is gone, or nobody takes what goes out on it: neither what was sent nor what is answered goes over it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("nothing goes out by the port any more; check its plug, and the power of adapter and units")]
pub(crate) struct LinkFault;
