//! A CAN bus as procedures have it, that is as a line: each nine octets of theirs are a frame of it. The thread of a link.

use std::collections::VecDeque;
use std::path::Path;

use crate::sys::can::{CanIds, CanSocket};
use crate::sys::serial::{CanError, PortFault};
use crate::time::MonoTime;
use crate::wire::sixpack2::{CanFrame, FRAME_LEN, ID_ZEROS, SixpackFrame};

/// A bus that is open.
#[derive(Debug)]
pub(super) struct BusPort {
    socket: CanSocket,
    /// Frames that wait in the interface: they come back once somebody has acknowledged them.
    waiting: Vec<CanFrame>,
    came: VecDeque<u8>,
}

impl BusPort {
    /// Opens that of an interface.
    pub(super) fn open(interface: &Path) -> Result<Self, CanError> {
        CanSocket::open(interface, CanIds { id: 0, mask: ID_ZEROS }).map(Self::over)
    }

    pub(super) const fn over(socket: CanSocket) -> Self {
        Self { socket, waiting: Vec::new(), came: VecDeque::new() }
    }

    /// Hands frames over; false where one found no room.
    pub(super) fn send(&mut self, octets: &[u8], deadline: MonoTime) -> Result<bool, PortFault> {
        for frame in octets.as_chunks::<FRAME_LEN>().0 {
            let frame = CanFrame::from(SixpackFrame::from_octets(*frame));
            if !self.socket.send((frame.id, frame.octets), deadline)? {
                return Ok(false);
            }
            self.waiting.push(frame);
        }
        Ok(true)
    }

    /// True once all that was handed over has left, which is waited for until then.
    pub(super) fn drain(&mut self, deadline: MonoTime) -> Result<bool, PortFault> {
        while !self.waiting.is_empty() {
            if !self.take(deadline)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Octets of frames that others sent; 0 where none came by then.
    pub(super) fn read(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, PortFault> {
        while self.came.is_empty() {
            if !self.take(deadline)? {
                return Ok(0);
            }
        }
        let octets = std::iter::from_fn(|| self.came.pop_front());
        Ok(buf.iter_mut().zip(octets).map(|(place, octet)| *place = octet).count())
    }

    /// Takes the next frame that comes, whosever it is; false where none came by then.
    fn take(&mut self, deadline: MonoTime) -> Result<bool, PortFault> {
        let Some((id, octets)) = self.socket.receive(deadline)? else { return Ok(false) };
        let frame = CanFrame { id, octets };
        if let Some(own) = self.waiting.iter().position(|sent| *sent == frame) {
            self.waiting.remove(own);
        } else if let Ok(frame) = SixpackFrame::try_from(frame) {
            self.came.extend(frame.octets());
        }
        Ok(true)
    }
}
