//! What readers tell: where the film is, in observations; and what a person should know beside that, in notes.

use std::io;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Serialize;

use crate::app::player::FilmGate;
use crate::film::labels::LabelClock;
use crate::film::observation::{FilmWord, Observation};
use crate::film::source::FilmArgs;
use crate::film::timecode::Timecode;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

/// From the end of a writer or a player to the next look for one.
pub(super) const AGAIN: Duration = Duration::from_secs(1);

/// What is noted of a source beside where its film is.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct SourceNotes {
    /// Why it is not read at present.
    pub(crate) trouble: Option<String>,
    /// Why its labels, or its sound, are none that can be used.
    pub(crate) refused: Option<String>,
    /// Frames a second, as configured or found.
    pub(crate) fps: Option<String>,
    /// The label of the film's time 0, once it is known how frames are labelled.
    #[serde(skip)]
    pub(crate) start: Option<Timecode>,
    /// Who else sends what this source is to send, the first of them, and how often others did.
    pub(crate) foreign_from: Option<Ipv4Addr>,
    pub(crate) foreign: u64,
    /// Datagrams, requests or lines that said nothing.
    pub(crate) garbage: u64,
    /// How loud the line is, dB of full scale.
    pub(crate) level_db: Option<f64>,
    /// The film that a player has open, or that is heard.
    pub(crate) film: Option<String>,
    /// How far the player's picture is from its sound, milliseconds.
    pub(crate) avsync_ms: Option<f64>,
    /// How far off the system's clock may be by its own account, milliseconds.
    pub(crate) clock_error_ms: Option<f64>,
    /// How often the system's clock was set, which a film that runs does not follow.
    pub(crate) clock_steps: u64,
}

impl SourceNotes {
    /// Those of a source of which nothing was heard.
    pub(super) fn shared(args: &FilmArgs) -> Notes {
        let fps = args.rate.map(|rate| rate.to_string());
        Arc::new(Mutex::new(Self { fps, ..Self::default() }))
    }

    pub(super) fn label(&mut self, labels: &LabelClock) {
        self.refused = labels.refused().map(ToString::to_string);
        self.fps = labels.rate().map(|rate| rate.to_string());
        self.start = labels.start();
    }
}

/// The notes of one source, shared.
pub(super) type Notes = Arc<Mutex<SourceNotes>>;

pub(super) fn noted(notes: &Notes) -> MutexGuard<'_, SourceNotes> {
    notes.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where a reader's words go.
#[derive(Debug, Clone)]
pub(super) struct WordSink {
    /// Its place in the ranking.
    pub(super) place: usize,
    pub(super) to: SyncSender<(usize, Observation)>,
    pub(super) notes: Notes,
    /// Nobody listens any more.
    pub(super) over: Arc<AtomicBool>,
    /// Which of its films counts, where not all do.
    pub(super) gate: Option<FilmGate>,
}

impl WordSink {
    /// Tells of the film; false once nobody listens.
    pub(super) fn tell(&self, what: Observation) -> bool {
        !self.is_over() && self.to.send((self.place, what)).is_ok()
    }

    /// Whoever wrote is gone, as `read` says, and another may come, which is waited for; false once nobody listens.
    pub(super) fn again(&self, read: io::Result<()>) -> bool {
        self.note(|notes| notes.trouble = read.err().map(|error| error.to_string()));
        self.tell(Observation::new(Monotonic.now(), FilmWord::Gone)) && self.waits()
    }

    /// Waits until it is time for another look; false if nobody listens any more by then.
    pub(super) fn waits(&self) -> bool {
        Monotonic.sleep_until(Monotonic.now() + AGAIN);
        !self.is_over()
    }

    /// Notes something for people.
    pub(super) fn note(&self, what: impl FnOnce(&mut SourceNotes)) {
        what(&mut noted(&self.notes));
    }

    /// True if that is the one sender who is heard, as `named`. Of others the first is noted: names may be made up at any pace.
    pub(super) fn hears(&self, named: Ipv4Addr, from: IpAddr) -> bool {
        if let IpAddr::V4(other) = from
            && other != named
        {
            self.note(|notes| {
                notes.foreign += 1;
                notes.foreign_from.get_or_insert(other);
            });
        }
        from == named
    }

    pub(super) fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }
}
