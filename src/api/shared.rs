//! What all handlers share.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use axum::extract::Request;
use hyper::body::Bytes;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

use super::Pages;
use super::access::Access;
use super::fleet_access::FleetAccess;
use super::once::Once;
use super::problem::panicked;
use super::streams::Streams;
use super::tries::Tries;
use crate::control::{Code, Handle, Problem, Status};
use crate::library::{Awaited, Library};
use crate::log::Log;
use crate::playlist::Shelf;
use crate::sys::clock::Monotonic;
use crate::sys::lock::lock;
use crate::time::{Clock as _, MonoTime};

/// How long the tick counter may stand still in a process that is well.
const STILL: Duration = Duration::from_secs(2);
/// How long somebody waits for their turn at what is done for one at a time.
const TURN: Duration = Duration::from_secs(5);
/// What waits for a disk at the most.
const ERRANDS: usize = 32;

/// What all handlers share. None of it is held while somebody waits.
pub(super) struct Shared {
    /// The way to the hall.
    pub(super) handle: Handle,
    /// Who may come in over TCP.
    pub(super) access: Access,
    /// Who of the fleet may ask.
    pub(super) fleet: FleetAccess,
    /// Why what the fleet wishes could not be done when that was tried last.
    pub(super) fleet_failed: Mutex<BTreeMap<String, Problem>>,
    /// Held by whoever does what the fleet wishes. Nobody waits for it.
    pub(super) fleet_settling: Mutex<()>,
    /// Held by whoever takes a wish, or tells what the hall has of it: whatever is in it, the others have the rest of the threads.
    pub(super) wishes: Arc<Semaphore>,
    /// Wrong tokens.
    pub(super) tries: Tries,
    /// Requests that may come twice.
    pub(super) once: Once,
    /// Room for those who are pushed to.
    pub(super) streams: Streams,
    /// Room for what waits for a disk.
    pub(super) errands: Arc<Semaphore>,
    /// Held by the report that is being read and sent.
    pub(super) reports: Arc<Semaphore>,
    /// Held by whoever has a recording drawn: that takes longer than a curve, which is asked for on each page.
    pub(super) pictures: Arc<Semaphore>,
    /// Held by whoever has a curve drawn.
    pub(super) curves: Arc<Semaphore>,
    /// True if the server ends.
    pub(super) closing: watch::Receiver<bool>,
    /// The description of all this, JSON.
    pub(super) document: Bytes,
    /// The cues.
    pub(super) library: Library,
    /// The playlists.
    pub(super) shelf: Shelf,
    /// The folder of the journal.
    pub(super) journal: PathBuf,
    /// The folder of recordings.
    pub(super) recordings: PathBuf,
    /// The console.
    pub(super) pages: Pages,
    /// Where it is said who was turned away.
    pub(super) log: Log,
    /// True if the tick thread ticks.
    pub(super) pulse: Pulse,
    /// The newest status that was written, and its JSON.
    pub(super) written: Mutex<Option<(Arc<Status>, Bytes)>>,
}

/// Tells those who work at a request whether whoever sent it is still there.
#[derive(Debug, Clone)]
pub(super) struct StillAsked(watch::Receiver<()>);

impl StillAsked {
    /// It is asked until the other end is dropped.
    pub(super) fn new() -> (watch::Sender<()>, Self) {
        let (here, asked) = watch::channel(());
        (here, Self(asked))
    }

    /// Whether whoever sent a request is still there.
    pub(super) fn of(request: &Request) -> Self {
        request.extensions().get::<Self>().expect("each request has passed the gate").clone()
    }
}

/// Room for what waits for a disk.
pub(super) fn errands() -> Arc<Semaphore> {
    Arc::new(Semaphore::new(ERRANDS))
}

/// Room for one, so that many who ask for much take no more than one does.
pub(super) fn one_at_a_time() -> Arc<Semaphore> {
    Arc::new(Semaphore::new(1))
}

