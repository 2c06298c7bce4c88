//! Admission of every request: is it meant for us, who sends it, is their role enough for it, did it come before. Refusals leave it as
//! problems, and every reply with the headers that keep pages of others out.

use std::panic::AssertUnwindSafe;
use std::pin::pin;
use std::sync::Arc;
use std::task::Poll;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header::{
    AUTHORIZATION, CACHE_CONTROL, CONTENT_SECURITY_POLICY, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
    X_FRAME_OPTIONS,
};
use axum::http::{HeaderName, HeaderValue, Method};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use sha2::{Digest as _, Sha256};

use super::access::{Access, one};
use super::input::whole;
use super::once::{KeptReply, KeyHolder, KeyedRequest};
use super::peer::{self, Peer};
use super::problem::{bad_value, panicked, render};
use super::rest::BodyRest;
use super::roles;
use super::shared::{Shared, StillAsked};
use super::show::STOP;
use super::tries::Tries;
use crate::control::{Code, Place, Problem, Surface, Who};
use crate::log::{Line, Log, Priority};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::time::Clock as _;

/// Where a page opens its channel.
pub(super) const LIVE: &str = "/api/v1/live";
/// Of two requests with the same one the second does nothing.
const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");
/// Our wall clock in every reply, unix milliseconds, so that a page can tell how far its own is off.
const TIME: HeaderName = HeaderName::from_static("x-kinocue-time");
/// The stop of the page of a desk.
pub(crate) const FLEET_STOP: &str = "/api/v1/fleet/stop";
/// Nothing but what this server itself serves, and in nobody's frame.
const POLICY: &str =
    "default-src 'self'; img-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Passes a request on, or refuses it. What was begun is ended also where the connection goes away meanwhile, but for what a process of
/// its own works at ([`StillAsked`]).
pub(super) async fn gate(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let of_gate = Arc::clone(&shared);
    let (mut request, rest) = BodyRest::of(request);
    let (_here, asked) = StillAsked::new();
    request.extensions_mut().insert(asked);
    let response = match tokio::spawn(async move { pass(&of_gate, request, next).await }).await {
        Ok(response) => response,
        Err(_) => render(panicked().into_response(), None),
    };
    if let Some(rest) = rest {
        rest.read_out().await;
    }
    with_headers(response)
}

async fn pass(shared: &Shared, mut request: Request, next: Next) -> Response {
    let who = match admit(&shared.access, &shared.tries, &request) {
        Ok(who) => who,
        Err(problem) => {
            note(&shared.log, &request, &problem);
            return render(problem.into_response(), None);
        }
    };
    let Some(who) = who else {
        return render(caught(next.run(request)).await, None);
    };
    if let Err(problem) = roles::check(&request, &who) {
        return render(problem.into_response(), Some(&shared.handle.status()));
    }
    let name = who.to_string();
    let asker = KeyHolder { name, is_known: introduce(&mut request, who) };
    let key = one(request.headers(), &IDEMPOTENCY_KEY).map(|key| key.map(str::to_owned));
    let response = match key {
        // A stop is done each time that it comes.
        _ if request.uri().path() == STOP => caught(next.run(request)).await,
        Ok(Some(key)) if request.method() == Method::POST => {
            once(shared, &asker, &key, request, next).await.unwrap_or_else(IntoResponse::into_response)
        }
        Ok(_) => caught(next.run(request)).await,
        Err(problem) => problem.into_response(),
    };
    render(response, Some(&shared.handle.status()))
}

/// Who asks; `None` if it does not matter.
pub(super) fn admit(access: &Access, tries: &Tries, request: &Request) -> Result<Option<Who>, Problem> {
    let (headers, path) = (request.headers(), request.uri().path());
    access.check_origin(headers)?;
    let peer = request.extensions().get::<Peer>().expect("every connection has another end");
    if let Peer::Tcp(_) = peer {
        access.check_host(headers, request.uri())?;
    }
    let in_the_open = is_public(path);
    if !in_the_open && path != STOP && !takes_query(path) && request.uri().query().is_some() {
        return Err(bad_value(
            "there is a query, but nothing here takes one",
            "omit the ? and what follows it",
        ));
    }
    Ok(match peer {
        Peer::Socket(name) => Some(peer::local(name)),
        Peer::Fleet(name) => Some(peer::link(name)),
        Peer::Tcp(_) if in_the_open => None,
        Peer::Tcp(address) => {
            let who = access.who(headers, *address, tries, Monotonic.now());
            // A page with a token of another day must not be kept from what it could do without one.
            let stops = access.whoever(*address).filter(|_| is_stop(path));
            Some(who.or_else(|problem| stops.ok_or(problem))?)
        }
    })
}

