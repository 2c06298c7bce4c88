//! Octets as choices.

use std::time::Duration;

/// Choices that octets make, one after the other. Once the octets are used up there is none any more.
pub(super) struct Script<'a>(&'a [u8]);

impl<'a> Script<'a> {
    pub(super) const fn new(octets: &'a [u8]) -> Self {
        Self(octets)
    }

    pub(super) fn octet(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    pub(super) fn flag(&mut self) -> Option<bool> {
        self.octet().map(|octet| octet & 1 == 1)
    }

    /// A number below `end`, which is at most 256.
    pub(super) fn below(&mut self, end: usize) -> Option<usize> {
        self.octet().map(|octet| usize::from(octet) % end)
    }

    /// The same as a number of sixteen bits.
    pub(super) fn number(&mut self, end: u16) -> Option<u16> {
        self.octet().map(|octet| u16::from(octet) % end)
    }

    pub(super) fn one_of<T: Copy>(&mut self, all: &[T]) -> Option<T> {
        self.below(all.len()).map(|index| all[index])
    }

    pub(super) fn word(&mut self) -> Option<u16> {
        Some(u16::from_be_bytes([self.octet()?, self.octet()?]))
    }

    pub(super) fn long(&mut self) -> Option<u32> {
        Some(u32::from(self.word()?) << 16 | u32::from(self.word()?))
    }

    /// A span of mostly some milliseconds, and now and then of minutes.
    pub(super) fn span(&mut self) -> Option<Duration> {
        let octet = u64::from(self.octet()?);
        Some(Duration::from_millis(match octet {
            0..200 => octet,
            200..250 => (octet - 199) * 100,
            _ => (octet - 249) * 60_000,
        }))
    }
}
