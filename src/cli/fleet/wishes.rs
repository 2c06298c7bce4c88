//! What a hall shall have: its wish from the engine to the hall, which alone decides, and the files of that from the engine to the hall,
//! while it is parked and unarmed. What came of it, as the hall says, goes back to the engine.
//!
//! The wish is looked up, not listened for: a listener may hear nothing more after the engine was restarted, and who looks up needs no
//! right that could be turned against others.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::mem;
use std::ops::Range;
use std::path::PathBuf;
use std::pin::pin;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use async_nats::jetstream::context::Context;
use futures_util::{StreamExt as _, stream};
use hyper::body::Bytes;
use tokio::sync::watch;
use tokio::task::spawn_blocking;
use tokio::time::sleep;

use super::engine;
use super::hall::Link;
use super::part::{CuePart, sweep};
use crate::cli::client::{FileBody, ServiceProblem};
use crate::fleet::{self, BriefStatus, HadState, HaveReport, WishHad, WishedCue};
use crate::state::State;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// Messages of the engine that are asked for at a time.
const BATCH: u64 = 8;
const BATCH_PLACES: usize = 8;
/// How long eight of them may take, over a line of 1 Mbit/s and with others beside it.
const PATIENT: Duration = Duration::from_secs(60);
/// How often it is looked whether the engine is there meanwhile.
const LOOK: Duration = Duration::from_millis(100);
/// How often the hall is asked, and the engine told, where nothing changes.
const KEEP: Duration = Duration::from_secs(60);
/// How often it is told how much of a cue was fetched, at the most.
const TELL: Duration = Duration::from_millis(500);
/// How long the hall may take to prove a cue, behind another one.
const PROVED: Duration = Duration::from_secs(900);
/// How long a cue waits that could not come for a reason which may pass.
const LATER: Duration = Duration::from_secs(60);
const MUCH_LATER: Duration = Duration::from_secs(3600);
/// What is sent at the most, bytes: an engine takes 1 MiB.
const LONGEST: usize = 512 << 10;

/// What the engine has as a wish, and the number of that message.
type Shown = (u64, Bytes);
type Told = watch::Receiver<Option<BriefStatus>>;

/// Keeps a hall's library as it is wished.
pub(super) struct WishKeeper<'l> {
    link: &'l Link,
    kept: Context,
    /// The same for what takes long.
    patient: Context,
    folder: PathBuf,
    told: Told,
    /// What was asked of the hall last, when, in which state that was, and what it said.
    asked: Option<(Option<Shown>, MonoTime, String, HaveReport)>,
    /// What the engine was told last.
    sent: Option<(HaveReport, MonoTime)>,
    /// Why a file, by its digest, is not tried again until then.
    later: BTreeMap<String, (MonoTime, HadState, String)>,
    /// How often the engine was reached.
    connects: u64,
}

/// What came of fetching a cue.
enum Fetched {
    /// It is all there, and the right file.
    Whole(CuePart),
    /// The hall does not rest any more.
    Later,
    /// Something came, or it is put off: there may be more to do at once.
    Again,
}

/// The engine does not have a part of a cue.
#[derive(Debug, thiserror::Error)]
#[error("the engine does not have all of its file; push it again")]
struct Lacking;

impl<'l> WishKeeper<'l> {
    pub(super) fn new(link: &'l Link, folder: PathBuf, told: Told) -> Self {
        Self {
            link,
            kept: engine::kept(&link.client),
            patient: engine::kept_within(&link.client, PATIENT),
            folder,
            told,
            asked: None,
            sent: None,
            later: BTreeMap::new(),
            connects: 0,
        }
    }

    /// Does what is next; says if there may be more at once.
    ///
    /// # Errors
    /// Where engine or hall do not answer; what is here of a cue stays, and the next call goes on.
    pub(super) async fn step(&mut self) -> anyhow::Result<bool> {
        if !self.link.is_connected() {
            sleep(LOOK).await;
            return Ok(true);
        }
        let connects = self.link.connects();
        if mem::replace(&mut self.connects, connects) != connects {
            self.sent = None;
        }
        let want = engine::last_value(&self.kept, fleet::WANT, &self.link.hall).await?;
        let report = self.ask(want.map(|message| (message.sequence, message.payload))).await?;
        let now = Monotonic.now();
        self.later.retain(|_, (until, ..)| *until > now);
        let is_next = |(_, had): &(&String, &WishHad)| {
            had.state == HadState::Missing && !self.later.contains_key(&had.sha256)
        };
        let next = report
            .cues
            .iter()
            .find(is_next)
            .map(|(id, had)| (id.clone(), WishedCue { sha256: had.sha256.clone(), bytes: had.bytes }));
        match next {
            Some((id, cue)) => self.bring(&report, &id, &cue).await,
            None => {
                self.tell(&report, None).await?;
                let waits = |digest: &str| {
                    let unsettled = |had: &WishHad| !had.is_settled() && had.sha256 == digest;
                    report.cues.values().any(unsettled)
                };
                sweep(&self.folder, waits);
                Ok(false)
            }
        }
    }

