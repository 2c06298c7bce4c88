//! The fleet socket of a hall, without an engine.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;

use crate::hall::Hall;
use crate::http::{Request, To, problem};

const FLEET: &str = "[fleet]\nname = \"berlin.h1\"\n";

/// What the threads of a process are called.
fn threads(pid: u32) -> Vec<String> {
    let tasks = fs::read_dir(format!("/proc/{pid}/task")).unwrap();
    let name = |task: fs::DirEntry| fs::read_to_string(task.path().join("comm")).unwrap_or_default();
    let mut names: Vec<_> = tasks.map(|task| name(task.unwrap()).trim().to_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_hall_without_a_fleet_has_no_socket_thread_warning_or_word_of_one() {
    let alone = Hall::open();
    assert!(!alone.path("fleet.sock").exists() && !alone.path("fleet-stop.sock").exists());
    let member = Hall::open_with(|config| config + FLEET);
    let stops = |hall: &Hall| threads(hall.serving().pid()).iter().filter(|name| *name == "stop").count();
    assert_eq!((stops(&alone), stops(&member)), (1, 2));
    assert!(!alone.status().to_string().contains("fleet"));
}

#[test]
fn the_fleet_socket_tells_how_the_hall_is_and_has_nothing_by_which_it_is_led() {
    let hall = Hall::open_with(|config| config + FLEET);
    let (socket, path) = (To::Unix(hall.path("fleet.sock")), hall.path("fleet.sock"));
    assert_eq!(fs::metadata(path).unwrap().permissions().mode() & 0o777, 0o660);
    let status = socket.get("/api/v1/fleet/status");
    assert_eq!((status.status, status.state().as_str()), (200, "parked"));
    assert_eq!(status.value()["seats"]["total"], 2);
    assert_eq!(socket.get("/api/v1/status").state(), "parked");
    let openapi = hall.socket().get("/api/v1/openapi.json").value();
    let (mut asked, paths) = (0, openapi["paths"].as_object().unwrap());
    for (path, item) in paths {
        let path = path.replace("{name}", "A1").replace("{id}", "ride").replace("{day}", "2026-11-21");
        for method in item.as_object().unwrap().keys().filter(|method| *method != "get") {
            let request = Request::new(&method.to_uppercase(), &path).sent_ago(0).json("{}");
            let (status, _) = request.send(&socket).problem();
            assert!([404, 405].contains(&status), "{method} {path}: {status}");
            asked += 1;
        }
    }
    assert!(asked > 25, "{asked}");
    let letter = r#"{"key":"U","sig":"","body":"{}"}"#;
    let order = |to: &To| Request::new("POST", "/api/v1/fleet/order").json(letter).send(to).problem();
    assert_eq!(order(&socket), problem(401, "token"));
    assert_eq!(order(&hall.socket()), problem(404, "unknown"), "it is on the fleet's own socket alone");
    assert_eq!(hall.status()["state"], "parked");
}

#[test]
fn the_stop_socket_of_the_fleet_stops_and_the_journal_says_whose_it_was() {
    let mut hall = Hall::open_with(|config| config + FLEET);
    hall.play("night");
    assert_eq!(hall.line_of("fleet-stop.sock", "stop\n"), "stopping\n");
    hall.comes_to("stopped");
    hall.close();
    let stops = hall.journal("action");
    let stop = stops.iter().find(|act| act["what"] == "stop").unwrap();
    assert!(stop["who"].as_str().unwrap().ends_with("(fleet, view)"), "{stop}");
}
