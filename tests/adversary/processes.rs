//! Histories of `kinocue serve` as a real process: `KINOCUE_PROCESSES=N` lives through so many, sixteen at a time; by default
//! a few are.

use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::Clock as _;
use serde_json::Value;
use tempfile::TempDir;

use super::cues::{KINDS, swing};
use super::dice::Dice;
use super::ether::Weather;
use super::hall::{breaches, seats};
use super::http::{Request, To};
use super::judge::Breach;
use super::seat::MS;
use super::serving::{self, Serving};
use super::town::Town;

/// Histories that are lived through at a time.
const AT_A_TIME: usize = 16;
/// Where they begin.
const FIRST: u64 = 77_000;
/// How long it goes on after the first GO.
const LASTS: Duration = Duration::from_secs(8);
/// How long seats may take to rest after a stop.
const RESTS: u64 = 2_500 * MS;

/// A hall of two seats that somebody leads by the control socket.
struct Hall {
    dir: TempDir,
    town: Town,
    serving: Option<Serving>,
    dice: Dice,
    stopped: Option<u64>,
    pressed: [bool; 2],
    diary: Vec<String>,
}

impl Hall {
    fn open(seed: u64) -> Self {
        let mut dice = Dice::new(seed);
        let mut settings: Vec<_> = (0..2).flat_map(|_| seats(&KINDS[0])).collect();
        for (index, seat) in settings.iter_mut().enumerate() {
            seat.address.0[3] = index as u8 + 1;
            seat.hurry = dice.one_in(2);
            (seat.stop_mode, seat.report_ms) = (2, 100);
        }
        let town = Town::open(&settings, seed);
        if dice.one_in(3) {
            town.ether.world().lines[0].seat.put(1, dice.range(5, 140) as f64);
        }
        let dir = tempfile::tempdir().expect("a folder");
        let accepted = "[show]\naccept_findings = [{ check = \"estop-filter\", why = \"slow hands\" }]\n";
        let mut config = serving::hall(dir.path()).replace("[show]\n", accepted);
        let addresses: Vec<String> = town.addresses.iter().map(ToString::to_string).collect();
        serving::write_row(&mut config, "A", &addresses);
        std::fs::write(dir.path().join("hall.toml"), config).expect("the folder is ours");
        std::fs::create_dir(dir.path().join("cues")).expect("the folder is ours");
        for (name, cue) in [("ride", swing(3, 0.8, 40.0, 75.0)), ("one", swing(1, 0.3, 20.0, 120.0))] {
            std::fs::write(dir.path().join(format!("cues/{name}.csv")), cue).expect("the folder is ours");
        }
        let mut hall =
            Self { dir, town, serving: None, dice, stopped: None, pressed: [false; 2], diary: Vec::new() };
        hall.serve();
        hall
    }

    fn note(&mut self, what: String) {
        self.diary.push(format!("{:8.3} s: {what}", self.town.ether.ns() as f64 * 1e-9));
    }

    fn serve(&mut self) {
        let serving = Serving::start(self.dir.path());
        let begun = |line: &str| {
            // A hall of which no seat takes part is in no state but boot.
            ["parked: ", "recovering: ", "stopped: ", "fault: ", "no seat takes part"]
                .iter()
                .any(|state| line.contains(state))
        };
        serving.heard(|line| begun(line).then_some(()));
        self.serving = Some(serving);
    }

    fn post(&mut self, path: &str, body: &str) -> Value {
        let to = To::Unix(self.dir.path().join("control.sock"));
        let request = Request::new("POST", &format!("/api/v1/{path}"));
        let request = if body.is_empty() { request } else { request.json(body) };
        if matches!(path, "show/go" | "show/resume" | "show/park") {
            self.stopped = None;
            let (now, world) = (self.town.ether.ns(), &mut *self.town.ether.world());
            (world.asked, world.asked_at) = (true, now);
        } else if path == "show/stop" {
            self.stopped.get_or_insert(self.town.ether.ns());
        }
        let answer = request.send(&to).value();
        let said = answer["detail"].as_str().or(answer["state"].as_str()).unwrap_or("?").to_owned();
        let fails = answer["preflight"]["findings"].as_array().into_iter().flatten();
        let fails: Vec<&str> = fails
            .filter(|finding| path == "preflight" && finding["severity"] == "error")
            .filter_map(|finding| finding["text"].as_str())
            .collect();
        self.note(format!("{path} {body}: {said} {fails:?}"));
        answer
    }

    fn pass(&mut self, ms: u64) {
        Monotonic.sleep_until(Monotonic.now() + Duration::from_millis(ms));
        let now = self.town.ether.ns();
        if self.stopped.is_some_and(|stopped| now > stopped + RESTS) {
            self.town.nobody_asks();
        }
    }

