//! Octets out and in, each call with an absolute deadline. Nothing here allocates.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::ioctl::{Getter, ioctl};
use rustix::termios::{QueueSelector, tcflush};

use super::{PortFault, code};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// What octets go out on and come in by.
#[derive(Debug)]
pub(crate) struct OctetLine(pub(in crate::sys) OwnedFd);

impl OctetLine {
    /// Reads what has come, waiting for it until `deadline`; 0 if nothing came by then. A deadline that is past takes what is
    /// there already.
    ///
    /// # Errors
    /// [`PortFault::Vanished`] once nobody is at the other end any more, by when octets that came before may be gone as well.
    pub(crate) fn read(&self, octets: &mut [u8], deadline: MonoTime) -> Result<usize, PortFault> {
        loop {
            let found = self.wait(PollFlags::IN, deadline)?;
            if found.is_empty() {
                return Ok(0);
            }
            match rustix::io::read(&self.0, &mut *octets) {
                Ok(0) | Err(Errno::AGAIN) if found.contains(PollFlags::HUP) => {
                    return Err(PortFault::Vanished);
                }
                // Somebody flushed it in between.
                Ok(0) | Err(Errno::AGAIN | Errno::INTR) => {}
                Ok(count) => return Ok(count),
                Err(errno) => return Err(errno.into()),
            }
            if Monotonic.now() >= deadline {
                return Ok(0);
            }
        }
    }

    /// Hands octets to the driver until `deadline`; says how many it took. They are not sent by then: [`OctetLine::unsent`].
    ///
    /// # Errors
    /// [`PortFault::Vanished`] if nobody is at the other end.
    pub(crate) fn write(&self, octets: &[u8], deadline: MonoTime) -> Result<usize, PortFault> {
        let mut taken = 0;
        while taken < octets.len() {
            let found = self.wait(PollFlags::OUT, deadline)?;
            if found.contains(PollFlags::HUP) {
                return Err(PortFault::Vanished);
            }
            if found.is_empty() {
                break;
            }
            match rustix::io::write(&self.0, &octets[taken..]) {
                Ok(count) => taken += count,
                Err(Errno::AGAIN | Errno::INTR) if Monotonic.now() >= deadline => break,
                Err(Errno::AGAIN | Errno::INTR) => {}
                Err(errno) => return Err(errno.into()),
            }
        }
        Ok(taken)
    }

    /// Octets that the driver holds and has not sent.
    ///
    /// # Errors
    /// A [`PortFault`] where the port is gone.
    #[expect(unsafe_code, reason = "no library has it")]
    pub(crate) fn unsent(&self) -> Result<u32, PortFault> {
        // SAFETY: TIOCOUTQ writes one int.
        let count = unsafe { ioctl(&self.0, Getter::<{ code(libc::TIOCOUTQ) }, libc::c_int>::new()) }?;
        Ok(u32::try_from(count).unwrap_or(0))
    }

    /// Forgets what has come and what was not sent yet.
    ///
    /// # Errors
    /// A [`PortFault`] where the port is gone.
    pub(crate) fn discard(&self) -> Result<(), PortFault> {
        Ok(tcflush(&self.0, QueueSelector::IOFlush)?)
    }

    /// What of `wanted` there is, or that the other end is gone; nothing at the deadline.
    fn wait(&self, wanted: PollFlags, deadline: MonoTime) -> Result<PollFlags, PortFault> {
        loop {
            let left = deadline.since(Monotonic.now());
            let wait = Timespec::try_from(left).map_err(|_| PortFault::System(Errno::INVAL))?;
            let mut polled = [PollFd::new(&self.0, wanted)];
            match poll(&mut polled, Some(&wait)) {
                Ok(0) => return Ok(PollFlags::empty()),
                Ok(_) => {}
                Err(Errno::INTR) => continue,
                Err(errno) => return Err(errno.into()),
            }
            let [polled] = polled;
            let found = polled.revents();
            return if found.intersects(PollFlags::ERR | PollFlags::NVAL) && !found.intersects(wanted) {
                Err(PortFault::Vanished)
            } else {
                Ok(found)
            };
        }
    }
}

impl AsFd for OctetLine {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}
