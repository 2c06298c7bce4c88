//! The report in a recording, found from the end of the file: a list of recordings reads no show of two hours for it.

use std::io::{self, Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::read::LinearReader;
use mcap::records::{AttachmentIndex, Record, op};

use super::recording::REPORT;

/// Octets at the end in which the offsets of the summary are: a record of 26 for each kind, and what ends the file.
const TAIL: u64 = 4 << 10;
/// The longest list of attachments, and the longest report, octets.
const LONGEST: u64 = 4 << 20;
/// What ends each file: a footer of 9 and 20 octets, and the magic.
const FOOTER: usize = 9 + 20 + MAGIC.len();
/// Before the data of an attachment are its head and lengths, after it a sum of 4 octets.
const SUM: u64 = 4;

/// The report that was attached to a recording, JSON; none where the file was not closed, or has none.
///
/// # Errors
/// Where it cannot be read.
pub(crate) fn report_of(mut file: impl Read + Seek) -> io::Result<Option<Vec<u8>>> {
    let len = file.seek(SeekFrom::End(0))?;
    let begin = len.saturating_sub(TAIL);
    let tail = part(&mut file, begin, len - begin)?;
    let Some(group) = attachments(&tail, begin) else { return Ok(None) };
    let (start, length) = group;
    if length > LONGEST {
        return Ok(None);
    }
    let list = part(&mut file, start, length)?;
    let index = records(&list).find_map(|record| match record {
        Record::AttachmentIndex(index) if index.name == REPORT => Some(index),
        _ => None,
    });
    let Some(AttachmentIndex { offset, length, data_size, .. }) = index else { return Ok(None) };
    let data = offset.saturating_add(length).checked_sub(SUM.saturating_add(data_size));
    match data {
        Some(data) if data_size <= LONGEST => part(&mut file, data, data_size).map(Some),
        _ => Ok(None),
    }
}

/// Where the list of attachments is, and how long, by the end of a file that begins at `begin`.
fn attachments(tail: &[u8], begin: u64) -> Option<(u64, u64)> {
    let footer = tail.len().checked_sub(FOOTER)?;
    let Record::Footer(end) = records(tail.get(footer..)?.strip_suffix(MAGIC)?).next()? else { return None };
    let offsets = usize::try_from(end.summary_offset_start.checked_sub(begin)?).ok()?;
    records(tail.get(offsets..footer)?).find_map(|record| match record {
        Record::SummaryOffset(of) if of.group_opcode == op::ATTACHMENT_INDEX => {
            Some((of.group_start, of.group_length))
        }
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
    fn the_report_is_found_from_the_end_and_none_where_the_file_was_cut() {
        let file = recorded_as(Mode::Full, (0..2_000).map(|tick| (f64::from(tick) / 2e3, 0.5)));
        assert_eq!(report_of(Cursor::new(&file)).unwrap().as_deref(), Some(&b"{}"[..]));
        for cut in [1, 30, 200, file.len() / 2, file.len()] {
            assert_eq!(report_of(Cursor::new(&file[..file.len() - cut])).unwrap(), None, "{cut} octets less");
        }
    }

    #[test]
    fn anything_is_looked_through_without_a_panic() {
        proptest!(|(bytes in proptest::collection::vec(any::<u8>(), 0..2_000))| {
            let mut bytes = bytes;
            let _ = report_of(Cursor::new(&bytes)).unwrap();
            bytes.extend_from_slice(MAGIC);
            let _ = report_of(Cursor::new(&bytes)).unwrap();
        });
    }
}
