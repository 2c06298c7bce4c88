//! What can be saved of a damaged file: each chunk whose sum is right, and each record outside of chunks that can be one. Behind damage reading
//! goes on where the index at the file's end knows a record, and without an index at the next place that begins like one.

use std::io::{Read, Seek};

use mcap::records::op;

use super::chunks::{WithinChunk, each_in_chunk};
use super::index::{self, EndIndex, FileEnd, HEAD, octets};
use super::losses::{Losses, Salvaged};
use super::{
    AttachmentRecord, ChannelRecord, MAGIC, MAX_RECORD, RecordBody, Trouble, message, metadata, schema_of,
};

/// How much of a file is searched at a time for the next record.
const WINDOW: u64 = 256 * 1024;
/// Log times of one recording are nearer to each other than this, ns.
const FAR_NS: u64 = 30 * 86_400 * 1_000_000_000;
/// Octets of a chunk up to the name of its compression, with the record's head.
const CHUNK_FRONT: usize = 9 + 32;

/// Hands every record that is whole to `take`: first the schemas and channels of the index, if that is whole, then those in front of it.
///
/// # Errors
/// That of `take`; where reading fails, and where the file is no MCAP file or unpacks to more than `most` octets.
pub(crate) fn each_saved<E: From<Trouble>>(
    mut input: impl Read + Seek,
    most: u64,
    mut take: impl FnMut(u8, &[u8]) -> Result<(), E>,
) -> Result<Salvaged, E> {
    let len = input.seek(std::io::SeekFrom::End(0)).map_err(unread)?;
    if len == 0 {
        return Err(Trouble::Empty.into());
    }
    let end = index::read(&mut input, len).map_err(unread)?;
    let begins = octets(&mut input, 0, MAGIC.len() as u64).map_err(unread)? == MAGIC;
    if !begins && !matches!(end, FileEnd::Indexed(_)) {
        return Err(Trouble::Foreign("it does not begin as MCAP files do".to_owned()).into());
    }
    let is_damaged = matches!(end, FileEnd::Damaged);
    let index = if let FileEnd::Indexed(index) = end { Some(index) } else { None };
    let declared = index.iter().flat_map(|index| &index.declared);
    declared.clone().try_for_each(|(opcode, body)| take(*opcode, body))?;
    let until = index.as_ref().map_or(len, |index| index.begin);
    let mut sum = crc32fast::Hasher::new();
    sum.update(MAGIC);
    let mut walk = SalvageWalk {
        input,
        index,
        until,
        losses: Losses::default(),
        unpacked: 0,
        most,
        sum,
        has_chunks: false,
        is_idle: false,
        unread: None,
    };
    let end = walk.run(&mut take)?;
    let SalvageWalk { mut losses, index, sum, is_idle, unread, .. } = walk;
    if end.is_none() && index.is_none() {
        losses.cut();
    }
    let is_sound = losses.any() || end.is_none_or(|said| said == 0 || said == sum.finalize());
    let damaged = |what: &str| Some(Trouble::Damaged(what.to_owned()));
    let trouble = match end {
        _ if unread.is_some() => unread,
        None if index.is_none() => Some(Trouble::CutShort),
        _ if is_damaged => damaged("the index at its end"),
        _ if !begins => damaged("its first octets"),
        _ if is_idle => damaged("indexes between its chunks"),
        _ if !is_sound => damaged("something outside of its chunks, such as its metadata; that may be wrong"),
        _ => None,
    };
    Ok(losses.into_salvaged(trouble, index.and_then(|index| index.messages)))
}

fn unread(error: std::io::Error) -> Trouble {
    Trouble::Unread(error.to_string())
}

/// A record as it stands in a file.
struct WholeRecord {
    opcode: u8,
    body: Vec<u8>,
    next: u64,
}

/// What is at a place of a file.
enum Found {
    Record(WholeRecord),
    /// No record; and where the next one is.
    Damage(Option<u64>),
}

struct SalvageWalk<R> {
    input: R,
    index: Option<EndIndex>,
    /// Where the data ends.
    until: u64,
    losses: Losses,
    unpacked: u64,
    most: u64,
    /// Over all that went by, while nothing is lost.
    sum: crc32fast::Hasher,
    /// Messages are in chunks.
    has_chunks: bool,
    /// There is damage to what holds nothing.
    is_idle: bool,
    /// Why no more could be read.
    unread: Option<Trouble>,
}

