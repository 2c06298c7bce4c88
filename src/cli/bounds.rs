//! What a process may take that the service starts for what is long or comes from outside.

use anyhow::Context as _;

use super::{Failure, OrExit as _};
use crate::sys::confined;
use crate::sys::humble::{self, ProcessBounds};

#[derive(Debug, clap::Args)]
pub(super) struct BoundsArgs {
    /// The most memory that it may take, MiB.
    #[arg(long, value_name = "N", default_value_t = 4096)]
    memory_mib: u64,
    /// The most processor time that it may take, s.
    #[arg(long, value_name = "N", default_value_t = 300)]
    seconds: u64,
}

impl BoundsArgs {
    /// Lowers this process and bounds what it may take; `what` is what it does, for the message.
    pub(super) fn lower(&self, what: &'static str) -> Result<(), Failure> {
        let bounds =
            ProcessBounds { memory: self.memory_mib.saturating_mul(1 << 20), cpu_s: self.seconds.max(1) };
        humble::lower(bounds).with_context(|| format!("cannot bound {what}")).or_system()
    }
}

/// Leaves this process nothing but what it has open, before it takes apart what comes from outside. Where the kernel has no way to do that,
/// which `kinocue doctor` says, its bounds are all that holds it.
pub(super) fn confine() {
    let _ = confined::confine();
}
