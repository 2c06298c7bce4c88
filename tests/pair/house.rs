//! A house: two show machines, the machine of the controllers, and that of the engine.

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{ChildStderr, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;

use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, MonoTime};
use rustix::process::Signal;
use serde_json::Value;
use tempfile::TempDir;

use crate::net::Machine;
use crate::process::{Guarded, PATIENCE, Row, Run};
use crate::programs::is_installed;
use crate::serving::{self, Serving};
use crate::statuses;

/// Two houses at a time: beside more their machines would stand still by themselves.
static TURNS: [Mutex<()>; 2] = [const { Mutex::new(()) }; 2];
static OPENED: AtomicUsize = AtomicUsize::new(0);

/// The address by which controllers know the hall.
const HALL: [u8; 4] = [10, 77, 0, 1];
const SEATS: [&str; 2] = ["10.77.0.2:7408", "10.77.0.3:7408"];
const ENGINE: &str = "10.3.0.9:4222";
const KEY: &str = "5f0c1d2e3b4a59687786958493a2b1c05f0c1d2e3b4a59687786958493a2b1c0";

pub(crate) struct House {
    dir: TempDir,
    pub(crate) shows: [Show; 2],
    seats: Machine,
    sims: Vec<Sim>,
    engine: Engine,
    _turn: MutexGuard<'static, ()>,
}

/// A show machine.
pub(crate) struct Show {
    pub(crate) machine: Machine,
    folder: PathBuf,
    serving: Option<Serving>,
    /// What carries its lease.
    link: Option<Guarded>,
    /// What moves the address of the hall, as a unit of root would.
    mover: Option<Guarded>,
}

struct Engine {
    machine: Machine,
    folder: PathBuf,
    process: Option<Guarded>,
}

struct Sim {
    guarded: Guarded,
    _stderr: BufReader<ChildStderr>,
}

impl House {
    /// With nothing running but controllers and engine; none where the machine refuses namespaces or has no engine.
    pub(crate) fn open() -> Option<Self> {
        let turn = &TURNS[OPENED.fetch_add(1, Ordering::Relaxed) % TURNS.len()];
        let turn = turn.lock().unwrap_or_else(PoisonError::into_inner);
        if !["nats-server", "openssl"].into_iter().all(is_installed) {
            return None;
        }
        let seats = Machine::first()?;
        let [a, b, engine] = [(); 3].map(|()| seats.beside());
        lay_cables(&seats, &engine, [&a, &b]);
        let dir = tempfile::tempdir().unwrap();
        let fleet = dir.path().join("fleet");
        make_fleet(&fleet);
        let mut engine = Engine { machine: engine, folder: fleet, process: None };
        engine.start();
        let table = fs::read_to_string(engine.folder.join("h1/kinocue-fleet.toml")).unwrap();
        let table = table.replace("allow = []", "allow = [\"preflight\"]");
        let shows = [(a, "a", "journal.nk"), (b, "b", "second-journal.nk")].map(|(machine, name, key)| {
            let folder = dir.path().join(name);
            furnish(&folder, &table);
            fs::copy(engine.folder.join("h1").join(key), folder.join("state/journal.nk")).unwrap();
            Show { machine, folder, serving: None, link: None, mover: None }
        });
        let mut house = Self { dir, shows, seats, sims: Vec::new(), engine, _turn: turn };
        house.sims = (0..2).map(|seat| house.simulate(seat)).collect();
        Some(house)
    }

    /// The first machine plays, the other one stands by and knows all of it.
    pub(crate) fn playing() -> Option<Self> {
        let mut house = Self::open()?;
        house.start(0);
        house.start(1);
        house.shows[0].leads("A", "parked");
        house.shows[0].wait(|status| status["state"] == "parked" && pair_troubles(status).is_empty());
        for words in [&["level", "60%"][..], &["load", "night"], &["preflight"], &["arm"], &["go"]] {
            house.shows[0].done(words);
        }
        house.shows[0].comes_to("playing");
        let now = |status: &Value| status["ticks"].as_u64().unwrap();
        let until = now(&house.shows[0].wait(|_| true)) + 200;
        house.shows[0].wait(|status| now(status) >= until);
        Some(house)
    }

    /// Starts a machine, with its link to the engine.
    pub(crate) fn start(&mut self, number: usize) {
        let settings = self.engine.folder.join("h1/fleet.toml");
        self.shows[number].start(settings.to_str().unwrap());
    }

