//! kinocue and its virtual controllers as real processes over real sockets, each ended with its test.

use std::io::{BufRead as _, BufReader, Read as _};
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, MonoTime};
use kinocue::wire::MotionRequest;
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open, pidfd_send_signal};
use serde_json::Value;
use tempfile::NamedTempFile;

/// No process lives longer, and nothing is waited for longer; where all is well a few seconds do.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// What a process left behind.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Run {
    /// The report of `--json`.
    pub(crate) fn report(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// The report, of a run that ended with this exit code.
    pub(crate) fn report_of(&self, code: i32) -> Value {
        assert_eq!(self.code, Some(code), "{self:?}");
        self.report()
    }
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

/// A child that is killed when it is dropped, or has lived too long.
pub(crate) struct Guarded {
    child: Option<Child>,
    handle: Arc<OwnedFd>,
    _ended: Sender<()>,
}

impl Guarded {
    pub(crate) fn start(args: &[&str]) -> Self {
        Self::start_with(args, Stdio::null(), Stdio::piped())
    }

    /// The same with the programs of a folder, and no others.
    pub(crate) fn start_with_path(args: &[&str], path: &Path) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        Self::spawn(command.args(args).env("PATH", path), Stdio::null(), Stdio::piped())
    }

    /// The same of another program, which becomes this one.
    pub(crate) fn start_command(command: &mut Command) -> Self {
        Self::spawn(command, Stdio::null(), Stdio::piped())
    }

    /// The number of its process.
    pub(crate) fn pid(&self) -> u32 {
        self.child.as_ref().expect("it was not taken").id()
    }

    fn start_with(args: &[&str], stdin: Stdio, stderr: Stdio) -> Self {
        Self::spawn(Command::new(env!("CARGO_BIN_EXE_kinocue")).args(args), stdin, stderr)
    }

    /// The same started by another program, whose arguments those of ours follow.
    pub(crate) fn start_by(by: &[String], args: &[&str]) -> Self {
        let mut command = Command::new(&by[0]);
        command.args(&by[1..]).arg(env!("CARGO_BIN_EXE_kinocue")).args(args);
        Self::spawn(&mut command, Stdio::null(), Stdio::piped())
    }

    fn spawn(command: &mut Command, stdin: Stdio, stderr: Stdio) -> Self {
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        command.stdin(stdin).stdout(Stdio::piped()).stderr(stderr);
        let child = command.spawn().expect("the program starts");
        let handle = Arc::new(pidfd_open(Pid::from_child(&child), PidfdFlags::empty()).expect("it is ours"));
        let (ended, waits) = channel::<()>();
        let watched = Arc::clone(&handle);
        std::thread::spawn(move || {
            if waits.recv_timeout(PATIENCE) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                let _ = pidfd_send_signal(&*watched, Signal::KILL); // it may have ended just now
            }
        });
        Self { child: Some(child), handle, _ended: ended }
    }

    /// What it says on its standard error, which is taken once.
    pub(crate) fn stderr(&mut self) -> BufReader<ChildStderr> {
        let child = self.child.as_mut().expect("it was not taken");
        BufReader::new(child.stderr.take().expect("piped"))
    }

    pub(crate) fn signal(&self, signal: Signal) {
        pidfd_send_signal(&*self.handle, signal).expect("it runs");
    }

    /// Waits for its end.
    pub(crate) fn finish(mut self) -> Run {
        let child = self.child.take().expect("it is taken once");
        child.wait_with_output().expect("it can be waited for").into()
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill(); // it may have ended already
            let _ = child.wait();
        }
    }
}

/// Runs the program to its end.
pub(crate) fn kinocue(args: &[&str]) -> Run {
    Guarded::start(args).finish()
}

/// A `kinocue play`, or a `kinocue demo`, at work.
pub(crate) struct Playing(Guarded);

impl Playing {
    /// Plays `cue` to each of `to` from any free port, with further arguments.
    pub(crate) fn start(cue: &Path, to: &[String], more: &[&str]) -> Self {
        Self::start_with(cue, to, more, Stdio::null(), Stdio::piped())
    }

    /// The same with a standard input and a standard error of the caller's.
    pub(crate) fn start_with(cue: &Path, to: &[String], more: &[&str], stdin: Stdio, stderr: Stdio) -> Self {
        let cue = cue.to_str().expect("text");
        let mut args = vec!["play", cue, "--bind", "127.0.0.1:0"];
        args.extend(to.iter().flat_map(|to| ["--to", to]));
        args.extend(more);
        Self(Guarded::start_with(&args, stdin, stderr))
    }

