//! Pseudo-terminals, by which a simulator is a serial line.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::OctetLine;

/// A pseudo-terminal: what is written here is read at its path, and the other way round. It has no baud rate, and knows no break.
#[derive(Debug)]
pub(crate) struct Pty {
    line: OctetLine,
    /// Held open, so that the line outlives whoever opens and closes it.
    _far: OwnedFd,
    path: PathBuf,
}

impl Pty {
    /// A new one, raw.
    ///
    /// # Errors
    /// What the system says.
    pub(crate) fn open() -> io::Result<Self> {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&near)?;
        unlockpt(&near)?;
        let name = ptsname(&near, Vec::new())?;
        let path = PathBuf::from(name.to_str().map_err(|_| io::ErrorKind::InvalidData)?);
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let far = ioctl_tiocgptpeer(&near, flags)?;
        let mut modes = tcgetattr(&far)?;
        modes.make_raw();
        tcsetattr(&far, OptionalActions::Now, &modes)?;
        rustix::io::ioctl_fionbio(&near, true)?;
        Ok(Self { line: OctetLine(near), _far: far, path })
    }

    /// What others open.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The rate at which whoever opened the path last set it; the pseudo-terminal itself keeps to none.
    pub(crate) fn baud(&self) -> Option<u32> {
        tcgetattr(&self.line).ok().map(|modes| modes.output_speed())
    }

    /// The near end. Whoever has the path open sees a port that vanished once this is dropped.
    pub(crate) fn line(&self) -> &OctetLine {
        &self.line
    }
}
