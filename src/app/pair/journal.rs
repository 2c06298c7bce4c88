//! The journal of this machine for the link to the engine, whether this machine leads or stands by: what it played until it died is told
//! once it is back. The link comes to a socket of its own, is told by one line which machine this is, and then asks by a line each what
//! stands behind what the engine has.

use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::Serialize;

use super::{PairError, links};
use crate::control::Problem;
use crate::journal::{TOLD_AT_ONCE, tail};

/// How long a link may say nothing: it asks each second.
const PATIENCE: Duration = Duration::from_secs(10);
/// The longest line of a link.
const LINE: u64 = 4_096;

/// Serves the socket at `path`.
pub(super) fn start(machine: String, dir: PathBuf, path: &Path) -> Result<(), PairError> {
    links::serve("pair-journal", path, PATIENCE, move |stream| tell(&machine, &dir, stream))
}

fn tell(machine: &str, dir: &Path, stream: &UnixStream) -> io::Result<()> {
    write(stream, &machine)?;
    let mut lines = BufReader::new(stream);
    loop {
        let mut line = String::new();
        lines.by_ref().take(LINE).read_line(&mut line)?;
        let told = serde_json::from_str(&line)?;
        let parts = tail(dir, &told, TOLD_AT_ONCE);
        write(stream, &parts.map_err(|error| Problem::from(error).to_string()))?;
    }
}

fn write(mut stream: &UnixStream, what: &impl Serialize) -> io::Result<()> {
    let mut line = serde_json::to_vec(what)?;
    line.push(b'\n');
    stream.write_all(&line)
}
