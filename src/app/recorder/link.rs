//! The way to a recorder: what it is told, bounded and never waited for; and how it stands.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

use crate::control::RecordStatus;
use crate::record::{AskBudget, IncidentCause, MarkNote, Note, TooOften};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// Notes that wait at the most; more are lost, and counted. What begins and ends files, and what somebody marked, always finds a place:
/// there is little of it.
const WAITING: usize = 1_024;
/// A recorder that has not looked at its taps for so long waits for a disk, or for a turn, and cannot say so itself; the taps hold two
/// seconds.
const STILL: Duration = Duration::from_secs(3);

/// A show, or what else is recorded as one.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct ShowStart {
    /// `show`, `test` or `homing`.
    pub(crate) kind: &'static str,
    /// The id of the cue.
    pub(crate) cue: String,
    /// Its title.
    pub(crate) title: String,
    /// SHA-256 of its file.
    pub(crate) sha256: String,
    /// A copy of it that goes with the recording, where one is wanted.
    pub(crate) attached: Option<std::path::PathBuf>,
}

/// What of recordings can be in trouble.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RecordPart {
    /// The recording of a show, or the recorder on the whole.
    Show,
    /// That of an incident.
    Incident,
    /// The flight recorder.
    Flight,
    /// What an earlier program left.
    Earlier,
    /// The room for more.
    Room,
}

impl RecordPart {
    /// The word for it in the status.
    const fn word(self) -> &'static str {
        match self {
            Self::Show => "show",
            Self::Incident => "incident",
            Self::Flight => "flight",
            Self::Earlier => "earlier",
            Self::Room => "room",
        }
    }
}

/// What a recorder is told.
#[derive(Debug)]
pub(crate) enum RecordAsk {
    /// That is to be kept.
    Keep(Note),
    /// A show begins.
    Begin(ShowStart),
    /// It is over.
    End,
    /// What it came to, as JSON.
    Report(Vec<u8>),
    /// Something is worth an incident.
    Incident(IncidentCause),
    /// The hall has closed.
    Close,
}

/// A surface's end.
#[derive(Debug, Clone, Default)]
pub(crate) struct RecordLink {
    /// None where nobody records.
    asks: Option<Sender<(MonoTime, RecordAsk)>>,
    shared: Arc<SharedFigures>,
}

#[derive(Debug, Default)]
struct SharedFigures {
    dropped: AtomicU64,
    waiting: AtomicUsize,
    /// Octets that a second of a show takes, and for which there is room, what may go for them included; 0 where nothing is known.
    octets_a_s: AtomicU64,
    room: AtomicU64,
    /// When the recorder looked at its taps last, ns; 0 where none does.
    looked_at: AtomicU64,
    /// The folder of recordings.
    dir: OnceLock<PathBuf>,
    status: Mutex<RecordStatus>,
    /// For the log.
    said: Mutex<Vec<String>>,
    marks: Mutex<AskBudget>,
    dumps: Mutex<AskBudget>,
}

impl RecordLink {
    /// The way to a recorder, and its other end.
    pub(crate) fn new() -> (Self, Receiver<(MonoTime, RecordAsk)>) {
        let (asks, end) = channel();
        (Self { asks: Some(asks), shared: Arc::default() }, end)
    }

    /// Tells the recorder, of now; where it does not keep up that is lost and counted.
    pub(crate) fn put(&self, ask: RecordAsk) {
        self.put_of(Monotonic.now(), ask);
    }

