//! Connections in, each served on the one thread of the control plane; beyond their number another one is closed.

use std::convert::Infallible;
use std::future::poll_fn;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream, UnixListener, UnixStream};
use tokio::sync::{mpsc, watch};

use super::guarded::Guarded;
use super::peer::Peer;
use super::{TcpPort, named};
use crate::control::{AwaitedPorts, Place, Places};
use crate::log::{Line, Log, Priority};

/// Connections over TCP.
const TCP: usize = 256;
/// Connections over the control socket.
const LOCAL: usize = 64;
/// How long the head of a request may take to come; a connection that is kept waits no longer for its next one either.
const HEAD_TIME: Duration = Duration::from_secs(5);
/// The longest head of a request, and how much of a reply waits to be sent, bytes.
const BUFFER: usize = 64 << 10;
/// The most headers.
const HEADERS: usize = 64;
/// How long nothing is accepted after the system refused a connection.
const PAUSE: Duration = Duration::from_millis(100);

/// What every connection needs.
#[derive(Clone)]
pub(super) struct ServedHall {
    /// The routes.
    pub(super) router: axum::Router,
    /// True if the server ends.
    pub(super) closing: watch::Receiver<bool>,
    /// Held by whatever still serves.
    pub(super) alive: mpsc::Sender<Infallible>,
    /// Where it is said that there is no room.
    pub(super) log: Log,
}

impl ServedHall {
    /// A place for a connection, for which another may have to leave.
    fn place(&self, places: &Places, address: Option<IpAddr>, from: &str) -> Place {
        let (place, crowded) = places.take(address);
        if crowded {
            self.no_room(from);
        }
        place
    }

    fn no_room(&self, from: &str) {
        let text = format!("too many connections; another one was closed for one from {from}");
        self.log.say(Line::new(Priority::Warning, "connections", text).with("from", from));
    }
}

/// Serves a socket of this machine until the server ends; `peer` names who comes by it.
pub(super) async fn local(
    listener: UnixListener,
    peer: impl Fn(u32) -> Peer,
    what: &'static str,
    hall: ServedHall,
) {
    let places = Places::new(LOCAL);
    let on = |(stream, _): (UnixStream, _)| {
        let Ok(user) = stream.peer_cred() else { return };
        let place = hall.place(&places, None, what);
        tokio::spawn(connection(stream, peer(user.uid()), place, hall.clone()));
    };
    accept_each(hall.closing.clone(), |context| listener.poll_accept(context), on).await;
}

/// Has the runtime that calls serve these TCP ports until the server ends, each as soon as it can be had.
pub(super) fn tcp(ports: Vec<TcpPort>, hall: &ServedHall, awaited: &AwaitedPorts) {
    let places = Places::new(TCP);
    for (address, listener) in ports {
        let (places, hall, awaited) = (places.clone(), hall.clone(), awaited.clone());
        tokio::spawn(async move {
            let taken = |listener| TcpListener::from_std(listener).expect("the runtime takes sockets");
            let opened = match listener {
                Some(listener) => listener,
                None => awaited.open(&named(address), || super::port(address)).await,
            };
            port(taken(opened), places, hall).await;
        });
    }
}

async fn port(listener: TcpListener, places: Places, hall: ServedHall) {
    let on = |(stream, from): (TcpStream, SocketAddr)| {
        let address = from.ip().to_canonical();
        let place = hall.place(&places, Some(address), &address.to_string());
        let _ = stream.set_nodelay(true); // a stop is worth a packet of its own
        tokio::spawn(connection(stream, Peer::Tcp(address), place, hall.clone()));
    };
    accept_each(hall.closing.clone(), |context| listener.poll_accept(context), on).await;
}

/// Hands on each connection that comes until the server ends.
async fn accept_each<T>(
    mut closing: watch::Receiver<bool>,
    mut accept: impl FnMut(&mut Context<'_>) -> Poll<io::Result<T>>,
    on: impl Fn(T),
) {
    loop {
        let accepted = tokio::select! {
            accepted = poll_fn(&mut accept) => accepted,
            _ = closing.changed() => return,
        };
        match accepted {
            Ok(connection) => on(connection),
            Err(_) => tokio::time::sleep(PAUSE).await, // out of descriptors or memory: a moment later there may be some
        }
    }
}

async fn connection<S>(stream: S, peer: Peer, place: Place, hall: ServedHall)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let ServedHall { router, mut closing, alive: _alive, .. } = hall;
    let router = Arc::new(TowerToHyperService::new(router));
    let place = Arc::new(place);
    let of_requests = Arc::clone(&place);
    let service = service_fn(move |mut request: hyper::Request<Incoming>| {
        request.extensions_mut().insert(peer.clone());
        request.extensions_mut().insert(Arc::clone(&of_requests));
        router.call(request)
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME).max_buf_size(BUFFER).max_headers(HEADERS);
    let served = http.serve_connection(TokioIo::new(Guarded::new(stream)), service).with_upgrades();
    tokio::pin!(served);
    tokio::select! {
        _ = served.as_mut() => return, // whatever ended it, the other end has gone
        () = place.leave() => return,
        _ = closing.changed() => {}
    }
    served.as_mut().graceful_shutdown();
    tokio::select! {
        _ = served => {}
        () = place.leave() => {}
    }
}
