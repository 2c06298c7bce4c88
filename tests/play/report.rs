//! The report: every field, the books, and what stands on which stream.

use serde_json::Value;

use super::process::{Sim, play};
use super::{Folder, shipped, undisturbed};

/// Asserts that every promised field is there with its type, and that the books balance.
pub(super) fn assert_sound(report: &Value) {
    assert!(report["cue"].is_string() && report["result"].is_string(), "{report}");
    for field in ["ticks", "missed_ticks", "strangers"] {
        assert!(report[field].is_u64(), "{field}: {report}");
    }
    assert!(report["rate_hz"].is_f64(), "{report}");
    assert_percentiles(&report["lateness_us"]);
    let realtime = &report["realtime"];
    assert!(
        realtime["policy"].is_string()
            && realtime["priority"].is_u64()
            && realtime["memory_locked"].is_boolean()
            && realtime["spin_us"]["asked"].as_f64() >= realtime["spin_us"]["in_effect"].as_f64(),
        "{report}"
    );
    for one in report["controllers"].as_array().expect("a list") {
        assert_balanced(one, &report["ticks"]);
    }
}

fn assert_balanced(one: &Value, ticks: &Value) {
    let count = |field: &str| one[field].as_u64().unwrap_or_else(|| panic!("{field} is no count: {one}"));
    assert!(one["name"].is_string() && one["address"].is_string(), "{one}");
    assert_eq!(count("asked"), count("acked") + count("refused") + count("lost"), "{one}");
    let sent = count("sent") + count("send_failed");
    assert_eq!(sent, ticks.as_u64().expect("a count") + count("park_frames"), "{one}");
    assert!(count("asked") <= count("sent"), "{one}");
    for field in ["duplicate", "stale", "stray", "port_closed"] {
        count(field);
    }
    assert_percentiles(&one["ack_us"]);
}

/// All null, or all numbers that rise.
fn assert_percentiles(found: &Value) {
    let all = ["p50", "p99", "p999", "max"].map(|name| found.get(name).expect("it is there"));
    let numbers: Vec<f64> = all.iter().filter_map(|value| value.as_f64()).collect();
    assert!(numbers.len() == 4 || all.iter().all(|value| value.is_null()), "{found}");
    assert!(numbers.is_sorted() && numbers.iter().all(|us| *us >= 0.0), "{found}");
}

#[test]
fn a_play_accounts_for_every_frame_in_a_report_with_every_field() {
    let (folder, sim) = (Folder::new(), Sim::start(2, &[]));
    let cue = folder.nod(&[0.1, 0.05, 0.02]);
    let to = [format!("{},name=A1", sim.addresses[0]), sim.addresses[1].clone()];
    let run = play(&cue, &to, &["--json"]);
    assert_eq!(run.stdout.lines().count(), 1, "one object on one line");
    let report = run.report_of(0);
    assert_sound(&report);
    assert_eq!(
        (&report["cue"], &report["result"]),
        (&cue.to_str().expect("text").into(), &"completed".into())
    );
    assert_eq!(
        (&report["format"], &report["rate_hz"], &report["strangers"]),
        (&2.into(), &100.0.into(), &0.into())
    );
    assert!(report["lateness_us"]["max"].is_number());
    for (one, name) in report["controllers"].as_array().expect("a list").iter().zip(["A1", "c2"]) {
        assert_eq!(one["name"], name);
        assert_eq!((&one["asked"], &one["acked"]), (&one["sent"], &one["sent"]), "{one}");
        for field in ["park_frames", "duplicate", "stale", "stray", "send_failed", "port_closed"] {
            assert_eq!(one[field], 0, "{field}: {one}");
        }
        assert!(one["ack_us"]["p50"].as_f64() > Some(0.0), "{one}");
    }
    let seen = sim.end();
    assert!(seen.rest_in_park());
    for (one, seen) in report["controllers"].as_array().expect("a list").iter().zip(&seen.controllers) {
        assert_eq!((&one["address"], &one["sent"]), (&seen["address"], &seen["motion"]));
        assert_eq!(seen["motion"], seen["executed"]);
    }
}

#[test]
fn people_read_the_report_on_stderr_and_stdout_stays_empty() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let run = play(&folder.nod(&[0.1]), &sim.to(), &[]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), ""));
    for part in
        ["completed", "ticks", "lateness", "real time", "no spin", "strangers", "c1", &sim.addresses[0]]
    {
        assert!(run.stderr.contains(part), "{part}: {}", run.stderr);
    }
    let table = run.stderr.lines().find(|line| line.contains("controller ")).expect("a table");
    let columns: Vec<&str> = table.split_whitespace().collect();
    assert!(
        columns.join(" ").contains("sent asked acked lost ack p50"),
        "without counts that are 0 for all: {table}"
    );
    assert!(!run.stderr.contains('\r') && !run.stderr.contains('\u{1b}'), "no progress in a pipe");
}

