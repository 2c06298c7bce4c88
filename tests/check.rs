//! `check`, `info` and `completions` as a person runs them: exit codes, places of faults, the shape of `--json`.

use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

const CUE: &str = "cues/coaster.csv";
const HALL: &str = "tests/data/config/hall.toml";
const BAD_HALL: &str = "tests/data/config/every_fault.toml";

struct Run {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Run {
    fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).expect("one JSON object")
    }
}

fn kinocue(args: &[&str]) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).args(args).output().expect("kinocue runs");
    let text = |octets| String::from_utf8(octets).expect("UTF-8");
    Run { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("the folder is ours");
    path.display().to_string()
}

#[test]
fn a_sound_cue_and_a_sound_hall_pass() {
    let run = kinocue(&["check", CUE, HALL]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    assert!(run.stdout.contains("cues/coaster.csv: passed: 6 axes"), "{}", run.stdout);
    assert!(run.stdout.contains("hall.toml: passed: 4 controllers"), "{}", run.stdout);
}

#[test]
fn every_fault_of_every_file_is_listed_and_the_worst_kind_is_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "bad.csv", "time_ms,a1\n0,0.5\n10,1.5\n20,x\n");
    let run = kinocue(&["check", &cue]);
    assert_eq!(run.code, Some(65));
    assert!(run.stderr.contains("bad.csv:3:4: a1: 1.5 is outside the stroke, 0 to 1\n"), "{}", run.stderr);
    assert!(run.stderr.contains("bad.csv:4:4: a1: \"x\" is not a number\n"), "{}", run.stderr);
    let run = kinocue(&["check", &cue, BAD_HALL]);
    assert_eq!(run.code, Some(78));
    assert!(
        run.stderr.contains("every_fault.toml:2:11: rate_hz: 2000 is outside 1..=1000\n"),
        "{}",
        run.stderr
    );
    assert!(run.stderr.ends_with("20 faults\n"), "{}", run.stderr);
    assert_eq!(kinocue(&["check", &cue, BAD_HALL, "nowhere.csv"]).code, Some(66));
    assert_eq!(kinocue(&["check", "cues"]).code, Some(66));
    assert_eq!(kinocue(&["check", "nowhere.toml"]).code, Some(66));
    assert_eq!(kinocue(&["check", CUE, "--config", BAD_HALL]).code, Some(78));
}

#[test]
fn a_cue_is_held_against_the_hall() {
    let run = kinocue(&["check", "cues/voyage.csv", "--config", HALL]);
    assert_eq!(run.code, Some(65));
    assert!(run.stderr.contains("voyage.csv:4:64: fx_wind: unknown effect"), "{}", run.stderr);
    let folder = tempfile::tempdir().unwrap();
    let hall = std::fs::read_to_string(HALL).unwrap().replace("axis_offset = 6", "axis_offset = 5");
    let hall = write(folder.path(), "hall.toml", &hall);
    let run = kinocue(&["check", "cues/voyage.csv", "--config", &hall]);
    assert!(run.stderr.contains("voyage.csv:4:44: a12: no controller takes this axis"), "{}", run.stderr);
}

#[test]
fn an_editors_rows_are_judged_in_their_unit_against_the_seat() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "1,2000,10,20\n2,2000,160,20\n3,2000,10,20\n";
    let cue = write(folder.path(), "rows.csv", &format!("line,time_ms,x,y\n{rows}"));
    let args = ["check", &cue, "--from", "rows", "--units", "mm", "--json"];
    let run = kinocue(&args);
    assert_eq!(run.code, Some(65), "{}", run.stderr);
    assert_eq!(run.json()["faults"][0]["line"], 3);
    let run = kinocue(&[&args[..], &["--config", HALL, "--seat", "platform6"]].concat());
    assert_eq!((run.code, &run.json()["seat"]), (Some(0), &"platform6".into()), "{}", run.stderr);
    assert_eq!(kinocue(&["check", &cue, "--from", "rows"]).code, Some(64), "the unit is not guessed");
}