    fn is_parked(&self) -> bool {
        is_parked(&self.told.borrow())
    }

    /// What the hall has of what the engine has as its wish, or else of the wish that it keeps.
    async fn ask(&mut self, want: Option<Shown>) -> anyhow::Result<HaveReport> {
        let now = Monotonic.now();
        let state = self.told.borrow().as_ref().map(|status| status.state.to_string()).unwrap_or_default();
        if let Some((before, at, state_before, report)) = &self.asked {
            // A hall that plays is left alone, and so is one that has all.
            let is_settled = !self.is_parked() || all_had(report).all(WishHad::is_settled);
            if *before == want && *state_before == state && is_settled && now.since(*at) < KEEP {
                return Ok(report.clone());
            }
            if *before != want {
                self.later.clear();
            }
        }
        let refused = match &want {
            Some((_, wish)) => {
                let reply = self.link.put("/api/v1/fleet/wish", wish.clone().into()).await?;
                match reply.status {
                    200 => None,
                    400..=428 => Some(ServiceProblem::of(&reply.text).line()),
                    status => anyhow::bail!("the hall replied {status}: {}", reply.text),
                }
            }
            None => None,
        };
        let mut report: HaveReport = self.link.look_up("/api/v1/fleet/wish").await?;
        report.refused = refused;
        report.seen = want.as_ref().map_or(0, |(seq, _)| *seq);
        self.asked = Some((want, now, state, report.clone()));
        Ok(report)
    }

    /// Fetches a cue and hands it to the hall; says if it went so far as to be tried.
    async fn bring(&mut self, report: &HaveReport, id: &str, cue: &WishedCue) -> anyhow::Result<bool> {
        let part = match self.fetch(report, id, cue).await? {
            Fetched::Whole(part) => part,
            Fetched::Later => return Ok(false),
            Fetched::Again => return Ok(true),
        };
        let body = match FileBody::open(part.path()) {
            Ok(body) => body,
            Err(error) => {
                self.no_place(cue, &error);
                return Ok(true);
            }
        };
        let link = self.link;
        let path = format!("/api/v1/fleet/cues/{id}");
        let given = link.give(&path, body, PROVED);
        let mut told = self.told.clone();
        let reply = tokio::select! {
            reply = given => reply?,
            // Whoever hangs up has the proof ended: nothing goes on beside people who get ready for a show.
            _ = told.wait_for(|status| !is_parked(status)) => return Ok(false),
        };
        self.asked = None;
        let says = ServiceProblem::of(&reply.text);
        match reply.status {
            200 => remove(part),
            // The hall has noted why, and says so.
            422 if !says.faults.is_empty() => remove(part),
            409 => return Ok(false),
            // Its proof takes more than the hall gives it: not to be tried all day.
            422 => self.put_off(cue, HadState::Refused, says.line(), MUCH_LATER),
            _ => self.put_off(cue, HadState::Waiting, says.line(), LATER),
        }
        Ok(true)
    }

    /// Fetches what is missing of a cue.
    async fn fetch(&mut self, report: &HaveReport, id: &str, cue: &WishedCue) -> anyhow::Result<Fetched> {
        let (folder, of_part) = (self.folder.clone(), cue.clone());
        let opened = spawn_blocking(move || CuePart::open(&folder, &of_part)).await?;
        let mut part = match opened {
            Ok(part) => part,
            Err(error) => return Ok(self.no_place(cue, &error)),
        };
        let mut told_at = None;
        while !part.next(BATCH).is_empty() {
            if !self.is_parked() {
                return Ok(Fetched::Later);
            }
            let now = Monotonic.now();
            if told_at.is_none_or(|at| now.since(at) >= TELL) {
                self.tell(report, Some((id, part.percent()))).await?;
                told_at = Some(now);
            }
            let (pieces, end) = self.pieces(cue, part.next(BATCH)).await;
            let came = !pieces.is_empty();
            let added = spawn_blocking(move || part.add(&pieces).map(|()| part)).await?;
            part = match added {
                Err(error) if error.kind() == ErrorKind::InvalidData => return Ok(self.damaged(cue)),
                Err(error) => return Ok(self.no_place(cue, &error)),
                Ok(part) => part,
            };
            match end {
                Ok(()) => {}
                Err(why) if why.is::<Lacking>() => {
                    self.put_off(cue, HadState::Waiting, why.to_string(), LATER);
                    return Ok(Fetched::Again);
                }
                Err(_) if came => return Ok(Fetched::Again),
                Err(why) => return Err(why),
            }
        }
        self.tell(report, Some((id, 100))).await?;
        let read = spawn_blocking(move || part.is_right().map(|right| (right, part))).await?;
        match read {
            Ok((true, part)) => Ok(Fetched::Whole(part)),
            Ok((false, part)) => {
                remove(part);
                Ok(self.damaged(cue))
            }
            Err(error) => Ok(self.no_place(cue, &error)),
        }
    }

