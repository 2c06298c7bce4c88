//! A hall of real processes: `kinocue serve`, `kinocue sim` for its two controllers, and the client commands.

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use rustix::process::Signal;
use serde_json::Value;
use tempfile::TempDir;

use crate::http::To;
use crate::process::{Guarded, PATIENCE, Relay, Run, Seen, Sim};
use crate::serving::{self, Serving};
use crate::statuses;

/// A row of two seats, each controller behind a relay that shows its frames and has a plug.
pub(crate) struct Hall {
    dir: TempDir,
    sim: Sim,
    relays: Vec<Relay>,
    serving: Option<Serving>,
}

impl Hall {
    /// Serving and parked, with the cues `ride`, over in two seconds, and `night`, which takes a minute.
    pub(crate) fn open() -> Self {
        Self::open_with(|config| config)
    }

    /// The same of another configuration.
    pub(crate) fn open_with(change: impl FnOnce(String) -> String) -> Self {
        let mut hall = Self::closed(&[], change);
        hall.serve();
        hall.comes_to("parked");
        hall
    }

    /// Not serving yet, over a simulator with further arguments.
    pub(crate) fn closed(sim: &[&str], change: impl FnOnce(String) -> String) -> Self {
        let dir = tempfile::tempdir().expect("a folder");
        let control = dir.path().join("sim.sock");
        let own = ["--safe", "--control", control.to_str().expect("text")];
        let sim = Sim::start(2, &[&own[..], sim].concat());
        let relays: Vec<Relay> = sim.addresses.iter().map(|address| Relay::start(address)).collect();
        // A controller that is reached through a relay has another address than it thinks.
        let accepted = "[show]\naccept_findings = [{ check = \"address\", why = \"a relay\" }]\n";
        let mut config = serving::hall(dir.path()).replace("[show]\n", accepted);
        serving::write_row(&mut config, "A", &relays.iter().map(Relay::to).collect::<Vec<_>>());
        for folder in ["cues", "playlists"] {
            fs::create_dir(dir.path().join(folder)).expect("a folder");
        }
        let hall = Self { dir, sim, relays, serving: None };
        hall.write("hall.toml", &change(config));
        hall.write("cues/ride.csv", &swell(2));
        hall.write("cues/night.csv", &swell(60));
        hall
    }

    /// Starts the daemon, and waits for nothing.
    pub(crate) fn launch(&mut self) {
        self.serving = Some(Serving::start(self.dir.path()));
    }

    /// Starts the daemon.
    pub(crate) fn serve(&mut self) {
        self.launch();
        self.begins();
    }

    fn begins(&self) {
        let begun = |line: &str| ["parked: ", "recovering: "].iter().any(|state| line.contains(state));
        self.serving().heard(|line| begun(line).then_some(()));
    }

    /// Starts it where no other program is installed.
    pub(crate) fn serve_alone(&mut self) {
        let nothing = self.path("cues");
        let start = |args: &[&str]| Guarded::start_with_path(args, &nothing);
        self.serves_by(Serving::start_by(self.dir.path(), start));
    }

    /// The daemon was started so.
    pub(crate) fn serves_by(&mut self, serving: Serving) {
        self.serving = Some(serving);
        self.begins();
    }

    /// Kills the daemon, as a crash would.
    pub(crate) fn kill(&mut self) {
        drop(self.serving.take());
    }

    pub(crate) fn serving(&self) -> &Serving {
        self.serving.as_ref().expect("it serves")
    }

    /// Has the daemon end; gives all that it has said.
    pub(crate) fn close(&mut self) -> Vec<String> {
        self.serving().signal(Signal::TERM);
        let (code, lines) = self.serving.take().expect("it serves").finish();
        assert_eq!(code, Some(0), "{lines:?}");
        lines
    }

    /// Ends all of it, and says what the controllers saw.
    pub(crate) fn end(mut self) -> Seen {
        if self.serving.is_some() {
            self.close();
        }
        self.sim.end()
    }

    /// The plug of a controller, counted from 0, and what goes by there.
    pub(crate) fn relay(&self, controller: usize) -> &Relay {
        &self.relays[controller]
    }

    /// Tells the simulator what happens.
    pub(crate) fn happens(&self, command: &str) {
        let mut stream = UnixStream::connect(self.path("sim.sock")).expect("it listens");
        writeln!(stream, "{command}").expect("it listens");
        let mut answer = String::new();
        BufReader::new(stream).read_line(&mut answer).expect("text");
        assert_eq!(answer, "ok\n", "{command}");
    }

