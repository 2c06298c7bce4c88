//! As `src/published/mod.rs`.

#![allow(dead_code, reason = "models need a part of it")]

/// Loom's, in place of `src/published/atomics.rs`.
pub(crate) mod atomics {
    pub(crate) use loom::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, AtomicU64, Ordering, fence};
}
#[path = "../../src/published/words.rs"]
mod words;

pub(crate) use words::{SharedWord, SharedWords};
