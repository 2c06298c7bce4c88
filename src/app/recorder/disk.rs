//! The folder of recordings: the names of files, and what is free.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use jiff::Zoned;

use super::link::RecordLink;
use super::plain_name;
use crate::config::Record;
use crate::control::is_recording;
use crate::record::IncidentCause;
use crate::sys::machine;

/// What a file is called until it is whole.
pub(super) const PART: &str = ".part.mcap";
const WHOLE: &str = ".mcap";

/// A file that is being written.
#[derive(Debug)]
pub(super) struct PartFile {
    /// What it is called once it is whole.
    pub(super) path: PathBuf,
    part: PathBuf,
    disk: File,
}

impl PartFile {
    /// The same, which is removed again unless it is begun.
    pub(super) const fn until_begun(self) -> Unbegun {
        Unbegun(Some(self))
    }

    /// Octets so far that were handed over.
    pub(super) fn len(&self) -> u64 {
        self.disk.metadata().map_or(0, |about| about.len())
    }

    /// Has them on the disk.
    pub(super) fn sync(&self) -> io::Result<()> {
        self.disk.sync_data()
    }

    /// Whether anybody who looks into the folder finds it.
    pub(super) fn is_there(&self) -> io::Result<()> {
        if self.part.try_exists()? { Ok(()) } else { Err(io::ErrorKind::NotFound.into()) }
    }

    /// It is whole.
    pub(super) fn close(self) -> io::Result<PathBuf> {
        self.disk.sync_all()?;
        fs::rename(&self.part, &self.path)?;
        Ok(self.path)
    }

    /// Its name once it is whole.
    pub(super) fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// A file of which nothing is written yet: where that fails, it goes.
#[derive(Debug)]
pub(super) struct Unbegun(Option<PartFile>);

impl Unbegun {
    /// Its beginning is written.
    ///
    /// # Panics
    /// Never: it is taken once.
    pub(super) fn begun(mut self) -> PartFile {
        self.0.take().expect("it is taken once")
    }
}

impl Drop for Unbegun {
    fn drop(&mut self) {
        if let Some(file) = &self.0 {
            // What cannot be removed is recovered at the next start, or is seen to be none.
            let _ = fs::remove_file(&file.part);
        }
    }
}

/// The folder.
#[derive(Debug, Clone)]
pub(super) struct Disk {
    dir: PathBuf,
    pub(super) record: Record,
    /// Where it is said what was deleted.
    pub(super) link: RecordLink,
}

impl Disk {
    /// That folder.
    pub(super) fn new(record: &Record, dir: &Path) -> Self {
        Self { dir: dir.to_owned(), record: record.clone(), link: RecordLink::default() }
    }

    /// The same that says there what it deletes.
    pub(super) fn telling(self, link: RecordLink) -> Self {
        Self { link, ..self }
    }

    /// Where it is.
    pub(super) fn dir(&self) -> &Path {
        &self.dir
    }

    /// Begins a file of that kind, of which `word` says what it is of; begun at another time it has another name.
    pub(super) fn create(
        &self,
        kind: &str,
        word: &str,
        part: u32,
    ) -> io::Result<(PartFile, BufWriter<File>)> {
        if !self.dir.is_dir() {
            fs::create_dir(&self.dir)?;
        }
        let today = Zoned::now();
        let now = today.strftime("%Y-%m-%dT%H-%M-%S").to_string();
        let part = if part > 1 { format!("-{part}") } else { String::new() };
        for number in 1..100_u32 {
            let again = if number > 1 { format!("_{number}") } else { String::new() };
            let name = format!("{now}-{kind}-{}{part}{again}", plain_name(word));
            let (path, part) =
                (self.dir.join(format!("{name}{WHOLE}")), self.dir.join(format!("{name}{PART}")));
            if path.try_exists()? {
                continue;
            }
            match File::create_new(&part) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
                Ok(out) => {
                    let disk = out.try_clone()?;
                    // Old ones that cannot be deleted are no reason to record nothing.
                    let _ = self.age_out(today.date(), machine::clock_is_synchronised());
                    return Ok((PartFile { path, part, disk }, BufWriter::new(out)));
                }
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    /// Octets that are free for us.
    pub(super) fn free(&self) -> io::Result<u64> {
        let place = if self.dir.is_dir() { &*self.dir } else { self.dir.parent().unwrap_or(&self.dir) };
        let about = rustix::fs::statvfs(place)?;
        Ok(about.f_bavail.saturating_mul(about.f_frsize))
    }

    /// Recordings of this folder that were cut short; what has another name is somebody else's, who may be writing it.
    pub(super) fn cut_short(&self) -> Vec<PathBuf> {
        let Ok(files) = fs::read_dir(&self.dir) else { return Vec::new() };
        let path = |entry: io::Result<fs::DirEntry>| {
            let entry = entry.ok()?;
            entry.file_type().is_ok_and(|kind| kind.is_file()).then(|| entry.path())
        };
        let is_cut = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.strip_suffix(PART).is_some_and(|stem| is_recording(&format!("{stem}{WHOLE}")))
        };
        files.filter_map(path).filter(is_cut).collect()
    }

    /// Begins the file of an incident.
    pub(super) fn create_incident(&self, cause: IncidentCause) -> io::Result<(PartFile, BufWriter<File>)> {
        self.create("incident", cause.word(), 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_file_takes_the_name_of_another() {
        let folder = tempfile::tempdir().unwrap();
        let disk = Disk::new(&Record::default(), folder.path());
        let first = disk.create("show", "one/two \u{1b}[.csv", 1).unwrap().0;
        let second = disk.create("show", "one/two \u{1b}[.csv", 1).unwrap().0;
        assert_ne!(first.name(), second.name());
        assert!(is_recording(&first.name()) && is_recording(&second.name()), "{}", first.name());
        assert_eq!(disk.cut_short().len(), 2);
        first.close().unwrap();
        // Somebody records a play of his own into the same folder.
        fs::write(disk.dir().join(format!("tuesday{PART}")), b"").unwrap();
        assert_eq!(disk.cut_short().len(), 1);
    }
}
