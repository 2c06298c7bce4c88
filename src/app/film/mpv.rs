//! mpv, over its socket: asked where its film is, for as long as there is one. It may start later, and again.

use std::io::{self, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use super::left::{LOOK, brings};
use super::told::AGAIN;
use super::{FilmError, WantedFile, WordSink, start};
use crate::film::mpv::MpvClient;
use crate::film::observation::{FilmWord, Observation};
use crate::film::source::FilmArgs;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, ShowTime};

/// Begins to ask the player at that socket; the cue begins where its film is at the begin of those arguments.
pub(super) fn start_reading(socket: &Path, args: &FilmArgs, told: WordSink) -> Result<(), FilmError> {
    let wanted = WantedFile::socket("give the path that mpv has as --input-ipc-server");
    let socket = wanted.check_if_there(socket)?;
    let player = MpvPlayer { socket, begin: args.begin(), args: args.clone(), told };
    Ok(start("mpv", move || while player.talk() {})?)
}

struct MpvPlayer {
    socket: PathBuf,
    begin: ShowTime,
    args: FilmArgs,
    told: WordSink,
}

impl MpvPlayer {
    /// One connection, from its begin to its end; false once nobody listens.
    fn talk(&self) -> bool {
        let now = Monotonic.now();
        let mut client = MpvClient::new(now);
        let ended = UnixStream::connect(&self.socket).and_then(|stream| self.converse(stream, &mut client));
        self.told.note(|notes| notes.trouble = ended.err().and_then(|error| self.trouble(&error)));
        let mut is_heard = true;
        client.hear_end(Monotonic.now(), &mut |what| is_heard &= self.tell(what));
        is_heard && self.told.waits()
    }

    /// What is wrong, for a person; nothing of the hall's own player, which says itself why it is not there.
    fn trouble(&self, error: &io::Error) -> Option<String> {
        match error.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::ConnectionRefused => {
                let socket = self.socket.display();
                let is_own = self.told.gate.is_some();
                (!is_own).then(|| format!("no player is there; start mpv with --input-ipc-server={socket}"))
            }
            _ => Some(error.to_string()),
        }
    }

    fn converse(&self, mut stream: UnixStream, client: &mut MpvClient) -> io::Result<()> {
        stream.set_write_timeout(Some(AGAIN))?;
        stream.write_all(MpvClient::greeting().as_bytes())?;
        let (mut octets, mut counted) = ([0; 4_096], false);
        // One that talks without a pause is left as well.
        while !self.told.is_over() {
            let now = Monotonic.now();
            if let Some(question) = client.poll(now) {
                stream.write_all(question.as_bytes())?;
            }
            // The next question is not late: after a seek seats wait for four answers.
            if !brings(&stream, client.next_at().since(now).min(LOOK)) {
                continue;
            }
            match stream.read(&mut octets) {
                Ok(0) => return Ok(()),
                Ok(count) => {
                    // Line by line, so that what is told is of the film that was said to be open before.
                    for line in octets[..count].split_inclusive(|octet| *octet == b'\n') {
                        let counts = self.counts(client);
                        if !std::mem::replace(&mut counted, counts) && counts {
                            client.say_again(Monotonic.now(), &mut |what| {
                                self.tell(what);
                            });
                        }
                        client.hear(line, Monotonic.now(), &mut |what| {
                            self.tell(if counts { what } else { Observation::new(what.at, FilmWord::Gone) });
                        });
                    }
                    self.note(client);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// True if the film that is open is one to be heard of.
    fn counts(&self, client: &MpvClient) -> bool {
        let lets = self.told.gate.as_ref().is_none_or(|gate| gate.lets(client.path()));
        lets && self.args.counts(client.path())
    }

    fn note(&self, client: &MpvClient) {
        self.told.note(|notes| {
            if notes.film.as_deref() != client.path() {
                notes.film = client.path().map(str::to_owned);
            }
            notes.fps = self.args.rate.or_else(|| client.rate()).map(|rate| rate.to_string());
            notes.avsync_ms = client.avsync_s().map(|seconds| seconds * 1e3);
            notes.garbage = client.garbage();
            let other = client.path().filter(|open| !self.args.counts(Some(open)));
            notes.refused = other.map(|open| {
                format!("{open} is not one of its films, so no seat follows it; if seats should, add it to films of [sync.mpv]")
            });
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
