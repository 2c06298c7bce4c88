//! What an earlier program left when it was killed: the flight recorder's file becomes an incident, and recordings that were cut short
//! are written anew with an index. Each is read back before it takes the place of the other.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use super::AGAIN;
use super::disk::{Disk, PART};
use super::link::{RecordLink, RecordPart};
use crate::app::recording::in_io;
use crate::container::Trouble;
use crate::record::{
    self, Entry, EntryMaker, IncidentCause, Opening, Recording, RecoverError, Wanted, WantedFull,
    WantedSamples, read_flight,
};
use crate::sys::file;
use crate::time::MonoTime;

/// How often it is asked whether it may go on.
const PATIENCE: Duration = Duration::from_millis(100);

/// What a flight recorder held.
pub(super) type Leftover = (Opening, Vec<Entry>);

/// What the flight recorder of an earlier program held, if that did not end in order: then there is a file.
pub(super) fn flight(path: &Path) -> Option<Leftover> {
    let file = file::open_ours(path).ok()?;
    let (opening, entries) = read_flight(&file).ok().flatten()?;
    let opening = Opening::of_octets(&opening)?;
    (!entries.is_empty()).then_some((opening, entries))
}

/// Writes all of it anew, while it may. What fails for want of room, or of a disk, is tried again until it is there.
pub(super) fn clear_up(
    disk: &Disk,
    link: &RecordLink,
    mut leftover: Option<Leftover>,
    mut cut_short: Vec<PathBuf>,
    may: &impl Fn() -> bool,
) {
    loop {
        let mut trouble = None;
        let mut failed = |what: &str, error: &io::Error| {
            let why = format!("{what} from before the start is not recovered: {error}");
            trouble = Some(format!("{why}; free space on that disk; it is tried again every 30 s"));
        };
        leftover = leftover.filter(|leftover| match incident(disk, leftover, may) {
            Err(error) => {
                failed("the flight recorder", &error);
                true
            }
            Ok(()) => {
                link.count(IncidentCause::Crash);
                false
            }
        });
        cut_short.retain(|path| match recover(path, may) {
            Ok(()) => false,
            Err(error) if is_its_own(&error) => {
                // It stays, and is not tried at each start again; one that was killed before anything was in it goes.
                let is_empty = fs::metadata(path).is_ok_and(|about| about.len() == 0);
                let _ = if is_empty {
                    fs::remove_file(path)
                } else {
                    fs::rename(path, path.with_extension("unreadable"))
                };
                false
            }
            Err(error) => {
                failed(&path.file_name().unwrap_or_default().to_string_lossy(), &error);
                true
            }
        });
        link.trouble(RecordPart::Earlier, trouble);
        if leftover.is_none() && cut_short.is_empty() {
            return;
        }
        thread::park_timeout(AGAIN);
    }
}

/// Whether a file itself is why it cannot be recovered.
fn is_its_own(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::InvalidData | io::ErrorKind::AlreadyExists | io::ErrorKind::NotFound
    )
}

fn wait_for(may: &impl Fn() -> bool) {
    while !may() {
        thread::park_timeout(PATIENCE);
    }
}

/// The last minute before the program was killed, as an incident.
fn incident(disk: &Disk, (opening, entries): &Leftover, may: &impl Fn() -> bool) -> io::Result<()> {
    disk.clear_out_for_more()?;
    let (part, out) = disk.create_incident(IncidentCause::Crash)?;
    let part = part.until_begun();
    let opening = opening.clone().with("cause", IncidentCause::Crash.word());
    let mut file =
        Recording::open(out, &opening, EntryMaker::new(0, (MonoTime::default(), 0))).map_err(in_io)?;
    for some in entries.chunks(1_000) {
        wait_for(may);
        some.iter().try_for_each(|entry| file.put(entry)).map_err(in_io)?;
        file.flush().map_err(in_io)?;
    }
    let end = [("messages", entries.len().to_string())];
    let out = file.finish(&end, None).map_err(in_io)?;
    out.into_inner().map_err(io::IntoInnerError::into_error)?;
    part.begun().close().map(drop)
}

/// Writes a file anew that was cut short.
///
/// # Errors
/// Where nothing of it can be read, or the new one cannot be written; what was there stays then.
fn recover(path: &Path, may: &impl Fn() -> bool) -> io::Result<()> {
    let name = path.to_string_lossy();
    let whole = PathBuf::from(format!("{}.mcap", name.strip_suffix(PART).unwrap_or(&name)));
    let fresh = path.with_extension("recovering");
    if whole.try_exists()? {
        return Err(taken(&whole));
    }
    let result = copy(path, &fresh, may).and_then(|()| {
        // It was closed after all: by a recorder whose disk stood still.
        if whole.try_exists()? {
            return Err(taken(&whole));
        }
        fs::rename(&fresh, &whole)?;
        fs::remove_file(path)
    });
    if result.is_err() {
        // It is of no use to anybody.
        let _ = fs::remove_file(&fresh);
    }
    result
}

fn taken(path: &Path) -> io::Error {
    io::Error::new(io::ErrorKind::AlreadyExists, format!("{} is there already", path.display()))
}

