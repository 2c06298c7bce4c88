//! The files of a journal: their names, in order of time, and which of them are kept.

use std::io;

use jiff::ToSpan as _;
use jiff::civil::Date;

use super::Limits;
use crate::sys::folder::Folder;

/// One file: its day, and which one of that day.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct FileId {
    pub(super) day: Date,
    pub(super) number: u32,
}

impl FileId {
    pub(super) fn name(self) -> String {
        format!("kinocue-{}-{:03}.jsonl", self.day, self.number)
    }

    fn parse(name: &str) -> Option<Self> {
        let (day, number) = name.strip_prefix("kinocue-")?.strip_suffix(".jsonl")?.rsplit_once('-')?;
        let id = Self { day: day.parse().ok()?, number: number.parse().ok()? };
        (id.name() == name).then_some(id)
    }
}

/// All files, the oldest first. What has another name is none of them.
pub(super) fn all(folder: &Folder) -> io::Result<Vec<FileId>> {
    let mut files: Vec<_> = folder.names()?.iter().filter_map(|name| FileId::parse(name)).collect();
    files.sort_unstable();
    Ok(files)
}

/// Removes the files that are too old on `current`'s day, and the oldest while all are too large together; never `current`
/// or one of a later day.
pub(super) fn clear_out(folder: &Folder, limits: &Limits, current: FileId) -> io::Result<()> {
    let oldest = current.day.checked_sub(i64::from(limits.max_age_days).days()).unwrap_or(Date::MIN);
    let files = all(folder)?;
    let size = |file: &FileId| Ok::<_, io::Error>(folder.stamp(&file.name())?.map_or(0, |stamp| stamp.size));
    let mut total = files.iter().map(size).sum::<io::Result<u64>>()?;
    // The current one may still grow to its full size.
    let most = limits.max_total.saturating_sub(limits.max_size);
    for file in files.iter().filter(|file| **file < current) {
        if file.day < oldest || total > most {
            total = total.saturating_sub(size(file)?);
            folder.remove(&file.name())?;
        }
    }
    Ok(())
}
