//! Proof of play: each record of a hall's journal once, in its order, whatever becomes of link and engine.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::fleet::{Engine, Link};
use crate::hall::Hall;

/// What the journal of a hall has to tell.
fn journal(hall: &Hall) -> Vec<Value> {
    let mut files: Vec<_> =
        fs::read_dir(hall.path("log")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| !file.to_str().unwrap().contains("asked"));
    files.sort();
    let text: String = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

/// Plays `ride` to its end.
fn play(hall: &Hall) {
    hall.done(&["load", "ride"]);
    hall.done(&["preflight"]);
    hall.done(&["arm"]);
    hall.done(&["go"]);
    hall.wait(|status| {
        status["state"] == "parked" && status["cause"] == "the seats that take part have parked"
    });
}

/// Waits until the engine has all that the journal says of so many shows, and says whether each record is there once and in its order.
fn is_told(engine: &Engine, hall: &Hall, shows: usize) {
    let (mut journaled, mut log) = (Vec::new(), Vec::new());
    engine.wait(|_| {
        // The line of its end comes after a show.
        journaled = journal(hall);
        log = engine.log("h1");
        let ended = journaled.iter().filter(|line| line["kind"] == "show").count();
        ended >= shows && log.len() >= journaled.len()
    });
    let records: Vec<_> = log.iter().map(|record| record["record"].clone()).collect();
    assert_eq!(records, journaled);
    let numbers: Vec<_> = log.iter().map(|record| record["n"].as_u64().unwrap()).collect();
    assert_eq!(numbers, (1..=log.len() as u64).collect::<Vec<_>>());
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// A hall that is linked, and heard.
fn linked() -> Option<(Engine, Hall, Link)> {
    let engine = Engine::start("h1,h2")?;
    let hall = engine.hall("h1", "[]");
    let link = engine.link("h1", &hall);
    engine.hears_one();
    Some((engine, hall, link))
}

#[test]
fn what_was_played_while_the_link_was_away_is_told_once_though_two_come_back() {
    let Some((engine, hall, link)) = linked() else { return };
    play(&hall);
    is_told(&engine, &hall, 1);
    drop(link);
    play(&hall);
    let _links = [engine.link("h1", &hall), engine.link("h1", &hall)];
    is_told(&engine, &hall, 2);
    let run = engine.desk(&["report"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(run.stdout.matches(" ride ").count(), 2, "{run:?}");
    assert!(run.stdout.contains("berlin.h2\nnothing was played"), "{run:?}");
}

#[test]
fn an_engine_whose_disk_is_as_it_was_before_a_show_is_told_of_that_show_again_and_of_none_twice() {
    let Some((mut engine, hall, _link)) = linked() else { return };
    let (store, saved) = (engine.path("jetstream"), engine.path("saved"));
    engine.end();
    copy(&store, &saved);
    engine.restart();
    play(&hall);
    is_told(&engine, &hall, 1);
    engine.kill();
    fs::remove_dir_all(&store).unwrap();
    fs::rename(&saved, &store).unwrap();
    engine.restart();
    play(&hall);
    is_told(&engine, &hall, 2);
}
