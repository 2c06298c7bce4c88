//! What is written down: what was asked by whom, and what was played.

use std::collections::VecDeque;

use super::Keeper;
use crate::hall::JournalLine;

/// Lines that every status carries.
const NEWEST: usize = 20;

/// What was written down lately.
#[derive(Debug, Default)]
pub(super) struct Records {
    newest: VecDeque<JournalLine>,
}

impl Records {
    /// The newest lines, newest first.
    pub(super) fn newest(&self) -> Vec<JournalLine> {
        self.newest.iter().cloned().collect()
    }

    /// Keeps a line.
    pub(super) fn keep(&mut self, line: JournalLine) {
        self.newest.push_front(line);
        self.newest.truncate(NEWEST);
    }
}

impl Keeper {
    /// A show is about to begin.
    pub(super) fn begin_record(&mut self, _who: &str) {}

    /// It did not.
    pub(super) fn drop_record(&mut self) {}

    /// A show is over.
    pub(super) fn end_record(&mut self, _how: &str) {}
}
