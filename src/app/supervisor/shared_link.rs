//! The way to the controllers' registers, which one job after the other has.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::rt::Line;

/// A line that is shared. It cannot get lost with a job that did not even begin.
#[derive(Debug, Clone)]
pub(super) struct SharedLink(Arc<Mutex<Line>>);

impl SharedLink {
    pub(super) fn of(line: Line) -> Self {
        Self(Arc::new(Mutex::new(line)))
    }

    /// Holds it for one conversation; of two jobs the second waits.
    pub(super) fn hold(&self) -> MutexGuard<'_, Line> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
