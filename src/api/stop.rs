//! The stop socket: `stop` is a stop, whatever else is stuck. Its own thread, no runtime, no locks but the flag that
//! the tick thread reads; no peer can hold it up, because it never waits for one.

use std::collections::VecDeque;
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::sockopt::socket_peercred;

use super::ApiError;
use super::peer::{self, Users};
use super::socket::{self, SocketFile};
use crate::control::{Handle, Who};
use crate::sys::clock::Monotonic;
use crate::sys::file::want_of_files;
use crate::time::{Clock as _, MonoTime};

/// Connections at a time; of more the oldest goes, so that idle ones keep nobody out.
const PEERS: usize = 32;
/// How long a connection may say nothing.
const SILENCE: Duration = Duration::from_secs(5);
/// The longest line that is looked at.
const LINE: usize = 64;
/// How long nothing is accepted after the system refused a connection.
const PAUSE: Duration = Duration::from_millis(50);

/// The stop socket, served until this is dropped.
#[derive(Debug)]
pub struct StopSocket {
    /// Dropped, it wakes the thread, which then ends.
    wake: Option<UnixStream>,
    thread: Option<JoinHandle<()>>,
}

/// Serves the stop socket at `path`. A connection that sends the line `stop` has the seats come to rest, and is told
/// `stopping`; any other line is told what is wanted. The folder has to be there.
///
/// # Errors
/// [`ApiError`] where the socket cannot be made, or another program serves it.
pub fn stop_socket(path: &Path, handle: Handle) -> Result<StopSocket, ApiError> {
    serve_stop(path, handle, peer::local)
}

/// The same for whoever carries the stops of a fleet, so that they need not be let in where whoever is let in leads the show.
///
/// # Errors
/// As [`stop_socket`].
pub(crate) fn fleet_stop_socket(path: &Path, handle: Handle) -> Result<StopSocket, ApiError> {
    serve_stop(path, handle, peer::link)
}

fn serve_stop(path: &Path, handle: Handle, who: fn(&str) -> Who) -> Result<StopSocket, ApiError> {
    let (desk, wake) = StopDesk::new(path, handle, who)?;
    let thread = Builder::new().name("stop".to_owned()).spawn(move || desk.run());
    Ok(StopSocket { wake: Some(wake), thread: Some(thread.map_err(ApiError::System)?) })
}

impl Drop for StopSocket {
    fn drop(&mut self) {
        drop(self.wake.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // it ends as soon as it wakes up
        }
    }
}

/// What the thread holds.
struct StopDesk {
    listener: UnixListener,
    _file: SocketFile,
    sleeper: UnixStream,
    /// A descriptor that is kept for a caller who finds none left.
    spare: Option<UnixStream>,
    handle: Handle,
    /// Who somebody is that comes by it, by the name of their user.
    who: fn(&str) -> Who,
    users: Users,
    peers: VecDeque<Caller>,
    pause_until: Option<MonoTime>,
}

/// A connection.
struct Caller {
    stream: UnixStream,
    line: Vec<u8>,
    until: MonoTime,
}

impl StopDesk {
    /// One that ends once what is given beside it is dropped.
    fn new(path: &Path, handle: Handle, who: fn(&str) -> Who) -> Result<(Self, UnixStream), ApiError> {
        let (listener, file) = socket::unix(path)?;
        let (wake, sleeper) = UnixStream::pair().map_err(ApiError::System)?;
        let (spare, peers) = (sleeper.try_clone().ok(), VecDeque::new());
        let desk = Self {
            listener,
            _file: file,
            sleeper,
            spare,
            handle,
            who,
            users: Users::read(),
            peers,
            pause_until: None,
        };
        Ok((desk, wake))
    }

    fn run(mut self) {
        loop {
            let woken = self.wait();
            let now = Monotonic.now();
            if woken.is_some_and(|closed| closed) {
                return;
            }
            self.pause_until = self.pause_until.filter(|&until| until > now);
            self.hear(now);
            self.accept(now);
            if self.spare.is_none() {
                self.spare = self.sleeper.try_clone().ok();
            }
        }
    }

