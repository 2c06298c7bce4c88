//! A line that another process has the device of: what it reads there, and when, over a socket. So the service that moves seats needs no
//! sound card, and several halls hear one line. Both are on one machine, whose clock they share.

use std::io::{self, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::line::{ByteLine, LineTaker};
use super::relayed::{FULL, greeting, record};
use super::{ChildSlot, FilmError, WordSink, mtc, sound_line, start};
use crate::film::source::{FilmSource, LineKind, MtcInput, SoundLine};
use crate::sys::unix_socket::listen_in_place;
use crate::time::MonoTime;

/// Halls that hear one line at the most.
const LISTENERS: usize = 8;

/// Those that hear a line.
#[derive(Debug, Clone, Default)]
pub(super) struct Listeners {
    streams: Arc<Mutex<Vec<UnixStream>>>,
    /// True while the device is there: else nobody is let in.
    has_line: Arc<AtomicBool>,
}

impl Listeners {
    /// Lets them in at the socket of a source in a folder, which nobody else may serve.
    ///
    /// # Errors
    /// [`FilmError`]: the source is no line, or the socket cannot be served.
    pub(super) fn serve(source: &FilmSource, folder: &Path) -> Result<Self, FilmError> {
        let kind = kind_of(source)?;
        let socket = folder.join(format!("{}.sock", kind.name()));
        let listeners = Self::default();
        let failed = |source| FilmError::Open { what: socket.display().to_string(), source };
        listeners.let_in_at(&socket, kind).map_err(failed)?;
        Ok(listeners)
    }

    fn let_in_at(&self, socket: &Path, kind: LineKind) -> io::Result<()> {
        let listener = listen_in_place(socket)?;
        // Who may hear it is a matter of the folder: it says nothing but what time it is in a film.
        std::fs::set_permissions(socket, std::fs::Permissions::from_mode(0o666))?;
        let listeners = self.clone();
        start("relay", move || {
            for stream in listener.incoming() {
                // One that cannot be greeted is let go.
                let _ = stream.and_then(|stream| listeners.let_in(stream, kind));
            }
        })
    }

    /// Begins to pass on what is read of that source.
    pub(super) fn read(
        &self,
        source: &FilmSource,
        told: WordSink,
        child: ChildSlot,
    ) -> Result<(), FilmError> {
        let listeners = self.clone();
        let line = ByteLine::new(told, move || listeners.begin());
        match source {
            FilmSource::Ltc(input) => sound_line::start_line(input, 1, line, &child),
            FilmSource::Mtc(input) => mtc::start_line(input, line),
            _ => Err(FilmError::NoLine(source.to_string())),
        }
    }

    fn let_in(&self, mut stream: UnixStream, kind: LineKind) -> io::Result<()> {
        if !self.has_line.load(Ordering::Relaxed) {
            return Ok(());
        }
        stream.set_nonblocking(true)?;
        let mut streams = self.streams();
        if streams.len() >= LISTENERS {
            return stream.write_all(FULL);
        }
        stream.write_all(greeting(kind).as_bytes())?;
        streams.push(stream);
        Ok(())
    }

    /// The device is there, until what this gives is dropped.
    pub(super) fn begin(&self) -> RelayTaker {
        self.has_line.store(true, Ordering::Relaxed);
        RelayTaker(self.clone())
    }

    fn streams(&self) -> MutexGuard<'_, Vec<UnixStream>> {
        self.streams.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Passes on what is read of a line.
pub(super) struct RelayTaker(Listeners);

impl Drop for RelayTaker {
    /// The device is gone: whoever heard it learns that.
    fn drop(&mut self) {
        self.0.has_line.store(false, Ordering::Relaxed);
        self.0.streams().clear();
    }
}

impl LineTaker for RelayTaker {
    /// One that does not keep up is let go, and may come again: nobody waits for it.
    fn take(&mut self, bytes: &[u8], at: MonoTime) -> io::Result<()> {
        let record = record(bytes, at);
        let passed = |stream: &mut UnixStream| stream.write(&record).is_ok_and(|sent| sent == record.len());
        self.0.streams().retain_mut(passed);
        Ok(())
    }
}

/// The kind of line of a source that has a device of its own.
fn kind_of(source: &FilmSource) -> Result<LineKind, FilmError> {
    match source {
        FilmSource::Ltc(SoundLine::Pipe(_) | SoundLine::Fifo(_) | SoundLine::Stdin | SoundLine::Alsa(_)) => {
            Ok(LineKind::Ltc)
        }
        FilmSource::Mtc(MtcInput::Device(_)) => Ok(LineKind::Mtc),
        _ => Err(FilmError::NoLine(source.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::film::relayed::{BLOCK, RelayedRead};
    use crate::sys::clock::Monotonic;
    use crate::time::Clock as _;

    #[test]
    fn what_is_read_of_a_line_is_heard_with_when_that_was_by_all_that_listen() {
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("ltc.sock");
        let source = FilmSource::Ltc(SoundLine::Stdin);
        let listeners = Listeners::serve(&source, folder.path()).unwrap();
        let refused = RelayedRead::begin(UnixStream::connect(&socket).unwrap(), LineKind::Ltc).err().unwrap();
        assert!(refused.to_string().contains("has no line at present"), "{refused}");

        let mut line = listeners.begin();
        let join = || RelayedRead::begin(UnixStream::connect(&socket).unwrap(), LineKind::Ltc).unwrap();
        let mut both = [join(), join()];
        let (first, second) = (Monotonic.now(), Monotonic.now());
        line.take(b"one", first).unwrap();
        line.take(b"two", second).unwrap();
        for one in &mut both {
            assert_eq!(one.next().unwrap(), Some((&b"one"[..], first)));
            assert_eq!(one.next().unwrap(), Some((&b"two"[..], second)));
        }
        drop(line);
        assert!(both.iter_mut().all(|one| one.next().unwrap().is_none()), "the device is gone");
        let taken = Listeners::serve(&source, folder.path()).unwrap_err();
        assert!(matches!(taken, FilmError::Open { source, .. } if source.kind() == io::ErrorKind::AddrInUse));
    }

    #[test]
    fn one_more_than_are_served_learns_why_it_hears_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let listeners = Listeners::serve(&FilmSource::Ltc(SoundLine::Stdin), folder.path()).unwrap();
        let _line = listeners.begin();
        let connect = || UnixStream::connect(folder.path().join("ltc.sock")).unwrap();
        let join = || RelayedRead::begin(connect(), LineKind::Ltc);
        let served: Vec<_> = (0..LISTENERS).map(|_| join().unwrap()).collect();
        let refused = join().err().unwrap().to_string();
        assert!(refused.contains("as many halls as it can"), "{refused}");
        drop(served);
    }

    #[test]
    fn one_that_does_not_listen_is_let_go_and_holds_nobody_up() {
        let (ours, _theirs) = UnixStream::pair().unwrap();
        let mut line = Listeners::default().begin();
        line.0.let_in(ours, LineKind::Ltc).unwrap();
        let mut taken = 0;
        while !line.0.streams().is_empty() {
            line.take(&[0; BLOCK], Monotonic.now()).unwrap();
            taken += 1;
            assert!(taken < 100_000, "a socket does not hold that much");
        }
    }
}
