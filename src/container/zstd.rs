//! zstd chunks, unpacked in Rust. What the `mcap` crate would do it with is libzstd, whose C takes longer to build than any
//! other library here.

use std::io::Read as _;

use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::{McapError, McapResult};
use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};

// RFC 8878, section 3.1.1, bytes.
const BLOCK_HEADER: usize = 3;
const CHECKSUM: usize = 4;
const LONGEST_BLOCK: usize = 128 * 1024;
/// Magic number and length of a frame that holds nothing for us.
const SKIP_HEADER: usize = 8;

/// Where in a chunk the next bytes belong.
#[derive(Clone, Copy)]
enum Part {
    /// To the header of a frame.
    Header,
    /// To a frame of which so many bytes are to be passed over.
    Skipped(usize),
    /// To a frame's blocks; the last may have a checksum behind it.
    Blocks { checked: bool },
}

/// Unpacks one block at a time, so that a few bytes never become more than a block and the frame's window in memory.
pub(super) struct Zstd {
    frame: FrameDecoder,
    part: Part,
}

impl Zstd {
    pub(super) fn new() -> Self {
        Self { frame: FrameDecoder::new(), part: Part::Header }
    }

    /// Takes what there is of the next part, and says how many bytes that were.
    fn take(&mut self, packed: &[u8]) -> McapResult<usize> {
        match self.part {
            _ if packed.is_empty() => Ok(0),
            Part::Header => self.begin(packed),
            Part::Skipped(left) => {
                let passed = left.min(packed.len());
                self.part = if passed == left { Part::Header } else { Part::Skipped(left - passed) };
                Ok(passed)
            }
            Part::Blocks { checked } => {
                let length = block_length(packed, checked);
                let Some(mut block) = length.and_then(|length| packed.get(..length)) else { return Ok(0) };
                let length = block.len();
                self.frame
                    .decode_blocks(&mut block, BlockDecodingStrategy::UptoBlocks(1))
                    .map_err(damaged)?;
                Ok(length)
            }
        }
    }

    fn begin(&mut self, packed: &[u8]) -> McapResult<usize> {
        use FrameDecoderError::ReadFrameHeaderError as Unread;
        let mut rest = packed;
        match self.frame.init(&mut rest) {
            Ok(()) => {
                let checked = packed.get(4).is_some_and(|descriptor| descriptor & 0b100 != 0);
                self.part = Part::Blocks { checked };
                Ok(packed.len() - rest.len())
            }
            Err(Unread(ReadFrameHeaderError::SkipFrame { length, .. })) => {
                self.part = Part::Skipped(usize::try_from(length).unwrap_or(usize::MAX));
                Ok(SKIP_HEADER)
            }
            Err(error) => Err(damaged(error)),
        }
    }
}

impl Decompressor for Zstd {
    fn next_read_size(&self) -> usize {
        BLOCK_HEADER + LONGEST_BLOCK + CHECKSUM
    }

    fn decompress(&mut self, packed: &[u8], unpacked: &mut [u8]) -> McapResult<DecompressResult> {
        let in_frame = matches!(self.part, Part::Blocks { .. }); // else the frame may hold what an abandoned chunk left
        let waiting = in_frame && self.frame.can_collect() > 0;
        if in_frame && !waiting && self.frame.is_finished() {
            self.part = Part::Header;
        }
        let consumed = if waiting { 0 } else { self.take(packed)? };
        let wrote = match self.part {
            Part::Blocks { .. } => self.frame.read(unpacked)?,
            Part::Header | Part::Skipped(_) => 0,
        };
        Ok(DecompressResult { consumed, wrote })
    }

    fn reset(&mut self) -> McapResult<()> {
        self.part = Part::Header;
        Ok(())
    }

    fn name(&self) -> &'static str {
        "zstd"
    }
}

/// Bytes of the block that these begin with, if its header is there.
fn block_length(packed: &[u8], checked: bool) -> Option<usize> {
    let header = packed.first_chunk::<BLOCK_HEADER>()?;
    let bits = usize::from(header[0]) | usize::from(header[1]) << 8 | usize::from(header[2]) << 16;
    let (last, repeated) = (bits & 1 != 0, bits >> 1 & 3 == 1);
    let content = if repeated { 1 } else { bits >> 3 };
    Some(BLOCK_HEADER + content + if last && checked { CHECKSUM } else { 0 })
}

fn damaged(error: impl std::fmt::Display) -> McapError {
    McapError::DecompressionError(error.to_string())
}
