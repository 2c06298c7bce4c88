//! Cues one after the other, and those that start by the clock.

use std::time::Duration;

use jiff::{Timestamp, ToSpan as _};
use rustix::process::Signal;
use serde_json::Value;

use crate::hall::Hall;

/// Loads a playlist whose second entry starts by itself a few seconds from now; says when.
fn load_timed(hall: &Hall) -> Timestamp {
    let entries = "[[entry]]\ncue = \"ride\"\n[[entry]]\ncue = \"ride\"\nlevel = \"80%\"\n";
    // The proof of a cue has the lowest priority; once it is known it takes no time.
    hall.write("playlists/day.toml", &format!("title = \"Day\"\n{entries}"));
    hall.done(&["playlist", "day"]);
    let at = Timestamp::from_second(Timestamp::now().as_second() + 4).unwrap();
    let time = at.strftime("%H:%M:%S");
    let text = format!("title = \"Day\"\ntimezone = \"UTC\"\n{entries}at = \"{time}\"\n");
    hall.write("playlists/day.toml", &text);
    hall.done(&["playlist", "day"]);
    at
}

fn notes(status: &Value) -> String {
    let warnings = status["warnings"].as_array().expect("a list").iter();
    warnings.filter(|one| one["id"] == "note").map(|one| one["text"].as_str().expect("text")).collect()
}

#[test]
fn an_entry_goes_on_to_the_next_and_both_are_in_the_records() {
    let mut hall = Hall::open();
    let text = "title = \"Day\"\n[[entry]]\ncue = \"ride\"\npreset = \"kids\"\nthen = \"go\"\n\
                [[entry]]\ncue = \"ride\"\nlevel = \"80%\"\neffects = { water = true }\n";
    hall.write("playlists/day.toml", text);
    hall.done(&["playlist", "day"]);
    hall.done(&["preflight"]);
    hall.done(&["arm"]);
    hall.done(&["go"]);
    hall.wait(|status| status["state"] == "joining" && status["playlist"]["current"] == 1);
    let parked = hall.wait(|status| status["state"] == "parked");
    assert_eq!(parked["playlist"]["current"], 1, "and no third");
    hall.close();
    let shows = hall.journal("show");
    let told: Vec<_> = shows
        .iter()
        .map(|show| {
            (&show["playlist"]["entry"], &show["level"], &show["effects_off"], &show["outcome"]["result"])
        })
        .collect();
    let done = &Value::from("completed");
    let water: Value = ["water"].as_slice().into();
    let nothing = Value::Array(Vec::new());
    assert_eq!(told, [(&0.into(), &0.6.into(), &water, done), (&1.into(), &0.8.into(), &nothing, done)]);
}

#[test]
fn a_playlist_that_cannot_be_played_is_refused_at_load_with_every_fault() {
    let hall = Hall::open();
    let steep = "time_ms,a1,a2,a3\n0,0,0,0\n20,1,0,0\n1000,1,0,0\n";
    hall.write("cues/steep.csv", steep);
    let text = "title = \"Day\"\n[[entry]]\ncue = \"ride\"\n[[entry]]\ncue = \"gone\"\n[[entry]]\ncue = \"steep\"\n\
                [[entry]]\ncue = \"ride\"\npreset = \"kidz\"\n";
    hall.write("playlists/day.toml", text);
    let run = hall.run(&["playlist", "day"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    for fault in ["day.toml:5:", "gone", "day.toml:7:", "steep does not pass", "day.toml:10:", "kids"] {
        assert!(run.stderr.contains(fault), "{fault}: {run:?}");
    }
    let status = hall.status();
    assert!(status["playlist"].is_null() && status["show"].is_null(), "{status}");
    assert_eq!(hall.run(&["playlist", "../hall"]).code, Some(64));
    assert_eq!(hall.run(&["playlist", "other"]).code, Some(66));
}

#[test]
fn a_timed_start_goes_by_itself_where_a_person_has_armed_the_hall() {
    let mut hall = Hall::open();
    hall.done(&["preflight"]);
    let at = load_timed(&hall);
    hall.done(&["arm"]);
    let started = hall.wait(|status| status["state"] == "joining");
    assert!(Timestamp::now() >= at, "not before its time");
    assert_eq!((&started["show"]["cue"], &started["levels"]["motion"]), (&"ride".into(), &0.8.into()));
    hall.done(&["stop"]);
    hall.close();
    let begun = &hall.journal("begin")[0];
    assert_eq!((&begun["scheduled"], &begun["operator"]), (&true.into(), &"the playlist".into()));
}

#[test]
fn a_timed_start_moves_nothing_where_nobody_has_armed_the_hall_and_says_so() {
    let hall = Hall::open();
    load_timed(&hall);
    let status = hall.wait(|status| notes(status).contains("nobody had armed"));
    assert_eq!(status["state"], "parked");
    hall.done(&["preflight"]);
    hall.done(&["arm"]);
    assert_eq!(hall.lives_on(50)["state"], "armed", "it is not caught up");
    assert_eq!(hall.end().motion(), 0);
}

#[test]
fn a_timed_start_that_the_daemon_slept_through_is_let_go() {
    let hall = Hall::open();
    hall.done(&["preflight"]);
    let at = load_timed(&hall);
    hall.done(&["arm"]);
    assert!(Timestamp::now() < at, "the machine is too slow for this");
    hall.serving().signal(Signal::STOP);
    while Timestamp::now() < at + 2_500.milliseconds() {
        std::thread::park_timeout(Duration::from_millis(50));
    }
    hall.serving().signal(Signal::CONT);
    let status = hall.lives_on(100);
    assert_eq!(status["state"], "armed", "{status}");
    assert_eq!(hall.end().motion(), 0);
}
