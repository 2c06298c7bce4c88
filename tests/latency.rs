//! `kinocue latency` from outside: what it measures, what it keeps, and that no seat ever moves for it.

#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "common/process.rs"]
mod process;

#[path = "common/jog.rs"]
mod jog;

use std::net::{Ipv4Addr, UdpSocket};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use jog::JoggedTo;
use kinocue::harness::latency::{Percentiles, read};
use kinocue::harness::motion::Pulses;
use kinocue::wire::{
    Access, Dialect, FrameNo, MAX_LEN, MotionRequest, ReadRequest, RegisterReply, ReplyCode, Words,
    position_words,
};
use process::{Run, Sim, kinocue};
use serde_json::Value;

/// Measures for a second what these arguments name, with a report for programs.
fn latency(args: &[&str]) -> Run {
    kinocue(&[&["latency", "--seconds", "1", "--json"], args].concat())
}

/// The same to controllers at these addresses, from any port.
fn latency_to(to: &[&str], more: &[&str]) -> Run {
    let to = to.iter().flat_map(|to| ["--to", to]);
    let args: Vec<&str> = to.chain(["--bind", "127.0.0.1:0"]).chain(more.iter().copied()).collect();
    latency(&args)
}

fn count(value: &Value) -> u64 {
    value.as_u64().unwrap_or_else(|| panic!("{value} is no count"))
}

#[test]
fn without_controllers_it_measures_virtual_ones_of_its_own_and_keeps_every_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("times.hlog");
    let report =
        latency(&["--rate", "500", "--count", "2", "--out", path.to_str().expect("text")]).report_of(0);
    assert_eq!((&report["virtual"], &report["report"]["result"]), (&true.into(), &"completed".into()));
    let ticks = count(&report["report"]["ticks"]);
    // A stall may take ticks away, which then are missed ones.
    assert!(ticks + count(&report["report"]["missed_ticks"]) >= 500, "{report}");
    assert_eq!(count(&report["lateness_us"]["count"]), ticks);
    let controllers = report["report"]["controllers"].as_array().expect("a list");
    let acked: u64 = controllers.iter().map(|one| count(&one["acked"])).sum();
    assert_eq!((controllers.len(), count(&report["ack_us"]["count"])), (2, acked));
    for (kind, us) in [("lateness", &report["lateness_us"]), ("acks", &report["ack_us"])] {
        let rising = ["p50", "p90", "p99", "p999", "max"].map(|figure| us[figure].as_f64().expect(kind));
        assert!(rising.is_sorted(), "{kind}: {us}");
    }
    let kept = read(&std::fs::read(&path).expect("it is there")).expect("a log");
    let [lateness, acks] = [&kept.lateness, &kept.acks].map(|times| Percentiles::of(times).count);
    assert_eq!((lateness, acks), (ticks, acked), "each time is in one interval");
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1, "nothing else is left");
}

#[test]
fn a_seat_away_from_park_is_held_where_it_stands_by_every_frame() {
    const PLACES: [i32; 3] = [90_001, 60_000, 12_345];
    let sim = Sim::one(&[]);
    let (channel, frame, axis, register) = (0, FrameNo(1), 0, 0x06);
    JoggedTo { channel, frame, positions: &PLACES, axis, register }.to(&sim.addresses[0]);
    let report = latency_to(&[&sim.addresses[0]], &[]).report_of(0);
    let sent = count(&report["report"]["controllers"][0]["sent"]);
    assert!(sent > 0 && count(&report["report"]["controllers"][0]["park_frames"]) == 0, "{report}");
    let seen = sim.end();
    assert_eq!(seen.motion() as u64, 1 + sent);
    for row in &seen.rows[1..] {
        assert_eq!((&row.commanded[..3], &row.executed[..3]), (&PLACES[..], &PLACES[..]), "{row:?}");
        assert_eq!((row.outputs, row.function.as_str()), (0, "0x1401"));
    }
    assert_eq!(seen.controllers[0]["positions"], Value::from(PLACES.to_vec()));
}