    fn put_of(&self, at: MonoTime, ask: RecordAsk) {
        let Some(asks) = &self.asks else { return };
        let SharedFigures { dropped, waiting, .. } = &*self.shared;
        let may_be_lost = matches!(&ask, RecordAsk::Keep(note) if !matches!(note, Note::Mark(_)));
        let is_full = may_be_lost && waiting.load(Ordering::Relaxed) >= WAITING;
        waiting.fetch_add(usize::from(!is_full), Ordering::Relaxed);
        if is_full || asks.send((at, ask)).is_err() {
            dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The recorder has taken so much of what waited.
    pub(super) fn took(&self, count: usize) {
        self.shared.waiting.fetch_sub(count, Ordering::Relaxed);
    }

    /// Has that kept.
    pub(crate) fn keep(&self, note: Note) {
        self.put(RecordAsk::Keep(note));
    }

    /// The same of what was a little before now.
    pub(crate) fn keep_of(&self, at: MonoTime, note: Note) {
        self.put_of(at, RecordAsk::Keep(note));
    }

    /// Has a moment marked.
    ///
    /// # Errors
    /// Why it is one too many; the recorder says how many there were.
    pub(crate) fn mark(&self, note: MarkNote, now: MonoTime) -> Result<(), TooOften> {
        let taken = self.shared.marks.lock().unwrap_or_else(PoisonError::into_inner).take(now);
        match taken {
            Ok(()) => self.keep(Note::Mark(note)),
            Err(_) => self.tell(|status| status.more_marks += 1),
        }
        taken
    }

    /// Has what the flight recorder holds written out.
    ///
    /// # Errors
    /// Why that was asked once too often.
    pub(crate) fn dump(&self, now: MonoTime) -> Result<(), TooOften> {
        self.shared.dumps.lock().unwrap_or_else(PoisonError::into_inner).take(now)?;
        self.put(RecordAsk::Incident(IncidentCause::Dump));
        Ok(())
    }

    /// Marks that were not kept since this was asked last.
    pub(super) fn take_more_marks(&self) -> u64 {
        self.shared.marks.lock().unwrap_or_else(PoisonError::into_inner).take_more()
    }

    /// How it stands, by its own words.
    pub(super) fn status(&self) -> RecordStatus {
        let mut status = self.shared.status.lock().unwrap_or_else(PoisonError::into_inner).clone();
        status.dropped_notes = self.shared.dropped.load(Ordering::Relaxed);
        status
    }

    /// How it stands now: also that it waits for a disk, which it cannot say itself.
    pub(crate) fn status_at(&self, now: MonoTime) -> RecordStatus {
        let mut status = self.status();
        let looked_at = self.shared.looked_at.load(Ordering::Relaxed);
        if looked_at > 0 && now.since(MonoTime::from_nanos(looked_at)) >= STILL {
            let dir = self.dir().display().to_string();
            let trouble = format!(
                "nothing is recorded: {dir}: the disk answers no write, or other programs take all processors; look at that disk, or set \
                 [record] dir to a folder on another; the show goes on, and so does the recording once it can"
            );
            status.troubles.insert(RecordPart::Show.word().to_owned(), trouble);
        }
        status
    }

    /// The folder of recordings.
    pub(super) fn dir(&self) -> PathBuf {
        self.shared.dir.get().cloned().unwrap_or_default()
    }

    /// The recorder writes there, and begins to look.
    pub(super) fn begins(&self, dir: &Path, now: MonoTime) {
        let _ = self.shared.dir.set(dir.to_owned());
        self.looks(now);
    }

    /// It looks at its taps; that the last time was long ago counts as an error.
    pub(super) fn looks(&self, now: MonoTime) {
        let before = self.shared.looked_at.swap(now.as_nanos(), Ordering::Relaxed);
        if before > 0 && now.since(MonoTime::from_nanos(before)) >= STILL {
            self.tell(|status| status.errors += 1);
        }
    }

    /// It looks no more.
    pub(super) fn ends(&self) {
        self.shared.looked_at.store(0, Ordering::Relaxed);
    }

    /// A second of a show takes so much.
    pub(in crate::app) fn takes(&self, octets_a_s: u64) {
        self.shared.octets_a_s.store(octets_a_s, Ordering::Relaxed);
    }

    /// So much may be recorded yet.
    pub(in crate::app) fn has_room(&self, octets: u64) {
        self.shared.room.store(octets, Ordering::Relaxed);
    }

    /// Octets that a show of so many seconds takes, and those for which there is room, where these are fewer.
    pub(crate) fn lacks(&self, length_s: f64) -> Option<(u64, u64)> {
        let [octets_a_s, room] =
            [&self.shared.octets_a_s, &self.shared.room].map(|one| one.load(Ordering::Relaxed));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cue is some hours")]
        let needs = octets_a_s.saturating_mul(length_s.max(0.0).ceil() as u64);
        // Before the first look at the disk nothing is known.
        (self.asks.is_some() && room > 0 && needs > room).then_some((needs, room))
    }

    /// There is a flight recorder.
    #[cfg(test)]
    pub(in crate::app) fn flies(&self) {
        self.tell(|status| status.flight_s = 60.0);
    }

    /// Changes how it stands.
    pub(super) fn tell(&self, change: impl FnOnce(&mut RecordStatus)) {
        change(&mut self.shared.status.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Has a line for the log.
    pub(super) fn say(&self, line: String) {
        self.shared.said.lock().unwrap_or_else(PoisonError::into_inner).push(line);
    }

    /// Takes the lines that are to be logged.
    pub(crate) fn take_said(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.said.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Counts an incident.
    pub(super) fn count(&self, cause: IncidentCause) {
        self.tell(|status| *status.incidents.entry(cause.word().to_owned()).or_default() += 1);
    }

    /// Says what is wrong with a part; none for nothing.
    pub(super) fn trouble(&self, part: RecordPart, trouble: Option<String>) {
        self.tell(|status| {
            status.errors +=
                u64::from(trouble.is_some() && status.troubles.get(part.word()) != trouble.as_ref());
            match trouble {
                Some(trouble) => status.troubles.insert(part.word().to_owned(), trouble),
                None => status.troubles.remove(part.word()),
            };
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{EventNote, HallNote};

    #[test]
    fn what_begins_and_ends_a_file_and_what_is_marked_finds_a_place_however_many_notes_wait() {
        let (link, asks) = RecordLink::new();
        let seats = 2 * WAITING;
        for _ in 0..seats {
            link.keep(Note::Event(EventNote { kind: "standing", seat: String::new(), text: String::new() }));
        }
        let mark = MarkNote { film_s: 0.0, text: String::new(), who: String::new() };
        assert_eq!(link.mark(mark, Monotonic.now()), Ok(()));
        link.put(RecordAsk::Incident(IncidentCause::EmergencyStop));
        link.put(RecordAsk::End);
        link.put(RecordAsk::Close);
        let told: Vec<_> = asks.try_iter().map(|(_, ask)| ask).collect();
        assert_eq!((told.len(), usize::try_from(link.status().dropped_notes)), (WAITING + 4, Ok(WAITING)));
        assert!(
            matches!(told.last_chunk(), Some([RecordAsk::Incident(_), RecordAsk::End, RecordAsk::Close])),
            "in the order in which they were told"
        );
        link.took(told.len());
        link.keep(Note::Hall(HallNote::default()));
        assert_eq!(asks.try_iter().count(), 1, "there is room again");
    }
}
