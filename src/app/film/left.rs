//! Lines that are left as soon as nobody listens: one that stays silent would hold its device, or take what a later reader waits for.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::fd::AsFd;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::OFlags;

use super::WordSink;

/// How often it is looked whether anybody still listens.
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 250_000_000 };

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
            let mut wanted = [PollFd::new(&self.line, PollFlags::IN)];
            match poll(&mut wanted, Some(&LOOK)) {
                Ok(0) | Err(rustix::io::Errno::INTR) => continue,
                _ => {}
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
