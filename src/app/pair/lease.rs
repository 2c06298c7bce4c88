//! The lease by the link to the engine. The link comes to a socket of its own, is told one line at a time what to ask the engine, and
//! answers by one. A promise counts from before that line was written, on this machine's clock: whatever link, network and engine take
//! shortens it.

use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::Arc;

use super::{PairError, PairShared, thread};
use crate::api::unix_socket;
use crate::pair::{Answered, PROMISED};
use crate::sys::clock::Monotonic;
use crate::sys::lock::lock;
use crate::time::Clock as _;

/// The longest line of a link.
const LINE: u64 = 1_024;

/// Serves the socket at `path`.
pub(super) fn start(shared: &Arc<PairShared>, path: &Path) -> Result<(), PairError> {
    let (listener, file) = unix_socket(path)?;
    listener.set_nonblocking(false).map_err(PairError::System)?;
    let shared = Arc::clone(shared);
    thread("pair-lease", move || {
        let _file = file;
        serve(&shared, &listener);
    })
}

/// One link at a time: of another one that comes meanwhile, what it is told is told once this one is gone, or does not answer.
fn serve(shared: &PairShared, listener: &UnixListener) {
    let mut again = Monotonic.now();
    loop {
        // Where the system has no descriptor left it is tried again a moment later.
        Monotonic.sleep_until(again);
        if let Ok((stream, _)) = listener.accept() {
            let _ = ask(shared, &stream); // it is gone: another one comes
        }
        again = Monotonic.now() + crate::pair::RENEW;
    }
}

fn ask(shared: &PairShared, stream: &UnixStream) -> io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(PROMISED))?;
    stream.set_write_timeout(Some(PROMISED))?;
    let mut lines = BufReader::new(stream);
    loop {
        let due = lock(&shared.claim).ask_at();
        Monotonic.sleep_until(due);
        let ask = shared.act(|claim, now| claim.ask(now));
        let mut line = serde_json::to_string(&ask).expect("it is names and numbers");
        line.push('\n');
        (&mut &*stream).write_all(line.as_bytes())?;
        let mut reply = String::new();
        lines.by_ref().take(LINE).read_line(&mut reply)?;
        if !reply.ends_with('\n') {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let Answered { ticket, answer } = serde_json::from_str(&reply)?;
        if let Some(answer) = answer {
            shared.act(|claim, now| claim.answer(ticket, answer, now));
        }
    }
}
