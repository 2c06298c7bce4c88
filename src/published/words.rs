//! One word, and several that belong together.

use super::atomics::{AtomicU32, AtomicU64, Ordering, fence};

/// One word; 0 before the first.
#[derive(Debug, Default)]
pub(crate) struct SharedWord(AtomicU64);

impl SharedWord {
    /// The newest. Whoever sees it sees everything that was written before it was put.
    pub(crate) fn get(&self) -> u64 {
        self.0.load(Ordering::Acquire)
    }

    /// Puts the next.
    pub(crate) fn put(&self, word: u64) {
        self.0.store(word, Ordering::Release);
    }
}

/// So many words that belong together, for one writer and any reader.
#[derive(Debug)]
pub(crate) struct SharedWords<const N: usize> {
    /// Odd while they are being written; 0 before the first.
    version: AtomicU32,
    words: [AtomicU64; N],
}

impl<const N: usize> Default for SharedWords<N> {
    fn default() -> Self {
        Self { version: AtomicU32::default(), words: std::array::from_fn(|_| AtomicU64::default()) }
    }
}

impl<const N: usize> SharedWords<N> {
    /// Publishes the next. Only one thread may.
    pub(crate) fn put(&self, words: [u64; N]) {
        let version = self.version.load(Ordering::Relaxed);
        self.version.store(version.wrapping_add(1), Ordering::Relaxed);
        // Nothing of them is seen before the version is odd.
        fence(Ordering::Release);
        for (cell, word) in self.words.iter().zip(words) {
            cell.store(word, Ordering::Relaxed);
        }
        // Zero stays for "none": after 2^31 of them the count begins anew.
        let next = version.wrapping_add(2);
        self.version.store(if next == 0 { 2 } else { next }, Ordering::Release);
    }

    /// Which are the newest; 0 before the first.
    pub(crate) fn version(&self) -> u32 {
        self.version.load(Ordering::Acquire)
    }

    /// The newest and their version; none before the first, and while others are being written.
    pub(crate) fn get(&self) -> Option<(u32, [u64; N])> {
        let version = self.version();
        if version == 0 || version % 2 == 1 {
            return None;
        }
        let words = std::array::from_fn(|place| self.words[place].load(Ordering::Relaxed));
        // What was loaded before this is of one version if the version is still the same after it.
        fence(Ordering::Acquire);
        (self.version.load(Ordering::Relaxed) == version).then_some((version, words))
    }

    /// As after so many of them, for tests of what comes then.
    #[cfg(test)]
    pub(super) fn at_version(version: u32) -> Self {
        Self { version: AtomicU32::new(version), ..Self::default() }
    }
}
