//! A thread that can do nothing any more but work, read what it has open and write to what it has open: what takes apart a file from
//! outside opens nothing, sends nothing, starts nothing and touches no other process, even where the file has made it somebody else's.
//!
//! A filter of system calls (seccomp) says so to the kernel. It names what stays; all else is refused with `EPERM`. It needs no right, no
//! file system and no setting, holds for all threads that are started from then on, and is never lifted.

use std::{io, thread};

use rustix::thread::set_no_new_privs;

/// What an argument has to be, in its lower 32 bits, so that the call stays.
#[derive(Debug, Clone, Copy)]
struct Argument {
    index: u8,
    mask: u32,
    is: u32,
}

/// A system call that stays.
type Rule = (libc::c_long, Option<Argument>);

const fn only(index: u8, mask: u32, is: u32) -> Option<Argument> {
    Some(Argument { index, mask, is })
}

/// Nothing that it maps can be run.
const NO_CODE: Option<Argument> = only(2, libc::PROT_EXEC.cast_unsigned(), 0);
const THREAD: u32 = libc::CLONE_THREAD.cast_unsigned();

/// What a process needs that reads, works with threads, and answers. Of a file it learns nothing by a path: the kernel does not let a
/// filter see which, so that `statx` and `newfstatat` stay for no file, not even for one that is open.
const STAYS: &[Rule] = &[
    (libc::SYS_read, None),
    (libc::SYS_readv, None),
    (libc::SYS_pread64, None),
    (libc::SYS_write, None),
    (libc::SYS_writev, None),
    (libc::SYS_lseek, None),
    (libc::SYS_close, None),
    (libc::SYS_fstat, None),
    (libc::SYS_brk, None),
    (libc::SYS_mmap, NO_CODE),
    (libc::SYS_mprotect, NO_CODE),
    (libc::SYS_mremap, None),
    (libc::SYS_munmap, None),
    (libc::SYS_madvise, None),
    (libc::SYS_futex, None),
    (libc::SYS_clone, only(0, THREAD, THREAD)),
    (libc::SYS_set_robust_list, None),
    (libc::SYS_rseq, None),
    (libc::SYS_prctl, only(0, u32::MAX, libc::PR_SET_NAME.cast_unsigned())),
    (libc::SYS_sched_getaffinity, None),
    (libc::SYS_sched_yield, None),
    (libc::SYS_gettid, None),
    (libc::SYS_getpid, None),
    (libc::SYS_getrandom, None),
    (libc::SYS_clock_gettime, None),
    (libc::SYS_rt_sigaction, None),
    (libc::SYS_rt_sigprocmask, None),
    (libc::SYS_rt_sigreturn, None),
    (libc::SYS_sigaltstack, None),
    (libc::SYS_restart_syscall, None),
    (libc::SYS_exit, None),
    (libc::SYS_exit_group, None),
];

/// The machine whose numbers those are (`linux/audit.h`): a call by those of another is the end of the process.
const MACHINE: Option<u32> = if cfg!(target_arch = "x86_64") {
    Some(0xc000_003e)
} else if cfg!(target_arch = "aarch64") {
    Some(0xc000_00b7)
} else {
    None
};

/// Places in `struct seccomp_data`: number, machine, then six arguments of 64 bits from there, the lower half first.
const NUMBER_AT: u32 = 0;
const MACHINE_AT: u32 = 4;
const ARGUMENTS_AT: u32 = 16;

