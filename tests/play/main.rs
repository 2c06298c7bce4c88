//! `kinocue play` from outside: real processes and real sockets, from a cue to what the controllers executed.

#[path = "../common/jog.rs"]
mod jog;
#[path = "../common/printed.rs"]
mod printed;
#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "../common/process.rs"]
mod process;
#[path = "../common/wav.rs"]
mod wav;

#[path = "../common/programs.rs"]
mod programs;

mod controllers;
mod cue_files;
mod demo;
mod film;
mod frames;
mod keyboard;
mod loss;
mod motion;
mod printed_imax;
mod recording;
mod report;
mod stopping;
mod turntable;
mod usage;
mod wire;

use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;

/// Pulses over the stroke of the bench seat, 150 mm.
const STROKE: f64 = 300_000.0;

/// A folder of its own for the files of one test.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).expect("the folder is ours");
        path
    }

    /// A wave of 1 Hz on one axis for so many seconds, 15 mm to either side of the middle of the stroke.
    fn wave(&self, seconds: u32) -> PathBuf {
        let mut text = "time_ms,a1\n".to_owned();
        for row in 0..=50 * seconds {
            let at = f64::from(row) * 0.02;
            text += &format!("{},{:.9}\n", row * 20, 0.5 + 0.1 * (at * std::f64::consts::TAU).sin());
        }
        self.write("wave.csv", text)
    }

    /// A short cue that begins and ends at rest in the park pose, and in between stands at `heights`, fractions of the
    /// stroke, one an axis, for 0.15 s: long enough to be seen there.
    fn nod(&self, heights: &[f64]) -> PathBuf {
        self.nod_with(heights, "", |_| String::new())
    }

    /// The same with further columns, and their cells at a time in ms.
    fn nod_with(&self, heights: &[f64], columns: &str, cells: impl Fn(u32) -> String) -> PathBuf {
        let axes: String = (1..=heights.len()).map(|axis| format!(",a{axis}")).collect();
        let mut text = format!("time_ms{axes}{columns}\n");
        for at_ms in (0..=NOD_MS).step_by(10) {
            let part = nod_part(at_ms);
            let row: String = heights.iter().map(|height| format!(",{:.9}", part * height)).collect();
            text += &format!("{at_ms}{row}{}\n", cells(at_ms));
        }
        self.write("nod.csv", text)
    }
}

/// How long a nod lasts.
const NOD_MS: u32 = 800;
/// When it stands at its heights, ms.
const NOD_TOP: std::ops::Range<u32> = 300..450;

/// How much of its heights a nod has reached.
fn nod_part(at_ms: u32) -> f64 {
    let rise = |ms: u32| {
        let part = f64::from(ms.min(300)) / 300.0;
        part.powi(3) * (10.0 - 15.0 * part + 6.0 * part * part)
    };
    rise(at_ms) - rise(at_ms.saturating_sub(NOD_TOP.end))
}

/// Where the motor of the bench seat stands at a fraction of its stroke.
#[expect(clippy::cast_possible_truncation, reason = "a stroke is 300,000 pulses")]
fn pulses(fraction: f64) -> i32 {
    (fraction * STROKE).round() as i32
}

/// What came of plays that the machine did not hold up for so long that acks were missed: such a play goes on as it should, by a hold
/// and a join, which is asked for elsewhere. They are played five times at the most.
#[track_caller]
fn undisturbed<T>(plays: impl Fn() -> (T, Vec<Value>)) -> T {
    let is_free_of_gaps = |report: &Value| {
        let controllers = report["controllers"].as_array().expect("a list");
        controllers.iter().all(|one| one["gaps"] == 0)
    };
    let tried = (0..5).map(|_| plays()).find(|(_, reports)| reports.iter().all(is_free_of_gaps));
    tried.expect("one of five goes by without a gap").0
}

/// A cue that ships.
fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cues").join(name)
}