#[test]
fn a_controller_whose_seat_might_move_is_sent_no_frame() {
    for (options, to, why) in [
        (&["--pa", "95=1"][..], "", "PA95"),
        (&["--pa", "55=5"], "", "PA55"),
        (&["--pa", "0d=500"], "", "PA0d"),
        (&["--axes", "6"], "", "PA02"),
        (&["--estop-at", "0"], "", "emergency stop"),
    ] {
        let sim = Sim::one(options);
        let run = latency_to(&[&format!("{}{to}", sim.addresses[0])], &[]);
        assert_eq!(run.code, Some(76), "{why}: {run:?}");
        assert!(run.stderr.contains("c1: left out: ") && run.stderr.contains(why), "{}", run.stderr);
        assert_eq!(sim.end().motion(), 0, "{why}");
    }
}

#[test]
fn a_silent_controller_is_left_out_and_the_others_are_measured() {
    let (sim, mute) = (Sim::one(&[]), Sim::one(&["--mute"]));
    let report = latency_to(&[&sim.addresses[0], &mute.addresses[0]], &[]).report_of(69);
    assert_eq!(report["refused"][0]["name"], "c2");
    let controllers = report["report"]["controllers"].as_array().expect("a list");
    assert_eq!((controllers.len(), &controllers[0]["acked"]), (1, &controllers[0]["sent"]));
    assert_eq!(mute.end().motion(), 0);
    assert!(sim.end().rest_in_park());
}

/// A controller of three axes at rest that says of its `nth` reading, from 0, that axis 1 stands at `place(nth)`; until it
/// is sent an empty datagram. Returns the frames that it got.
fn fickle(socket: &UdpSocket, place: impl Fn(usize) -> i32, readings: &AtomicUsize) -> usize {
    let (mut bytes, mut frames) = ([0; MAX_LEN], 0);
    loop {
        let (len, from) = socket.recv_from(&mut bytes).expect("loopback works");
        if len == 0 {
            return frames;
        }
        frames += usize::from(MotionRequest::parse(&bytes[..len]).is_ok());
        let Ok(ReadRequest { channel, start, num, .. }) = ReadRequest::parse(&bytes[..len]) else {
            continue;
        };
        let mut words = vec![0; usize::from(num)];
        match (channel, start) {
            (0, 0x06) => {
                let nth = readings.fetch_add(1, Ordering::Relaxed);
                words[..2].copy_from_slice(&position_words(Pulses(place(nth)), Dialect::Smc));
            }
            (1, 0x00) => words[2] = 3,
            (1, 0x02) => words[0] = 3,
            _ => {}
        }
        let reply = RegisterReply {
            access: Access::Read,
            code: ReplyCode::Running,
            channel,
            error: 0,
            start,
            num,
            data: Words::from(&words[..]),
        };
        socket.send_to(reply.emit(&mut [0; MAX_LEN]), from).expect("loopback works");
    }
}

/// Measures such a controller; how it ended, and the frames that it got.
fn measured_while(place: impl Fn(usize) -> i32 + Sync) -> (Run, usize) {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
    let (address, readings) = (socket.local_addr().expect("it is bound"), AtomicUsize::new(0));
    thread::scope(|scope| {
        let controller = scope.spawn(|| fickle(&socket, &place, &readings));
        let run = latency_to(&[&address.to_string()], &["--no-acks"]);
        socket.send_to(&[], address).expect("loopback works");
        (run, controller.join().expect("it does not panic"))
    })
}

#[test]
fn a_seat_that_has_moved_just_before_the_first_frame_is_sent_none() {
    // Two readings are before, of whether somebody else moves it.
    let (run, frames) = measured_while(|nth| if nth < 4 { 100_000 } else { 100_002 });
    assert_eq!((run.code, frames), (Some(75), 0), "{run:?}");
    assert!(run.stderr.contains("c1: cannot be held"), "{}", run.stderr);
    let (run, frames) = measured_while(|nth| if nth < 3 { 100_000 } else { 100_002 });
    assert_eq!((run.code, frames), (Some(76), 0), "{run:?}");
}

