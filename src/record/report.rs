//! How a recording ends, found from the end of the file: a list of recordings reads no show of two hours for it.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::read::LinearReader;
use mcap::records::{AttachmentIndex, MetadataIndex, Record, op};

use super::recording::{END, REPORT};

/// Octets at the end in which the offsets of the summary are: a record of 26 for each kind, and what ends the file.
const TAIL: u64 = 4 << 10;
/// The longest list of attachments or metadata, and the longest of these, octets.
const LONGEST: u64 = 4 << 20;
/// What ends each file: a footer of 9 and 20 octets, and the magic.
const FOOTER: usize = 9 + 20 + MAGIC.len();
/// Before the data of an attachment are its head and lengths, after it a sum of 4 octets.
const SUM: u64 = 4;

/// How a recording ends; of one that was not closed nothing is known.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Closing {
    /// The report that is attached, JSON.
    pub(crate) report: Option<Vec<u8>>,
    /// The metadata record `kinocue.end`.
    pub(crate) end: BTreeMap<String, String>,
}

/// How a recording ends.
///
/// # Errors
/// Where it cannot be read.
pub(crate) fn closing_of(mut file: impl Read + Seek) -> io::Result<Closing> {
    let len = file.seek(SeekFrom::End(0))?;
    let begin = len.saturating_sub(TAIL);
    let tail = part(&mut file, begin, len - begin)?;
    let mut closing = Closing::default();
    let index = find(&mut file, &tail, begin, op::ATTACHMENT_INDEX, |record| match record {
        Record::AttachmentIndex(index) if index.name == REPORT => Some(index),
        _ => None,
    })?;
    if let Some(AttachmentIndex { offset, length, data_size, .. }) = index {
        let data = offset.saturating_add(length).checked_sub(SUM.saturating_add(data_size));
        closing.report = match data {
            Some(data) if data_size <= LONGEST => Some(part(&mut file, data, data_size)?),
            _ => None,
        };
    }
    let index = find(&mut file, &tail, begin, op::METADATA_INDEX, |record| match record {
        Record::MetadataIndex(index) if index.name == END => Some(index),
        _ => None,
    })?;
    if let Some(MetadataIndex { offset, length, .. }) = index.filter(|index| index.length <= LONGEST) {
        let record = part(&mut file, offset, length)?;
        if let Some(Record::Metadata(end)) = records(&record).next() {
            closing.end = end.metadata;
        }
    }
    Ok(closing)
}

/// An entry of the index of that kind, by the end of a file that begins at `begin`.
fn find<T>(
    file: &mut (impl Read + Seek),
    tail: &[u8],
    begin: u64,
    kind: u8,
    wanted: impl FnMut(Record<'_>) -> Option<T>,
) -> io::Result<Option<T>> {
    let Some((start, length)) = group(tail, begin, kind).filter(|(_, length)| *length <= LONGEST) else {
        return Ok(None);
    };
    Ok(records(&part(file, start, length)?).find_map(wanted))
}

/// Where the records of that kind are in the summary, and how long they are.
fn group(tail: &[u8], begin: u64, kind: u8) -> Option<(u64, u64)> {
    let footer = tail.len().checked_sub(FOOTER)?;
    let Record::Footer(end) = records(tail.get(footer..)?.strip_suffix(MAGIC)?).next()? else { return None };
    let offsets = usize::try_from(end.summary_offset_start.checked_sub(begin)?).ok()?;
    records(tail.get(offsets..footer)?).find_map(|record| match record {
        Record::SummaryOffset(of) if of.group_opcode == kind => Some((of.group_start, of.group_length)),
        _ => None,
    })
}

/// The records of a part of a file, as far as they are whole.
fn records(bytes: &[u8]) -> impl Iterator<Item = Record<'_>> {
    LinearReader::sans_magic(bytes).map_while(Result::ok)
}

fn part(file: &mut (impl Read + Seek), at: u64, len: u64) -> io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    file.take(len).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use proptest::prelude::*;

    use super::*;
    use crate::record::{Mode, recorded_as};

    #[test]
    fn report_and_counts_are_found_from_the_end_and_none_where_the_file_was_cut() {
        let file = recorded_as(Mode::Full, (0..2_000).map(|tick| (f64::from(tick) / 2e3, 0.5)));
        let Closing { report, end } = closing_of(Cursor::new(&file)).unwrap();
        assert_eq!((report.as_deref(), end["ticks"].as_str()), (Some(&b"{}"[..]), "2000"));
        for cut in [1, 30, 200, file.len() / 2, file.len()] {
            let cut_off = closing_of(Cursor::new(&file[..file.len() - cut])).unwrap();
            assert_eq!(cut_off, Closing::default(), "{cut} octets less");
        }
    }

    #[test]
    fn anything_is_looked_through_without_a_panic() {
        proptest!(|(bytes in proptest::collection::vec(any::<u8>(), 0..2_000))| {
            let mut bytes = bytes;
            let _ = closing_of(Cursor::new(&bytes)).unwrap();
            bytes.extend_from_slice(MAGIC);
            let _ = closing_of(Cursor::new(&bytes)).unwrap();
        });
    }
}
