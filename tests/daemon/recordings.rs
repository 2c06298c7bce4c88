//! What the service records: shows, marked moments, and what was before it was killed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use kinocue::harness::recording::datagrams;
use kinocue::harness::sys::clock::wall_now_ns;
use kinocue::wire::MotionRequest;
use mcap::{MessageStream, Summary};
use serde_json::{Value, json};

use crate::hall::Hall;
use crate::http::{Request, problem};

/// A recording as a viewer reads it.
struct Recorded {
    octets: Vec<u8>,
    messages: Vec<(String, u64, Value)>,
    full: usize,
}

impl Recorded {
    fn read(path: &Path) -> Self {
        let octets = fs::read(path).expect("it is there");
        let (mut messages, mut full) = (Vec::new(), 0);
        for message in MessageStream::new(&octets).expect("a recording") {
            let message = message.expect("it is whole");
            match serde_json::from_slice(&message.data) {
                Ok(value) if message.channel.message_encoding == "json" => {
                    messages.push((message.channel.topic.clone(), message.log_time, value));
                }
                _ => full += 1,
            }
        }
        Self { octets, messages, full }
    }

    fn of<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a (String, u64, Value)> {
        self.messages.iter().filter(move |(one, ..)| one == topic)
    }

    fn sum(&self, topic: &str, key: &str) -> u64 {
        self.of(topic).filter_map(|(_, _, value)| value[key].as_u64()).sum()
    }

    fn metadata(&self) -> BTreeMap<String, BTreeMap<String, String>> {
        let summary = Summary::read(&self.octets).expect("an index").expect("an index");
        let read = |index| mcap::read::metadata(&self.octets, index).expect("it is whole");
        summary.metadata_indexes.iter().map(|index| (index.name.clone(), read(index).metadata)).collect()
    }

    fn attachment(&self, name: &str) -> String {
        let summary = Summary::read(&self.octets).expect("an index").expect("an index");
        let index = summary.attachment_indexes.iter().find(|one| one.name == name).expect("it is attached");
        let read = mcap::read::attachment(&self.octets, index).expect("it is whole");
        String::from_utf8(read.data.into_owned()).expect("text")
    }
}

/// Waits until a file with that in its name is whole.
fn closed(hall: &Hall, what: &str) -> PathBuf {
    let is_it = |status: &Value| status["record"]["last"].as_str().is_some_and(|name| name.contains(what));
    let status = hall.wait(is_it);
    hall.path("state/recordings").join(status["record"]["last"].as_str().expect("a name"))
}

fn files(hall: &Hall) -> Vec<String> {
    let all = fs::read_dir(hall.path("state/recordings")).into_iter().flatten().flatten();
    all.map(|entry| entry.file_name().into_string().expect("text")).collect()
}

