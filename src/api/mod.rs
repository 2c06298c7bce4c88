//! The HTTP API: requests in, commands to the hall out, and back as JSON. One thread of its own with a runtime; nothing of it
//! reaches the tick thread but through [`Handle`]. The stop socket has a thread without a runtime besides.
//!
//! - **Who**: whoever may open the control socket is engineer, named as the kernel names them. Over TCP, which is off unless
//!   the configuration says otherwise, a token says who asks; names of hosts and origins of pages are exact.
//! - **What**: each change is a POST or PUT, and replies with the state that it led to. GET changes nothing.
//! - **When**: what came twice is done once, and what would move a seat is refused when it comes late.
//! - **How much**: connections, heads, bodies, waits and what is remembered are bounded; the rest is refused or cut off, before
//!   others whoever has shown nothing. A stop waits for none of it.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread::Builder;
use std::time::Duration;

use tokio::runtime::{self, Runtime};
use tokio::sync::{mpsc, watch};

use crate::config;
use crate::control::Handle;
use crate::library::Library;
use crate::log::Log;
use crate::playlist::Shelf;

mod access;
mod asker;
mod controllers;
mod cues;
mod gate;
mod guarded;
mod history;
mod input;
mod once;
mod peer;
mod pieces;
mod playlist;
mod problem;
mod recordings;
mod reports;
mod rest;
mod routes;
mod serve;
mod service;
mod serving;
mod settings;
mod shared;
mod show;
mod socket;
mod status;
mod stop;
mod streams;
mod tries;

pub(crate) use serving::ServingThread;
pub use stop::{StopSocket, stop_socket};

use access::{Access, AccessTokens};
use shared::{Pulse, Shared};
use socket::SocketFile;
use streams::Streams;

/// What its threads are called. A panic on one of them ends the request that it was for, and nothing else.
pub(crate) const THREAD: &str = "api";
/// Threads that wait for disks.
const BLOCKING: usize = 8;
/// How long what is under way may go on when the server ends.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// The console: the content type and the bytes of what is at a path, `/` for its page; `None` if there is nothing.
pub(crate) type Pages = fn(path: &str) -> Option<(&'static str, &'static [u8])>;

/// What the API serves, and where.
#[derive(Debug)]
pub struct Setup {
    /// What the configuration says of it.
    pub config: config::Api,
    /// The control socket; its folder has to be there.
    pub socket: PathBuf,
    /// The way to the hall.
    pub handle: Handle,
    /// The cues.
    pub library: Library,
    /// The playlists.
    pub playlists: Shelf,
    /// The folder of the journal.
    pub journal: PathBuf,
    /// The folder of recordings.
    pub recordings: PathBuf,
    /// The console.
    pub pages: Pages,
    /// Where it is said who was turned away.
    pub log: Log,
}

