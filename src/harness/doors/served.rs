//! A hall of which nothing but the HTTP API is there, on a port of the loopback.

use std::cell::LazyCell;
use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use std::{env, fs, process};

use sha2::{Digest as _, Sha256};

use crate::api::{self, Running, Setup};
use crate::config::{self, ApiToken, Role};
use crate::control::{Desired, Handle, Inbox, Status, handle};
use crate::library::{self, Bounds, Library};
use crate::log::Log;
use crate::playlist::Shelf;
use crate::rt::Desk;

/// One token for each role, which true requests show.
const TOKENS: [(&str, Role); 3] =
    [("guest-token", Role::View), ("tablet-token", Role::Operate), ("booth-token", Role::Engineer)];
/// A reply that has not begun by then waits for more of the request.
const BEGUN: Duration = Duration::from_millis(30);
/// No reply takes longer.
const ENDED: Duration = Duration::from_secs(10);
/// The longest reply that is read.
const MAX_REPLY: u64 = 8 << 20;

/// Goes on for each hall that is opened, as each thread that goes through the door has its own.
static OPENED: AtomicU64 = AtomicU64::new(0);

thread_local! {
    static HALL: LazyCell<ServedHall> = LazyCell::new(ServedHall::open);
}

/// What is served, and what came of it.
pub(super) struct ServedHall {
    folder: PathBuf,
    running: Option<Running>,
    asked: Receiver<Desired>,
    over: Arc<AtomicBool>,
    supervisor: Option<JoinHandle<()>>,
}

impl ServedHall {
    /// The hall of this thread.
    pub(super) fn with(does: impl FnOnce(&Self)) {
        HALL.with(|hall| does(hall));
    }

    fn open() -> Self {
        let number = OPENED.fetch_add(1, Ordering::Relaxed);
        let folder = env::temp_dir().join(format!("kinocue-door-{}-{number}", process::id()));
        fs::create_dir_all(&folder).expect("there is a folder for what is temporary");
        let (handle, inbox, _source) =
            handle(Arc::new(Desk::new(std::iter::empty())), Status::starting("Hall 1"));
        let running = api::start(setup(&folder, handle.clone())).expect("the loopback has a free port");
        let (note, asked) = mpsc::channel();
        let over = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&over);
        let supervise = move || supervise(&inbox, &handle, &is_over, |desired| drop(note.send(desired)));
        let supervisor = thread::spawn(supervise);
        Self { folder, running: Some(running), asked, over, supervisor: Some(supervisor) }
    }

    /// Sends octets as one connection, reads what comes back, and holds what was asked against who may ask it.
    pub(super) fn send(&self, octets: &[u8]) {
        let address = self.running.as_ref().expect("it is open").addresses()[0];
        let mut stream = TcpStream::connect(address).expect("it listens");
        stream.set_read_timeout(Some(BEGUN)).expect("it is a socket");
        let _ = stream.write_all(octets); // it may have heard enough before the end
        let mut reply = vec![0; 16];
        let begun = stream.read(&mut reply).unwrap_or_default();
        reply.truncate(begun);
        let _ = stream.shutdown(Shutdown::Write);
        stream.set_read_timeout(Some(ENDED)).expect("it is a socket");
        if let Err(error) = stream.take(MAX_REPLY).read_to_end(&mut reply) {
            assert!(error.kind() != std::io::ErrorKind::WouldBlock, "no end within {ENDED:?}");
        }
        // What a handler that panicked leaves; what was sent may be quoted, but never begins a detail.
        assert!(!contains(&reply, b"\"detail\":\"an internal fault"), "{}", String::from_utf8_lossy(&reply));
        for Desired { ask, who } in self.asked.try_iter() {
            let is_known = TOKENS.iter().any(|(token, role)| *role == who.role && *token == who.name);
            assert!(is_known && contains(octets, who.name.as_bytes()), "{who} got {ask:?} done");
            assert!(who.role >= ask.least_role(), "{who} got {ask:?} done");
        }
    }
}

fn contains(octets: &[u8], part: &[u8]) -> bool {
    octets.windows(part.len()).any(|window| window == part)
}

impl Drop for ServedHall {
    fn drop(&mut self) {
        drop(self.running.take());
        self.over.store(true, Ordering::Relaxed);
        if let Some(supervisor) = self.supervisor.take() {
            let _ = supervisor.join();
        }
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Answers whatever is asked with the status as it is.
fn supervise(inbox: &Inbox, handle: &Handle, over: &AtomicBool, mut note: impl FnMut(Desired)) {
    while !over.load(Ordering::Relaxed) {
        let Some(asked) = inbox.next(Duration::from_millis(5)) else { continue };
        note(asked.desired.clone());
        asked.answer(Ok(handle.status()));
    }
}

fn setup(folder: &std::path::Path, handle: Handle) -> Setup {
    let tokens = TOKENS.map(|(token, role)| ApiToken {
        name: token.to_owned(),
        role,
        sha256: Sha256::digest(token).into(),
    });
    let listen = vec!["127.0.0.1:0".parse().expect("an address")];
    // Nothing checks what is uploaded: that would be a process for each.
    let hall =
        library::Hall { config: folder.join("hall.toml"), program: folder.join("none"), bounds: bounds() };
    Setup {
        // By a name: nobody who searches knows its port.
        config: config::Api {
            listen,
            hosts: vec!["hall".to_owned()],
            tokens: tokens.into(),
            ..config::Api::default()
        },
        socket: folder.join("control.sock"),
        handle,
        library: Library::open(&folder.join("cues"), hall).expect("the folder is ours"),
        playlists: Shelf::new(&folder.join("playlists")),
        journal: folder.join("journal"),
        recordings: folder.join("recordings"),
        pages: |path| (path == "/").then_some(("text/html", b"<!doctype html>")),
        log: Log::start(|_| {}).expect("there is a thread"),
    }
}

fn bounds() -> Bounds {
    Bounds { max_bytes: 100_000, ..Bounds::default() }
}
