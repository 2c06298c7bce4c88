//! The journal: commands with operator and result, and the shows that were played. Records in, lines of JSON out,
//! and from them the report of a day. Written by a thread of its own, so that no disk, full or slow, holds up anybody.
//!
//! - **Files** are `kinocue-DATE-NNN.jsonl` for shows and `kinocue-asked-DATE-NNN.jsonl` for commands, one or more for
//!   each day, the day being that of the records' own times. A new one begins with a day and where one would grow over its
//!   limit; the oldest go by age and by the size of all of their kind, each of which has half of the room. By age at most two days go on
//!   one day, and only while the clock is synchronised.
//! - **Commands** are bounded in length, and repeats are folded, so that nobody can flush out what others did.
//! - **A line** is written by one write(2) with `O_APPEND`. Where a crash or a full disk has cut one, the next begins on a
//!   line of its own, and whoever reads passes the cut one over with a note.
//! - **On the disk**: the begin and the end of a show are synced before the next line is written; commands are left to
//!   the kernel, so that a power cut may lose the last half minute of it, and a crash of the program nothing.
//! - **Seals**: each line has the number of its place in the chain of its kind, the hash of the line before, and a signature by the key of
//!   the service, so that what is taken out, put in or altered is found (docs/proof-of-play.md).
//! - **Trouble**: a line that cannot be written is lost and counted, the cause is reported once, and the next line that can be
//!   written is preceded by how many were lost. Nothing waits, and nothing of the show depends on it.
//!
//! One folder belongs to one hall.

mod age;
mod chain;
mod files;
mod fold;
mod read;
mod record;
mod report;
mod seal;
mod tail;
#[cfg(test)]
mod tests;
mod told;
#[cfg(feature = "harness")]
mod tried;
mod writer;

pub(crate) use age::too_old;
pub(crate) use chain::{ChainFindings, JournalKeys};
pub(crate) use fold::{FoldedAction, Folds};
pub use record::{Action, FilmProof, Outcome, SeatOut, ShowRecord};
pub(crate) use record::{PlaylistPlace, stamp};
pub(crate) use report::{
    JournalError, JournalReport, ReportBounds, ReportShown, ShowResult, Totals, report, report_by, report_of,
};
pub(crate) use seal::{KEY, Sealer, is_journal_key, new_journal_key};
pub(crate) use tail::{JournalPart, LONGEST_TOLD, TOLD_AT_ONCE, TOLD_FILES, Told, tail};
pub(crate) use told::check_told;
#[cfg(feature = "harness")]
pub(crate) use tried::try_file;

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{self, SyncSender, TrySendError};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

use jiff::Zoned;
use jiff::civil::Date;

use crate::config::Log;
use crate::sys::lock::lock;
use crate::sys::machine;
use record::{Line, day_of};
use writer::{QueuedLine, Writer};

/// Lines that wait for the disk at the most; more are lost.
const WAITING: usize = 1024;

/// How much is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of one file, after which a new one begins.
    pub max_size: u64,
    /// Bytes of all files together.
    pub max_total: u64,
    /// Days that a file is kept.
    pub max_age_days: u32,
}

impl From<&Log> for Limits {
    fn from(log: &Log) -> Self {
        let bytes = |mib: u32| u64::from(mib) << 20;
        Self {
            max_size: bytes(log.max_size_mib),
            max_total: bytes(log.max_total_mib),
            max_age_days: log.max_age_days,
        }
    }
}

/// A journal that is being written. Dropped, it writes what still waits.
#[derive(Debug)]
pub struct Journal {
    to: Option<SyncSender<QueuedLine>>,
    thread: Option<JoinHandle<()>>,
    standing: Arc<Standing>,
    /// The day of lines whose time cannot be read.
    day: Date,
}

/// How the writing goes.
#[derive(Debug, Default)]
struct Standing {
    lost: AtomicU64,
    trouble: Mutex<Option<String>>,
    news: Mutex<Vec<String>>,
}

impl Journal {
    /// Opens the journal in `dir`, which is made where it is missing, and notes that the program has started. Cannot fail:
    /// what is wrong shows in [`Journal::trouble`].
    #[must_use]
    pub fn open(dir: &Path, limits: Limits, now: &Zoned) -> Self {
        Self::open_with(dir, limits, now, None)
    }

    /// The same with lines that are sealed.
    #[must_use]
    pub(crate) fn open_with(dir: &Path, limits: Limits, now: &Zoned, sealer: Option<Sealer>) -> Self {
        Self::open_by(dir, limits, now, sealer, machine::clock_is_synchronised)
    }