#[test]
fn a_show_leaves_a_recording_whose_counts_are_those_of_its_report_and_in_which_nothing_is_secret() {
    let secret = "[api]\nlisten = [\"127.0.0.1:0\"]\n[[api.token]]\nname = \"door\"\nrole = \"operate\"\n\
        sha256 = \"00112233445566778899aabbccddeeff00112233445566778899aabbccddeeff\"\n";
    let hall = Hall::open_with(|config| format!("{config}{secret}"));
    hall.play("ride");
    hall.comes_to("parked");
    let recorded = Recorded::read(&closed(&hall, "-show-ride"));
    let report: Value = serde_json::from_str(&recorded.attachment("report.json")).unwrap();
    let frames = &report["outcome"];
    let of_seats = |key| recorded.sum("/seat/A1", key) + recorded.sum("/seat/A2", key);
    assert_eq!(Value::from(of_seats("sent")), frames["sent"], "{report}");
    assert_eq!(Value::from(of_seats("acked")), frames["acked"], "{report}");
    let metadata = recorded.metadata();
    assert_eq!((&*metadata["kinocue"]["of"], &*metadata["kinocue"]["cue"]), ("show", "ride"));
    assert_eq!(metadata["kinocue.end"]["dropped"], "0");
    let configuration = recorded.attachment("configuration.toml");
    assert!(
        configuration.contains("rate_hz = 100") && !configuration.contains("0011223344"),
        "{configuration}"
    );
    // Listed with what came of it, and drawn.
    let listed = hall.socket().get("/api/v1/recordings").value()[0].clone();
    assert_eq!(
        [&listed["result"], &listed["lost"], &listed["missed_ticks"]],
        [&frames["result"], &frames["lost"], &frames["missed_ticks"]],
        "{listed}"
    );
    let at = format!("/api/v1/recordings/{}/picture", listed["name"].as_str().unwrap());
    let picture = hall.socket().get(&format!("{at}?seat=A2")).value();
    assert_eq!((&picture["seat"], &picture["seats"]), (&"A2".into(), &json!(["A1", "A2"])));
    assert!(picture["sentence"].as_str().unwrap().starts_with("A2"), "{}", picture["sentence"]);
    assert!(picture["svg"].as_str().unwrap().starts_with("<svg "), "a picture");
    let other = hall.socket().get(&format!("{at}?seat=Z9"));
    assert!(other.problem().0 == 404 && other.text().contains("there are: A1, A2"), "{}", other.text());
    // From before the show to after it, with what people asked.
    let states: Vec<_> = recorded.of("/hall").map(|(_, _, value)| value["state"].clone()).collect();
    assert!(states.len() > 3, "{states:?}");
    assert!(recorded.of("/action").any(|(_, _, value)| value["what"] == "go"));
    assert_eq!(recorded.full, 0, "samples alone");
    assert!(!files(&hall).iter().any(|name| name.contains(".part.")), "{:?}", files(&hall));
}

#[test]
fn every_datagram_of_a_show_is_in_its_full_recording_as_the_controllers_received_it() {
    let hall = Hall::open_with(|config| format!("{config}[record]\nmode = \"full\"\n"));
    hall.play("ride");
    hall.comes_to("parked");
    let file = fs::read(closed(&hall, "-show-ride")).expect("it is there");
    let mut sent = BTreeMap::<usize, Vec<_>>::new();
    for (lane, octets, is_taken) in datagrams(&file) {
        let request = MotionRequest::parse(&octets).expect("a motion frame");
        let positions: Vec<i32> = request.positions.iter().map(|pulses| pulses.0).collect();
        assert!(is_taken);
        sent.entry(lane).or_default().push((request.frame.0, request.time_ms, request.extend, positions));
    }
    let mut received = BTreeMap::<String, Vec<_>>::new();
    for row in hall.end().rows {
        let positions = row.commanded[..3].to_vec();
        received.entry(row.controller).or_default().push((row.frame, row.time_ms, row.extend, positions));
    }
    let (mut sent, mut received): (Vec<_>, Vec<_>) =
        (sent.into_values().collect(), received.into_values().collect());
    sent.sort();
    received.sort();
    assert!(sent.len() == 2 && sent[0].len() > 200, "{} frames", sent[0].len());
    assert_eq!(sent, received);
}

#[test]
fn a_marked_moment_is_kept_with_what_was_before_it_at_full_rate() {
    let hall = Hall::open();
    hall.play("night");
    hall.rises(0);
    let marked = hall.done(&["mark", "a2 jerked!"]);
    assert!(marked.stderr.contains("marked at "), "{marked:?}");
    let recorded = Recorded::read(&closed(&hall, "-incident-mark"));
    let (_, at, mark) = recorded.of("/mark").next().expect("it is marked");
    assert_eq!(mark["text"], "a2 jerked!");
    assert!(mark["film_s"].as_f64().unwrap() > 0.0, "{mark}");
    let first = recorded.messages.first().expect("there are some").1;
    let last = recorded.messages.last().expect("there are some").1;
    assert!(first < *at && last >= at + 9_000_000_000, "{first} {at} {last}");
    assert!(recorded.full > 10, "{} blocks", recorded.full);
    assert!(hall.status()["state"] == "playing", "it plays on");
    assert_eq!(hall.status()["record"]["incidents"]["mark"], 1);
    // Its picture is of the seat that the words name, with one flag for the mark.
    let path = closed(&hall, "-incident-mark");
    let at = format!("/api/v1/recordings/{}/picture", path.file_name().unwrap().to_str().unwrap());
    let picture = hall.socket().get(&at).value();
    assert_eq!(picture["seat"], "A2");
    assert_eq!(picture["svg"].as_str().unwrap().matches(">a2 jerked!<").count(), 1);
    assert_eq!(picture["svg"].as_str().unwrap().matches(">mark").count(), 0);
}

