//! Which recordings are kept: no more than may be, none too old, and as much of the disk free as has to be.

use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::{fs, io};

use jiff::civil::Date;

use super::disk::{Disk, PART};
use crate::config::Record;
use crate::control::is_recording;
use crate::journal::too_old;

const GIB: f64 = 1_073_741_824.0;
/// Octets of a block as the system counts them.
const BLOCK: u64 = 512;

/// A recording that is there.
#[derive(Debug, Clone)]
struct KeptFile {
    path: PathBuf,
    len: u64,
    /// Octets that are free once it is gone: none where it has another name somewhere.
    frees: u64,
    kind: Kept,
}

/// What a recording is of, the first to go first where there is too little room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kept {
    Show,
    Incident,
    /// An incident that a person has marked.
    Marked,
}

impl Kept {
    /// That of a recording of this name.
    fn of(name: &str) -> Self {
        match name.get(19..) {
            Some(rest) if rest.starts_with("-incident-mark") => Self::Marked,
            Some(rest) if rest.starts_with("-incident-") => Self::Incident,
            _ => Self::Show,
        }
    }
}

impl Disk {
    /// Octets that may be recorded yet where so many are free: those that need not stay so, and the recordings that would go for it.
    pub(super) fn room(&self, free: u64) -> io::Result<u64> {
        let ours: u64 = self.kept()?.iter().map(|one| one.frees).sum();
        Ok((free + ours).saturating_sub(self.floor()))
    }

    /// Removes what is too much where so many octets are free; says whether as much is free as has to be. Where that cannot be reached,
    /// nothing goes for it.
    fn clear_out(&self, mut free: u64) -> io::Result<bool> {
        let mut all = self.kept()?;
        all.sort_by_key(|one| one.kind); // the oldest first within each, as before
        for (is_incident, key, most_gib) in [
            (false, "max_total_gib", self.record.max_total_gib),
            (true, "incidents_gib", self.record.incidents_gib),
        ] {
            let of_kind = |one: &&KeptFile| (one.kind != Kept::Show) == is_incident;
            let mut total: u64 = all.iter().filter(of_kind).map(|one| one.len).sum();
            let mut gone = Vec::new();
            for one in all.iter().filter(of_kind) {
                if gib(total) <= most_gib {
                    break;
                }
                total = total.saturating_sub(one.len);
                free = free.saturating_add(one.frees);
                self.remove(&one.path, &format!("more than {key}"));
                gone.push(one.path.clone());
            }
            all.retain(|one| !gone.contains(&one.path));
        }
        // What goes may be free only after a while, so that it is counted rather than looked for.
        let mut wanted = self.floor().saturating_sub(free);
        if wanted > all.iter().map(|one| one.frees).sum() {
            return Ok(false);
        }
        for one in all.iter().filter(|one| one.frees > 0) {
            if wanted == 0 {
                break;
            }
            wanted = wanted.saturating_sub(one.frees);
            self.remove(&one.path, "for min_free_gib");
        }
        Ok(true)
    }

    /// Removes what is too old on a day on which one recording was begun so far, if the clock is known to be right.
    pub(super) fn age_out(&self, today: Date, is_synchronised: bool) -> io::Result<()> {
        let day = |name: &str| name.get(..10).and_then(|day| day.parse::<Date>().ok());
        let names = self.names()?;
        let days = names.iter().filter_map(|name| day(name));
        if !is_synchronised || days.clone().filter(|day| *day == today).count() != 1 {
            return Ok(());
        }
        let whole = days.clone().zip(&names).filter(|(_, name)| is_recording(name));
        let old = too_old(whole.clone().map(|(day, _)| day), today, self.record.max_age_days);
        for (_, name) in whole.filter(|(day, _)| old.contains(day)) {
            self.remove(&self.dir().join(name), "older than max_age_days");
        }
        Ok(())
    }

