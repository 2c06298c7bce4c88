//! Art-Net timecode, and positions by OSC and HTTP: what comes over the network from one sender who is named.

use std::convert::Infallible;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use http_body_util::{BodyExt as _, Full, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use rosc::{OscPacket, decoder};
use tokio::net::{TcpListener, TcpStream};

use super::{FilmError, WordSink, datagrams, start};
use crate::api::Access;
use crate::control::{Place, Places};
use crate::film::artnet::{ArtNetReader, ArtTimecode};
use crate::film::message::{FilmPosition, PositionReader};
use crate::film::source::{FilmArgs, NamedSender};
use crate::json;
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::sys::listen;
use crate::time::Clock as _;

/// Where positions are put.
const PATH: &str = "/api/v1/sync/position";
const ADDRESS: &str = "/kinocue/sync";
/// The longest body of a request, bytes, and how long its head may take.
const BODY: usize = 1_024;
const HEAD_TIME: Duration = Duration::from_secs(5);
/// Connections of the one sender. There is always room for one more: of those that have told no position yet, the one that was silent
/// longest goes.
const CONNECTIONS: usize = 64;
/// Whose a connection is that has told a position.
const PLAYER: &str = "player";
/// How often it is looked whether anybody still listens.
const LOOK: Duration = Duration::from_millis(250);

fn at_bind(sender: &NamedSender) -> impl FnOnce(std::io::Error) -> FilmError {
    let what = format!("the port {}", sender.bind);
    move |source| FilmError::Open { what, source }
}

/// Begins to hear Art-Net timecode.
pub(super) fn hear_artnet(sender: &NamedSender, args: &FilmArgs, told: WordSink) -> Result<(), FilmError> {
    let socket = datagrams::open(sender.bind).map_err(at_bind(sender))?;
    let (mut reader, named) = (ArtNetReader::new(args.rate, args.start), sender.from);
    // Others may send whatever else Art-Net has.
    let is_one = |bytes: &[u8]| ArtTimecode::parse(bytes).is_some();
    start("artnet", move || {
        datagrams::read(&socket, named, &told, is_one, |bytes, at| {
            reader.hear(bytes, at, &mut |what| {
                told.tell(what);
            });
            told.note(|notes| {
                notes.garbage = reader.garbage();
                notes.label(reader.labels());
            });
        });
    })?;
    Ok(())
}

/// Begins to hear positions by OSC.
pub(super) fn hear_osc(sender: &NamedSender, args: &FilmArgs, told: WordSink) -> Result<(), FilmError> {
    let socket = datagrams::open(sender.bind).map_err(at_bind(sender))?;
    let (mut reader, named) = (PositionReader::new(args.begin()), sender.from);
    start("osc", move || {
        datagrams::read(
            &socket,
            named,
            &told,
            |_| true,
            |bytes, at| match osc_position(bytes) {
                Some(position) => reader.hear(&position, at, &mut |what| {
                    told.tell(what);
                }),
                None => told.note(|notes| notes.garbage += 1),
            },
        );
    })?;
    Ok(())
}

/// The position of a datagram, if it is one message that tells of one.
pub(super) fn osc_position(bytes: &[u8]) -> Option<FilmPosition> {
    // A bundle is not looked into: it says when something is to be done, not when it was so.
    let Ok((_, OscPacket::Message(message))) = decoder::decode_udp(bytes) else { return None };
    (message.addr == ADDRESS).then(|| FilmPosition::of_osc(&message.args, wall_now_ns())).flatten()
}

/// Begins to hear positions by HTTP.
pub(super) fn hear_http(sender: &NamedSender, args: &FilmArgs, told: WordSink) -> Result<(), FilmError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let listener = listen::tcp(sender.bind.into()).map_err(at_bind(sender))?;
    let listener = runtime.block_on(async { TcpListener::from_std(listener) }).map_err(at_bind(sender))?;
    let access = Access::without_pages();
    let door = Door { reader: Mutex::new(PositionReader::new(args.begin())), told, access };
    let named = sender.from;
    start("http", move || runtime.block_on(serve(listener, named, Arc::new(door))))?;
    Ok(())
}

/// Where requests come in.
struct Door {
    reader: Mutex<PositionReader>,
    told: WordSink,
    access: Access,
}

