//! The process that checks cues and draws recordings: what comes from outside or is long is taken apart there, at the lowest priority
//! and within limits, and never in the process that moves seats.

use std::io::{self, PipeReader, PipeWriter, Read as _};
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use serde::de::DeserializeOwned;

use super::{Bounds, Drawing, Hall, Sketch, Verdict};
use crate::control::{Code, Problem};
use crate::sys::clock::Monotonic;
use crate::time::{Clock as _, MonoTime};

/// The most that is taken of what it prints, bytes: the curves of twelve axes in as many stretches as may be asked.
const MAX_OUTPUT: u64 = 4 << 20;
/// How it ends where the configuration has faults (sysexits).
const BAD_CONFIGURATION: i32 = 78;

/// What the process does with a file.
struct Chore<'a> {
    /// In words.
    name: &'static str,
    /// What it does about one that takes too much.
    remedy: &'static str,
    command: &'a [&'a str],
    file: &'a Path,
    /// The most memory that it may take, MiB.
    memory_mib: u64,
    /// Whoever waits for it; none where it is done for everybody.
    awaited: Option<&'a Awaited>,
}

/// What a picture may take, MiB: it is read piece by piece, and may be drawn beside the check of a cue.
const PICTURE_MIB: u64 = 384;

const CHECK: &str = "the check of the cue";
const FEWER_ROWS: &str =
    "give the cue fewer rows, or raise max_memory_mib in [library] and MemoryMax of the service";
const SHORTER: &str =
    "draw it on another machine with `kinocue plot`, or cut it first with `kinocue record cut`";

/// Tells a process that is at work whether somebody still waits for what it makes.
#[derive(Debug)]
pub struct Awaited(PipeReader);

impl Awaited {
    /// It is awaited until the other end is dropped.
    ///
    /// # Errors
    /// Where this process may open nothing more.
    pub fn pair() -> io::Result<(PipeWriter, Self)> {
        let (reader, writer) = io::pipe()?;
        Ok((writer, Self(reader)))
    }
}

/// Has a cue file checked for a hall. Blocks until it is, or is awaited no more.
pub(super) fn examine(hall: &Hall, cue: &Path, awaited: Option<&Awaited>) -> Result<Verdict, Problem> {
    check(hall, cue, &[], awaited)
}

/// Has the curves of a cue file drawn in so many stretches of time. Blocks until they are, or are awaited no more.
pub(super) fn draw(
    hall: &Hall,
    cue: &Path,
    points: usize,
    awaited: Option<&Awaited>,
) -> Result<Drawing, Problem> {
    check(hall, cue, &["--curve", &points.to_string()], awaited)
}

/// Has a recording drawn: that seat, or the one that was held back farthest. Blocks until it is, or is awaited no more.
pub(super) fn picture(
    hall: &Hall,
    recording: &Path,
    seat: Option<&str>,
    awaited: Option<&Awaited>,
) -> Result<Sketch, Problem> {
    let seat = seat.map(|seat| format!("--seat={seat}"));
    let command: Vec<&str> = ["draw-recording"].into_iter().chain(seat.as_deref()).collect();
    let name = "the picture of the recording";
    let memory_mib = hall.bounds.memory_mib.min(PICTURE_MIB);
    run(hall, &Chore { name, remedy: SHORTER, command: &command, file: recording, memory_mib, awaited })
}

fn check<T: DeserializeOwned>(
    hall: &Hall,
    cue: &Path,
    more: &[&str],
    awaited: Option<&Awaited>,
) -> Result<T, Problem> {
    let config = hall.config.to_str().ok_or_else(|| {
        let detail = format!("the path of the configuration, {}, is not UTF-8", hall.config.display());
        Problem::new(Code::File, detail, "rename it")
    })?;
    let command: Vec<&str> =
        ["prove", "--json", "--config", config].into_iter().chain(more.iter().copied()).collect();
    let memory_mib = hall.bounds.memory_mib;
    run(hall, &Chore { name: CHECK, remedy: FEWER_ROWS, command: &command, file: cue, memory_mib, awaited })
}

