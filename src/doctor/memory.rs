//! Memory that stays where it is: a page that has to come from a disk stops a tick for milliseconds.

use super::{FindingLine, Seen, some_of};
use crate::sys::machine::ProcessLimit;

/// What is known of memory.
#[derive(Debug, Clone)]
pub(crate) struct MemoryFacts {
    /// True if locking it was granted; else why not.
    pub(crate) locked: Result<(), String>,
    /// Bytes that may be locked without a right (`RLIMIT_MEMLOCK`).
    pub(crate) limit: ProcessLimit,
    /// What the machine swaps to.
    pub(crate) swaps: Seen<Vec<String>>,
}

const UNLIMITED: &str = "LimitMEMLOCK=infinity in the unit, or `@kinocue - memlock unlimited` in \
                         /etc/security/limits.d/kinocue.conf and log in again; in a container: --ulimit memlock=-1";

impl MemoryFacts {
    /// One line for each.
    #[must_use]
    pub(crate) fn judge(&self) -> Vec<FindingLine> {
        vec![self.lock(), self.lock_limit(), self.swap()]
    }

    fn lock(&self) -> FindingLine {
        const ID: &str = "memory_lock";
        match &self.locked {
            Ok(()) => FindingLine::ok(ID, "granted"),
            // Without swap only pages of the program's own file can leave.
            Err(why) if self.swaps.as_ref().is_ok_and(Vec::is_empty) => {
                FindingLine::warn(ID, format!("refused: {why}"), UNLIMITED)
            }
            Err(why) => FindingLine::bad(ID, format!("refused: {why}, and the machine may swap"), UNLIMITED),
        }
    }

    fn lock_limit(&self) -> FindingLine {
        const ID: &str = "memory_lock_limit";
        match self.limit.soft {
            None => FindingLine::ok(ID, "RLIMIT_MEMLOCK unlimited"),
            Some(bytes) => FindingLine::warn(
                ID,
                format!(
                    "RLIMIT_MEMLOCK {bytes} bytes: only the memory in use at the start is locked, and only if it fits"
                ),
                UNLIMITED,
            ),
        }
    }

    fn swap(&self) -> FindingLine {
        const ID: &str = "swap";
        match &self.swaps {
            Err(why) => FindingLine::unknown(ID, why, "swapon --show"),
            Ok(swaps) if swaps.is_empty() => FindingLine::ok(ID, "none"),
            Ok(swaps) if self.locked.is_ok() && self.limit.soft.is_none() => {
                FindingLine::ok(ID, format!("{}; locked memory does not go there", some_of(swaps, 3)))
            }
            Ok(swaps) => FindingLine::warn(
                ID,
                format!("{}, and not all memory is locked", some_of(swaps, 3)),
                "swapoff -a, and remove it from /etc/fstab; or see memory_lock_limit",
            ),
        }
    }
}
