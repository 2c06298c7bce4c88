//! The index at the end of an MCAP file (mcap.dev/spec, "Summary Section"), as far as it helps to save what a damaged file holds. One
//! whose sum is wrong is none.

use std::collections::BTreeSet;
use std::io::{self, Read, Seek, SeekFrom};

use mcap::records::op;

use super::{MAGIC, MAX_RECORD, RecordBody};

/// Octets of opcode and length.
pub(super) const HEAD: u64 = 9;
/// Octets of a footer with its head.
const FOOTER: u64 = HEAD + 20;

/// An index that is whole.
#[derive(Debug, Default)]
pub(super) struct EndIndex {
    /// Where it begins: behind all data.
    pub(super) begin: u64,
    /// Where the records are that it knows.
    pub(super) starts: BTreeSet<u64>,
    /// Those of these that hold what the file is of: chunks, attachments, metadata.
    pub(super) holding: BTreeSet<u64>,
    /// Chunks, each with its place and the log times of its first and its last message.
    pub(super) chunks: Vec<(u64, (u64, u64))>,
    /// Messages of the file, if it counts them.
    pub(super) messages: Option<u64>,
    /// Schemas and channels, whole.
    pub(super) declared: Vec<(u8, Vec<u8>)>,
}

/// How a file ends.
#[derive(Debug)]
pub(super) enum FileEnd {
    /// With an index that is whole.
    Indexed(EndIndex),
    /// In order, without an index.
    Plain,
    /// With what cannot be its end.
    Damaged,
}

/// Reads the end of a file of that length.
///
/// # Errors
/// Where reading fails.
pub(super) fn read(input: &mut (impl Read + Seek), len: u64) -> io::Result<FileEnd> {
    let tail = FOOTER + MAGIC.len() as u64;
    if len < tail + MAGIC.len() as u64 {
        return Ok(FileEnd::Damaged);
    }
    let footer = octets(input, len - tail, tail)?;
    let (footer, magic) = footer.split_at(footer.len() - MAGIC.len());
    let (head, body) = footer.split_at(9);
    let mut body = RecordBody(body);
    let [Some(begin), Some(_), Some(sum)] = [body.u64(), body.u64(), body.u32().map(u64::from)] else {
        return Ok(FileEnd::Damaged);
    };
    if head[0] != op::FOOTER || head[1..] != 20_u64.to_le_bytes() || magic != MAGIC {
        return Ok(FileEnd::Damaged);
    }
    if begin == 0 {
        return Ok(FileEnd::Plain);
    }
    let footer_at = len - tail;
    let size = footer_at.checked_sub(begin).filter(|size| *size <= MAX_RECORD as u64);
    let Some(size) = size.filter(|_| begin >= MAGIC.len() as u64) else { return Ok(FileEnd::Damaged) };
    // The sum is over all of it and over the footer up to itself.
    let summed = octets(input, begin, size + FOOTER - 4)?;
    if u64::from(crc32fast::hash(&summed)) != sum {
        return Ok(FileEnd::Damaged);
    }
    let records = &summed[..usize::try_from(size).unwrap_or_default()];
    Ok(of_records(records, begin).map_or(FileEnd::Damaged, FileEnd::Indexed))
}

fn of_records(mut records: &[u8], begin: u64) -> Option<EndIndex> {
    let mut index = EndIndex { begin, ..EndIndex::default() };
    while let Some((opcode, rest)) = records.split_first() {
        let (len, rest) = rest.split_first_chunk()?;
        let (body, rest) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*len)).ok()?)?;
        index.take(*opcode, body)?;
        records = rest;
    }
    // Everything stands in front of it.
    index.starts.last().is_none_or(|last| *last < begin).then_some(index)
}

impl EndIndex {
    fn take(&mut self, opcode: u8, body: &[u8]) -> Option<()> {
        let mut rest = RecordBody(body);
        match opcode {
            op::SCHEMA | op::CHANNEL => self.declared.push((opcode, body.to_vec())),
            op::CHUNK_INDEX => {
                let span = (rest.u64()?, rest.u64()?);
                let (at, len) = (rest.u64()?, rest.u64()?);
                self.chunks.push((at, span));
                self.starts.extend([at, at.checked_add(len)?]);
                self.holding.insert(at);
            }
            op::ATTACHMENT_INDEX | op::METADATA_INDEX => {
                let at = rest.u64()?;
                self.starts.insert(at);
                self.holding.insert(at);
            }
            op::STATISTICS => self.messages = Some(rest.u64()?),
            _ => {}
        }
        Some(())
    }

    /// Log times of the messages of all chunks that begin there.
    pub(super) fn span(&self, from: u64, until: u64) -> Option<(u64, u64)> {
        let of_it = self.chunks.iter().filter(|(at, _)| (from..until).contains(at)).map(|(_, span)| *span);
        of_it.reduce(|one, other| (one.0.min(other.0), one.1.max(other.1)))
    }
}

/// So many octets from there on; fewer where the file ends before.
///
/// # Errors
/// Where reading fails.
pub(super) fn octets(input: &mut (impl Read + Seek), at: u64, len: u64) -> io::Result<Vec<u8>> {
    input.seek(SeekFrom::Start(at))?;
    let mut octets = Vec::new();
    input.take(len).read_to_end(&mut octets)?;
    Ok(octets)
}
