//! The way to a pad: its device, or the socket of a relay that has it. Both say the same records; nobody waits for either.

use std::io::{self, Read as _, Write as _};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::event::{InputEvent, InputRecords, LEN, lamp};
use crate::config::PadDevice;
use crate::sys::clock::Monotonic;
use crate::sys::evdev;
use crate::time::{Clock as _, MonoTime};

/// What a relay says first.
pub(super) const GREETING: &[u8; 18] = b"kinocue buttons 1\n";
/// A relay gives a sign of life each second: one that says nothing for so long hangs.
const SILENCE: Duration = Duration::from_secs(3);
/// How long a relay may take to greet.
const GREETS: Duration = Duration::from_secs(1);
/// Records that are read at a time.
const AT_ONCE: usize = 64;

/// An open pad.
#[derive(Debug)]
pub(super) struct PadLine {
    stream: std::fs::File,
    /// When a relay was heard last; `None` of a device, whose end the kernel tells.
    heard: Option<MonoTime>,
    records: InputRecords,
}

impl PadLine {
    /// Opens a pad, for this program alone.
    ///
    /// # Errors
    /// Those of the system, in words with what to do.
    pub(super) fn open(device: &PadDevice) -> io::Result<Self> {
        match device {
            PadDevice::Event(path) => Ok(Self::of(evdev::open_alone(path)?, None)),
            PadDevice::Relay(path) => {
                let stream = UnixStream::connect(path).map_err(no_relay)?;
                stream.set_read_timeout(Some(GREETS))?;
                greeted(&stream)?;
                stream.set_nonblocking(true)?;
                Ok(Self::of(stream.into(), Some(Monotonic.now())))
            }
        }
    }

    fn of(fd: OwnedFd, heard: Option<MonoTime>) -> Self {
        Self { stream: fd.into(), heard, records: InputRecords::default() }
    }

    /// Reads what is there, which may be nothing.
    ///
    /// # Errors
    /// Why the pad is gone.
    pub(super) fn read(&mut self, now: MonoTime) -> io::Result<Vec<InputEvent>> {
        let mut octets = [0; AT_ONCE * LEN];
        let count = match self.stream.read(&mut octets) {
            Ok(0) => return Err(gone("the relay has closed, or its device is gone; see its log")),
            Ok(count) => count,
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => 0,
            Err(_) => return Err(gone("it was unplugged; plug it in again")),
        };
        if let Some(heard) = self.heard.as_mut() {
            if count > 0 {
                *heard = now;
            }
            if now.since(*heard) > SILENCE {
                return Err(gone("its relay says nothing: it hangs; restart it"));
            }
        }
        Ok(self.records.take(&octets[..count]))
    }

    /// Lights a lamp, or has it dark.
    ///
    /// # Errors
    /// Those of the system.
    pub(super) fn light(&mut self, code: u16, is_lit: bool) -> io::Result<()> {
        self.stream.write_all(&lamp(code, is_lit))
    }
}

impl AsFd for PadLine {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}

/// Waits until one of them has something, or for so long; says for each whether it has.
pub(super) fn wait<const N: usize>(all: [Option<BorrowedFd<'_>>; N], span: Duration) -> [bool; N] {
    let mut places = Vec::with_capacity(N);
    let mut ready = Vec::with_capacity(N);
    for (place, fd) in all.into_iter().enumerate() {
        if let Some(fd) = fd {
            places.push(place);
            ready.push(PollFd::from_borrowed_fd(fd, PollFlags::IN));
        }
    }
    let span = Timespec::try_from(span).expect("some seconds fit");
    let mut has = [false; N];
    if poll(&mut ready, Some(&span)).is_ok() {
        places.iter().zip(&ready).for_each(|(place, one)| has[*place] = !one.revents().is_empty());
    }
    has
}

fn greeted(mut stream: &UnixStream) -> io::Result<()> {
    let mut greeting = [0; GREETING.len()];
    match stream.read_exact(&mut greeting) {
        Ok(()) if greeting == *GREETING => Ok(()),
        Ok(()) => Err(gone("it is no relay of buttons; name the socket that `kinocue buttons relay` makes")),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
            Err(gone("the relay has no device at present, or another hall has it; its log says which"))
        }
        Err(_) => Err(gone("the relay does not greet: it hangs; restart it")),
    }
}

fn no_relay(error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{error}; start the relay: systemctl start kinocue-buttons"))
}

fn gone(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::BrokenPipe, why)
}

#[cfg(test)]
mod tests {
    use super::super::event::{InputKind, beat, key};
    use super::*;

    fn pair(heard: Option<MonoTime>) -> (PadLine, UnixStream) {
        let (near, far) = UnixStream::pair().unwrap();
        near.set_nonblocking(true).unwrap();
        (PadLine::of(near.into(), heard), far)
    }

    #[test]
    fn records_are_read_whole_however_they_come_and_the_end_is_told() {
        let (mut line, mut pad) = pair(None);
        let now = MonoTime::from_nanos(5_000_000_000);
        let both = [key(1, 1, now), key(1, 0, now)].concat();
        pad.write_all(&both[..30]).unwrap();
        let kinds = |events: Vec<InputEvent>| events.iter().map(|event| event.kind).collect::<Vec<_>>();
        assert_eq!(kinds(line.read(now).unwrap()), [InputKind::Down(1)]);
        assert_eq!(kinds(line.read(now).unwrap()), []);
        pad.write_all(&both[30..]).unwrap();
        assert_eq!(kinds(line.read(now).unwrap()), [InputKind::Up(1)]);
        drop(pad);
        assert!(line.read(now).is_err());
    }

    #[test]
    fn a_relay_that_hangs_is_told_apart_from_one_that_has_nothing_to_say() {
        let at = |s: u64| MonoTime::from_nanos(s * 1_000_000_000);
        let (mut line, mut relay) = pair(Some(at(10)));
        relay.write_all(&beat()).unwrap();
        assert!(line.read(at(12)).unwrap().iter().all(|event| event.kind == InputKind::Other));
        assert!(line.read(at(15)).is_ok());
        assert!(line.read(at(16)).unwrap_err().to_string().contains("it hangs"));
        let (mut device, _pad) = pair(None);
        assert!(device.read(at(10_000)).is_ok(), "a device that nobody presses says nothing");
    }
}