/// Leaves the calling thread, and those that it starts from now on, nothing but [`STAYS`], for good.
///
/// # Errors
/// If the kernel takes no filter, or the machine is one whose numbers are not known here; nothing is confined then.
#[expect(unsafe_code, reason = "no safe wrapper of this call exists among our dependencies")]
pub(crate) fn confine() -> io::Result<()> {
    let machine = MACHINE.ok_or(io::ErrorKind::Unsupported)?;
    let mut filter = filter(machine);
    let len = u16::try_from(filter.len()).map_err(io::Error::other)?;
    let program = libc::sock_fprog { len, filter: filter.as_mut_ptr() };
    set_no_new_privs(true)?; // who can gain no rights needs none for a filter
    // SAFETY: `program` points to `len` instructions, which live until the kernel has copied them.
    match unsafe { libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, &raw const program, 0, 0) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// Tries it on a thread of its own, which is gone afterwards.
///
/// # Errors
/// As [`confine`]; or if a file can be opened all the same.
pub(crate) fn try_confinement() -> io::Result<()> {
    let trial = thread::Builder::new().spawn(|| {
        confine()?;
        match std::fs::File::open("/proc/self/stat") {
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => Ok(()),
            _ => Err(io::Error::other("the kernel took the filter, and does not keep it")),
        }
    })?;
    trial.join().expect("nothing in the trial panics")
}

/// The filter as the kernel runs it, call by call.
fn filter(machine: u32) -> Vec<libc::sock_filter> {
    let mut filter = vec![
        load(MACHINE_AT),
        unless(machine, 1),
        jump_over(1),
        end(libc::SECCOMP_RET_KILL_PROCESS),
        load(NUMBER_AT),
    ];
    // The C library then takes `clone`, whose flags can be seen.
    filter.extend([unless(number(libc::SYS_clone3), 1), refuse(libc::ENOSYS)]);
    // Whoever aborts signals itself.
    let abort = (libc::SYS_tgkill, only(0, u32::MAX, std::process::id()));
    for &(call, argument) in STAYS.iter().chain([&abort]) {
        match argument {
            None => filter.extend([unless(number(call), 1), end(libc::SECCOMP_RET_ALLOW)]),
            Some(Argument { index, mask, is }) => filter.extend([
                unless(number(call), 5),
                load(ARGUMENTS_AT + 8 * u32::from(index)),
                instruction(libc::BPF_ALU | libc::BPF_AND | libc::BPF_K, mask, 0),
                unless(is, 1),
                end(libc::SECCOMP_RET_ALLOW),
                refuse(libc::EPERM),
            ]),
        }
    }
    filter.push(refuse(libc::EPERM));
    filter
}

fn number(call: libc::c_long) -> u32 {
    u32::try_from(call).expect("calls have small numbers")
}

fn load(at: u32) -> libc::sock_filter {
    instruction(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, at, 0)
}

/// Goes on with the next where what was loaded is `value`, else so many further.
fn unless(value: u32, further: u8) -> libc::sock_filter {
    instruction(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, value, further)
}

fn jump_over(further: u32) -> libc::sock_filter {
    instruction(libc::BPF_JMP | libc::BPF_JA, further, 0)
}

fn end(verdict: u32) -> libc::sock_filter {
    instruction(libc::BPF_RET | libc::BPF_K, verdict, 0)
}

fn refuse(error: libc::c_int) -> libc::sock_filter {
    end(libc::SECCOMP_RET_ERRNO | error.cast_unsigned())
}

fn instruction(code: u32, k: u32, jf: u8) -> libc::sock_filter {
    let code = u16::try_from(code).expect("codes have sixteen bits");
    libc::sock_filter { code, jt: 0, jf, k }
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File, OpenOptions};
    use std::io::{Read as _, Write as _};
    use std::net::{TcpListener, UdpSocket};
    use std::os::unix::net::UnixStream;
    use std::process::Command;

    use rustix::mm::{MapFlags, ProtFlags, mmap_anonymous, munmap};
    use rustix::process::{getpid, test_kill_process};

    use super::*;

    /// What comes of something that a confined thread does; `None` where the kernel takes no filter.
    fn confined<T: Send + 'static>(does: impl FnOnce() -> T + Send + 'static) -> Option<T> {
        let thread = thread::spawn(|| confine().map(|()| does()));
        match thread.join().unwrap() {
            Ok(what) => Some(what),
            Err(error) => {
                let _ =
                    writeln!(io::stderr(), "skipped: the kernel takes no filter of system calls: {error}");
                None
            }
        }
    }

    fn is_refused<T>(what: &str, tried: io::Result<T>) {
        let kind = tried.map(drop).map_err(|error| error.kind());
        assert_eq!(kind, Err(io::ErrorKind::PermissionDenied), "{what}");
    }

    #[test]
    #[expect(unsafe_code, reason = "memory is mapped by hand")]
    fn what_is_confined_opens_nothing_sends_nothing_starts_nothing_and_ends_nobody() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("there");
        fs::write(&there, "as it was").unwrap();
        let (own, new) = (there.clone(), folder.path().join("new"));
        let tried = confined(move || {
            is_refused("reading a file", File::open("/etc/passwd"));
            is_refused("writing to a file", OpenOptions::new().write(true).open(&own));
            is_refused("emptying a file", File::create(&own));
            is_refused("making a file", File::create_new(&new));
            is_refused("removing a file", fs::remove_file(&own));
            is_refused("renaming a file", fs::rename(&own, &new));
            is_refused("making a folder", fs::create_dir(&new));
            is_refused("listing a folder", fs::read_dir("/"));
            is_refused("how long a file is", fs::metadata("/etc/passwd"));
            is_refused("whether there is a file", fs::symlink_metadata(&own));
            is_refused("a link", fs::read_link("/proc/self/exe"));
            let stat = rustix::fs::stat("/etc/passwd").map_err(io::Error::from);
            is_refused("who has a file", stat);
            is_refused("a datagram", UdpSocket::bind("127.0.0.1:0"));
            is_refused("a connection", TcpListener::bind("127.0.0.1:0"));
            is_refused("a socket of this machine", UnixStream::pair());
            is_refused("another program", Command::new("/bin/true").status());
            is_refused("a signal", test_kill_process(getpid()).map_err(io::Error::from));
            let page = |protection| {
                // SAFETY: fresh memory, which nobody has a reference to.
                unsafe { mmap_anonymous(std::ptr::null_mut(), 4096, protection, MapFlags::PRIVATE) }
            };
            let memory = page(ProtFlags::READ | ProtFlags::WRITE).unwrap();
            // SAFETY: the memory is ours, and nothing refers to it.
            unsafe { munmap(memory, 4096) }.unwrap();
            is_refused("memory to be run", page(ProtFlags::READ | ProtFlags::EXEC).map_err(io::Error::from));
            let in_memory = rustix::fs::memfd_create("program", rustix::fs::MemfdFlags::CLOEXEC);
            is_refused("a program in memory", in_memory.map_err(io::Error::from));
        });
        if tried.is_some() {
            assert_eq!(fs::read(there).unwrap(), b"as it was");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        }
        assert!(File::open("/etc/passwd").is_ok(), "and no other thread is");
    }

    #[test]
    fn what_is_confined_reads_works_with_threads_panics_and_answers() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("cue"), "a cue").unwrap();
        let mut file = File::open(folder.path().join("cue")).unwrap();
        let (mut answer, mut to) = io::pipe().unwrap();
        let done = confined(move || {
            let mut text = String::new();
            file.read_to_string(&mut text).unwrap();
            let sums = thread::scope(|scope| {
                let sum = |from: u64| move || vec![from; 1 << 20].into_iter().sum::<u64>();
                [1, 2].map(|from| scope.spawn(sum(from))).map(|sum| sum.join().unwrap())
            });
            assert!(thread::spawn(|| panic!("on purpose")).join().is_err());
            write!(to, "{text}: {sums:?}").unwrap();
        });
        if done.is_some() {
            let mut text = String::new();
            answer.read_to_string(&mut text).unwrap();
            assert_eq!(text, "a cue: [1048576, 2097152]");
        }
        // What doctor says is so.
        assert_eq!(try_confinement().is_ok(), done.is_some());
    }
}