impl<R: Read + Seek> SalvageWalk<R> {
    /// Goes through the data; gives the sum that its end has, if it has one.
    fn run<E: From<Trouble>>(
        &mut self,
        take: &mut impl FnMut(u8, &[u8]) -> Result<(), E>,
    ) -> Result<Option<u32>, E> {
        let mut at = MAGIC.len() as u64;
        while at < self.until {
            at = match self.found(at)? {
                Found::Record(record) => {
                    if matches!(record.opcode, op::DATA_END | op::FOOTER) {
                        return Ok(Some(RecordBody(&record.body).u32().unwrap_or(0)));
                    }
                    self.sum_up(&record);
                    self.take_record(at, &record, take)?;
                    record.next
                }
                Found::Damage(next) => {
                    let until = next.unwrap_or(self.until);
                    self.damage(at, until);
                    until
                }
            }
        }
        Ok(None)
    }

    /// Nothing can be read from there on.
    fn damage(&mut self, at: u64, until: u64) {
        let Some(index) = &self.index else {
            return self.losses.gap(until - at, None, until == self.until);
        };
        if index.holding.range(at..until).next().is_some() {
            self.losses.gap(until - at, index.span(at, until), false);
        } else {
            self.losses.indexes();
            self.is_idle = true;
        }
    }

    fn sum_up(&mut self, WholeRecord { opcode, body, .. }: &WholeRecord) {
        self.sum.update(&[*opcode]);
        self.sum.update(&(body.len() as u64).to_le_bytes());
        self.sum.update(body);
    }

