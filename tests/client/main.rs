//! The client commands as a person runs them, against a double of the daemon.

mod daemon;

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::UnixListener;
use std::process::{Command, Stdio};
use std::thread;

use serde_json::{Value, json};

use daemon::{Answer, Daemon, Run, Running, run};

/// The status of a hall with two controllers.
fn hall(state: &str) -> Value {
    json!({
        "hall": "Hall 1", "version": "0.1.0", "state": state, "cause": format!("{state} by anna"), "next": "go on",
        "since_s": 1.0, "rate_hz": 100.0, "trim_ms": 80,
        "show": {"cue": "coaster", "title": null, "length_s": 200.0, "position_s": 70.12},
        "levels": {"motion": 0.6, "vibration": 1.0, "effects": {"air": true, "water": false}, "rows": {"A": 1.0}},
        "controllers": [
            {"name": "A1", "row": "A", "enabled": true, "health": "ok", "ack_rate": 1.0, "ack_p50_us": 40.0},
            {"name": "A2", "row": "A", "enabled": true, "health": "lost", "why": "no ack for 3 s"},
        ],
        "warnings": [{"id": "controller-lost", "severity": "error", "controller": "A2", "text": "it is lost",
            "remedy": "look at its plug"}],
    })
}

/// A text with each run of blanks as one, as the width of columns is no matter.
fn squeezed(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn told(run: &Run, says: &str) {
    assert!(run.stderr.contains(says), "{says}\n{run:?}");
}

#[test]
fn each_command_is_one_request_in_the_words_of_the_api() {
    for (args, method, path, body) in [
        (vec!["arm"], "POST", "/api/v1/show/arm", json!({})),
        (vec!["arm", "--seats-empty"], "POST", "/api/v1/show/arm", json!({"seats_empty": true})),
        (vec!["disarm"], "POST", "/api/v1/show/disarm", json!({})),
        (vec!["go"], "POST", "/api/v1/show/go", json!({})),
        (vec!["go", "--from", "12:30"], "POST", "/api/v1/show/go", json!({ "from_s": 750.0 })),
        (vec!["pause"], "POST", "/api/v1/show/pause", json!({})),
        (vec!["resume"], "POST", "/api/v1/show/resume", json!({})),
        (vec!["park"], "POST", "/api/v1/show/park", json!({})),
        (vec!["clear"], "POST", "/api/v1/show/clear", json!({})),
        (vec!["home", "--seats-empty"], "POST", "/api/v1/show/home", json!({})),
        (vec!["preflight"], "POST", "/api/v1/preflight", json!({})),
        (vec!["reload"], "POST", "/api/v1/reload", json!({})),
        (vec!["seek", "12:30"], "POST", "/api/v1/show/seek", json!({"position_s": 750.0})),
        (vec!["load", "coaster"], "POST", "/api/v1/show/load", json!({"cue": "coaster"})),
        (vec!["playlist", "saturday"], "PUT", "/api/v1/playlist", json!({"id": "saturday"})),
        (vec!["playlist", "--none"], "PUT", "/api/v1/playlist", json!({"id": null})),
        (vec!["select", "2"], "POST", "/api/v1/playlist/select", json!({"entry": 1})),
        (vec!["trim", "+80ms"], "PUT", "/api/v1/trim", json!({"offset_s": 0.08})),
        (vec!["trim", "-80ms"], "PUT", "/api/v1/trim", json!({"offset_s": -0.08})),
        (vec!["level", "60%"], "PUT", "/api/v1/levels", json!({"motion": 0.6, "vibration": 0.6})),
        (vec!["level", "motion", "60%"], "PUT", "/api/v1/levels", json!({"motion": 0.6})),
        (
            vec!["level", "50%", "--row", "A,B"],
            "PUT",
            "/api/v1/levels",
            json!({"rows": {"A": 0.5, "B": 0.5}}),
        ),
        (vec!["effects", "off", "water"], "PUT", "/api/v1/levels", json!({"effects": {"water": false}})),
        (vec!["preset", "kids show"], "POST", "/api/v1/presets/kids%20show", json!({})),
        (vec!["enable", "A2"], "POST", "/api/v1/controllers/A2/enable", json!({})),
        (vec!["disable", "A2"], "POST", "/api/v1/controllers/A2/disable", json!({})),
        (
            vec!["disable", "A2", "--why", "broken leg"],
            "POST",
            "/api/v1/controllers/A2/disable",
            json!({ "why": "broken leg" }),
        ),
    ] {
        let daemon = Daemon::with(hall("armed"));
        let run = daemon.run(&args);
        assert_eq!(run.code, Some(0), "{args:?} {run:?}");
        assert_eq!(run.stdout, "", "data is for --json, and for what lists something");
        let request = daemon.request();
        assert_eq!((request.method.as_str(), request.path.as_str()), (method, path));
        assert_eq!(request.json(), body, "{args:?}");
        assert_eq!(request.header("content-type"), Some("application/json"));
        assert!(request.header("idempotency-key").is_some_and(|key| key.len() == 32));
        assert!(
            request
                .header("x-kinocue-sent")
                .is_some_and(|ms| ms.parse::<u64>().is_ok_and(|ms| ms > 1_700_000_000_000))
        );
        assert!(daemon.is_done(), "{args:?}");
        told(&run, "kinocue: armed: armed by anna; next: go on; at 01:10.120 of 03:20.000");
    }
}

/// The film of a hall with two sources.
fn film() -> Value {
    json!({
        "state": "locked", "cause": "the film runs", "next": "nothing", "leads": true, "source": "artnet:10.0.0.20",
        "position_s": 5.48, "error_ms": 0.126, "timecode": "01:00:05:12",
        "sources": [
            {"source": "artnet:10.0.0.20", "state": "locked", "cause": "the film runs", "timecode": "01:00:05:12",
                "rate_ppm": 12.0, "sigma_ms": 0.03},
            {"source": "mtc:/dev/snd/midiC1D0", "state": "absent", "cause": "nothing has been received from the film yet"},
        ],
    })
}

#[test]
fn the_film_of_the_hall_is_shown_once_where_nobody_looks_at_a_terminal() {
    let daemon = Daemon::with(film());
    let run = daemon.run(&["sync"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!((daemon.request().path.as_str(), daemon.is_done()), ("/api/v1/sync", true));
    for part in [
        "film locked by artnet:10.0.0.20",
        "error +0.13 ms",
        "> artnet:10.0.0.20 locked 01:00:05:12 +12 0.03",
    ] {
        assert!(squeezed(&run.stdout).contains(part), "{part}\n{}", run.stdout);
    }
    let json = Daemon::with(film()).run(&["sync", "--json"]);
    assert_eq!(serde_json::from_str::<Value>(&json.stdout).expect("the film"), film());
    let none = Daemon::refusing(404, "unknown").run(&["sync"]);
    assert_eq!((none.code, none.stdout.as_str()), (Some(66), ""), "a hall that follows no film says so");
}

#[test]
fn a_source_of_the_film_is_chosen_by_its_name_or_kind_or_left_to_the_ranking() {
    for (wanted, source) in [
        ("artnet:10.0.0.20", json!("artnet:10.0.0.20")),
        ("mtc", json!("mtc:/dev/snd/midiC1D0")),
        ("ltc", json!("ltc")),
        ("auto", Value::Null),
    ] {
        let daemon = Daemon::start(|_, request| {
            Answer::Reply(200, if request.method == "GET" { film() } else { hall("armed") })
        });
        let run = daemon.run(&["sync", "use", wanted]);
        assert_eq!(run.code, Some(0), "{run:?}");
        let mut request = daemon.request();
        if request.method == "GET" {
            request = daemon.request();
        }
        assert_eq!((request.method.as_str(), request.path.as_str()), ("PUT", "/api/v1/sync/source"));
        assert_eq!(request.json(), json!({ "source": source }), "{wanted}");
        told(&run, "kinocue: armed");
    }
}

#[test]
fn all_effects_are_those_that_the_hall_has() {
    let daemon = Daemon::with(hall("armed"));
    assert_eq!(daemon.run(&["effects", "on"]).code, Some(0));
    assert_eq!(daemon.request().method, "GET");
    assert_eq!(daemon.request().json(), json!({"effects": {"air": true, "water": true}}));
}

#[test]
fn a_refusal_says_what_to_do_and_ends_with_its_code() {
    for (status, code, exit) in [
        (409, "state", 75),
        (409, "late", 75),
        (429, "busy", 75),
        (503, "timeout", 75),
        (403, "role", 77),
        (401, "token", 77),
        (404, "unknown", 66),
        (422, "check", 1),
        (400, "value", 64),
        (500, "file", 74),
    ] {
        let run = Daemon::refusing(status, code).run(&["go"]);
        assert_eq!(run.code, Some(exit), "{code}");
        told(&run, "kinocue: cannot go while parked; arm first\nparked: parked by anna; next: arm\n");
        let json = Daemon::refusing(status, code).run(&["go", "--json"]);
        assert_eq!(json.code, Some(exit));
        assert_eq!(serde_json::from_str::<Value>(&json.stdout).expect("the problem")["code"], code);
    }
}

#[test]
fn json_is_printed_as_it_came() {
    let run = Daemon::with(hall("armed")).run(&["arm", "--json"]);
    assert_eq!(run.stdout, format!("{}\n", hall("armed")));
    let run = Daemon::with(hall("armed")).run(&["status", "--json"]);
    assert_eq!((run.stdout, run.stderr.as_str()), (format!("{}\n", hall("armed")), ""));
}

#[test]
fn status_shows_state_controllers_and_warnings() {
    let run = Daemon::with(hall("playing")).run(&["status"]);
    assert_eq!(run.code, Some(0));
    for part in [
        "playing by anna",
        "next       go on",
        "coaster, at 01:10.120 of 03:20.000",
        "no ack for 3 s",
        "look at its plug",
    ] {
        assert!(run.stdout.contains(part), "{part}\n{}", run.stdout);
    }
}

#[test]
fn without_a_daemon_it_says_how_to_start_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let nowhere = folder.path().join("control.sock");
    for args in [["status"], ["go"], ["watch"]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        let run = run(command.args(args).env("KINOCUE_SOCKET", &nowhere));
        assert_eq!(run.code, Some(69), "{run:?}");
        told(
            &run,
            &format!(
                "no daemon answers at {}; start it with `sudo systemctl start kinocue`",
                nowhere.display()
            ),
        );
    }
}

#[test]
fn whoever_asks_a_daemon_that_stands_still_hears_of_it_soon() {
    let daemon = Daemon::start(|_, _| Answer::Silence);
    let mut pause = Running(daemon.command(&["pause"]).spawn().expect("it starts"));
    let run = daemon.run(&["status"]);
    assert_eq!(run.code, Some(69), "{run:?}");
    told(&run, "did not answer within 5 s; it stands still, or is overloaded");
    let mut said = BufReader::new(pause.0.stderr.take().expect("piped")).lines();
    let line = said.next().expect("a line").expect("text");
    assert!(
        line.starts_with("kinocue: no answer from the daemon yet; waiting for it for up to 65 s"),
        "{line}"
    );
}

#[test]
fn wrong_use_asks_nothing() {
    let daemon = Daemon::with(hall("armed"));
    for args in [
        vec!["level", "motion", "60%", "--row", "A"],
        vec!["level", "60"],
        vec!["trim", "501"],
        vec!["seek", "soon"],
        vec!["select", "0"],
        vec!["effects", "maybe"],
        vec!["home"],
        vec!["home", "A1", "--seats-empty"],
        vec!["preflight", "--rate", "250"],
        vec!["test", "sweep", "--rows", "C-A", "--seats-empty"],
        vec!["test", "sweep"],
    ] {
        let run = daemon.run(&args);
        assert_eq!(run.code, Some(64), "{args:?} {run:?}");
    }
    assert!(daemon.is_done());
}

#[test]
fn preflight_shows_what_was_found_and_fails_where_that_fails() {
    let mut status = hall("parked");
    let finding = json!({"id": "amplitude", "severity": "error", "controller": "A1", "text": "PA90 is 3", "remedy": "set it"});
    status["preflight"] = json!({"passed": false, "answered": 1, "findings": [finding]});
    let run = Daemon::with(status).run(&["preflight"]);
    assert_eq!(run.code, Some(1));
    assert!(run.stdout.contains("amplitude") && run.stdout.contains("set it"), "{run:?}");
    told(&run, "preflight failed: 1 of 2 controllers answered");
}

#[test]
fn preflight_says_what_several_have_in_common_once_and_where_to_find_one_that_fails() {
    let mut status = hall("parked");
    status["controllers"] = json!([
        {"name": "A1", "row": "A", "address": "10.0.0.1:7408"}, {"name": "B1", "row": "B", "address": "10.0.0.2:7408"}
    ]);
    let finding = |severity: &str, id: &str, name: &str| json!({"id": id, "severity": severity, "controller": name, "text": "as it is", "remedy": "set it"});
    let findings = [
        finding("error", "no-answer", "B1"),
        finding("warning", "slow-replies", "A1"),
        finding("warning", "slow-replies", "B1"),
    ];
    status["preflight"] = json!({"passed": false, "answered": 1, "findings": findings});
    let run = Daemon::with(status).run(&["preflight"]);
    assert!(run.stdout.contains("B1 (row B, 10.0.0.2:7408)   no-answer"), "{}", run.stdout);
    assert!(run.stdout.contains("A1, B1") && !run.stdout.contains("10.0.0.1"), "{}", run.stdout);
}

#[test]
fn what_all_of_a_hall_have_in_common_is_no_list_of_names() {
    let mut status = hall("parked");
    let names: Vec<_> = (0..64).map(|n| format!("S{n}")).collect();
    status["controllers"] =
        names.iter().map(|name| json!({"name": name, "address": "10.0.0.1:7408"})).collect();
    let finding = |name| json!({"id": "speed-too-low", "severity": "error", "controller": name, "text": "as it is", "remedy": "set it"});
    let findings: Vec<_> = names.iter().map(finding).collect();
    status["preflight"] = json!({"passed": false, "answered": 64, "findings": findings});
    let run = Daemon::with(status).run(&["preflight"]);
    assert!(run.stdout.contains("all 64") && !run.stdout.contains("S17"), "{}", run.stdout);
}

/// A thread that takes one connection to the stop socket, and answers its line.
fn stop_socket(daemon: &Daemon, answer: &'static str) -> thread::JoinHandle<String> {
    let listener = UnixListener::bind(daemon.socket("stop.sock")).expect("a socket");
    thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a connection");
        let mut line = String::new();
        BufReader::new(&stream).read_line(&mut line).expect("a line");
        stream.write_all(answer.as_bytes()).expect("it listens");
        line
    })
}

