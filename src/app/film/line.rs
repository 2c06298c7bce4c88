//! Lines that bring bytes: read as they come, and each read stamped with the instant at which it was; here, or by a relay that has the
//! device.

use std::io::{self, Read};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::Path;

use super::relayed::{BLOCK, RelayedRead};
use super::{LeftRead, WantedFile, WordSink};
use crate::film::source::LineKind;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

pub(super) const RELAY: WantedFile = WantedFile::socket("give the path of a socket of `kinocue sync relay`");

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
        let stream = UnixStream::connect(socket).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::ConnectionRefused => {
                let why = "no relay is there; start kinocue-sync.service, or `kinocue sync relay`";
                io::Error::new(error.kind(), why)
            }
            _ => error,
        })?;
        let stream = LeftRead::new(stream, &self.told);
        let silent =
            format!("{} accepts and says nothing; restart the service that has the line", socket.display());
        self.told.note(|notes| notes.trouble = Some(silent));
        let mut relayed = RelayedRead::begin(stream, kind)?;
        self.told.note(|notes| notes.trouble = None);
        let mut taker = (self.open)();
        while let Some((bytes, at)) = relayed.next()? {
            taker.take(bytes, at)?;
        }
        Ok(())
    }

    fn read_left(&self, mut stream: impl Read) -> io::Result<()> {
        let (mut taker, mut bytes, mut is_heard) = ((self.open)(), [0; BLOCK], false);
        loop {
            let count = stream.read(&mut bytes)?;
            if count == 0 {
                return Ok(());
            }
            // What was wrong before is so until something comes: a command that fails is started again and again.
            if !std::mem::replace(&mut is_heard, true) {
                self.told.note(|notes| notes.trouble = None);
            }
            taker.take(&bytes[..count], Monotonic.now())?;
        }
    }
}
