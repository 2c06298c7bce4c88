//! What the machine of the service runs out of, or is taken away from it.

use std::fs;
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::process::{Command, Stdio};

use rustix::process::Signal;
use serde_json::Value;

use crate::hall::{Hall, all, connect, count, plays_on, warning};
use crate::statuses::statuses;

/// The least number that a file of the service could have.
fn first_free(pid: u32) -> usize {
    let is_taken = |number: &usize| fs::read_link(format!("/proc/{pid}/fd/{number}")).is_ok();
    (0..).find(|number| !is_taken(number)).expect("there are many numbers")
}

/// Whether a show is under way; a busy machine may have its seats hold and join again.
fn rides(status: &Value) -> bool {
    ["playing", "holding", "joining"].iter().any(|state| status["state"] == *state)
}

/// Limits the open files of the service.
fn limit(pid: u32, files: usize) {
    let (pid, files) = (pid.to_string(), format!("--nofile={files}:"));
    let set = Command::new("prlimit").args(["--pid", &pid, &files]).status().expect("it starts");
    assert!(set.success(), "{files}");
}

#[test]
fn with_no_descriptor_left_the_show_goes_on_a_stop_is_heard_and_what_to_do_is_said() {
    let Some(hall) = Hall::open() else { return };
    hall.rides();
    let pid = hall.serving().pid();
    let mut told = statuses(&hall.path("control.sock")).expect("it listens");
    told.next().expect("a status");
    let least = first_free(pid);
    limit(pid, least);
    // What is closed meanwhile is taken by connections that stay.
    let mut held: Vec<UnixStream> = Vec::new();
    for status in told.by_ref().take(4) {
        let mut half = connect(&hall.path("control.sock"));
        half.write_all(b"GET /api/v1/status HTTP/1.1\r\nHost: localhost\r\n").expect("it listens");
        held.push(half);
        assert!(rides(&status), "{status}");
    }
    assert!(first_free(pid) >= least, "none is left");
    let first = told.next().expect("a status");
    let until = first["ticks"].as_u64().expect("a count") + 30;
    let later = told.find(|status| status["ticks"].as_u64() >= Some(until)).expect("a status");
    assert!(rides(&later) && (0..2).all(|seat| plays_on(&later, seat)), "{later}");
    assert!(count(&later, 0, "acked") > count(&first, 0, "acked"), "{later}");

    let mut stop = connect(&hall.path("stop.sock"));
    told.next().expect("a status"); // it is let in long before it says anything
    stop.write_all(b"stop\n").expect("it listens");
    let mut answer = String::new();
    stop.read_to_string(&mut answer).expect("text");
    assert_eq!(answer, "stopping\n");
    for half in &mut held {
        half.set_nonblocking(true).expect("it is ours");
        let ended = half.read(&mut [0]);
        let waits = ended.as_ref().is_err_and(|error| error.kind() == ErrorKind::WouldBlock);
        assert!(waits, "it was not heard for one that has ended: {ended:?}");
    }
    told.find(|status| status["state"] == "stopped").expect("it stops");
    hall.serving().signal(Signal::HUP);
    hall.serving().heard(|line| line.contains("(os error 24)").then_some(()));
    limit(pid, 1_024);
    drop(held);
    hall.lives_on(50); // the reload is over
    hall.done(&["clear"]);
    hall.wait(|status| status["next"] == "park, or home");
    hall.comes_down();
    let wanted = ["what people set cannot be kept", "the show is not recorded", "an incident is not kept"];
    for line in hall.serving().lines().iter().filter(|line| wanted.iter().any(|words| line.contains(words))) {
        assert!(!line.contains("(os error 24)") || line.contains("LimitNOFILE="), "{line}");
    }
    hall.ends(true);
}

#[test]
fn a_real_time_program_that_takes_the_processor_of_the_tick_thread_ends_in_a_hold_and_a_join() {
    let last = std::thread::available_parallelism().map_or(0, |processors| processors.get() - 1).to_string();
    let may = Command::new("chrt").args(["--fifo", "99", "true"]).stderr(Stdio::null()).status();
    if !may.is_ok_and(|may| may.success()) {
        let _ = writeln!(std::io::stderr(), "skipped: nobody may be real-time here; run it as root");
        return;
    }
    let Some(hall) = Hall::open_with(3, &["taskset", "--cpu-list", &last]) else { return };
    hall.rides();
    // The kernel kills it after 0.3 s; by itself it would never end.
    let spin = "prlimit --rttime=300000 sh -c 'while :; do :; done'";
    let mut hog = Command::new("taskset");
    hog.args(["--cpu-list", &last, "chrt", "--fifo", "99", "sh", "-c", spin]).stderr(Stdio::null());
    assert!(!hog.status().expect("it starts").success(), "it was ended");
    hall.serving().heard(|line| {
        line.contains("holding: this machine sent the seats a frame more than 50 ms late").then_some(())
    });
    let held = hall.lives_on(50);
    let back = hall.wait(|status| {
        let is_led = (0..2).all(|seat| count(status, seat, "sent") > count(&held, seat, "sent") + 20);
        status["state"] == "playing" && all(status, "ok") && is_led
    });
    assert!(warning(&back, "no-seat", None).is_none(), "{back}");
    hall.comes_down();
    hall.ends(true);
}
