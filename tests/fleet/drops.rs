//! What the fleet brought and wishes to go again: between shows, and nothing else.

use serde_json::Value;

use crate::cues::{cue, library};
use crate::fleet::Engine;
use crate::hall::{Hall, swell};
use crate::lists::{BOTH, lists, of, send};

/// Brings a cue.
fn push(engine: &Engine, id: &str, more: &[&str]) {
    let file = cue(engine, id, &swell(3));
    let run = engine.desk(&[&["push", file.to_str().unwrap(), "--to", "all"][..], more].concat());
    assert_eq!(run.code, Some(0), "{run:?}");
}

fn is_there(hall: &Hall, name: &str) -> bool {
    library(hall).iter().any(|(file, _)| file == name)
}

/// How far a hall is with what shall go.
fn text<'v>(hall: &'v Value, id: &str) -> &'v str {
    let dropped = hall["dropped"].as_array().unwrap();
    dropped.iter().find(|one| one["id"] == id).and_then(|one| one["text"].as_str()).unwrap_or_default()
}

#[test]
fn what_the_fleet_brought_goes_between_shows_and_a_cue_once_it_is_not_loaded_and_no_playlist_names_it() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", BOTH);
    let _link = engine.link("h1", &hall);
    push(&engine, "storm", &[]);
    assert_eq!(send(&engine, "today", &of("Today", "storm"), &[]).code, Some(0));
    hall.arm("storm");
    let drop = |names: &[&str]| {
        let run = engine.desk(&[&["drop", "--to", "all", "--no-wait"][..], names].concat());
        assert_eq!(run.code, Some(0), "{run:?}");
    };
    drop(&["--playlist", "today"]);
    engine.has("berlin.h1", |hall| text(hall, "today") == "waiting: the hall is armed");
    drop(&["storm"]);
    engine.has("berlin.h1", |hall| text(hall, "storm") == "waiting: the playlist today names it");
    assert!(is_there(&hall, "storm.csv") && lists(&hall).len() == 1);
    hall.done(&["disarm"]);
    engine.has("berlin.h1", |hall| {
        text(hall, "today") == "gone" && text(hall, "storm") == "waiting: storm is loaded"
    });
    assert!(is_there(&hall, "storm.csv") && lists(&hall).is_empty());
    hall.done(&["load", "night"]);
    let run = engine.desk(&["drop", "storm", "--to", "all", "--within", "50"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "all halls are without it\n"), "{run:?}");
    assert!(!is_there(&hall, "storm.csv"));
    // What comes again is there again.
    push(&engine, "storm", &[]);
    assert!(is_there(&hall, "storm.csv"));
}

#[test]
fn a_name_that_no_hall_had_is_said_to_be_none() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", BOTH);
    let _link = engine.link("h1", &hall);
    push(&engine, "storm", &[]);
    let drop = |names: &[&str]| {
        let run = engine.desk(&[&["drop", "--to", "all", "--within", "50"][..], names].concat());
        (run.code, run.stdout)
    };
    for _ in 0..2 {
        let none = "no hall had it: dropped playlist sunday, dropped strom\n".to_owned();
        assert_eq!(drop(&["strom", "--playlist", "sunday"]), (Some(66), none));
    }
    assert!(is_there(&hall, "storm.csv"));
    for _ in 0..2 {
        assert_eq!(drop(&["storm"]), (Some(0), "all halls are without it\n".to_owned()));
    }
}

#[test]
fn what_people_put_there_is_not_dropped_nor_is_what_no_wish_names_any_more() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", BOTH);
    let _link = engine.link("h1", &hall);
    push(&engine, "storm", &[]);
    push(&engine, "calm", &["--only"]);
    hall.write("playlists/own.toml", &of("Own", "night"));
    let run = engine.desk(&["drop", "ride", "--playlist", "own", "--to", "all", "--within", "50"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    for theirs in [
        "dropped ride: refused: people of the hall put the cue ride there",
        "dropped playlist own: refused: people",
    ] {
        assert!(run.stdout.contains(theirs), "{theirs}: {run:?}");
    }
    for name in ["ride.csv", "night.csv", "storm.csv", "calm.csv"] {
        assert!(is_there(&hall, name), "{name}");
    }
    assert_eq!(lists(&hall).len(), 1);
}
