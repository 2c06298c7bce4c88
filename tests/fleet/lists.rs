//! Playlists from a desk into halls: checked as those that people load, in their place only between shows, and never loaded by it.

use std::fs;
use std::path::PathBuf;

use jiff::{Timestamp, ToSpan as _};
use serde_json::Value;

use crate::cues::{cue, folder};
use crate::fleet::Engine;
use crate::hall::{Hall, swell};
use crate::process::Run;

pub(crate) const BOTH: &str = r#"["cues", "playlists"]"#;

/// A playlist at the desk.
fn list(engine: &Engine, id: &str, text: &str) -> PathBuf {
    let file = engine.path(&format!("{id}.toml"));
    fs::write(&file, text).unwrap();
    file
}

/// A playlist of one cue.
pub(crate) fn of(title: &str, cue: &str) -> String {
    format!("title = \"{title}\"\n[[entry]]\ncue = \"{cue}\"\n")
}

/// Sends a playlist to all halls; gives how that ended.
pub(crate) fn send(engine: &Engine, id: &str, text: &str, more: &[&str]) -> Run {
    let file = list(engine, id, text);
    engine.desk(&[&["playlist", file.to_str().unwrap(), "--to", "all", "--within", "50"][..], more].concat())
}

/// The playlists of a hall.
pub(crate) fn lists(hall: &Hall) -> Vec<(String, String)> {
    let text = |(name, bytes)| (name, String::from_utf8(bytes).unwrap());
    folder(hall, "playlists").into_iter().map(text).collect()
}

fn has(hall: &Hall, name: &str, text: &str) -> bool {
    lists(hall).contains(&(name.to_owned(), text.to_owned()))
}

fn text<'v>(hall: &'v Value, id: &str) -> &'v str {
    // Where the engine was slow to answer there is none.
    let mut lists = hall["playlists"].as_array().into_iter().flatten();
    lists.find(|list| list["id"] == id).and_then(|list| list["text"].as_str()).unwrap_or_default()
}

#[test]
fn a_playlist_comes_into_halls_that_can_play_it_and_one_that_cannot_says_every_fault() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let one = engine.hall("h1", BOTH);
    let two = engine.hall_with("h2", BOTH, |config| {
        config.replace("[preset.kids]", "[preset.calm]").replace("smoke = 5\n", "")
    });
    let _links = [engine.link("h1", &one), engine.link("h2", &two)];
    let day = "title = \"Saturday\"\n[[entry]]\ncue = \"ride\"\npreset = \"kids\"\n\
               [[entry]]\ncue = \"night\"\neffects = { smoke = false }\n";
    let run = send(&engine, "saturday", day, &[]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(
        run.stdout.starts_with(
            "1 of 2 are there; not there:\nberlin.h2: playlist saturday: refused: the playlist saturday cannot be played\n"
        ),
        "{run:?}"
    );
    for fault in [
        "  saturday.toml:4:10: preset: there is no [preset.kids]",
        "  saturday.toml:7:11: smoke: is not in [effects]",
    ] {
        assert!(run.stdout.contains(fault), "{fault}: {run:?}");
    }
    assert!(has(&one, "saturday.toml", day) && lists(&two).is_empty());
    assert_eq!(
        (&one.status()["playlist"], &one.status()["show"]),
        (&Value::Null, &Value::Null),
        "nothing is loaded"
    );
    one.done(&["playlist", "saturday"]);
    let run = engine.desk(&["have"]);
    assert!(
        run.code == Some(1) && run.stdout.contains("\nberlin.h2: playlist saturday: refused: "),
        "{run:?}"
    );
    // One with faults of its own never leaves the desk.
    let run = send(&engine, "sunday", "title = \"Sunday\"\n", &[]);
    assert!(run.code == Some(1) && run.stderr.contains("the playlist has no entry"), "{run:?}");
}

#[test]
fn a_playlist_that_is_loaded_stays_until_another_is_and_what_people_wrote_always() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", BOTH);
    let _link = engine.link("h1", &hall);
    let (first, second) = (of("First", "ride"), of("Second", "night"));
    assert_eq!(send(&engine, "today", &first, &[]).code, Some(0));
    hall.done(&["playlist", "today"]);
    assert_eq!(send(&engine, "today", &second, &["--no-wait"]).code, Some(0));
    engine.has("berlin.h1", |hall| text(hall, "today").starts_with("waiting: today is loaded, and stays"));
    assert!(has(&hall, "today.toml", &first));
    hall.done(&["playlist", "--none"]);
    engine.has("berlin.h1", |hall| text(hall, "today") == "ready");
    assert!(has(&hall, "today.toml", &second));
    hall.write("playlists/today.toml", &of("Theirs", "night"));
    let run = send(&engine, "today", &first, &[]);
    let theirs = "refused: people of the hall have another playlist today, and what is theirs stays";
    assert!(run.code == Some(1) && run.stdout.contains(theirs), "{run:?}");
    assert!(has(&hall, "today.toml", &of("Theirs", "night")));
}

#[test]
fn a_playlist_waits_for_its_cue_and_for_a_hall_that_is_armed() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", BOTH);
    let _link = engine.link("h1", &hall);
    let run = send(&engine, "today", &of("Today", "storm"), &[]);
    assert!(run.code == Some(1) && run.stdout.contains("  today.toml:3:7: cue: there is no cue"), "{run:?}");
    hall.arm("ride");
    let file = cue(&engine, "storm", &swell(3));
    let push = ["push", file.to_str().unwrap(), "--to", "all", "--no-wait"];
    assert_eq!(engine.desk(&push).code, Some(0));
    engine.has("berlin.h1", |hall| text(hall, "today") == "waiting: its cue storm is not there yet");
    assert_eq!(send(&engine, "more", &of("More", "ride"), &["--no-wait"]).code, Some(0));
    engine.has("berlin.h1", |hall| text(hall, "more") == "waiting: the hall is armed");
    assert!(lists(&hall).is_empty());
    hall.done(&["disarm"]);
    engine.has("berlin.h1", |hall| text(hall, "today") == "ready" && text(hall, "more") == "ready");
    assert!(has(&hall, "today.toml", &of("Today", "storm")));
}

#[test]
fn a_playlist_comes_at_its_time_also_where_link_and_engine_are_gone_by_then() {
    let Some(mut engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", BOTH);
    let link = engine.link("h1", &hall);
    let (before, after) = (of("Before", "ride"), of("After", "night"));
    assert_eq!(send(&engine, "today", &before, &[]).code, Some(0));
    let at = (Timestamp::now() + 10.seconds()).to_string();
    let run = send(&engine, "today", &after, &["--from", &at]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.stdout.contains("berlin.h1: playlist today: checked; it comes at 20"), "{run:?}");
    drop(link);
    engine.kill();
    hall.wait(|_| has(&hall, "today.toml", &after));
    assert!(Timestamp::now() >= at.parse::<Timestamp>().unwrap());
}
