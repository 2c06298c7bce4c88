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
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Run { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("the folder is ours");
    path.display().to_string()
}

/// Whether a text is what a terminal shows and does not obey.
fn is_plain(text: &str) -> bool {
    !text.chars().any(|c| c.is_control() && c != '\n')
}

#[test]
fn nothing_in_a_file_or_its_name_reaches_the_terminal_as_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let evil = "\x1b]0;owned\x07\u{9b}2J\x7f\u{202e}";
    let bad = format!("# title: {evil}\ntime_ms,a1,{evil}\n0,{evil},0\n10,0,0\n");
    let name = format!("ok: passed\n{evil}");
    let good = format!("# title: {evil}\ntime_ms,a1\n0,0\n1000,0.001\n2000,0.001\n");
    let files = [
        write(folder.path(), &format!("{name}.csv"), &bad),
        write(folder.path(), &format!("{name} well.csv"), &good),
        write(folder.path(), &format!("{name}.toml"), &format!("[\"{evil}\"]\n[show]\nbind = \"{evil}\"\n")),
        write(folder.path(), &format!("{name}.mcap"), evil),
    ];
    for file in &files {
        for args in [
            vec!["check", file],
            vec!["info", file],
            vec!["check", file, "--json"],
            vec!["info", file, "--json"],
            vec!["fit", file, "-o", "/dev/null/x.csv"],
        ] {
            let run = kinocue(&args);
            assert!(
                is_plain(&run.stdout) && is_plain(&run.stderr),
                "{args:?}\n{}\n{}",
                run.stdout,
                run.stderr
            );
            let told = run.stdout + &run.stderr;
            let forged = told.lines().any(|line| line.starts_with("\\u{1b}]0;owned"));
            assert!(!forged, "a name makes no line of its own: {told}");
        }
    }
    let json = kinocue(&["check", &files[0], "--json"]).json();
    assert_eq!(json["faults"][0]["file"], files[0].as_str(), "a program gets the name as it is");
    for args in
        [vec![evil], vec!["play", evil], vec!["play", "x.csv", evil], vec!["check", "x", "--rate", evil]]
    {
        let run = kinocue(&args);
        assert!(run.code != Some(0) && is_plain(&run.stderr), "{}", run.stderr);
    }
}