    /// The same where no file can grow longer than so many blocks of 512 octets.
    pub(crate) fn start_cramped(cue: &Path, to: &str, blocks: u32, more: &[&str]) -> Self {
        let mut command = Command::new("sh");
        command.args(["-c", "trap '' XFSZ; ulimit -f \"$0\"; exec \"$@\"", &blocks.to_string()]);
        command.arg(env!("CARGO_BIN_EXE_kinocue")).arg("play").arg(cue);
        command.args(["--bind", "127.0.0.1:0", "--to", to]).args(more);
        Self(Guarded::spawn(&mut command, Stdio::null(), Stdio::piped()))
    }

    /// The demo, with its temporary files in `folder`.
    pub(crate) fn demo(folder: &Path, args: &[&str], stdin: Stdio, stderr: Stdio) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.arg("demo").args(args).env("TMPDIR", folder);
        Self(Guarded::spawn(&mut command, stdin, stderr))
    }

    pub(crate) fn signal(&self, signal: Signal) {
        self.0.signal(signal);
    }

    /// Waits until it says that on the standard error; what it said up to there is not in its [`Run`], but here.
    pub(crate) fn wait_for(&mut self, text: &str) -> String {
        let child = self.0.child.as_mut().expect("it was not taken");
        let stderr = child.stderr.as_mut().expect("piped");
        let (mut said, mut byte) = (String::new(), [0]);
        while !said.contains(text) {
            assert_eq!(stderr.read(&mut byte).expect("it can be read"), 1, "it ended: {said}");
            said.push(char::from(byte[0]));
        }
        said
    }

    /// Waits for its end.
    pub(crate) fn finish(self) -> Run {
        self.0.finish()
    }
}

/// Plays to the end.
pub(crate) fn play(cue: &Path, to: &[String], more: &[&str]) -> Run {
    Playing::start(cue, to, more).finish()
}

/// A `kinocue sim` at work: controllers at free ports of 127.0.0.1 that take frames from any port.
pub(crate) struct Sim {
    guarded: Guarded,
    _stderr: BufReader<ChildStderr>,
    log: NamedTempFile,
    /// Where the controllers listen.
    pub(crate) addresses: Vec<String>,
}

impl Sim {
    /// One controller, with further arguments.
    pub(crate) fn one(more: &[&str]) -> Self {
        Self::start(1, more)
    }

    /// `count` controllers, with further arguments.
    pub(crate) fn start(count: usize, more: &[&str]) -> Self {
        let log = NamedTempFile::new().expect("a file");
        let (path, number) = (log.path().to_str().expect("text"), count.to_string());
        let mut args = vec!["sim", "--listen", "127.0.0.1:0", "--host-port", "0", "--json", "--log", path];
        args.extend(["--count", &number]);
        args.extend(more);
        let mut guarded = Guarded::start(&args);
        let mut stderr = guarded.stderr();
        let mut addresses = Vec::new();
        while addresses.len() < count {
            let mut line = String::new();
            assert_ne!(stderr.read_line(&mut line).expect("text"), 0, "the simulator ended");
            addresses.extend(line.strip_prefix("ready ").map(|address| address.trim().to_owned()));
        }
        Self { guarded, _stderr: stderr, log, addresses }
    }

    /// The only controller.
    pub(crate) fn to(&self) -> Vec<String> {
        self.addresses.clone()
    }

    /// Ends it, and says what its controllers saw.
    pub(crate) fn end(self) -> Seen {
        let Self { guarded, log, .. } = self;
        guarded.signal(Signal::TERM);
        let run = guarded.finish();
        let controllers = run.report_of(0)["controllers"].as_array().expect("a list").clone();
        let mut text = String::new();
        log.reopen().expect("a file").read_to_string(&mut text).expect("text");
        Seen { controllers, rows: text.lines().skip(1).filter_map(Row::parse).collect() }
    }
}

/// What virtual controllers saw.
#[derive(Debug)]
pub(crate) struct Seen {
    /// The counts of each.
    pub(crate) controllers: Vec<Value>,
    /// The motion frames of all.
    pub(crate) rows: Vec<Row>,
}

impl Seen {
    /// Motion frames that came to any of them, obeyed or not.
    pub(crate) fn motion(&self) -> usize {
        self.rows.len()
    }

    /// Whether all of them rest in pulse 0 of every axis with all outputs off, the analogue ones too.
    pub(crate) fn rest_in_park(&self) -> bool {
        self.controllers.iter().all(|one| {
            let positions = one["positions"].as_array().expect("a list");
            one["outputs"] == 0 && one["extend"] == 0 && positions.iter().all(|position| position == 0)
        })
    }

    /// The farthest that an axis was executed, from 0.
    pub(crate) fn farthest(&self, axis: usize) -> i32 {
        self.rows.iter().map(|row| row.executed[axis]).max().unwrap_or(0)
    }
}