#[test]
fn without_acks_lateness_alone_is_measured_and_positions_are_read_all_the_same() {
    let (run, frames) = measured_while(|_| 100_000);
    let report = run.report_of(0);
    assert_eq!((count(&report["ack_us"]["count"]), &report["ack_us"]["p99"]), (0, &Value::Null));
    assert_eq!(count(&report["lateness_us"]["count"]), frames as u64);
}

#[test]
fn people_read_drawings_on_stdout_and_a_line_a_second_on_stderr() {
    let run = kinocue(&["latency", "--seconds", "1", "--count", "1", "--rate", "200"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    for part in
        ["200 Hz to 1 virtual controller\n", "lateness (bars", "ack latency (bars", " |###", "real time"]
    {
        assert!(run.stdout.contains(part), "{part}: {}", run.stdout);
    }
    assert!(run.stderr.contains("kinocue: 1 s: lateness p50 "), "{}", run.stderr);
    assert!(!run.stderr.contains('\r') && !run.stderr.contains('\u{1b}'), "no drawing in a pipe");
}

#[test]
fn two_files_are_held_against_each_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("text").to_owned();
    let (a, b) = (file("a.hlog"), file("b.hlog"));
    for path in [&a, &b] {
        latency(&["--count", "1", "--out", path]).report_of(0);
    }
    let run = kinocue(&["latency", "--compare", &a, &b]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    for part in ["lateness", "ack latency", "p50", "p90", "p99", "p99.9", "max", "B / A"] {
        assert!(run.stdout.contains(part), "{part}: {}", run.stdout);
    }
    let report = kinocue(&["latency", "--compare", &a, &a, "--json"]).report_of(0);
    // What the verdict says hangs on how many ticks a busy machine left.
    for (kind, name) in [("lateness", "lateness: "), ("ack_latency", "ack latency: ")] {
        let figures = report[kind]["figures"].as_array().expect("a list");
        assert!(figures.len() == 5 && figures.iter().all(|one| one["ratio"] == 1.0), "{report}");
        assert!(report[kind]["verdict"].as_str().expect("text").starts_with(name), "{report}");
    }
}

#[test]
fn files_that_are_missing_or_something_else_are_told_apart() {
    let missing = kinocue(&["latency", "--compare", "no.hlog", "no.hlog"]);
    assert_eq!(missing.code, Some(66), "{missing:?}");
    let other = kinocue(&["latency", "--compare", "cues/coaster.csv", "cues/coaster.csv"]);
    assert_eq!(other.code, Some(65), "{other:?}");
    assert!(other.stderr.contains("cues/coaster.csv: line "), "{}", other.stderr);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.hlog");
    let (out, mute) = (path.to_str().expect("text"), Sim::one(&["--mute"]));
    assert_eq!(latency_to(&[&mute.addresses[0]], &["--out", out]).code, Some(69));
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0, "nothing was measured");
    let unwritable = kinocue(&["latency", "--out", "no/such/folder/x.hlog"]);
    assert_eq!(unwritable.code, Some(74), "{unwritable:?}");
}

#[test]
fn wrong_use_is_refused() {
    for args in [
        &["--count", "2", "--to", "127.0.0.1:7408"][..],
        &["--compare", "a.hlog"],
        &["--seconds", "0"],
        &["--rate", "1001"],
        &["--spin-us", "901"],
        &["--no-acks", "--ack-every", "2"],
        &["--rate", "100", "--ack-every", "7"],
        &["--to", "127.0.0.1"],
    ] {
        let run = kinocue(&[&["latency"], args].concat());
        assert_eq!(run.code, Some(64), "{args:?}: {run:?}");
    }
}