#[test]
fn a_sound_cue_and_a_sound_hall_pass() {
    let run = kinocue(&["check", CUE, HALL]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    assert!(run.stdout.contains("cues/coaster.csv: passed: 6 axes"), "{}", run.stdout);
    assert!(run.stdout.contains("hall.toml: passed: 4 controllers"), "{}", run.stdout);
    let unlooked =
        "coaster.csv: not checked whether the hall has its effects (air, water, wind, leg, smoke, light)";
    assert!(run.stdout.contains(unlooked), "{}", run.stdout);
    let run = kinocue(&["check", CUE, "--config", HALL]);
    assert!(!run.stdout.contains("not checked whether"), "{}", run.stdout);
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
fn a_file_of_another_kind_is_called_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let day =
        write(folder.path(), "day.toml", "title = \"Day\"\n[[entry]]\ncue = \"storm\"\nat = \"19:00\"\n");
    for args in [vec!["check", &day], vec!["check", CUE, "--config", &day]] {
        let run = kinocue(&args);
        assert_eq!(run.code, Some(78), "{}", run.stderr);
        assert!(
            run.stderr.contains("day.toml:1:1: this is a playlist, not a configuration;"),
            "{}",
            run.stderr
        );
        assert!(run.stderr.contains("\n1 fault\n"), "{}", run.stderr);
    }
    for (name, begin, says) in [
        ("ride.bag", "#ROSBAG V2.0\nE\0\0\0", "is a bag of ROS 1; a cue is a CSV or MCAP file"),
        ("ride.db3", "SQLite format 3\0", "is an SQLite database, as a bag of ROS 2 (.db3) is; a cue is"),
        ("reel.wav", "fLaC\0\0\0", "is FLAC sound; a cue is"),
    ] {
        let run = kinocue(&["check", &write(folder.path(), name, begin)]);
        assert_eq!(run.code, Some(65), "{}", run.stderr);
        assert!(run.stderr.contains(says) && run.stderr.ends_with("\n1 fault\n"), "{}", run.stderr);
    }
}

#[test]
fn a_sparse_cue_that_the_spline_makes_undershoot_passes_with_the_line_that_it_is_told_to_have() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "time_ms,a1\n0,0\n1000,0\n2000,0.3\n4000,0.3\n6000,0\n7000,0\n";
    let run = kinocue(&["check", &write(folder.path(), "sparse.csv", rows)]);
    let line = "# interpolation: monotone";
    assert!(
        run.code == Some(65) && run.stderr.contains(&format!("write \"{line}\" above the header")),
        "{}",
        run.stderr
    );
    let run = kinocue(&["check", &write(folder.path(), "written.csv", &format!("{line}\n{rows}"))]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
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
fn what_serial_drives_execute_of_a_cue_is_judged_where_somebody_asks() {
    let folder = tempfile::tempdir().unwrap();
    let hall = "[seat.silver3]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 4000\n\
                max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
                [[controller]]\nname = \"A1\"\nseat = \"silver3\"\naddress = \"127.0.0.1:7408\"\n";
    let hall = write(folder.path(), "hall.toml", hall);
    let row = |row: u32| {
        let place = 0.3 + 0.2 * (f64::from(row) * 0.05).cos();
        format!("{},{place:.6},{},0.001\n", row * 20, if row > 50 { 20 } else { 0 })
    };
    let rows: String = (0..200).map(row).collect();
    let cue = write(folder.path(), "swing.csv", &format!("time_ms,a1,v1_hz,v1_amp\n{rows}"));
    let check = |more: &[&str]| {
        let all = ["check", &cue, "--config", &hall, "--drive", "silvermax"];
        kinocue(&[&all, more].concat())
    };
    let run = check(&["--link-rate", "30", "--drive-vibration", "0%"]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{}", run.stdout);
    assert!(run.stdout.contains("swing.csv: drives play it at 30.0 Hz, at most 0.0"), "{}", run.stdout);
    let json = check(&["--link-rate", "30", "--drive-vibration", "0%", "--json"]).json();
    assert!(json["drives"][0]["deviation"].as_f64().is_some_and(|mm| mm < 0.1), "{json}");
    let run = check(&["--link-rate", "30"]);
    assert_eq!(run.code, Some(1));
    assert!(
        run.stderr.contains(" is too fast for drives at 30.0 Hz, which follow at most 3.8 Hz"),
        "{}",
        run.stderr
    );
    assert_eq!(check(&[]).code, Some(64), "a link has a rate");
}

#[test]
fn an_editors_rows_are_judged_in_their_unit_against_the_seat() {
    let folder = tempfile::tempdir().unwrap();
    let rows = "1,2000,10,20\n2,2000,15,20\n3,2000,160,20\n";
    let cue = write(folder.path(), "rows.csv", &format!("line,time_ms,x,y\n{rows}"));
    let args = ["check", &cue, "--from", "rows", "--units", "mm", "--json"];
    let run = kinocue(&args);
    assert_eq!(run.code, Some(65), "{}", run.stderr);
    let faults = run.json()["faults"].clone();
    assert_eq!((&faults[0]["line"], faults[0]["message"].to_string().contains("outside")), (&4.into(), true));
    let run = kinocue(&[&args[..], &["--config", HALL, "--seat", "platform6"]].concat());
    assert_eq!((run.code, &run.json()["seat"]), (Some(1), &"platform6".into()), "its corner is too sharp");
    let messages = run.json()["faults"].to_string();
    assert!(messages.contains("acceleration") && !messages.contains("outside the stroke"), "{messages}");
    assert_eq!(kinocue(&["check", &cue, "--from", "rows"]).code, Some(64), "the unit is not guessed");
}

#[test]
fn what_is_asked_wrongly_is_a_usage_error() {
    for args in [
        &["check"][..],
        &["check", CUE, "--rate", "0"],
        &["check", CUE, "--rate", "1001"],
        &["info", CUE, CUE],
        &["completions", "punchcard"],
    ] {
        let run = kinocue(args);
        assert_eq!(run.code, Some(64), "{args:?}: {}", run.stderr);
    }
    // What else there is, beside what is missing, stands in the answer.
    for (args, both) in
        [(&["play", CUE][..], "<--to <ADDR>|--config <FILE>>"), (&["serve"], "<--config <FILE>|--rehearse>")]
    {
        let run = kinocue(args);
        assert_eq!(run.code, Some(64), "{args:?}: {}", run.stderr);
        assert!(run.stderr.contains(both), "{args:?}: {}", run.stderr);
    }
    for args in
        [&["check", CUE, "--seat", "bench33"][..], &["info", CUE, "--config", HALL, "--seat", "bench33"]]
    {
        let run = kinocue(args);
        assert_eq!(run.code, Some(66), "{args:?}: {}", run.stderr);
        assert!(run.stderr.contains("there is no seat type bench33"), "{args:?}: {}", run.stderr);
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

/// Rests, then moves by half its stroke in so many milliseconds.
fn leap(ms: u32) -> String {
    format!(
        "# interpolation: linear\ntime_ms,a1,a2\n0,0.5,0.2\n1000,0.5,0.2\n{},0.5,0.7\n4000,0.5,0.7\n",
        1000 + ms
    )
}

#[test]
fn a_broken_limit_is_told_with_its_place_and_ends_with_1() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "leap.csv", &leap(200));
    let run = kinocue(&["check", &cue]);
    assert_eq!(run.code, Some(1));
    let velocity = run.stderr.lines().find(|line| line.contains("velocity 375.0 mm/s")).expect("it is told");
    assert!(velocity.contains("leap.csv:4:10: a2: velocity 375.0 mm/s at 00:01."), "{velocity}");
    assert!(velocity.contains("is over 240.0, the limit of seat bench3"), "{velocity}");
    assert!(run.stderr.contains("kinocue fit"), "{}", run.stderr);
    assert!(run.stdout.contains("375.0 mm/s") && run.stdout.contains("-56.2 % !"), "{}", run.stdout);
    let report = kinocue(&["check", &cue, "--json"]).json();
    assert_eq!((&report["passed"], &report["level"]), (&false.into(), &1.0.into()));
    let margin = report["axes"][1]["velocity"]["margin"].as_f64().unwrap();
    assert!((margin + 0.5625).abs() < 1e-6, "{report}");
    assert!(report["axes"][0]["jerk"]["margin"].as_f64().unwrap() > 0.999_999, "the other axis rests");
}

#[test]
fn a_level_may_make_a_cue_pass_and_a_trim_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "leap.csv", &leap(1000)); // 75 mm/s, and corners for 12
    assert_eq!(kinocue(&["check", &cue]).code, Some(1));
    let low = kinocue(&["check", &cue, "--level", "15%", "--trim", "-120ms", "--json"]);
    assert_eq!((low.code, &low.json()["trim_ms"]), (Some(0), &(-120).into()), "{}", low.stderr);
    let figures = |trim| kinocue(&["check", &cue, "--json", "--trim", trim]).json()["axes"].clone();
    assert_eq!(figures("0ms"), figures("333ms"));
    for (option, value) in [("--level", "110%"), ("--trim", "501ms"), ("--trim", "1s")] {
        assert_eq!(kinocue(&["check", &cue, option, value]).code, Some(64), "{option} {value}");
    }
}

#[test]
fn effects_and_controllers_have_limits_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let hall = std::fs::read_to_string(HALL).unwrap();
    let limited = hall.replace("[effects]", "[effect_limits]\nair = { min_on_ms = 50 }\n\n[effects]");
    let limited = limited.replace("lead_mm = 5.0", "lead_mm = 5.0\nmax_rpm = 2000");
    let limited = write(folder.path(), "limited.toml", &limited);
    let cue =
        write(folder.path(), "puff.csv", "time_ms,a1,fx_air\n0,0.5,0\n1000,0.5,1\n1040,0.5,0\n2000,0.5,0\n");
    assert_eq!(kinocue(&["check", &cue, "--config", HALL]).code, Some(0));
    let run = kinocue(&["check", &cue, "--config", &limited]);
    assert_eq!(run.code, Some(1));
    assert!(run.stderr.contains("fx_air: on at 00:01.000 for 40ms"), "{}", run.stderr);
    assert!(run.stderr.contains("2000 rpm (PA07), 166.7 mm/s"), "{}", run.stderr);
    for (text, message) in [
        ("air = { min_on = 50 }", "min_on: unknown key in [effect_limits.air]; did you mean min_on_ms?"),
        ("airr = { min_on_ms = 50 }", "airr is not in [effects]; did you mean air?"),
        ("air = { min_on_ms = 50, max_on_ms = 40 }", "air: min_on_ms 50 is over max_on_ms 40"),
        ("air = { max_duty = 1.5 }", "max_duty: 1.5 is outside 0.001..=1"),
    ] {
        let bad = hall.replace("[effects]", &format!("[effect_limits]\n{text}\n\n[effects]"));
        let bad = write(folder.path(), "bad.toml", &bad);
        let run = kinocue(&["check", &bad]);
        assert_eq!(run.code, Some(78), "{text}");
        assert!(
            run.stderr.contains(message) && run.stderr.contains("bad.toml:33:"),
            "{text}: {}",
            run.stderr
        );
    }
}

