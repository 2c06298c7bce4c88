//! The command line: help, wrong use, and what is refused with 64.

use std::process::{Command, Stdio};

use super::Folder;
use super::process::{Sim, kinocue, play};

#[test]
fn every_command_has_a_help_with_examples() {
    let all = kinocue(&["--help"]);
    assert_eq!(all.code, Some(0));
    for command in ["demo", "play", "sim", "check", "info", "convert", "decode", "completions"] {
        assert!(
            command == "completions" || all.stdout.contains(&format!("\n  {command} ")),
            "{command}: {}",
            all.stdout
        );
        let run = kinocue(&[command, "--help"]);
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{command}");
        assert!(run.stdout.contains("Example"), "{command}: {}", run.stdout);
        assert!(run.stdout.contains(&format!("kinocue {command}")), "{command}: {}", run.stdout);
    }
}

#[test]
fn wrong_use_is_64_and_says_what_is_wrong() {
    let folder = Folder::new();
    let cue = folder.nod(&[0.1, 0.1]);
    let cue = cue.to_str().expect("text");
    let to = "127.0.0.1:9";
    let twice = format!("{to},axes=1");
    let cases: &[(&[&str], &str)] = &[
        (&[], "--to"),
        (&["--to", to, "--tow", to], "--tow"),
        (&["--to", to, "--to", &twice], "address"),
        (&["--to", to, "--config", "hall.toml"], "--config"),
        (&["--to", "127.0.0.1"], "port"),
        (&["--to", "127.0.0.1:0"], "port"),
        (&["--to", "0.0.0.0:7408"], "--to 0.0.0.0:7408: is not a destination"),
        (&["--to", "127.0.0.1:7408,axis=2"], "axis"),
        (&["--to", "127.0.0.1:7408,axes=13"], "12"),
        (&["--to", "127.0.0.1:7408,offset=2"], "offset"),
        (&["--to", to, "--rate", "0"], "1000"),
        (&["--to", to, "--rate", "1001"], "1000"),
        (&["--to", to, "--rate", "nan"], "1000"),
        (&["--to", to, "--time", "later"], "relative"),
        (&["--to", to, "--start", "0.8"], "00:00.800"),
        (&["--to", to, "--start", "1:99"], "--start"),
        (&["--to", to, "--level", "150%"], "--level"),
        (&["--to", to, "--loop", "-1"], "-1"),
        (&["--to", to, "--effect", "air"], "air"),
        (&["--to", to, "--effect", "air=13"], "12"),
        (&["--to", to, "--bind", "here"], "--bind"),
        (&["--to", to, "--ack-every", "0"], "1..=1000"),
        (&["--to", to, "--ack-every", "1001"], "1..=1000"),
        (&["--to", to, "--ack-every", "2", "--no-acks"], "--no-acks"),
        (&["--to", to, "--ack-every", "7"], "--ack-every 7: a loss would be seen 60 ms later"),
        (&["--to", to, "--ack-every", "2", "--rate", "19"], "1 is the most at 19 Hz"),
        (&["--to", to, "--spin-us", "901"], "0..=900"),
    ];
    for (args, said) in cases {
        let run = kinocue(&[&["play", cue], *args].concat());
        assert_eq!((run.code, run.stdout.as_str()), (Some(64), ""), "{args:?}: {run:?}");
        assert!(run.stderr.contains(said), "{said}: {}", run.stderr);
    }
    assert_eq!(kinocue(&["serenade"]).code, Some(64));
    assert_eq!(kinocue(&[]).code, Some(64));
}

#[test]
fn a_port_that_is_taken_is_75_and_an_address_that_is_not_ours_71() {
    let folder = Folder::new();
    let cue = folder.nod(&[0.1]);
    let taken = std::net::UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let taken = taken.local_addr().expect("it is bound").to_string();
    for (bind, code) in [(taken.as_str(), 75), ("192.0.2.1:0", 71)] {
        let cue = cue.to_str().expect("text");
        let run = kinocue(&["play", cue, "--to", "127.0.0.1:9", "--bind", bind, "--json"]);
        assert_eq!((run.code, run.stdout.as_str()), (Some(code), ""), "{run:?}");
        assert!(run.stderr.contains(bind), "{}", run.stderr);
    }
    for held in
        [&["sim", "--listen", &taken][..], &["sync", "watch", &format!("artnet:127.0.0.1,bind={taken}")]]
    {
        let run = kinocue(held);
        assert_eq!(run.code, Some(75), "{held:?} {run:?}");
    }
}

#[test]
fn vibration_that_a_frame_has_no_room_for_is_refused() {
    let folder = Folder::new();
    let cue = folder.nod_with(&[0.01; 7], ",v1_hz,v1_amp", |_| ",20,0.01".to_owned());
    for to in ["127.0.0.1:9", "127.0.0.1:9,dialect=mbox"] {
        let run = play(&cue, &[to.to_owned()], &["--json"]);
        assert_eq!((run.code, run.stdout.as_str()), (Some(65), ""), "{run:?}");
        assert!(run.stderr.contains("nod.csv:1:30: v1_hz"), "{}", run.stderr);
    }
}

#[test]
fn a_vibration_that_swings_too_far_is_refused_by_check_and_play() {
    let folder = Folder::new();
    let seat = "[seat.wide]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
                max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n";
    let hall = format!("{seat}[[controller]]\nname = \"A1\"\naddress = \"127.0.0.1:9\"\nseat = \"wide\"\n");
    let hall = folder.write("hall.toml", hall);
    let cue = folder.nod_with(&[0.01; 3], ",v1_hz,v1_amp", |_| ",20,0.6".to_owned());
    let [hall, cue] = [&hall, &cue].map(|path| path.to_str().expect("text"));
    for command in ["check", "play"] {
        let run = kinocue(&[command, cue, "--config", hall, "--json"]);
        assert_eq!(run.code, Some(65), "{run:?}");
        let said = if command == "check" { &run.stdout } else { &run.stderr };
        assert!(said.contains("v1_amp: the amplitude at 00:00.000 (90.000 mm"), "{run:?}");
    }
}

/// Runs the program with both its outputs leading nowhere, and says how it ends.
fn unheard(args: &[&str]) -> Option<i32> {
    let (gone, closed) = std::io::pipe().expect("a pipe");
    drop(gone);
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinocue"));
    command.args(args).stdin(Stdio::null()).stdout(closed.try_clone().expect("a handle")).stderr(closed);
    command.status().expect("the program runs").code()
}

#[test]
fn closed_pipes_change_no_exit_code() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let [cue, bad] = [folder.nod(&[0.1]), folder.write("bad.csv", "time_ms,a1\n0,0\n10,2\n")];
    let [cue, bad] = [&cue, &bad].map(|path| path.to_str().expect("text"));
    let to = sim.addresses[0].as_str();
    let play = ["play", cue, "--bind", "127.0.0.1:0", "--to", to];
    assert_eq!(unheard(&play), Some(0));
    assert_eq!(unheard(&[&play[..], &["--json", "--start", "0.4"]].concat()), Some(0));
    assert_eq!(unheard(&["play", bad, "--to", to]), Some(65));
    assert_eq!(unheard(&["play", "missing.csv", "--to", to]), Some(66));
    assert_eq!(unheard(&["check", bad]), Some(65));
    assert_eq!(unheard(&["info", cue]), Some(0));
    assert_eq!(unheard(&["play", cue]), Some(64));
    assert!(sim.end().rest_in_park());
}
