//! Lines that are left as soon as nobody listens: one that stays silent would hold its device, or take what a later reader waits for.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::fd::AsFd;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::fs::OFlags;

use super::WordSink;

/// How often it is looked whether anybody still listens.
pub(super) const LOOK: Duration = Duration::from_millis(250);

/// A line, at whose end one is as well where nobody listens any more.
pub(super) struct LeftRead<R> {
    line: R,
    over: Arc<AtomicBool>,
}

impl<R: Read + AsFd> LeftRead<R> {
    pub(super) fn new(line: R, told: &WordSink) -> Self {
        Self { line, over: Arc::clone(&told.over) }
    }
}

impl LeftRead<File> {
    /// Opens a FIFO or a device, without waiting for whoever writes.
    pub(super) fn open(path: &Path, told: &WordSink) -> io::Result<Self> {
        let flags = OFlags::NONBLOCK.bits().cast_signed();
        Ok(Self::new(OpenOptions::new().read(true).custom_flags(flags).open(path)?, told))
    }
}

impl<R: Read + AsFd> Read for LeftRead<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        while !self.over.load(Ordering::Relaxed) {
            // Before there is a writer a FIFO that is read is at its end, and only a poll waits for one.
            if !brings(&self.line, LOOK) {
                continue;
            }
            match self.line.read(bytes) {
                Err(error)
                    if matches!(error.kind(), io::ErrorKind::Interrupted | io::ErrorKind::WouldBlock) => {}
                read => return read,
            }
        }
        Ok(0)
    }
}

/// Waits until a line brings something, or ends; false if it did not within that time, which is kept to far below a millisecond.
pub(super) fn brings(line: &impl AsFd, within: Duration) -> bool {
    let within = within.try_into().ok();
    !matches!(
        poll(&mut [PollFd::new(line, PollFlags::IN)], within.as_ref()),
        Ok(0) | Err(rustix::io::Errno::INTR)
    )
}