#[test]
fn play_refuses_a_cue_without_a_passing_proof_before_anything_opens() {
    let folder = tempfile::tempdir().unwrap();
    let cue = write(folder.path(), "leap.csv", &leap(200));
    // Nobody listens there, and nobody is asked.
    let run = kinocue(&["play", &cue, "--to", "127.0.0.1:9", "--bind", "127.0.0.1:0", "--json"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""), "{}", run.stderr);
    assert!(run.stderr.contains("leap.csv:4:10: a2: velocity 375.0 mm/s"), "{}", run.stderr);
    assert!(run.stderr.contains("kinocue fit"), "{}", run.stderr);
}

#[test]
fn info_measures_what_check_does_and_says_by_its_exit_code_that_a_curve_leaves_the_stroke() {
    let folder = tempfile::tempdir().unwrap();
    // A corner that no frame of a grid falls on that begins with the cue.
    let text = "# interpolation: linear\ntime_ms,a1\n0,0.5\n1005,0.5\n1505,0.52\n2007,0.52\n";
    let cue = write(folder.path(), "corner.csv", text);
    let figures = |command: &str| {
        let run = kinocue(&[command, &cue, "--json"]);
        let json: serde_json::Value = serde_json::from_str(&run.stdout).expect("one JSON object");
        ["velocity", "acceleration", "jerk"].map(|figure| json["axes"][0][figure]["max"].as_f64().unwrap())
    };
    for (shown, proved) in figures("info").into_iter().zip(figures("check")) {
        assert!((shown / proved - 1.0).abs() <= 0.02, "{shown} {proved}");
    }
    let text = "time_ms,a1\n0,0\n1000,0\n2000,0\n3000,1\n4000,1\n5000,1\n";
    let run = kinocue(&["info", &write(folder.path(), "leaves.csv", text)]);
    assert!(
        run.code == Some(65) && run.stdout.contains("outside the stroke"),
        "{:?} {}",
        run.code,
        run.stdout
    );
}

