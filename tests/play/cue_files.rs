//! What is played: cues, imports and configurations, and what is refused before anything moves.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::process::{Sim, kinocue, play};
use super::{Folder, pulses, shipped};

#[test]
fn what_is_bad_is_refused_before_anything_moves_with_its_place_and_exit_code() {
    let folder = Folder::new();
    let sim = Sim::start(1, &[]);
    let file = |name: &str, bytes: &[u8]| folder.write(name, bytes);
    let whole = std::fs::read(shipped("storm.mcap")).expect("it ships");
    let long_line = format!("time_ms,a1\n0,0\n10,{}\n", "0".repeat(70_000));
    let thirteen: String = (1..=13).map(|axis| format!(",a{axis}")).collect();
    let cases: Vec<(PathBuf, i32, &str)> = vec![
        (file("column_missing.csv", b"time_ms,a2\n0,0\n10,0\n"), 65, ":1:"),
        (file("column_unknown.csv", b"time_ms,a1,b1\n0,0,0\n10,0,0\n"), 65, ":1:12: "),
        (file("axes.csv", format!("time_ms{thirteen}\n").as_bytes()), 65, ":1:"),
        (file("ragged.csv", b"time_ms,a1\n0,0\n10\n"), 65, ":3:"),
        (file("text.csv", b"time_ms,a1\n0,0\n10,high\n"), 65, ":3:4: a1: "),
        (file("nan.csv", b"time_ms,a1\n0,0\n10,NaN\n"), 65, ":3:4: a1: "),
        (file("infinity.csv", b"time_ms,a1\n0,0\n10,inf\n"), 65, ":3:4: a1: "),
        (file("overflow.csv", b"time_ms,a1\n0,0\n10,1e999\n"), 65, ":3:4: a1: "),
        (file("backwards.csv", b"time_ms,a1\n0,0\n10,0\n10,0\n"), 65, ":4:1: time_ms: "),
        (file("late.csv", b"time_ms,a1\n5,0\n10,0\n"), 65, ":2:1: time_ms: "),
        (file("outside.csv", b"time_ms,a1,a2\n0,0,0\n10,0,1.42\n"), 65, ":3:6: a2: 1.42"),
        (file("effect.csv", b"time_ms,a1,fx_lasers\n0,0,0\n10,0,0\n"), 65, ":1:12: fx_lasers: "),
        (file("wide.csv", b"time_ms,a1,a2,a3,a4\n0,0,0,0,0\n10,0,0,0,0\n"), 65, ":1:18: a4: "),
        (file("empty.csv", b""), 65, "empty.csv"),
        (file("latin.csv", b"time_ms,a1\n0,0\n10,\xff\n"), 65, ":3:4"),
        (file("long.csv", long_line.as_bytes()), 65, ":3:"),
        (file("cut.mcap", &whole[..whole.len() / 2]), 65, "--recover"),
        (file("foreign.mcap", b"\x7fELF and so on, no cue at all"), 65, "foreign.mcap"),
        (folder.path("missing.csv"), 66, "missing.csv"),
        (folder.path("").parent().expect("a folder").to_owned(), 66, "folder"),
    ];
    for (cue, code, said) in &cases {
        let to = [format!("{},axes=3", sim.addresses[0])];
        let run = play(cue, &to, &["--json"]);
        assert_eq!((run.code, run.stdout.as_str()), (Some(*code), ""), "{run:?}");
        assert!(run.stderr.contains(said), "{said}: {}", run.stderr);
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    }
    assert_eq!(sim.end().controllers[0]["received"], 0, "nothing was sent");
}

#[test]
fn a_pipe_or_a_device_in_place_of_a_cue_is_refused_at_once() {
    let folder = Folder::new();
    let pipe = folder.path("pipe.csv");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("coreutils").success());
    for path in [pipe.to_str().expect("text"), "/dev/zero"] {
        for command in [vec!["check", path], vec!["info", path], vec!["play", path, "--to", "127.0.0.1:9"]] {
            let run = kinocue(&command);
            assert_eq!(run.code, Some(66), "{run:?}");
            assert!(run.stderr.contains("it is a pipe or a device, not a file; copy its data"), "{run:?}");
        }
    }
}

