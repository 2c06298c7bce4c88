//! A hall of which only the surfaces are real.

use std::fs;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use kinocue::harness::api::{self, Running, Setup, StopSocket};
use kinocue::harness::config::{self, ApiToken};
use kinocue::harness::control::{
    Code, Command, ControllerStatus, Desired, Handle, Health, Inbox, JournalLine, Problem, Role, Status,
    StatusSource, handle,
};
use kinocue::harness::library::{self, Bounds, Library};
use kinocue::harness::log::Log;
use kinocue::harness::playlist::Shelf;
use kinocue::harness::rt::Desk;
use kinocue::harness::state::{PlayMode, State};
use sha2::{Digest as _, Sha256};
use tempfile::TempDir;

use crate::client::To;
use crate::script;

/// One token for each role.
pub const TOKENS: [(&str, Role); 3] =
    [("guest-token", Role::View), ("tablet-token", Role::Operate), ("booth-token", Role::Engineer)];

const CONFIG: &str = "[seat.s]\naxes = 1\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
    max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
    [[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"127.0.0.1:7408\"\n";

/// A hall, its surfaces, and what was asked of it.
pub struct Hall {
    pub dir: TempDir,
    pub handle: Handle,
    pub desk: Arc<Desk>,
    pub asked: Arc<Mutex<Vec<Desired>>>,
    awake: Arc<AtomicBool>,
    asleep: Arc<AtomicBool>,
    running: Option<Running>,
    _stop: StopSocket,
    ends: Arc<AtomicBool>,
    supervisor: Option<JoinHandle<()>>,
}

impl Hall {
    /// Served on its sockets, and on a port of the loopback.
    pub fn open() -> Self {
        Self::with(Status::starting("Hall 1"), |api| api)
    }

    /// One whose cues are checked by a script, which finds its own folder in `$0`.
    pub fn with_checks_by(text: &str) -> Self {
        let dir = tempfile::tempdir().unwrap();
        let program = dir.path().join("check");
        script::make(&program, &format!("#!/bin/bash\n{text}\n"));
        Self::of(dir, program, Status::starting("Hall 1"), |api| api)
    }

    pub fn with(first: Status, change: impl FnOnce(config::Api) -> config::Api) -> Self {
        Self::of(tempfile::tempdir().unwrap(), env!("CARGO_BIN_EXE_kinocue").into(), first, change)
    }

    fn of(
        dir: TempDir,
        program: PathBuf,
        first: Status,
        change: impl FnOnce(config::Api) -> config::Api,
    ) -> Self {
        let config = change(config::Api {
            listen: vec!["127.0.0.1:0".parse().unwrap()],
            tokens: TOKENS
                .map(|(token, role)| ApiToken { name: format!("{role}'s"), role, sha256: hash(token) })
                .into(),
            ..config::Api::default()
        });
        let desk = Arc::new(Desk::new(std::iter::empty()));
        let (handle, inbox, source) = handle(Arc::clone(&desk), first);
        let setup = Setup {
            config,
            socket: dir.path().join("control.sock"),
            handle: handle.clone(),
            library: library(dir.path(), program),
            playlists: Shelf::new(&dir.path().join("playlists")),
            journal: dir.path().join("journal"),
            recordings: dir.path().join("recordings"),
            pages,
            log: Log::start(|_| {}).unwrap(),
        };
        let running = api::start(setup).unwrap();
        let stop = api::stop_socket(&dir.path().join("stop.sock"), handle.clone()).unwrap();
        let [ends, asleep, awake] = [false, false, true].map(|flag| Arc::new(AtomicBool::new(flag)));
        let asked = Arc::<Mutex<Vec<Desired>>>::default();
        let supervisor = Supervisor { inbox, source, handle: handle.clone(), asked: Arc::clone(&asked) };
        let [of_ends, of_awake, of_asleep] = [&ends, &awake, &asleep].map(Arc::clone);
        let supervisor = thread::spawn(move || supervisor.run(&of_ends, &of_awake, &of_asleep));
        Self {
            dir,
            handle,
            desk,
            asked,
            awake,
            asleep,
            running: Some(running),
            _stop: stop,
            ends,
            supervisor: Some(supervisor),
        }
    }

    /// Its control socket.
    pub fn socket(&self) -> To {
        To::Unix(self.dir.path().join("control.sock"))
    }

    /// Its stop socket.
    pub fn stop_socket(&self) -> PathBuf {
        self.dir.path().join("stop.sock")
    }

    /// Its port.
    pub fn port(&self) -> To {
        To::Tcp(self.address())
    }

    pub fn address(&self) -> SocketAddr {
        self.running.as_ref().unwrap().addresses()[0]
    }

    /// Waits until it was seen to tick.
    pub fn is_well(&self) {
        let ticks = |_| self.socket().get("/healthz").status == 200;
        assert!((0..20_000).any(ticks), "it never ticks");
    }

    /// What was asked so far.
    pub fn asks(&self) -> Vec<Command> {
        self.asked.lock().unwrap().iter().map(|desired| desired.ask.clone()).collect()
    }

    /// From now on nothing that is asked is taken.
    pub fn sleep(&self) {
        self.awake.store(false, Ordering::Relaxed);
        while !self.asleep.load(Ordering::Relaxed) {
            thread::yield_now();
        }
    }

    pub fn wake(&self) {
        self.awake.store(true, Ordering::Relaxed);
    }

    /// Ends the API.
    pub fn close(&mut self) {
        drop(self.running.take());
    }
}

impl Drop for Hall {
    fn drop(&mut self) {
        self.close();
        self.ends.store(true, Ordering::Relaxed);
        self.supervisor.take().unwrap().join().unwrap();
    }
}

/// Takes what is asked and answers it.
struct Supervisor {
    inbox: Inbox,
    source: StatusSource,
    handle: Handle,
    asked: Arc<Mutex<Vec<Desired>>>,
}

impl Supervisor {
    fn run(self, ends: &AtomicBool, awake: &AtomicBool, asleep: &AtomicBool) {
        while !ends.load(Ordering::Relaxed) {
            let mut status = Status::clone(&self.handle.status());
            status.ticks += 1;
            self.source.put(Arc::new(status));
            if !awake.load(Ordering::Relaxed) {
                asleep.store(true, Ordering::Relaxed);
                thread::park_timeout(Duration::from_millis(5));
                continue;
            }
            let Some(asked) = self.inbox.next(Duration::from_millis(5)) else { continue };
            self.asked.lock().unwrap().push(asked.desired.clone());
            let answer = self.answer(&asked.desired.ask);
            asked.answer(answer);
        }
    }

    fn answer(&self, ask: &Command) -> Result<Arc<Status>, Problem> {
        let state = match ask {
            Command::Load { cue } if cue == "bad" => {
                let faults = vec!["bad.csv:2:1: a1".to_owned(), "bad.csv:3:1: a1".to_owned()];
                return Err(Problem::new(Code::Check, "the cue bad is refused", "mend it").with(faults));
            }
            Command::Resume => {
                return Err(Problem::new(Code::State, "cannot resume while armed", "arm and go"));
            }
            Command::Arm { .. } => State::Armed,
            Command::Go => State::Playing(PlayMode::Joining),
            Command::Stop => State::Stopping,
            _ => State::Parked,
        };
        let status = Status {
            state: state.into(),
            cause: format!("asked: {}", ask.word()),
            ..Status::clone(&self.handle.status())
        };
        let status = Arc::new(status);
        self.source.put(Arc::clone(&status));
        Ok(status)
    }
}

/// A status with a controller and many lines, so that it is long.
pub fn long_status() -> Status {
    let line = |n| JournalLine {
        at: format!("{n}"),
        who: "x".repeat(5000),
        what: String::new(),
        result: String::new(),
        times: 1,
    };
    Status { journal: (0..20).map(line).collect(), ..with_controller() }
}

/// A status with a controller.
pub fn with_controller() -> Status {
    let controller = ControllerStatus {
        name: "A1".to_owned(),
        row: Some("A".to_owned()),
        seat: "s".to_owned(),
        address: "127.0.0.1:7408".to_owned(),
        group: "A1".to_owned(),
        enabled: true,
        health: Health::Ok,
        ..ControllerStatus::default()
    };
    Status { state: State::Parked.into(), controllers: vec![controller], ..Status::starting("Hall 1") }
}

fn hash(token: &str) -> [u8; 32] {
    Sha256::digest(token).into()
}

fn library(dir: &Path, program: PathBuf) -> Library {
    let config = dir.join("hall.toml");
    fs::write(&config, CONFIG).unwrap();
    let bounds = Bounds { max_bytes: 100_000, ..Bounds::default() };
    let hall = library::Hall { config, program, bounds };
    Library::open(&dir.join("cues"), hall).unwrap()
}

fn pages(path: &str) -> Option<(&'static str, &'static [u8])> {
    match path {
        "/" => Some(("text/html; charset=utf-8", b"<!doctype html>")),
        "/console.js" => Some(("text/javascript", b"'use strict'")),
        "/broken" => panic!("a page that breaks, on purpose"),
        _ => None,
    }
}