async fn serve(listener: TcpListener, named: Ipv4Addr, door: Arc<Door>) {
    let places = Places::new(CONNECTIONS);
    while !door.told.is_over() {
        let Ok(accepted) = tokio::time::timeout(LOOK, listener.accept()).await else { continue };
        let Ok((stream, peer)) = accepted else {
            tokio::time::sleep(LOOK).await; // out of descriptors: a moment later there may be some
            continue;
        };
        if !door.told.hears(named, peer.ip()) {
            continue;
        }
        let (place, _) = places.take(Some(IpAddr::V4(named)));
        let door = Arc::clone(&door);
        tokio::spawn(async move {
            tokio::select! {
                () = connection(stream, &door, &place) => {}
                () = place.leave() => {}
            }
        });
    }
}

async fn connection(stream: TcpStream, door: &Door, place: &Place) {
    let _ = stream.set_nodelay(true); // a position that waits is a wrong one
    let service = service_fn(|request| async { Ok::<_, Infallible>(answer(request, door, place).await) });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME).max_headers(32).max_buf_size(8_192);
    // What ended it, the sender knows best.
    let _ = http.serve_connection(TokioIo::new(stream), service).await;
}

async fn answer(request: Request<Incoming>, door: &Door, place: &Place) -> Response<Full<Bytes>> {
    let (status, text) = match take(request, door).await {
        Ok(()) => {
            place.show(PLAYER);
            (StatusCode::NO_CONTENT, String::new())
        }
        Err((status, text)) => {
            door.told.note(|notes| notes.garbage += 1);
            (status, text + "\n")
        }
    };
    let mut response = Response::new(Full::new(Bytes::from(text)));
    *response.status_mut() = status;
    response
}

async fn take(request: Request<Incoming>, door: &Door) -> Result<(), (StatusCode, String)> {
    // A page in a browser of the player's machine is no player, whatever name has led it here.
    let of_page = door.access.check_origin(request.headers());
    of_page.and_then(|()| door.access.check_host(request.headers(), request.uri())).map_err(|problem| {
        let status = StatusCode::from_u16(problem.status).unwrap_or(StatusCode::FORBIDDEN);
        (status, format!("{}; {}", problem.detail, problem.remedy))
    })?;
    if request.uri().path() != PATH {
        return Err((StatusCode::NOT_FOUND, format!("put positions to {PATH}")));
    }
    if request.method() != Method::PUT {
        return Err((StatusCode::METHOD_NOT_ALLOWED, "use PUT".to_owned()));
    }
    let body = tokio::time::timeout(HEAD_TIME, Limited::new(request, BODY).collect()).await;
    let body = body.ok().and_then(Result::ok).ok_or_else(|| {
        (StatusCode::PAYLOAD_TOO_LARGE, format!("the body is longer than {BODY} bytes, or late"))
    })?;
    let at = Monotonic.now();
    let position: FilmPosition = json::from_slice(&body.to_bytes()).map_err(|error| {
        (
            StatusCode::BAD_REQUEST,
            format!("{error}; send {{\"media_ms\": 61500.0, \"rate\": 1.0, \"playing\": true}}"),
        )
    })?;
    // WordSink outside of the lock: who listens may be slow.
    let mut words = Vec::new();
    let mut reader = door.reader.lock().unwrap_or_else(PoisonError::into_inner);
    reader.hear(&position, at, &mut |what| words.push(what));
    drop(reader);
    words.into_iter().for_each(|what| {
        door.told.tell(what);
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use rosc::{OscMessage, OscType, encoder};

    use super::*;

    #[test]
    fn only_a_message_of_the_address_with_a_position_is_one() {
        let bytes = |addr: &str, args: Vec<OscType>| {
            encoder::encode(&OscPacket::Message(OscMessage { addr: addr.to_owned(), args }))
                .expect("it is OSC")
        };
        let read = osc_position(&bytes(ADDRESS, vec![OscType::Long(61_500), OscType::Bool(false)]));
        assert!(read.is_some_and(|read| !read.playing && (read.media_ms - 61_500.0).abs() < 1e-9));
        assert!(osc_position(&bytes("/kinocue/seek", vec![OscType::Long(1)])).is_none());
        assert!(osc_position(&bytes(ADDRESS, vec![])).is_none());
        assert!(osc_position(b"/kinocue/sync").is_none() && osc_position(&[]).is_none());
    }
}
