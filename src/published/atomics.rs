//! The atomics of everything that `tests/models` tries: the standard library's, and there loom's in their place.

pub(crate) use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, AtomicU64, Ordering, fence};