    fn simulate(&self, seat: usize) -> Sim {
        let log = self.dir.path().join(format!("frames{seat}.csv"));
        let mut args = vec!["sim", "--allow-lan", "--safe", "--listen", SEATS[seat], "--axes", "3"];
        args.extend(["--log", log.to_str().unwrap()]);
        let host: Vec<String> =
            (0x20..).zip(HALL).map(|(register, octet)| format!("{register:x}={octet}")).collect();
        args.extend(host.iter().flat_map(|one| ["--pa", one]));
        let mut guarded = Guarded::start_by(&self.seats.enter(), &args);
        let mut stderr = guarded.stderr();
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        assert!(line.starts_with("ready "), "{line}");
        Sim { guarded, _stderr: stderr }
    }

    /// Cuts the network between the two machines, or mends it.
    pub(crate) fn cut_pair(&self, is_cut: bool) {
        self.shows[0].machine.run(&format!("ip link set pair {}", if is_cut { "down" } else { "up" }));
    }

    /// Cuts a machine off the engine, or mends that.
    pub(crate) fn cut_engine(&self, number: usize, is_cut: bool) {
        self.shows[number].machine.run(&format!("ip link set engine {}", if is_cut { "down" } else { "up" }));
    }

    /// Another program that sends to the first seat, fifty datagrams a second.
    pub(crate) fn stranger(&self) -> Guarded {
        let mut command = self.seats.command("bash");
        command.args(["-c", "while :; do echo >/dev/udp/10.77.0.2/7408; sleep 0.02; done"]);
        Guarded::start_command(&mut command)
    }

    /// A controller stands still, or goes on.
    pub(crate) fn signal_seat(&self, seat: usize, signal: Signal) {
        self.sims[seat].guarded.signal(signal);
    }

    /// A command at the desk of the fleet.
    pub(crate) fn desk(&self, args: &[&str]) -> Run {
        self.at_the_desk(args).stdin(Stdio::null()).output().unwrap().into()
    }

    /// The same of one that takes its time.
    pub(crate) fn begin_at_desk(&self, args: &[&str]) -> Guarded {
        Guarded::start_command(&mut self.at_the_desk(args))
    }

    fn at_the_desk(&self, args: &[&str]) -> Command {
        let mut command = self.engine.machine.command(env!("CARGO_BIN_EXE_kinocue"));
        command.arg("fleet").args(args).arg("--desk").arg(self.engine.folder.join("office/desk.toml"));
        command
    }

    /// How the desk sees the hall once that is so.
    #[track_caller]
    pub(crate) fn seen(&self, wanted: impl Fn(&Value) -> bool) -> Value {
        self.at_desk(&["status", "--json"], |all| {
            all.as_array()?.first().filter(|hall| wanted(hall)).cloned()
        })
    }

    /// How many shows the day's report at the desk counts once that is so.
    #[track_caller]
    pub(crate) fn played(&self, wanted: impl Fn(&Value) -> bool) -> Value {
        self.at_desk(&["report", "--json"], |halls| {
            Some(&halls["berlin.h1"]["totals"]).filter(|totals| wanted(totals)).cloned()
        })
    }

    /// Asks the desk until it says that.
    #[track_caller]
    fn at_desk(&self, args: &[&str], wanted: impl Fn(&Value) -> Option<Value>) -> Value {
        let until = Monotonic.now() + PATIENCE;
        let mut last = None;
        while Monotonic.now() < until {
            let run = self.desk(args);
            // Where the engine is slow there is none.
            let told: Option<Value> = serde_json::from_str(&run.stdout).ok();
            if let Some(told) = told.as_ref().and_then(&wanted) {
                return told;
            }
            last = Some(run);
        }
        panic!("the desk does not come to say that: {last:#?}");
    }

    pub(crate) fn kill_engine(&mut self) {
        drop(self.engine.process.take());
    }

    pub(crate) fn start_engine(&mut self) {
        self.engine.start();
    }

    /// Ends all of it; gives the frames that came to each seat.
    pub(crate) fn ends(mut self) -> [Vec<Row>; 2] {
        for show in &mut self.shows {
            show.kill();
        }
        for sim in self.sims.drain(..) {
            sim.guarded.signal(Signal::TERM);
            assert_eq!(sim.guarded.finish().code, Some(0));
        }
        [0, 1].map(|seat| {
            let mut text = String::new();
            let log = fs::File::open(self.dir.path().join(format!("frames{seat}.csv")));
            log.and_then(|mut log| log.read_to_string(&mut text)).unwrap();
            text.lines().skip(1).filter_map(Row::parse).collect()
        })
    }
}

