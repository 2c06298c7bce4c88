//! How the hall stood, for files that begin with what was before.

use std::collections::VecDeque;
use std::time::Duration;

use crate::record::Entry;

/// What was told of the hall, as far back as a file may begin and once before that.
#[derive(Debug, Default)]
pub(super) struct HallNotes(VecDeque<Entry>);

impl HallNotes {
    /// Takes the next; no file begins longer than `reach` before it.
    pub(super) fn put(&mut self, note: Entry, reach: Duration) {
        let oldest = note.log_time.saturating_sub(u64::try_from(reach.as_nanos()).unwrap_or(u64::MAX));
        self.0.push_back(note);
        while self.0.get(1).is_some_and(|second| second.log_time < oldest) {
            self.0.pop_front();
        }
    }

    /// The last before a log time; `None` where nothing was told by then.
    pub(super) fn before(&self, log_time: u64) -> Option<&Entry> {
        self.0.iter().rev().find(|note| note.log_time < log_time)
    }
}
