//! The records of an MCAP file, out of their chunks; for cues and recordings. Any thread but the tick thread; holds one record and
//! one chunk at a time, and takes any bytes without a panic.
//!
//! The file is read by the `mcap` crate; the bodies of the few records that matter are taken apart here, because the crate
//! reserves as much memory as a length in the file claims.

mod ahead;
mod chunks;
mod index;
mod losses;
mod salvage;
mod walk;
mod zstd;

use std::collections::BTreeMap;
use std::io::{BufReader, Read};

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::plain::escaped;
pub(crate) use ahead::{SplitReader, each_sound_ahead};
pub(crate) use losses::{LostStretch, Salvaged};
pub(crate) use salvage::each_saved;
use walk::Walk;
use zstd::Zstd;

/// What every MCAP file begins and ends with (mcap.dev/spec).
pub(crate) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// The longest record that is taken into memory; indexes of foreign writers can be some MB.
const MAX_RECORD: usize = 64 * 1024 * 1024;
/// How much is read at a time, whatever a length in the file asks for.
const READ: usize = 256 * 1024;

/// How much is told of what the reader met, bytes.
const REASON_TOLD: usize = 200;

/// Why no more of a file can be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Trouble {
    /// There is nothing in it.
    #[error("is empty")]
    Empty,
    /// It ends inside a record, or before its footer.
    #[error("is cut short")]
    CutShort,
    /// It is something else.
    #[error("is no MCAP file: {0}")]
    Foreign(String),
    /// What it says of itself cannot be so.
    #[error("is damaged: {0}")]
    Damaged(String),
    /// It, or what it unpacks to, is longer than was allowed.
    #[error("is too large")]
    TooLarge,
    /// Reading failed.
    #[error("reading failed: {0}")]
    Unread(String),
}

/// Hands every record, its opcode and body, to `take`; stops at its first error or the file's, or where it unpacks to more than
/// `most` bytes. With the error comes where the record begins in which that was met, or the chunk that holds it.
///
/// # Errors
/// That of `take`, or what is wrong with the file.
pub(crate) fn each<E: From<Trouble>>(
    input: impl Read,
    most: u64,
    take: impl FnMut(u8, &[u8]) -> Result<(), E>,
) -> Result<(), (u64, E)> {
    each_of(input, most, checked().with_validate_chunk_crcs(true), take)
}

/// The same for whoever uses what comes before the fault: nothing is handed out of a chunk before its sum is right. Chunks are held
/// whole, at most 64 MiB.
///
/// # Errors
/// As [`each`]; where a chunk is longer, too.
pub(crate) fn each_sound<E: From<Trouble>>(
    input: impl Read,
    most: u64,
    take: impl FnMut(u8, &[u8]) -> Result<(), E>,
) -> Result<(), (u64, E)> {
    each_of(input, most, checked().with_prevalidate_chunk_crcs(true), take)
}

/// All sums beside those of chunks are looked at.
fn checked() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true)
}

fn each_of<E: From<Trouble>>(
    input: impl Read,
    most: u64,
    chunks: LinearReaderOptions,
    take: impl FnMut(u8, &[u8]) -> Result<(), E>,
) -> Result<(), (u64, E)> {
    let mut walk = Walk::new(most);
    // No byte is read before it is asked for, so that the walk is where the reader is.
    let input = BufReader::with_capacity(READ, input);
    walk_on(input, &mut walk, most, chunks, take).map_err(|error| (walk.record(), error))
}

fn walk_on<E: From<Trouble>>(
    mut input: impl Read,
    walk: &mut Walk,
    most: u64,
    chunks: LinearReaderOptions,
    mut take: impl FnMut(u8, &[u8]) -> Result<(), E>,
) -> Result<(), E> {
    let mut reader = LinearReader::new_with_options(chunks.with_record_length_limit(MAX_RECORD));
    reader.add_decompressor(Zstd::new()).map_err(|error| trouble(&error, 0, false))?;
    let (mut unpacked, mut begun) = (0_u64, false);
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let space = reader.insert(wanted.clamp(1, READ));
                let bytes = input.read(space).map_err(|error| Trouble::Unread(error.to_string()))?;
                walk.pass(&space[..bytes])?;
                reader.notify_read(bytes);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                begun = true;
                unpacked += data.len() as u64 + 9; // opcode and length
                take(opcode, data)?;
            }
            Err(error) => return Err(trouble(&error, walk.bytes(), begun).into()),
        }
        if walk.bytes() > most || unpacked > most {
            return Err(Trouble::TooLarge.into());
        }
    }
    Ok(())
}