    /// Messages of a cue in their order, as far as they come; why the next one did not.
    async fn pieces(&self, cue: &WishedCue, numbers: Range<u64>) -> (Vec<Bytes>, anyhow::Result<()>) {
        let piece = |n: u64| async move {
            let subject = fleet::chunk_of(&cue.sha256, &n.to_string());
            let message = engine::last_of(&self.patient, fleet::CUES, &subject).await?;
            anyhow::Ok(message.ok_or(Lacking)?.payload)
        };
        let mut coming = stream::iter(numbers).map(piece).buffered(BATCH_PLACES);
        let mut cut = pin!(self.cut());
        let mut pieces = Vec::new();
        loop {
            let next = tokio::select! {
                next = coming.next() => next,
                () = &mut cut => Some(Err(anyhow!("the engine is away"))),
            };
            match next {
                Some(Ok(piece)) => pieces.push(piece),
                Some(Err(why)) => return (pieces, Err(why)),
                None => return (pieces, Ok(())),
            }
        }
    }

    /// Returns when the engine is lost: what it was asked before is never answered.
    async fn cut(&self) {
        let connects = self.link.connects();
        while self.link.is_connected() && self.link.connects() == connects {
            sleep(LOOK).await;
        }
    }

    /// The folder of what is fetched takes a cue no further, which the desk is told as well.
    fn no_place(&mut self, cue: &WishedCue, error: &io::Error) -> Fetched {
        let folder = self.folder.display();
        let why =
            format!("its link has no place for cues in {folder}: {error}; make room there, or set --state");
        self.put_off(cue, HadState::Waiting, why, LATER);
        Fetched::Again
    }

    fn damaged(&mut self, cue: &WishedCue) -> Fetched {
        let why = format!(
            "the engine has another file under that digest; have whoever keeps it purge {}, and push again",
            fleet::chunk_of(&cue.sha256, "*")
        );
        self.put_off(cue, HadState::Refused, why, LATER);
        Fetched::Again
    }

    fn put_off(&mut self, cue: &WishedCue, state: HadState, why: String, time: Duration) {
        self.later.insert(cue.sha256.clone(), (Monotonic.now() + time, state, why));
    }

    /// Tells the engine what the hall has, where that is news, or was not told for a while.
    async fn tell(&mut self, report: &HaveReport, fetching: Option<(&str, u8)>) -> anyhow::Result<()> {
        let mut report = report.clone();
        for (id, had) in &mut report.cues {
            if let Some((_, state, why)) = self.later.get(&had.sha256).filter(|_| !had.is_settled()) {
                (had.state, had.why) = (*state, Some(why.clone()));
            }
            if let Some((_, percent)) = fetching.filter(|(fetched, _)| id == fetched) {
                (had.state, had.percent) = (HadState::Fetching, Some(percent));
            }
        }
        let now = Monotonic.now();
        let is_news = self.sent.as_ref().is_none_or(|(before, at)| {
            let same = HaveReport { at: before.at.clone(), ..report.clone() } == *before;
            !same || now.since(*at) >= KEEP
        });
        if is_news {
            let subject = engine::value_to(fleet::HAVE, &self.link.hall);
            let text = report.text_within(LONGEST);
            let sent = self.kept.publish(subject, text.into()).await.context("the engine takes no report")?;
            sent.await.context("the engine took no report of what the hall has")?;
            self.sent = Some((report, now));
        }
        Ok(())
    }
}

/// All that is wished.
fn all_had(report: &HaveReport) -> impl Iterator<Item = &WishHad> {
    let dropped = report.dropped_cues.values().chain(report.dropped_playlists.values());
    report.cues.values().chain(report.playlists.values()).chain(dropped)
}

fn is_parked(status: &Option<BriefStatus>) -> bool {
    status.as_ref().is_some_and(|status| status.state == State::Parked)
}

fn remove(part: CuePart) {
    let _ = part.remove(); // what is left is swept
}
