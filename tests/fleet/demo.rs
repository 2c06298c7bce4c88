//! The demo as somebody finds it who has just read of it.

use std::io::BufRead as _;
use std::path::Path;
use std::process::Command;

use rustix::process::Signal;

use crate::process::Guarded;
use crate::programs::is_installed;

#[test]
fn the_demo_is_a_fleet_of_three_halls_and_leaves_nothing_behind() {
    if !is_installed("nats-server") {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
    let mut demo = Guarded::start_command(command.args(["fleet", "demo"]).env("TMPDIR", dir.path()));
    let mut lines = demo.stderr().lines().map_while(Result::ok);
    let desk = lines.find_map(|line| line.trim().strip_prefix("export KINOCUE_DESK=").map(str::to_owned));
    let desk = desk.expect("it says how to ask");
    let fleet = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
        command.arg("fleet").args(args).env("KINOCUE_DESK", &desk).output().unwrap()
    };
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    assert!((0..40).any(|_| fleet(&["status"]).status.code() == Some(0)), "all three are heard");
    let loaded = fleet(&["load", "bench-ride", "all"]);
    assert_eq!(loaded.status.code(), Some(0), "{}", text(loaded.stdout));
    let stopped = fleet(&["stop"]);
    assert_eq!(text(stopped.stdout), "demo.h1: stopping\ndemo.h2: stopping\ndemo.h3: stopping\n");
    demo.signal(Signal::TERM);
    let run = demo.finish();
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(!Path::new(&desk).exists());
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "nothing is left");
}

#[test]
fn without_an_engine_the_demo_names_its_package() {
    let dir = tempfile::tempdir().unwrap();
    if ["/usr/sbin", "/usr/local/sbin"].iter().any(|folder| Path::new(folder).join("nats-server").exists()) {
        return; // it is found there whatever the path is
    }
    let run = Guarded::start_with_path(&["fleet", "demo"], dir.path()).finish();
    assert_eq!(run.code, Some(69), "{run:?}");
    assert!(run.stderr.contains("apt install nats-server"), "{run:?}");
}
