//! The film that a show chases: its source is read on threads of their own, and where the film is by it is published for the tick
//! thread. A source that fails leads nobody; the threads end with the program, or with what they read.

mod ltc;
mod mpv;
mod riff;
mod sound;
mod source;

use std::io;
use std::process::Child;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

pub(crate) use sound::{LtcFound, LtcSound, SAMPLES_PER_S, look_for_ltc, wav_header};
pub(crate) use source::{FilmArgs, FilmSource};

use crate::film::follower::PaceLimits;
use crate::film::observation::Observation;
use crate::film::point::PublishedPoint;
use crate::film::tracker::SourceTracker;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// How often where the film is is published, whatever is heard.
const PUBLISH_EVERY: Duration = Duration::from_millis(50);
/// Observations that wait at the most: seconds of a source that tells a hundred a second.
const WAITING: usize = 512;

/// Why a source is not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum FilmError {
    /// A file, a FIFO or a socket does not open.
    #[error("{what} cannot be opened")]
    Open {
        /// Which, as it was named.
        what: String,
        /// Why.
        source: io::Error,
    },
    /// A command does not start.
    #[error("`{command}` cannot be started; see that it is installed")]
    Command {
        /// Which.
        command: String,
        /// Why.
        source: io::Error,
    },
    /// The system starts no further thread.
    #[error("no thread could be started; allow more with `ulimit -u`")]
    Thread(#[from] io::Error),
}

/// A source that is being read.
#[derive(Debug)]
pub(crate) struct FilmReader {
    point: Arc<PublishedPoint>,
    /// The command that gives the sound.
    child: Arc<Mutex<Option<Child>>>,
}

impl FilmReader {
    /// Begins to read a source.
    ///
    /// # Errors
    /// [`FilmError`] where it cannot be had at all. One that ends later is looked for again.
    pub(crate) fn start(args: &FilmArgs) -> Result<Self, FilmError> {
        let point = Arc::new(PublishedPoint::default());
        let (told, heard) = sync_channel(WAITING);
        let published = Arc::clone(&point);
        let kind = args.source.kind();
        let band = PaceLimits::default().band;
        start("film", move || track(&published, SourceTracker::new(kind, band, Monotonic.now()), &heard))?;
        let child = Arc::default();
        match &args.source {
            FilmSource::Ltc(input) => ltc::start_reading(input, args, told, &child)?,
            FilmSource::Mpv(socket) => mpv::start_reading(socket, args.begin(), told)?,
        }
        Ok(Self { point, child })
    }

    /// Where the film is, for whoever follows it.
    #[must_use]
    pub(crate) fn point(&self) -> Arc<PublishedPoint> {
        Arc::clone(&self.point)
    }
}

impl Drop for FilmReader {
    fn drop(&mut self) {
        if let Some(mut child) = ltc::lock(&self.child).take() {
            // One that has ended by itself cannot be ended any more.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn start(name: &str, run: impl FnOnce() + Send + 'static) -> io::Result<()> {
    thread::Builder::new().name(name.to_owned()).spawn(run).map(drop)
}

/// Makes of observations where the film is, until nobody can tell any more: then the newest point grows stale.
fn track(point: &PublishedPoint, mut tracker: SourceTracker, heard: &Receiver<Observation>) {
    loop {
        match heard.recv_timeout(PUBLISH_EVERY) {
            Ok(told) => tracker.hear(&told),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        let now = Monotonic.now();
        tracker.poll(now);
        point.publish(&tracker.point(now));
    }
}

/// Where a reader's observations go.
type Told = SyncSender<Observation>;