/// A bridge for the hall, one for the engine, and a cable from machine to machine.
fn lay_cables(seats: &Machine, engine: &Machine, shows: [&Machine; 2]) {
    for (machine, addresses) in [(seats, &["10.77.0.2/24", "10.77.0.3/24"][..]), (engine, &["10.3.0.9/24"])] {
        machine.run("ip link add bridge type bridge\nip link set bridge up");
        for address in addresses {
            machine.run(&format!("ip address add {address} dev bridge"));
        }
    }
    for (number, show) in (1..).zip(shows) {
        let pid = show.pid();
        for (machine, name, net) in [(seats, "hall", "10.77.0.1"), (engine, "engine", "10.3.0.")] {
            machine.run(&format!(
                "ip link add to{number} type veth peer name {name}\nip link set {name} netns {pid}\n\
                 ip link set to{number} master bridge\nip link set to{number} up"
            ));
            show.run(&format!("ip address add {net}{number}/24 dev {name}\nip link set {name} up"));
        }
    }
    let pid = shows[1].pid();
    shows[0].run(&format!("ip link add pair type veth peer name other\nip link set other netns {pid}"));
    shows[0].run("ip address add 10.1.0.1/24 dev pair\nip link set pair up");
    shows[1].run("ip link set other name pair\nip address add 10.1.0.2/24 dev pair\nip link set pair up");
}

/// Keys, certificate and the configuration of the engine.
fn make_fleet(folder: &Path) {
    let text = folder.to_str().unwrap();
    let of = ["--site", "berlin", "--halls", "h1", "--pairs", "h1", "--engine", ENGINE, "--folder", text];
    let args = [&["fleet", "init"][..], &of].concat();
    assert_eq!(crate::process::kinocue(&args).code, Some(0));
    let script = "openssl req -x509 -newkey ed25519 -nodes -days 9 -subj /CN=fleet-ca -keyout ca.key -out fleet-ca.pem\n\
        openssl req -newkey ed25519 -nodes -subj /CN=10.3.0.9 -keyout engine.key -out engine.csr\n\
        echo subjectAltName=IP:10.3.0.9 >ext\n\
        openssl x509 -req -days 9 -in engine.csr -CA fleet-ca.pem -CAkey ca.key -CAcreateserial -extfile ext -out engine.pem\n\
        cp fleet-ca.pem h1/\ncp fleet-ca.pem office/\n";
    let made = Command::new("sh").args(["-ec", script]).current_dir(folder).output().unwrap();
    assert!(made.status.success(), "{made:?}");
    let conf = folder.join("nats-server.conf");
    let conf_text = fs::read_to_string(&conf)
        .unwrap()
        .replace("/var/lib/nats/jetstream", folder.join("jetstream").to_str().unwrap())
        .replace("/etc/nats/fleet-engine.pem", folder.join("engine.pem").to_str().unwrap())
        .replace("/etc/nats/fleet-engine.key", folder.join("engine.key").to_str().unwrap());
    fs::write(conf, conf_text).unwrap();
}

/// What both machines have: the configuration, with the lines of its fleet, the key and the cue.
fn furnish(folder: &Path, fleet: &str) {
    fs::create_dir_all(folder.join("state/cues")).unwrap();
    let named = |line: &&str| !["library", "dir", "[log]"].iter().any(|key| line.starts_with(key));
    let mut config: String = serving::hall(folder)
        .replace("bind = \"127.0.0.1:0\"", "bind = \"10.77.0.1:8410\"")
        .lines()
        .filter(named)
        .fold(String::new(), |text, line| text + line + "\n");
    serving::write_row(&mut config, "A", &SEATS.map(str::to_owned));
    config += "[api]\nlisten = [\"127.0.0.1:8480\"]\n\
        [pair]\nkey = \"pair.key\"\n\
        [[pair.machine]]\nname = \"A\"\naddresses = [\"10.1.0.1:8430\"]\n\
        [[pair.machine]]\nname = \"B\"\naddresses = [\"10.1.0.2:8430\"]\n";
    config += fleet;
    fs::write(folder.join("hall.toml"), config).unwrap();
    let key = folder.join("pair.key");
    fs::write(&key, KEY).unwrap();
    fs::set_permissions(&key, fs::Permissions::from_mode(0o600)).unwrap();
    fs::write(folder.join("state/cues/night.csv"), swing()).unwrap();
}

/// Three axes go up and down by 100 mm for two minutes, 188 mm/s at the most.
fn swing() -> String {
    let mut cue = String::from("# kinocue-csv: 1\n# title: Swing\ntime_ms,a1,a2,a3\n");
    for row in 0..=6_000 {
        let height = (1.0 - (std::f64::consts::TAU * 0.6 * f64::from(row) / 50.0).cos()) / 3.0;
        writeln!(cue, "{},{height:.6},{height:.6},{height:.6}", row * 20).unwrap();
    }
    cue
}

