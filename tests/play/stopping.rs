//! Ctrl-C and SIGTERM: where the seats are then, and what is said.

use rustix::process::Signal;
use serde_json::Value;

use super::process::{Playing, Relay, Run, Sim, play};
use super::{Folder, NOD_TOP, pulses};

/// The frame that a nod's controllers get when they stand at its heights.
const AT_TOP: u32 = NOD_TOP.start / 10 + 2;

/// Plays a nod and signals at its top: the report, and the simulator.
fn stopped_by(signals: &[Signal], more: &[&str]) -> (Run, Sim) {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let relay = Relay::start(&sim.addresses[0]);
    let cue = folder.nod_with(&[0.15, 0.1], ",fx_air", |_| ",1".to_owned());
    let mut args = vec!["--json"];
    args.extend(more);
    let playing = Playing::start(&cue, &[relay.to()], &args);
    for (signal, frame) in signals.iter().zip(AT_TOP..) {
        relay.wait_for(|seen| seen.frame.0 == frame);
        playing.signal(*signal);
    }
    (playing.finish(), sim)
}

#[test]
fn ctrl_c_and_sigterm_park_the_seats_turn_effects_off_and_report_a_stop() {
    std::thread::scope(|scope| {
        for signal in [Signal::INT, Signal::TERM] {
            scope.spawn(move || {
                let (run, sim) = stopped_by(&[signal], &[]);
                let report = run.report_of(0);
                let one = &report["controllers"][0];
                assert_eq!(report["result"], "stopped");
                for line in [
                    "playing: the seats that take part are on the cue; next: nothing; pause, park or stop as needed",
                    "parking: parked by the operator; next: wait until the seats are at rest",
                    "parked: the seats that take part have parked",
                ] {
                    let line = format!("kinocue: {line}\n");
                    assert_eq!(run.stderr.matches(&line).count(), 1, "{line}: {}", run.stderr);
                }
                assert_eq!((&one["acked"], &one["park_frames"]), (&one["sent"], &0.into()), "{one}");
                let seen = sim.end();
                assert!(seen.rest_in_park(), "{:?}", seen.controllers);
                assert_eq!(seen.farthest(0), pulses(0.15), "it was at its top");
                let last = &seen.rows[seen.rows.len() - 4..];
                assert!(last.iter().all(|row| row.commanded.iter().all(|pulses| *pulses == 0)), "{last:?}");
                assert!(last[1..].iter().all(|row| row.outputs == 0), "{last:?}");
            });
        }
    });
}

#[test]
fn a_second_sigterm_changes_nothing() {
    let (run, sim) = stopped_by(&[Signal::TERM, Signal::TERM], &[]);
    assert_eq!(run.report_of(0)["result"], "stopped");
    assert!(sim.end().rest_in_park());
}

#[test]
fn a_second_ctrl_c_ends_at_once_and_the_next_play_parks_the_seat_that_was_left_before_it_goes() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let relay = Relay::start(&sim.addresses[0]);
    // From the middle of the stroke the way to park takes a second and a half.
    let mut playing = Playing::start(&folder.wave(9), &[relay.to()], &["--json"]);
    relay.wait_for(|frame| frame.frame.0 == 200);
    playing.signal(Signal::INT);
    // Twice within an instant is one press that came by two ways.
    playing.signal(Signal::INT);
    playing.wait_for("Ctrl-C again, half a second from now or later, ends it at once");
    playing.wait_for("Ctrl-C again ends at once");
    playing.signal(Signal::INT);
    let run = playing.finish();
    assert_eq!((run.code, run.stdout.as_str()), (Some(130), ""), "{run:?}");
    let report = play(&folder.nod(&[0.1, 0.1]), &sim.to(), &["--json", "--time", "absolute"]).report_of(0);
    let one = &report["controllers"][0];
    assert_eq!((&one["park_frames"], &one["acked"]), (&0.into(), &one["sent"]), "{one}");
    let seen = sim.end();
    let home = seen.rows.iter().rposition(|row| row.frame == 1).expect("two plays");
    let first = &seen.rows[home];
    assert!(first.executed[0] > pulses(0.02), "it was left in the air: {first:?}");
    let apart = first.commanded.iter().zip(&first.executed).map(|(to, at)| to.abs_diff(*at));
    assert!(apart.max() < Some(100), "it goes on from there: {first:?}");
    let rows = &seen.rows[home..];
    let parked = rows.iter().position(|row| row.commanded == [0; 3]).expect("it parks");
    assert!(
        rows[..=parked].windows(2).all(|pair| pair[1].commanded[0] <= pair[0].commanded[0]),
        "downwards, and nowhere else"
    );
    assert!(rows[parked..].iter().any(|row| row.commanded[0] > pulses(0.05)), "the cue comes after that");
    assert!(seen.rest_in_park());
}

#[test]
fn a_stop_while_the_seats_are_brought_home_ends_without_playing() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let relay = Relay::start(&sim.addresses[0]);
    let playing = Playing::start(&folder.nod(&[0.15]), &[relay.to()], &["--json", "--no-acks"]);
    relay.wait_for(|frame| frame.time_ms == 3000);
    playing.signal(Signal::INT);
    let report = playing.finish().report_of(0);
    assert_eq!(
        (&report["result"], &report["controllers"][0]["park_frames"]),
        (&"stopped".into(), &Value::from(1))
    );
    assert_eq!(report["ticks"], 0);
    assert_eq!(sim.end().motion(), 1, "nothing follows the slow frame");
}

#[test]
fn an_endless_loop_plays_until_it_is_stopped() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let relay = Relay::start(&sim.addresses[0]);
    let playing = Playing::start(&folder.nod(&[0.15]), &[relay.to()], &["--json", "--loop", "0"]);
    relay.wait_for(|frame| frame.frame.0 == 200);
    playing.signal(Signal::INT);
    assert_eq!(playing.finish().report_of(0)["result"], "stopped");
    assert!(sim.end().rest_in_park());
}
