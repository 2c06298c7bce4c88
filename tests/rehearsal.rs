//! `kinocue serve` as an ordinary user on a laptop: one command, simulated seats, and nothing in /var.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpStream, UdpSocket};
use std::os::unix::fs::chown;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use rustix::process::{Pid, Signal, geteuid, kill_process};
use tempfile::TempDir;

/// A user of every system that owns nothing.
const NOBODY: u32 = 65_534;

/// A home, and a program, of somebody without rights over /var.
struct Laptop {
    home: TempDir,
    program: PathBuf,
}

impl Laptop {
    fn new() -> Self {
        let home = tempfile::tempdir().expect("a folder");
        let built = PathBuf::from(env!("CARGO_BIN_EXE_kinocue"));
        if !geteuid().is_root() {
            return Self { home, program: built };
        }
        // The folder that it was built in may be closed to others. Copied by a process of its own: what another test starts meanwhile would hold
        // the file open for writing, and nothing that is runs.
        let program = home.path().join("kinocue");
        assert!(
            Command::new("cp").args([&built, &program]).status().expect("cp runs").success(),
            "there is room"
        );
        chown(home.path(), Some(NOBODY), Some(NOBODY)).expect("root may");
        Self { home, program }
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(&self.program);
        command
            .args(args)
            .env_clear()
            .env("HOME", self.home.path())
            .current_dir(self.home.path())
            .stdin(Stdio::null());
        if geteuid().is_root() {
            command.uid(NOBODY).gid(NOBODY);
        }
        command
    }

    fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().expect("kinocue runs")
    }

    fn done(&self, args: &[&str]) -> String {
        let output = self.run(args);
        assert_eq!(output.status.code(), Some(0), "{args:?} {output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    /// The shipped hall of one seat, at ports that are free.
    fn hall(&self) -> String {
        let free =
            || UdpSocket::bind("127.0.0.1:0").expect("a free port").local_addr().expect("it is bound").port();
        let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hall.toml"))
            .expect("it is shipped");
        let text = [7408, 7409, 8410]
            .iter()
            .fold(text, |text, port| text.replace(&port.to_string(), &free().to_string()));
        fs::write(self.path("hall.toml"), text).expect("there is room");
        "hall.toml".to_owned()
    }
}

/// A service, killed with its test.
struct Serving {
    child: Child,
    /// What it said until its seats were parked.
    said: Vec<String>,
}

impl Serving {
    /// Starts it, and waits until its seats are parked.
    fn start(laptop: &Laptop, args: &[&str]) -> Self {
        let mut child = laptop.command(args).stderr(Stdio::piped()).spawn().expect("kinocue runs");
        let stderr = BufReader::new(child.stderr.take().expect("it is a pipe"));
        let mut serving = Self { child, said: Vec::new() };
        let mut lines = stderr.lines().map_while(Result::ok);
        let said = &mut serving.said;
        assert!(
            lines.by_ref().inspect(|line| said.push(line.clone())).any(|line| line.contains("parked: ")),
            "{said:?}"
        );
        std::thread::spawn(move || lines.for_each(drop));
        serving
    }

    fn end(mut self) -> Option<i32> {
        kill_process(Pid::from_child(&self.child), Signal::TERM).expect("it runs");
        self.child.wait().expect("it ends").code()
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.child.kill(); // it may have ended
        let _ = self.child.wait();
    }
}

#[test]
fn an_ordinary_user_rehearses_with_one_command_and_nothing_lies_in_var() {
    let laptop = Laptop::new();
    let cue = concat!(env!("CARGO_MANIFEST_DIR"), "/cues/bench-ride.csv");
    fs::copy(cue, laptop.path("bench-ride.csv")).expect("it is shipped");
    let hall = laptop.hall();
    let serving = Serving::start(&laptop, &["serve", "--rehearse", "--config", &hall]);
    for words in [
        &["upload", "bench-ride.csv"][..],
        &["load", "bench-ride"],
        &["preflight"],
        &["arm"],
        &["go"],
        &["park"],
        &["mark"],
    ] {
        laptop.done(words);
    }
    assert_eq!(serving.end(), Some(0));
    assert!(
        laptop.done(&["report", "--day", "today"]).contains("bench-ride"),
        "the journal is found without a word"
    );
    let state = laptop.path(".local/state/kinocue");
    for name in ["cues/bench-ride.csv", "log", "recordings", "rehearsal.toml", "run"] {
        assert!(state.join(name).exists(), "{name}");
    }
}

#[test]
fn whoever_rehearses_is_given_a_link_that_may_do_everything() {
    let laptop = Laptop::new();
    let hall = laptop.hall();
    let text = fs::read_to_string(laptop.path(&hall)).expect("it was written");
    let (before, _) = text.split_once("[api]").unwrap_or((&text, ""));
    let page = format!("{before}\n[api]\nlisten = [\"127.0.0.1:0\"]\nopen_role = \"view\"\n");
    fs::write(laptop.path("page.toml"), page).expect("there is room");
    let serving = Serving::start(&laptop, &["serve", "--rehearse", "--config", "page.toml"]);
    let link = serving
        .said
        .iter()
        .find_map(|line| line.split_once("http://").filter(|(_, to)| to.contains("#token=")));
    let (address, token) = link.and_then(|(_, to)| to.split_once("/#token=")).expect("it says so");
    let mut asked = TcpStream::connect(address).expect("it listens");
    let request = "GET /api/v1/who HTTP/1.0";
    write!(asked, "{request}\r\nHost: {address}\r\nAuthorization: Bearer {token}\r\n\r\n").expect("it reads");
    let mut reply = String::new();
    asked.read_to_string(&mut reply).expect("it replies");
    assert!(reply.contains("200 OK") && reply.contains("\"engineer\""), "{reply}");
    assert_eq!(serving.end(), Some(0));
}

#[test]
fn the_folder_that_is_named_has_all_that_the_service_keeps() {
    let laptop = Laptop::new();
    let hall = laptop.hall();
    let serving = Serving::start(
        &laptop,
        &["serve", "--rehearse", "--config", &hall, "--state", "kept", "--socket", "control.sock"],
    );
    laptop.done(&["status", "--socket", "control.sock"]);
    assert_eq!(serving.end(), Some(0));
    assert!(laptop.path("kept/log").is_dir() && laptop.path("kept/rehearsal.toml").is_file());
    assert!(!laptop.path(".local").exists());
}

#[test]
fn seats_that_are_elsewhere_are_not_rehearsed_with() {
    let laptop = Laptop::new();
    laptop.hall();
    let text = fs::read_to_string(laptop.path("hall.toml")).expect("it was written");
    // An address of documentation, which no machine has (RFC 5737).
    let elsewhere = text.replacen("address = \"127.0.0.1", "address = \"192.0.2.1", 1);
    fs::write(laptop.path("far.toml"), elsewhere).expect("there is room");
    let refused = laptop.run(&["serve", "--rehearse", "--config", "far.toml"]);
    assert_eq!(refused.status.code(), Some(78), "{refused:?}");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("A1 is at 192.0.2.1") && said.contains("127.0.0.1:7408"), "{said}");
    fs::write(laptop.path("open.toml"), text.replace("bind = ", "# bind = ")).expect("there is room");
    assert_eq!(laptop.run(&["serve", "--rehearse", "--config", "open.toml"]).status.code(), Some(78));
}
