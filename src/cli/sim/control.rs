//! The control socket of `kinocue sim`: one command per line, each answered with `ok` or `error …`.

use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::sys::unix_socket::listen_in_place;

/// Connections at a time.
const CONNECTIONS: usize = 16;
/// Bytes of a line.
const LINE: u64 = 1_024;

/// Carries out one command.
pub(super) type CarryOut = Arc<dyn Fn(&str) -> anyhow::Result<()> + Send + Sync>;

/// A control socket; its file goes with it.
#[derive(Debug)]
pub(super) struct Control {
    path: PathBuf,
}

impl Control {
    /// Listens at `path`, in the place of a socket that nobody listens to any more.
    ///
    /// # Errors
    /// A path that is taken or cannot be made, or a thread that cannot be had.
    pub(super) fn open(path: &Path, carry_out: CarryOut) -> io::Result<Self> {
        let listener = listen_in_place(path)?;
        let control = Self { path: path.to_owned() };
        std::thread::Builder::new()
            .name("sim-control".to_owned())
            .spawn(move || accept(&listener, &carry_out))?;
        Ok(control)
    }
}

impl Drop for Control {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path); // it may be gone already
    }
}

/// Serves each connection on a thread of its own, until the program ends.
fn accept(listener: &UnixListener, carry_out: &CarryOut) {
    let open = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else { continue };
        let place = ControlPlace::take(&open);
        let Some(place) = place else {
            let _ = (&stream).write_all(b"error too many connections\n");
            continue;
        };
        let carry_out = Arc::clone(carry_out);
        // Without a thread the connection closes, which says enough.
        let _ = std::thread::Builder::new().name("sim-control".to_owned()).spawn(move || {
            let _ = serve(&stream, &carry_out); // whoever was connected is gone
            drop(place);
        });
    }
}

/// One of the connections that there may be.
struct ControlPlace(Arc<AtomicUsize>);

impl ControlPlace {
    fn take(open: &Arc<AtomicUsize>) -> Option<Self> {
        let place = Self(Arc::clone(open));
        (open.fetch_add(1, Ordering::Relaxed) < CONNECTIONS).then_some(place)
    }
}

impl Drop for ControlPlace {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Answers line by line; a line that is too long ends the connection.
fn serve(stream: &UnixStream, carry_out: &CarryOut) -> io::Result<()> {
    let mut lines = BufReader::new(stream);
    let mut line = Vec::new();
    loop {
        line.clear();
        lines.by_ref().take(LINE).read_until(b'\n', &mut line)?;
        if line.is_empty() {
            return Ok(());
        }
        if line.last() != Some(&b'\n') && line.len() as u64 == LINE {
            return writeln!(&*stream, "error a line has at most {LINE} bytes");
        }
        let done = std::str::from_utf8(&line).map_err(Into::into).and_then(|text| carry_out(text.trim()));
        let answer = match done {
            Ok(()) => "ok".to_owned(),
            Err(error) => format!("error {error:#}"),
        };
        writeln!(&*stream, "{answer}")?;
    }
}
