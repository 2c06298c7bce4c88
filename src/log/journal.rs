//! Lines for the journal, with fields: one datagram each, by the native protocol of journald
//! (systemd.io, "Native Journal Protocol"). Values are one line each by then, so that the simple form is enough.

use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};

use super::Line;
use crate::plain::escaped;

const SOCKET: &str = "/run/systemd/journal/socket";
/// The longest message, bytes; a datagram has room for many times that.
const MESSAGE_LEN: usize = 4_096;
/// The longest value of a field.
const VALUE_LEN: usize = 256;

/// The way to the journal.
#[derive(Debug)]
pub(super) struct Journal {
    socket: UnixDatagram,
    path: PathBuf,
}

impl Journal {
    /// The journal, if it is where the standard error output goes (`JOURNAL_STREAM`) and it can be reached.
    pub(super) fn open() -> Option<Self> {
        let stream = std::env::var("JOURNAL_STREAM").ok()?;
        let stderr = std::fs::metadata("/proc/self/fd/2").ok()?;
        is_stream(&stream, stderr.dev(), stderr.ino()).then(|| Self::at(Path::new(SOCKET)).ok())?
    }

    fn at(path: &Path) -> io::Result<Self> {
        UnixDatagram::unbound()?.connect(path)?; // somebody is there
        let socket = UnixDatagram::unbound()?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, path: path.to_owned() })
    }

    /// Hands a line over. Not connected, so that a journal that starts anew is found again.
    pub(super) fn send(&self, line: &Line) -> io::Result<()> {
        self.socket.send_to(datagram(line).as_bytes(), &self.path).map(drop)
    }
}

/// True if `JOURNAL_STREAM` ("device:inode") names that file.
fn is_stream(stream: &str, dev: u64, ino: u64) -> bool {
    stream.split_once(':').is_some_and(|(a, b)| a.parse() == Ok(dev) && b.parse() == Ok(ino))
}

/// A line as the journal takes it: `NAME=value`, one a line.
fn datagram(line: &Line) -> String {
    let Line { priority, cause, message, fields } = line;
    let mut text = format!("PRIORITY={}\nSYSLOG_IDENTIFIER=kinocue\n", *priority as u8);
    let mut add = |name: &str, value: &str, limit| {
        text.push_str(name);
        text.push('=');
        text.push_str(&escaped(value, limit));
        text.push('\n');
    };
    add("MESSAGE", message, MESSAGE_LEN);
    add("KINOCUE_CAUSE", cause, VALUE_LEN);
    for (name, value) in fields {
        add(&field(name), value, VALUE_LEN);
    }
    text
}

/// `controller` becomes `KINOCUE_CONTROLLER`; the journal takes upper case, digits and underscores.
fn field(name: &str) -> String {
    let upper = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
    "KINOCUE_".chars().chain(name.chars().map(upper)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Priority;
    use super::*;

    #[test]
    fn a_line_has_its_fields_and_none_that_a_value_smuggles_in() {
        let line = Line::new(Priority::Warning, "controller-lost", "A1 is silent\nPRIORITY=0")
            .with("controller", "A1\0")
            .with("ack-rate", "0.5");
        assert_eq!(
            datagram(&line),
            "PRIORITY=4\nSYSLOG_IDENTIFIER=kinocue\nMESSAGE=A1 is silent\\nPRIORITY=0\n\
             KINOCUE_CAUSE=controller-lost\nKINOCUE_CONTROLLER=A1\\u{0}\nKINOCUE_ACK_RATE=0.5\n"
        );
    }

    #[test]
    fn the_journal_is_taken_only_where_stderr_goes_there() {
        assert!(is_stream("8:4711", 8, 4_711));
        for other in ["8:4712", "9:4711", "8", "", "8:4711:1", "x:y"] {
            assert!(!is_stream(other, 8, 4_711), "{other}");
        }
    }

    #[test]
    fn a_line_goes_out_as_one_datagram_and_a_full_socket_is_told_at_once() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("socket");
        let journald = UnixDatagram::bind(&path).unwrap();
        let journal = Journal::at(&path).unwrap();
        let line = Line::new(Priority::Info, "state", "parked");
        journal.send(&line).unwrap();
        let mut buf = [0; 1_024];
        let len = journald.recv(&mut buf).unwrap();
        assert_eq!(&buf[..len], datagram(&line).as_bytes());

        let full = (0..100_000).find_map(|_| journal.send(&line).err());
        assert_eq!(full.map(|error| error.kind()), Some(io::ErrorKind::WouldBlock));
    }
}
