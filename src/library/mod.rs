//! The cue library: a folder of checked cues. Ids in; cues, what is known of them, and uploads out. Control plane; every call
//! may read or write files, and those that say so block for longer.
//!
//! A cue named `x` is the file `x.csv` or `x.mcap`, a regular one; of two the newer counts. What comes from outside is
//! checked and proved in a process of its own, of the lowest priority and with limits on memory, time and files, before it
//! gets that name. The library's verdict is for people and playlists: a cue is proved again before it is played.

mod brought;
mod brought_files;
mod child;
mod curve;
mod hashed;
mod id;
mod index;
mod info;
mod part;
mod sketch;
mod upload;

pub(crate) use brought::{StandingOfCue, theirs};
pub(crate) use brought_files::{BroughtFiles, LeftThere};
pub use child::Awaited;
pub(crate) use curve::{CurveData, Drawing, MAX_POINTS, draw, needs_hall};
pub(crate) use hashed::Hashed;
pub(crate) use id::{CueId, Id, IdError};
pub(crate) use info::Verdict;
pub use info::{CueInfo, Proved};
pub(crate) use sketch::{RecordingPicture, Sketch};
pub(crate) use upload::Upload;

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use serde::de::DeserializeOwned;
use sha2::{Digest as _, Sha256};

use crate::config::MAX_FILE_LEN;
use crate::config::{self, Config, Store};
use crate::control::{Code, Problem};
use crate::cue::{self, Source, limits};
use crate::sys::file;
use crate::sys::folder::{Folder, Stamp};
use crate::sys::lock::lock;
use crate::timeline::Timeline;
use brought::Brought;
use index::Index;

/// A CSV file of so many bytes is read by whoever wants to play it, known or not; MCAP may unpack to more.
const SMALL: u64 = 16 << 20;
/// The most that is read of a file beside the cues, bytes.
const MAX_KEPT: u64 = 64 << 20;
/// Curves that are kept; a page asks for the same one again and again.
const CURVES: usize = 4;

/// The library cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("cannot open the cue library {}; set another in [show] library, or make it writable for the service", path.display())]
pub struct LibraryError {
    /// The folder.
    pub(crate) path: PathBuf,
    /// What the system said.
    pub(crate) source: io::Error,
}

/// What cues are checked for, by what, and within which bounds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hall {
    /// The configuration's file.
    pub config: PathBuf,
    /// The program that checks: kinocue.
    pub program: PathBuf,
    /// What a cue and its check may take.
    pub bounds: Bounds,
}

/// What a cue and its check may take.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bounds {
    /// The longest file that is taken in, bytes.
    pub max_bytes: u64,
    /// Memory of the checking process, MiB: what a cue may take once it is read.
    pub memory_mib: u64,
    /// Processor time of the checking process, and how long it is waited for.
    pub time: Duration,
}

impl Default for Bounds {
    /// Room for a cue of two hours and one axis at 1 kHz, or of twelve at 100 Hz; a proof of it takes seconds where nothing
    /// else runs. The service takes as much once it plays it, beside one that is loaded, and its unit has 2 GiB.
    fn default() -> Self {
        Self { max_bytes: 256 << 20, memory_mib: 768, time: Duration::from_secs(300) }
    }
}

impl Hall {
    /// The hall of that configuration file, with what its `[library]` says. Cues are checked by this very program, also where
    /// a newer one has taken its place on the disk since it was started.
    #[must_use]
    pub(crate) fn new(config: &Path, store: &Store) -> Self {
        let bounds = Bounds {
            max_bytes: u64::from(store.max_cue_mib) << 20,
            memory_mib: u64::from(store.max_memory_mib),
            ..Bounds::default()
        };
        Self { config: config.to_owned(), program: PathBuf::from("/proc/self/exe"), bounds }
    }

    /// What a proof holds for: this version of the program, and the configuration's file as it now is.
    fn fingerprint(&self) -> String {
        let hash = Sha256::new().chain_update(env!("CARGO_PKG_VERSION"));
        hex(&hash.chain_update(self.text()).finalize())
    }

    fn text(&self) -> Vec<u8> {
        file::read(&self.config, MAX_FILE_LEN).unwrap_or_default() // the check itself says that it cannot be read
    }
}

