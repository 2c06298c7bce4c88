//! Connections in, each served on the one thread of the control plane; beyond their number they are closed at once.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, UnixListener};
use tokio::sync::{mpsc, watch};

use super::guarded::Guarded;
use super::peer::Peer;
use super::slots::{Slot, Slots};
use crate::log::{Line, Log, Priority};

/// Connections over TCP, and of one address.
const TCP: (usize, usize) = (256, 64);
/// Connections over the control socket.
const LOCAL: usize = 64;
/// How long the head of a request may take to come; a connection that is kept waits no longer for its next one either.
const HEAD_TIME: Duration = Duration::from_secs(5);
/// The longest head of a request, and how much of a reply waits to be sent, octets.
const BUFFER: usize = 64 << 10;
/// The most headers.
const HEADERS: usize = 64;
/// How long nothing is accepted after the system refused a connection.
const PAUSE: Duration = Duration::from_millis(100);

/// What every connection needs.
#[derive(Clone)]
pub(super) struct Hall {
    /// The routes.
    pub(super) router: axum::Router,
    /// Whether the server ends.
    pub(super) closing: watch::Receiver<bool>,
    /// Held by whatever still serves.
    pub(super) alive: mpsc::Sender<Infallible>,
    /// Where it is said that there is no room.
    pub(super) log: Log,
}

impl Hall {
    fn no_room(&self, from: &str) {
        let text = format!("there is no room for more connections from {from}; they are closed");
        self.log.say(Line::new(Priority::Warning, "connections", text).with("from", from));
    }
}

/// Serves the control socket until the server ends.
pub(super) async fn local(listener: UnixListener, hall: Hall) {
    let slots = Slots::new(LOCAL, LOCAL);
    let mut closing = hall.closing.clone();
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            _ = closing.changed() => return,
        };
        match accepted {
            Ok((stream, _)) => {
                let Some(slot) = slots.take(None) else {
                    hall.no_room("the control socket");
                    continue;
                };
                let Ok(user) = stream.peer_cred() else { continue };
                tokio::spawn(connection(stream, Peer::of_user(user.uid()), slot, hall.clone()));
            }
            Err(_) => tokio::time::sleep(PAUSE).await, // out of descriptors or memory: a moment later there may be some
        }
    }
}

/// Serves one TCP port until the server ends.
pub(super) async fn tcp(listener: TcpListener, slots: Slots, hall: Hall) {
    let mut closing = hall.closing.clone();
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            _ = closing.changed() => return,
        };
        match accepted {
            Ok((stream, from)) => {
                let address = from.ip().to_canonical();
                let Some(slot) = slots.take(Some(address)) else {
                    hall.no_room(&address.to_string());
                    continue;
                };
                let _ = stream.set_nodelay(true); // a stop is worth a packet of its own
                tokio::spawn(connection(stream, Peer::Tcp(address), slot, hall.clone()));
            }
            Err(_) => tokio::time::sleep(PAUSE).await,
        }
    }
}

/// Room for all connections over TCP.
pub(super) fn tcp_slots() -> Slots {
    Slots::new(TCP.0, TCP.1)
}

async fn connection<S>(stream: S, peer: Peer, _slot: Slot, hall: Hall)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let Hall { router, mut closing, alive: _alive, .. } = hall;
    let router = Arc::new(TowerToHyperService::new(router));
    let service = service_fn(move |mut request: hyper::Request<Incoming>| {
        request.extensions_mut().insert(peer.clone());
        router.call(request)
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME).max_buf_size(BUFFER).max_headers(HEADERS);
    let served = http.serve_connection(TokioIo::new(Guarded::new(stream)), service);
    tokio::pin!(served);
    tokio::select! {
        _ = served.as_mut() => return, // whatever ended it, the other end has gone
        _ = closing.changed() => {}
    }
    served.as_mut().graceful_shutdown();
    let _ = served.await;
}
