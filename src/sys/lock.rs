//! Locks of threads that may panic. Never for the tick thread.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// What is behind a lock, which has to be whole at any time: it is taken also where a thread that held it panicked.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