    fn open_by(
        dir: &Path,
        limits: Limits,
        now: &Zoned,
        sealer: Option<Sealer>,
        is_synchronised: fn() -> bool,
    ) -> Self {
        let standing = Arc::new(Standing::default());
        let (to, entries) = mpsc::sync_channel::<QueuedLine>(WAITING);
        let mut writer = Writer::new(dir, limits, sealer, is_synchronised);
        let of_thread = Arc::clone(&standing);
        let write = move || entries.iter().for_each(|entry| of_thread.write(&mut writer, &entry));
        let thread = thread::Builder::new().name("journal".to_owned()).spawn(write);
        let thread =
            thread.map_err(|error| standing.note(format!("the journal has no thread: {error}"))).ok();
        let journal = Self { to: Some(to), thread, standing, day: now.date() };
        let version = env!("CARGO_PKG_VERSION").to_owned();
        journal.put(&Line::Start { at: stamp(now), version }, true);
        journal
    }

    /// Notes what somebody asked and what came of it. Waits for nothing.
    pub fn note(&mut self, action: &Action) {
        self.put(&Line::Action(action.clone()), false);
    }

    /// Notes that a show begins; its outcome is not looked at. Waits for nothing.
    pub fn begin(&mut self, show: &ShowRecord) {
        self.put(&Line::Begin(Box::new(ShowRecord { outcome: None, ..show.clone() })), true);
    }

    /// Notes how a show that has begun ended: the same record with its outcome. Waits for nothing.
    pub fn show(&mut self, show: &ShowRecord) {
        self.put(&Line::Show(Box::new(show.shortened())), true);
    }

    /// Why lines cannot be written at present, and what to do; `None` if they can.
    #[must_use]
    pub(crate) fn trouble(&self) -> Option<String> {
        lock(&self.standing.trouble).clone()
    }

    /// Lines that were lost since the program started.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn lost(&self) -> u64 {
        self.standing.lost.load(Ordering::Relaxed)
    }

    /// What has become worse or better since this was last asked, a line each, for the log.
    pub(crate) fn news(&mut self) -> Vec<String> {
        std::mem::take(&mut lock(&self.standing.news))
    }

    fn put(&self, line: &Line, sync: bool) {
        let lose = |why| self.standing.lose(why);
        let Ok(mut text) = serde_json::to_vec(line) else { return lose("it has no words") };
        text.push(b'\n');
        let day = day_of(line.at()).unwrap_or(self.day);
        let entry = QueuedLine { day, at: line.at().to_owned(), text, kind: line.kind(), sync };
        match self.to.as_ref().map(|to| to.try_send(entry)) {
            Some(Ok(())) => {}
            Some(Err(TrySendError::Full(_))) => lose("the disk is too slow"),
            Some(Err(TrySendError::Disconnected(_))) | None => lose("its thread is gone"),
        }
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        self.to = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // what it could not write is counted
        }
    }
}

impl Standing {
    /// Writes a line, and before it how many were lost, if any were.
    fn write(&self, writer: &mut Writer, entry: &QueuedLine) {
        let troubled = lock(&self.trouble).is_some();
        let lines = self.lost.load(Ordering::Relaxed);
        let written = if troubled && lines > 0 {
            let gap = Line::Lost { at: entry.at.clone(), lines };
            let mut text = serde_json::to_vec(&gap).unwrap_or_default();
            text.push(b'\n');
            writer.append(&QueuedLine { text, ..entry.clone() }).and_then(|()| writer.append(entry))
        } else {
            writer.append(entry)
        };
        lock(&self.news).append(&mut writer.gone);
        match written {
            Ok(()) if troubled => {
                *lock(&self.trouble) = None;
                let words = format!("the journal is written again; {lines} lines were lost since the start");
                lock(&self.news).push(words);
            }
            Ok(()) => {}
            Err(error) => self.lose(&error.to_string()),
        }
    }

    fn lose(&self, why: &str) {
        self.lost.fetch_add(1, Ordering::Relaxed);
        self.note(format!(
            "the journal cannot be written: {why}; make room, or name another folder in [log]"
        ));
    }

    /// Notes trouble, once until it is over.
    fn note(&self, words: String) {
        let mut trouble = lock(&self.trouble);
        if trouble.is_none() {
            lock(&self.news).push(words.clone());
            *trouble = Some(words);
        }
    }
}