#[test]
fn what_is_asked_wrongly_is_a_usage_error() {
    for args in [
        &["check"][..],
        &["check", CUE, "--rate", "0"],
        &["check", CUE, "--rate", "1001"],
        &["check", CUE, "--seat", "throne"],
        &["info", CUE, "--config", HALL, "--seat", "throne"],
        &["info", CUE, CUE],
        &["completions", "punchcard"],
    ] {
        let run = kinocue(args);
        assert_eq!(run.code, Some(64), "{args:?}: {}", run.stderr);
    }
}

#[test]
fn the_json_of_check_has_the_shape_that_is_promised() {
    let report = kinocue(&["check", CUE, "--json", "--rate", "1000"]).json();
    assert_eq!(report["passed"], true);
    assert_eq!(report["faults"], Value::Array(Vec::new()));
    assert_eq!((&report["seat"], &report["rate_hz"]), (&"bench3".into(), &1000.0.into()));
    let axes = report["axes"].as_array().unwrap();
    assert_eq!(axes.len(), 6);
    assert_eq!((&axes[5]["name"], &axes[5]["unit"]), (&"a6".into(), &"mm".into()));
    for (what, fields) in [
        ("position", &["min", "max", "at_s", "line"]),
        ("velocity", &["max", "limit", "at_s", "line"]),
        ("acceleration", &["max", "limit", "at_s", "line"]),
        ("jerk", &["max", "limit", "at_s", "line"]),
    ] {
        assert!(fields.iter().all(|field| axes[0][what][field].is_number()), "{what}: {}", axes[0][what]);
    }
    let report = kinocue(&["check", "nowhere.csv", BAD_HALL, "--json"]).json();
    let faults = report["faults"].as_array().unwrap();
    assert_eq!((&report["passed"], faults.len()), (&false.into(), 19));
    assert_eq!((&faults[0]["file"], &faults[0]["line"]), (&"nowhere.csv".into(), &Value::Null));
    assert_eq!((&faults[1]["line"], &faults[1]["column"]), (&2.into(), &11.into()));
    assert_eq!(faults[1]["message"], "rate_hz: 2000 is outside 1..=1000");
}

#[test]
fn info_tells_what_a_cue_holds() {
    let run = kinocue(&["info", "cues/storm.mcap"]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    for part in
        ["Storm", "00:44.000", "1101, 40 ms apart (25 Hz)", "light: 3×", "14 to 18 Hz", "seat bench3", "a6"]
    {
        assert!(run.stdout.contains(part), "{part}: {}", run.stdout);
    }
    let info = kinocue(&["info", CUE, "--config", HALL, "--seat", "platform6", "--json"]).json();
    assert_eq!(
        (&info["rows"], &info["unit"], &info["interpolation"]),
        (&2001.into(), &"fraction".into(), &"spline".into())
    );
    assert_eq!((&info["seat"], &info["rate_hz"]), (&"platform6".into(), &59.94.into()));
    assert_eq!(info["axes"][0]["velocity"]["limit"], 300.0);
    assert_eq!(info["effects"][0]["name"], "air");
    assert_eq!(kinocue(&["info", "nowhere.csv"]).code, Some(66));
    assert_eq!(kinocue(&["info", CUE, "--config", BAD_HALL]).code, Some(78));
}

#[test]
fn the_help_shows_the_limits_of_a_cue_and_examples() {
    for command in ["check", "info"] {
        let run = kinocue(&[command, "--help"]);
        assert_eq!(run.code, Some(0));
        assert!(run.stdout.contains("8,000,000 rows") && run.stdout.contains("Examples:"), "{}", run.stdout);
    }
}

#[test]
fn completions_name_the_commands() {
    for shell in ["bash", "fish", "zsh"] {
        let run = kinocue(&["completions", shell]);
        assert!(run.code == Some(0) && run.stdout.contains("convert"), "{shell}");
    }
}

#[test]
fn one_axis_and_one_frequency_are_told_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "one.csv", "time_s,a1,v1_hz,v1_amp\n0,0.5,20,0.001\n1,0.5,20,0.001\n");
    let run = kinocue(&["check", &cue]);
    assert!(run.stdout.contains("passed: 1 axis, "), "{}", run.stdout);
    let run = kinocue(&["info", &cue]);
    assert!(run.stdout.contains("a1: 20 Hz, up to 0.15 mm"), "{}", run.stdout);
}
