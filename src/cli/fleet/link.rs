//! `kinocue fleet link`: carries what a hall says of itself to the engine, and what it is asked to the hall. It decides nothing: letters
//! are checked by the hall. While it is away, or the engine, the hall plays on as ever.

use std::path::PathBuf;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use async_nats::Message;
use futures_util::{StreamExt as _, stream};
use serde_json::{Value, json};
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::{Semaphore, watch};
use tokio::time::{MissedTickBehavior, interval, sleep, timeout};

use super::act::{AT_IT, AT_IT_AFTER, AWAY, UNANSWERED};
use super::clock::Rounds;
use super::hall::Link;
use super::log::LogTeller;
use super::wishes::WishKeeper;
use super::{clock, engine, lease, settings};
use crate::cli::{Exit, Failure, OrExit as _, places, print};
use crate::fleet::{self, BriefStatus};
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// What is heard by several subjects.
pub(super) type Messages = stream::SelectAll<async_nats::Subscriber>;

/// How often the hall is looked at, and so the most that is told of it.
const LOOK: Duration = Duration::from_millis(100);
/// How often it is told where nothing changes.
const TELL: Duration = Duration::from_millis(500);
/// How often the last status is kept where the state stays.
const KEEP: Duration = Duration::from_secs(60);
/// How long the next try waits after something failed.
const AGAIN: Duration = Duration::from_secs(2);
/// How long the hall may take to answer what is asked.
const ASKED: Duration = Duration::from_secs(65);
/// What is asked at a time.
const AT_ONCE: usize = 32;
/// The longest letter.
const LONGEST: usize = 60 << 10;

/// Carries what a hall says to the engine, and what it is asked to the hall.
///
/// Runs beside `kinocue serve`, best as the unit kinocue-link.service: as a user who may open the two fleet sockets of the hall and nothing
/// else. It checks no signature; the hall does. Ends on SIGTERM and Ctrl-C.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Its settings, as `kinocue fleet init` makes them.
    #[arg(long, value_name = "FILE", env = "KINOCUE_FLEET", default_value = "/etc/kinocue/fleet.toml")]
    config: PathBuf,
    /// The fleet socket of the hall [default: fleet.sock beside the control socket].
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
    /// Where cues lie while they are fetched [default: what the service manager says, or a folder of the user's].
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<Exit, Failure> {
    let settings = settings::link(&args.config)?;
    let socket = args.socket.clone().unwrap_or_else(|| places::control_socket().with_file_name("fleet.sock"));
    engine::block_on(async {
        let mut ends = signal(SignalKind::terminate()).context("signals cannot be handled").or_system()?;
        let client = engine::connect_link(&settings.access, &settings.hall).await?;
        let link = Arc::new(Link { hall: settings.hall, client, socket });
        let parts = args.state.clone().unwrap_or_else(places::link_state);
        let clock = settings.time_server.as_deref().map(|server| (server, clock::watch_server(server)));
        print::tell(&format!("carries {} by {}", link.hall, link.socket.display()));
        let (tell, told) = watch::channel(None);
        let (renew, renewed) = watch::channel(None);
        let work = async {
            // First, so that a hall that is heard of can also be stopped.
            let stops = link.subscribe_to_stops().await;
            let orders = link.subscribed([fleet::command_to(&link.hall, "*", "*")]).await;
            tokio::join!(
                link.tell(&tell),
                link.keep(told.clone()),
                link.keep_wishes(parts, told),
                link.hear_stops(stops, renewed),
                link.hear_orders(orders),
                link.tell_log(),
                lease::carry(&link, &renew),
                link.tell_clock(clock)
            );
        };
        tokio::select! {
            () = work => {}
            _ = ends.recv() => {}
            _ = tokio::signal::ctrl_c() => {}
        }
        Ok(Exit::Done)
    })
}

