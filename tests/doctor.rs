//! `doctor` as a person runs it: the shape of `--json`, and exit codes that agree with the verdicts. What the machine is
//! found to be is its own affair.

use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

fn doctor(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).arg("doctor").args(args).output().expect("kinocue runs")
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

fn lines(report: &Value) -> &Vec<Value> {
    report["lines"].as_array().expect("a list of lines")
}

#[test]
fn a_short_run_is_reported_whole_and_ends_as_its_verdicts_say() {
    let output = doctor(&["--seconds", "1", "--load", "--json"]);
    let report = json(&output);
    let verdict = |line: &Value| line["verdict"].as_str().expect("a word").to_owned();
    for line in lines(&report) {
        assert!(line["id"].is_string() && line["found"].is_string(), "{line}");
        assert!(["ok", "warn", "bad", "unknown"].contains(&verdict(line).as_str()), "{line}");
        assert_eq!(line["fix"].is_string(), verdict(line) != "ok", "{line}");
    }
    let bad = lines(&report).iter().any(|line| verdict(line) == "bad");
    assert_eq!((report["ready"].as_bool(), output.status.code()), (Some(!bad), Some(i32::from(bad))));
    assert!(output.stderr.is_empty(), "no progress in a pipe");

    let runs = report["runs"].as_array().expect("a list of runs");
    assert_eq!((runs[0]["load"].as_str(), runs[1]["load"].as_str()), (Some("idle"), Some("loaded")));
    for run in runs {
        let number = |name: &str| run[name].as_u64().expect("a whole number");
        // A stall may reach past the end of the run, and its ticks are missed ones.
        assert!(number("ticks") > 0 && number("ticks") + number("missed_ticks") >= 1_000, "{run}");
        let histogram = run["histogram"].as_array().expect("a list of buckets");
        let counted: u64 = histogram.iter().filter_map(|bucket| bucket["count"].as_u64()).sum();
        assert_eq!(counted, number("ticks"));
        assert!(run["lateness_us"]["p99"].as_f64() <= run["lateness_us"]["max"].as_f64());
    }
}

#[test]
fn without_a_run_it_only_looks_and_the_hall_comes_from_the_configuration() {
    let report = json(&doctor(&["--seconds", "0", "--json", "--config", "tests/data/config/hall.toml"]));
    assert_eq!(report["runs"].as_array().map(Vec::len), Some(0));
    assert_eq!(lines(&report).iter().filter(|line| line["id"] == "realtime_policy").count(), 1);
    assert!(report["controllers"].as_u64() > Some(0));
}

#[test]
fn the_size_of_the_hall_may_be_given_as_a_number() {
    let output = doctor(&["--seconds", "0", "--controllers", "65535"]);
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(text.contains("for 65535 controllers: "), "{text}");
    assert!(text.contains("neighbour_table") && text.contains("open_files"), "{text}");
}

#[test]
fn wrong_use_is_told_apart_from_a_machine_that_is_not_ready() {
    assert_eq!(doctor(&["--seconds", "3601"]).status.code(), Some(64));
    assert_eq!(doctor(&["--controllers", "0"]).status.code(), Some(64));
    assert_eq!(doctor(&["--controllers", "2", "--config", "x.toml"]).status.code(), Some(64));
    assert_eq!(doctor(&["--config", "no-such-file.toml"]).status.code(), Some(66));
}