/// What that ride asks for beside motion.
const EFFECTS: &str = "\n[effects]\nair = 1\nwater = 2\nwind = 3\nleg = 4\nsmoke = 5\nlight = 6\n";
const RIDE: &str = "cues/bench-ride.csv";
const DRIVES: &str = "tests/data/config/drives.toml";

#[test]
fn a_hall_with_drives_passes_its_check_which_says_how_often_its_links_play() {
    let run = kinocue(&["check", DRIVES]);
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    for text in [
        "passed: 2 controllers, 2 links, 2 seat types",
        "drives.toml: plays at 29.98 Hz on link stalls, 3 axes\n",
        "drives.toml: link circle runs at 56818 baud, the nearest rate to 57600\n",
        "Hz on link circle, 3 axes, by a USB adapter whose latency timer is 1 ms\n",
    ] {
        assert!(run.stdout.contains(text), "{text}: {}", run.stdout);
    }
    let cue = kinocue(&["info", CUE, "--config", DRIVES]);
    assert!(cue.stdout.contains("plays at 29.98 Hz on link stalls"), "{}", cue.stdout);
}

#[test]
fn check_and_info_say_how_far_ahead_and_how_far_beside_the_cue_a_link_plays() {
    let folder = tempfile::tempdir().expect("a folder");
    let drives = std::fs::read_to_string(DRIVES).expect("it is there");
    let (silver, _) = drives.rsplit_once("[[controller]]").expect("two seats");
    let still = silver.replace("[seat.silver3.drive]", "[seat.silver3.drive]\nvibration = \"0%\"") + EFFECTS;
    let hall = write(folder.path(), "hall.toml", &still);
    let said = "plays at 29.98 Hz on link stalls, 220 ms ahead, at most 0.05 mm off the cue (a1 of D1 at ";
    for command in ["check", "info"] {
        let run = kinocue(&[command, RIDE, "--config", &hall]);
        assert_eq!(run.code, Some(0), "{command}: {}", run.stderr);
        assert!(run.stdout.contains(said), "{command}: {}", run.stdout);
        let json = kinocue(&[command, RIDE, "--config", &hall, "--json"]).json();
        let axis = &json["drives"][0];
        assert_eq!((&axis["link"], &axis["controllers"][0]), (&"stalls".into(), &"D1".into()), "{json}");
        assert!(axis["lead_ms"].as_f64().is_some_and(|ms| (220.0..221.0).contains(&ms)), "{json}");
    }
}

