//! What the player is told and asked over its socket: a line of JSON each way, and the one who asks waits for a moment.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use serde_json::{Value, json};

use super::PlayerShared;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// It answers within a millisecond, but while a window or a sound card is opened.
const ANSWER: Duration = Duration::from_secs(2);
/// What a command waits for where mpv takes none.
const WRITE_FOR: Duration = Duration::from_millis(500);
/// It has begun, and a film is open, within that, from a slow disk too.
const OPEN: Duration = Duration::from_secs(10);
/// How long one read waits.
const READ_FOR: Duration = Duration::from_millis(50);
/// The longest line that is taken: mpv's are shorter than a kilobyte, but for lists that nobody asks for.
const LONGEST_LINE: usize = 65_536;

/// A connection to the player.
#[derive(Debug)]
pub(super) struct MpvTalk {
    stream: UnixStream,
    heard: Vec<u8>,
    asked: u64,
    shared: PlayerShared,
}

impl MpvTalk {
    pub(super) fn new(stream: UnixStream, shared: PlayerShared) -> io::Result<Self> {
        stream.set_read_timeout(Some(READ_FOR))?;
        stream.set_write_timeout(Some(WRITE_FOR))?;
        Ok(Self { stream, heard: Vec::new(), asked: 0, shared })
    }

    /// Has a command done; gives what it says. One that mpv does not do gives null.
    ///
    /// # Errors
    /// [`ErrorKind::TimedOut`] where it does not answer; else it has gone.
    pub(super) fn ask(&mut self, command: &Value) -> io::Result<Value> {
        self.ask_for(command, ANSWER)
    }

    /// What it is, once it has begun.
    pub(super) fn version(&mut self) -> io::Result<Value> {
        self.ask_for(&json!(["get_property", "mpv-version"]), OPEN)
    }

    fn ask_for(&mut self, command: &Value, patience: Duration) -> io::Result<Value> {
        self.asked += 1;
        let line = json!({ "command": command, "request_id": self.asked }).to_string() + "\n";
        self.stream.write_all(line.as_bytes()).map_err(as_mute)?;
        let (asked, until) = (self.asked, Monotonic.now() + patience);
        let answer = self.hear(until, |said| said["request_id"] == asked && said.get("event").is_none())?;
        Ok(if answer["error"] == "success" { answer["data"].clone() } else { Value::Null })
    }

    /// What a property is; null where it is not known now.
    pub(super) fn get(&mut self, name: &str) -> io::Result<Value> {
        self.ask(&json!(["get_property", name]))
    }

    /// Opens a film; why not, where it cannot be shown.
    pub(super) fn open(&mut self, film: &str) -> io::Result<Result<(), String>> {
        let entry = self.ask(&json!(["loadfile", film, "replace"]))?["playlist_entry_id"].clone();
        let ends = |said: &Value| match said["event"].as_str() {
            Some("file-loaded") => true,
            // The film before ends as well, which says nothing of this one.
            Some("end-file") => said["playlist_entry_id"] == entry,
            _ => false,
        };
        let said = self.hear(Monotonic.now() + OPEN, ends)?;
        let why = || said["file_error"].as_str().unwrap_or("it cannot be opened").to_owned();
        Ok(if said["event"] == "file-loaded" { Ok(()) } else { Err(why()) })
    }

    /// Waits for a line of that kind.
    fn hear(&mut self, until: MonoTime, is_it: impl Fn(&Value) -> bool) -> io::Result<Value> {
        let mut octets = [0; 4_096];
        loop {
            while let Some(end) = self.heard.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.heard.drain(..=end).collect();
                // What is none of its protocol is nothing that is waited for.
                let said = serde_json::from_slice::<Value>(&line).unwrap_or_default();
                if is_it(&said) {
                    return Ok(said);
                }
            }
            if Monotonic.now() >= until || self.shared.is_over() {
                return Err(ErrorKind::TimedOut.into());
            }
            if self.heard.len() > LONGEST_LINE {
                return Err(ErrorKind::InvalidData.into());
            }
            match self.stream.read(&mut octets) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => self.heard.extend_from_slice(&octets[..count]),
                Err(error) if as_mute_kind(error.kind()) => {}
                Err(error) => return Err(error),
            }
        }
    }
}

const fn as_mute_kind(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

fn as_mute(error: io::Error) -> io::Error {
    if as_mute_kind(error.kind()) { ErrorKind::TimedOut.into() } else { error }
}
