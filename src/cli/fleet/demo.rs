//! `kinocue fleet demo`: an engine, three halls with simulated seats, and their links, on this machine alone and gone at the end.

use std::env;
use std::fs::{self, File, OpenOptions};
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{Ipv4Addr, TcpListener, TcpStream, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use anyhow::{Context as _, anyhow};
use rustix::process::{Pid, Signal, kill_process};

use super::init::{Plan, make};
use super::made::put;
use super::settings::LONGEST;
use crate::cli::play::leave_on_signals;
use crate::cli::{Exit, Failure, OrExit as _, print};
use crate::config::FleetWord;
use crate::journal::KEY;
use crate::sys;
use crate::sys::clock::Monotonic;
use crate::sys::own_folder::OwnFolder;
use crate::time::Clock as _;

/// Its halls.
const HALLS: [&str; 3] = ["h1", "h2", "h3"];
/// What each has in its library.
const CUE: &str = include_str!("../../../cues/bench-ride.csv");
/// Seats of a hall.
const SEATS: usize = 2;
/// How long the engine and the halls may take to start, and to end.
const START: Duration = Duration::from_secs(30);
const END: Duration = Duration::from_secs(20);
/// How often it is looked whether all is well.
const LOOK: Duration = Duration::from_millis(50);

/// Starts three halls with simulated seats, an engine and their links, to try what a desk does.
///
/// Needs nats-server (Debian: apt install nats-server). Everything stays on this machine, in a temporary folder that is removed at the end:
/// Ctrl-C parks the seats and ends all of it.
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

/// Where the engine is looked for beside PATH: that of an ordinary user lacks them.
const BESIDE: [&str; 2] = ["/usr/sbin", "/usr/local/sbin"];

pub(super) fn run(_: &Args) -> Result<Exit, Failure> {
    let engine = engine_program()?;
    let leave = Arc::<AtomicBool>::default();
    leave_on_signals(&leave).context("signals cannot be handled").or_system()?;
    let temporary = env::temp_dir();
    let folder = OwnFolder::make(&temporary)
        .with_context(|| format!("cannot make a folder in {}; set TMPDIR to another", temporary.display()))
        .or_exit(Exit::Io)?;
    let mut running = Running::default();
    let started = start(&engine, &folder, &mut running, &leave);
    if started.is_ok() {
        while !leave.load(Ordering::Acquire) && running.all_live() {
            Monotonic.sleep_until(Monotonic.now() + LOOK);
        }
    }
    let ended = running.end();
    if !leave.load(Ordering::Acquire) {
        started?;
    }
    folder.remove().context("the folder of the demo is left").or_exit(Exit::Io)?;
    if !leave.load(Ordering::Acquire) {
        return Err(anyhow!("a part of the demo ended by itself")).or_exit(Exit::Internal);
    }
    ended
}

/// The engine's program; its package where there is none.
pub(super) fn engine_program() -> Result<PathBuf, Failure> {
    let path = env::var_os("PATH").unwrap_or_default();
    let folders = env::split_paths(&path).chain(BESIDE.map(PathBuf::from));
    let found = folders.map(|folder| folder.join("nats-server")).find(|program| program.is_file());
    found.ok_or_else(|| {
        let error = anyhow!(
            "there is no nats-server, the engine of a fleet; install it: sudo apt install nats-server"
        );
        Failure { exit: Exit::Unavailable, error }
    })
}

fn start(
    engine: &Path,
    folder: &OwnFolder,
    running: &mut Running,
    leave: &AtomicBool,
) -> Result<(), Failure> {
    let port = free_tcp().context("no port for the engine").or_system()?;
    let address = format!("127.0.0.1:{port}");
    let allow = FleetWord::ALL.map(|(word, _)| format!("\"{word}\"")).join(", ");
    let store = folder.path("jetstream");
    let halls = HALLS.map(str::to_owned);
    let plan = Plan {
        site: "demo",
        halls: &halls,
        pairs: &[],
        desk: "office",
        engine: &address,
        store: store.to_str().unwrap_or_default(),
        allow: &format!("[{allow}]"),
    };
    let fleet = folder.path("fleet");
    make(&plan, &fleet)?;
    let conf = fleet.join("nats-server.conf");
    let mut command = Command::new(engine);
    running.start(command.arg("-c").arg(conf), &folder.path("engine.log"))?;
    await_engine(&address, leave)?;
    let mut consoles = Vec::new();
    for hall in HALLS {
        consoles.push(start_hall(hall, folder, &fleet, running)?);
    }
    for (hall, console) in HALLS.into_iter().zip(consoles) {
        let link = started(&console, leave).ok_or_else(|| {
            let said = fs::read_to_string(folder.path(format!("{hall}.log"))).unwrap_or_default();
            anyhow!("hall {hall} does not start: {}", said.lines().last().unwrap_or_default())
        });
        print::tell(&format!("demo.{hall}, its console with all rights: {}", link.or_exit(Exit::Internal)?));
    }
    let desk = fleet.join("office/desk.toml");
    let page = started(&start_page(&desk, folder, running)?, leave)
        .context("the page of all halls does not start")
        .or_exit(Exit::Internal)?;
    print::tell(&format!("the page of all three: {page}"));
    tell(&desk);
    Ok(())
}

/// Starts the page of all halls, for whoever comes: its halls are simulated.
fn start_page(desk: &Path, folder: &OwnFolder, running: &mut Running) -> Result<Receiver<String>, Failure> {
    let mut settings = OpenOptions::new().append(true).open(desk).or_exit(Exit::Io)?;
    settings.write_all(b"[api]\nlisten = [\"127.0.0.1:0\"]\nopen_role = \"view\"\n").or_exit(Exit::Io)?;
    let mut page = Command::new(env::current_exe().context("this program is not to be found").or_system()?);
    page.args(["fleet", "desk", "--desk"]).arg(desk);
    running.start_told(&mut page, "shows 3 halls at ", &folder.path("desk.log"))
}

/// Where a page is, once it is served; none where it is not, or nobody wants it any more.
fn started(page: &Receiver<String>, leave: &AtomicBool) -> Option<String> {
    let until = Monotonic.now() + START;
    while Monotonic.now() < until && !leave.load(Ordering::Acquire) {
        match page.recv_timeout(LOOK) {
            Err(RecvTimeoutError::Timeout) => {}
            told => return told.ok(),
        }
    }
    None
}

fn tell(desk: &Path) {
    print::tell(&format!(
        "a desk over all three, in another terminal:\n  export KINOCUE_DESK={}\n  kinocue fleet watch\n  kinocue fleet load bench-ride \
         all     then arm and go on a console\n  kinocue fleet level 50% demo.h1\n  kinocue fleet stop\n  kinocue fleet report\n  kinocue fleet push FILE.csv \
         --to all     a cue of yours into the libraries of all three\n  kinocue fleet have\nCtrl-C ends \
         all of it; nothing leaves this machine",
        desk.display()
    ));
}

/// Starts a hall and its link; its console comes later.
fn start_hall(
    hall: &str,
    folder: &OwnFolder,
    fleet: &Path,
    running: &mut Running,
) -> Result<Receiver<String>, Failure> {
    let own = folder.path(hall);
    let path = |name: &str| own.join(name);
    fs::create_dir_all(path("state/cues")).or_exit(Exit::Io)?;
    fs::write(path("state/cues/bench-ride.csv"), CUE).or_exit(Exit::Io)?;
    let seed = sys::file::text(&fleet.join(hall).join(KEY), LONGEST).or_exit(Exit::Io)?;
    put(&path("state").join(KEY), &seed, 0o600)?;
    let table = fs::read_to_string(fleet.join(hall).join("kinocue-fleet.toml")).or_exit(Exit::Io)?;
    let config = config(hall).context("no ports for seats").or_system()? + &table;
    fs::write(path("hall.toml"), config).or_exit(Exit::Io)?;
    let program = env::current_exe().context("this program is not to be found").or_system()?;
    let mut serve = Command::new(&program);
    serve.args(["serve", "--rehearse", "--config"]).arg(path("hall.toml"));
    serve.arg("--socket").arg(path("control.sock")).arg("--state").arg(path("state"));
    let console = running.start_told(
        &mut serve,
        "to rehearse, with all rights: ",
        &folder.path(format!("{hall}.log")),
    )?;
    let mut link = Command::new(&program);
    link.args(["fleet", "link", "--config"]).arg(fleet.join(hall).join("fleet.toml"));
    link.arg("--socket").arg(path("fleet.sock")).arg("--state").arg(path("link"));
    running.start(&mut link, &folder.path(format!("{hall}-link.log")))?;
    Ok(console)
}

/// A hall of two seats at ports that are free.
fn config(hall: &str) -> std::io::Result<String> {
    let held: Vec<UdpSocket> =
        (0..=SEATS).map(|_| UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))).collect::<Result<_, _>>()?;
    let ports: Vec<u16> =
        held.iter().map(|socket| Ok(socket.local_addr()?.port())).collect::<std::io::Result<_>>()?;
    let mut text = format!(
        "[show]\nname = \"{hall}\"\nrate_hz = 100\nbind = \"127.0.0.1:{}\"\n[api]\nlisten = [\"127.0.0.1:0\"]\n[seat.bench3]\naxes = 3\n\
         stroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\nmax_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\n\
         max_jerk_mm_s3 = 60000.0\npark = [0.0, 0.0, 0.0]\nneutral = [0.5, 0.5, 0.5]\n\
         [effects]\nair = 1\nwater = 2\nwind = 3\nleg = 4\nsmoke = 5\nlight = 6\n",
        ports[0]
    );
    for (seat, port) in ports[1..].iter().enumerate() {
        let name = seat + 1;
        text += &format!(
            "[[controller]]\nname = \"A{name}\"\nrow = \"A\"\nseat = \"bench3\"\naddress = \"127.0.0.1:{port}\"\n"
        );
    }
    Ok(text)
}