    /// Waits until there is something to do; says whether that is to end, `None` if the system would not wait.
    fn wait(&self) -> Option<bool> {
        let now = Monotonic.now();
        let ends = self.peers.iter().map(|caller| caller.until).chain(self.pause_until).min();
        let timeout = ends.map(|end| timespec(end.since(now)));
        let mut ready = vec![PollFd::new(&self.sleeper, PollFlags::IN)];
        if self.pause_until.is_none() {
            ready.push(PollFd::new(&self.listener, PollFlags::IN));
        }
        ready.extend(
            self.peers.iter().map(|caller| PollFd::from_borrowed_fd(caller.stream.as_fd(), PollFlags::IN)),
        );
        if poll(&mut ready, timeout.as_ref()).is_err() {
            return None; // interrupted by a signal
        }
        Some(!ready[0].revents().is_empty())
    }

    /// Reads what the connections said, without waiting for any; before one goes that said nothing for long: this thread may have stood still.
    fn hear(&mut self, now: MonoTime) {
        let Self { handle, who, users, peers, .. } = self;
        peers.retain_mut(|caller| caller.listen(handle, |uid| who(&users.name(uid))) && caller.until > now);
    }

    fn accept(&mut self, now: MonoTime) {
        while self.pause_until.is_none() {
            match self.listener.accept() {
                Ok((stream, _)) if stream.set_nonblocking(true).is_ok() => {
                    let mut caller = Caller { stream, line: Vec::new(), until: now + SILENCE };
                    if caller.listen(&self.handle, |uid| (self.who)(&self.users.name(uid))) {
                        self.peers.push_back(caller);
                        if self.peers.len() > PEERS {
                            self.parts_with_oldest();
                        }
                    }
                }
                Ok(_) => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                // Also where nobody calls: whoever was let in last is not to go for nobody.
                Err(error) if want_of_files(&error).is_some() && !self.is_called() => return,
                Err(error) if want_of_files(&error).is_some() && self.makes_room() => {}
                // Out of descriptors or memory: a moment later there may be some.
                Err(_) => self.pause_until = Some(now + PAUSE),
            }
        }
    }

    /// Whether somebody waits to be let in.
    fn is_called(&self) -> bool {
        let mut listener = [PollFd::new(&self.listener, PollFlags::IN)];
        poll(&mut listener, Some(&Timespec::default())).is_ok() && !listener[0].revents().is_empty()
    }

    /// Gives up a descriptor for whoever calls: the spare one, or that of the oldest caller.
    fn makes_room(&mut self) -> bool {
        self.spare.take().is_some() || self.parts_with_oldest()
    }

    /// Has the oldest caller go, once what they said meanwhile was read; whether there was one.
    fn parts_with_oldest(&mut self) -> bool {
        let Some(mut oldest) = self.peers.pop_front() else { return false };
        oldest.listen(&self.handle, |uid| (self.who)(&self.users.name(uid)));
        true
    }
}

impl Caller {
    /// Takes in what is there; whether more is to come.
    fn listen(&mut self, handle: &Handle, who: impl Fn(u32) -> Who) -> bool {
        let mut bytes = [0; LINE];
        loop {
            match self.stream.read(&mut bytes) {
                Ok(0) => break,
                Ok(read) => self.line.extend_from_slice(&bytes[..read]),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return true,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(_) => return false,
            }
            // A stop waits for no end of its line.
            if self.is_stop() || self.line.contains(&b'\n') || self.line.len() >= LINE {
                break;
            }
        }
        let reply = if self.is_stop() {
            handle.stop(); // before all else
            handle.note_stop(who(self.uid()));
            "stopping\n"
        } else {
            "send the line: stop\n"
        };
        let _ = self.stream.write_all(reply.as_bytes()); // fits into an empty socket; who has gone needs none
        false
    }

    fn is_stop(&self) -> bool {
        let line = self.line.split(|&byte| byte == b'\n').next().unwrap_or_default();
        line.trim_ascii().eq_ignore_ascii_case(b"stop")
    }

    /// Whoever calls; one whom the kernel does not name is nobody's number.
    fn uid(&self) -> u32 {
        socket_peercred(&self.stream).map_or(u32::MAX, |peer| peer.uid.as_raw())
    }
}