impl Link {
    /// Tells how the hall is, twice a second and where it changes.
    async fn tell(&self, last: &watch::Sender<Option<BriefStatus>>) {
        let mut pace = interval(LOOK);
        pace.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (mut seq, mut told_at, mut trouble) = (0, None, Trouble::default());
        loop {
            pace.tick().await;
            let mut status: BriefStatus = match self.look_up("/api/v1/fleet/status").await {
                Ok(status) => status,
                Err(why) => {
                    self.tell_trouble(&mut trouble, "the hall", &why);
                    continue;
                }
            };
            trouble.over("the hall");
            let now = Monotonic.now();
            let is_due = told_at.is_none_or(|at| now.since(at) >= TELL);
            let differs = last.borrow().as_ref().is_none_or(|before| status.differs(before));
            if !(is_due || differs) {
                continue;
            }
            // Whoever fetches cues stops as soon as the hall is armed, also while the engine is away.
            if self.is_connected() {
                seq += 1;
                (status.seq, told_at) = (seq, Some(now));
                let text = serde_json::to_vec(&status).expect("a status is text and numbers");
                // Where it does not go out, the next one does.
                let _ = self.client.publish(fleet::status_of(&self.hall), text.into()).await;
            } else {
                status.seq = seq;
            }
            last.send_replace(Some(status));
        }
    }

    /// Has the engine keep the last status: at each change of state, and each minute. None twice: one of a hall that does not answer any more
    /// would look new, and take the place of what its other machine tells.
    async fn keep(&self, mut told: watch::Receiver<Option<BriefStatus>>) {
        let kept = engine::kept(&self.client);
        let subject = engine::value_to(fleet::SEEN, &self.hall);
        let mut trouble = Trouble::default();
        let mut seq = 0;
        loop {
            let Some(status) = told_after(&mut told, seq).await else { return };
            if !self.is_connected() {
                sleep(AGAIN).await;
                continue;
            }
            let text = serde_json::to_vec(&status).expect("a status is text and numbers");
            let put = async { kept.publish(subject.clone(), text.into()).await?.await };
            match put.await {
                Ok(_) => trouble.over("keeping the last status"),
                Err(error) => {
                    trouble.tell("keeping the last status", &anyhow!(error));
                    sleep(AGAIN).await;
                    continue;
                }
            }
            seq = status.seq;
            let differs = told.wait_for(|now| now.as_ref().is_some_and(|now| now.state != status.state));
            if matches!(timeout(KEEP, differs).await, Ok(Err(_))) {
                return;
            }
        }
    }

    /// Passes orders on, and what the hall answers back.
    async fn hear_orders(self: &Arc<Self>, mut orders: Messages) {
        let places = Arc::new(Semaphore::new(AT_ONCE));
        while let Some(message) = orders.next().await {
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                self.answer(
                    &message,
                    (
                        429,
                        json!({ "code": "busy", "detail": "too many orders at once",
                    "remedy": "try again in a second" }),
                    ),
                )
                .await;
                continue;
            };
            let link = Arc::clone(self);
            tokio::spawn(async move {
                let _place = place;
                match link.carry(&message).await {
                    Ok(reply) => link.answer(&message, reply).await,
                    // The other machine may have it, but not what this one hung up on.
                    Err(why) if link.is_of_two() && !is_cut_off(&why) => {}
                    Err(why) => link.answer(&message, away(&why)).await,
                }
            });
        }
    }

    /// Has the hall take a letter, or look up its status, which needs none.
    async fn carry(&self, message: &Message) -> anyhow::Result<(u16, Value)> {
        let word = message.subject.rsplit('.').next().unwrap_or_default();
        let reply = if word == "status" {
            self.get("/api/v1/status").await?
        } else {
            anyhow::ensure!(message.payload.len() <= LONGEST, "a letter is at most {LONGEST} bytes long");
            let mut asked = pin!(self.post("/api/v1/fleet/order", message.payload.clone(), ASKED));
            match timeout(AT_IT_AFTER, asked.as_mut()).await {
                Ok(reply) => reply?,
                Err(_) => {
                    self.answer(message, (AT_IT, Value::Null)).await;
                    asked.await?
                }
            }
        };
        Ok((reply.status, serde_json::from_str(&reply.text).unwrap_or(Value::Null)))
    }

    pub(super) async fn answer(&self, message: &Message, (status, reply): (u16, Value)) {
        let Some(to) = message.reply.clone() else { return };
        let text = json!({ "hall": self.hall, "status": status, "reply": reply }).to_string();
        let _ = self.client.publish(to, text.into()).await; // whoever asked is told nothing, and says so
    }

    /// Passes the journal on, for as long as there is more.
    async fn tell_log(&self) {
        let mut log = LogTeller::new(self);
        let mut trouble = Trouble::default();
        loop {
            match log.tell().await {
                Ok(true) => trouble.over("the log"),
                Ok(false) => {
                    trouble.over("the log");
                    sleep(AGAIN).await;
                }
                Err(why) => {
                    self.tell_trouble(&mut trouble, "the log", &why);
                    sleep(AGAIN).await;
                }
            }
        }
    }

    /// Keeps the library as it is wished.
    async fn keep_wishes(&self, parts: PathBuf, told: watch::Receiver<Option<BriefStatus>>) {
        let mut wishes = WishKeeper::new(self, parts, told);
        let mut trouble = Trouble::default();
        loop {
            let more = wishes.step().await;
            match &more {
                Ok(_) => trouble.over("cues"),
                Err(why) => self.tell_trouble(&mut trouble, "cues", why),
            }
            if !more.unwrap_or(false) {
                sleep(AGAIN).await;
            }
        }
    }

    /// Tells the hall how far its clock is off, as often as that was measured.
    async fn tell_clock(&self, clock: Option<(&str, anyhow::Result<Rounds>)>) {
        let mut trouble = Trouble::default();
        let Some((server, rounds)) = clock else { return };
        let mut rounds = match rounds {
            Ok(rounds) => rounds,
            Err(why) => return trouble.tell("the time server", &why),
        };
        while rounds.changed().await.is_ok() {
            let round = rounds.borrow_and_update().clone();
            let told = match round {
                Some(Ok(measured)) => {
                    let body = clock::told(server, &measured);
                    self.look_up_by::<Value>("/api/v1/fleet/clock", &body).await.map(drop)
                }
                Some(Err(why)) => Err(anyhow!(why)),
                None => continue,
            };
            match told {
                Ok(()) => trouble.over("the time server"),
                Err(why) => self.tell_trouble(&mut trouble, "the time server", &why),
            }
        }
    }

    /// Tells what goes wrong with a hall that is served here.
    fn tell_trouble(&self, trouble: &mut Trouble, what: &str, why: &anyhow::Error) {
        if !self.stands_by() {
            trouble.tell(what, why);
        }
    }

    pub(super) async fn subscribed<const N: usize>(&self, subjects: [String; N]) -> Messages {
        let mut all = stream::SelectAll::new();
        for subject in subjects {
            // It fails where the client was closed, which nobody does.
            if let Ok(heard) = self.client.subscribe(subject).await {
                all.push(heard);
            }
        }
        all
    }
}

