//! How many datagrams and messages came to what end.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

/// What a count is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Count {
    Received,
    Foreign,
    Malformed,
    Refused,
    Forbidden,
    Early,
    Repeated,
    Done,
    NotDone,
    Unsent,
}

/// The words of the counts, in their order.
const WORDS: [&str; 10] = [
    "received",
    "foreign",
    "malformed",
    "refused",
    "forbidden",
    "early",
    "repeated",
    "done",
    "not_done",
    "unsent",
];

/// Counts since the port was opened.
///
/// Of datagrams: `received`; of these `foreign` (from an address that is no source) and `malformed`. Of messages: `refused`
/// (unknown, a bad value, turned off, or too many at once), `forbidden` (arm, home, clear and the like), `early` (in a
/// bundle for a later time), `repeated` (the same go, resume or seek within a second), `done` and `not_done` (by the
/// hall). `unsent`: feedback that the system did not take.
#[derive(Debug, Default)]
pub(crate) struct Counts([AtomicU64; WORDS.len()]);

impl Counts {
    pub(super) fn add(&self, what: Count) {
        self.0[what as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// All of them by their words, for the status.
    #[must_use]
    pub(crate) fn by_word(&self) -> BTreeMap<String, u64> {
        self.all().map(|(word, count)| (word.to_owned(), count)).into()
    }

    /// All of them with their words.
    #[must_use]
    pub(crate) fn all(&self) -> [(&'static str, u64); WORDS.len()] {
        std::array::from_fn(|place| (WORDS[place], self.0[place].load(Ordering::Relaxed)))
    }

    /// One of them by its word; 0 if none is called so.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn of(&self, word: &str) -> u64 {
        self.all().iter().find(|(name, _)| *name == word).map_or(0, |&(_, count)| count)
    }
}