    /// Makes room for more.
    ///
    /// # Errors
    /// Where there is too little, all the same.
    pub(super) fn clear_out_for_more(&self) -> io::Result<()> {
        if !self.dir().is_dir() {
            fs::create_dir(self.dir())?;
        }
        if self.clear_out(self.free()?)? {
            return Ok(());
        }
        let free = gib(self.free()?);
        Err(io::Error::other(format!(
            "{free:.1} GiB are free, and min_free_gib is {}",
            self.record.min_free_gib
        )))
    }

    /// That the floor cannot be reached, with what to do.
    pub(super) fn unreached(&self) -> String {
        let Record { min_free_gib, .. } = self.record;
        let dir = self.dir().display();
        format!(
            "nothing can be recorded: {dir}: less than min_free_gib = {min_free_gib} would be free even without recordings, so none is \
             deleted for it; free space on that disk, or set dir or min_free_gib in [record]"
        )
    }

    /// Octets that have to stay free.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a size")]
    fn floor(&self) -> u64 {
        (self.record.min_free_gib * GIB) as u64
    }

    /// Recordings that are whole, oldest first. What has another name is none.
    fn kept(&self) -> io::Result<Vec<KeptFile>> {
        let mut all = Vec::new();
        for name in self.names()?.into_iter().filter(|name| is_recording(name)) {
            let path = self.dir().join(&name);
            let about = match fs::symlink_metadata(&path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue, // somebody has deleted it
                about => about?,
            };
            if about.is_file() {
                let frees = if about.nlink() > 1 { 0 } else { about.blocks().saturating_mul(BLOCK) };
                all.push(KeptFile { path, len: about.len(), frees, kind: Kept::of(&name) });
            }
        }
        Ok(all)
    }

    /// The names of recordings, those that are being written as well, oldest first.
    fn names(&self) -> io::Result<Vec<String>> {
        let name = |entry: io::Result<fs::DirEntry>| entry.map(|entry| entry.file_name().into_string().ok());
        let is_ours = |name: &String| {
            is_recording(name)
                || name.strip_suffix(PART).is_some_and(|stem| is_recording(&format!("{stem}.mcap")))
        };
        let names = fs::read_dir(self.dir())?.filter_map(|entry| name(entry).transpose());
        let mut names = names.collect::<io::Result<Vec<_>>>()?;
        names.retain(is_ours);
        names.sort();
        Ok(names)
    }

    /// What cannot be removed is tried again the next time.
    fn remove(&self, path: &Path, why: &str) {
        if fs::remove_file(path).is_ok() {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            self.link.say(format!("the recording {name} was deleted: {why}"));
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "far fewer octets than a double counts")]
fn gib(octets: u64) -> f64 {
    octets as f64 / GIB
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 5] = [
        "2026-01-01T10-00-00-show-one.mcap",
        "2026-01-02T10-00-00-incident-stop.mcap",
        "2026-01-03T10-00-00-show-two.mcap",
        "2026-01-04T10-00-00-incident-clamp.mcap",
        "notes.mcap",
    ];
    const MARK: &str = "2026-01-01T10-00-00-incident-mark.mcap";

    /// Octets of a recording here.
    const LEN: u64 = 64 << 10;

    fn disk(record: Record, names: &[&str]) -> (tempfile::TempDir, Disk) {
        let folder = tempfile::tempdir().unwrap();
        let disk = Disk::new(&record, folder.path());
        let octets = vec![1; 64 << 10];
        names.iter().for_each(|name| fs::write(folder.path().join(name), &octets).unwrap());
        (folder, disk)
    }

    fn left(disk: &Disk) -> Vec<String> {
        let name = |entry: io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<_> = fs::read_dir(disk.dir()).unwrap().map(name).collect();
        names.sort();
        names
    }

    /// So much has to stay free.
    fn floor(octets: u64) -> Record {
        Record { min_free_gib: gib(octets), ..Record::default() }
    }

