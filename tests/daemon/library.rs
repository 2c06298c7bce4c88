//! Cues that come in from outside.

use std::fs;

use crate::hall::{Hall, swell};
use crate::http::{Request, problem};

#[test]
fn a_cue_that_fits_is_taken_in_and_one_that_does_not_is_refused_with_every_fault() {
    let hall = Hall::open();
    hall.write("good.csv", &swell(1));
    hall.write("steep.csv", "time_ms,a1,a2,a3\n0,0,0,0\n20,1,0,1\n1000,1,0,1\n");
    let file = |name: &str| hall.path(name).to_str().unwrap().to_owned();
    hall.done(&["upload", &file("good.csv")]);
    hall.done(&["load", "good"]);
    let run = hall.run(&["upload", &file("steep.csv")]);
    assert_eq!(run.code, Some(65), "{run:?}");
    for fault in ["a1", "a3", "velocity", "acceleration", "jerk"] {
        assert!(run.stderr.contains(fault), "{fault}: {run:?}");
    }
    assert_eq!(hall.run(&["load", "steep"]).code, Some(66));
    let run = hall.run(&["upload", &file("steep.csv"), "--id", "good"]);
    assert_eq!(run.code, Some(65), "{run:?}");
    hall.done(&["load", "good"]); // the one before is still there
    let mut names: Vec<_> =
        fs::read_dir(hall.path("cues")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.retain(|name| name.to_str().unwrap().ends_with(".csv"));
    names.sort();
    assert_eq!(names, ["good.csv", "night.csv", "ride.csv"]);
}

#[test]
fn a_name_that_is_a_path_names_nothing() {
    let hall = Hall::open();
    for id in ["..%2Fhall", "%2Fetc%2Fpasswd", "..", ".upload-1", "a%00b", "Ride", &"x".repeat(65)] {
        let path = format!("/api/v1/cues/{id}");
        let reply = Request::new("PUT", &path).body(swell(1)).send(&hall.socket());
        assert!([400, 404].contains(&reply.status), "{id}: {}", reply.text());
        assert!([400, 404].contains(&hall.socket().get(&path).status), "{id}");
        let load = Request::new("POST", "/api/v1/show/load").json(format!("{{\"cue\":\"{id}\"}}"));
        assert_eq!(load.send(&hall.socket()).problem(), problem(400, "value"), "{id}");
    }
    let mut names: Vec<_> =
        fs::read_dir(hall.folder()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.retain(|name| name.to_str().unwrap().ends_with(".csv"));
    assert!(names.is_empty(), "{names:?}");
}

#[test]
fn a_shell_completes_what_the_running_service_knows_and_nothing_where_none_runs() {
    let hall = Hall::open();
    let bash = hall.done(&["completions", "bash"]).stdout;
    hall.write("kinocue.bash", &bash);
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_kinocue")).parent().unwrap();
    let completed = |line: &str, socket: &str| {
        let script = format!(
            "source {}; COMP_WORDS=({line}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); current=${{COMP_WORDS[COMP_CWORD]}}; \
             _kinocue_known kinocue \"$current\" \"${{COMP_WORDS[COMP_CWORD-1]}}\"; echo ${{COMPREPLY[@]}}",
            hall.path("kinocue.bash").display()
        );
        let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
        let mut bash = std::process::Command::new("bash");
        bash.args(["--norc", "-c", &script]).env("PATH", path).env("KINOCUE_SOCKET", hall.path(socket));
        let output = bash.output().expect("bash runs");
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    };
    let cases = [
        ("kinocue load r", "ride"),
        ("kinocue load ''", "night ride"),
        ("kinocue disable A", "A1 A2"),
        ("kinocue preset k", "kids"),
        ("kinocue effects off wa", "water"),
    ];
    for (line, wanted) in cases {
        assert_eq!(completed(line, "control.sock"), wanted, "{line}");
        assert_eq!(completed(line, "none.sock"), "", "{line}");
    }
    assert!(completed("kinocue load --s", "control.sock").contains("--socket"), "options as ever");
    assert!(completed("kinocue pre", "control.sock").contains("preset"), "commands as ever");
}
