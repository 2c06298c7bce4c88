//! Controllers that are dead, deaf, mute, slow or stopped, and strangers.

use std::net::UdpSocket;

use kinocue::harness::motion::Pulses;
use kinocue::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, Timing};
use serde_json::Value;

use super::Folder;
use super::process::{Playing, Relay, Row, Sim, kinocue, play};

fn first(report: &Value) -> &Value {
    &report["controllers"][0]
}

#[test]
fn a_dead_controller_costs_the_live_one_no_frame() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    // Nobody listens at a port that was free a moment ago.
    let dead = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port");
    let run = play(&folder.nod(&[0.1]), &[dead.to_string(), sim.addresses[0].clone()], &["--json"]);
    let report = run.report_of(69);
    assert_eq!(report["result"], "completed");
    let (dead, live) = (first(&report), &report["controllers"][1]);
    assert_eq!((&dead["acked"], &dead["lost"]), (&0.into(), &dead["asked"]), "{dead}");
    assert!(dead["port_closed"].as_u64() > Some(0), "{dead}");
    assert_eq!((&live["acked"], &live["port_closed"]), (&live["sent"], &0.into()), "{live}");
    assert!(run.stderr.contains("c1"), "{}", run.stderr);
    assert!(sim.end().rest_in_park());
}

#[test]
fn a_seat_that_stands_elsewhere_is_led_to_park_and_then_rides_though_another_controller_is_dead() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let dead = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port");
    let hand = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let away = Motion {
        timing: Timing::Relative,
        channel: 0,
        accept: Code::ALL,
        reply: Code::NONE,
        frame: FrameNo(1),
        time_ms: 300,
        positions: &[90_000, 0, 0].map(Pulses),
        outputs: 0,
        analogue: Analogue::OFF,
        vibration: None,
    };
    hand.send_to(away.emit(&mut [0; MAX_LEN]), &sim.addresses[0]).expect("loopback takes it");
    let run = play(&folder.nod(&[0.1]), &[sim.addresses[0].clone(), dead.to_string()], &["--json"]);
    let report = run.report_of(69);
    let one = first(&report);
    assert_eq!((&one["acked"], &one["park_frames"]), (&one["sent"], &0.into()), "{one}");
    let seen = sim.end();
    let rows = &seen.rows[1..];
    assert_eq!(rows[0].executed, [90_000, 0, 0], "it stood there: {:?}", rows[0]);
    let parked = rows.iter().position(|row| row.commanded == [0; 3]).expect("it parks");
    let is_slow = |pair: &[Row]| {
        let pulses = pair[1].commanded[0].abs_diff(pair[0].commanded[0]);
        pulses <= 101 * pair[1].time_ms // 50 mm/s are 100 a millisecond
    };
    assert!(rows[..=parked].windows(2).all(is_slow), "at 50 mm/s at the most");
    assert!(rows[parked..].iter().any(|row| row.commanded[0] > 10_000), "the cue comes after that");
    assert!(seen.rest_in_park());
}

#[test]
fn nothing_is_sent_to_a_controller_that_drives_other_axes_than_the_cue_has_for_its_seat() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let run = play(&folder.nod(&[0.1; 6]), &sim.to(), &[]);
    assert_eq!(run.code, Some(65), "{run:?}");
    let told =
        "c1 works with 3 axes (PA02), but its seat here has 6: give it axes=3 and a cue for as many (--to)";
    assert!(run.stderr.contains(told), "{run:?}");
    assert!(!run.stderr.contains("lost"), "{run:?}");
    let seen = sim.end();
    assert_eq!(seen.controllers[0]["motion"], 0, "{:?}", seen.controllers);
}

#[test]
fn an_emergency_stop_is_told_by_whatever_answers_first_and_ends_the_play_with_76() {
    // It has looked for other masters for 0.8 s by then.
    let (folder, sim) = (Folder::new(), Sim::one(&["--estop-at", "1.3"]));
    let run = play(&folder.nod(&[0.1]), &sim.to(), &["--json"]);
    let report = run.report_of(76);
    let one = first(&report);
    assert_eq!((&one["state"]["emergency_stop"], &one["lost"]), (&true.into(), &0.into()), "{one}");
    assert_eq!(sim.end().controllers[0]["refused"]["emergency_stop"], one["refused"]);
}

#[test]
fn an_emergency_stop_before_the_first_frame_ends_the_play_with_76_and_without_motion() {
    let (folder, sim) = (Folder::new(), Sim::one(&["--estop-at", "0"]));
    let report = play(&folder.nod(&[0.1]), &sim.to(), &["--json"]).report_of(76);
    assert_eq!(first(&report)["state"]["emergency_stop"], true, "{report}");
}

#[test]
fn a_mute_controller_is_homed_and_unavailable() {
    let (folder, sim) = (Folder::new(), Sim::one(&["--mute"]));
    let report = play(&folder.nod(&[0.1]), &sim.to(), &["--json"]).report_of(69);
    let one = first(&report);
    assert_eq!(
        (&one["park_frames"], &one["lost"], &one["port_closed"]),
        (&1.into(), &one["sent"], &0.into()),
        "{one}"
    );
    let seen = sim.end();
    assert_eq!(seen.controllers[0]["motion"], one["sent"], "it obeyed all the same");
    let told =
        |what: &str| report["events"].as_array().expect("a list").iter().any(|event| event["what"] == what);
    assert!(told("lost: no ack and no report for too long"), "{report}");
    let frames = one["sent"].as_u64().expect("a count");
    assert!(frames < 80, "it gets nothing more once it is given up, and has come to rest: {frames}");
}

