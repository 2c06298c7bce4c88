//! Attacks.

use std::thread::sleep;
use std::time::Duration;

use rustix::process::Signal;
use serde_json::Value;

use crate::house::{House, Show};
use crate::process::Row;
use crate::takeovers::{judge, tell};

fn place(status: &Value) -> f64 {
    status["show"]["position_s"].as_f64().unwrap_or(-1.0)
}

fn next(show: &Show) -> String {
    show.wait(|_| true)["next"].as_str().unwrap_or_default().to_owned()
}

/// What B says once it has read all and had time for its preflight.
fn settled(house: &House, name: &str, who: usize) -> Value {
    house.shows[who].leads(name, "recovering");
    sleep(Duration::from_millis(2_500));
    house.shows[who].wait(|_| true)
}

fn words(status: &Value) -> String {
    let notes = status["warnings"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| one["text"].as_str().unwrap_or(""))
        .collect::<Vec<_>>();
    format!(
        "state {} cause {} next {} lapses {} resume_s {} job {} warnings {notes:?}",
        status["state"],
        status["cause"],
        status["next"],
        status["lapses_s"],
        status["show"]["resume_s"],
        status["job"]
    )
}

fn all_end(house: House) -> [Vec<Row>; 2] {
    house.ends()
}

#[test]
fn a1_a_test_of_the_seats() {
    let Some(house) = House::playing() else { return };
    let mut house = house;
    house.shows[0].done(&["park"]);
    house.shows[0].comes_to("parked");
    house.shows[0].done(&["arm"]);
    let run = house.shows[0].run(&["test", "sweep", "--help"]);
    tell(&format!("{run:?}"));
    let socket = house.shows[0].path("control.sock");
    let mut sweep = std::process::Command::new(env!("CARGO_BIN_EXE_kinocue"))
        .args(["test", "sweep", "--seats-empty"])
        .env("KINOCUE_SOCKET", socket)
        .stdin(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let status = house.shows[0].wait(|status| status["state"] == "playing" || status["state"] == "joining");
    tell(&format!("A: {} {}", status["show"]["cue"], status["job"]));
    sleep(Duration::from_millis(1_500));
    house.shows[0].kill();
    let _ = sweep.kill();
    let _ = sweep.wait();
    let status = settled(&house, "B", 1);
    tell(&format!("B: {}", words(&status)));
    let run = house.shows[1].run(&["resume"]);
    tell(&format!("{run:?}"));
    all_end(house);
    assert_ne!(run.code, Some(0), "a test of the seats is no show");
}

#[test]
fn a2_b_was_held_while_a_died() {
    let Some(mut house) = House::playing() else { return };
    let at = place(&house.shows[0].wait(|_| true));
    let since = std::time::Instant::now();
    house.shows[1].serving().signal(Signal::STOP);
    sleep(Duration::from_millis(2_000));
    house.shows[0].kill();
    sleep(Duration::from_millis(6_000));
    house.shows[1].serving().signal(Signal::CONT);
    let status = settled(&house, "B", 1);
    let film = at + since.elapsed().as_secs_f64();
    tell(&format!("B: {} film {film}", words(&status)));
    let run = house.shows[1].run(&["resume"]);
    let resumed = place(&house.shows[1].wait(|_| true));
    tell(&format!("{run:?} at {resumed} film {}", at + since.elapsed().as_secs_f64()));
    all_end(house);
    assert_ne!(run.code, Some(0), "A was heard 8 s before");
}

#[test]
fn a3_the_settings_are_not_written_all_the_time() {
    let Some(mut house) = House::playing() else { return };
    house.shows[0].kill();
    let status = settled(&house, "B", 1);
    tell(&format!("B: {}", words(&status)));
    let path = house.shows[1].path("state/settings.json");
    let stamp = || std::fs::metadata(&path).unwrap().modified().unwrap();
    let (mut seen, mut last) = (0, stamp());
    for _ in 0..300 {
        sleep(Duration::from_millis(10));
        let now = stamp();
        seen += usize::from(now != last);
        last = now;
    }
    tell(&format!("written {seen} times in 3 s"));
    all_end(house);
    assert!(seen < 4, "{seen}");
}

#[test]
fn a4_there_and_back_again() {
    let Some(mut house) = House::playing() else { return };
    let at = place(&house.shows[0].wait(|_| true));
    let since = std::time::Instant::now();
    let film = |since: &std::time::Instant| at + since.elapsed().as_secs_f64();
    house.shows[0].kill();
    settled(&house, "B", 1);
    for _ in 0..2 {
        house.shows[1].done(&["resume"]);
    }
    let status = house.shows[1].comes_to("playing");
    tell(&format!("B plays at {} film {} journal {}", place(&status), film(&since), status["journal"]));
    house.start(0);
    house.shows[0].serving().heard(|line| line.contains("A stands by").then_some(()));
    sleep(Duration::from_millis(2_500));
    house.shows[1].kill();
    let status = settled(&house, "A", 0);
    tell(&format!("A: {}", words(&status)));
    house.shows[0].done(&["resume"]);
    let status = house.shows[0].comes_to("playing");
    let (place, film) = (place(&status), film(&since));
    tell(&format!("A plays at {place} film {film}"));
    assert!((place - film).abs() < 0.5);
    // B is back and stands by; A is not on a show any more.
    house.start(1);
    house.shows[1].serving().heard(|line| line.contains("B stands by").then_some(()));
    sleep(Duration::from_millis(1_500));
    house.shows[0].done(&["stop"]);
    tell(&format!("B before: {:?}", house.shows[1].serving().lines()));
    house.shows[0].kill();
    sleep(Duration::from_millis(4_000));
    let lines = house.shows[1].serving().lines();
    tell(&format!("B then: {lines:?}"));
    if !lines.iter().any(|line| line.contains("leads the hall")) {
        tell(&format!("B ended: {:?}", house.shows[1].ended()));
        panic!("it ended");
    }
    let status = settled(&house, "B", 1);
    tell(&format!("B after a stop: {}", words(&status)));
    let run = house.shows[1].run(&["resume"]);
    tell(&format!("{run:?}"));
    assert_ne!(run.code, Some(0));
    house.shows[1].done(&["park"]);
    house.shows[1].comes_to("parked");
    let report = house.shows[1].run(&["report", "--log", house.shows[1].path("log").to_str().unwrap()]);
    tell(&format!("{report:?}"));
    all_end(house);
}

#[test]
fn a5_killed_again_before_anybody_resumed() {
    let Some(mut house) = House::playing() else { return };
    house.shows[0].kill();
    let status = settled(&house, "B", 1);
    tell(&format!("B: {}", words(&status)));
    house.shows[1].kill();
    house.start(1);
    let status = settled(&house, "B", 1);
    tell(&format!("B anew: {}", words(&status)));
    let run = house.shows[1].run(&["resume"]);
    tell(&format!("{run:?}"));
    assert_ne!(run.code, Some(0));
    house.shows[1].done(&["park"]);
    house.shows[1].comes_to("parked");
    let status = house.shows[1].wait(|status| status["next"] != "park, or home");
    tell(&format!("B parked: {}", words(&status)));
    all_end(house);
}

#[test]
fn a6_killed_on_the_way() {
    for what in ["pause", "seek", "disable", "park", "stop", "go", "home"] {
        let Some(mut house) = House::playing() else { return };
        let mut place_a = 0.0;
        match what {
            "pause" => {
                house.shows[0].done(&["pause"]);
                place_a = place(&house.shows[0].comes_to("paused"));
            }
            "seek" => {
                house.shows[0].done(&["seek", "1:30"]);
                place_a = 90.0;
            }
            "disable" => house.shows[0].done(&["disable", "A1"]),
            "go" => {
                house.shows[0].done(&["park"]);
                house.shows[0].comes_to("parked");
                house.shows[0].done(&["arm"]);
                house.shows[0].done(&["go"]);
            }
            "home" => {
                house.shows[0].done(&["park"]);
                house.shows[0].comes_to("parked");
                house.shows[0].done(&["home", "--seats-empty"]);
            }
            other => house.shows[0].done(&[other]),
        }
        if !["seek", "disable", "go"].contains(&what) {
            sleep(Duration::from_millis(100));
        }
        house.shows[0].kill();
        let status = settled(&house, "B", 1);
        tell(&format!(
            "{what} ({place_a}): B: {} out {}",
            words(&status),
            status["controllers"][0]["enabled"]
        ));
        let run = house.shows[1].run(&["resume"]);
        sleep(Duration::from_millis(1_500));
        let status = house.shows[1].wait(|_| true);
        tell(&format!(
            "{what}: {:?} {}; now {} at {}",
            run.code,
            run.stderr,
            status["state"],
            place(&status)
        ));
        let may = ["pause", "seek", "disable", "go"].contains(&what);
        house.shows[1].kill();
        let rows = all_end(house);
        for (seat, rows) in rows.iter().enumerate() {
            judge(rows, may && run.code == Some(0) && !(what == "disable" && seat == 0));
        }
        let second = rows
            .iter()
            .map(|rows| rows.iter().filter(|row| row.frame >= 100_000).count())
            .collect::<Vec<_>>();
        tell(&format!("{what}: frames of B {second:?}"));
        assert_eq!(run.code == Some(0), may, "{what}");
        if what == "disable" {
            assert_eq!(second[0], 0);
        }
    }
}

#[test]
fn a7_other_cue_then_resume_and_reload() {
    let Some(mut house) = House::playing() else { return };
    house.shows[0].kill();
    settled(&house, "B", 1);
    tell(&format!("{:?}", house.shows[1].run(&["reload"])));
    sleep(Duration::from_millis(1_500));
    let status = house.shows[1].wait(|_| true);
    tell(&format!("reloaded: {}", words(&status)));
    let run = house.shows[1].run(&["resume"]);
    tell(&format!("{run:?}"));
    assert_ne!(run.code, Some(0));
    tell(&format!("{} {:?}", next(&house.shows[1]), house.shows[1].run(&["park"])));
    house.shows[1].comes_to("parked");
    all_end(house);
}