/// Writes what is whole of it to another file, and reads that back.
fn copy(from: &Path, to: &Path, may: &impl Fn() -> bool) -> io::Result<()> {
    let input = Patient { file: BufReader::new(file::open_ours(from)?), may };
    let (recovered, out) =
        record::recover(input, BufWriter::new(file::create_ours(to)?)).map_err(|error| match error {
            RecoverError::Write(error) => error,
            RecoverError::Read(error) => io::Error::new(io::ErrorKind::InvalidData, error),
        })?;
    if let Some(Trouble::Unread(why)) = &recovered.salvaged.trouble {
        return Err(io::Error::other(why.clone()));
    }
    if recovered.messages.is_empty() {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "it has no complete message"));
    }
    out.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
    let again = Patient { file: BufReader::new(file::open_ours(to)?), may };
    let unwanted = Wanted { samples: WantedSamples::None, full: WantedFull::None, ..Wanted::ALL };
    let read = record::read(again, unwanted, &mut |_, _, _| ()).map_err(io::Error::other)?;
    if read.trouble.is_some() || read.messages != recovered.messages {
        return Err(io::Error::other("the written file does not read back; the disk may be failing"));
    }
    Ok(())
}

/// A file of which more is read only while it may.
struct Patient<'a, F> {
    file: BufReader<File>,
    may: &'a F,
}

impl<F: Fn() -> bool> Read for Patient<'_, F> {
    fn read(&mut self, octets: &mut [u8]) -> io::Result<usize> {
        wait_for(self.may);
        self.file.read(octets)
    }
}

impl<F> Seek for Patient<'_, F> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use mcap::MessageStream;

    use super::*;
    use crate::record::{About, EventNote, Message, Mode, Note};

    fn opening() -> Opening {
        let about = About {
            hall: "hall".to_owned(),
            cue: "ride".to_owned(),
            title: String::new(),
            cue_sha256: String::new(),
            rate_hz: 100.0,
            mode: Mode::Sampled,
            clocks: (MonoTime::default(), 0),
        };
        Opening::new(&about, &[])
    }

    fn entry(number: u64) -> Entry {
        let maker = EntryMaker::new(0, (MonoTime::default(), 0));
        let note = EventNote { kind: "standing", seat: "A1".to_owned(), text: number.to_string() };
        maker.entry(MonoTime::from_nanos(number), &Message::Note(Note::Event(note))).unwrap()
    }

    #[test]
    fn a_recording_that_was_cut_short_is_whole_after_the_next_start() {
        let folder = tempfile::tempdir().unwrap();
        let part = folder.path().join("2026-01-01T10-00-00-show-one.part.mcap");
        let octets = octets_of_a_show();
        // Killed in the middle of a record.
        fs::write(&part, &octets[..octets.len() - 60]).unwrap();
        recover(&part, &|| true).unwrap();
        assert!(!part.exists());
        let whole = fs::read(folder.path().join("2026-01-01T10-00-00-show-one.mcap")).unwrap();
        let summary = mcap::Summary::read(&whole).unwrap().unwrap();
        let names: Vec<_> = summary.metadata_indexes.iter().map(|one| one.name.as_str()).collect();
        assert_eq!((names, summary.attachment_indexes.len()), (vec!["kinocue", "kinocue.recovered"], 1));
        assert_eq!(MessageStream::new(&whole).unwrap().count(), 99);
        // Nothing of it is left.
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_recording_for_which_the_disk_has_no_room_is_tried_again() {
        let folder = tempfile::tempdir().unwrap();
        let part = folder.path().join("2026-01-01T10-00-00-show-one.part.mcap");
        fs::write(&part, octets_of_a_show()).unwrap();
        // Whatever is written there meets a disk that is full.
        std::os::unix::fs::symlink("/dev/full", part.with_extension("recovering")).unwrap();
        let full = recover(&part, &|| true).unwrap_err();
        assert!(!is_its_own(&full), "{full}");
        assert!(part.exists());
        recover(&part, &|| true).unwrap();
        assert!(!part.exists());
    }

    #[test]
    fn what_cannot_be_recovered_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let part = folder.path().join("2026-01-01T10-00-00-show-one.part.mcap");
        for octets in [&b""[..], b"no recording at all", &octets_of_a_start()[..40]] {
            fs::write(&part, octets).unwrap();
            assert!(is_its_own(&recover(&part, &|| true).unwrap_err()));
            assert_eq!(fs::read(&part).unwrap(), octets);
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        }
    }

    #[test]
    fn of_a_file_that_was_only_just_begun_nothing_is_left_and_of_one_that_is_none_all() {
        let folder = tempfile::tempdir().unwrap();
        let disk = Disk::new(&crate::config::Record::default(), folder.path());
        for (name, octets) in [("one", &b""[..]), ("two", b"no recording at all")] {
            fs::write(folder.path().join(format!("2026-01-01T10-00-00-show-{name}{PART}")), octets).unwrap();
        }
        clear_up(&disk, &RecordLink::default(), None, disk.cut_short(), &|| true);
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|one| one.unwrap().file_name()).collect();
        assert_eq!(left, ["2026-01-01T10-00-00-show-two.part.unreadable"]);
    }

    /// Of a show that was killed behind its hundredth message.
    fn octets_of_a_show() -> Vec<u8> {
        let mut octets = Vec::new();
        let maker = EntryMaker::new(0, (MonoTime::default(), 0));
        let mut file = Recording::open(io::Cursor::new(&mut octets), &opening(), maker).unwrap();
        file.attach("configuration.toml", "application/toml", b"[show]").unwrap();
        for number in 0..100 {
            file.put(&entry(number)).unwrap();
            file.flush().unwrap();
        }
        std::mem::forget(file);
        octets
    }

    fn octets_of_a_start() -> Vec<u8> {
        let file = Recording::open(
            io::Cursor::new(Vec::new()),
            &opening(),
            EntryMaker::new(0, (MonoTime::default(), 0)),
        );
        file.unwrap().finish(&[], None).unwrap().into_inner()
    }
}
