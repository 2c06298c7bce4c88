//! A process that makes itself small: last in line for the processor, bounded in what it may take, first to go where memory
//! runs out, and gone when whoever started it is.

use std::{fs, io};

use rustix::process::{
    Resource, Rlimit, Signal, set_parent_process_death_signal, setpriority_process, setrlimit,
};

use super::realtime::set_scheduler;

/// What the process may take from now on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ProcessBounds {
    /// Address space, bytes.
    pub(crate) memory: u64,
    /// Processor time of all its threads, s.
    pub(crate) cpu_s: u64,
}

/// Lowers the calling process for good; to be called before it starts a thread. It writes no files and dumps no core.
///
/// # Errors
/// If the system refuses a bound. A refused priority is no error: nothing is at stake but the time of others.
pub(crate) fn lower(bounds: ProcessBounds) -> io::Result<()> {
    let _ = set_scheduler(libc::SCHED_IDLE, 0);
    let _ = setpriority_process(None, 19);
    let _ = fs::write("/proc/self/oom_score_adj", "1000");
    set_parent_process_death_signal(Some(Signal::KILL))?;
    let ProcessBounds { memory, cpu_s } = bounds;
    let limits = [(Resource::As, memory), (Resource::Cpu, cpu_s), (Resource::Fsize, 0), (Resource::Core, 0)];
    for (resource, most) in limits {
        // What whoever started it allows at most cannot be raised, and need not.
        let most = rustix::process::getrlimit(resource).maximum.map_or(most, |given| given.min(most));
        setrlimit(resource, Rlimit { current: Some(most), maximum: Some(most) })?;
    }
    Ok(())
}
