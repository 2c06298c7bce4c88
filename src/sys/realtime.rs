//! Asks the kernel for real-time service and reads each answer back: a program that fell back to ordinary scheduling
//! without a word looks right on an idle desk and fails in the hall.

use std::num::NonZeroU64;
use std::{fs, io};

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, Rlimit, getrlimit, setpriority_process, setrlimit};
use rustix::thread::set_current_timer_slack;

use crate::plain;

/// The priority asked for: above every ordinary program, with room for an operator to put something above it.
pub(crate) const PRIORITY: u8 = 50;

/// How far below the tick thread the thread is that watches over it.
const BELOW: u8 = 10;

/// How the kernel schedules a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Policy {
    /// `SCHED_FIFO`: runs as soon as it can, until it sleeps.
    Fifo,
    /// `SCHED_RR`: as [`Policy::Fifo`], taking turns within its priority.
    RoundRobin,
    /// Any other: time is shared with every program of the machine.
    Other,
}

plain::displayed!(Policy {
    Self::Fifo => "fifo",
    Self::RoundRobin => "rr",
    Self::Other => "other",
});

/// What the kernel gave, as read back from it after asking.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RealTime {
    /// Scheduling policy of the calling thread.
    pub policy: Policy,
    /// Its real-time priority, 1 to 99; 0 if the policy has none.
    pub(crate) priority: u8,
    /// True if the memory of the process is kept from being paged out.
    pub memory_locked: bool,
    /// Each thing that was refused: what, why, and what to change; a sentence for a person.
    pub(crate) refusals: Vec<String>,
}

impl RealTime {
    /// That of a thread that did not ask.
    pub(crate) const NOTHING: Self =
        Self { policy: Policy::Other, priority: 0, memory_locked: false, refusals: Vec::new() };
}

/// Asks for real-time scheduling of the calling thread and for locked memory, and reads both back.
///
/// A real-time policy that the thread already has, as systemd's `CPUSchedulingPolicy=fifo` gives it, is kept as it is.
/// Without one, the thread's timer slack is set to 1 ns: the default delays every wake-up by 50 µs. To be called once
/// what is to be locked has been loaded.
#[must_use]
pub fn request() -> RealTime {
    let mut refusals = Vec::new();
    let (policy, priority) = request_priority(&mut refusals);
    let memory_locked = match lock_memory() {
        Ok(()) => true,
        Err(refusal) => {
            refusals.push(refusal);
            false
        }
    };
    RealTime { policy, priority, memory_locked, refusals }
}

/// Gives the calling thread ordinary scheduling, for helper threads of one that may be real-time: a policy is inherited.
///
/// # Errors
/// If the kernel refuses; giving up priority needs no right, so that is not to be expected.
pub fn normal_priority() -> io::Result<()> {
    set_scheduler(libc::SCHED_OTHER, 0)
}

/// Has the calling thread stand back behind the ordinary ones of the machine. Where the kernel refuses, it is one of them.
pub(crate) fn stand_back() {
    let _ = normal_priority();
    // On Linux a nice value is of a thread, although POSIX has one for the process.
    let _ = setpriority_process(None, 10);
}

/// Gives the calling thread real-time service below a thread of that priority, so that what it watches over does not hang on how
/// busy the machine is; says whether it has it. Where the kernel refuses, or that thread has none, it is an ordinary one.
#[must_use]
pub(crate) fn request_below(priority: u8) -> bool {
    let below = libc::c_int::from(priority.saturating_sub(BELOW).max(1));
    if priority > 1 && set_scheduler(libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, below).is_ok() {
        return scheduler().0 == Policy::Fifo;
    }
    let _ = normal_priority();
    false
}

/// Raises the limit of open files from the soft to the hard one and returns what it then is (`u64::MAX` if there is
/// none); every controller takes a socket, and the usual soft limit is 1,024.
///
/// # Errors
/// A sentence for a person, where the kernel refuses.
pub(crate) fn raise_open_files() -> Result<u64, String> {
    let limit = getrlimit(Resource::Nofile);
    if limit.current != limit.maximum {
        setrlimit(Resource::Nofile, Rlimit { current: limit.maximum, ..limit }).map_err(|cause| {
            format!(
                "raising the limit of open files from {} to {} was refused: {cause}; set LimitNOFILE= in the unit, \
                 or `ulimit -n`",
                words(limit.current),
                words(limit.maximum)
            )
        })?;
    }
    Ok(getrlimit(Resource::Nofile).current.unwrap_or(u64::MAX))
}

fn request_priority(refusals: &mut Vec<String>) -> (Policy, u8) {
    let asked = match scheduler() {
        (Policy::Fifo | Policy::RoundRobin, _) => Ok(()),
        // Reset on fork: threads that this one starts later are not real-time as well.
        (Policy::Other, _) => {
            set_scheduler(libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, libc::c_int::from(PRIORITY))
        }
    };
    let (policy, priority) = scheduler();
    if policy == Policy::Other {
        let cause =
            asked.err().map_or_else(|| String::from("granted, but not in force"), |cause| cause.to_string());
        refusals.push(format!(
            "real-time scheduling (SCHED_FIFO, priority {PRIORITY}) was refused: {cause}; set LimitRTPRIO={PRIORITY} in \
             the unit, `ulimit -r {PRIORITY}`, or give CAP_SYS_NICE (a cpu control group without a real-time share \
             refuses it even so)"
        ));
        if let Err(cause) = set_current_timer_slack(Some(NonZeroU64::MIN)) {
            refusals.push(format!("a timer slack of 1 ns was refused: {cause}; expect wake-ups 50 µs late"));
        }
    }
    (policy, priority)
}