/// What the process says of a file.
fn run<T: DeserializeOwned>(hall: &Hall, chore: &Chore<'_>) -> Result<T, Problem> {
    let bounds = &hall.bounds;
    let mut child = spawn(hall, chore).map_err(|error| {
        let detail = format!("cannot start {}: {error}", chore.name);
        Problem::new(Code::File, detail, "check the service's limits on processes and memory")
    })?;
    let deadline = Monotonic.now() + bounds.time;
    let watched = watch(&mut child, chore.awaited, deadline);
    if watched.is_err() {
        let _ = child.kill(); // it may have ended meanwhile
    }
    let status = child.wait().map_err(|error| failed(chore, &error))?;
    let output = watched.map_err(|error| match error.kind() {
        io::ErrorKind::TimedOut => too_long(chore, bounds),
        _ => failed(chore, &error),
    })?;
    serde_json::from_slice(&output).map_err(|_| no_verdict(chore, status, bounds))
}

/// Not a copy of this process, which would slow its real-time thread down: the child lowers itself.
fn spawn(hall: &Hall, chore: &Chore<'_>) -> io::Result<Child> {
    Command::new(&hall.program)
        .arg0("kinocue")
        .args(chore.command)
        .args(["--memory-mib", &chore.memory_mib.to_string()])
        .args(["--seconds", &hall.bounds.time.as_secs().to_string()])
        .arg("--")
        .arg(chore.file)
        .env_clear()
        .env("MALLOC_ARENA_MAX", "1") // each arena would take of the address space that it may have
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
}

/// What it prints, once it has ended.
fn watch(child: &mut Child, awaited: Option<&Awaited>, deadline: MonoTime) -> io::Result<Vec<u8>> {
    let mut stdout = child.stdout.take().expect("its output is a pipe");
    let mut output = Vec::new();
    let mut buf = [0; 4096];
    loop {
        wait_for(&PollFd::new(&stdout, PollFlags::IN), awaited, deadline)?;
        match stdout.read(&mut buf)? {
            0 => break,
            bytes => output.extend_from_slice(&buf[..bytes]),
        }
        if output.len() as u64 > MAX_OUTPUT {
            return Err(io::Error::other("its output is longer than any verdict"));
        }
    }
    let ended = pidfd_open(Pid::from_child(child), PidfdFlags::empty())?;
    wait_for(&PollFd::new(&ended, PollFlags::IN), awaited, deadline)?;
    Ok(output)
}

/// Waits until there is something to read, or an end; not where nobody waits for it any more.
fn wait_for(fd: &PollFd<'_>, awaited: Option<&Awaited>, deadline: MonoTime) -> io::Result<()> {
    let mut fds: Vec<PollFd<'_>> = vec![fd.clone()];
    fds.extend(awaited.map(|Awaited(pipe)| PollFd::new(pipe, PollFlags::empty())));
    loop {
        let left = deadline.since(Monotonic.now());
        if left == Duration::ZERO {
            return Err(io::ErrorKind::TimedOut.into());
        }
        let left = Timespec::try_from(left).map_err(io::Error::other)?;
        match poll(&mut fds, Some(&left)) {
            Ok(0) | Err(Errno::INTR) => {}
            Ok(_) if fds[1..].iter().any(|pipe| !pipe.revents().is_empty()) => {
                return Err(io::Error::other("nobody waits for it any more"));
            }
            Ok(_) => return Ok(()),
            Err(error) => return Err(error.into()),
        }
    }
}

fn failed(chore: &Chore<'_>, error: &io::Error) -> Problem {
    Problem::new(Code::File, format!("{} failed: {error}", chore.name), "try again")
}

fn too_long(chore: &Chore<'_>, bounds: &Bounds) -> Problem {
    let detail = format!("{} took more than {} s and was ended", chore.name, bounds.time.as_secs());
    Problem::new(Code::Check, detail, "try again when nothing plays; one that never ends in time is too long")
}

/// It ended without a verdict: its limits ended it, or it could not begin.
fn no_verdict(chore: &Chore<'_>, status: ExitStatus, bounds: &Bounds) -> Problem {
    if status.code() == Some(BAD_CONFIGURATION) {
        let remedy = "run kinocue check on the configuration and correct it";
        return Problem::new(Code::Check, "the configuration of the hall has faults", remedy);
    }
    let how = match (status.signal(), status.code()) {
        (Some(signal), _) => format!("signal {signal}"),
        (None, code) => format!("code {}", code.unwrap_or_default()),
    };
    let (memory, time) = (chore.memory_mib, bounds.time.as_secs());
    let detail = format!(
        "{} ended with {how}; it may take {memory} MiB of memory and {time} s of processor time",
        chore.name
    );
    Problem::new(Code::Check, detail, chore.remedy)
}
