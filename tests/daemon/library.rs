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
