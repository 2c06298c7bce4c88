//! Shows, from loading to the record of what was played.

use serde_json::Value;

use crate::hall::Hall;
use crate::http::{Request, problem};
use crate::process::kinocue;

/// Of all controllers together.
fn sum(controllers: &[Value], count: &str) -> u64 {
    controllers.iter().map(|one| one[count].as_u64().expect("a count")).sum()
}

#[test]
fn a_whole_show_ends_parked_and_its_record_says_what_the_controllers_counted() {
    let mut hall = Hall::open();
    hall.arm("ride");
    hall.done(&["go"]);
    let parked = hall.wait(|status| status["cause"] == "the seats that take part have parked");
    assert_eq!(parked["state"], "parked");
    let lines = hall.close();
    assert!(lines.len() <= 20, "{} lines: {lines:#?}", lines.len());

    let shows = hall.journal("show");
    let [show] = &shows[..] else { panic!("{shows:?}") };
    let config = hall.path("hall.toml").to_str().unwrap().to_owned();
    let report = kinocue(&["report", "--day", "today", "--json", "--config", &config]).report_of(0);
    assert_eq!(report["totals"]["shows"], 1, "{report}");
    let seen = hall.end();
    assert!(seen.rest_in_park(), "{:?}", seen.controllers);
    let (figures, motion) = (&show["outcome"], sum(&seen.controllers, "motion"));
    assert_eq!(figures["result"], "completed");
    assert_eq!(figures["ticks"], motion / 2, "{show}");
    for count in ["sent", "asked", "acked"] {
        assert_eq!(figures[count], motion, "{count}: {show}");
    }
    for count in ["refused", "lost", "send_failed"] {
        assert_eq!(figures[count], 0, "{count}: {show}");
    }
    assert_eq!(
        (&show["cue"], &show["seats_available"], &show["seats_total"]),
        (&"ride".into(), &2.into(), &2.into())
    );
}

#[test]
fn the_journal_names_who_asked_what_when_and_what_came_of_it() {
    let mut hall = Hall::open();
    assert_eq!(hall.run(&["arm"]).code, Some(75));
    hall.arm("ride");
    hall.done(&["level", "60%"]);
    hall.done(&["disable", "A2"]);
    hall.done(&["disarm"]);
    assert_eq!(hall.stop_socket("stop\n"), "stopping\n");
    hall.comes_to("stopped");
    hall.close();
    let acts = hall.journal("action");
    let what: Vec<&str> = acts.iter().map(|act| act["what"].as_str().unwrap()).collect();
    let expected = [
        "arm",
        "load ride",
        "preflight",
        "arm",
        "levels motion 60 % vibration 60 %",
        "disable A2",
        "disarm",
        "stop",
    ];
    assert_eq!(what, expected);
    for act in &acts {
        assert!(act["at"].as_str().unwrap().parse::<jiff::Timestamp>().is_ok(), "{act}");
        assert!(act["who"].as_str().unwrap().ends_with("(socket, engineer)"), "{act}");
    }
    assert!(acts[0]["result"].as_str().unwrap().contains("no cue is loaded; load one"), "{}", acts[0]);
    assert_eq!(acts[3]["result"], "done");
    assert_eq!(acts[3]["state"], "armed");
}

#[test]
fn the_same_go_twice_acts_once_and_a_go_that_comes_late_does_nothing() {
    let mut hall = Hall::open();
    hall.arm("night");
    let go = Request::new("POST", "/api/v1/show/go");
    assert_eq!(go.clone().sent_ago(2_500).send(&hall.socket()).problem(), problem(409, "late"));
    assert_eq!(hall.lives_on(20)["state"], "armed");
    let go = go.sent_ago(0).header("Idempotency-Key", "one");
    let first = go.clone().send(&hall.socket());
    assert!(["joining", "playing"].contains(&first.state().as_str()), "{}", first.text());
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.done(&["arm"]);
    assert_eq!(go.send(&hall.socket()).body, first.body, "the first reply again");
    assert_eq!(hall.lives_on(20)["state"], "armed", "and no second show");
    hall.close();
    assert_eq!(hall.journal("begin").len(), 1);
}

