//! Puts lines at the end of the present file of their kind, and begins new files. Journal thread.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};

use jiff::civil::Date;

use super::Limits;
use super::files::{self, FileId, FileKind, RemovedFile};
use super::record::Line;
use super::seal::Sealer;
use crate::sys::folder::{Folder, Stamp};

/// A line on its way to the disk.
#[derive(Debug, Clone)]
pub(super) struct QueuedLine {
    /// The day that it belongs to.
    pub(super) day: Date,
    /// When it happened.
    pub(super) at: String,
    /// The line with its end.
    pub(super) text: Vec<u8>,
    /// In which files it belongs.
    pub(super) kind: FileKind,
    /// True if it is to be on the disk before the next one is written.
    pub(super) sync: bool,
}

/// Where lines go.
#[derive(Debug)]
pub(super) struct Writer {
    dir: PathBuf,
    limits: Limits,
    /// Kept open, so that others see that somebody writes here.
    folder: Option<Folder>,
    sealer: Option<Sealer>,
    /// For each kind.
    current: [Option<Current>; 2],
    /// True while the clock is known to be right.
    is_synchronised: fn() -> bool,
    /// What was deleted, in words.
    pub(super) gone: Vec<String>,
}

/// The file that lines are added to.
#[derive(Debug)]
struct Current {
    id: FileId,
    file: File,
    size: u64,
    /// True if its last line has no end.
    torn: bool,
    /// It is the first of its day, and what is too old on that day is still there: nothing goes by a clock that may be wrong.
    is_age_due: bool,
}

impl Writer {
    pub(super) fn new(
        dir: &Path,
        limits: Limits,
        sealer: Option<Sealer>,
        is_synchronised: fn() -> bool,
    ) -> Self {
        Self {
            dir: dir.to_owned(),
            limits,
            folder: None,
            sealer,
            current: [None, None],
            is_synchronised,
            gone: Vec::new(),
        }
    }

    /// Writes a line. After an error everything is opened anew the next time.
    pub(super) fn append(&mut self, entry: &QueuedLine) -> io::Result<()> {
        self.try_append(entry).inspect_err(|_| {
            self.current[entry.kind as usize] = None;
            self.sealer.iter_mut().for_each(|sealer| sealer.forget(entry.kind));
        })
    }

    fn try_append(&mut self, entry: &QueuedLine) -> io::Result<()> {
        let folder = match self.folder.take() {
            Some(folder) => folder,
            None => {
                fs::create_dir_all(&self.dir)?;
                Folder::open(&self.dir)?
            }
        };
        folder.claim(); // a report may have been looking at it the last time
        let folder = self.folder.insert(folder);
        if let Some(sealer) = &mut self.sealer {
            if entry.kind == FileKind::Shows && sealer.has_new_key(folder) {
                let line = Line::Key { at: entry.at.clone(), new: sealer.public_key() };
                let text = serde_json::to_vec(&line).map_err(io::Error::other)?;
                self.append_sealed(&QueuedLine { text, sync: true, ..entry.clone() }, true)?;
            }
            return self.append_sealed(entry, false);
        }
        self.put(entry)
    }

    /// Seals a line, and writes it; `is_change` if it says that the key is a new one.
    fn append_sealed(&mut self, entry: &QueuedLine, is_change: bool) -> io::Result<()> {
        let sealed = self
            .sealer
            .as_mut()
            .zip(self.folder.as_ref())
            .and_then(|(sealer, folder)| sealer.seal(folder, (entry.kind, is_change), &entry.text));
        let (text, tip) = sealed.ok_or_else(|| io::Error::other("a line cannot be sealed"))?;
        self.put(&QueuedLine { text, ..entry.clone() })?;
        self.sealer.iter_mut().for_each(|sealer| sealer.advance(entry.kind, is_change, tip.clone()));
        Ok(())
    }

    /// Puts a line as it is at the end of the file that it belongs to.
    fn put(&mut self, entry: &QueuedLine) -> io::Result<()> {
        let Some(folder) = &self.folder else { return Err(io::ErrorKind::NotFound.into()) };
        let fits = |current: &Current| {
            let grown = current.size + entry.text.len() as u64;
            current.id.day == entry.day && (grown <= self.limits.max_size || current.size == 0)
        };
        let place = &mut self.current[entry.kind as usize];
        let current = match place.take().filter(fits) {
            Some(current) => current,
            None => {
                let current = Current::open(folder, entry, &self.limits)?;
                // Old files that cannot be removed are no reason to write nothing.
                let gone = files::clear_out(folder, &self.limits, current.id).unwrap_or_default();
                self.gone.extend(gone.iter().map(RemovedFile::to_string));
                current
            }
        };
        let current = place.insert(current);
        if current.is_age_due && (self.is_synchronised)() {
            current.is_age_due = false;
            let gone = files::age_out(folder, &self.limits, current.id).unwrap_or_default();
            self.gone.extend(gone.iter().map(RemovedFile::to_string));
        }
        current.append(entry)
    }
}

impl Current {
    /// The last file of the day, or the next one where that is full.
    fn open(folder: &Folder, entry: &QueuedLine, limits: &Limits) -> io::Result<Self> {
        let fits = |id: &FileId| id.day == entry.day && id.kind == entry.kind;
        let of_day = files::all(folder)?.into_iter().rfind(fits);
        let mut id = of_day.unwrap_or(FileId { day: entry.day, number: 0, kind: entry.kind });
        loop {
            let file = folder.append(&id.name())?;
            let size = Stamp::of(&file)?.size;
            if size == 0 || size + entry.text.len() as u64 <= limits.max_size {
                let mut last = [b'\n'];
                if size > 0 {
                    file.read_exact_at(&mut last, size - 1)?;
                }
                folder.sync()?;
                let is_age_due = size == 0 && id.number == 0;
                return Ok(Self { id, file, size, torn: last != [b'\n'], is_age_due });
            }
            id.number += 1;
        }
    }

    fn append(&mut self, entry: &QueuedLine) -> io::Result<()> {
        let line = match self.torn {
            true => [b"\n", entry.text.as_slice()].concat(),
            false => entry.text.clone(),
        };
        let written = loop {
            match self.file.write(&line) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                written => break written?,
            }
        };
        self.size += written as u64;
        self.torn = written < line.len();
        if self.torn {
            return Err(io::Error::new(io::ErrorKind::StorageFull, "the disk took only part of a line"));
        }
        if entry.sync { self.file.sync_data() } else { Ok(()) }
    }
}
