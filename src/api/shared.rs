//! What all handlers share.

use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::Duration;

use hyper::body::Bytes;
use tokio::sync::{Semaphore, watch};

use super::access::Access;
use super::once::Once;
use super::tries::Tries;
use super::{Metrics, Pages, Ticks};
use crate::hall::{Handle, Status};
use crate::library::Library;
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// How long the tick counter may stand still in a process that is well.
const STILL: Duration = Duration::from_secs(1);
/// Statuses that are pushed to so many at a time.
const STREAMS: usize = 32;

/// What all handlers share; none of it is ever held while somebody waits.
pub(super) struct Shared {
    /// The way to the hall.
    pub(super) handle: Handle,
    /// Who may come in.
    pub(super) access: RwLock<Arc<Access>>,
    /// Wrong tokens.
    pub(super) tries: Tries,
    /// Requests that may come twice.
    pub(super) once: Once,
    /// Room for those who are pushed to.
    pub(super) streams: Arc<Semaphore>,
    /// Whether the server ends.
    pub(super) closing: watch::Receiver<bool>,
    /// The description of all this, JSON.
    pub(super) document: Bytes,
    /// The library of cues.
    pub(super) library: Library,
    /// Figures for Prometheus.
    pub(super) metrics: Metrics,
    /// The console.
    pub(super) pages: Pages,
    pulse: Pulse,
    written: Mutex<Option<(Arc<Status>, Bytes)>>,
}