    /// Loads, checks, arms and lets go, as far as that can be.
    fn begin(&mut self) {
        let cue = self.dice.pick(&[r#"{"cue":"ride"}"#, r#"{"cue":"ride"}"#, r#"{"cue":"one"}"#]);
        self.post("show/load", cue);
        self.post("preflight", "");
        self.post("show/arm", "");
        self.post("show/go", "");
    }

    fn act(&mut self) {
        let seat = self.dice.range(0, 2) as usize;
        match self.dice.range(0, 20) {
            0..=9 => self.ask(),
            10..=14 => self.weather(seat),
            15 => drop(self.post(["controllers/A1/disable", "controllers/A2/disable"][seat], "")),
            16 => drop(self.post(["controllers/A1/enable", "controllers/A2/enable"][seat], "")),
            17 => self.jog(seat),
            18 => self.unkind(seat),
            _ => {
                self.note("it is killed".to_owned());
                drop(self.serving.take());
                self.town.nobody_asks();
                self.serve();
            }
        }
    }

    /// Something that leads somewhere from where the hall is.
    fn ask(&mut self) {
        let to = To::Unix(self.dir.path().join("control.sock"));
        let status = to.get("/api/v1/status").value();
        let path = match status["state"].as_str().unwrap_or("?") {
            "parked" => return self.begin(),
            "recovering" => "show/park",
            "stopped" | "fault" => "show/clear",
            "paused" => self.dice.pick(&["show/resume", "show/resume", "show/park", "show/stop"]),
            "armed" => "show/go",
            // A ride is left alone for a while, or nothing would be far from park.
            _ if !self.dice.one_in(3) => return,
            _ => self.dice.pick(&["show/pause", "show/pause", "show/stop", "show/park"]),
        };
        self.post(path, "");
    }

    fn jog(&mut self, seat: usize) {
        let (axis, mm) = (self.dice.range(0, 3) as usize, self.dice.range(0, 100) as f64 - 50.0);
        let now = self.town.ether.ns();
        let done = self.town.ether.jog(seat, axis, mm, now);
        self.note(format!("seat {}, axis {}: jogged by {mm} mm: {done}", seat + 1, axis + 1));
        if done {
            self.pass(1_500);
        }
    }

    fn weather(&mut self, seat: usize) {
        let ms = self.dice.pick(&[20, 45, 130, 200, 400]);
        let weather = match self.dice.range(0, 7) {
            0 => Weather::Lost,
            1 => Weather::Mute,
            2 => Weather::Cut,
            3 => Weather::Held,
            4 => Weather::Shuffled,
            5 => Weather::Echo(300),
            _ => Weather::Hoarse(3),
        };
        self.note(format!("seat {}: {weather:?} for {ms} ms", seat + 1));
        self.town.ether.turns(seat, weather, ms);
    }

    fn unkind(&mut self, seat: usize) {
        let now = self.town.ether.ns();
        if self.dice.one_in(2) {
            self.note(format!("seat {}: its power goes", seat + 1));
            self.town.ether.world().lines[seat].seat.reboot(now, 1_000 * MS);
        } else {
            self.pressed[seat] = !self.pressed[seat];
            self.note(format!("seat {}: pressed {}", seat + 1, self.pressed[seat]));
            self.town.ether.world().lines[seat].seat.press(self.pressed[seat], now);
        }
    }
}

/// What came of a history.
struct Past {
    breaches: Vec<Breach>,
    frames: u64,
    diary: Vec<String>,
}

/// Eight seconds or so of a hall.
fn live_through(seed: u64) -> Past {
    let mut hall = Hall::open(seed);
    hall.post("show/park", "");
    hall.pass(3_500);
    hall.begin();
    let until = Monotonic.now() + LASTS;
    while Monotonic.now() < until {
        let ms = hall.dice.pick(&[50, 150, 400, 900]);
        hall.pass(ms);
        hall.act();
    }
    drop(hall.serving.take());
    hall.pass(300);
    let frames = hall.town.ether.world().lines.iter().map(|line| line.frames).sum();
    Past { breaches: breaches(&hall.town.ether), frames, diary: hall.diary }
}

fn setting(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|value| value.parse().expect("a number"))
}

#[test]
fn no_history_of_a_real_process_moves_a_seat_faster_than_its_type_allows_or_unasked() {
    let count = setting("KINOCUE_PROCESSES").unwrap_or(2);
    let first = setting("KINOCUE_SEED").unwrap_or(FIRST);
    let [next, bad, played] = [0; 3].map(AtomicU64::new);
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return;
            }
            let Past { breaches, frames, diary } = live_through(first + index);
            played.fetch_add(u64::from(frames > 200), Ordering::Relaxed);
            if !breaches.is_empty() || count == 1 {
                let told: Vec<String> = breaches.iter().take(4).map(ToString::to_string).collect();
                println!("{}: {frames} frames, {told:#?}\n{}", first + index, diary.join("\n"));
            }
            bad.fetch_add(u64::from(!breaches.is_empty()), Ordering::Relaxed);
        }
    };
    thread::scope(|scope| {
        (0..AT_A_TIME.min(count as usize)).for_each(|_| drop(scope.spawn(work)));
    });
    let (bad, played) = (bad.into_inner(), played.into_inner());
    assert_eq!(bad, 0, "{bad} of {count} histories from seed {first}");
    assert!(2 * played >= count, "only in {played} of {count} histories much was played");
}
