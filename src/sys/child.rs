//! A process that turns into another program beside the one that moves seats: it shares nothing with it, is an ordinary one whatever
//! that is, and is gone when that is.

use std::io;
use std::os::unix::process::CommandExt as _;
use std::process::Command;

use rustix::fs::{Mode, OFlags};
use rustix::process::{Signal, getppid, set_parent_process_death_signal, setpriority_process};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use super::realtime::normal_priority;

/// Turns the process into that program, for as long as the process of that number, which started it, is there. Comes back only where
/// that fails.
pub(crate) fn become_program(command: &mut Command, parent: u32) -> io::Error {
    if let Err(error) = set_parent_process_death_signal(Some(Signal::KILL)) {
        return error.into();
    }
    // It may have ended before that was set.
    if getppid().is_none_or(|now| now.as_raw_nonzero().get().unsigned_abs() != parent) {
        return io::ErrorKind::NotFound.into();
    }
    if let Err(error) = normal_priority() {
        return error;
    }
    let _ = setpriority_process(None, 0);
    leave_processors();
    // Where memory runs out it goes before the show does.
    let _ = write_own("/proc/self/oom_score_adj", b"500");
    keep_nothing_open();
    command.exec()
}

/// Leaves the processors that the seats were given, where they were given some.
fn leave_processors() {
    let Ok(given) = sched_getaffinity(None) else { return };
    let mut others = CpuSet::new();
    (0..CpuSet::MAX_CPU).filter(|number| !given.is_set(*number)).for_each(|number| others.set(number));
    // Where all were given there are no others, and the kernel refuses.
    let _ = sched_setaffinity(None, &others);
}

fn write_own(path: &str, what: &[u8]) -> io::Result<()> {
    let file = rustix::fs::open(path, OFlags::WRONLY | OFlags::CLOEXEC, Mode::empty())?;
    rustix::io::write(file, what)?;
    Ok(())
}

/// All that is open but standard input, output and error is closed when the program begins.
#[expect(unsafe_code, reason = "no safe wrapper of this call exists among our dependencies")]
fn keep_nothing_open() {
    // SAFETY: marks descriptors, and closes none of those that something here still uses. Where the kernel knows it not, each was marked
    // when it was opened.
    let _ = unsafe { libc::syscall(libc::SYS_close_range, 3_u32, u32::MAX, libc::CLOSE_RANGE_CLOEXEC) };
}
