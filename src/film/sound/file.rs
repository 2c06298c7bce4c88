//! The file of an index. All numbers are little-endian:
//!
//! ```text
//!  "KINOKIDX"  version u16  name u16 + UTF-8  blocks of the trace u32  landmarks u32
//!  each block   scale u8, 128 samples of 4 bits (`trace`)
//!  landmarks    hash u24, spectrum u24, by hash (`landmarks`)
//!  SHA-256 of all before
//! ```

use sha2::{Digest as _, Sha256};

use super::index::SoundIndex;
use super::landmarks::Landmark;
use super::trace::{BLOCK_OCTETS, PackedTrace};

const MAGIC: &[u8; 8] = b"KINOKIDX";
const VERSION: u16 = 1;
const SUM: usize = 32;
const MARK: usize = 6;
/// A name is no longer, octets.
const NAME_MOST: usize = 200;
/// The longest index that is read: some 14 hours.
pub(crate) const MOST_OCTETS: u64 = 64 << 20;

/// Why octets are no index that can be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum IndexFault {
    /// Something else.
    #[error("this is not an index of a film's sound; make one with `kinocue sync index FILM -o FILE.kidx`")]
    Foreign,
    /// Made by another version.
    #[error(
        "it is an index of version {0}, but this program reads version {VERSION}; make it again with `kinocue sync index`"
    )]
    Version(u16),
    /// Cut short, or more than that.
    #[error("it has {found} bytes instead of {said}; copy it again, or make it again")]
    Length { found: u64, said: u64 },
    /// Longer than the index of any film.
    #[error(
        "it is longer than {MOST_OCTETS} bytes, too long for a film; make an index with `kinocue sync index FILM -o FILE.kidx`"
    )]
    Long,
    /// Its sum is not that of what is in it.
    #[error("it is damaged: its checksum is wrong; copy it again, or make it again")]
    Sum,
    /// Its sum fits, and its content makes no sense.
    #[error("{0}; make it again with `kinocue sync index`")]
    Content(&'static str),
}

impl SoundIndex {
    /// The octets of its file.
    pub(crate) fn to_octets(&self) -> Vec<u8> {
        let mut octets = MAGIC.to_vec();
        let name = self.name.as_bytes();
        octets.extend(VERSION.to_le_bytes());
        octets.extend((name.len() as u16).to_le_bytes());
        octets.extend(name);
        octets.extend(((self.trace.octets().len() / BLOCK_OCTETS) as u32).to_le_bytes());
        octets.extend((self.landmarks.len() as u32).to_le_bytes());
        octets.extend(self.trace.octets());
        for mark in &self.landmarks {
            octets.extend(&mark.hash.to_le_bytes()[..3]);
            octets.extend(&mark.frame.to_le_bytes()[..3]);
        }
        octets.extend(Sha256::digest(&octets));
        octets
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`IndexFault`].
    pub(crate) fn of_octets(octets: &[u8]) -> Result<Self, IndexFault> {
        let mut rest = Rest(octets.strip_prefix(MAGIC).ok_or(IndexFault::Foreign)?);
        let cut = |said: usize| IndexFault::Length { found: octets.len() as u64, said: said as u64 };
        let head = MAGIC.len() + 12;
        let version = rest.u16().ok_or_else(|| cut(head))?;
        if version != VERSION {
            return Err(IndexFault::Version(version));
        }
        let length = usize::from(rest.u16().ok_or_else(|| cut(head))?);
        let name = rest.take(length).ok_or_else(|| cut(head + length))?;
        let [blocks, marks] = [(); 2].map(|()| rest.u32().map(|count| count as usize));
        let (Some(blocks), Some(marks)) = (blocks, marks) else { return Err(cut(head + length)) };
        // A file may say any number: none may wrap to a length that fits.
        let (trace, landmarks) = (blocks.saturating_mul(BLOCK_OCTETS), marks.saturating_mul(MARK));
        let said = (head + length).saturating_add(trace).saturating_add(landmarks).saturating_add(SUM);
        if octets.len() != said {
            return Err(cut(said));
        }
        let (body, sum) = octets.split_at(octets.len() - SUM);
        if Sha256::digest(body).as_slice() != sum {
            return Err(IndexFault::Sum);
        }
        let (trace, landmarks) =
            (rest.take(trace).unwrap_or_default(), rest.take(landmarks).unwrap_or_default());
        Self::of_parts(name, trace, landmarks)
    }

    fn of_parts(name: &[u8], trace: &[u8], landmarks: &[u8]) -> Result<Self, IndexFault> {
        let name = std::str::from_utf8(name).ok().filter(|name| is_name(name));
        let name = name.ok_or(IndexFault::Content("it has no valid name"))?.to_owned();
        let u24 = |octets: &[u8]| u32::from_le_bytes([octets[0], octets[1], octets[2], 0]);
        let mark = |octets: &[u8]| Landmark { hash: u24(octets), frame: u24(&octets[3..]) };
        let landmarks: Vec<Landmark> = landmarks.chunks_exact(MARK).map(mark).collect();
        if !landmarks.is_sorted() {
            return Err(IndexFault::Content("its landmarks are not in order"));
        }
        Ok(Self { name, landmarks, trace: PackedTrace::of(trace.to_vec()) })
    }
}

/// True if a film may be called that.
pub(crate) fn is_name(name: &str) -> bool {
    (1..=NAME_MOST).contains(&name.len()) && !name.chars().any(char::is_control)
}

/// What of a file has not been read.
struct Rest<'o>(&'o [u8]);

impl<'o> Rest<'o> {
    fn take(&mut self, count: usize) -> Option<&'o [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn u16(&mut self) -> Option<u16> {
        self.take(2).map(|octets| u16::from_le_bytes([octets[0], octets[1]]))
    }

    fn u32(&mut self) -> Option<u32> {
        self.take(4).map(|octets| u32::from_le_bytes([octets[0], octets[1], octets[2], octets[3]]))
    }
}
