//! What can be saved of a file of which a chunk is damaged: that chunk is passed over by the length that its head says, and what comes
//! behind it is read.

use std::io::Read;

use mcap::records::op;
use mcap::sans_io::linear_reader::LinearReaderOptions;

use super::walk::Walk;
use super::{MAGIC, Trouble, checked, each_of, walk_on};

/// A chunk of which nothing can be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LostChunk {
    /// Log times of its first and its last message, as its head has them, ns since 1970.
    pub(crate) span: (u64, u64),
    /// Why.
    pub(crate) trouble: Trouble,
}

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

/// The same as [`super::each_sound`] up to the summary, but a chunk that is damaged is handed to `lost`, and reading goes on behind it.
///
/// # Errors
/// That of `take`, or what else is wrong with the file.
pub(crate) fn each_saved<E: From<Trouble>>(
    input: impl Read,
    most: u64,
    mut take: impl FnMut(u8, &[u8]) -> Result<(), E>,
    mut lost: impl FnMut(LostChunk),
) -> Result<(), E> {
    let mut unpacked = 0_u64;
    let mut is_over = false;
    whole_chunks(input, most, plain(), |opcode, body| {
        is_over |= opcode == op::DATA_END;
        match opcode {
            _ if is_over => return Ok(()),
            op::CHUNK => {}
            _ => return take(opcode, body),
        }
        let inside = each_in_chunk(body, |opcode, body| {
            unpacked += body.len() as u64;
            take(opcode, body).map_err(WithinChunk::Taker)
        });
        match inside {
            Ok(()) if unpacked > most => Err(Trouble::TooLarge.into()),
            Ok(()) => Ok(()),
            Err(WithinChunk::Taker(error)) => Err(error),
            Err(WithinChunk::Chunk(trouble)) => {
                let at = |from: usize| body.get(from..).and_then(|rest| rest.first_chunk());
                let ns = |from| at(from).map_or(0, |octets| u64::from_le_bytes(*octets));
                lost(LostChunk { span: (ns(0), ns(8)), trouble });
                Ok(())
            }
        }
    })
}

/// Hands over the records that stand in no chunk, of the summary as well, up to where the file cannot be read.
pub(crate) fn each_outside(input: impl Read, most: u64, mut take: impl FnMut(u8, &[u8])) {
    // Why there is no more is told by whoever reads it for what it holds.
    let _: Result<(), Trouble> = whole_chunks(input, most, plain(), |opcode, body| {
        if opcode != op::CHUNK {
            take(opcode, body);
        }
        Ok(())
    });
}

/// A sum over all of a file is wrong where a chunk is.
fn plain() -> LinearReaderOptions {
    LinearReaderOptions::default().with_emit_chunks(true)
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
