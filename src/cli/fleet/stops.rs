//! Stops on their way to a hall, by a socket of their own that waits for nothing. Of a hall with two show machines both links hear each:
//! the one whose machine does not serve the hall keeps it for as long as a takeover lasts, unless the other one lives on.

use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use async_nats::Message;
use futures_util::StreamExt as _;
use hyper::body::Bytes;
use serde_json::{Value, json};
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep};

use super::engine;
use super::hall::Link;
use super::lease::Renewed;
use super::link::{Messages, away};
use crate::cli::client::ask_stop;
use crate::cli::print;
use crate::fleet;

/// How long a stop may take.
const STOPPED: Duration = Duration::from_secs(2);
/// How long it waits for a machine that is about to lead: for the lead, for the address of the hall, and for the first look at it.
const TAKEN_OVER: Duration = Duration::from_secs(6);
/// The lease of a machine that leads is renewed ten times a second: one that was seen to be so much later has the stop.
const LIVES_ON: Duration = Duration::from_millis(500);
/// How often that machine is tried.
const AGAIN: Duration = Duration::from_millis(100);
/// Stops that wait; one more is done with these, and not answered.
const WAITING: usize = 64;

/// A stop, and when it was asked.
type WaitingStop = (Instant, Message);

impl Link {
    pub(super) async fn subscribe_to_stops(&self) -> Messages {
        let site = self.hall.split_once('.').map_or("", |(site, _)| site);
        let all = fleet::stop_to(&format!("{site}.{}", fleet::ALL), "*");
        self.subscribed([fleet::stop_to(&self.hall, "*"), all]).await
    }

    /// Passes stops on.
    pub(super) async fn hear_stops(self: &Arc<Self>, mut stops: Messages, renewed: Renewed) {
        let (wait, waiting) = mpsc::channel(WAITING);
        tokio::spawn(Arc::clone(self).stop_later(waiting, renewed));
        while let Some(message) = stops.next().await {
            if is_of_engine(&message) {
                print::tell("no stop: a member had the engine answer here");
                continue;
            }
            let (link, wait) = (Arc::clone(self), wait.clone());
            let (message, asked) = (Message { payload: Bytes::new(), ..message }, Instant::now());
            tokio::spawn(async move {
                let who = message.subject.rsplit('.').next().unwrap_or_default();
                let stopped = link.stop().await; // before a terminal, which may stand still
                print::tell(&format!("{who} asks for a stop"));
                match stopped {
                    Ok(()) => link.answer(&message, stopping()).await,
                    Err(_) if link.is_of_two() => drop(wait.try_send((asked, message))),
                    Err(why) => link.answer(&message, away(&why)).await,
                }
            });
        }
    }

    /// Has a machine stop that is about to lead, as soon as it serves the hall.
    async fn stop_later(self: Arc<Self>, mut waiting: mpsc::Receiver<WaitingStop>, renewed: Renewed) {
        while let Some(first) = waiting.recv().await {
            let mut all = vec![first];
            while !all.is_empty() {
                if self.stop().await.is_ok() {
                    print::tell("the hall stops, as was asked while this machine did not serve it yet");
                    for (_, message) in all.drain(..) {
                        self.answer(&message, stopping()).await;
                    }
                    break;
                }
                sleep(AGAIN).await;
                all.extend(std::iter::from_fn(|| waiting.try_recv().ok()).take(WAITING));
                let renewed = *renewed.borrow();
                all.retain(|(asked, _)| waits(*asked, renewed, Instant::now()));
                all.truncate(WAITING);
            }
        }
    }

    /// Has the hall stop now.
    async fn stop(&self) -> anyhow::Result<()> {
        let socket = self.socket.with_file_name("fleet-stop.sock");
        ask_stop(&socket, STOPPED).await.context("the hall did not say that it stops")
    }
}

/// True while a stop may still be for this machine: the other one was not seen to live on, and a takeover lasts no longer.
fn waits(asked: Instant, renewed: Option<Instant>, now: Instant) -> bool {
    now < asked + TAKEN_OVER && renewed.is_none_or(|renewed| renewed < asked + LIVES_ON)
}

fn stopping() -> (u16, Value) {
    (200, json!({ "stopping": true }))
}

/// True of what the engine itself says. All else is somebody's stop, whatever is in it.
fn is_of_engine(message: &Message) -> bool {
    let is_kept = message.headers.as_ref().is_some_and(|headers| headers.get("Nats-Stream").is_some());
    message.status.is_some() || is_kept || engine::is_said_by_engine(&message.payload)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_waits_for_a_takeover_and_not_where_the_other_machine_lives_on() {
        let asked = Instant::now();
        let ms = |ms| asked + Duration::from_millis(ms);
        let waits = |renewed: Option<u64>, now| waits(asked, renewed.map(ms), ms(now));
        assert!(waits(None, 100) && waits(None, 5_900) && !waits(None, 6_000));
        assert!(waits(Some(0), 4_000), "it may have died at that very instant");
        assert!(waits(Some(400), 4_000) && !waits(Some(500), 600), "it has the stop itself");
    }
}
