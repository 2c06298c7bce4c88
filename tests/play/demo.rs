//! The demo: the daemon at work with its console, for as long as a ride takes, and nothing left of it.

use std::io::{Read as _, Write as _, pipe};
use std::net::TcpStream;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Stdio;
use std::sync::{Mutex, PoisonError};

use kinocue::harness::sys::clock::{Monotonic, wall_now_ns};
use kinocue::harness::time::Clock as _;
use rustix::process::Signal;
use serde_json::Value;

use super::Folder;
use super::keyboard::{read_all, terminal};
use super::process::{Guarded, PATIENCE, Playing, Run};
use super::programs::is_installed;
use super::report::assert_sound;
use super::wav::silent_film;

/// The console of a demo, and whoever has its link.
struct Console {
    address: String,
    token: String,
}

impl Console {
    /// The one that the demo says is its own.
    fn told(said: &str) -> Self {
        let link = said.lines().find_map(|line| line.strip_prefix("the console: http://")).expect("a link");
        let (address, token) = link.split_once("/#token=").expect("a token");
        Self { address: address.to_owned(), token: token.to_owned() }
    }

    /// The status and the body of a reply.
    fn ask(&self, head: &str, headers: &str, body: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("it takes any");
        let (address, length) = (&self.address, body.len());
        let request = format!(
            "{head} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\n{headers}\r\n{body}"
        );
        stream.write_all(request.as_bytes()).expect("it reads");
        let mut reply = String::new();
        stream.read_to_string(&mut reply).expect("it replies");
        let (head, body) = reply.split_once("\r\n\r\n").expect("a head");
        (head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status"), body.to_owned())
    }

    fn get(&self, path: &str) -> (u16, String) {
        self.ask(&format!("GET {path}"), "", "")
    }

    /// The status is made anew ten times a second.
    fn status_once_it_plays(&self) -> Value {
        let until = Monotonic.now() + PATIENCE;
        loop {
            let (status, hall) = self.get("/api/v1/status");
            let hall: Value = serde_json::from_str(&hall).unwrap_or_else(|error| panic!("{error}: {hall}"));
            assert!(status == 200 && Monotonic.now() < until, "{status}: {hall}");
            // A ride that has not sent a frame yet is over as soon as it is to end, and is none; until then the position is that
            // of the ride before, near its end.
            let at_s = hall["show"]["position_s"].as_f64().unwrap_or(0.0);
            let is_under_way = (0.1..8.0).contains(&at_s);
            if hall["state"] == "playing" && hall["moving"] == true && is_under_way {
                return hall;
            }
        }
    }

    fn trim(&self, headers: &str) -> u16 {
        self.ask("PUT /api/v1/trim", headers, r#"{"offset_s": 0.01}"#).0
    }

    /// The header of whoever has the link.
    fn by_link(&self) -> String {
        format!("Authorization: Bearer {}\r\n", self.token)
    }
}

/// The one folder that the demo has made.
fn only(folder: &Path) -> std::fs::DirEntry {
    let mut entries = std::fs::read_dir(folder).expect("it is ours");
    let only = entries.next().expect("it has one").expect("it is ours");
    assert!(entries.next().is_none());
    only
}

fn is_empty(folder: &Path) -> bool {
    std::fs::read_dir(folder).expect("it is ours").next().is_none()
}

fn demo(folder: &Folder) -> Playing {
    Playing::demo(&folder.path(""), &["--json"], Stdio::null(), Stdio::piped())
}

/// Asserts that four controllers got every frame and acked it, but for those that a busy machine kept from answering for so
/// long that they were lost, and got no frames for a while.
fn assert_all_acked(report: &Value) {
    let events: Vec<&str> =
        report["events"].as_array().expect("a list").iter().filter_map(|one| one["what"].as_str()).collect();
    assert!(events.first().is_none_or(|what| !what.starts_with("rejoining")), "nobody was away: {report}");
    if !events.iter().any(|what| what.starts_with("lost")) {
        assert_sound(report);
    }
    let controllers = report["controllers"].as_array().expect("a list");
    assert_eq!(controllers.len(), 4);
    for one in controllers {
        assert_eq!((&one["acked"], &one["park_frames"]), (&one["sent"], &0.into()), "{one}");
    }
}

#[test]
fn the_demo_serves_the_console_while_it_plays_and_ends_by_itself_with_every_frame_acked() {
    let folder = Folder::new();
    let mut demo = demo(&folder);
    let console = Console::told(&demo.wait_for("playing: the seats that take part are on the cue"));
    let files = only(&folder.path("")).metadata().expect("it is ours");
    assert_eq!(files.permissions().mode() & 0o777, 0o700, "others may not look into it");

    let (status, page) = console.get("/");
    assert!(status == 200 && page.to_lowercase().contains("<!doctype html"), "{status}: {page}");
    let hall = console.status_once_it_plays();
    assert_eq!(hall["controllers"].as_array().map(Vec::len), Some(4), "{hall}");

    assert_eq!(console.trim(""), 403, "without the link one may look, and stop");
    assert_eq!(console.trim(&console.by_link()), 200);

    let run = demo.finish();
    let report = run.report_of(0);
    assert_eq!((&report["result"], &report["rate_hz"]), (&"completed".into(), &100.0.into()));
    assert!(report["ticks"].as_u64() > Some(1_700), "the whole cue: {report}");
    assert_all_acked(&report);
    assert!(is_empty(&folder.path("")), "it leaves no file behind");
}

#[test]
fn the_demo_shows_a_film_and_plays_a_cue_of_its_length_to_it_and_leaves_nothing() {
    if !is_installed("mpv") {
        return;
    }
    let (folder, films) = (Folder::new(), Folder::new());
    let film = films.write("film.wav", silent_film(10));
    let args = ["--json", "--film", film.to_str().expect("text")];
    let mut demo = Playing::demo(&folder.path(""), &args, Stdio::null(), Stdio::piped());
    demo.wait_for("playing: ");
    let report = demo.finish().report_of(0);
    assert_eq!(report["result"], "completed");
    assert_all_acked(&report);
    assert!(is_empty(&folder.path("")), "it leaves no file behind");
}

#[test]
fn the_demo_of_a_film_says_what_to_install_where_there_is_no_player() {
    let films = Folder::new();
    let film = films.write("film.wav", silent_film(10));
    let run =
        Guarded::start_with_path(&["demo", "--film", film.to_str().expect("text")], &films.path("")).finish();
    assert_eq!(run.code, Some(69), "{run:?}");
    assert!(run.stderr.contains("install it (`apt-get install mpv`)"), "{run:?}");
}

#[test]
fn ctrl_c_parks_the_seats_of_the_demo_and_ends_it_with_the_report() {
    let folder = Folder::new();
    let mut demo = demo(&folder);
    Console::told(&demo.wait_for("playing: the seats that take part are on the cue")).status_once_it_plays();
    demo.signal(Signal::INT);
    demo.wait_for("parked: the seats that take part have parked");
    let report = demo.finish().report_of(0);
    assert_eq!(report["result"], "stopped");
    assert_all_acked(&report);
    assert!(is_empty(&folder.path("")));
}

#[test]
fn on_a_terminal_the_console_stays_after_the_ride_to_go_again_until_ctrl_c() {
    let folder = Folder::new();
    let (ours, theirs) = terminal(200);
    let (closed, _open) = pipe().expect("a pipe");
    let written = read_all(ours, closed);
    let end = || Stdio::from(theirs.try_clone().expect("a handle"));
    let demo = Playing::demo(&folder.path(""), &["--json"], end(), end());
    let mut said = String::new();
    while !said.contains("the console stays up: arm and go again there; Ctrl-C ends: http://") {
        said += &written.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("it is silent: {said}"));
    }
    assert!(said.contains("parked: the seats that take part have parked"), "{said}");
    let console = Console::told(&said);
    for step in ["arm", "go"] {
        let sent = wall_now_ns() / 1_000_000;
        let headers = format!("{}X-Kinocue-Sent: {sent}\r\n", console.by_link());
        let (status, reply) = console.ask(&format!("POST /api/v1/show/{step}"), &headers, "{}");
        assert_eq!(status, 200, "{step}: {reply}");
    }
    console.status_once_it_plays();
    demo.signal(Signal::INT);
    let report = demo.finish().report_of(0);
    assert_eq!(report["result"], "stopped", "the second ride");
    assert!(report["ticks"].as_u64() > Some(1_700), "the first ride counts too: {report}");
    assert_all_acked(&report);
    assert!(is_empty(&folder.path("")));
}

/// One at a time: units that hear of nothing for too long are not home, and nobody rides on them.
static DRIVES: Mutex<()> = Mutex::new(());

/// A ride on drives that is ridden to its end by all seats. Where the machine held up units so often that a seat fell out for good (75), it
/// is ridden again, three times at the most.
fn ridden(dialect: &str) -> (Run, Folder) {
    for tries in 0.. {
        let folder = Folder::new();
        let args = ["--json", "--dialect", dialect];
        let mut demo = Playing::demo(&folder.path(""), &args, Stdio::null(), Stdio::piped());
        let begun = demo.wait_for("homing: homed by the operator");
        assert!(begun.contains("the demo does both"), "{begun}");
        demo.wait_for("playing: the seats that take part are on the cue");
        let run = demo.finish();
        if tries == 2 || run.code != Some(75) {
            return (run, folder);
        }
    }
    unreachable!("the last try is given back");
}

/// A ride on drives, and each line about a unit at its end. True with it if all frames were confirmed: a busy machine may keep a
/// unit from being asked for so long that its seat is lost for a while.
fn ride_on_drives(dialect: &str) -> (Vec<String>, bool) {
    let _one = DRIVES.lock().unwrap_or_else(PoisonError::into_inner);
    let (run, folder) = ridden(dialect);
    let report = run.report_of(0);
    assert_eq!(report["result"], "completed");
    let events = report["events"].as_array().expect("a list");
    let is_undisturbed =
        !events.iter().any(|event| event["what"].as_str().is_some_and(|what| what.starts_with("lost")));
    let controllers = report["controllers"].as_array().expect("a list");
    assert_eq!(controllers.len(), 2);
    for one in controllers.iter().filter(|_| is_undisturbed) {
        assert_eq!(one["acked"], one["asked"], "{one}");
        assert!(one["sent"].as_u64() > Some(1_700), "the whole cue: {one}");
    }
    assert!(is_empty(&folder.path("")), "it leaves no file behind");
    let units = run.stderr.lines().filter(|line| line.contains(": unit 1"));
    (units.map(str::to_owned).collect(), is_undisturbed)
}

fn assert_all_say(units: &[String], fine: &[&str]) {
    let wrong = units.iter().find(|unit| fine.iter().any(|fine| !unit.contains(fine)));
    assert_eq!(wrong, None, "not all of {fine:?}");
}

#[test]
fn the_demo_of_silvermax_units_homes_them_first_and_plays_the_ride_and_none_lets_go_or_jumps() {
    let (units, is_undisturbed) = ride_on_drives("silvermax");
    assert_eq!(units.len(), 6, "{units:?}");
    assert_all_say(&units, &["refused 0", "killed 0", "jumps 0"]);
    if is_undisturbed {
        assert_all_say(&units, &["dry 0", "position 0"]);
    }
}

#[test]
fn the_demo_of_sixpack_2_units_homes_them_first_and_plays_the_ride_and_no_step_is_lost() {
    let (units, _) = ride_on_drives("sixpack2");
    assert_eq!(units.len(), 2, "{units:?}");
    let fine = ["unknown 0", "settings while moving 0", "searches by itself 0", "most lost 0 microsteps"];
    assert_all_say(&units, &fine);
}

#[test]
fn the_demo_of_mbox_controllers_plays_the_ride_with_every_frame_acked() {
    let folder = Folder::new();
    let args = ["--json", "--dialect", "mbox"];
    let report = Playing::demo(&folder.path(""), &args, Stdio::null(), Stdio::piped()).finish().report_of(0);
    assert_eq!(report["result"], "completed");
    assert_all_acked(&report);
}
