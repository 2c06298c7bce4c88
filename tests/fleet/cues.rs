//! Cues from a desk into the libraries of halls: which has what, and why not.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;

use crate::fleet::Engine;
use crate::hall::{Hall, swell};

const CUES: &str = r#"["cues"]"#;

/// A cue at the desk.
pub(crate) fn cue(engine: &Engine, id: &str, text: &str) -> PathBuf {
    let file = engine.path(&format!("{id}.csv"));
    fs::write(&file, text).unwrap();
    file
}

/// Pushes a cue to halls; gives how that ended.
fn push(engine: &Engine, id: &str, text: &str, more: &[&str]) -> crate::process::Run {
    let file = cue(engine, id, text);
    engine.desk(&[&["push", file.to_str().unwrap(), "--within", "50"][..], more].concat())
}

/// What is in the library of a hall, with what is in it.
pub(crate) fn library(hall: &Hall) -> Vec<(String, Vec<u8>)> {
    folder(hall, "cues")
}

/// What people see in a folder of a hall, with what is in it.
pub(crate) fn folder(hall: &Hall, name: &str) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(hall.path(name)).unwrap().map(Result::unwrap);
    let mut files: Vec<_> = entries
        .filter_map(|entry| Some((entry.file_name().into_string().unwrap(), fs::read(entry.path()).ok()?)))
        .filter(|(name, _)| !name.starts_with('.'))
        .collect();
    files.sort();
    files
}

fn has(hall: &Hall, name: &str) -> Option<Vec<u8>> {
    library(hall).into_iter().find(|(file, _)| file == name).map(|(_, text)| text)
}

fn state<'v>(hall: &'v Value, id: &str) -> &'v Value {
    let cues = hall["cues"].as_array().unwrap();
    cues.iter().find(|cue| cue["id"] == id).map_or(&Value::Null, |cue| &cue["text"])
}