#[test]
fn the_picture_of_an_incident_is_of_the_seat_that_fell_out_and_says_so_in_one_sentence() {
    let hall = Hall::open();
    hall.play("night");
    hall.rises(0);
    hall.relay(1).pull();
    hall.wait(|status| status["record"]["incidents"]["lost-seat"] == 1);
    hall.relay(1).put_back();
    let path = closed(&hall, "-incident-lost-seat");
    let at = format!("/api/v1/recordings/{}/picture", path.file_name().unwrap().to_str().unwrap());
    let picture = hall.socket().get(&at).value();
    let sentence = picture["sentence"].as_str().unwrap();
    assert_eq!(picture["seat"], "A2");
    assert!(
        sentence.starts_with("A2 stood still from 00:") && sentence.contains(": judged lost at 00:"),
        "{sentence}"
    );
    assert_eq!(sentence.matches("A2").count(), 1, "one sentence: {sentence}");
}

#[test]
fn what_the_flight_recorder_holds_is_dumped_as_a_file_that_is_read_like_any_other() {
    let hall = Hall::open();
    hall.play("ride");
    hall.comes_to("parked");
    let dumped = hall.done(&["record", "dump", "--json"]);
    let status: Value = serde_json::from_str(&dumped.stdout).expect("JSON");
    assert_eq!(status["state"], "parked");
    let path = closed(&hall, "-incident-dump");
    let recorded = Recorded::read(&path);
    assert!(recorded.of("/mark").next().is_none() && recorded.full > 0, "nobody marked anything");
    let metadata = recorded.metadata();
    assert_eq!((&*metadata["kinocue"]["of"], &*metadata["kinocue"]["cause"]), ("incident", "dump"));
    // It has all of the show that was before, and what is said of it is what the show's own file says.
    let show = Recorded::read(&closed_show(&hall));
    for key in ["sent", "acked", "lost", "clamps"] {
        assert_eq!(recorded.sum("/seat/A2", key), show.sum("/seat/A2", key), "{key}");
    }
    let of = |args: &[&str]| {
        let run = hall.run(&[args, &[path.to_str().unwrap()]].concat());
        assert_eq!(run.code, Some(0), "{run:?}");
        run.stdout
    };
    let info = of(&["record", "info"]);
    assert!(info.contains("full recording of dump, 100 Hz") && info.contains("A1 ok: "), "{info}");
    assert!(info.contains("/action go: done, "), "{info}");
    assert!(of(&["replay"]).contains("no difference"));
    let refused = hall.run(&["convert", path.to_str().unwrap(), hall.path("a.csv").to_str().unwrap()]);
    assert!(refused.code == Some(65) && refused.stderr.contains("--take sent` makes a cue"), "{refused:?}");
}

fn closed_show(hall: &Hall) -> PathBuf {
    let name = files(hall).into_iter().find(|name| name.ends_with("-show-ride.mcap")).expect("it is closed");
    hall.path("state/recordings").join(name)
}

