//! Cues that are cut on their way, to the engine and from it.

use std::fs;

use rustix::process::Signal;

use crate::cues::{cue, library};
use crate::fleet::Engine;
use crate::hall::{Hall, swell};
use crate::relay::CutWay;

const CUES: &str = r#"["cues"]"#;
/// Bytes of a message of the engine.
const CHUNK: u64 = 128 << 10;

/// A cue of some 40 messages: a gentle one with many words about it.
fn long() -> String {
    let words = format!("# note: {}\n", "x".repeat(1000)).repeat(5_200);
    swell(2).replace("# title: Swell\n", &format!("# title: Swell\n{words}"))
}

/// How much of it the link has on its disk.
fn part(hall: &Hall) -> u64 {
    let entries = fs::read_dir(hall.path("link")).into_iter().flatten().map_while(Result::ok);
    entries.map(|entry| entry.metadata().map_or(0, |about| about.len())).max().unwrap_or(0)
}

/// Waits until so much is there.
fn comes_to(hall: &Hall, bytes: u64) {
    hall.wait(|_| part(hall) >= bytes);
}

#[test]
fn a_cue_that_is_cut_at_every_third_of_a_megabyte_goes_on_where_it_was_and_comes_whole() {
    let Some(engine) = Engine::start("h1") else { return };
    let way = CutWay::to(engine.address(), 3 * CHUNK);
    engine.reached_at("h1", way.address());
    let hall = engine.hall("h1", CUES);
    let _link = engine.link("h1", &hall);
    let text = long();
    let file = cue(&engine, "long", &text);
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "all"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(library(&hall).contains(&("long.csv".to_owned(), text.clone().into_bytes())));
    let (cuts, bytes, length) = (way.cuts(), way.bytes(), text.len() as u64);
    assert!(cuts >= 10, "{cuts} cuts");
    // What was under way at a cut comes again, and no more than that.
    assert!(bytes < length + cuts * 4 * CHUNK, "{bytes} bytes for {length} with {cuts} cuts");
}

#[test]
fn a_cue_goes_on_over_a_link_and_an_engine_that_are_killed_in_mid_transfer() {
    let Some(mut engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", CUES);
    // A way that is closed in the middle, so that it is surely there that link and engine are killed.
    let way = CutWay::to(engine.address(), u64::MAX);
    way.ends_at(12 * CHUNK);
    engine.reached_at("h1", way.address());
    let link = engine.link("h1", &hall);
    let text = long();
    let file = cue(&engine, "long", &text);
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "all", "--no-wait"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    comes_to(&hall, 4 * CHUNK);
    link.signal(Signal::KILL);
    drop(link);
    let first = part(&hall);
    let _link = engine.link("h1", &hall);
    way.ends_at(26 * CHUNK);
    comes_to(&hall, first + 4 * CHUNK);
    engine.kill();
    let second = part(&hall);
    assert!(first < second && second < text.len() as u64, "{first} {second}: in the middle, both times");
    engine.restart();
    way.ends_at(u64::MAX);
    engine.has("berlin.h1", |hall| hall["cues"][0]["state"] == "ready");
    assert!(library(&hall).contains(&("long.csv".to_owned(), text.clone().into_bytes())));
    assert_eq!(part(&hall), 0, "the part is gone");
    let (bytes, most) = (way.bytes(), text.len() as u64 + 24 * CHUNK);
    assert!(bytes < most, "{bytes} of {most}: it went on where it was");
}

#[test]
fn a_push_whose_engine_is_killed_in_the_middle_says_so_and_the_next_one_sends_what_is_missing() {
    let Some(mut engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", CUES);
    let _link = engine.link("h1", &hall);
    let (direct, way) = (engine.address().to_owned(), CutWay::to(engine.address(), u64::MAX));
    way.ends_at(12 * CHUNK);
    engine.reached_at("office", way.address());
    let text = long();
    let file = cue(&engine, "long", &text);
    let push = ["push", file.to_str().unwrap(), "--to", "all"];
    let run = engine.desk(&push);
    assert_eq!(run.code, Some(69), "{run:?}");
    assert!(run.stderr.contains("push it again, which sends what is missing"), "{run:?}");
    engine.kill();
    engine.restart();
    engine.reached_at("office", &direct);
    assert!(library(&hall).iter().all(|(name, _)| name != "long.csv"), "what was not wished does not come");
    let run = engine.desk(&push);
    assert_eq!(run.code, Some(0), "{run:?}");
    let sent =
        run.stderr.lines().find_map(|line| line.rsplit_once("; ")?.1.split(' ').next()?.parse::<u64>().ok());
    let all = (text.len() as u64).div_ceil(CHUNK);
    assert!(sent.is_some_and(|sent| (1..all).contains(&sent)), "{sent:?} of {all}: {run:?}");
    assert!(library(&hall).contains(&("long.csv".to_owned(), text.into_bytes())));
}
