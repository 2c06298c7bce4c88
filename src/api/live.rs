//! `/api/v1/live`: the channel of a page, a WebSocket. Statuses go out as they change. A stop comes in, past all that holds up requests;
//! so does an echo, by which a page knows that a stop would.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::{Request, State};
use axum::http::header::AUTHORIZATION;
use axum::http::{HeaderMap, HeaderValue};
use axum::response::Response;
use hyper_util::rt::TokioIo;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::{mpsc, watch};
use tokio::time::{Interval, MissedTickBehavior, interval, timeout};

use super::gate;
use super::peer::Peer;
use super::problem::{bad_value, panicked, text};
use super::shared::Shared;
use super::status::PACE;
use super::websocket::{self, Message};
use crate::control::{Place, Problem, Status, Who};
use crate::sys::clock::{Monotonic, wall_now_ns};
use crate::time::Clock as _;

/// How long the first message may take to come.
const HELLO: Duration = Duration::from_secs(5);
/// How long a page may say nothing: one that sleeps makes room.
const SILENCE: Duration = Duration::from_secs(10);
/// How long a page that is turned away has to leave.
const PARTING: Duration = Duration::from_secs(1);
/// LiveAnswers that wait to be sent.
const ANSWERS: usize = 4;

/// The other end.
struct Guest {
    peer: Peer,
    /// Who it is, where the socket that it came by says so.
    who: Option<Who>,
    place: Arc<Place>,
}

/// Makes a channel of the connection. The first message is what the header `Authorization` of a request would be, or empty. Of those
/// that follow `stop` is a stop, and `echo` asks for the time.
pub(super) async fn live(
    State(shared): State<Arc<Shared>>,
    mut request: Request,
) -> Result<Response, Problem> {
    let (response, upgrade) = websocket::accept(&mut request)?;
    let parts = request.extensions_mut();
    let (peer, place) = (parts.remove::<Peer>(), parts.remove::<Arc<Place>>());
    let (Some(peer), Some(place)) = (peer, place) else { return Err(panicked()) };
    let guest = Guest { peer, who: parts.remove(), place };
    tokio::spawn(async move {
        let Ok(upgraded) = upgrade.await else { return };
        let (place, mut closing) = (Arc::clone(&guest.place), shared.closing.clone());
        tokio::select! {
            () = talk(&shared, guest, TokioIo::new(upgraded)) => {}
            () = place.leave() => {}
            _ = closing.wait_for(|&closing| closing) => {}
        }
    });
    Ok(response)
}

async fn talk(shared: &Shared, guest: Guest, stream: impl AsyncRead + AsyncWrite) {
    let (mut from, mut to) = tokio::io::split(stream);
    let Ok(Ok(Message::Text(shown))) = timeout(HELLO, websocket::read(&mut from)).await else { return };
    let admitted = guest.admit(shared, &shown).and_then(|who| Ok((shared.streams.take(&who)?, who)));
    match admitted {
        Ok((place, who)) => {
            let (answer, answers) = mpsc::channel(ANSWERS);
            tokio::select! {
                () = listen(shared, &who, from, answer) => {}
                () = push(shared, to, answers) => {}
                () = place.leave() => {}
            }
        }
        Err(problem) => {
            let sent =
                websocket::send(&mut to, &[b"{\"problem\":", text(&problem, None).as_bytes(), b"}"]).await;
            // What came meanwhile is read: the system would take back what is on its way to the page.
            let rest = async { while websocket::read(&mut from).await.is_ok() {} };
            if sent.is_ok() {
                let _ = timeout(PARTING, rest).await; // it may stay away
            }
        }
    }
}

impl Guest {
    /// Who it is by what it has shown.
    fn admit(&self, shared: &Shared, shown: &str) -> Result<Who, Problem> {
        let is_known = self.who.is_some() || !shown.is_empty();
        let who = self.who.clone().map_or_else(|| self.named(shared, shown), Ok);
        match &who {
            Ok(who) if is_known => self.place.show(&who.name),
            Ok(_) => {}
            Err(problem) => gate::note_of(&shared.log, Some(&self.peer), is_known, problem),
        }
        who
    }

    fn named(&self, shared: &Shared, shown: &str) -> Result<Who, Problem> {
        let Peer::Tcp(address) = &self.peer else { return Err(panicked()) };
        let mut headers = HeaderMap::new();
        if !shown.is_empty() {
            let shown = HeaderValue::from_str(shown);
            let shown =
                shown.map_err(|_| bad_value("the first message is no token", "send: Bearer TOKEN"))?;
            headers.insert(AUTHORIZATION, shown);
        }
        shared.access.who(&headers, *address, &shared.tries, Monotonic.now())
    }
}

/// Takes what a page says, until it says nothing any more.
async fn listen(
    shared: &Shared,
    who: &Who,
    mut from: impl AsyncRead + Unpin,
    answer: mpsc::Sender<LiveAnswer>,
) {
    while let Ok(Ok(message)) = timeout(SILENCE, websocket::read(&mut from)).await {
        let what = match message {
            Message::Text(text) if text.trim().eq_ignore_ascii_case("stop") => {
                shared.handle.stop(); // before all else
                shared.handle.note_stop(who.clone());
                LiveAnswer::Text("{\"stop\":\"received\"}".to_owned())
            }
            Message::Text(text) if text == "echo" => {
                LiveAnswer::Text(format!("{{\"time\":{}}}", wall_now_ns() / 1_000_000))
            }
            Message::Text(_) => return,
            Message::Ping(payload) => LiveAnswer::Pong(payload),
            Message::Pong => continue,
        };
        drop(answer.try_send(what)); // who takes no answers gets none
    }
}

/// What is said to one page.
enum LiveAnswer {
    Text(String),
    Pong(Vec<u8>),
}

/// Sends answers and statuses, each status whole, ten a second at the most, until the other end takes nothing any more.
async fn push(shared: &Shared, mut to: impl AsyncWrite + Unpin, mut answers: mpsc::Receiver<LiveAnswer>) {
    let mut statuses = shared.handle.watch();
    statuses.mark_changed();
    let mut pace = interval(PACE);
    pace.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let sent = tokio::select! {
            biased;
            answer = answers.recv() => match answer {
                Some(LiveAnswer::Text(text)) => websocket::send(&mut to, &[text.as_bytes()]).await,
                Some(LiveAnswer::Pong(payload)) => websocket::pong(&mut to, &payload).await,
                None => return,
            },
            status = next(&mut statuses, &mut pace) => match status {
                Some(status) => websocket::send(&mut to, &[b"{\"status\":", &shared.write(&status), b"}"]).await,
                None => return, // there is no hall any more
            },
        };
        if sent.is_err() {
            return;
        }
    }
}

/// The next status, in its time.
async fn next(statuses: &mut watch::Receiver<Arc<Status>>, pace: &mut Interval) -> Option<Arc<Status>> {
    pace.tick().await;
    statuses.changed().await.ok()?;
    Some(Arc::clone(&statuses.borrow_and_update()))
}