/// A turn at what is done for one at a time.
pub(super) async fn turn(of: &Arc<Semaphore>, what: &str) -> Result<OwnedSemaphorePermit, Problem> {
    let turn = tokio::time::timeout(TURN, Arc::clone(of).acquire_owned()).await;
    turn.ok().and_then(Result::ok).ok_or_else(|| {
        let detail = format!("{what} is already being made for another request");
        Problem::new(Code::Busy, detail, "try again in a few seconds")
    })
}

impl Shared {
    /// Does what waits for a disk, on a thread for that.
    pub(super) async fn blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let Ok(place) = Arc::clone(&self.errands).try_acquire_owned() else {
            let detail = format!("{ERRANDS} requests already wait for a disk");
            return Err(Problem::new(Code::Busy, detail, "try again in a second"));
        };
        let done = tokio::task::spawn_blocking(move || {
            let _place = place; // held until it is done, also where nobody waits for it any more
            work()
        });
        done.await.unwrap_or_else(|_| Err(panicked()))
    }

    /// The same of what a process of its own does, which is ended once whoever asked has gone away.
    pub(super) async fn awaiting<T: Send + 'static>(
        &self,
        mut asked: StillAsked,
        work: impl FnOnce(&Awaited) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let (waits, awaited) = Awaited::pair().map_err(|error| {
            let detail = format!("cannot wait for a process: {error}");
            Problem::new(Code::File, detail, "check the service's limit of open files")
        })?;
        let done = self.blocking(move || work(&awaited));
        tokio::pin!(done);
        tokio::select! {
            done = &mut done => return done,
            _ = asked.0.changed() => drop(waits),
        }
        done.await
    }

    /// A status as JSON. Of many who ask for the same one it is written once.
    pub(super) fn write(&self, status: &Arc<Status>) -> Bytes {
        let mut written = lock(&self.written);
        if let Some((same, json)) = written.as_ref()
            && Arc::ptr_eq(same, status)
        {
            return json.clone();
        }
        let json = serde_json::to_vec(&**status).expect("a status is text and numbers");
        let json = Bytes::from(json);
        *written = Some((Arc::clone(status), json.clone()));
        json
    }
}

/// When the tick counter last moved.
#[derive(Debug, Default)]
pub(super) struct Pulse {
    ticks: AtomicU64,
    moved_ns: AtomicU64,
}

impl Pulse {
    /// Takes note of the tick counter.
    pub(super) fn note(&self, ticks: u64, now: MonoTime) {
        if self.ticks.swap(ticks, Ordering::Relaxed) != ticks {
            self.moved_ns.store(now.as_nanos(), Ordering::Relaxed);
        }
    }

    /// True if it has moved of late.
    pub(super) fn beats(&self, now: MonoTime) -> bool {
        self.still(now) < STILL
    }

    /// For how long a counter that has moved before stands still; `None` if that is not long.
    pub(super) fn stopped(&self, now: MonoTime) -> Option<Duration> {
        let has_moved = self.moved_ns.load(Ordering::Relaxed) > 0;
        Some(self.still(now)).filter(|still| has_moved && *still >= STILL)
    }

    fn still(&self, now: MonoTime) -> Duration {
        now.since(MonoTime::from_nanos(self.moved_ns.load(Ordering::Relaxed)))
    }

    /// Notes every new status until there are none any more.
    pub(super) async fn follow(shared: Arc<Shared>) {
        let mut statuses = shared.handle.watch();
        loop {
            let ticks = statuses.borrow_and_update().ticks;
            shared.pulse.note(ticks, Monotonic.now());
            if statuses.changed().await.is_err() {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_is_a_counter_that_moves() {
        let at = |seconds| MonoTime::from_nanos(0) + Duration::from_secs(seconds);
        let pulse = Pulse::default();
        assert!(!pulse.beats(at(100)) && pulse.stopped(at(100)).is_none(), "before the first tick");
        pulse.note(7, at(100));
        pulse.note(7, at(101));
        assert!(pulse.beats(at(101)) && pulse.stopped(at(101)).is_none());
        assert!(!pulse.beats(at(102)), "the status is new, and the counter in it is not");
        assert_eq!(pulse.stopped(at(103)), Some(Duration::from_secs(3)));
    }
}