/// Why the API is not served.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ApiError {
    /// The folder of a socket cannot be opened.
    #[error("cannot open {}, the folder of the socket; create it, or give another socket", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A socket cannot be made.
    #[error("cannot listen on {}", path.display())]
    Socket {
        /// Which.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Something else is where the socket belongs.
    #[error("{} exists and is not a socket; move it away, or give another socket", path.display())]
    NoSocket {
        /// What is there.
        path: PathBuf,
    },
    /// A program serves that socket.
    #[error("{} is served by a running program; end it, or give another socket", path.display())]
    Served {
        /// The socket.
        path: PathBuf,
    },
    /// A TCP port cannot be had.
    #[error("cannot listen on {address}; does another program use it?")]
    Port {
        /// Which.
        address: SocketAddr,
        /// What the system said.
        source: io::Error,
    },
    /// The system gives no thread or no timer.
    #[error("the system refused a thread or a socket of the API")]
    System(#[source] io::Error),
}

/// The API, served until this is dropped: no more connections are taken then, and those that are there end what they are at, within a
/// few seconds.
#[derive(Debug)]
pub struct Running {
    addresses: Vec<SocketAddr>,
    tokens: AccessTokens,
    streams: Streams,
    _thread: ServingThread,
}

impl Running {
    /// Where it listens over TCP, with the ports that the system chose.
    #[must_use]
    pub fn addresses(&self) -> &[SocketAddr] {
        &self.addresses
    }

    /// Has these tokens from now on. Where they are others, whoever is pushed to over TCP has to come again, and show one.
    pub(crate) fn set_tokens(&self, tokens: &[config::ApiToken]) {
        if self.tokens.set(tokens) {
            self.streams.part_with_tcp();
        }
    }
}

/// Serves the API on a thread of its own. When this returns, all sockets take connections.
///
/// # Errors
/// [`ApiError`] where a socket or a port cannot be had; nothing is served then.
pub fn start(setup: Setup) -> Result<Running, ApiError> {
    let Setup { config, socket, handle, library, playlists, journal, recordings, pages, log } = setup;
    let (local, file) = socket::unix(&socket)?;
    let (tcp, addresses) = ports(&config.listen)?;
    let (closing, closed) = watch::channel(false);
    let (router, document) = routes::routes();
    let (access, streams) = (Access::new(&config, &addresses), Streams::default());
    let tokens = access.tokens();
    let shared = Shared {
        handle,
        access,
        tries: Default::default(),
        once: Default::default(),
        streams: streams.clone(),
        errands: shared::errands(),
        reports: shared::one_at_a_time(),
        curves: shared::one_at_a_time(),
        pictures: shared::one_at_a_time(),
        closing: closed.clone(),
        document: document.to_json().expect("a description is text").into(),
        library,
        shelf: playlists,
        journal,
        recordings,
        pages,
        log: log.clone(),
        pulse: Pulse::default(),
        written: Mutex::new(None),
    };
    let shared = Arc::new(shared);
    let router = routes::guarded(router, Arc::clone(&shared));
    let runtime = runtime::Builder::new_current_thread()
        .enable_all()
        .thread_name(THREAD)
        .max_blocking_threads(BLOCKING)
        .build()
        .map_err(ApiError::System)?;
    let sockets = ApiSockets { local, _file: file, tcp, log };
    let thread = Builder::new().name(THREAD.to_owned()).spawn(move || run(runtime, sockets, shared, router));
    let thread = ServingThread::new(closing, thread.map_err(ApiError::System)?);
    Ok(Running { addresses, tokens, streams, _thread: thread })
}

/// What is listened on.
struct ApiSockets {
    local: std::os::unix::net::UnixListener,
    /// Goes when the server ends.
    _file: SocketFile,
    tcp: Vec<TcpListener>,
    log: Log,
}

/// Serves until the server ends.
fn run(runtime: Runtime, sockets: ApiSockets, shared: Arc<Shared>, router: axum::Router) {
    let ApiSockets { local, _file, tcp, log } = sockets;
    let mut closing = shared.closing.clone();
    let (alive, mut all_gone) = mpsc::channel(1);
    let hall = serve::ServedHall { router, closing: closing.clone(), alive, log };
    runtime.block_on(async move {
        tokio::spawn(Pulse::follow(shared));
        let places = serve::tcp_places();
        for listener in tcp {
            let listener = tokio::net::TcpListener::from_std(listener);
            let listener = listener.expect("the runtime has just been made, and takes sockets");
            tokio::spawn(serve::tcp(listener, places.clone(), hall.clone()));
        }
        let local = tokio::net::UnixListener::from_std(local);
        tokio::spawn(serve::local(local.expect("the runtime takes sockets"), hall));
        let _ = closing.wait_for(|&closing| closing).await; // whoever would say so has gone: an end as well
        let _ = tokio::time::timeout(LAST_WORDS, all_gone.recv()).await;
    });
    runtime.shutdown_timeout(LAST_WORDS);
}

/// Listens on all of them, and says where that is, with the ports that the system chose.
fn ports(addresses: &[SocketAddr]) -> Result<(Vec<TcpListener>, Vec<SocketAddr>), ApiError> {
    let listeners = addresses.iter().map(|&address| port(address)).collect::<Result<Vec<_>, _>>()?;
    let bound = listeners.iter().map(TcpListener::local_addr).collect::<Result<_, _>>();
    Ok((listeners, bound.map_err(ApiError::System)?))
}

fn port(address: SocketAddr) -> Result<TcpListener, ApiError> {
    let failed = |source| ApiError::Port { address, source };
    let listener = TcpListener::bind(address).map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    Ok(listener)
}