/// A motion frame as a virtual controller's log has it.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub(crate) at_s: f64,
    pub(crate) controller: String,
    pub(crate) frame: u32,
    pub(crate) function: String,
    pub(crate) time_ms: u32,
    pub(crate) outputs: u16,
    pub(crate) extend: u32,
    pub(crate) commanded: Vec<i32>,
    /// Where the motors were when it came.
    pub(crate) executed: Vec<i32>,
}

impl Row {
    /// A row; none where it is the one that says where the motors came to rest.
    pub(crate) fn parse(line: &str) -> Option<Self> {
        let cells: Vec<&str> = line.split(',').collect();
        let pulses = |cells: &[&str]| cells.iter().filter_map(|cell| cell.parse().ok()).collect();
        Some(Self {
            at_s: cells[0].parse().expect("a time"),
            controller: cells[1].to_owned(),
            frame: cells[2].parse().ok()?,
            function: cells[3].to_owned(),
            time_ms: cells[4].parse().expect("a Time"),
            outputs: u16::from_str_radix(&cells[6][2..], 16).expect("a word"),
            extend: u32::from_str_radix(&cells[7][2..], 16).expect("two words"),
            commanded: pulses(&cells[8..20]),
            executed: pulses(&cells[20..32]),
        })
    }
}

/// Stands between kinocue and a controller, shows each motion frame that goes by, and has a plug to pull.
pub(crate) struct Relay {
    socket: UdpSocket,
    frames: Receiver<(SocketAddr, MonoTime, MotionRequest)>,
    pulled: Arc<AtomicBool>,
    done: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Relay {
    /// A relay to `controller`.
    pub(crate) fn start(controller: &str) -> Self {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
        let inner = socket.try_clone().expect("a handle");
        let controller = SocketAddr::V4(controller.parse().expect("an address"));
        let [pulled, done] = [false; 2].map(|flag| Arc::new(AtomicBool::new(flag)));
        let (unplugged, over) = (Arc::clone(&pulled), Arc::clone(&done));
        let (seen, frames) = channel();
        let thread = std::thread::spawn(move || relay(&inner, controller, (&unplugged, &over), &seen));
        Self { socket, frames, pulled, done, thread: Some(thread) }
    }

    /// Where kinocue plays to.
    pub(crate) fn to(&self) -> String {
        self.socket.local_addr().expect("it is bound").to_string()
    }

    /// Waits for a frame, and says where it came from.
    pub(crate) fn wait_for(&self, mut wanted: impl FnMut(&MotionRequest) -> bool) -> SocketAddr {
        loop {
            let (from, _, frame) = self.frames.recv_timeout(PATIENCE).expect("frames go by");
            if wanted(&frame) {
                return from;
            }
        }
    }

    /// How many frames have gone by since that was asked last.
    pub(crate) fn count(&self) -> usize {
        self.frames.try_iter().count()
    }

    /// The frames that have gone by since that was asked last, and when each did.
    pub(crate) fn seen(&self) -> Vec<(MonoTime, MotionRequest)> {
        self.frames.try_iter().map(|(_, at, frame)| (at, frame)).collect()
    }

    /// Pulls the plug of the controller: nothing goes by any more.
    pub(crate) fn pull(&self) {
        self.pulled.store(true, Ordering::Release);
    }

    /// Puts the plug back.
    pub(crate) fn put_back(&self) {
        self.pulled.store(false, Ordering::Release);
    }

    /// Sends bytes as if the controller had.
    pub(crate) fn send(&self, bytes: &[u8], to: SocketAddr) {
        self.socket.send_to(bytes, to).expect("loopback takes it");
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Release);
        self.send(&[], self.socket.local_addr().expect("it is bound")); // wakes the thread
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn relay(
    socket: &UdpSocket,
    controller: SocketAddr,
    (pulled, over): (&AtomicBool, &AtomicBool),
    seen: &Sender<(SocketAddr, MonoTime, MotionRequest)>,
) {
    let mut host = None;
    let mut bytes = [0; 2048];
    while !over.load(Ordering::Acquire) {
        let Ok((len, from)) = socket.recv_from(&mut bytes) else { continue };
        let at = Monotonic.now();
        if pulled.load(Ordering::Acquire) {
            continue;
        }
        let answer = from == controller;
        if !answer {
            host = Some(from);
        }
        let to = if answer { host } else { Some(controller) };
        if let Some(to) = to {
            let _ = socket.send_to(&bytes[..len], to); // who is gone is gone
        }
        if let (false, Ok(frame)) = (answer, MotionRequest::parse(&bytes[..len])) {
            let _ = seen.send((from, at, frame)); // nobody may be looking any more
        }
    }
}
