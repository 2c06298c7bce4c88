//! Where frames lead, against where the film is that mpv shows, asked on a connection of the test's own. `benches/film` measures
//! the same with the kernel's stamps, for longer; here a thread that wakes up late is none of kinocue's.

use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, MonoTime};
use serde_json::{Value, json};

use super::process::{PATIENCE, Playing, Relay, Sim};
use super::programs::is_installed;
use super::{Folder, STROKE};

/// The cue: straight from here to there, but for its ends.
const SECONDS: f64 = 60.0;
const EASE_S: f64 = 2.0;

fn ramp(folder: &Folder) -> std::path::PathBuf {
    let pace = 1.0 / (SECONDS - EASE_S);
    let at = |t: f64| match t {
        _ if t < EASE_S => pace * t * t / (2.0 * EASE_S),
        _ if t > SECONDS - EASE_S => 1.0 - pace * (SECONDS - t).powi(2) / (2.0 * EASE_S),
        _ => pace * (t - EASE_S / 2.0),
    };
    let rows: String =
        (0..=3_000).map(|row| format!("{},{:.9}\n", 20 * row, at(f64::from(row) / 50.0))).collect();
    folder.write("ramp.csv", format!("time_ms,a1\n{rows}"))
}

/// The instant of the film that a position is made for, where the cue is straight, seconds.
fn media_s(pulses: i32) -> f64 {
    f64::from(pulses) / STROKE * (SECONDS - EASE_S) + EASE_S / 2.0
}

/// A film that mpv shows, and a connection to it.
struct Film {
    mpv: Child,
    line: BufReader<UnixStream>,
}

impl Film {
    fn start(socket: &Path) -> Self {
        let mut mpv = Command::new("mpv");
        mpv.args(["--no-config", "--no-terminal", "--vo=null", "--ao=null", "av://lavfi:sine=frequency=440"]);
        mpv.arg(format!("--input-ipc-server={}", socket.display()));
        let mut mpv = mpv.stdin(Stdio::null()).stdout(Stdio::null()).spawn().expect("it starts");
        let end = Monotonic.now() + PATIENCE;
        let stream = loop {
            match UnixStream::connect(socket) {
                Ok(stream) => break stream,
                Err(_) if Monotonic.now() < end => std::thread::yield_now(),
                Err(error) => {
                    let _ = mpv.kill(); // the test has failed already
                    panic!("mpv has no socket: {error}")
                }
            }
        };
        stream.set_read_timeout(Some(PATIENCE)).expect("it can be set");
        Self { mpv, line: BufReader::new(stream) }
    }

    fn asked(&mut self, command: &Value) -> Value {
        let question = json!({ "command": command, "request_id": 7 });
        writeln!(self.line.get_mut(), "{question}").expect("it listens");
        loop {
            let mut line = String::new();
            assert_ne!(self.line.read_line(&mut line).expect("it answers"), 0, "mpv ended");
            let told: Value = serde_json::from_str(&line).expect("JSON");
            if told["request_id"] == 7 {
                return told["data"].clone();
            }
        }
    }

    /// Where it is, less the clock, seconds: the middlemost of some answers, each taken half way.
    fn ahead_s(&mut self, since: MonoTime) -> f64 {
        let mut ahead: Vec<f64> = (0..25)
            .filter_map(|_| {
                let before = Monotonic.now();
                let media = self.asked(&json!(["get_property", "audio-pts"])).as_f64()?;
                let after = Monotonic.now();
                Some(media - f64::midpoint(seconds(since, before), seconds(since, after)))
            })
            .collect();
        ahead.sort_by(f64::total_cmp);
        ahead[ahead.len() / 2]
    }
}

impl Drop for Film {
    fn drop(&mut self) {
        let _ = self.mpv.kill(); // it may have ended already
        let _ = self.mpv.wait();
    }
}

fn seconds(since: MonoTime, at: MonoTime) -> f64 {
    at.since(since).as_secs_f64()
}

/// How far the film is ahead of where the next frames lead by the time they are over, seconds: the tenth part of them is less. A
/// frame can be seen late and not early, so that most of a loaded machine's lateness is in the others.
fn behind_s(relay: &Relay, film: &mut Film, since: MonoTime) -> f64 {
    relay.count();
    let mut behind: Vec<f64> = (0..20)
        .flat_map(|_| {
            let ahead = film.ahead_s(since);
            relay.count(); // what came meanwhile was seen at none of these instants
            let mut of_one = Vec::new();
            relay.wait_for(|frame| {
                let end = Monotonic.now() + Duration::from_millis(frame.time_ms.into());
                of_one.push(ahead + seconds(since, end) - media_s(frame.positions[0].0));
                of_one.len() == 10
            });
            of_one
        })
        .collect();
    behind.sort_by(f64::total_cmp);
    behind[behind.len() / 10]
}

#[test]
fn frames_lead_to_where_the_film_of_a_player_is_when_they_are_over_and_so_they_do_once_it_runs_faster() {
    if !is_installed("mpv") {
        return;
    }
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let (cue, socket, relay) = (ramp(&folder), folder.path("mpv.sock"), Relay::start(&sim.addresses[0]));
    let mut film = Film::start(&socket);
    let chase = format!("mpv:{}", socket.display());
    let mut playing = Playing::start(&cue, &[relay.to()], &["--chase", &chase]);
    playing.wait_for("playing: ");
    // From here on the cue is straight, and what the join left is taken back.
    relay.wait_for(|frame| media_s(frame.positions[0].0) > 8.0);
    let since = Monotonic.now();
    for speed in [1.0, 1.001] {
        film.asked(&json!(["set_property", "speed", speed]));
        let from = seconds(since, Monotonic.now());
        relay.wait_for(|_| seconds(since, Monotonic.now()) > from + 3.0);
        let behind = behind_s(&relay, &mut film, since);
        // A third of a frame's length, and less than a tenth of what is felt.
        assert!(behind.abs() < 0.003, "{:.2} ms at speed {speed}", 1e3 * behind);
    }
    drop(film);
    playing.wait_for("waiting: no position is received from the film any more");
}
