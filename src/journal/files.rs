//! The files of a journal: their names, in order of time, and which of them are kept.

use std::{fmt, io};

use jiff::civil::Date;

use super::Limits;
use super::age::too_old;
use crate::sys::folder::Folder;

/// What a file holds. Each kind has half of the room, so that no flood of asks washes shows out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum FileKind {
    /// Shows, and starts of the program.
    Shows,
    /// What was asked.
    Asked,
}

impl FileKind {
    /// All of them.
    pub(super) const ALL: [Self; 2] = [Self::Shows, Self::Asked];

    /// What the names of its files begin with.
    const fn prefix(self) -> &'static str {
        match self {
            Self::Shows => "kinocue-",
            Self::Asked => "kinocue-asked-",
        }
    }
}

/// One file: its day, which one of that day, and of what kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct FileId {
    pub(super) day: Date,
    pub(super) number: u32,
    pub(super) kind: FileKind,
}

impl FileId {
    pub(super) fn name(self) -> String {
        format!("{}{}-{:03}.jsonl", self.kind.prefix(), self.day, self.number)
    }

    fn parse(name: &str) -> Option<Self> {
        let of = |kind: FileKind| {
            let (day, number) = name.strip_prefix(kind.prefix())?.strip_suffix(".jsonl")?.rsplit_once('-')?;
            let id = Self { day: day.parse().ok()?, number: number.parse().ok()?, kind };
            (id.name() == name).then_some(id)
        };
        FileKind::ALL.into_iter().find_map(of)
    }
}

/// All files, the oldest first. What has another name is none of them.
pub(super) fn all(folder: &Folder) -> io::Result<Vec<FileId>> {
    let mut files: Vec<_> = folder.names()?.iter().filter_map(|name| FileId::parse(name)).collect();
    files.sort_unstable();
    Ok(files)
}

/// Removes the oldest files of `current`'s kind while they take more than half of the room; never `current` or one of a later day.
pub(super) fn clear_out(folder: &Folder, limits: &Limits, current: FileId) -> io::Result<Vec<RemovedFile>> {
    let files = of_kind(folder, current.kind)?;
    let size = |file: &FileId| Ok::<_, io::Error>(folder.stamp(&file.name())?.map_or(0, |stamp| stamp.size));
    let mut total = files.iter().map(size).sum::<io::Result<u64>>()?;
    // The current one may still grow to its full size.
    let most = (limits.max_total / 2).saturating_sub(limits.max_size);
    let mut gone = Vec::new();
    for file in files.into_iter().filter(|file| *file < current) {
        if total > most {
            total = total.saturating_sub(size(&file)?);
            folder.remove(&file.name())?;
            gone.push(RemovedFile { file, why: "more than max_total_mib" });
        }
    }
    Ok(gone)
}

/// Removes those that are too old on its day; to be called once on each day, and only while the clock is known to be right.
pub(super) fn age_out(folder: &Folder, limits: &Limits, current: FileId) -> io::Result<Vec<RemovedFile>> {
    let files = of_kind(folder, current.kind)?;
    let old = too_old(files.iter().map(|file| file.day), current.day, limits.max_age_days);
    let mut gone = Vec::new();
    for file in files.into_iter().filter(|file| old.contains(&file.day)) {
        folder.remove(&file.name())?;
        gone.push(RemovedFile { file, why: "older than max_age_days" });
    }
    Ok(gone)
}

/// A file that is gone, and why.
#[derive(Debug)]
pub(super) struct RemovedFile {
    file: FileId,
    why: &'static str,
}

impl fmt::Display for RemovedFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the journal's file {} was deleted: {}", self.file.name(), self.why)
    }
}

fn of_kind(folder: &Folder, kind: FileKind) -> io::Result<Vec<FileId>> {
    Ok(all(folder)?.into_iter().filter(|file| file.kind == kind).collect())
}
