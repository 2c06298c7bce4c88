//! `kinocue serve` at work in a folder of its own.

use std::fmt::Write as _;
use std::io::BufRead as _;
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;

use rustix::process::Signal;

use crate::process::{Guarded, PATIENCE};

/// A hall at 100 Hz that takes any free port for its frames, still without controllers.
const HALL: &str = "\
[show]
name = \"Hall 1\"
rate_hz = 100
bind = \"127.0.0.1:0\"
library = \"FOLDER/cues\"

[log]
dir = \"FOLDER/log\"

[seat.bench3]
axes = 3
stroke_mm = 150.0
lead_mm = 5.0
pulses_per_rev = 10000
max_velocity_mm_s = 240.0
max_acceleration_mm_s2 = 3000.0
max_jerk_mm_s3 = 60000.0
park = [0.0, 0.0, 0.0]
neutral = [0.5, 0.5, 0.5]

[effects]
air = 1
water = 2
wind = 3
leg = 4
smoke = 5
light = 6

[preset.kids]
motion = \"60%\"
vibration = \"50%\"
effects = { water = false }
";

/// The configuration of a hall, still without controllers, that keeps its files in a folder.
pub(crate) fn hall(dir: &Path) -> String {
    HALL.replace("FOLDER", dir.to_str().expect("text"))
}

/// Adds the controllers of a row to a configuration: A1, A2 and so on.
pub(crate) fn write_row(config: &mut String, row: &str, addresses: &[String]) {
    for (seat, address) in addresses.iter().enumerate() {
        let name = format!("{row}{}", seat + 1);
        writeln!(
            config,
            "[[controller]]\nname = \"{name}\"\nrow = \"{row}\"\nseat = \"bench3\"\naddress = \"{address}\""
        )
        .expect("memory");
    }
}

/// A `kinocue serve` at work; dropped, it is killed as by a crash.
pub(crate) struct Serving {
    guarded: Guarded,
    said: Arc<Said>,
    reader: JoinHandle<()>,
}

/// What it has said on its standard error so far.
#[derive(Default)]
struct Said {
    so_far: Mutex<SoFar>,
    more: Condvar,
}

#[derive(Default)]
struct SoFar {
    lines: Vec<String>,
    ended: bool,
}

impl Serving {
    /// Serves the hall of `hall.toml` in a folder, with its sockets and its state there.
    pub(crate) fn start(dir: &Path) -> Self {
        Self::start_by(dir, Guarded::start)
    }

    /// The same, started so.
    pub(crate) fn start_by(dir: &Path, start: impl FnOnce(&[&str]) -> Guarded) -> Self {
        let path = |name: &str| dir.join(name).to_str().expect("text").to_owned();
        let (config, socket, state) = (path("hall.toml"), path("control.sock"), path("state"));
        let args = ["serve", "--config", &config, "--socket", &socket, "--state", &state];
        let mut guarded = start(&args);
        let stderr = guarded.stderr();
        let said = Arc::<Said>::default();
        let hears = Arc::clone(&said);
        // Whatever it says is taken, so that it never waits for us.
        let reader = std::thread::spawn(move || {
            stderr.lines().map_while(Result::ok).for_each(|line| hears.add(Some(line)));
            hears.add(None);
        });
        Self { guarded, said, reader }
    }

    /// The number of its process.
    pub(crate) fn pid(&self) -> u32 {
        self.guarded.pid()
    }

    /// Waits until it has said a line of which `find` makes something.
    pub(crate) fn heard<T>(&self, mut find: impl FnMut(&str) -> Option<T>) -> T {
        let mut so_far = self.said.so_far.lock().unwrap_or_else(PoisonError::into_inner);
        let mut looked_at = 0;
        loop {
            if let Some(found) = so_far.lines[looked_at..].iter().find_map(|line| find(line)) {
                return found;
            }
            looked_at = so_far.lines.len();
            assert!(!so_far.ended, "it ended: {:?}", so_far.lines);
            let waited = self.said.more.wait_timeout(so_far, PATIENCE);
            let (next, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
            assert!(!timeout.timed_out(), "it says nothing more: {:?}", next.lines);
            so_far = next;
        }
    }

    /// What it has said so far.
    pub(crate) fn lines(&self) -> Vec<String> {
        self.said.so_far.lock().unwrap_or_else(PoisonError::into_inner).lines.clone()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        self.guarded.signal(signal);
    }

    /// Waits for its end; gives its exit code, and all that it has said.
    pub(crate) fn finish(self) -> (Option<i32>, Vec<String>) {
        let Self { guarded, said, reader } = self;
        let code = guarded.finish().code;
        reader.join().expect("it reads to the end");
        let mut so_far = said.so_far.lock().unwrap_or_else(PoisonError::into_inner);
        (code, std::mem::take(&mut so_far.lines))
    }
}

impl Said {
    /// A line more, or none any more.
    fn add(&self, line: Option<String>) {
        let mut so_far = self.so_far.lock().unwrap_or_else(PoisonError::into_inner);
        so_far.ended = line.is_none();
        so_far.lines.extend(line);
        self.more.notify_all();
    }
}