#[test]
fn the_first_twenty_faults_are_named_and_the_others_counted() {
    let folder = Folder::new();
    let rows: String = (1..=50).map(|row| format!("{},2\n", row * 10)).collect();
    let cue = folder.write("many.csv", format!("time_ms,a1\n0,0\n{rows}"));
    let run = play(&cue, &["127.0.0.1:9".to_owned()], &[]);
    assert_eq!(run.code, Some(65));
    assert_eq!(run.stderr.matches(": a1: 2 is outside").count(), 20, "{}", run.stderr);
    assert!(run.stderr.contains("30 more"), "{}", run.stderr);
}

/// Rows of a motion editor for a platform of six legs: about 1 s each, in mm, slow enough for the corners of straight lines.
const ROWS: &str = "line,time_ms,x,y,z,u,v,w\n1,1000,0,0,0,0,0,0\n2,1000,11,10,9,11,10,9\n3,1000,0,0,0,0,0,0\n4,500,0,0,0,0,0,0\n";

#[test]
fn rows_of_a_motion_editor_play_and_each_is_reached_when_its_time_is_over() {
    let (folder, sim) = (Folder::new(), Sim::one(&["--axes", "6"]));
    let cue = folder.write("platform.csv", ROWS);
    let report = play(&cue, &sim.to(), &["--json", "--from", "rows", "--units", "mm"]).report_of(0);
    let one = &report["controllers"][0];
    assert_eq!((&one["acked"], &report["result"]), (&one["sent"], &"completed".into()));
    let missed = i32::try_from(report["missed_ticks"].as_u64().expect("a count")).expect("few");
    let seen = sim.end();
    // At time 0 the cue stands at row 1, which it reaches after 1 s; row 2 follows after 2 s.
    for (at_ms, part) in [(1000, 0.0), (1500, 0.5), (2000, 1.0), (2500, 0.5)] {
        let row = &seen.rows[at_ms / 10 - 1];
        for (commanded, mm) in row.commanded.iter().zip([11.0, 10.0, 9.0, 11.0, 10.0, 9.0]) {
            // A tick that was missed shifts the cue by its period, and one that came late by a part of it.
            let slack = pulses(mm / 150.0) / 100 * (2 + missed);
            assert!((commanded - pulses(part * mm / 150.0)).abs() <= slack, "{at_ms} ms: {row:?}");
        }
    }
    assert!(seen.rest_in_park());
    let cue = cue.to_str().expect("text");
    for args in [&["--from", "rows"][..], &["--units", "mm"], &["--from", "rows", "--units", "inch"]] {
        let run = kinocue(&[&["play", cue, "--to", "127.0.0.1:9"], args].concat());
        assert_eq!(run.code, Some(64), "a unit is never guessed: {args:?}");
    }
}