    #[test]
    fn the_oldest_go_first_and_shows_do_not_take_the_room_of_incidents() {
        let record =
            Record { max_total_gib: gib(LEN + LEN / 2), incidents_gib: 1.0, min_free_gib: 0.0, ..floor(0) };
        let (_folder, disk) = disk(record, &NAMES);
        assert!(disk.clear_out(0).unwrap());
        assert_eq!(left(&disk), NAMES[1..]);
        let said = "the recording 2026-01-01T10-00-00-show-one.mcap was deleted: more than max_total_gib";
        assert_eq!(disk.link.take_said(), [said]);
    }

    #[test]
    fn where_the_floor_cannot_be_reached_nothing_is_deleted() {
        let (_folder, disk) = disk(Record { min_free_gib: 1e6, ..Record::default() }, &NAMES);
        assert!(!disk.clear_out(100 * LEN).unwrap());
        assert_eq!(left(&disk), NAMES);
        let refused = disk.clear_out_for_more().unwrap_err().to_string();
        assert!(refused.ends_with("min_free_gib is 1000000"), "{refused}");
        assert_eq!(disk.room(100 * LEN).unwrap(), 0);
        assert!(disk.unreached().contains("; free space on that disk"));
    }

    #[test]
    fn what_has_another_name_elsewhere_frees_nothing_and_stays() {
        let (folder, disk) = disk(floor(LEN / 2), &NAMES[..1]);
        fs::hard_link(folder.path().join(NAMES[0]), folder.path().join("backup")).unwrap();
        assert!(!disk.clear_out(0).unwrap());
        assert_eq!(left(&disk), [NAMES[0], "backup"]);
    }

    #[test]
    fn what_a_person_marked_goes_last_though_it_is_the_oldest() {
        let record = Record { incidents_gib: gib(LEN + 1), min_free_gib: 0.0, ..Record::default() };
        let (_folder, disk) = disk(record, &[MARK, NAMES[1], NAMES[2]]);
        assert!(disk.clear_out(0).unwrap());
        assert_eq!(left(&disk), [MARK, NAMES[2]]);
    }

    #[test]
    fn for_the_floor_shows_go_before_incidents_and_no_more_than_it_takes() {
        let names = [MARK, NAMES[0], NAMES[1], NAMES[2], NAMES[3]];
        let (_folder, disk) = disk(floor(3 * LEN / 2 + 4 * LEN), &names);
        assert!(disk.clear_out(4 * LEN).unwrap());
        assert_eq!(left(&disk), [MARK, NAMES[1], NAMES[3]]);
        assert!(disk.clear_out(6 * LEN).unwrap());
        assert_eq!(left(&disk).len(), 3);
    }

    #[test]
    fn nothing_goes_by_age_while_the_clock_may_be_wrong_or_has_leapt_and_else_two_days_at_a_time() {
        let names: Vec<String> =
            (1..=20).map(|day| format!("2026-01-{day:02}T10-00-00-show-one.mcap")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (folder, disk) = disk(Record { max_age_days: 5, ..Record::default() }, &names);
        let begin = |day: &str, is_synchronised| {
            fs::write(folder.path().join(format!("{day}T09-00-00-show-two{PART}")), b"").unwrap();
            disk.age_out(day.parse().unwrap(), is_synchronised).unwrap();
            fs::remove_file(folder.path().join(format!("{day}T09-00-00-show-two{PART}"))).unwrap();
            left(&disk).len()
        };
        assert_eq!(begin("2026-01-21", false), 20);
        assert_eq!([begin("2035-01-01", true), begin("2061-07-01", true)], [20, 20]);
        assert_eq!(begin("2026-01-21", true), 18);
        let said: String = disk.link.take_said().concat();
        assert!(
            said.contains("2026-01-02T10-00-00-show-one.mcap was deleted: older than max_age_days"),
            "{said}"
        );
        // It is the second recording of that day.
        fs::write(folder.path().join("2026-01-21T08-00-00-show-one.mcap"), b"").unwrap();
        assert_eq!(begin("2026-01-21", true), 19);
    }
}