#[test]
fn of_marks_without_end_few_are_kept_and_the_rest_is_counted_in_the_answers_and_in_the_file() {
    const ASKED: u64 = 300;
    let hall = Hall::open();
    let mut kept = 0;
    for _ in 0..ASKED {
        let reply = Request::new("POST", "/api/v1/record/mark").send(&hall.socket());
        if reply.status == 200 {
            kept += 1;
            continue;
        }
        assert_eq!(reply.problem(), problem(429, "busy"));
        assert!(reply.text().contains("mark again in"), "{}", reply.text());
    }
    assert!((1..ASKED / 2).contains(&kept), "{kept} of {ASKED}");
    let recorded = Recorded::read(&closed(&hall, "-incident-mark"));
    assert_eq!(recorded.of("/mark").count() as u64, kept);
    let more = recorded.of("/event").filter(|(.., event)| event["kind"] == "marks");
    let count =
        |text: &str| text.split(' ').nth(1).and_then(|word| word.parse::<u64>().ok()).expect("a count");
    let more: u64 = more.map(|(.., event)| count(event["text"].as_str().unwrap())).sum();
    assert_eq!(more, ASKED - kept);
    assert_eq!(hall.status()["record"]["more_marks"], more);
    // Nor does what was asked fill it: repeats are told once in ten seconds.
    assert!(recorded.of("/action").count() < 30, "{}", recorded.of("/action").count());
}

#[test]
fn what_was_before_a_crash_in_mid_show_is_whole_after_the_next_start_and_nothing_moves() {
    let mut hall = Hall::open();
    hall.play("night");
    hall.rises(0);
    // What is killed has lost its last second.
    hall.lives_on(120);
    hall.kill();
    let killed = wall_now_ns();
    assert!(files(&hall).iter().any(|name| name.ends_with("-show-night.part.mcap")), "{:?}", files(&hall));
    hall.relay(0).count();
    hall.serve();
    hall.wait(|_| {
        let files = files(&hall);
        !files.iter().any(|name| name.contains(".part.")) && files.len() >= 2
    });
    assert_eq!(hall.relay(0).count(), 0, "no motion frame");
    for what in ["-show-night.mcap", "-incident-crash.mcap"] {
        let name = files(&hall).into_iter().find(|name| name.ends_with(what)).expect("it was recovered");
        let recorded = Recorded::read(&hall.path("state/recordings").join(name));
        let last = recorded.of("/tick").last().expect("there are some").1;
        assert!(killed - last < 1_000_000_000, "{what}: {} ms were lost", (killed - last) / 1_000_000);
        assert!(recorded.sum("/seat/A1", "acked") > 0, "{what}");
    }
}

#[test]
fn where_nothing_can_be_written_the_show_goes_on_and_it_is_said_what_to_do() {
    let hall = Hall::open_with(|config| {
        let dir = config.lines().find_map(|line| line.strip_prefix("library = \"")).unwrap();
        let dir = dir.trim_end_matches("cues\"");
        format!("{config}[record]\ndir = \"{dir}hall.toml\"\n")
    });
    hall.play("ride");
    let told = hall.wait(|status| status["record"]["troubles"]["show"].is_string());
    let trouble = told["record"]["troubles"]["show"].as_str().unwrap();
    assert!(trouble.contains("hall.toml") && trouble.contains("[record] dir"), "{trouble}");
    let warnings = told["warnings"].as_array().unwrap();
    assert!(warnings.iter().any(|one| one["id"] == "record-show"), "{warnings:?}");
    hall.parks_in_time();
}

#[test]
fn recordings_are_listed_and_taken_away_by_their_names_alone() {
    let hall = Hall::open();
    hall.done(&["mark"]);
    let path = closed(&hall, "-incident-mark");
    let name = path.file_name().unwrap().to_str().unwrap();
    let list = hall.socket().get("/api/v1/recordings").value();
    assert_eq!((&list[0]["name"], list.as_array().unwrap().len()), (&Value::from(name), 1));
    let file = hall.socket().get(&format!("/api/v1/recordings/{name}"));
    assert_eq!(file.header("content-length").unwrap(), fs::metadata(&path).unwrap().len().to_string());
    for other in ["hall.toml", "..%2Fhall.toml", "..%2F..%2Fcontrol.sock"] {
        let reply = hall.socket().get(&format!("/api/v1/recordings/{other}"));
        assert_eq!(reply.problem().0, 404, "{other}");
    }
    let reply = Request::new("DELETE", &format!("/api/v1/recordings/{name}")).send(&hall.socket());
    assert_eq!(reply.value().as_array().unwrap().len(), 0);
    assert!(!path.exists());
}
