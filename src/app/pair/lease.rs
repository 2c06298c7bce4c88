//! The lease by the link to the engine. The link comes to a socket of its own, is told one line at a time what to ask the engine, and
//! answers by one. A promise counts from before that line was written, on this machine's clock: whatever link, network and engine take
//! shortens it.

use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::Arc;

use super::{PairError, PairShared, links};
use crate::pair::{Answered, PROMISED};
use crate::sys::clock::Monotonic;
use crate::sys::lock::lock;
use crate::time::Clock as _;

/// The longest line of a link.
const LINE: u64 = 1_024;

/// Serves the socket at `path`.
pub(super) fn start(shared: &Arc<PairShared>, path: &Path) -> Result<(), PairError> {
    let shared = Arc::clone(shared);
    links::serve("pair-lease", path, PROMISED, move |stream| ask(&shared, stream))
}

fn ask(shared: &PairShared, stream: &UnixStream) -> io::Result<()> {
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
