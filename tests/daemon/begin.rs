//! How it starts, and when it does not.

use std::fs;
use std::process::Command;

use crate::hall::Hall;
use crate::process::{Guarded, Run, kinocue};
use crate::serving::Serving;

/// A daemon that is to end by itself.
fn serve(hall: &Hall, socket: &str) -> Run {
    let path = |name: &str| hall.path(name).to_str().unwrap().to_owned();
    let (config, socket, state) = (path("hall.toml"), path(socket), path("state"));
    kinocue(&["serve", "--config", &config, "--socket", &socket, "--state", &state])
}

#[test]
fn a_start_goes_from_boot_to_parked_and_moves_nothing() {
    let mut hall = Hall::open();
    let parked = hall.lives_on(100);
    assert_eq!(parked["cause"], "all seats that take part were found at their park poses");
    let lines = hall.close();
    let states = lines.iter().filter(|line| line.contains("(state-")).count();
    assert_eq!(states, 1, "boot to parked at once: {lines:?}");
    assert_eq!(hall.end().motion(), 0);
}

#[test]
fn the_folder_for_playlists_is_made_where_it_is_missing() {
    let mut hall = Hall::closed(&[], |config| config);
    fs::remove_dir(hall.path("playlists")).unwrap();
    hall.serve();
    assert!(hall.path("playlists").is_dir());
}

#[test]
fn a_controller_that_works_with_other_axes_than_its_seat_has_is_in_error_from_the_start() {
    let mut hall = Hall::closed(&["--pa", "02=2"], |config| config);
    hall.serve();
    let status = hall.wait(|status| status["controllers"][0]["health"] == "error");
    let why = status["controllers"][0]["why"].as_str().unwrap();
    assert!(why.starts_with("it works with 2 axes (PA02)"), "{why}");
    assert_eq!(hall.end().motion(), 0);
}

#[test]
fn after_a_crash_in_mid_show_nothing_moves_until_a_person_parks_the_seats() {
    let mut hall = Hall::open();
    hall.play("night");
    hall.rises(0);
    hall.kill();
    hall.relay(0).count();
    hall.serve();
    let status = hall.lives_on(100);
    assert_eq!(status["state"], "recovering", "{status}");
    assert!(status["cause"].as_str().unwrap().contains("without parking"), "{status}");
    assert_eq!(status["next"], "park, or home");
    let refused = hall.run(&["arm"]);
    assert_eq!(refused.code, Some(75), "{refused:?}");
    assert_eq!(hall.relay(0).count(), 0, "no motion frame");
    let before = hall.status()["controllers"][0]["positions_mm"][0].as_f64().unwrap();
    assert!(before > 1.0, "it stands where the crash left it: {before} mm");

    hall.done(&["park"]);
    hall.comes_to("parked");
    let seen = hall.end();
    assert!(seen.rest_in_park(), "{:?}", seen.controllers);
    let of_one = seen.rows.iter().rev().filter(|row| row.controller == seen.rows[0].controller);
    let park: Vec<_> = of_one.take_while(|row| row.frame > 1).collect();
    assert!(park.len() > 10, "{park:?}");
    for pair in park.windows(2) {
        let mm = f64::from((pair[0].commanded[0] - pair[1].commanded[0]).abs()) / 2_000.0;
        let speed = mm / (f64::from(pair[0].time_ms) / 1_000.0);
        assert!(speed <= 50.5, "{speed} mm/s");
    }
}

#[test]
fn preflight_on_the_heels_of_the_start_finds_nobody_who_is_not_there() {
    let mut hall = Hall::closed(&[], |config| config);
    hall.launch();
    // 69: there is no socket yet.
    let asks = std::iter::repeat_with(|| hall.run(&["preflight"])).take(1_000);
    let told = asks.into_iter().find(|run| run.code != Some(69)).expect("it comes up");
    assert_eq!(told.code, Some(0), "{told:?}");
    let preflight = &hall.status()["preflight"];
    let findings = preflight["findings"].as_array().expect("a list");
    let of_others = ["other-master", "foreign-replies", "two-answer", "contradiction"];
    let strangers = findings.iter().filter(|one| of_others.iter().any(|id| one["id"] == *id));
    assert_eq!(strangers.count(), 0, "{preflight}");
    hall.comes_to("parked");
}

#[test]
fn a_second_daemon_is_refused_by_the_port_and_by_the_socket_and_the_first_goes_on() {
    let port = std::net::UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let hall = Hall::open_with(|config| config.replace("127.0.0.1:0", &port.to_string()));
    let run = serve(&hall, "other.sock");
    assert_eq!(run.code, Some(75), "{run:?}");
    assert!(run.stderr.contains(&port.to_string()), "{run:?}");

    hall.rewrite(|config| config.replace(&port.to_string(), "127.0.0.1:0"));
    let run = serve(&hall, "control.sock");
    assert_eq!(run.code, Some(75), "{run:?}");
    assert!(run.stderr.contains("stop.sock"), "{run:?}");
    hall.done(&["load", "ride"]);
}

