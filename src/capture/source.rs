//! A reader that knows how far it has come, and one block of memory that grows only by what was read.

use std::io::{self, Read};

use super::CaptureError;

/// Reads a capture front to back.
#[derive(Debug)]
pub(super) struct Source<R> {
    reader: R,
    at: u64,
    block: Vec<u8>,
}

impl<R: Read> Source<R> {
    pub(super) const fn new(reader: R) -> Self {
        Self { reader, at: 0, block: Vec::new() }
    }

    /// Bytes read so far.
    pub(super) const fn at(&self) -> u64 {
        self.at
    }

    /// What [`Source::fill`] read last.
    pub(super) fn block(&self) -> &[u8] {
        &self.block
    }

    /// The next bytes.
    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], CaptureError> {
        self.array_or_end()?.ok_or(CaptureError::Ends { at: self.at })
    }

    /// The next bytes; `None` if nothing is left.
    pub(super) fn array_or_end<const N: usize>(&mut self) -> Result<Option<[u8; N]>, CaptureError> {
        let mut bytes = [0; N];
        let mut filled = 0;
        while filled < N {
            match self.reader.read(&mut bytes[filled..]) {
                Ok(0) => break,
                Ok(more) => filled += more,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(CaptureError::Io(error)),
            }
        }
        self.at += filled as u64;
        match filled {
            0 => Ok(None),
            _ if filled < N => Err(CaptureError::Ends { at: self.at }),
            _ => Ok(Some(bytes)),
        }
    }

    /// Reads `len` bytes into the block.
    pub(super) fn fill(&mut self, len: u32) -> Result<(), CaptureError> {
        self.block.clear();
        let read = self.reader.by_ref().take(u64::from(len)).read_to_end(&mut self.block);
        self.passed(read.map(|read| read as u64), len)
    }

    /// Passes over `len` bytes.
    pub(super) fn skip(&mut self, len: u32) -> Result<(), CaptureError> {
        let read = io::copy(&mut self.reader.by_ref().take(u64::from(len)), &mut io::sink());
        self.passed(read, len)
    }

    fn passed(&mut self, read: io::Result<u64>, len: u32) -> Result<(), CaptureError> {
        let read = read.map_err(CaptureError::Io)?;
        self.at += read;
        if read < u64::from(len) { Err(CaptureError::Ends { at: self.at }) } else { Ok(()) }
    }
}

/// The order of the bytes in a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Big,
    Little,
}

impl ByteOrder {
    pub(super) const fn u16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::Big => u16::from_be_bytes(bytes),
            Self::Little => u16::from_le_bytes(bytes),
        }
    }

    pub(super) const fn u32(self, bytes: [u8; 4]) -> u32 {
        match self {
            Self::Big => u32::from_be_bytes(bytes),
            Self::Little => u32::from_le_bytes(bytes),
        }
    }

    pub(super) const fn u64(self, bytes: [u8; 8]) -> u64 {
        match self {
            Self::Big => u64::from_be_bytes(bytes),
            Self::Little => u64::from_le_bytes(bytes),
        }
    }
}

/// The bytes at a place, where there are as many.
pub(super) fn array_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}