#[test]
fn what_a_link_misses_of_a_cue_fails_check_fit_and_upload_with_place_and_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let drives = std::fs::read_to_string(DRIVES).expect("it is there");
    let (silver, _) = drives.rsplit_once("[[controller]]").expect("two seats");
    let hall = write(folder.path(), "hall.toml", &(silver.to_owned() + EFFECTS));
    let out = folder.path().join("out.csv").display().to_string();
    for args in [
        &["check", RIDE, "--config", &hall][..],
        &["fit", RIDE, "-o", &out, "--config", &hall],
        &["prove", RIDE, "--config", &hall],
    ] {
        let run = kinocue(args);
        let said = run.stdout.clone() + &run.stderr;
        assert_eq!(run.code, Some(1), "{args:?}: {said}");
        assert!(said.contains("v1_hz: link stalls, D1: vibration at 20.0 Hz at 00:"), "{args:?}: {said}");
    }
    assert!(!std::path::Path::new(&out).exists(), "fit wrote what it cannot mend");
}

#[test]
fn a_link_that_is_to_play_more_often_than_it_can_fails_the_check_with_what_would_fit() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(DRIVES)
        .expect("it is there")
        .replace("[link.stalls]", "[link.stalls]\nrate_hz = 50");
    let run = kinocue(&["check", &write(folder.path(), "fast.toml", &text)]);
    assert_eq!(run.code, Some(1), "{}", run.stdout);
    let wanted =
        "rate_hz of [link.stalls]: 3 axes play at 29.98 Hz at 57600 baud, not at 50; use baud = 115200\n";
    assert!(run.stderr.contains(wanted), "{}", run.stderr);
}

