//! Lines that bring bytes: read as they come, and each read stamped with the instant at which it was; here, or by a relay that has the
//! device.

use std::io::{self, Read};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::Path;

use super::relayed::{BLOCK, RelayedRead};
use super::{LeftRead, WordSink};
use crate::film::source::LineKind;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// Takes what is read of a line, from its begin to its end, and when that was read.
pub(super) trait LineTaker {
    /// # Errors
    /// Why the line can be of no use.
    fn take(&mut self, bytes: &[u8], at: MonoTime) -> io::Result<()>;
}

/// A line, and who takes what comes on it: another one each time that it is opened.
pub(super) struct ByteLine {
    pub(super) told: WordSink,
    open: Box<dyn Fn() -> Box<dyn LineTaker> + Send>,
}

impl ByteLine {
    pub(super) fn new<T: LineTaker + 'static>(told: WordSink, open: impl Fn() -> T + Send + 'static) -> Self {
        Self { told, open: Box::new(move || Box::new(open())) }
    }

    /// Reads to the end of a stream, or until nobody listens.
    pub(super) fn read(&self, stream: impl Read + AsFd) -> io::Result<()> {
        self.read_left(LeftRead::new(stream, &self.told))
    }

    /// Opens a FIFO or a device, and reads to its end.
    pub(super) fn read_at(&self, path: &Path) -> io::Result<()> {
        self.read_left(LeftRead::open(path, &self.told)?)
    }

    /// Reads what a relay sends of its device, with the instants at which it was read there.
    pub(super) fn read_relayed(&self, socket: &Path, kind: LineKind) -> io::Result<()> {
        let stream = LeftRead::new(UnixStream::connect(socket)?, &self.told);
        let silent =
            format!("{} accepts and says nothing; restart the service that has the line", socket.display());
        self.told.note(|notes| notes.trouble = Some(silent));
        let mut relayed = RelayedRead::begin(stream, kind)?;
        let mut taker = self.begin();
        while let Some((bytes, at)) = relayed.next()? {
            taker.take(bytes, at)?;
        }
        Ok(())
    }

    fn read_left(&self, mut stream: impl Read) -> io::Result<()> {
        let (mut taker, mut bytes) = (self.begin(), [0; BLOCK]);
        loop {
            match stream.read(&mut bytes)? {
                0 => return Ok(()),
                count => taker.take(&bytes[..count], Monotonic.now())?,
            }
        }
    }

    fn begin(&self) -> Box<dyn LineTaker> {
        self.told.note(|notes| notes.trouble = None);
        (self.open)()
    }
}