fn timespec(span: Duration) -> Timespec {
    Timespec::try_from(span).expect("a few seconds fit")
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead as _, BufReader};
    use std::sync::Arc;

    use super::*;
    use crate::control::{Command, Inbox, Role, Status, handle};
    use crate::rt::Desk;

    struct Hall {
        _dir: tempfile::TempDir,
        path: std::path::PathBuf,
        desk: Arc<Desk>,
        inbox: Inbox,
        _socket: StopSocket,
    }

    fn hall() -> Hall {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("stop.sock");
        let desk = Arc::new(Desk::new(std::iter::empty()));
        let (handle, inbox, _) = handle(Arc::clone(&desk), Status::starting("Hall 1"));
        let socket = stop_socket(&path, handle).unwrap();
        Hall { _dir: dir, path, desk, inbox, _socket: socket }
    }

    fn say(path: &Path, text: &str) -> String {
        let mut stream = UnixStream::connect(path).unwrap();
        stream.write_all(text.as_bytes()).unwrap();
        stream.shutdown(std::net::Shutdown::Write).unwrap();
        let mut reply = String::new();
        BufReader::new(stream).read_line(&mut reply).unwrap();
        reply
    }

    #[test]
    fn the_line_stop_stops_and_is_noted_with_its_user() {
        let hall = hall();
        assert_eq!(say(&hall.path, "stop\n"), "stopping\n");
        assert!(hall.desk.take_stop());
        let noted = hall.inbox.next(Duration::ZERO).unwrap().desired;
        assert_eq!((noted.ask, noted.who.role), (Command::Stop, Role::Engineer));
        assert_eq!(noted.who.name, Users::read().name(rustix::process::getuid().as_raw()));
        assert_eq!(say(&hall.path, " STOP\r\n"), "stopping\n");
        assert_eq!(say(&hall.path, "stop"), "stopping\n", "a line without its end");
    }

    #[test]
    fn nothing_else_is_a_stop() {
        let hall = hall();
        for text in
            ["", "\n", "go\n", "stop now\n", "stopstop\n", "GET / HTTP/1.1\r\n\r\n", &"stop".repeat(100)]
        {
            assert_eq!(say(&hall.path, text), "send the line: stop\n", "{text:?}");
        }
        assert!(!hall.desk.take_stop());
    }

    #[test]
    fn a_stop_passes_connections_that_say_nothing() {
        let hall = hall();
        let mut idle: Vec<_> = (0..4 * PEERS).map(|_| UnixStream::connect(&hall.path).unwrap()).collect();
        idle[4 * PEERS - 1].write_all(b"sto").unwrap();
        assert_eq!(say(&hall.path, "stop\n"), "stopping\n");
        assert!(hall.desk.take_stop());
        idle[4 * PEERS - 1].write_all(b"p\n").unwrap();
        let mut reply = [0; 9];
        idle[4 * PEERS - 1].read_exact(&mut reply).unwrap();
        assert_eq!(&reply, b"stopping\n", "the newest of the idle ones was kept, and half a line too");
    }

    #[test]
    fn a_stop_waits_for_no_end_of_its_line() {
        let hall = hall();
        let mut stream = UnixStream::connect(&hall.path).unwrap();
        stream.write_all(b"stop").unwrap();
        let mut reply = String::new();
        BufReader::new(&stream).read_line(&mut reply).unwrap();
        assert_eq!(reply, "stopping\n");
        assert!(hall.desk.take_stop());
    }

    #[test]
    fn a_stop_that_came_while_nobody_looked_is_heard_before_its_caller_goes() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("stop.sock");
        let desk = Arc::new(Desk::new(std::iter::empty()));
        let (handle, _inbox, _) = handle(Arc::clone(&desk), Status::starting("Hall 1"));
        let (mut stops, _wake) = StopDesk::new(&path, handle, peer::local).unwrap();
        let now = Monotonic.now();
        let call = |stops: &mut StopDesk| {
            let stream = UnixStream::connect(&path).unwrap();
            stops.accept(now);
            stream
        };
        let mut early = call(&mut stops);
        early.write_all(b"stop\n").unwrap();
        stops.hear(now + SILENCE);
        assert!(desk.take_stop(), "the thread stood still for as long as a caller may say nothing");

        let mut oldest = call(&mut stops);
        oldest.write_all(b"stop\n").unwrap();
        let _others: Vec<_> = (0..PEERS).map(|_| call(&mut stops)).collect();
        assert!(desk.take_stop(), "and it has to make room for others");
        assert_eq!(stops.peers.len(), PEERS);
    }

    #[test]
    fn the_socket_goes_with_its_owner() {
        let Hall { path, _socket: socket, .. } = hall();
        drop(socket);
        assert!(UnixStream::connect(path).is_err());
    }
}