fn free_tcp() -> std::io::Result<u16> {
    Ok(TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?.port())
}

/// Waits until the engine takes connections.
fn await_engine(address: &str, leave: &AtomicBool) -> Result<(), Failure> {
    let until = Monotonic.now() + START;
    while TcpStream::connect(address).is_err() {
        if Monotonic.now() >= until || leave.load(Ordering::Acquire) {
            return Err(anyhow!("the engine does not start at {address}")).or_exit(Exit::Unavailable);
        }
        Monotonic.sleep_until(Monotonic.now() + LOOK);
    }
    Ok(())
}

/// What was started, in that order; ended with the program.
#[derive(Default)]
struct Running(Vec<Child>);

impl Running {
    /// Starts a program that says what it says to a file.
    fn start(&mut self, command: &mut Command, log: &Path) -> Result<(), Failure> {
        let log = File::create(log).or_exit(Exit::Io)?;
        self.spawn(command, log.into()).map(|_| ())
    }

    /// The same of one that says where its page is, behind these words; that comes by the channel.
    fn start_told(
        &mut self,
        command: &mut Command,
        before: &'static str,
        log: &Path,
    ) -> Result<Receiver<String>, Failure> {
        let mut log = File::create(log).or_exit(Exit::Io)?;
        let child = self.spawn(command, Stdio::piped())?;
        let said = child.stderr.take().map(BufReader::new);
        let (tell, told) = channel();
        thread::spawn(move || {
            for line in said.into_iter().flat_map(|said| said.lines()).map_while(Result::ok) {
                if let Some(link) = line.strip_prefix(before) {
                    let _ = tell.send(link.to_owned());
                }
                let _ = writeln!(log, "{line}"); // a full disk ends no hall
            }
        });
        Ok(told)
    }

    fn spawn(&mut self, command: &mut Command, stderr: Stdio) -> Result<&mut Child, Failure> {
        let name = command.get_program().display().to_string();
        let started = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(stderr).spawn();
        let child = started.with_context(|| format!("{name} does not start")).or_system()?;
        self.0.push(child);
        Ok(self.0.last_mut().expect("it was just put there"))
    }

    fn all_live(&mut self) -> bool {
        self.0.iter_mut().all(|child| matches!(child.try_wait(), Ok(None)))
    }

    /// Ends all of them, the last that was started first; halls park their seats.
    fn end(&mut self) -> Result<Exit, Failure> {
        for child in self.0.iter().rev() {
            if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
                let _ = kill_process(pid, Signal::TERM); // it may have ended
            }
        }
        let until = Monotonic.now() + END;
        while self.0.iter_mut().any(|child| matches!(child.try_wait(), Ok(None))) {
            if Monotonic.now() >= until {
                return Err(anyhow!("a part of the demo does not end, and is killed"))
                    .or_exit(Exit::Internal);
            }
            Monotonic.sleep_until(Monotonic.now() + LOOK);
        }
        self.0.clear();
        Ok(Exit::Done)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill(); // it may have ended
            let _ = child.wait();
        }
    }
}
