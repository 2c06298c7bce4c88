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
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread::Builder;
use std::time::Duration;

use tokio::runtime::{self, Runtime};
use tokio::sync::{mpsc, watch};

use crate::config;
use crate::control::{AwaitedPorts, Handle};
use crate::library::Library;
use crate::log::Log;
use crate::playlist::Shelf;
use crate::sys::listen;

mod access;
mod asker;
mod controllers;
mod cues;
mod doors;
mod fleet;
mod fleet_access;
mod fleet_cues;
mod fleet_drops;
mod fleet_kept;
mod fleet_lists;
mod fleet_pull;
mod fleet_wishes;
mod gate;
mod guarded;
mod history;
mod input;
mod live;
mod once;
mod peer;
mod pieces;
mod playlist;
mod problem;
mod recordings;
mod reports;
mod rest;
mod roles;
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
mod websocket;

pub(crate) use access::Access;
pub(crate) use doors::serve_behind_doors;
#[cfg(test)]
pub(crate) use fleet::Letterbox;
#[cfg(feature = "harness")]
pub(crate) use fleet::{try_letter, try_order};
#[cfg(feature = "harness")]
pub(crate) use fleet_wishes::try_wish;
pub(crate) use gate::FLEET_STOP;
pub(crate) use service::figures_as;
pub(crate) use serving::ServingThread;
pub(crate) use socket::unix as unix_socket;
pub(crate) use stop::fleet_stop_socket;
pub use stop::{StopSocket, stop_socket};

use access::AccessTokens;
use fleet_access::FleetAccess;
use peer::{Peer, Users};
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
    #[error("{address} cannot be had for the API: {source}")]
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
    fleet: FleetAccess,
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

    /// Has the keys of that fleet from now on; a socket of its own is there only from the start on.
    pub(crate) fn set_fleet(&self, fleet: Option<&config::Fleet>) {
        self.fleet.set(fleet);
    }
}

/// Serves the API on a thread of its own. When this returns, all sockets take connections, but for TCP ports that cannot be had yet.
///
/// # Errors
/// [`ApiError`] where a socket cannot be had; nothing is served then.
pub fn start(setup: Setup) -> Result<Running, ApiError> {
    start_with(setup, None, &AwaitedPorts::default())
}

/// The same for a hall that belongs to a fleet, with the socket of whoever carries its letters. TCP ports that cannot be had yet are noted in
/// `awaited`, and served once they can.
///
/// # Errors
/// As [`start`].
pub(crate) fn start_with(
    setup: Setup,
    fleet: Option<(&config::Fleet, &Path)>,
    awaited: &AwaitedPorts,
) -> Result<Running, ApiError> {
    let (local, file) = socket::unix(&setup.socket)?;
    let of_fleet = fleet.map(|(_, socket)| socket::unix(socket)).transpose()?;
    let (tcp, addresses) = ports_so_far(&setup.config.listen, awaited);
    let (closing, closed) = watch::channel(false);
    let (router, document) = routes::routes();
    let access = Access::new(&setup.config, &addresses);
    let (tokens, log) = (access.tokens(), setup.log.clone());
    let fleet = FleetAccess::of(fleet.map(|(fleet, _)| fleet));
    let document = document.to_json().expect("a description is text").into();
    let shared = Arc::new(shared(setup, access, fleet.clone(), closed, document));
    let streams = shared.streams.clone();
    let router = routes::guarded(router, Arc::clone(&shared));
    let fleet_router = routes::guarded(routes::of_fleet(), Arc::clone(&shared));
    let runtime = runtime::Builder::new_current_thread()
        .enable_all()
        .thread_name(THREAD)
        .max_blocking_threads(BLOCKING)
        .build()
        .map_err(ApiError::System)?;
    let sockets = ApiSockets { local: (local, file), fleet: of_fleet, tcp, awaited: awaited.clone(), log };
    let thread = Builder::new()
        .name(THREAD.to_owned())
        .spawn(move || run(runtime, sockets, shared, [router, fleet_router]));
    let thread = ServingThread::new(closing, thread.map_err(ApiError::System)?);
    Ok(Running { addresses, tokens, fleet, streams, _thread: thread })
}

