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

#[test]
fn what_was_played_while_link_or_engine_were_away_is_told_once_and_in_its_order() {
    let Some(mut engine) = Engine::start("h1,h2") else { return };
    let hall = engine.hall("h1", "[]");
    let link = engine.link("h1", &hall);
    engine
        .wait(|table| table.as_array().is_some_and(|halls| halls.iter().any(|hall| hall["silent"] == false)));
    play(&hall);
    is_told(&engine, &hall, 1);
    // The link dies; a show is played; two links come, of which one is too many.
    drop(link);
    play(&hall);
    let links: [Link; 2] = [engine.link("h1", &hall), engine.link("h1", &hall)];
    is_told(&engine, &hall, 2);
    // The engine dies, and comes back with its disk as it was before the last show.
    engine.end();
    let (store, saved) = (engine.path("jetstream"), engine.path("saved"));
    copy(&store, &saved);
    engine.restart();
    play(&hall);
    is_told(&engine, &hall, 3);
    engine.kill();
    fs::remove_dir_all(&store).unwrap();
    fs::rename(&saved, &store).unwrap();
    engine.restart();
    play(&hall);
    is_told(&engine, &hall, 4);
    drop(links);
    let run = engine.desk(&["report"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(run.stdout.matches(" ride ").count(), 4, "{run:?}");
    assert!(run.stdout.contains("berlin.h2\nnothing was played"), "{run:?}");
}