    fn take_record<E: From<Trouble>>(
        &mut self,
        at: u64,
        record: &WholeRecord,
        take: &mut impl FnMut(u8, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        match record.opcode {
            op::CHUNK => {
                self.has_chunks = true;
                self.chunk(at, record, take)
            }
            // One of these may be anything.
            0x80.. => {
                self.losses.indexes();
                Ok(())
            }
            op::MESSAGE_INDEX => {
                self.losses.index(&record.body);
                Ok(())
            }
            opcode => {
                self.losses.saved(opcode, &record.body);
                take(opcode, &record.body)
            }
        }
    }

    /// What is there. A disk that reads no further is the end of the file.
    fn found(&mut self, at: u64) -> Result<Found, Trouble> {
        let found = match self.record(at) {
            Ok(Some(record)) => Ok(Found::Record(record)),
            Ok(None) => self.next_start(at + 1).map(Found::Damage),
            Err(trouble) => Err(trouble),
        };
        found.or_else(|trouble| match trouble {
            Trouble::Unread(_) => {
                self.unread = Some(trouble);
                Ok(Found::Damage(None))
            }
            other => Err(other),
        })
    }

    fn chunk<E: From<Trouble>>(
        &mut self,
        at: u64,
        record: &WholeRecord,
        take: &mut impl FnMut(u8, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (losses, unpacked) = (&mut self.losses, &mut self.unpacked);
        let inside = each_in_chunk(&record.body, |opcode, body| {
            *unpacked += body.len() as u64;
            losses.saved(opcode, body);
            take(opcode, body).map_err(WithinChunk::Taker)
        });
        match inside {
            Ok(()) if self.unpacked > self.most => Err(Trouble::TooLarge.into()),
            Ok(()) => Ok(()),
            Err(WithinChunk::Taker(error)) => Err(error),
            Err(WithinChunk::Chunk(trouble)) => {
                let span = self.span(at, record.next);
                self.losses.chunk(record.next - at, span, trouble);
                Ok(())
            }
        }
    }

    fn span(&self, from: u64, until: u64) -> Option<(u64, u64)> {
        self.index.as_ref().and_then(|index| index.span(from, until))
    }

    /// The record there; none where nothing can be one, or where it would reach over one that the index knows.
    fn record(&mut self, at: u64) -> Result<Option<WholeRecord>, Trouble> {
        let head = octets(&mut self.input, at, HEAD).map_err(unread)?;
        let Some((opcode, len)) = head_of(&head) else { return Ok(None) };
        let next = at.saturating_add(HEAD).saturating_add(len);
        let mut known = self.index.iter().flat_map(|index| index.starts.range(at + 1..));
        let reaches_over = known.next().is_some_and(|start| *start < next);
        if next > self.until || reaches_over || len > MAX_RECORD as u64 {
            return Ok(None);
        }
        let body = octets(&mut self.input, at + HEAD, len).map_err(unread)?;
        // Of a message outside of chunks nothing says whether it is one.
        let is_odd = opcode == op::MESSAGE && self.has_chunks;
        let is_one = body.len() as u64 == len && can_be(opcode, &body) && !is_odd;
        Ok(is_one.then_some(WholeRecord { opcode, body, next }))
    }

    /// Where the next record begins, from there on.
    fn next_start(&mut self, from: u64) -> Result<Option<u64>, Trouble> {
        if let Some(index) = &self.index {
            return Ok(index.starts.range(from..).next().copied());
        }
        let (mut at, mut is_nested) = (from, false);
        while at < self.until {
            let window = octets(&mut self.input, at, WINDOW + CHUNK_FRONT as u64).map_err(unread)?;
            for place in 0..window.len().min(usize::try_from(WINDOW).unwrap_or_default()) {
                let rest = &window[place..];
                // A file that is attached has records of its own.
                if let Some(behind) = rest.strip_prefix(MAGIC) {
                    is_nested = behind.first() == Some(&op::HEADER);
                }
                if is_nested || !begins_like_one(rest) {
                    continue;
                }
                let start = at + place as u64;
                if self.record(start)?.is_some_and(|record| self.is_of_this_file(&record)) {
                    return Ok(Some(start));
                }
            }
            at += WINDOW;
        }
        Ok(None)
    }

    /// False of a chunk whose times are far from those of this file.
    fn is_of_this_file(&self, record: &WholeRecord) -> bool {
        let Some(newest) = self.losses.newest.filter(|_| record.opcode == op::CHUNK) else { return true };
        RecordBody(&record.body).u64().is_some_and(|since| since.abs_diff(newest) < FAR_NS)
    }
}

/// Opcode and length.
fn head_of(octets: &[u8]) -> Option<(u8, u64)> {
    let (opcode, rest) = octets.split_first()?;
    Some((*opcode, u64::from_le_bytes(*rest.first_chunk()?)))
}

/// True of what hardly anything but a record begins with, as far as that can be seen at a glance.
fn begins_like_one(rest: &[u8]) -> bool {
    let Some((opcode, len)) = head_of(rest) else { return false };
    match opcode {
        op::CHUNK => {
            rest.get(CHUNK_FRONT - 4..CHUNK_FRONT).is_some_and(|name| name[1..] == [0; 3] && name[0] <= 4)
        }
        op::ATTACHMENT | op::METADATA => len <= MAX_RECORD as u64,
        op::DATA_END => len == 4,
        _ => false,
    }
}

/// True of a record whose body fits its length: whatever damage made it up, it is no other one.
fn can_be(opcode: u8, body: &[u8]) -> bool {
    let mut rest = RecordBody(body);
    let holds = match opcode {
        op::HEADER => rest.text().and_then(|_| rest.text()).map(|_| rest.0.is_empty()),
        op::SCHEMA => schema_of(body).map(|(_, name, encoding, data)| {
            2 + 3 * 4 + name.len() + encoding.len() + data.len() == body.len()
        }),
        op::CHANNEL => ChannelRecord::parse(body).map(|one| {
            // Behind it is a map.
            let map = body.get(2 * 2 + 2 * 4 + one.topic.len() + one.encoding.len()..).unwrap_or_default();
            let mut map = RecordBody(map);
            map.u32().is_some_and(|len| len as usize == map.0.len())
        }),
        op::MESSAGE => message(body).map(|_| true),
        op::CHUNK => holds_chunk(body),
        op::MESSAGE_INDEX => rest
            .u16()
            .and_then(|_| rest.u32())
            .map(|len| len.is_multiple_of(16) && usize::try_from(len).is_ok_and(|len| rest.0.len() == len)),
        op::ATTACHMENT => AttachmentRecord::parse(body).map(|one| one.is_sound(body)),
        op::METADATA => metadata(body).map(|(name, entries)| {
            let texts = entries.iter().map(|(key, value)| 8 + key.len() + value.len());
            !name.is_empty() && 8 + name.len() + texts.sum::<usize>() == body.len()
        }),
        op::DATA_END => Some(body.len() == 4),
        op::FOOTER => Some(body.len() == 20),
        // Those of other programs.
        0x80.. => Some(true),
        _ => None,
    };
    holds == Some(true)
}

fn holds_chunk(body: &[u8]) -> Option<bool> {
    let mut rest = RecordBody(body);
    rest.bytes(28)?;
    let name = rest.text()?;
    let packed = usize::try_from(rest.u64()?).ok()?;
    Some(matches!(name, "" | "lz4" | "zstd") && rest.0.len() == packed)
}
