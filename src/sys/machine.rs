//! What the kernel grants this process and what it says of the machine's time, asked without leaving a trace: a trial of
//! real-time scheduling ends with the thread that it was made on, a trial of locked memory is undone.

use std::num::NonZeroU64;
use std::{io, mem, thread};

use rustix::mm::{MlockAllFlags, mlockall, munlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{current_timer_slack, set_current_timer_slack};
use rustix::time::{ClockId, clock_getres};

use super::realtime::{PRIORITY, Policy, scheduler, set_scheduler};

/// What came of asking for real-time scheduling, on a thread that has ended since.
#[derive(Debug)]
pub(crate) struct Trial {
    /// True if whoever started the process gave the asking thread a real-time policy; then none was asked for.
    pub(crate) given: bool,
    /// Policy and priority that a play would have; the priority is 0 where the policy has none.
    pub(crate) in_force: (Policy, u8),
    /// Why the kernel refused; `None` where it did not.
    pub(crate) refusal: Option<io::Error>,
    /// Timer slack that a thread of this process begins with, ns; `None` where the kernel does not tell.
    pub(crate) slack_ns: Option<u64>,
    /// True if a timer slack of 1 ns was accepted.
    pub(crate) slack_settable: bool,
}

/// Tries on a thread of its own what a play asks for: `SCHED_FIFO` at [`PRIORITY`], and a timer slack of 1 ns. A
/// real-time policy that the calling thread has already, as systemd's `CPUSchedulingPolicy=fifo` gives it, is what a play
/// keeps; another thread might be refused it, so it is not asked for.
///
/// # Errors
/// If no thread can be started.
///
/// # Panics
/// If the thread panicked, which nothing in it does.
pub(crate) fn try_realtime() -> io::Result<Trial> {
    let own = scheduler();
    let given = own.0 != Policy::Other;
    let trial = thread::Builder::new().spawn(move || {
        let slack_ns = current_timer_slack().ok();
        let slack_settable = set_current_timer_slack(Some(NonZeroU64::MIN)).is_ok();
        if given {
            return Trial { given, in_force: own, refusal: None, slack_ns, slack_settable };
        }
        let asked = set_scheduler(libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, libc::c_int::from(PRIORITY));
        Trial { given, in_force: scheduler(), refusal: asked.err(), slack_ns, slack_settable }
    })?;
    Ok(trial.join().expect("nothing in the trial panics"))
}

/// Locks the memory that the process has now, and unlocks it again.
///
/// # Errors
/// If the kernel refuses.
pub(crate) fn try_memory_lock() -> io::Result<()> {
    mlockall(MlockAllFlags::CURRENT)?;
    munlockall()?;
    Ok(())
}

/// A limit of this process; `None` where there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ProcessLimit {
    /// What holds now.
    pub(crate) soft: Option<u64>,
    /// As far as the process may raise it.
    pub(crate) hard: Option<u64>,
}

/// The limits that matter to a play.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ProcessLimits {
    /// The highest real-time priority without a right (`RLIMIT_RTPRIO`).
    pub(crate) priority: ProcessLimit,
    /// Bytes that may be locked without a right (`RLIMIT_MEMLOCK`).
    pub(crate) locked: ProcessLimit,
    /// Files open at once (`RLIMIT_NOFILE`).
    pub(crate) files: ProcessLimit,
}

/// Reads the limits of this process.
#[must_use]
pub(crate) fn limits() -> ProcessLimits {
    let limit = |resource| {
        let told = getrlimit(resource);
        ProcessLimit { soft: told.current, hard: told.maximum }
    };
    ProcessLimits {
        priority: limit(Resource::Rtprio),
        locked: limit(Resource::Memlock),
        files: limit(Resource::Nofile),
    }
}

/// How well the wall clock is held to the true time, as the kernel has it from whoever disciplines it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ClockSync {
    /// True if anything disciplines it: neither `TIME_ERROR` nor `STA_UNSYNC`.
    pub(crate) synchronised: bool,
    /// The most that it may be wrong by, µs; grows while nobody disciplines it.
    pub(crate) max_error_us: u64,
}

/// Asks how well the wall clock is held; sets nothing (`adjtimex` with no modes).
///
/// # Errors
/// If the kernel, or a filter of the container, refuses to tell.
#[expect(unsafe_code, reason = "no safe wrapper of this call exists among our dependencies")]
pub(crate) fn clock_sync() -> io::Result<ClockSync> {
    // SAFETY: `timex` is a plain C structure of integers, for which all-zero bytes are a valid value; so `modes` is 0.
    let mut told: libc::timex = unsafe { mem::zeroed() };
    // SAFETY: `told` is a live, writable `timex` and outlives the call.
    let state = unsafe { libc::adjtimex(&raw mut told) };
    if state < 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(ClockSync {
        synchronised: state != libc::TIME_ERROR && told.status & libc::STA_UNSYNC == 0,
        max_error_us: u64::try_from(told.maxerror).unwrap_or(0),
    })
}

/// True if the kernel says that the wall clock is held to the true time; a kernel that does not say is taken for one that says no.
#[must_use]
pub(crate) fn clock_is_synchronised() -> bool {
    clock_sync().is_ok_and(|sync| sync.synchronised)
}

/// The finest step of a sleep on the monotonic clock, ns: 1 with high-resolution timers, a kernel tick without.
#[must_use]
pub(crate) fn timer_resolution_ns() -> u64 {
    let step = clock_getres(ClockId::Boottime);
    let part = |part: i64| u64::try_from(part).unwrap_or(0);
    part(step.tv_sec).saturating_mul(1_000_000_000).saturating_add(part(step.tv_nsec))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_leaves_the_asking_thread_as_it_was() {
        let before = scheduler();
        let trial = try_realtime().unwrap();
        assert_eq!(trial.refusal.is_none(), trial.in_force.0 != Policy::Other);
        assert_eq!(scheduler(), before);
    }

    #[test]
    fn what_the_kernel_tells_is_within_reason() {
        assert!(timer_resolution_ns() > 0);
        let files = limits().files;
        assert!(files.soft.unwrap_or(u64::MAX) <= files.hard.unwrap_or(u64::MAX));
        if let Ok(sync) = clock_sync() {
            assert!(sync.max_error_us <= clock_sync().unwrap().max_error_us || sync.synchronised);
        }
    }
}
