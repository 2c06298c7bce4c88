//! Chunks as they stand in a file, taken apart one by one.

use std::io::Read;

use mcap::records::op;
use mcap::sans_io::linear_reader::LinearReaderOptions;

use super::walk::Walk;
use super::{MAGIC, Trouble, checked, each_of, walk_on};

/// Why reading ends within a chunk.
pub(super) enum WithinChunk<E> {
    /// It is damaged.
    Chunk(Trouble),
    /// Whoever takes its records will have no more.
    Taker(E),
}

impl<E> From<Trouble> for WithinChunk<E> {
    fn from(trouble: Trouble) -> Self {
        Self::Chunk(trouble)
    }
}

/// Hands over all records outside of chunks, and chunks as they stand there.
pub(super) fn whole_chunks<E: From<Trouble>>(
    input: impl Read,
    most: u64,
    options: LinearReaderOptions,
    take: impl FnMut(u8, &[u8]) -> Result<(), E>,
) -> Result<(), E> {
    let read = each_of(input, most, options, take);
    read.map_err(|(_, error)| error)
}

/// Hands over the records in a chunk, as it stands in a file; none before its sum is right.
pub(super) fn each_in_chunk<E: From<Trouble>>(
    chunk: &[u8],
    mut take: impl FnMut(u8, &[u8]) -> Result<(), E>,
) -> Result<(), E> {
    let (file, options) = (alone(chunk), checked().with_prevalidate_chunk_crcs(true));
    walk_on(file.as_slice(), &mut Walk::new(u64::MAX), u64::MAX, options, |opcode, body| match opcode {
        op::DATA_END | op::FOOTER => Ok(()),
        _ => take(opcode, body),
    })
}

/// A file that has this chunk alone.
fn alone(chunk: &[u8]) -> Vec<u8> {
    let record = |opcode: u8, body: &[u8]| {
        [&[opcode][..], (body.len() as u64).to_le_bytes().as_slice(), body].concat()
    };
    [MAGIC, &record(op::CHUNK, chunk), &record(op::DATA_END, &[0; 4]), &record(op::FOOTER, &[0; 20]), MAGIC]
        .concat()
}
