//! Memory that stays where it is: a page that has to come from a disk stops a tick for milliseconds.

use super::{Line, Seen, some_of};
use crate::sys::machine::Limit;

/// What is known of memory.
#[derive(Debug, Clone)]
pub(crate) struct Memory {
    /// True if locking it was granted; else why not.
    pub(crate) locked: Result<(), String>,
    /// Bytes that may be locked without a right (`RLIMIT_MEMLOCK`).
    pub(crate) limit: Limit,
    /// What the machine swaps to.
    pub(crate) swaps: Seen<Vec<String>>,
}

const UNLIMITED: &str = "LimitMEMLOCK=infinity in the unit, or `@kinocue - memlock unlimited` in \
                         /etc/security/limits.d/kinocue.conf and log in anew; in a container: --ulimit memlock=-1";

impl Memory {
    /// One line for each.
    #[must_use]
    pub(crate) fn judge(&self) -> Vec<Line> {
        vec![self.lock(), self.lock_limit(), self.swap()]
    }

    fn lock(&self) -> Line {
        const ID: &str = "memory_lock";
        match &self.locked {
            Ok(()) => Line::ok(ID, "granted"),
            // Without swap only pages of the program's own file can leave.
            Err(why) if self.swaps.as_ref().is_ok_and(Vec::is_empty) => {
                Line::warn(ID, format!("refused: {why}"), UNLIMITED)
            }
            Err(why) => Line::bad(ID, format!("refused: {why}, and the machine may swap"), UNLIMITED),
        }
    }

    fn lock_limit(&self) -> Line {
        const ID: &str = "memory_lock_limit";
        match self.limit.soft {
            None => Line::ok(ID, "RLIMIT_MEMLOCK unlimited"),
            Some(bytes) => Line::warn(
                ID,
                format!(
                    "RLIMIT_MEMLOCK {bytes} bytes: only what is there at the start is locked, and only if it fits"
                ),
                UNLIMITED,
            ),
        }
    }

    fn swap(&self) -> Line {
        const ID: &str = "swap";
        match &self.swaps {
            Err(why) => Line::unknown(ID, why, "swapon --show"),
            Ok(swaps) if swaps.is_empty() => Line::ok(ID, "none"),
            Ok(swaps) if self.locked.is_ok() && self.limit.soft.is_none() => {
                Line::ok(ID, format!("{}; locked memory does not go there", some_of(swaps, 3)))
            }
            Ok(swaps) => Line::warn(
                ID,
                format!("{}, and not all memory is locked", some_of(swaps, 3)),
                "swapoff -a, and take it out of /etc/fstab; or see memory_lock_limit",
            ),
        }
    }
}
