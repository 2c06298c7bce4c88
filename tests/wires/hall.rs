//! A hall of two seats whose controllers are on another machine than the service.

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{ChildStderr, Command, Stdio};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use rustix::process::Signal;
use serde_json::Value;
use tempfile::TempDir;

use crate::net::Machine;
use crate::process::{Guarded, PATIENCE, Row, Run};
use crate::serving::{self, Serving};
use crate::statuses;

/// A hall whose processor is taken away is alone: others would be late by that.
static BESIDE: RwLock<()> = RwLock::new(());

/// The turn of a hall.
#[expect(dead_code, reason = "they are held")]
pub(crate) enum Turn {
    Beside(RwLockReadGuard<'static, ()>),
    Alone(RwLockWriteGuard<'static, ()>),
}

impl Turn {
    pub(crate) fn beside() -> Self {
        Self::Beside(BESIDE.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn alone() -> Self {
        Self::Alone(BESIDE.write().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Where the service is, and its controllers.
pub(crate) const SHOW: [u8; 4] = [10, 77, 0, 1];
pub(crate) const SEATS: [[u8; 4]; 2] = [[10, 77, 0, 2], [10, 77, 0, 3]];
pub(crate) const PORT: u16 = 7408;
pub(crate) const FRAME_PORT: u16 = 8410;

/// Pulses of the bench seat, and its greatest speed.
const PULSES_PER_MM: f64 = 2_000.0;
const MM_S: f64 = 240.0;
/// Roundings of pulses and milliseconds.
const SLACK: f64 = 1.01;
/// What is lost for up to 50 ms is made up for in one frame; so long may be from one that came to the next that did.
const ADMITTED_MS: u32 = 80;

/// A hall at work.
pub(crate) struct Hall {
    dir: TempDir,
    /// The machine of the service.
    pub(crate) show: Machine,
    /// The machine of the controllers.
    pub(crate) far: Machine,
    axes: usize,
    seats: [[u8; 4]; 2],
    sims: [Option<Sim>; 2],
    serving: Option<Serving>,
    _turn: Turn,
}

/// Where a hall is, and what of that is there when its service starts.
pub(crate) struct Place<'p> {
    /// Where its frames come from.
    pub(crate) bind: &'p str,
    pub(crate) seats: [[u8; 4]; 2],
    /// Gives the machine of the service its addresses.
    pub(crate) lay: &'p str,
    /// Tables of its configuration, in place of its API.
    pub(crate) more: &'p str,
}

/// A `kinocue sim` at work.
pub(crate) struct Sim {
    guarded: Guarded,
    _stderr: BufReader<ChildStderr>,
}

impl Sim {
    /// Ends it, which writes down what came to it.
    #[track_caller]
    pub(crate) fn end(self) {
        self.guarded.signal(Signal::TERM);
        assert_eq!(self.guarded.finish().code, Some(0));
    }
}

impl Hall {
    /// Serving and parked; none where the machine refuses namespaces.
    pub(crate) fn open() -> Option<Self> {
        Self::open_with(3, &[])
    }

    /// The same with seats of so many axes, three of which move; the service started by a program with those arguments.
    pub(crate) fn open_with(axes: usize, by: &[&str]) -> Option<Self> {
        let at =
            Place { bind: "10.77.0.1", seats: SEATS, lay: "ip address add 10.77.0.1/24 dev show", more: "" };
        let hall = Self::open_at(axes, by, &at)?;
        hall.comes_to("parked");
        Some(hall)
    }

    /// The same at those addresses; it serves, and has found whatever it finds.
    pub(crate) fn open_at(axes: usize, by: &[&str], at: &Place<'_>) -> Option<Self> {
        let turn = if by.is_empty() { Turn::beside() } else { Turn::alone() };
        let show = Machine::first()?;
        let far = show.beside();
        let pid = far.pid();
        show.run(&format!(
            "ip link add show type veth peer name far\nip link set far netns {pid}\nip link set show up\n{}",
            at.lay
        ));
        for [a, b, c, d] in at.seats {
            far.run(&format!("ip address add {a}.{b}.{c}.{d}/24 dev far\nip link set far up"));
        }
        let dir = tempfile::tempdir().expect("a folder");
        let seats = at.seats;
        let mut hall = Self { dir, show, far, axes, seats, sims: [None, None], serving: None, _turn: turn };
        (0..2).for_each(|seat| hall.switch_on(seat));
        hall.configure(at);
        let enter = [hall.show.enter(), by.iter().map(|&word| word.to_owned()).collect()].concat();
        hall.serve_by(&enter);
        Some(hall)
    }

    fn configure(&self, at: &Place<'_>) {
        let each = |one: &str| vec![one; self.axes].join(", ");
        let (park, neutral) = (format!("park = [{}]", each("0.0")), format!("neutral = [{}]", each("0.5")));
        let mut config = serving::hall(self.dir.path())
            .replace("bind = \"127.0.0.1:0\"", &format!("bind = \"{}:{FRAME_PORT}\"", at.bind))
            .replace("axes = 3", &format!("axes = {}", self.axes))
            .replace("park = [0.0, 0.0, 0.0]", &park)
            .replace("neutral = [0.5, 0.5, 0.5]", &neutral);
        serving::write_row(
            &mut config,
            "A",
            &self.seats.map(|[a, b, c, d]| format!("{a}.{b}.{c}.{d}:{PORT}")),
        );
        config += if at.more.is_empty() { "[api]\nlisten = [\"127.0.0.1:8480\"]\n" } else { at.more };
        for folder in ["cues", "playlists"] {
            fs::create_dir(self.path(folder)).expect("a folder");
        }
        fs::write(self.path("hall.toml"), config).expect("the folder is ours");
        fs::write(self.path("cues/night.csv"), swing(60)).expect("the folder is ours");
        fs::write(self.path("cues/ride.csv"), swing(2)).expect("the folder is ours");
    }

    /// Starts the simulator of a controller, counted from 0.
    pub(crate) fn switch_on(&mut self, seat: usize) {
        self.sims[seat] = Some(self.simulate(&self.far, seat, &seat.to_string()));
    }

    /// A simulator with the address of a controller, whose files end with that.
    pub(crate) fn simulate(&self, machine: &Machine, seat: usize, files: &str) -> Sim {
        let name = |what: &str| self.path(&format!("{what}{files}")).to_str().expect("text").to_owned();
        let (control, log, axes) = (name("sim.sock"), name("frames.csv"), self.axes.to_string());
        let [a, b, c, d] = self.seats[seat];
        let listen = format!("{a}.{b}.{c}.{d}:{PORT}");
        let mut args = vec!["sim", "--allow-lan", "--safe", "--listen", &listen, "--axes", &axes];
        args.extend(["--control", &control, "--log", &log]);
        let host = (0x20..).zip([a, b, c, 1]).map(|(register, octet)| format!("{register:x}={octet}"));
        let host: Vec<String> = host.collect();
        args.extend(host.iter().flat_map(|one| ["--pa", one]));
        let mut guarded = Guarded::start_by(&machine.enter(), &args);
        let mut stderr = guarded.stderr();
        let mut line = String::new();
        stderr.read_line(&mut line).expect("text");
        assert!(line.starts_with("ready "), "{line}");
        Sim { guarded, _stderr: stderr }
    }

    /// Cuts a controller's power, as it were.
    pub(crate) fn switch_off(&mut self, seat: usize) {
        drop(self.sims[seat].take());
    }

    fn serve_by(&mut self, enter: &[String]) {
        self.serving = Some(Serving::start_by(self.dir.path(), |args| Guarded::start_by(enter, args)));
        let begun = |line: &str| {
            ["parked: ", "recovering: ", "no-seat", "yet"].iter().any(|state| line.contains(state))
        };
        self.serving().heard(|line| begun(line).then_some(()));
    }

    pub(crate) fn serving(&self) -> &Serving {
        self.serving.as_ref().expect("it serves")
    }

    /// The end of the service, which ends by itself.
    pub(crate) fn ended(&mut self) -> (Option<i32>, Vec<String>) {
        self.serving.take().expect("it served").finish()
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Tells a simulator what happens.
    pub(crate) fn happens(&self, seat: usize, command: &str) {
        let mut stream = UnixStream::connect(self.path(&format!("sim.sock{seat}"))).expect("it listens");
        writeln!(stream, "{command}").expect("it listens");
        let mut answer = String::new();
        BufReader::new(stream).read_line(&mut answer).expect("text");
        assert_eq!(answer, "ok\n", "{command}");
    }

    /// A command of a person, run to its end.
    pub(crate) fn run(&self, args: &[&str]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.args(args).env("KINOCUE_SOCKET", self.path("control.sock")).stdin(Stdio::null());
        command.output().expect("kinocue runs").into()
    }

    /// A command that is done.
    #[track_caller]
    pub(crate) fn done(&self, args: &[&str]) {
        let run = self.run(args);
        assert_eq!(run.code, Some(0), "{args:?} {run:?}");
    }

    /// Plays a cue, until the seats are on it.
    pub(crate) fn play(&self, cue: &str) {
        self.done(&["load", cue]);
        self.done(&["preflight"]);
        self.done(&["arm"]);
        self.done(&["go"]);
        self.wait(|status| status["state"] == "playing" && (0..2).all(|seat| plays_on(status, seat)));
    }

    /// Plays for a while, so that the seats are somewhere and fast.
    pub(crate) fn rides(&self) {
        self.play("night");
        self.lives_on(100);
    }

    /// Waits for a status like that.
    #[track_caller]
    pub(crate) fn wait(&self, wanted: impl FnMut(&Value) -> bool) -> Value {
        let told = || self.serving().lines().join("\n");
        let came = statuses::wait(&self.path("control.sock"), told, wanted);
        came.unwrap_or_else(|last| panic!("it did not come to that: {last:#?}\n{}", told()))
    }

    /// How all of it stands.
    pub(crate) fn status(&self) -> Value {
        self.wait(|_| true)
    }

    #[track_caller]
    pub(crate) fn comes_to(&self, state: &str) -> Value {
        self.wait(|status| status["state"] == state)
    }

    /// Waits until the hall has lived for so many ticks more.
    #[track_caller]
    pub(crate) fn lives_on(&self, ticks: u64) -> Value {
        let now = |status: &Value| status["ticks"].as_u64();
        let until = now(&self.wait(|status| now(status).is_some())).expect("a count") + ticks;
        self.wait(|status| now(status).is_some_and(|now| now >= until))
    }

    /// Parks, clears what is to be cleared, and parks again what was out: after that all seats are down.
    #[track_caller]
    pub(crate) fn comes_down(&self) {
        self.done(&["park"]);
        let parked = self.comes_to("parked");
        if (0..2).any(|seat| health(&parked, seat) == "error") {
            self.done(&["clear"]);
            self.wait(|status| status["next"] == "park, or home");
            self.done(&["park"]);
        }
        self.wait(|status| status["state"] == "parked" && (0..2).all(|seat| health(status, seat) == "ok"));
    }

    /// Ends all of it; none of the frames that came to a seat may have led it faster than its type allows, and at the end all rest in
    /// park if they are to.
    #[track_caller]
    pub(crate) fn ends(mut self, in_park: bool) -> [Vec<Row>; 2] {
        if self.serving.is_some() {
            self.serving().signal(Signal::TERM);
            let (code, lines) = self.ended();
            assert_eq!(code, Some(0), "{lines:?}");
        }
        [0, 1].map(|seat| {
            if let Some(sim) = self.sims[seat].take() {
                sim.end();
            }
            let rows = self.frames(&seat.to_string());
            if let Some(pair) = rows.windows(2).find(|pair| leaps(pair)) {
                panic!("seat {} leaps: {pair:?}", seat + 1);
            }
            let last = rows.last().map(|row| row.commanded[..self.axes].to_vec());
            assert!(!in_park || last.is_none_or(|last| last == vec![0; self.axes]), "seat {}", seat + 1);
            rows
        })
    }

    /// The motion frames that came to a simulator whose files end with that, once it has ended.
    pub(crate) fn frames(&self, files: &str) -> Vec<Row> {
        let mut text = String::new();
        let log = fs::File::open(self.path(&format!("frames.csv{files}")));
        log.and_then(|mut log| log.read_to_string(&mut text)).expect("it is logged");
        // What it refused (x = 3 to 5) it did not do.
        let is_done = |line: &&str| !["3", "4", "5"].contains(&line.split(',').nth(5).unwrap_or(""));
        text.lines().skip(1).filter(is_done).filter_map(Row::parse).collect()
    }
}

/// Whether a frame leads a seat on faster than its type allows from where the one that came before led it.
fn leaps(pair: &[Row]) -> bool {
    let [before, row] = pair else { return false };
    let is_next = row.frame == before.frame.wrapping_add(1);
    let ms = if is_next { row.time_ms } else { row.time_ms.max(ADMITTED_MS) };
    let far = f64::from(ms) / 1_000.0 * MM_S * SLACK * PULSES_PER_MM + 2.0;
    let ways = before.commanded.iter().zip(&row.commanded).map(|(from, to)| f64::from(to.abs_diff(*from)));
    ways.fold(0.0, f64::max) > far
}

/// How a controller stands.
pub(crate) fn health(status: &Value, seat: usize) -> &str {
    status["controllers"][seat]["health"].as_str().unwrap_or("?")
}

/// Whether frames still go to it; acks may come late where the machine is busy.
pub(crate) fn plays_on(status: &Value, seat: usize) -> bool {
    ["ok", "degraded"].contains(&health(status, seat))
}

/// Whether all controllers stand so.
pub(crate) fn all(status: &Value, word: &str) -> bool {
    (0..2).all(|seat| health(status, seat) == word)
}

/// A count of a controller.
pub(crate) fn count(status: &Value, seat: usize, field: &str) -> u64 {
    status["controllers"][seat][field].as_u64().unwrap_or_else(|| panic!("{field}: {status}"))
}

/// The text and the remedy of a warning, of a seat or of none.
pub(crate) fn warning(status: &Value, id: &str, seat: Option<usize>) -> Option<(String, String)> {
    let of = seat.map(|seat| status["controllers"][seat]["name"].clone());
    let warnings = status["warnings"].as_array()?;
    let found = warnings
        .iter()
        .find(|one| one["id"] == id && of.as_ref().is_none_or(|of| one["controller"] == *of))?;
    let text = |key: &str| found[key].as_str().unwrap_or_default().to_owned();
    Some((text("text"), text("remedy")))
}

/// What is told of a seat that frames do not reach, or that is not heard.
pub(crate) const MISSED: &str =
    "lost: frames to it, or its acks, were missing for over 50 ms: its position has to be read";

/// Three axes go up and down by 100 mm at up to 188 mm/s: who misses half a second of it is far from where it is.
fn swing(seconds: u32) -> String {
    let mut cue = String::from("# kinocue-csv: 1\n# title: Swing\ntime_ms,a1,a2,a3\n");
    // The last swing ends where it began.
    let whole = (f64::from(seconds) * HERTZ).floor() / HERTZ;
    for row in 0..=50 * seconds {
        let at = (f64::from(row) / 50.0).min(whole);
        let height = (1.0 - (std::f64::consts::TAU * HERTZ * at).cos()) / 3.0;
        writeln!(cue, "{},{height:.6},{height:.6},{height:.6}", row * 20).expect("memory");
    }
    cue
}

const HERTZ: f64 = 0.6;

/// A connection to a socket of a hall.
pub(crate) fn connect(path: &Path) -> UnixStream {
    let stream = UnixStream::connect(path).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("it is longer than nothing");
    stream
}