#[test]
fn a_start_that_is_refused_leaves_no_mark_of_a_crash() {
    let mut hall = Hall::closed(&[], |config| config);
    let held = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = held.local_addr().unwrap().to_string();
    hall.rewrite(|config| config.replace("127.0.0.1:0", &port));
    assert_eq!(serve(&hall, "control.sock").code, Some(75));
    drop(held);
    hall.serve();
    hall.comes_to("parked");
}

#[test]
fn a_bad_configuration_is_refused_with_every_fault_and_its_place() {
    let hall = Hall::closed(&[], |config| {
        let config = config.replace("rate_hz = 100", "rate_hz = 0\nrates = 1");
        config.replacen("seat = \"bench3\"", "seat = \"bench4\"", 1)
    });
    let run = serve(&hall, "control.sock");
    assert_eq!(run.code, Some(78), "{run:?}");
    for fault in ["hall.toml:4:", "hall.toml:5:", "rates", "bench4"] {
        assert!(run.stderr.contains(fault), "{fault}: {run:?}");
    }
    assert!(!hall.path("control.sock").exists());
    assert_eq!(hall.end().motion(), 0);
}

#[test]
fn a_configuration_that_is_missing_and_a_library_that_is_none_are_named() {
    let hall = Hall::closed(&[], |config| config);
    hall.rewrite(|config| config.replace("/cues\"", "/cues/ride.csv\""));
    let run = serve(&hall, "control.sock");
    assert_eq!(run.code, Some(71), "{run:?}");
    assert!(run.stderr.contains("cues/ride.csv"), "{run:?}");
    fs::remove_file(hall.path("hall.toml")).unwrap();
    let run = serve(&hall, "control.sock");
    assert_eq!(run.code, Some(66), "{run:?}");
    assert!(run.stderr.contains("hall.toml"), "{run:?}");
}

/// A hall whose folders cannot be had plays, says so, and begins the next time as after a crash: no mark could be left.
#[track_caller]
fn plays_without_its_folders(hall: &Hall, folder: &str) {
    let told = hall.comes_to("recovering");
    let notes = told["warnings"].to_string();
    assert!(notes.contains(&format!("{folder} takes no file")), "{notes}");
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.play("ride");
    let over = hall.comes_to("parked");
    assert_eq!(over["state"], "parked");
    let warned = hall.wait(|status| {
        status["warnings"].as_array().is_some_and(|all| all.iter().any(|one| one["id"] == "settings"))
    });
    assert!(warned["warnings"].to_string().contains("settings"), "{warned}");
}

#[test]
fn a_state_folder_that_is_not_there_keeps_no_hall_shut() {
    let mut hall = Hall::closed(&[], |config| config);
    // The volume is not mounted that it is on.
    std::os::unix::fs::symlink(hall.path("volume/state"), hall.path("state")).unwrap();
    hall.serve();
    plays_without_its_folders(&hall, hall.path("state").to_str().unwrap());
    hall.kill();
    fs::create_dir_all(hall.path("volume/state")).unwrap();
    hall.serve();
    let parked = hall.comes_to("parked");
    assert!(!parked["warnings"].to_string().contains("takes no file"), "{parked}");
    hall.end();
}

#[test]
fn a_state_folder_that_is_read_only_keeps_no_hall_shut() {
    let mut hall = Hall::closed(&[], |config| config);
    fs::create_dir(hall.path("state")).unwrap();
    let script = "mount --bind \"$1\" \"$1\" && mount -o remount,bind,ro \"$1\" && shift && exec \"$@\"";
    let folder = hall.path("state");
    let start = |args: &[&str]| {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c", script, "sh"]).arg(&folder);
        Guarded::start_command(command.arg(env!("CARGO_BIN_EXE_kinocue")).args(args))
    };
    let serving = Serving::start_by(hall.folder(), start);
    hall.serves_by(serving);
    plays_without_its_folders(&hall, folder.to_str().unwrap());
    hall.end();
}

#[test]
fn a_library_that_is_not_there_keeps_no_hall_shut_and_is_named() {
    let mut hall = Hall::closed(&[], |config| config);
    fs::rename(hall.path("cues"), hall.path("aside")).unwrap();
    std::os::unix::fs::symlink(hall.path("volume/cues"), hall.path("cues")).unwrap();
    hall.serve();
    let told = hall.comes_to("parked");
    assert!(told["warnings"].to_string().contains("the cue library"), "{told}");
    fs::create_dir(hall.path("volume")).unwrap();
    fs::rename(hall.path("aside"), hall.path("volume/cues")).unwrap();
    hall.play("ride");
    hall.comes_to("parked");
    hall.end();
}
