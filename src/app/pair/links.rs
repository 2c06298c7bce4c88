//! Sockets for the link to the engine, each with a thread of its own.

use std::io;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::time::Duration;

use super::{PairError, thread};
use crate::api::unix_socket;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// Serves a socket at `path`, one link at a time: another one that comes meanwhile is served once this one is gone, or does not answer for
/// as long as `patience`.
pub(super) fn serve(
    name: &str,
    path: &Path,
    patience: Duration,
    serve_one: impl Fn(&UnixStream) -> io::Result<()> + Send + 'static,
) -> Result<(), PairError> {
    let (listener, file) = unix_socket(path)?;
    listener.set_nonblocking(false).map_err(PairError::System)?;
    thread(name, move || {
        let _file = file;
        let mut again = Monotonic.now();
        loop {
            // Where the system has no descriptor left it is tried again a moment later.
            Monotonic.sleep_until(again);
            let _ = next(&listener, patience).and_then(|stream| serve_one(&stream)); // it is gone: another one comes
            again = Monotonic.now() + crate::pair::RENEW;
        }
    })
}

fn next(listener: &UnixListener, patience: Duration) -> io::Result<UnixStream> {
    let (stream, _) = listener.accept()?;
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(patience))?;
    stream.set_write_timeout(Some(patience))?;
    Ok(stream)
}
