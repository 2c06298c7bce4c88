//! `--record`: the file that a play leaves, read by the library that viewers read with.

use mcap::{MessageStream, Summary};
use serde_json::Value;

use super::process::{Sim, play};
use super::{Folder, STROKE};

/// All messages of a topic.
fn messages(file: &[u8], topic: &str) -> Vec<Value> {
    let all = MessageStream::new(file).expect("a recording").map(|one| one.expect("it is whole"));
    let of_topic = all.filter(|one| one.channel.topic == topic);
    of_topic.map(|one| serde_json::from_slice(&one.data).expect("JSON")).collect()
}

fn sum(messages: &[Value], field: &str) -> u64 {
    messages.iter().map(|one| one[field].as_u64().expect("a count")).sum()
}

fn greatest(messages: &[Value], field: &str) -> f64 {
    let places = messages.iter().filter_map(|one| one[field].get(0)?.as_f64());
    places.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn a_recorded_play_leaves_a_file_whose_counts_and_places_are_those_of_report_and_controller() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let path = folder.path("nod.mcap");
    let to = [format!("{},name=F4", sim.addresses[0])];
    let args = ["--json", "--record", path.to_str().expect("UTF-8")];
    let report = play(&folder.nod(&[0.1]), &to, &args).report_of(0);
    let seen = sim.end();
    let file = std::fs::read(&path).expect("it is there");
    let (seat, ticks) = (messages(&file, "/seat/F4"), messages(&file, "/tick"));
    assert_eq!(Value::from(sum(&seat, "sent")), report["controllers"][0]["sent"]);
    assert_eq!(sum(&seat, "unsent") + sum(&seat, "clamps") + sum(&ticks, "dropped"), 0);
    let farthest = f64::from(seen.farthest(0)) * 150.0 / STROKE;
    assert!((greatest(&seat, "sent_mm") - farthest).abs() < 1e-3, "{farthest} mm");
    assert!((greatest(&seat, "asked_mm") - farthest).abs() < 1e-3, "no pose was held back");
    let states: Vec<_> = messages(&file, "/hall").iter().map(|one| one["state"].clone()).collect();
    assert!(states.len() > 2, "it was parked, played and parked: {states:?}");
    let summary = Summary::read(&file).expect("it is closed").expect("it has one");
    let index = &summary.attachment_indexes[0];
    let attached = mcap::read::attachment(&file, index).expect("it is whole");
    assert_eq!(serde_json::from_slice::<Value>(&attached.data).expect("JSON"), report);
    assert!(!folder.path("nod.part.mcap").exists());
}

#[test]
fn a_file_that_is_there_is_not_recorded_over_and_nothing_is_played() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let path = folder.write("yesterday.mcap", "yesterday");
    let run = play(&folder.nod(&[0.1]), &sim.to(), &["--record", path.to_str().expect("UTF-8")]);
    assert_eq!(run.code, Some(74), "{run:?}");
    assert!(run.stderr.contains("yesterday.mcap"), "{}", run.stderr);
    assert_eq!(std::fs::read(&path).expect("it is there"), b"yesterday");
    assert!(sim.end().rows.is_empty());
}