/// True of a stop: of this hall, or of those of a desk.
fn is_stop(path: &str) -> bool {
    path == STOP || path == FLEET_STOP
}

/// Has a request, and the connection that it came by, know who asks. True of who has shown a token, or may open the control socket: they
/// keep a place before those who have not.
pub(super) fn introduce(request: &mut Request, who: Who) -> bool {
    let is_known = matches!(who.surface, Surface::Socket | Surface::Fleet)
        || request.headers().contains_key(AUTHORIZATION);
    if let Some(place) = request.extensions().get::<Arc<Place>>().filter(|_| is_known) {
        place.show(&who.name);
    }
    request.extensions_mut().insert(who);
    is_known
}

/// What is no secret and changes nothing: the page and what belongs to it, the description of the API, whether it is well. The channel of
/// the page asks for the token itself, as a browser sends none with the handshake of a WebSocket.
fn is_public(path: &str) -> bool {
    match path {
        "/healthz" | "/readyz" | super::service::DOCUMENT | LIVE => true,
        "/metrics" => false,
        _ => !path.starts_with("/api"),
    }
}

/// Says who was turned away at the door: nobody guesses tokens unseen. Who just comes without one is not worth a line.
pub(super) fn note(log: &Log, request: &Request, problem: &Problem) {
    let guessed = request.headers().contains_key(AUTHORIZATION);
    note_of(log, request.extensions().get::<Peer>(), guessed, problem);
}

/// Like [`note`], of a peer who showed a token or did not.
pub(super) fn note_of(log: &Log, peer: Option<&Peer>, guessed: bool, problem: &Problem) {
    if guessed && matches!(problem.code, Code::Token | Code::Busy) || problem.code == Code::Origin {
        let from = peer.map_or_else(String::new, ToString::to_string);
        let line =
            Line::new(Priority::Warning, "turned-away", format!("rejected {from}: {}", problem.detail));
        log.say(line.with("code", problem.code.word()).with("from", from));
    }
}

fn takes_query(path: &str) -> bool {
    let drawn = [("/api/v1/cues/", "/curve"), ("/api/v1/recordings/", "/picture")];
    drawn.iter().any(|(begin, end)| path.strip_prefix(begin).is_some_and(|rest| rest.ends_with(end)))
}

/// Does it, or gives the reply to the first request with that key.
async fn once(
    shared: &Shared,
    asker: &KeyHolder,
    key: &str,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let (parts, body) = request.into_parts();
    let body = whole(&parts.headers, body).await?;
    let line = format!("{} {}", parts.method, parts.uri.path());
    let asked = KeyedRequest { line, body: Sha256::digest(&body).into() };
    let first = shared.once.first(asker, key, asked, Monotonic.now())?;
    let request = Request::from_parts(parts, Body::from(body));
    let reply = first.get_or_init(|| async {
        KeptReply::of(render(caught(next.run(request)).await, Some(&shared.handle.status()))).await
    });
    let reply = reply.await;
    if reply.is_busy() {
        shared.once.release(&first);
    }
    Ok(reply.response())
}

/// The response, or a problem where the handler panicked.
pub(super) async fn caught(handler: impl Future<Output = Response>) -> Response {
    let mut handler = pin!(handler);
    std::future::poll_fn(|cx| {
        let poll = std::panic::catch_unwind(AssertUnwindSafe(|| handler.as_mut().poll(cx)));
        poll.unwrap_or_else(|_| Poll::Ready(panicked().into_response()))
    })
    .await
}

/// The reply with what keeps pages of others out.
pub(super) fn with_headers(mut response: Response) -> Response {
    let headers = response.headers_mut();
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
    headers.insert(REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.insert(CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    headers.insert(TIME, HeaderValue::from(wall_now_ns() / 1_000_000));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_public_is_listed_and_all_else_is_not() {
        for path in ["/", "/console.js", "/healthz", "/readyz", "/api/v1/openapi.json"] {
            assert!(is_public(path), "{path}");
        }
        for path in ["/api", "/api/v1/status", "/api/v1/openapi.json/", "/metrics", "/api/v1/cues"] {
            assert!(!is_public(path), "{path}");
        }
    }

    #[test]
    fn a_handler_that_panics_leaves_a_problem() {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let response = runtime.block_on(caught(async { panic!("on purpose") }));
        assert_eq!(render(response, None).status().as_u16(), 500);
    }
}