/// What all handlers share.
fn shared(
    setup: Setup,
    access: Access,
    fleet: FleetAccess,
    closing: watch::Receiver<bool>,
    document: hyper::body::Bytes,
) -> Shared {
    let Setup { handle, library, playlists, journal, recordings, pages, log, .. } = setup;
    Shared {
        handle,
        access,
        fleet,
        fleet_failed: Default::default(),
        fleet_settling: Default::default(),
        wishes: shared::one_at_a_time(),
        tries: Default::default(),
        once: Default::default(),
        streams: Streams::default(),
        errands: shared::errands(),
        reports: shared::one_at_a_time(),
        curves: shared::one_at_a_time(),
        pictures: shared::one_at_a_time(),
        closing,
        document,
        library,
        shelf: playlists,
        journal,
        recordings,
        pages,
        log,
        pulse: Pulse::default(),
        written: Mutex::new(None),
    }
}

/// A socket in the file system, whose file goes when the server ends.
type FileListener = (std::os::unix::net::UnixListener, SocketFile);

/// What is listened on.
struct ApiSockets {
    local: FileListener,
    fleet: Option<FileListener>,
    tcp: Vec<TcpPort>,
    awaited: AwaitedPorts,
    log: Log,
}

/// A TCP port by its address; without a socket where it cannot be had yet.
type TcpPort = (SocketAddr, Option<TcpListener>);

/// Serves until the server ends.
fn run(runtime: Runtime, sockets: ApiSockets, shared: Arc<Shared>, [router, of_fleet]: [axum::Router; 2]) {
    let ApiSockets { local: (local, _file), fleet, tcp, awaited, log } = sockets;
    let (fleet, _fleet_file) = fleet.unzip();
    let mut closing = shared.closing.clone();
    let (alive, mut all_gone) = mpsc::channel(1);
    let hall = serve::ServedHall { router, closing: closing.clone(), alive, log };
    let users = Users::read();
    let of_desk = users.clone();
    let of_link = move |uid| Peer::Fleet(users.name(uid).into());
    let of_user = move |uid| Peer::Socket(of_desk.name(uid).into());
    runtime.block_on(async move {
        tokio::spawn(Pulse::follow(Arc::clone(&shared)));
        serve::tcp(tcp, &hall, &awaited);
        let taken =
            |listener| tokio::net::UnixListener::from_std(listener).expect("the runtime takes sockets");
        if let Some(fleet) = fleet {
            let hall = serve::ServedHall { router: of_fleet, ..hall.clone() };
            tokio::spawn(fleet_wishes::keep_settled(shared));
            tokio::spawn(serve::local(taken(fleet), of_link, "the fleet socket", hall));
        }
        tokio::spawn(serve::local(taken(local), of_user, "the control socket", hall));
        let _ = closing.wait_for(|&closing| closing).await; // whoever would say so has gone: an end as well
        let _ = tokio::time::timeout(LAST_WORDS, all_gone.recv()).await;
    });
    runtime.shutdown_timeout(LAST_WORDS);
}

/// What a port is called that is awaited.
fn named(address: SocketAddr) -> String {
    format!("api {address}")
}

/// Listens on those that can be had, and says where that is, and will be.
fn ports_so_far(addresses: &[SocketAddr], awaited: &AwaitedPorts) -> (Vec<TcpPort>, Vec<SocketAddr>) {
    let open = |&address: &SocketAddr| (address, awaited.try_open(&named(address), || port(address)));
    let ports: Vec<TcpPort> = addresses.iter().map(open).collect();
    let bound = |(address, listener): &TcpPort| {
        listener.as_ref().and_then(|listener| listener.local_addr().ok()).unwrap_or(*address)
    };
    let addresses = ports.iter().map(bound).collect();
    (ports, addresses)
}

/// Listens on all of them, and says where that is, with the ports that the system chose.
fn ports(addresses: &[SocketAddr]) -> Result<(Vec<TcpListener>, Vec<SocketAddr>), ApiError> {
    let listeners = addresses.iter().map(|&address| port(address)).collect::<Result<Vec<_>, _>>()?;
    let bound = listeners.iter().map(TcpListener::local_addr).collect::<Result<_, _>>();
    Ok((listeners, bound.map_err(ApiError::System)?))
}

fn port(address: SocketAddr) -> Result<TcpListener, ApiError> {
    listen::tcp(address).map_err(|source| ApiError::Port { address, source })
}