#[test]
fn a_sweep_tries_each_axis_and_effect_of_two_seats_and_gives_a_table() {
    let one_axis = |config: String| {
        let config = config.replace("axes = 3", "axes = 1").replace("[0.0, 0.0, 0.0]", "[0.0]");
        let (head, rest) = config.split_once("water = 2").expect("it is there");
        let (_, presets) = rest.split_once("[[controller]]").expect("it is there");
        format!("{}\n[[controller]]{presets}", head.replace("[0.5, 0.5, 0.5]", "[0.5]"))
    };
    let mut hall = Hall::closed(&["--axes", "1"], one_axis);
    hall.write("cues/ride.csv", "time_ms,a1\n0,0\n1000,0\n");
    hall.serve();
    assert_eq!(hall.run(&["test", "sweep", "--seats-empty"]).code, Some(75), "only an armed hall");
    hall.arm("ride");
    let run = hall.done(&["test", "sweep", "--rows", "A", "--seats-empty", "--json"]);
    let rows = run.report()["rows"].as_array().expect("a table").clone();
    let parts: Vec<_> =
        rows.iter().map(|row| (row["controller"].as_str().unwrap(), row["part"].as_str().unwrap())).collect();
    assert_eq!(parts, [("A1", "a1"), ("A2", "a1"), ("A1", "air"), ("A2", "air")]);
    for row in &rows {
        assert!(
            row["asked"].as_u64() > Some(100) && row["p99_us"].is_number() && row["passed"] == true,
            "{row}"
        );
    }
    let status = hall.comes_to("parked");
    assert_eq!(status["show"]["cue"], "ride", "what was loaded before is back");
    let seen = hall.end();
    assert!(seen.farthest(0) > 50_000, "30 mm are 60,000 pulses");
    assert!(seen.rest_in_park(), "{:?}", seen.controllers);
}

#[test]
fn go_waits_for_an_open_belt_and_the_status_says_whose() {
    let hall = Hall::open_with(|config| {
        let config = config.replace("[show]\n", "[show]\nbelts = \"all\"\n");
        config.replace("seat = \"bench3\"\n", "seat = \"bench3\"\nbelt_inputs = [2]\n")
    });
    hall.arm("ride");
    let belt = |status: &Value| status["controllers"][1]["belts_open"].clone();
    hall.happens("2@X2=1");
    let status = hall.wait(|status| belt(status) == serde_json::json!([2]));
    assert_eq!(status["next"], "GO waits until these are buckled: A2 (X02)");
    let refused = hall.run(&["go"]);
    assert_eq!(refused.code, Some(75), "{refused:?}");
    assert!(refused.stderr.contains("not buckled: A2 (X02)"), "{refused:?}");
    hall.happens("2@X2=0");
    hall.wait(|status| belt(status) == serde_json::json!([]));
    hall.done(&["go"]);
    hall.comes_to("parked");
}

#[test]
fn a_journal_that_is_whole_is_reported_with_0_over_a_restart_and_one_that_was_changed_with_1() {
    let mut hall = Hall::open();
    hall.play("ride");
    hall.comes_to("parked");
    hall.close();
    hall.serve();
    hall.comes_to("parked");
    let folder = hall.path("log").to_str().unwrap().to_owned();
    let report = || hall.run(&["report", "--from", "2000-01-01", "--dir", &folder]);
    let whole = report();
    assert_eq!((whole.code, whole.stderr.as_str()), (Some(0), ""), "{whole:?}");
    let keys = hall.run(&["report", "--from", "2000-01-01", "--dir", &folder, "--keys"]);
    assert!(
        keys.code == Some(0) && keys.stdout.starts_with('M') && keys.stdout.lines().count() == 1,
        "{keys:?}"
    );
    let of_shows = |entry: &std::fs::DirEntry| !entry.file_name().to_str().unwrap().contains("asked");
    let entries = std::fs::read_dir(&folder).unwrap().flatten();
    let file = entries.into_iter().find(of_shows).unwrap().path();
    let text = std::fs::read_to_string(&file).unwrap();
    let mut lines: Vec<&str> = text.lines().collect();
    lines.remove(1);
    std::fs::write(&file, lines.join("\n") + "\n").unwrap();
    let cut = report();
    assert!(cut.code == Some(1) && cut.stderr.contains("line 2 is missing"), "{cut:?}");
    hall.end();
}
