//! Controllers that are lost, come back, are stopped or restart in the middle of a show.

use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;

use serde_json::Value;

use crate::Folder;
use crate::process::{Playing, Relay, Sim};

/// Tells the simulator to do something, and waits until it has.
fn tell(control: &Path, command: &str) {
    let mut stream = UnixStream::connect(control).expect("the simulator listens");
    writeln!(stream, "{command}").expect("it takes a line");
    let mut answer = String::new();
    BufReader::new(stream).read_line(&mut answer).expect("it answers");
    assert_eq!(answer.trim(), "ok", "{command}");
}

/// Two controllers of the simulator with safe settings, each behind a relay.
struct Hall {
    folder: Folder,
    control: std::path::PathBuf,
    _sim: Sim,
    relays: Vec<Relay>,
}

impl Hall {
    fn open() -> Self {
        let folder = Folder::new();
        let control = folder.path("control.sock");
        let sim = Sim::start(2, &["--safe", "--axes", "1", "--control", control.to_str().expect("text")]);
        let relays = sim.addresses.iter().map(|address| Relay::start(address)).collect();
        Self { folder, control, _sim: sim, relays }
    }

    fn play(&self, seconds: u32) -> Playing {
        let to: Vec<String> = self.relays.iter().map(Relay::to).collect();
        Playing::start(&self.folder.wave(seconds), &to, &["--json"])
    }

    /// Waits until the first controller has had so many frames.
    fn frame(&self, number: u32) {
        self.relays[0].wait_for(|frame| frame.frame.0 >= number);
    }
}

/// What the report says happened to a controller, in order, and when, seconds.
fn events<'a>(report: &'a Value, name: &str) -> Vec<(f64, &'a str)> {
    let events = report["events"].as_array().expect("a list").iter();
    let own = events.filter(|event| event["controller"] == name);
    own.map(|event| (event["at_s"].as_f64().expect("a time"), event["what"].as_str().expect("text")))
        .collect()
}

fn when(events: &[(f64, &str)], what: &str) -> f64 {
    let found = events.iter().find(|(_, told)| told.starts_with(what));
    found.unwrap_or_else(|| panic!("nothing says {what:?}: {events:?}")).0
}

#[test]
fn a_controller_that_falls_silent_is_given_up_and_joins_again_once_it_speaks_while_the_other_plays_on() {
    let hall = Hall::open();
    let mut playing = hall.play(9);
    hall.frame(300);
    tell(&hall.control, "2@mute=1");
    playing.wait_for("c2: lost: frames to it, or its acks, were missing for over 50 ms");
    tell(&hall.control, "2@mute=0");
    playing.wait_for("c2: back as it was; it rejoins from where it is");
    playing.wait_for("c2: takes part again");
    let report = playing.finish().report_of(0);
    let [first, second] = [0, 1].map(|index: usize| &report["controllers"][index]);
    assert_eq!(first["sent"], report["ticks"], "the other plays on: {report}");
    assert!(second["sent"].as_u64() < first["sent"].as_u64(), "{second}");
    let told = events(&report, "c2");
    let (lost, back, well) = (when(&told, "lost"), when(&told, "rejoining"), when(&told, "ok"));
    assert!(lost < back && back < well, "{told:?}");
    assert!(events(&report, "c1").is_empty(), "{report}");
}

#[test]
fn a_controller_that_restarts_is_not_trusted_with_a_position_any_more() {
    let hall = Hall::open();
    let playing = hall.play(7);
    hall.frame(200);
    tell(&hall.control, "2@reboot");
    let report = playing.finish().report_of(69);
    let told = events(&report, "c2");
    assert!(when(&told, "lost") < when(&told, "excluded"), "{told:?}");
    assert!(!told.iter().any(|(_, what)| what.starts_with("rejoining")), "{told:?}");
}

#[test]
fn an_emergency_stop_at_one_seat_stops_the_hall_and_that_seat_gets_no_further_frame() {
    let hall = Hall::open();
    let mut playing = hall.play(9);
    hall.frame(300);
    tell(&hall.control, "2@X1=1");
    playing.wait_for("c2: stopped: emergency stop; next: release");
    let report = playing.finish().report_of(76);
    assert_eq!(report["result"], "stopped", "{report}");
    let told = events(&report, "c2");
    let stopped = when(&told, "stopped: emergency stop");
    let [first, second] = [0, 1].map(|index: usize| &report["controllers"][index]);
    // The other one is brought to rest: at most 0.15 s of frames, and three that hold.
    let more = first["sent"].as_u64().expect("a count") - second["sent"].as_u64().expect("a count");
    assert!((3..=22).contains(&more), "{more} frames more: {report}");
    // Silent from the period after the first refusal was read; a busy machine may read it some periods late, but before the
    // other one is at rest.
    assert!(second["refused"].as_u64() < Some(15), "it was sent to while it refused: {second}");
    assert!(stopped > 0.0);
}