#[test]
fn lost_and_repeated_answers_are_counted_and_leave_0() {
    let (folder, sim) =
        (Folder::new(), Sim::one(&["--loss", "0.1", "--duplicate", "0.2", "--seed", "11", "--delay", "3ms"]));
    let report = play(&folder.nod(&[0.1]), &sim.to(), &["--json", "--rate", "500"]).report_of(0);
    let one = first(&report);
    let count = |field: &str| one[field].as_u64().expect("a count");
    assert!(count("lost") > 0 && count("duplicate") > 0 && count("acked") > 0, "{one}");
    assert_eq!(count("asked"), count("acked") + count("refused") + count("lost"), "{one}");
    let seen = sim.end();
    let of = |field: &str| seen.controllers[0][field].as_u64().expect("a count");
    // Position reads are lost and repeated by the same link; they are no frames.
    assert!(of("duplicated") >= count("duplicate"));
    assert!(of("lost_frames") + of("lost_replies") >= count("lost"));
    assert_eq!(count("acked"), count("sent") - count("lost"));
}

#[test]
fn late_answers_are_acks_with_their_latency_and_a_seat_whose_answers_are_a_second_late_is_not_moved() {
    let folder = Folder::new();
    let cue = folder.nod(&[0.1]);
    let (slow, asleep) = (Sim::one(&["--delay", "25ms"]), Sim::one(&["--delay", "1.2s"]));
    let late = Playing::start(&cue, &slow.to(), &["--json"]);
    let unsure = Playing::start(&cue, &asleep.to(), &["--json"]).finish();
    let late = late.finish().report_of(0);
    let one = first(&late);
    assert_eq!(one["acked"], one["sent"], "{one}");
    assert!(one["ack_us"]["p50"].as_f64() > Some(25_000.0), "{one}");
    // Its positions came too late as well, and so did the acks of the slow frame to park.
    assert_eq!(unsure.code, Some(75), "{unsure:?}");
    assert!(unsure.stderr.contains("cannot be brought to park for certain"), "{unsure:?}");
}

#[test]
fn a_seat_whose_acks_come_later_than_a_gap_lasts_is_brought_to_rest_and_named() {
    let folder = Folder::new();
    let slow = Sim::one(&["--delay", "90ms"]);
    let run = Playing::start(&folder.nod(&[0.1]), &slow.to(), &["--json"]).finish();
    assert!(run.stdout.contains("were missing for over 50 ms"), "{run:?}");
}

#[test]
fn a_controller_that_goes_silent_mid_show_is_told_by_69() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let relay = Relay::start(&sim.addresses[0]);
    let playing = Playing::start(&folder.nod(&[0.1]), &[relay.to()], &["--json", "--loop", "3"]);
    relay.wait_for(|frame| frame.frame.0 == 30);
    drop(sim);
    let report = playing.finish().report_of(69);
    let one = first(&report);
    assert!(one["acked"].as_u64() >= Some(20) && one["lost"].as_u64() > Some(3), "{one}");
    assert!(one["sent"].as_u64() < Some(100), "it gets nothing more once it is given up: {one}");
}

#[test]
fn strangers_and_strays_are_counted_and_disturb_nothing() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let relay = Relay::start(&sim.addresses[0]);
    let playing = Playing::start(&folder.nod(&[0.1]), &[relay.to()], &["--json"]);
    let host = relay.wait_for(|frame| frame.frame.0 == 10);
    let stranger = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    for bytes in [&b"hello"[..], &[0x55, 0xaa, 0, 0, 0x14, 2], &[]] {
        stranger.send_to(bytes, host).expect("loopback takes it");
        relay.send(bytes, host);
    }
    let report = playing.finish().report_of(0);
    let one = first(&report);
    assert_eq!(report["strangers"], 3, "{report}");
    assert_eq!((&one["stray"], &one["acked"]), (&3.into(), &one["sent"]), "{one}");
    drop(stranger);
}

#[test]
fn a_second_kinocue_on_the_same_port_is_refused_with_71_and_the_first_loses_nothing() {
    let (folder, sim) = (Folder::new(), Sim::start(2, &[]));
    let cue = folder.nod(&[0.1]);
    let relay = Relay::start(&sim.addresses[0]);
    let playing = Playing::start(&cue, &[relay.to()], &["--json"]);
    let host = relay.wait_for(|frame| frame.frame.0 == 2).to_string();
    let cue = cue.to_str().expect("text");
    let second = kinocue(&["play", cue, "--bind", &host, "--to", &sim.addresses[1], "--json"]);
    assert_eq!((second.code, second.stdout.as_str()), (Some(71), ""), "{second:?}");
    assert!(second.stderr.contains(&host), "{}", second.stderr);
    let report = playing.finish().report_of(0);
    let one = first(&report);
    assert_eq!((&one["acked"], &one["stray"], &report["strangers"]), (&one["sent"], &0.into(), &0.into()));
    assert_eq!(sim.end().controllers[1]["received"], 0, "the second sent nothing");
}