/// What is told of the other machine and of the engine.
pub(crate) fn pair_troubles(status: &Value) -> Vec<String> {
    let warnings = status["warnings"].as_array().cloned().unwrap_or_default();
    let of_pair = warnings.into_iter().filter(|one| one["id"] == "pair");
    of_pair.map(|one| one["text"].as_str().unwrap_or_default().to_owned()).collect()
}

impl Engine {
    fn start(&mut self) {
        let mut command = self.machine.command("nats-server");
        command.arg("-c").arg(self.folder.join("nats-server.conf"));
        let mut process = Guarded::start_command(&mut command);
        let mut lines = process.stderr().lines().map_while(Result::ok);
        let _ = lines.find(|line| line.contains("Server is ready")).expect("it starts");
        thread::spawn(move || lines.for_each(drop));
        self.process = Some(process);
    }
}

impl Show {
    fn start(&mut self, settings: &str) {
        let lead = self.path("lead");
        let lead = lead.to_str().unwrap();
        if self.mover.is_none() {
            // As a unit of root: the address is here while the service says that it leads.
            let script = format!(
                "while :; do if [ -e {lead} ]; then ip address add 10.77.0.1/24 dev hall; else ip address del 10.77.0.1/24 dev hall; fi \
                 2>/dev/null; sleep 0.02; done"
            );
            let mut command = self.machine.command("sh");
            command.args(["-c", &script]);
            self.mover = Some(Guarded::start_command(&mut command));
        }
        // As the units have it: what the link reaches lies apart.
        let sockets = self.path("fleet");
        fs::create_dir_all(&sockets).unwrap();
        let socket = sockets.join("fleet.sock");
        let socket = socket.to_str().unwrap();
        self.serving = Some(Serving::start_by(&self.folder, |args| {
            Guarded::start_by(&self.machine.enter(), &[args, &["--fleet-socket", socket]].concat())
        }));
        if self.link.is_none() {
            let args = ["fleet", "link", "--config", settings, "--socket", socket];
            let mut link = Guarded::start_by(&self.machine.enter(), &args);
            let lines = link.stderr();
            thread::spawn(move || lines.lines().map_while(Result::ok).for_each(drop));
            self.link = Some(link);
        }
    }

    /// Kills the service, and takes its address away as whoever moves it does.
    pub(crate) fn kill(&mut self) {
        if self.serving.take().is_some() {
            let _ = fs::remove_file(self.path("lead"));
        }
    }

    /// Waits until it leads, and until it serves the hall in that state.
    pub(crate) fn leads(&self, name: &str, state: &str) -> MonoTime {
        let leads = format!("{name} leads the hall");
        self.serving().heard(|line| line.contains(&leads).then_some(()));
        let at = Monotonic.now();
        let state = format!("{state}: ");
        self.serving().heard(|line| line.contains(&state).then_some(()));
        at
    }

    /// The end of the service, which ends by itself.
    pub(crate) fn ended(&mut self) -> (Option<i32>, Vec<String>) {
        self.serving.take().unwrap().finish()
    }

    pub(crate) fn serving(&self) -> &Serving {
        self.serving.as_ref().expect("it serves")
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// A command of a person.
    pub(crate) fn run(&self, args: &[&str]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.args(args).env("KINOCUE_SOCKET", self.path("control.sock")).stdin(Stdio::null());
        command.output().unwrap().into()
    }

    /// The same of one that takes its time; dropped, it is ended.
    pub(crate) fn begin(&self, args: &[&str]) -> Guarded {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.args(args).env("KINOCUE_SOCKET", self.path("control.sock"));
        Guarded::start_command(&mut command)
    }

    #[track_caller]
    pub(crate) fn done(&self, args: &[&str]) {
        let run = self.run(args);
        assert_eq!(run.code, Some(0), "{args:?} {run:?}");
    }

    #[track_caller]
    pub(crate) fn wait(&self, wanted: impl FnMut(&Value) -> bool) -> Value {
        let told = || self.serving().lines().join("\n");
        let came = statuses::wait(&self.path("control.sock"), told, wanted);
        came.unwrap_or_else(|last| panic!("it did not come to that: {last:#?}\n{}", told()))
    }

    #[track_caller]
    pub(crate) fn comes_to(&self, state: &str) -> Value {
        self.wait(|status| status["state"] == state)
    }
}