fn trouble(error: &McapError, read: u64, begun: bool) -> Trouble {
    match error {
        McapError::UnexpectedEof if read == 0 => Trouble::Empty,
        McapError::UnexpectedEof => Trouble::CutShort,
        // So writers begin a chunk, and say how long it is once it is over.
        McapError::RecordTooLarge { opcode: op::CHUNK, len: u64::MAX } => Trouble::CutShort,
        McapError::BadMagic if !begun => Trouble::Foreign("it does not begin as MCAP files do".to_owned()),
        other => Trouble::Damaged(escaped(&other.to_string(), REASON_TOLD).into_owned()),
    }
}

/// Schema record: its id.
pub(crate) fn schema(body: &[u8]) -> Option<u16> {
    RecordBody(body).u16()
}

/// Schema record, whole: id, name, encoding and data.
pub(crate) fn schema_of(body: &[u8]) -> Option<(u16, &str, &str, &[u8])> {
    let mut body = RecordBody(body);
    let (id, name, encoding, length) = (body.u16()?, body.text()?, body.text()?, body.u32()?);
    Some((id, name, encoding, body.bytes(length)?))
}

/// ChannelRecord record.
pub(crate) struct ChannelRecord<'a> {
    pub(crate) id: u16,
    /// The schema of its messages; 0 is none.
    pub(crate) schema: u16,
    pub(crate) topic: &'a str,
    pub(crate) encoding: &'a str,
}

impl<'a> ChannelRecord<'a> {
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut body = RecordBody(body);
        Some(Self { id: body.u16()?, schema: body.u16()?, topic: body.text()?, encoding: body.text()? })
    }
}

/// Message record: channel, log time and data.
pub(crate) fn message(body: &[u8]) -> Option<(u16, u64, &[u8])> {
    let mut body = RecordBody(body);
    let channel = body.u16()?;
    body.u32()?; // sequence
    let log_time = body.u64()?;
    body.u64()?; // publish time
    Some((channel, log_time, body.0))
}

/// Metadata record: name and entries.
pub(crate) fn metadata(body: &[u8]) -> Option<(&str, BTreeMap<&str, &str>)> {
    let mut body = RecordBody(body);
    let name = body.text()?;
    let length = body.u32()?;
    let mut entries = RecordBody(body.bytes(length)?);
    let mut map = BTreeMap::new();
    while !entries.0.is_empty() {
        map.insert(entries.text()?, entries.text()?);
    }
    Some((name, map))
}

/// Attachment record.
pub(crate) struct AttachmentRecord<'a> {
    pub(crate) log_time: u64,
    pub(crate) name: &'a str,
    pub(crate) media_type: &'a str,
    pub(crate) data: &'a [u8],
}

impl<'a> AttachmentRecord<'a> {
    pub(crate) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut body = RecordBody(body);
        let log_time = body.u64()?;
        body.u64()?; // create time
        let (name, media_type) = (body.text()?, body.text()?);
        let length = body.u64()?;
        let (data, _) = body.0.split_at_checked(usize::try_from(length).ok()?)?;
        Some(Self { log_time, name, media_type, data })
    }
}

impl AttachmentRecord<'_> {
    /// True where the record ends with it, and its sum, if it has one, is right.
    fn is_sound(&self, body: &[u8]) -> bool {
        let Some((summed, sum)) = body.split_last_chunk() else { return false };
        let sum = u32::from_le_bytes(*sum);
        let ends = 8 + 8 + 4 + self.name.len() + 4 + self.media_type.len() + 8 + self.data.len();
        ends == summed.len() && (sum == 0 || crc32fast::hash(summed) == sum)
    }
}

/// What is left of a record's body; little-endian, texts behind their length (mcap.dev/spec).
struct RecordBody<'a>(&'a [u8]);

impl<'a> RecordBody<'a> {
    fn bytes(&mut self, count: u32) -> Option<&'a [u8]> {
        let (front, rest) = self.0.split_at_checked(usize::try_from(count).ok()?)?;
        self.0 = rest;
        Some(front)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (front, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*front)
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        str::from_utf8(self.bytes(length)?).ok()
    }
}