/// A library of cues. Clones share it; any thread.
#[derive(Debug, Clone)]
pub struct Library {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    dir: PathBuf,
    hall: Hall,
    index: Mutex<Index>,
    /// What a fleet brought; held while a cue is put into its place.
    brought: Mutex<Brought>,
    /// Held while a cue or a playlist is put into its place, or removed, as a fleet wishes.
    changing: Mutex<()>,
    /// Held while a cue is checked: one at a time.
    proving: Mutex<()>,
    /// Uploads that have begun.
    uploads: AtomicUsize,
    /// Numbers the uploads.
    serial: AtomicU64,
    curves: Mutex<Vec<Drawn>>,
}

/// A curve that was drawn before.
#[derive(Debug)]
struct Drawn {
    name: String,
    stamp: Stamp,
    points: usize,
    curve: Arc<CurveData>,
}

/// The file of a cue.
struct Cue {
    folder: Folder,
    name: String,
    file: File,
    stamp: Stamp,
}

impl Library {
    /// Opens the library in `dir`, which is made where it is missing, and removes what uploads left there in a crash. A folder that cannot
    /// be made, read or written is no reason to play nothing: [`Library::trouble`] has it.
    ///
    /// # Errors
    /// [`LibraryError`] where something else than a folder is there.
    pub fn open(dir: &Path, hall: Hall) -> Result<Self, LibraryError> {
        let open = || -> io::Result<(Index, Brought)> {
            fs::create_dir_all(dir)?;
            let folder = Folder::open(dir)?;
            for name in folder.names()?.iter().filter(|name| name.starts_with(upload::UNFINISHED)) {
                let _ = folder.remove_abandoned(name); // where nothing can be removed, nothing is uploaded either
            }
            Ok((Index::read(&folder), Brought::read(&folder)))
        };
        let is_other = fs::metadata(dir).is_ok_and(|found| !found.is_dir());
        let (index, brought) = match open() {
            Err(source) if is_other => return Err(LibraryError { path: dir.to_owned(), source }),
            opened => opened.unwrap_or_default(),
        };
        let inner = Inner {
            dir: dir.to_owned(),
            hall,
            index: Mutex::new(index),
            brought: Mutex::new(brought),
            changing: Mutex::new(()),
            proving: Mutex::new(()),
            uploads: AtomicUsize::new(0),
            serial: AtomicU64::new(0),
            curves: Mutex::new(Vec::new()),
        };
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Why it takes no cues, or has none, and what to do; `None` where it can be read and written.
    #[must_use]
    pub(crate) fn trouble(&self) -> Option<String> {
        let dir = &self.inner.dir;
        let written = || rustix::fs::access(dir, rustix::fs::Access::WRITE_OK);
        let cause = Folder::open(dir).and_then(|_| Ok(written()?)).err()?;
        let dir = dir.display();
        Some(format!(
            "the cue library {dir} takes no cues, and may have none: {cause}; set another in [show] library, or make it writable"
        ))
    }

    /// All cues by their ids, with what is known of them; reads none of them. Empty where the folder cannot be read.
    #[must_use]
    pub fn list(&self) -> Vec<CueInfo> {
        let print = self.inner.hall.fingerprint();
        self.ids().iter().filter_map(|id| self.info(id, &print)).collect()
    }

    fn ids(&self) -> BTreeSet<CueId> {
        let names = Folder::open(&self.inner.dir).and_then(|folder| folder.names()).unwrap_or_default();
        names.iter().filter_map(|name| id_of(name)).collect()
    }

    /// That there is no such cue.
    pub(crate) fn unknown(&self, id: &CueId) -> Problem {
        let ids: Vec<_> = self.ids().iter().map(ToString::to_string).collect();
        let remedy = "upload it, or give another of the library";
        Problem::unknown("cue", &id.to_string(), ids.iter().map(String::as_str), remedy)
    }

    /// What is known of a cue; reads it not.
    #[must_use]
    pub fn get(&self, id: &CueId) -> Option<CueInfo> {
        self.info(id, &self.inner.hall.fingerprint())
    }

    fn info(&self, id: &CueId, print: &str) -> Option<CueInfo> {
        let cue = self.cue(id).ok()?;
        let index = lock(&self.inner.index);
        Some(CueInfo::new(id, cue.stamp.size, index.get(&cue.name, cue.stamp, print)))
    }

    /// Has a cue that is in the folder already checked and proved, unless it is known for the hall as it now is. Blocks until
    /// that is done: seconds, minutes for a long cue beside a show.
    ///
    /// # Errors
    /// [`Problem`] where there is no such cue, or the check cannot be done. A cue that does not pass is no error.
    pub fn examine(&self, id: &CueId) -> Result<CueInfo, Problem> {
        let inner = &self.inner;
        let _turn = lock(&inner.proving);
        let print = inner.hall.fingerprint();
        let info = self.info(id, &print).ok_or_else(|| self.unknown(id))?;
        if info.proof != Proved::Unknown {
            return Ok(info);
        }
        let cue = self.cue(id)?;
        let verdict = child::examine(&inner.hall, &cue.folder.path(&cue.name), None)?;
        if cue.folder.stamp(&cue.name).ok().flatten() != Some(cue.stamp) {
            let detail = format!("the cue {id} changed while it was being checked");
            return Err(Problem::new(Code::File, detail, "try again when it is all there"));
        }
        let info = CueInfo::new(id, cue.stamp.size, Some((&verdict, true)));
        lock(&inner.index).put(&cue.folder, &cue.name, cue.stamp, &print, verdict);
        Ok(info)
    }

    /// Has every cue checked that is not known for the hall as it now is, one after another; for a thread of its own, when
    /// the service has started and after the configuration has changed. Those that cannot be checked stay unknown.
    pub fn examine_all(&self) {
        for info in self.list() {
            if let (Proved::Unknown, Ok(id)) = (&info.proof, info.id.parse()) {
                let _ = self.examine(&id); // it stays unknown, and whoever loads it is told why
            }
        }
    }

    /// Reads a cue whole into memory, and gives the SHA-256 of those very bytes, hexadecimal. Blocks for as long as that
    /// takes, seconds for the longest.
    ///
    /// # Errors
    /// [`Problem`] where there is no such cue, it cannot be read, or it has faults, each with its place.
    pub fn read(&self, id: &CueId) -> Result<(Timeline, String), Problem> {
        let cue = self.cue(id)?;
        self.keep_budget(id, &cue)?;
        let path = cue.folder.path(&cue.name);
        let mut input = Hashed::new((&cue.file).take(limits::MAX_FILE + 1));
        let read = cue::read(&path, &mut input, &Source::Native).map_err(|faults| {
            let lines = faults.to_string().lines().map(str::to_owned).collect();
            unplayable(id, lines)
        })?;
        let sha256 = input.finish().map_err(|error| file_problem("read the cue", &error))?;
        // What was read is what the name stands for: it was not written to meanwhile.
        if cue.folder.stamp(&cue.name).ok().flatten() != Some(cue.stamp) {
            let detail = format!("the cue {id} changed while it was being read");
            return Err(Problem::new(Code::File, detail, "try again when it is all there"));
        }
        Ok((Timeline::new(read), sha256))
    }

    /// What nobody has looked at yet, and may be large, is read by the child first, which ends where it takes too much.
    fn keep_budget(&self, id: &CueId, cue: &Cue) -> Result<(), Problem> {
        let small = if cue.name.ends_with(".mcap") { SMALL / 16 } else { SMALL };
        let known = lock(&self.inner.index).get(&cue.name, cue.stamp, "").is_some();
        if known || cue.stamp.size <= small { Ok(()) } else { self.examine(id).map(drop) }
    }

    /// The curves of a cue in so many stretches of time, 1 to [`MAX_POINTS`]. They are drawn by a process of the lowest
    /// priority, unless the same was asked before; one at a time.
    ///
    /// # Errors
    /// As for [`Library::read`]; [`Code::Value`] where `points` is out of range, [`Code::Cue`] where the cue cannot be read, [`Code::Check`] where it is in mm or
    /// pulses and the configuration cannot be read, or where drawing it takes too much.
    pub fn curve(
        &self,
        id: &CueId,
        points: usize,
        awaited: Option<&Awaited>,
    ) -> Result<Arc<CurveData>, Problem> {
        if !(1..=MAX_POINTS).contains(&points) {
            let detail = format!("{points} points are outside 1..={MAX_POINTS}");
            return Err(Problem::new(Code::Value, detail, "request as many as the page is wide"));
        }
        let cue = self.cue(id)?;
        let mut curves = lock(&self.inner.curves);
        let same =
            |drawn: &&Drawn| drawn.name == cue.name && drawn.stamp == cue.stamp && drawn.points == points;
        if let Some(drawn) = curves.iter().find(same) {
            return Ok(Arc::clone(&drawn.curve));
        }
        let curve = match child::draw(&self.inner.hall, &cue.folder.path(&cue.name), points, awaited)? {
            Drawing::Curve(curve) => Arc::new(curve),
            Drawing::Faults(lines) => return Err(unplayable(id, lines)),
        };
        curves.truncate(CURVES - 1);
        let drawn = Drawn { name: cue.name, stamp: cue.stamp, points, curve: Arc::clone(&curve) };
        curves.insert(0, drawn);
        Ok(curve)
    }

    /// Has a recording drawn as the check of a cue is made: that seat, or the one that was held back farthest. Blocks for as long.
    ///
    /// # Errors
    /// [`Code::Unknown`] where the recording, or the seat in it, is not there; as for a check where drawing it takes too much.
    pub(crate) fn picture(
        &self,
        recording: &Path,
        seat: Option<&str>,
        awaited: Option<&Awaited>,
    ) -> Result<RecordingPicture, Problem> {
        match child::picture(&self.inner.hall, recording, seat, awaited)? {
            Sketch::Picture(picture) => Ok(*picture),
            Sketch::Fault(fault) => {
                Err(Problem::new(Code::Unknown, fault, "GET /api/v1/recordings lists what is there"))
            }
        }
    }

    /// The configuration of the hall as its file now is, as cues are checked for it.
    ///
    /// # Errors
    /// [`Problem`] where it has faults.
    pub(crate) fn config(&self) -> Result<Config, Problem> {
        config::load(&self.inner.hall.config).map_err(|_| {
            let remedy = "run kinocue check on the configuration and correct it";
            Problem::new(Code::Check, "the configuration of the hall has faults", remedy)
        })
    }

    /// SHA-256 of the file of the hall's configuration as it now is, hexadecimal.
    #[must_use]
    pub(crate) fn config_digest(&self) -> String {
        hex(&Sha256::digest(self.inner.hall.text()))
    }

    /// To be held from the last look at what the hall does until a cue or a playlist is changed for a fleet. Whoever loads one waits for
    /// it, once that can be seen, before anything is read: so either it reads the new file, or the change waits for it.
    pub(crate) fn changing(&self) -> MutexGuard<'_, ()> {
        lock(&self.inner.changing)
    }