#[test]
fn twenty_bytes_a_second_play_once_they_are_converted() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let bytes: Vec<u8> = (0..34_u8)
        .flat_map(|row| [29_u8.saturating_sub(row).min(row) * 2, 29_u8.saturating_sub(row).min(row), 0])
        .collect();
    let (raw, cue) = (folder.write("ride.bin", bytes), folder.path("ride.csv"));
    let [raw, cue_text] = [&raw, &cue].map(|path| path.to_str().expect("text"));
    let run = kinocue(&["convert", raw, cue_text, "--from", "u8", "--axes", "3", "--rate", "20"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let report = play(&cue, &sim.to(), &["--json"]).report_of(0);
    assert_eq!(report["controllers"][0]["acked"], report["controllers"][0]["sent"]);
    let seen = sim.end();
    assert_eq!((seen.farthest(0), seen.farthest(1)), (pulses(28.0 / 255.0), pulses(14.0 / 255.0)));
    assert!(seen.rest_in_park());
}

/// A hall of two seat types: a three-axis bench seat, and a two-axis seat with a longer stroke that gets the last two
/// axes.
fn hall(bench: &str, long: &str) -> String {
    let seat = |name: &str, axes: u32, stroke: u32| {
        format!(
            "[seat.{name}]\naxes = {axes}\nstroke_mm = {stroke}\nlead_mm = 5\npulses_per_rev = 10000\n\
             max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n"
        )
    };
    format!(
        "[show]\nrate_hz = 200\nbind = \"127.0.0.1:0\"\nack_every = 2\n{}{}[effects]\nmist = 5\nair = 1\n\
         [[controller]]\nname = \"A1\"\nrow = \"A\"\nseat = \"bench3\"\naddress = \"{bench}\"\neffects = [\"air\"]\n\
         [[controller]]\nname = \"B1\"\nrow = \"B\"\nseat = \"long\"\naddress = \"{long}\"\naxis_offset = 3\n",
        seat("bench3", 3, 150),
        seat("long", 2, 100),
    )
}

#[test]
fn a_configuration_says_seats_rows_acks_and_which_outputs_the_effects_are() {
    let folder = Folder::new();
    let cue = folder.nod_with(&[0.1, 0.1, 0.1, 0.15, 0.15], ",fx_air,fx_mist", |_| ",1,1".to_owned());
    let (bench, long) = (Sim::one(&[]), Sim::one(&["--axes", "2"]));
    let config = folder.write("hall.toml", hall(&bench.addresses[0], &long.addresses[0]));
    let [cue, config] = [&cue, &config].map(|path| path.to_str().expect("text"));
    let report = kinocue(&["play", cue, "--config", config, "--rate", "250", "--json"]).report_of(0);
    assert_eq!(report["rate_hz"], 250.0, "the command line has the last word");
    let [a1, b1] = [0, 1].map(|index| &report["controllers"][index]);
    assert_eq!((&a1["name"], &b1["name"]), (&"A1".into(), &"B1".into()));
    let (sent, asked) = (a1["sent"].as_u64().expect("a count"), a1["asked"].as_u64().expect("a count"));
    assert_eq!((asked, a1["acked"].as_u64()), (sent.div_ceil(2), Some(asked)), "every other one is asked");
    let (bench, long) = (bench.end(), long.end());
    assert_eq!(bench.farthest(0), pulses(0.1));
    assert_eq!(long.farthest(0), 30_000, "0.15 of 100 mm");
    assert_eq!((bench.rows[20].outputs, long.rows[20].outputs), (0x01, 0x11), "A1 has air alone");
    assert!(bench.rest_in_park() && long.rest_in_park());
}

#[test]
fn a_seat_that_is_not_asked_is_brought_to_its_own_park_pose_and_told_where_that_is_faster_than_50_mm_a_second()
 {
    let (folder, sim) = (Folder::new(), Sim::start(2, &[]));
    let hall = hall(&sim.addresses[0], &sim.addresses[1]);
    let hall = hall.replace("stroke_mm = 150", "stroke_mm = 200\npark = [0.5, 0.5, 0.25]");
    let config = folder.write("hall.toml", hall);
    let cue = folder.nod(&[0.1, 0.1, 0.1, 0.1, 0.1]);
    let [cue, config] = [&cue, &config].map(|path| path.to_str().expect("text"));
    let run = kinocue(&["play", cue, "--config", config, "--json", "--no-acks"]);
    let report = run.report_of(0);
    let slow = [0, 1].map(|index| report["controllers"][index]["park_frames"].as_u64());
    assert_eq!(slow, [Some(1); 2], "where they are nobody asked");
    let notes: Vec<&str> = run.stderr.lines().filter(|line| line.contains("PA0b")).collect();
    assert!(matches!(notes[..], [note] if note.contains("A1") && note.contains("200 mm")), "{notes:?}");
    let seen = sim.end();
    let slow = &seen.rows[0];
    assert_eq!((slow.frame, slow.function.as_str(), slow.time_ms), (1, "0x1401", 3000));
    assert_eq!(slow.commanded, [200_000, 200_000, 100_000]);
    let next = seen.rows.iter().find(|row| row.frame == 2 && row.controller == slow.controller);
    assert_eq!(next.expect("the play goes on").executed, slow.commanded, "tick 0 waits for it");
    assert_eq!(seen.controllers[0]["positions"], serde_json::json!([200_000, 200_000, 100_000]));
}

#[test]
fn bad_configurations_are_78_and_missing_ones_66() {
    let folder = Folder::new();
    let cue = folder.nod(&[0.1, 0.1, 0.1, 0.15, 0.15]);
    let run = |config: &Path| {
        kinocue(&["play", cue.to_str().expect("text"), "--config", config.to_str().expect("text")])
    };
    let same = folder.write("same.toml", hall("127.0.0.1:7408", "127.0.0.1:7408"));
    assert_eq!(run(&same).code, Some(78), "one address twice");
    let mut text = hall("127.0.0.1:7408", "127.0.0.1:7409");
    writeln!(text, "colour = \"red\"").expect("a String takes it");
    let unknown = run(&folder.write("unknown.toml", text));
    assert!(unknown.code == Some(78) && unknown.stderr.contains("colour"), "{unknown:?}");
    assert_eq!(run(&folder.path("missing.toml")).code, Some(66));
}