#[test]
fn a_stop_goes_by_its_own_socket_while_the_other_is_stuck() {
    let daemon = Daemon::start(|_, _| Answer::Silence);
    let socket = stop_socket(&daemon, "stopping\n");
    let run = daemon.run(&["stop"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(socket.join().expect("it was asked"), "stop\n");
    assert!(daemon.is_done(), "the control socket was not asked");
    told(&run, &format!("stopping, via {}", daemon.socket("stop.sock").display()));
    told(&run, "the emergency stop is hard-wired");
}

#[test]
fn a_stop_goes_by_the_control_socket_where_its_own_fails() {
    for answer in [None, Some("what\n"), Some("")] {
        let daemon = Daemon::with(hall("stopping"));
        let socket = answer.map(|answer| stop_socket(&daemon, answer));
        let run = daemon.run(&["stop", "--json"]);
        assert_eq!(run.code, Some(0), "{run:?}");
        assert_eq!(daemon.request().path, "/api/v1/show/stop");
        assert!(run.stdout.contains("\"state\":\"stopping\""), "{run:?}");
        told(&run, "did not take the stop");
        told(&run, &format!("via {}", daemon.socket("control.sock").display()));
        socket.map(thread::JoinHandle::join);
    }
}

#[test]
fn a_stop_that_nobody_takes_points_at_the_emergency_stop() {
    let daemon = Daemon::refusing(503, "timeout");
    let run = daemon.run(&["stop"]);
    assert_eq!(run.code, Some(69));
    told(&run, "THE STOP IS NOT CONFIRMED; use the hard-wired emergency stop");
}

#[test]
fn a_file_is_uploaded_as_it_is_and_named_by_its_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let cue = folder.path().join("new-ride.csv");
    let text = "time_ms,a1\n".to_owned() + &"0,0.5\n".repeat(50_000);
    std::fs::write(&cue, &text).expect("it is ours");
    let daemon = Daemon::start(|_, request| {
        let is_there = request.path != "/api/v1/cues/new-ride" || request.method == "PUT";
        Answer::Reply(if is_there { 200 } else { 404 }, json!({"id": "new-ride"}))
    });
    let run = daemon.run(&["upload", cue.to_str().expect("text")]);
    assert_eq!((run.code, daemon.request().method.as_str()), (Some(0), "GET"), "{run:?}");
    let request = daemon.request();
    assert_eq!((request.method.as_str(), request.path.as_str()), ("PUT", "/api/v1/cues/new-ride"));
    assert_eq!(request.header("content-type"), Some("text/csv"));
    assert!(request.body == text.as_bytes());
    told(&run, "new-ride is in the library; next: kinocue load new-ride");
    assert_eq!(daemon.run(&["upload", "no-such-file.csv"]).code, Some(66));
    told(
        &daemon.run(&["upload", cue.to_str().expect("text"), "--id", "x"]),
        "x is in the library, in place of the one that was there; next: kinocue load x",
    );
    assert_eq!(daemon.request().path, "/api/v1/cues/x");
}

#[test]
fn a_cue_that_does_not_pass_is_told_with_every_fault() {
    let problem = json!({"code": "check", "detail": "new-ride does not pass", "remedy": "fit it", "faults": ["a1: too fast",
        "a2: too far"]});
    let daemon = Daemon::start(move |_, _| Answer::Reply(422, problem.clone()));
    let run = daemon.run(&["upload", "Cargo.toml", "--id", "new-ride"]);
    assert_eq!(run.code, Some(1));
    told(&run, "new-ride does not pass; fit it\n  a1: too fast\n  a2: too far\n");
}

#[test]
fn the_library_and_the_playlist_are_listed() {
    let cues = json!([{"id": "coaster", "title": "Coaster", "length_s": 60.0, "axes": 3, "effects": ["air"], "size": 9,
        "sha256": null, "proof": {"state": "passed"}}]);
    let run = Daemon::start(move |_, _| Answer::Reply(200, cues.clone())).run(&["cues"]);
    assert!(squeezed(&run.stdout).contains("coaster Coaster 01:00.000 3 air passed"), "{run:?}");
    let mut status = hall("parked");
    let entry = json!({"cue": "coaster", "title": null, "length_s": 60.0, "level": 0.6, "trim_ms": null, "then": "hold",
        "at": "14:00"});
    status["playlist"] = json!({"id": "saturday", "title": "Saturday", "entries": [entry, entry], "current": 1,
        "next_start": null});
    let run = Daemon::with(status).run(&["playlist"]);
    assert!(squeezed(&run.stdout).contains(">2 coaster"), "{run:?}");
    let lists = json!([{"id": "saturday"}, {"id": "today"}]);
    let daemon = Daemon::start(move |_, request| {
        let of_lists = request.path.contains("/api/v1/playlists");
        Answer::Reply(200, if of_lists { lists.clone() } else { hall("parked") })
    });
    told(
        &daemon.run(&["playlist"]),
        "no playlist is loaded; there are: saturday, today; next: kinocue playlist ID",
    );
}

#[test]
fn watch_writes_a_line_a_change_and_says_at_once_when_the_daemon_is_gone_and_back() {
    let daemon = Daemon::start(|count, _| match count {
        0 => Answer::Events(vec![hall("armed"), hall("armed"), json!({"other": 1}), hall("playing")]),
        1 => Answer::Reply(503, json!({})),
        _ => Answer::Events(vec![hall("stopped")]),
    });
    let mut watch = Running(daemon.command(&["watch"]).stderr(Stdio::piped()).spawn().expect("it starts"));
    let mut lines =
        BufReader::new(watch.0.stdout.take().expect("piped")).lines().map(|line| line.expect("text"));
    assert_eq!(lines.next().as_deref(), Some("armed: armed by anna; next: go on; at 01:10.120 of 03:20.000"));
    assert_eq!(lines.next().as_deref(), Some("loaded: coaster"));
    let playing = lines.by_ref().find(|line| line.starts_with("playing"));
    assert!(playing.is_some());
    assert!(lines.next().expect("it goes on").starts_with("stopped: stopped by anna"));
    watch.0.kill().expect("it runs");
    let mut said = String::new();
    watch.0.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    assert!(
        said.contains("is gone: it closed the connection; waiting for it\nkinocue: the daemon is back\n"),
        "{said}"
    );
}

#[test]
fn watch_says_when_what_it_shows_is_old() {
    let daemon = Daemon::start(|_, _| Answer::EventsAndSilence(vec![hall("playing")]));
    let mut watch = Running(daemon.command(&["watch"]).spawn().expect("it starts"));
    let mut said = BufReader::new(watch.0.stderr.take().expect("piped")).lines();
    let line = said.next().expect("a line").expect("text");
    assert_eq!(line, "kinocue: no update from the daemon for 2 s: what is shown is old");
}

#[test]
fn watch_prints_events_as_they_come_and_ends_when_nobody_reads() {
    let daemon = Daemon::start(|_, _| Answer::Events(vec![hall("armed"); 3]));
    let mut watch = Running(daemon.command(&["watch", "--json"]).spawn().expect("it starts"));
    let mut lines = BufReader::new(watch.0.stdout.take().expect("piped")).lines();
    assert_eq!(lines.next().expect("a line").expect("text"), hall("armed").to_string());
    drop(lines);
    assert_eq!(watch.0.wait().expect("it ends").code(), Some(0));
}

fn tested(running: bool, done: u64, passed: bool) -> Value {
    let row = |part: &str, passed: bool| json!({"controller": "A1", "part": part, "asked": 200, "acked": 200, "p50_us": 41.0, "p99_us": 93.0, "passed": passed});
    let mut status = hall("playing");
    status["test"] = json!({"running": running, "step": "ended", "done": done, "total": 2, "rows": [row("a1", true),
        row("air", passed)]});
    status
}

#[test]
fn a_sweep_is_followed_to_its_end_and_its_table_shown() {
    for (passed, exit) in [(true, 0), (false, 1)] {
        let daemon = Daemon::start(move |count, _| match count {
            0 => Answer::Reply(200, tested(true, 0, true)),
            _ => Answer::Events(vec![tested(true, 1, true), tested(false, 2, passed)]),
        });
        let run = daemon.run(&["test", "sweep", "--rows", "A-C", "--seats-empty"]);
        assert_eq!(run.code, Some(exit), "{run:?}");
        assert_eq!(daemon.request().json(), json!({"rows": ["A", "B", "C"]}));
        assert!(squeezed(&run.stdout).contains("A1 a1 200 200 41 93 ok"), "{run:?}");
        assert_eq!(run.stdout.contains("FAIL"), !passed);
        told(&run, "test ended: 2 of 2 axes and effects");
    }
}

#[test]
fn a_sweep_that_loses_its_daemon_says_to_look_at_the_seats() {
    let daemon = Daemon::start(|count, _| match count {
        0 => Answer::Reply(200, tested(true, 0, true)),
        _ => Answer::Events(vec![tested(true, 1, true)]),
    });
    let run = daemon.run(&["test", "sweep", "--seats-empty", "--json"]);
    assert_eq!(run.code, Some(69));
    told(&run, "check the seats");
}

#[test]
fn a_sweep_that_did_not_get_through_is_no_pass() {
    let daemon = Daemon::start(|count, _| match count {
        0 => Answer::Reply(200, tested(true, 0, true)),
        _ => Answer::Events(vec![tested(false, 1, true)]),
    });
    let run = daemon.run(&["test", "sweep", "--seats-empty", "--json"]);
    assert_eq!(run.code, Some(1));
    assert_eq!(serde_json::from_str::<Value>(&run.stdout).expect("the result")["done"], 1);
}
