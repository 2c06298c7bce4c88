//! mpv, over its socket: asked where its film is, for as long as there is one. It may start later, and again.

use std::io::{self, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::told::AGAIN;
use super::{WordSink, start};
use crate::film::mpv::MpvClient;
use crate::film::observation::{FilmWord, Observation};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, ShowTime};

/// An answer is read for so long before it is looked whether something is to be asked.
const READ_FOR: Duration = Duration::from_millis(10);

/// Begins to ask the player at that socket; the cue begins where its film is at `begin`.
pub(super) fn start_reading(socket: &Path, begin: ShowTime, told: WordSink) -> io::Result<()> {
    let player = MpvPlayer { socket: socket.to_path_buf(), begin, told };
    start("mpv", move || while player.talk() {})
}

struct MpvPlayer {
    socket: PathBuf,
    begin: ShowTime,
    told: WordSink,
}

impl MpvPlayer {
    /// One connection, from its begin to its end; false once nobody listens.
    fn talk(&self) -> bool {
        let now = Monotonic.now();
        let mut client = MpvClient::new(now);
        let ended = UnixStream::connect(&self.socket).and_then(|stream| self.converse(stream, &mut client));
        self.told.note(|notes| notes.trouble = ended.err().map(|error| error.to_string()));
        let mut is_heard = true;
        client.hear_end(Monotonic.now(), &mut |what| is_heard &= self.tell(what));
        Monotonic.sleep_until(Monotonic.now() + AGAIN);
        is_heard
    }

    fn converse(&self, mut stream: UnixStream, client: &mut MpvClient) -> io::Result<()> {
        stream.set_read_timeout(Some(READ_FOR))?;
        stream.set_write_timeout(Some(AGAIN))?;
        stream.write_all(MpvClient::greeting().as_bytes())?;
        let mut octets = [0; 4_096];
        loop {
            if let Some(question) = client.poll(Monotonic.now()) {
                stream.write_all(question.as_bytes())?;
            }
            match stream.read(&mut octets) {
                Ok(0) => return Ok(()),
                Ok(count) => {
                    client.hear(&octets[..count], Monotonic.now(), &mut |what| {
                        self.tell(what);
                    });
                    self.note(client);
                }
                Err(_) if self.told.is_over() => return Ok(()),
                Err(error) if is_nothing_yet(&error) => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn note(&self, client: &MpvClient) {
        self.told.note(|notes| {
            if notes.film.as_deref() != client.path() {
                notes.film = client.path().map(str::to_owned);
            }
            notes.avsync_ms = client.avsync_s().map(|seconds| seconds * 1e3);
            notes.garbage = client.garbage();
            notes.trouble = None;
        });
    }

    fn tell(&self, mut what: Observation) -> bool {
        if let FilmWord::Position(media) = &mut what.word {
            *media = media.since(self.begin);
        }
        self.told.tell(what)
    }
}

fn is_nothing_yet(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}