    /// The longest file that is taken in, bytes.
    #[must_use]
    pub(crate) fn max_bytes(&self) -> u64 {
        self.inner.hall.bounds.max_bytes
    }

    /// Begins to take a cue in; it replaces the one with that id when it is finished and passes. Two at a time.
    ///
    /// # Errors
    /// [`Problem`] where two are being taken in already, or the folder cannot be written.
    pub fn begin(&self, id: &CueId) -> Result<Upload, Problem> {
        Upload::begin(self, id)
    }

    /// Opens the file of a cue: of two the newer.
    fn cue(&self, id: &CueId) -> Result<Cue, Problem> {
        let open = || -> io::Result<Option<Cue>> {
            let mut found: Option<Cue> = None;
            for mcap in [false, true] {
                let (folder, name) = (Folder::open(&self.inner.dir)?, file_name(id, mcap));
                let Some((file, stamp)) = folder.file(&name)? else { continue };
                if found.as_ref().is_none_or(|other| !stamp.is_before(&other.stamp)) {
                    found = Some(Cue { folder, name, file, stamp });
                }
            }
            Ok(found)
        };
        open().map_err(|error| file_problem("open the cue", &error))?.ok_or_else(|| self.unknown(id))
    }
}

/// The file of a cue.
fn file_name(id: &CueId, mcap: bool) -> String {
    format!("{id}.{}", if mcap { "mcap" } else { "csv" })
}

/// The cue that a file is, if it is one.
fn id_of(name: &str) -> Option<CueId> {
    name.strip_suffix(".csv").or_else(|| name.strip_suffix(".mcap"))?.parse().ok()
}

fn unplayable(id: &CueId, faults: Vec<String>) -> Problem {
    let detail = format!("the cue {id} cannot be played");
    Problem::new(Code::Cue, detail, "correct these faults, and upload it again").with(faults)
}

fn file_problem(what: &str, error: &io::Error) -> Problem {
    Problem::new(
        Code::File,
        format!("cannot {what}: {error}"),
        "check the folder of the library and its disk",
    )
}

/// What a file beside the cues keeps as JSON; nothing where it is missing or cannot be read.
pub(crate) fn kept<T: DeserializeOwned + Default>(folder: &Folder, name: &str) -> T {
    let read = || {
        let (file, _) = folder.file(name).ok()??;
        let mut text = Vec::new();
        file.take(MAX_KEPT).read_to_end(&mut text).ok()?;
        serde_json::from_slice(&text).ok()
    };
    read().unwrap_or_default()
}

/// Bytes as hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests;
