//! The folder of recordings: names, what is kept, what is free.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use jiff::Zoned;

use super::plain_name;
use crate::config::Record;
use crate::control::is_recording;
use crate::record::IncidentCause;
use crate::sys::clock::wall_now_ns;

const GIB: f64 = 1_073_741_824.0;
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

/// A recording that is there.
#[derive(Debug, Clone)]
struct KeptFile {
    path: PathBuf,
    len: u64,
    modified: SystemTime,
    is_incident: bool,
}

/// The folder.
#[derive(Debug, Clone)]
pub(super) struct Disk {
    dir: PathBuf,
    record: Record,
}

impl Disk {
    /// That folder.
    pub(super) fn new(record: &Record, dir: &Path) -> Self {
        Self { dir: dir.to_owned(), record: record.clone() }
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
        let now = Zoned::now().strftime("%Y-%m-%dT%H-%M-%S").to_string();
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

    /// Octets that may be recorded yet where so many are free: those that need not stay so, and the recordings that would go for it.
    pub(super) fn room(&self, free: u64) -> io::Result<u64> {
        let ours: u64 = self.kept()?.iter().map(|one| one.len).sum();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a size")]
        let stays_free = (self.record.min_free_gib * GIB) as u64;
        Ok((free + ours).saturating_sub(stays_free))
    }

    /// Removes what is too old or too much; says whether as much is free as has to be.
    pub(super) fn clear_out(&self) -> io::Result<bool> {
        let mut all = self.kept()?;
        let age = Duration::from_secs(86_400 * u64::from(self.record.max_age_days));
        let oldest = wall_now().checked_sub(age).unwrap_or(SystemTime::UNIX_EPOCH);
        let (old, kept): (Vec<_>, Vec<_>) = all.into_iter().partition(|one| one.modified < oldest);
        old.iter().for_each(remove);
        all = kept;
        for (is_incident, most_gib) in [(false, self.record.max_total_gib), (true, self.record.incidents_gib)]
        {
            let of_kind = |one: &&KeptFile| one.is_incident == is_incident;
            let mut total: u64 = all.iter().filter(of_kind).map(|one| one.len).sum();
            let mut gone = Vec::new();
            for one in all.iter().filter(of_kind).take_while(|one| {
                let is_too_much = gib(total) > most_gib;
                total = total.saturating_sub(if is_too_much { one.len } else { 0 });
                is_too_much
            }) {
                remove(one);
                gone.push(one.path.clone());
            }
            all.retain(|one| !gone.contains(&one.path));
        }
        for one in &all {
            if self.has_room()? {
                return Ok(true);
            }
            remove(one);
        }
        self.has_room()
    }

    /// Makes room for more.
    ///
    /// # Errors
    /// Where there is too little, all the same.
    pub(super) fn clear_out_for_more(&self) -> io::Result<()> {
        if !self.dir.is_dir() {
            fs::create_dir(&self.dir)?;
        }
        let Record { min_free_gib, .. } = self.record;
        if self.clear_out()? {
            return Ok(());
        }
        let free = gib(self.free()?);
        Err(io::Error::other(format!("{free:.1} GiB are free, and min_free_gib is {min_free_gib}")))
    }

    fn has_room(&self) -> io::Result<bool> {
        Ok(gib(self.free()?) >= self.record.min_free_gib)
    }

    /// Recordings that are whole, oldest first. What has another name is none.
    fn kept(&self) -> io::Result<Vec<KeptFile>> {
        let mut all = Vec::new();
        for entry in fs::read_dir(&self.dir)? {
            let entry = entry?;
            let (name, about) = (entry.file_name().to_string_lossy().into_owned(), entry.metadata()?);
            if about.is_file() && is_recording(&name) {
                let is_incident = name.get(19..).is_some_and(|rest| rest.starts_with("-incident-"));
                let modified = about.modified()?;
                all.push(KeptFile { path: entry.path(), len: about.len(), modified, is_incident });
            }
        }
        all.sort_by(|one, other| one.path.cmp(&other.path));
        Ok(all)
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

fn wall_now() -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_nanos(wall_now_ns())
}

#[expect(clippy::cast_precision_loss, reason = "far fewer octets than a double counts")]
fn gib(octets: u64) -> f64 {
    octets as f64 / GIB
}

/// What cannot be removed is tried again the next time.
fn remove(one: &KeptFile) {
    let _ = fs::remove_file(&one.path);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disk(record: Record, names: &[&str]) -> (tempfile::TempDir, Disk) {
        let folder = tempfile::tempdir().unwrap();
        let disk = Disk::new(&record, folder.path());
        names.iter().for_each(|name| fs::write(folder.path().join(name), [0; 1_024]).unwrap());
        (folder, disk)
    }

    fn left(disk: &Disk) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(disk.dir())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    const NAMES: [&str; 5] = [
        "2026-01-01T10-00-00-show-one.mcap",
        "2026-01-02T10-00-00-incident-stop.mcap",
        "2026-01-03T10-00-00-show-two.mcap",
        "2026-01-04T10-00-00-incident-clamp.mcap",
        "notes.mcap",
    ];

    #[test]
    fn the_oldest_go_first_and_shows_do_not_take_the_room_of_incidents() {
        let one_and_a_half = 1_536.0 / GIB;
        let record = Record {
            max_total_gib: one_and_a_half,
            incidents_gib: 1.0,
            min_free_gib: 0.0,
            ..Record::default()
        };
        let (_folder, disk) = disk(record, &NAMES);
        assert!(disk.clear_out().unwrap());
        assert_eq!(left(&disk), [NAMES[1], NAMES[2], NAMES[3], NAMES[4]]);
    }

    #[test]
    fn where_too_little_is_free_all_of_ours_go_and_nothing_else() {
        let record = Record { min_free_gib: 1e6, ..Record::default() };
        let (_folder, disk) = disk(record, &NAMES);
        assert!(!disk.clear_out().unwrap(), "it is still too little");
        assert_eq!(left(&disk), [NAMES[4]]);
    }

    #[test]
    fn no_file_takes_the_name_of_another() {
        let (_folder, disk) = disk(Record::default(), &[]);
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