/// Locks what the process has now; what it will get only where no limit can make that fail, because an allocation past
/// the limit then ends the program.
fn lock_memory() -> Result<(), String> {
    let limit = getrlimit(Resource::Memlock).current;
    let pages = match limit {
        None => MlockAllFlags::CURRENT | MlockAllFlags::FUTURE,
        Some(_) => MlockAllFlags::CURRENT,
    };
    let cause = match mlockall(pages) {
        Ok(()) => match not_in_force(fs::read_to_string("/proc/self/status")) {
            None => return Ok(()),
            Some(cause) => cause,
        },
        Err(cause) => cause.to_string(),
    };
    Err(format!(
        "locking the memory was refused: {cause} (the limit is {} bytes); set LimitMEMLOCK=infinity in the unit, or \
         `ulimit -l unlimited`",
        words(limit)
    ))
}

fn words(limit: Option<u64>) -> String {
    limit.map_or_else(|| String::from("unlimited"), |limit| limit.to_string())
}

/// Why a lock that was granted cannot be taken for one, by what the kernel says of the process.
fn not_in_force(status: io::Result<String>) -> Option<String> {
    match status {
        Ok(status) if vm_lck(&status) > 0 => None,
        Ok(_) => Some(String::from("granted, but VmLck in /proc/self/status is 0")),
        Err(cause) => Some(format!("granted, but /proc/self/status could not be read: {cause}")),
    }
}

/// Locked memory, in KiB; 0 if the kernel does not tell.
fn vm_lck(status: &str) -> u64 {
    let line = status.lines().find_map(|line| line.strip_prefix("VmLck:"));
    line.and_then(|value| value.trim().strip_suffix("kB")?.trim().parse().ok()).unwrap_or(0)
}

/// Policy and priority of the calling thread, as the kernel tells them.
#[expect(unsafe_code, reason = "no safe wrapper of these two calls exists among our dependencies")]
pub(super) fn scheduler() -> (Policy, u8) {
    let mut param = libc::sched_param { sched_priority: 0 };
    // SAFETY: 0 names the calling thread; `param` is a live, writable `sched_param` and outlives the call.
    let (policy, told) = unsafe { (libc::sched_getscheduler(0), libc::sched_getparam(0, &raw mut param)) };
    let policy = match policy & !libc::SCHED_RESET_ON_FORK {
        _ if policy < 0 || told < 0 => Policy::Other,
        libc::SCHED_FIFO => Policy::Fifo,
        libc::SCHED_RR => Policy::RoundRobin,
        _ => Policy::Other,
    };
    (policy, u8::try_from(param.sched_priority).unwrap_or(0))
}

#[expect(unsafe_code, reason = "no safe wrapper of this call exists among our dependencies")]
pub(super) fn set_scheduler(policy: libc::c_int, priority: libc::c_int) -> io::Result<()> {
    let param = libc::sched_param { sched_priority: priority };
    // SAFETY: 0 names the calling thread; `param` is a live `sched_param` that the kernel only reads.
    let answer = unsafe { libc::sched_setscheduler(0, policy, &raw const param) };
    if answer < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_locked_memory_is_found_in_the_status_of_the_process() {
        assert_eq!(vm_lck("Name:\tkinocue\nVmSize:\t  9000 kB\nVmLck:\t    1234 kB\n"), 1_234);
        assert_eq!(vm_lck("Name:\tkinocue\n"), 0);
        assert_eq!(vm_lck("VmLck:\tnonsense\n"), 0);
    }

    #[test]
    fn a_status_that_cannot_be_read_is_not_taken_for_one_without_locked_memory() {
        let told = |status| not_in_force(status).unwrap_or_default();
        assert_eq!(told(Ok("VmLck:\t 4 kB\n".to_owned())), "");
        assert!(told(Ok("VmLck:\t 0 kB\n".to_owned())).contains("VmLck"));
        let unread = told(Err(io::Error::from_raw_os_error(libc::EMFILE)));
        assert!(unread.contains("could not be read") && !unread.contains("VmLck"), "{unread}");
    }

    #[test]
    fn what_is_reported_is_what_the_kernel_says_and_each_lack_is_explained() {
        // In a thread of its own, so that no other test becomes real-time.
        std::thread::spawn(|| {
            let (policy, priority) = request_priority(&mut Vec::new());
            assert_eq!((policy, priority), scheduler());
            let mut refusals = Vec::new();
            request_priority(&mut refusals);
            assert_eq!(policy == Policy::Other, refusals.iter().any(|r| r.contains("LimitRTPRIO=50")));
            if policy == Policy::Fifo {
                assert!(request_below(priority));
                assert_eq!(scheduler(), (Policy::Fifo, priority - BELOW));
            }
            assert!(!request_below(0));
            assert_eq!(scheduler(), (Policy::Other, 0));
            normal_priority().unwrap();
            assert_eq!(scheduler(), (Policy::Other, 0));
        })
        .join()
        .unwrap();
    }

    #[test]
    fn open_files_may_be_as_many_as_the_hard_limit() {
        let limit = raise_open_files().unwrap();
        assert_eq!(Some(limit), getrlimit(Resource::Nofile).maximum.or(Some(u64::MAX)));
    }
}
