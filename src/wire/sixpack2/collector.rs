//! Octets of a line to frames. Since frames have neither beginning nor sum, one octet more or less shifts all that follow, until
//! the line is silent for long enough, or a break comes (CMD $41; manual, page 21).

use std::time::Duration;

use super::{FRAME_LEN, SixpackFrame};

/// Collects the octets of frames, at either end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrameCollector {
    timeout: Option<Duration>,
    octets: [u8; FRAME_LEN],
    count: usize,
    strays: u64,
}

impl FrameCollector {
    /// One that forgets what it has after a silence longer than `timeout`; with none it never does.
    #[must_use]
    pub(crate) const fn new(timeout: Option<Duration>) -> Self {
        Self { timeout, octets: [0; FRAME_LEN], count: 0, strays: 0 }
    }

    /// Another timeout from now on.
    pub(crate) const fn set_timeout(&mut self, timeout: Option<Duration>) {
        self.timeout = timeout;
    }

    /// Takes an octet that came after such a silence, and gives the frame of which it is the last.
    pub(crate) fn push(&mut self, octet: u8, silence: Duration) -> Option<SixpackFrame> {
        if self.timeout.is_some_and(|timeout| silence > timeout) {
            self.clear();
        }
        self.octets[self.count] = octet;
        self.count += 1;
        if self.count < FRAME_LEN {
            return None;
        }
        self.count = 0;
        Some(SixpackFrame::from_octets(self.octets))
    }

    /// A break, or a silence that is known to have been long enough: the next octet is the first of a frame.
    pub(crate) fn clear(&mut self) {
        self.strays += self.count as u64;
        self.count = 0;
    }

    /// Octets of the frame that is not whole yet.
    #[must_use]
    pub(crate) fn begun(&self) -> &[u8] {
        &self.octets[..self.count]
    }

    /// Octets that were forgotten, as they never became a frame.
    #[must_use]
    pub(crate) const fn strays(&self) -> u64 {
        self.strays
    }
}