#[test]
fn with_few_replies_asked_for_the_books_are_of_the_frames_that_ask() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let run = play(&folder.nod(&[0.1]), &sim.to(), &["--ack-every", "5", "--json"]);
    let report = run.report_of(0);
    assert_sound(&report);
    let one = &report["controllers"][0];
    let sent = one["sent"].as_u64().expect("a count");
    assert_eq!((&one["asked"], &one["acked"]), (&sent.div_ceil(5).into(), &one["asked"]), "{one}");
    assert_eq!((&one["lost"], &one["stray"]), (&0.into(), &0.into()), "{one}");
    let seen = sim.end();
    assert_eq!((seen.controllers[0]["executed"].as_u64(), seen.rows.len() as u64), (Some(sent), sent));
    assert!(run.code == Some(0) && seen.rest_in_park());
}

#[test]
fn a_controller_that_answers_no_frame_is_played_nothing_though_few_would_ask() {
    let (folder, sim) = (Folder::new(), Sim::one(&["--mute"]));
    let run = play(&folder.nod(&[0.1]), &sim.to(), &["--ack-every", "5", "--json"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(69), ""));
    assert!(run.stderr.contains("c1: nobody answers, so nothing is played"), "{}", run.stderr);
    let seen = sim.end();
    assert_eq!(seen.controllers[0]["executed"], 1, "the slow frame to park, and nothing else");
}

#[test]
fn a_play_that_spins_before_each_tick_is_acked_like_any_other() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let run = play(&folder.nod(&[0.1]), &sim.to(), &["--spin-us", "900", "--rate", "500", "--json"]);
    let report = run.report_of(0);
    assert_sound(&report);
    let one = &report["controllers"][0];
    assert_eq!((&report["result"], &one["acked"]), (&"completed".into(), &one["sent"]), "{one}");
    let spin = &report["realtime"]["spin_us"];
    assert_eq!(spin["asked"], 900.0);
    assert!(spin["in_effect"].as_f64() > Some(0.0), "{spin}");
    assert!(sim.end().rest_in_park());
}

#[test]
fn the_report_says_what_was_cut_off_the_spin() {
    let folder = Folder::new();
    let cue = folder.nod(&[0.1]);
    let spun = |more: &[&str]| play(&cue, &Sim::one(&[]).to(), more);
    std::thread::scope(|scope| {
        let text = scope.spawn(|| spun(&["--spin-us", "100"]).stderr);
        // At 1 kHz 900 µs are all that work and spin may take together, and there always is work.
        let cut = spun(&["--json", "--rate", "1000", "--spin-us", "900"]).report_of(0);
        let spin = &cut["realtime"]["spin_us"];
        assert!(spin["asked"] == 900.0 && spin["in_effect"].as_f64() < Some(900.0), "{spin}");
        let text = text.join().expect("it does not panic");
        assert!(text.contains(" of 100 µs asked"), "{text}");
    });
}

#[test]
fn without_acks_nothing_is_asked_read_or_judged_and_every_seat_is_homed() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let run = play(&folder.nod(&[0.1]), &sim.to(), &["--no-acks", "--json"]);
    let report = run.report_of(0);
    assert_sound(&report);
    let one = &report["controllers"][0];
    for field in ["asked", "acked", "refused", "lost"] {
        assert_eq!(one[field], 0, "{field}: {one}");
    }
    assert_eq!(
        (&one["park_frames"], &one["ack_us"]["p50"], &one["ack_us"]["max"]),
        (&1.into(), &Value::Null, &Value::Null)
    );
    let seen = sim.end();
    assert_eq!(
        (&seen.controllers[0]["replied"], &seen.controllers[0]["received"]),
        (&0.into(), &one["sent"])
    );
    assert_eq!((seen.rows[0].function.as_str(), seen.rows[0].time_ms), ("0x1401", 3000));
}

#[test]
fn the_last_seconds_of_each_shipped_cue_are_all_acked() {
    let play_end = |name: &str, start: &str, sim: &Sim, to: &[String]| {
        let report = undisturbed(|| {
            let report = play(&shipped(name), to, &["--json", "--start", start]).report_of(0);
            (report.clone(), vec![report])
        });
        assert_sound(&report);
        for one in report["controllers"].as_array().expect("a list") {
            assert_eq!(one["acked"], one["sent"], "{name}: {one}");
        }
        sim.addresses.len()
    };
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let sim = Sim::one(&[]);
            play_end("bench-ride.csv", "17.5", &sim, &sim.to())
        });
        for (name, start) in [("coaster.csv", "49.5"), ("storm.mcap", "43.5")] {
            scope.spawn(move || {
                let sim = Sim::one(&["--axes", "6"]);
                play_end(name, start, &sim, &sim.to())
            });
        }
        scope.spawn(|| {
            let sim = Sim::start(2, &["--axes", "6"]);
            let to =
                [format!("{},axes=6", sim.addresses[0]), format!("{},axes=6,offset=6", sim.addresses[1])];
            play_end("voyage.csv", "55.5", &sim, &to)
        });
    });
}