/// The newest status that was told after the one of that number, as soon as there is one; `None` where no more is told.
async fn told_after(told: &mut watch::Receiver<Option<BriefStatus>>, seq: u64) -> Option<BriefStatus> {
    told.wait_for(|now| now.as_ref().is_some_and(|now| now.seq > seq)).await.ok()?.clone()
}

/// That the hall cannot be asked.
pub(super) fn away(why: &anyhow::Error) -> (u16, Value) {
    let remedy = "look at the hall: its service may be down";
    let status = if is_cut_off(why) { UNANSWERED } else { AWAY };
    (status, json!({ "code": "timeout", "detail": format!("{why:#}"), "remedy": remedy }))
}

/// True if the service had been reached by then.
fn is_cut_off(why: &anyhow::Error) -> bool {
    why.is::<hyper::Error>()
}

/// What goes wrong, told once until it is over.
#[derive(Debug, Default)]
struct Trouble(Option<String>);

impl Trouble {
    fn tell(&mut self, what: &str, why: &anyhow::Error) {
        let why = format!("{what}: {why:#}");
        if self.0.as_ref() != Some(&why) {
            print::tell(&why);
            self.0 = Some(why);
        }
    }

    fn over(&mut self, what: &str) {
        if self.0.take().is_some() {
            print::tell(&format!("{what}: well again"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_of_a_hall_that_tells_no_more_is_kept_once() {
        let status = |seq| Some(BriefStatus { seq, ..BriefStatus::default() });
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let (tell, mut told) = watch::channel(None);
            let mut after = async |seq| timeout(LOOK, told_after(&mut told, seq)).await.ok();
            assert_eq!(after(0).await, None, "nothing was told yet");
            tell.send_replace(status(1));
            assert_eq!(after(0).await, Some(status(1)));
            assert_eq!(after(1).await, None, "a minute later it would look new");
            tell.send_replace(status(2));
            assert_eq!(after(1).await, Some(status(2)));
            drop(tell);
            assert_eq!(after(2).await, Some(None));
        });
    }
}