#[test]
fn a_seat_with_axes_that_no_cue_can_have_is_checked_without_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let drives = std::fs::read_to_string(DRIVES).expect("it is there");
    let udp = drives[drives.find("[seat.silver3]").expect("a seat")
        ..drives.find("[seat.silver3.drive]").expect("its drive")]
        .to_owned()
        + "[[controller]]\nname = \"A1\"\nseat = \"silver3\"\naddress = \"127.0.0.1:7408\"\naxis_offset = 11\n";
    let on_link = drives.replace("name = \"D1\"", "name = \"D1\"\naxis_offset = 11");
    for (name, text) in [("udp.toml", udp), ("link.toml", on_link)] {
        let run = kinocue(&["check", CUE, "--config", &write(folder.path(), name, &text)]);
        assert_eq!(run.code, Some(65), "{name}: {}", run.stderr);
        assert!(run.stderr.contains("no controller takes these axes"), "{name}: {}", run.stderr);
    }
}

#[test]
fn what_reaches_the_network_alone_takes_no_hall_with_drives() {
    for (args, refused) in [
        (&["latency", "--config", DRIVES][..], "D1, D2 on serial links, which this does not reach"),
        (
            &["register", "write", "PA95=6", "--config", DRIVES],
            "D1, D2 on serial links, which this does not reach",
        ),
    ] {
        let run = kinocue(args);
        assert!(run.stderr.contains(refused), "{args:?}: {}", run.stderr);
        assert_eq!(run.code, Some(78), "{args:?}");
    }
}

#[test]
fn the_bench_ride_fits_the_seats_of_all_examples() {
    for example in ["silvermax", "sixpack2", "chair"] {
        let config = format!("{}/examples/{example}.toml", env!("CARGO_MANIFEST_DIR"));
        let run = kinocue(&["check", "cues/bench-ride.csv", "--config", &config]);
        assert_eq!(run.code, Some(0), "{example}: {}{}", run.stdout, run.stderr);
    }
}

#[test]
fn ports_that_may_change_places_and_seats_that_are_then_taken_for_each_other_are_worth_a_note() {
    let folder = tempfile::tempdir().expect("a folder");
    let drives = std::fs::read_to_string(DRIVES).expect("it is there");
    let (silver, _) = drives.rsplit_once("[[controller]]").expect("two seats");
    let (before, seat) = silver.split_once("[[controller]]").expect("one seat");
    let ports = before.replace("ttyS0", "ttyUSB1").replace("wiring = \"rs485\"", "");
    let twin = seat.replace("\"D1\"", "\"D3\"").replace("link:stalls", "link:circle");
    let checked = |name: &str, twin: &str| {
        let hall = format!("{ports}[[controller]]{seat}[[controller]]{twin}");
        kinocue(&["check", &write(folder.path(), name, &hall)])
    };
    let run = checked("alike.toml", &twin);
    let said = "D1, D3 have units of the same numbers: if their adapters or plugs change places while the units are off";
    assert!(run.code == Some(0) && run.stdout.contains(said), "{}{}", run.stdout, run.stderr);
    let port = "link stalls: /dev/ttyUSB1 may be the adapter of another line after the next start; use its link in /dev/serial/by-id";
    assert!(run.stdout.contains(port) && !run.stdout.contains("link circle: "), "{}", run.stdout);
    let run = checked("apart.toml", &twin.replace("[16, 17, 18]", "[19, 20, 21]"));
    assert!(run.code == Some(0) && !run.stdout.contains("same numbers"), "{}{}", run.stdout, run.stderr);
}

#[test]
fn a_film_that_leads_no_cue_is_worth_a_note() {
    let folder = tempfile::tempdir().expect("a folder");
    let hall = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/systemd/simulated.toml"))
        .expect("it ships");
    let checked = |name: &str, sync: &str| {
        kinocue(&["check", &write(folder.path(), name, &format!("{hall}\n[sync]\n{sync}\n"))])
    };
    let run = checked("without.toml", "sources = [\"mpv:/run/film.sock\"]");
    assert_eq!(run.code, Some(0), "{}", run.stdout);
    assert!(run.stdout.contains("[sync] has no start: a cue follows the film only where"), "{}", run.stdout);
    let run = checked(
        "with.toml",
        "sources = [\"mpv:/run/film.sock\"]\nstart = \"00:00:00:00\"\nfilm_fps = \"25\"",
    );
    assert!(run.code == Some(0) && !run.stdout.contains("[sync] has no start"), "{}", run.stdout);
}