    /// Where a controller is, past its relay.
    pub(crate) fn address(&self, controller: usize) -> &str {
        &self.sim.addresses[controller]
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn folder(&self) -> &Path {
        self.dir.path()
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("it can be written");
    }

    /// Writes the configuration anew.
    pub(crate) fn rewrite(&self, change: impl FnOnce(String) -> String) {
        let config = fs::read_to_string(self.path("hall.toml")).expect("it was written");
        self.write("hall.toml", &change(config));
    }

    /// Another machine that drives the seats, past the relays, with the cue `ride`.
    pub(crate) fn rival(&self, more: &[&str]) -> Child {
        let mut config = serving::hall(self.folder());
        serving::write_row(&mut config, "A", &self.sim.addresses);
        self.write("rival.toml", &config);
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.arg("play").arg(self.path("cues/ride.csv")).arg("--config").arg(self.path("rival.toml"));
        command.args(["--bind", "127.0.0.1:0"]).args(more).stdin(Stdio::null()).stdout(Stdio::null());
        command.spawn().expect("kinocue runs")
    }

    /// Its control socket.
    pub(crate) fn socket(&self) -> To {
        To::Unix(self.path("control.sock"))
    }

    /// A command of a person, run to its end.
    pub(crate) fn run(&self, args: &[&str]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.args(args).env("KINOCUE_SOCKET", self.path("control.sock")).stdin(Stdio::null());
        command.output().expect("kinocue runs").into()
    }

    /// A command that is done.
    pub(crate) fn done(&self, args: &[&str]) -> Run {
        let run = self.run(args);
        assert_eq!(run.code, Some(0), "{args:?} {run:?}");
        run
    }

    /// Loads a cue, checks the hall and arms it.
    pub(crate) fn arm(&self, cue: &str) {
        self.done(&["load", cue]);
        self.done(&["preflight"]);
        self.done(&["arm"]);
    }

    /// Plays a cue, until the seats are on it.
    pub(crate) fn play(&self, cue: &str) {
        self.arm(cue);
        self.done(&["go"]);
        self.comes_to("playing");
    }

    /// Waits until the first axis of a controller is sent 5 mm up.
    pub(crate) fn rises(&self, controller: usize) {
        self.relay(controller).wait_for(|frame| frame.positions[0].0 > 10_000);
    }

    /// Waits until it is parked, and ticks went on until then: whoever waits for a disk misses hundreds, and beside other programs a few are.
    pub(crate) fn parks_in_time(&self) {
        let parked = self.comes_to("parked");
        assert!(parked["missed_ticks"].as_u64().is_some_and(|missed| missed < 100), "{parked}");
    }

    /// How all of it stands.
    pub(crate) fn status(&self) -> Value {
        self.socket().get("/api/v1/status").value()
    }

    /// Waits for a status like that.
    pub(crate) fn wait(&self, wanted: impl FnMut(&Value) -> bool) -> Value {
        let told = || format!("{:?}", self.serving().lines());
        statuses::wait(&self.path("control.sock"), told, wanted)
            .unwrap_or_else(|last| panic!("it did not come to that: {last:#?}\n{}", told()))
    }

    /// Waits for a state.
    pub(crate) fn comes_to(&self, state: &str) -> Value {
        self.wait(|status| status["state"] == state)
    }

    /// Waits until the hall has lived for so many ticks more.
    pub(crate) fn lives_on(&self, ticks: u64) -> Value {
        // None while there is no status to be had.
        let now = |status: &Value| status["ticks"].as_u64();
        let until = now(&self.wait(|status| now(status).is_some())).expect("a count") + ticks;
        self.wait(|status| now(status).is_some_and(|now| now >= until))
    }

    /// The lines of the journal that are of that kind; whole once the daemon has ended.
    pub(crate) fn journal(&self, kind: &str) -> Vec<Value> {
        assert!(self.serving.is_none(), "lines may still be on their way");
        let mut files: Vec<PathBuf> = fs::read_dir(self.path("log"))
            .expect("it is there")
            .map(|entry| entry.expect("it can be read").path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "jsonl"))
            .collect();
        files.sort();
        let text: String = files.iter().map(|path| fs::read_to_string(path).expect("text")).collect();
        let lines = text.lines().map(|line| serde_json::from_str(line).expect("JSON"));
        lines.filter(|line: &Value| line["kind"] == kind).collect()
    }

    /// What the stop socket answers to a line.
    pub(crate) fn stop_socket(&self, line: &str) -> String {
        self.line_of("stop.sock", line)
    }

    /// What a socket of lines answers to one.
    pub(crate) fn line_of(&self, socket: &str, line: &str) -> String {
        let mut stream = UnixStream::connect(self.path(socket)).expect("it listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("it is longer than nothing");
        stream.write_all(line.as_bytes()).expect("it listens");
        let mut answer = String::new();
        BufReader::new(stream).read_line(&mut answer).expect("text");
        answer
    }
}

/// A gentle cue of that many seconds: three axes go 15 mm up and down every two.
pub(crate) fn swell(seconds: u32) -> String {
    let mut cue = String::from("# kinocue-csv: 1\n# title: Swell\ntime_ms,a1,a2,a3,fx_air,fx_water\n");
    for tenth in 0..=10 * seconds {
        let height = 0.05 - 0.05 * (std::f64::consts::TAU * f64::from(tenth) / 20.0).cos();
        writeln!(cue, "{},{height:.6},{height:.6},{height:.6},0,0", tenth * 100).expect("memory");
    }
    cue
}
