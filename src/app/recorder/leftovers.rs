//! What an earlier program left when it was killed: the flight recorder's file becomes an incident, and recordings that were cut short
//! are written anew with an index. Each is read back before it takes the place of the other.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use mcap::read::{ChunkFlattener, Options};
use mcap::records::{Metadata, Record};
use mcap::{Attachment, Compression, McapResult, MessageStream, WriteOptions};

use super::disk::{Disk, PART};
use super::link::RecordLink;
use crate::app::recording::in_io;
use crate::record::{Entry, EntryMaker, IncidentCause, Opening, Recording, read_flight};
use crate::time::MonoTime;

/// How often it is asked whether it may go on.
const PATIENCE: Duration = Duration::from_millis(100);
/// The largest file that is recovered, octets: it is held in memory.
const MOST: u64 = 2 << 30;

/// What a flight recorder held.
pub(super) type Leftover = (Opening, Vec<Entry>);

/// What the flight recorder of an earlier program held, if that did not end in order: then there is a file.
pub(super) fn flight(path: &Path) -> Option<Leftover> {
    let file = File::open(path).ok()?;
    let (opening, entries) = read_flight(&file).ok().flatten()?;
    let opening = Opening::of_octets(&opening)?;
    (!entries.is_empty()).then_some((opening, entries))
}

/// Writes all of it anew, while it may.
pub(super) fn clear_up(
    disk: &Disk,
    link: &RecordLink,
    leftover: Option<Leftover>,
    cut_short: &[PathBuf],
    may: &impl Fn() -> bool,
) {
    let told = |what: &str, result: io::Result<()>| {
        if let Err(error) = result {
            link.trouble(Some(format!("{what} of before the start could not be recovered: {error}")));
        }
    };
    if let Some(leftover) = leftover {
        told("the flight recorder", incident(disk, &leftover, may));
        link.tell(|status| {
            *status.incidents.entry(IncidentCause::Crash.word().to_owned()).or_default() += 1;
        });
    }
    for path in cut_short {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let recovered = recover(path, may);
        if recovered.is_err() {
            // It stays, and is not tried at each start again.
            let _ = fs::rename(path, path.with_extension("unreadable"));
        }
        told(&name, recovered);
    }
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
    let opening = opening.clone().with("mode", "full").with("cause", IncidentCause::Crash.word());
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
    part.close().map(drop)
}

/// Writes a file anew that was cut short.
///
/// # Errors
/// Where nothing of it can be read, or the new one cannot be written; what was there stays then.
fn recover(path: &Path, may: &impl Fn() -> bool) -> io::Result<()> {
    if fs::metadata(path)?.len() > MOST {
        return Err(io::ErrorKind::FileTooLarge.into());
    }
    let octets = fs::read(path)?;
    let name = path.to_string_lossy();
    let whole = PathBuf::from(format!("{}.mcap", name.strip_suffix(PART).unwrap_or(&name)));
    let fresh = path.with_extension("recovering");
    if whole.try_exists()? {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    let copied = copy(&octets, &fresh, may).map_err(in_io);
    let result = copied.and_then(|messages| {
        // Read back before the one that was cut short goes.
        let again = fs::read(&fresh)?;
        let read =
            MessageStream::new(&again).map_err(in_io)?.collect::<McapResult<Vec<_>>>().map_err(in_io)?;
        if read.len() != messages {
            return Err(io::Error::other(format!("{messages} messages were written, {} read", read.len())));
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

/// Writes what is whole of it to another file; gives how many messages there are.
fn copy(octets: &[u8], to: &Path, may: &impl Fn() -> bool) -> McapResult<usize> {
    let options = || Options::IgnoreEndMagic.into();
    let mut out = WriteOptions::new()
        .library(concat!("kinocue ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Lz4))
        .create(BufWriter::new(File::create(to)?))?;
    for record in ChunkFlattener::new_with_options(octets, options())?.map_while(Result::ok) {
        match record {
            Record::Metadata(metadata) => out.write_metadata(&metadata)?,
            Record::Attachment { header, data, .. } => out.attach(&Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            })?,
            _ => {}
        }
    }
    let mut messages = 0;
    for message in MessageStream::new_with_options(octets, options())?.map_while(Result::ok) {
        if messages % 1_000 == 0 {
            wait_for(may);
        }
        out.write(&message)?;
        messages += 1;
    }
    if messages == 0 {
        return Err(io::Error::other("it has no whole message").into());
    }
    let metadata = BTreeMap::from([("messages".to_owned(), messages.to_string())]);
    out.write_metadata(&Metadata { name: "kinocue.recovered".to_owned(), metadata })?;
    out.finish()?;
    let mut file = out.into_inner();
    file.flush()?;
    file.get_ref().sync_all()?;
    Ok(messages)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{About, EventNote, Message, Note};

    fn opening() -> Opening {
        let about = About {
            hall: "hall".to_owned(),
            cue: "ride".to_owned(),
            title: String::new(),
            cue_sha256: String::new(),
            rate_hz: 100.0,
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
        let out = BufWriter::new(File::create(&part).unwrap());
        let maker = EntryMaker::new(0, (MonoTime::default(), 0));
        let mut file = Recording::open(out, &opening(), maker).unwrap();
        file.attach("configuration.toml", "application/toml", b"[show]").unwrap();
        for number in 0..100 {
            file.put(&entry(number)).unwrap();
            file.flush().unwrap();
        }
        // Killed in the middle of a record.
        let octets = fs::read(&part).unwrap();
        std::mem::forget(file);
        fs::write(&part, &octets[..octets.len() - 10]).unwrap();
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
    fn what_cannot_be_recovered_stays_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let part = folder.path().join("2026-01-01T10-00-00-show-one.part.mcap");
        for octets in [&b""[..], b"no recording at all", &octets_of_a_start()[..40]] {
            fs::write(&part, octets).unwrap();
            assert!(recover(&part, &|| true).is_err());
            assert_eq!(fs::read(&part).unwrap(), octets);
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        }
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
