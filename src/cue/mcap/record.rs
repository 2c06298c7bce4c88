//! The records of an MCAP file, out of their chunks. The file is read by the `mcap` crate; the bodies of the few
//! records that matter are taken apart here, because the crate reserves as much memory as a length in the file claims.

use std::collections::BTreeMap;
use std::io::{BufReader, Read};

use mcap::McapError;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::super::fault::Place;
use super::super::limits::MAX_FILE;
use super::super::problem::Problem;
use super::walk::Walk;
use super::zstd::Zstd;
use crate::plain::escaped;

/// The longest record that is taken into memory; indexes of foreign writers can be some MB.
const MAX_RECORD: usize = 64 * 1024 * 1024;
/// How much is read at a time, whatever a length in the file asks for.
const READ: usize = 256 * 1024;

/// How much is told of what the reader met, bytes.
const REASON_TOLD: usize = 200;

/// Hands every record, its opcode and body, to `take`; stops at its first error or the file's, with its place: that of the
/// record, or of the chunk that holds it.
pub(super) fn each(
    input: impl Read,
    take: impl FnMut(u8, &[u8]) -> Result<(), Problem>,
) -> Result<(), (Place, Problem)> {
    let mut walk = Walk::new();
    each_of(input, &mut walk, take).map_err(|problem| match problem {
        Problem::Damaged(_) => (Place::Byte(walk.record()), problem),
        _ => (Place::File, problem),
    })
}

fn each_of(
    input: impl Read,
    walk: &mut Walk,
    mut take: impl FnMut(u8, &[u8]) -> Result<(), Problem>,
) -> Result<(), Problem> {
    let options = LinearReaderOptions::default()
        .with_validate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true)
        .with_record_length_limit(MAX_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    reader.add_decompressor(Zstd::new()).map_err(|error| problem(&error, 0, false))?;
    // No byte is read before it is asked for, so that the walk is where the reader is.
    let mut input = BufReader::with_capacity(READ, input);
    let (mut unpacked, mut begun) = (0_u64, false);
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let space = reader.insert(wanted.clamp(1, READ));
                let bytes = input.read(space).map_err(|error| Problem::Unread(error.to_string()))?;
                walk.pass(&space[..bytes]).map_err(Problem::Damaged)?;
                reader.notify_read(bytes);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                begun = true;
                unpacked += data.len() as u64 + 9; // opcode and length
                take(opcode, data)?;
            }
            Err(error) => return Err(problem(&error, walk.bytes(), begun)),
        }
        if walk.bytes() > MAX_FILE || unpacked > MAX_FILE {
            return Err(Problem::FileTooLarge);
        }
    }
    Ok(())
}

fn problem(error: &McapError, read: u64, begun: bool) -> Problem {
    match error {
        McapError::UnexpectedEof if read == 0 => Problem::Empty,
        McapError::UnexpectedEof => Problem::CutShort,
        McapError::BadMagic if !begun => Problem::Foreign("it does not begin as MCAP files do".to_owned()),
        other => Problem::Damaged(escaped(&other.to_string(), REASON_TOLD).into_owned()),
    }
}

/// Schema record: its id.
pub(super) fn schema(body: &[u8]) -> Option<u16> {
    RecordBody(body).u16()
}

/// ChannelRecord record.
pub(super) struct ChannelRecord<'a> {
    pub(super) id: u16,
    /// The schema of its messages; 0 is none.
    pub(super) schema: u16,
    pub(super) topic: &'a str,
    pub(super) encoding: &'a str,
}

impl<'a> ChannelRecord<'a> {
    pub(super) fn parse(body: &'a [u8]) -> Option<Self> {
        let mut body = RecordBody(body);
        Some(Self { id: body.u16()?, schema: body.u16()?, topic: body.text()?, encoding: body.text()? })
    }
}

/// Message record: channel, log time and data.
pub(super) fn message(body: &[u8]) -> Option<(u16, u64, &[u8])> {
    let mut body = RecordBody(body);
    let channel = body.u16()?;
    body.u32()?; // sequence
    let log_time = body.u64()?;
    body.u64()?; // publish time
    Some((channel, log_time, body.0))
}

/// Metadata record: name and entries.
pub(super) fn metadata(body: &[u8]) -> Option<(&str, BTreeMap<&str, &str>)> {
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