#[test]
fn one_command_brings_a_cue_into_all_halls_but_the_one_whose_seats_it_breaks_which_says_why() {
    let Some(engine) = Engine::start("h1,h2,h3") else { return };
    let (one, two) = (engine.hall("h1", CUES), engine.hall("h2", CUES));
    let slow = |config: String| config.replace("max_velocity_mm_s = 240.0", "max_velocity_mm_s = 12.0");
    let three = engine.hall_with("h3", CUES, slow);
    let _links = [engine.link("h1", &one), engine.link("h2", &two), engine.link("h3", &three)];
    let run = push(&engine, "tomorrow", &swell(5), &["--to", "berlin.*"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(
        run.stdout.starts_with("2 of 3 are there; not there:\nberlin.h3: tomorrow: refused: "),
        "{run:?}"
    );
    let fault = run.stdout.lines().find(|line| line.contains("velocity")).expect("the fault is told");
    assert!(
        fault.starts_with("  ") && fault.contains("8:5: a1: ") && fault.contains("is over 12.0"),
        "{fault}"
    );
    for hall in [&one, &two] {
        assert_eq!(has(hall, "tomorrow.csv").unwrap(), swell(5).into_bytes());
        assert_eq!(hall.status()["show"], Value::Null, "nothing is loaded by it");
        hall.done(&["load", "tomorrow"]);
    }
    assert!(has(&three, "tomorrow.csv").is_none());
    let run = engine.desk(&["have"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stdout.contains("1 of 1") && run.stdout.contains("0 of 1"), "{run:?}");
    assert!(run.stdout.contains("\nberlin.h3: tomorrow: refused: "), "{run:?}");
    let h3 = engine.has("berlin.h3", |hall| hall["report"]["version"] == env!("CARGO_PKG_VERSION"));
    assert_eq!(h3["report"]["config"].as_str().unwrap().len(), 64, "{h3}");
    // Its people let their seats be faster, and it comes by itself.
    three.rewrite(|config| config.replace("= 12.0", "= 240.0"));
    three.done(&["reload"]);
    let run = push(&engine, "tomorrow", &swell(5), &["--to", "all"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "all halls have all of it\n"), "{run:?}");
    assert_eq!(engine.desk(&["have"]).code, Some(0));
}

#[test]
fn what_people_of_a_hall_uploaded_is_never_replaced() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", CUES);
    let _link = engine.link("h1", &hall);
    let own = fs::read(hall.path("cues/ride.csv")).unwrap();
    let run = push(&engine, "ride", &swell(3), &["--to", "all"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stdout.contains("refused: people of the hall have another cue ride"), "{run:?}");
    assert_eq!(has(&hall, "ride.csv").unwrap(), own);
    assert_eq!(push(&engine, "ride", &swell(2), &["--to", "all"]).code, Some(0), "they have that very one");
}

#[test]
fn what_the_fleet_brought_is_replaced_by_it_until_people_upload_another_of_that_id() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", CUES);
    let _link = engine.link("h1", &hall);
    for seconds in [4, 5] {
        assert_eq!(push(&engine, "storm", &swell(seconds), &["--to", "all"]).code, Some(0));
        assert_eq!(has(&hall, "storm.csv").unwrap(), swell(seconds).into_bytes());
    }
    let theirs = cue(&engine, "theirs", &swell(6));
    hall.done(&["upload", theirs.to_str().unwrap(), "--id", "storm"]);
    let run = push(&engine, "storm", &swell(7), &["--to", "all"]);
    assert!(
        run.code == Some(1) && run.stdout.contains("people of the hall have another cue storm"),
        "{run:?}"
    );
    assert_eq!(has(&hall, "storm.csv").unwrap(), swell(6).into_bytes());
}

#[test]
fn an_armed_hall_takes_nothing_until_it_is_disarmed_and_what_is_loaded_stays() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", CUES);
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    assert_eq!(push(&engine, "film", &swell(2), &["--to", "all"]).code, Some(0));
    hall.arm("film");
    let before = library(&hall);
    assert_eq!(push(&engine, "tomorrow", &swell(3), &["--to", "all", "--no-wait"]).code, Some(0));
    engine.has("berlin.h1", |hall| *state(hall, "tomorrow") == "waiting: the hall is armed");
    hall.done(&["go"]);
    hall.comes_to("playing");
    engine.has("berlin.h1", |hall| *state(hall, "tomorrow") == "waiting: the hall is playing");
    assert_eq!(library(&hall), before);
    assert_eq!(fs::read_dir(hall.path("link")).map_or(0, Iterator::count), 0, "nor is it fetched");
    hall.wait(|status| status["cause"] == "the seats that take part have parked");
    engine.has("berlin.h1", |hall| *state(hall, "tomorrow") == "ready");
    assert_eq!(has(&hall, "tomorrow.csv").unwrap(), swell(3).into_bytes());
    // What is loaded is replaced once something else is.
    assert_eq!(push(&engine, "film", &swell(4), &["--to", "all", "--no-wait"]).code, Some(0));
    engine.has("berlin.h1", |hall| *state(hall, "film") == "waiting: film is loaded");
    assert_eq!(has(&hall, "film.csv").unwrap(), swell(2).into_bytes());
    let run = engine.desk(&["have"]);
    assert!(run.code == Some(75) && run.stdout.contains("1 of 2"), "{run:?}");
    hall.done(&["load", "night"]);
    engine.has("berlin.h1", |hall| *state(hall, "film") == "ready");
    assert_eq!(has(&hall, "film.csv").unwrap(), swell(4).into_bytes());
}

#[test]
fn a_hall_that_does_not_allow_it_and_one_that_is_away_are_told_apart() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let closed = engine.hall("h1", r#"["load", "levels"]"#);
    let link = engine.link("h1", &closed);
    let before = library(&closed);
    let file = cue(&engine, "storm", &swell(2));
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "all", "--within", "5"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stdout.contains("berlin.h1: storm: refused: allow of [fleet] does not name cues"), "{run:?}");
    assert!(run.stdout.contains("berlin.h2: storm: waiting: the hall told nothing yet"), "{run:?}");
    assert_eq!(library(&closed), before);
    drop(link);
    let away = engine.hall("h2", CUES);
    let _link = engine.link("h2", &away);
    engine.has("berlin.h2", |hall| *state(hall, "storm") == "ready");
    assert_eq!(engine.desk(&["have", "berlin.h2"]).code, Some(0));
}

#[test]
fn a_desk_is_told_that_the_link_has_no_place_for_a_cue() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", CUES);
    hall.write("link", "a file, where the folder of its cues would be");
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    let run = push(&engine, "storm", &swell(3), &["--to", "all", "--no-wait"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    engine.has("berlin.h1", |hall| {
        hall["cues"].to_string().contains("waiting: its link has no place for cues in")
    });
}
