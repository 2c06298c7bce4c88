//! What the controllers get: fan-out, time, function codes, vibration and outputs, in the simulators' logs.

use serde_json::Value;

use super::process::{Playing, Relay, Row, Seen, Sim, play};
use super::{Folder, NOD_MS, NOD_TOP, STROKE, pulses, undisturbed};

fn functions(seen: &Seen) -> Vec<&str> {
    let mut all: Vec<&str> = seen.rows.iter().map(|row| row.function.as_str()).collect();
    all.dedup();
    all
}

fn assert_all_acked(report: &Value) {
    for one in report["controllers"].as_array().expect("a list") {
        assert_eq!(one["acked"], one["sent"], "{one}");
    }
}

#[test]
fn a_pair_that_shares_a_frame_executes_each_its_own_window() {
    let folder = Folder::new();
    let left = Sim::one(&["--axes", "2"]);
    let right = Sim::one(&["--axes", "1", "--pa", "95=2"]);
    let to = [
        format!("{},axes=2,fan_out=shared", left.addresses[0]),
        format!("{},axes=1,offset=2,fan_out=shared", right.addresses[0]),
    ];
    assert_all_acked(&play(&folder.nod(&[0.1, 0.05, 0.02]), &to, &["--json"]).report_of(0));
    let (left, right) = (left.end(), right.end());
    for seen in [&left, &right] {
        assert!(seen.rest_in_park());
        let top = seen.rows.iter().map(|row| &row.commanded).max().expect("frames came");
        assert_eq!(*top, [pulses(0.1), pulses(0.05), pulses(0.02)], "both get the whole frame");
    }
    assert_eq!((left.farthest(0), left.farthest(1)), (pulses(0.1), pulses(0.05)));
    assert_eq!((right.farthest(0), right.rows[0].executed.len()), (pulses(0.02), 1));
}

#[test]
fn a_slice_carries_its_own_axes_and_padding_rests_in_park() {
    let (folder, sim) = (Folder::new(), Sim::start(2, &[]));
    let to = [format!("{},axes=2", sim.addresses[0]), format!("{},axes=2,offset=2", sim.addresses[1])];
    assert_all_acked(&play(&folder.nod(&[0.1, 0.05, 0.02]), &to, &["--json"]).report_of(0));
    let seen = sim.end();
    for (address, wanted) in sim_tops(&to).zip([[0.1, 0.05, 0.0], [0.02, 0.0, 0.0]]) {
        let rows = seen.rows.iter().filter(|row| row.controller == address);
        let top = rows.map(|row| &row.commanded).max().expect("frames came");
        assert_eq!(*top, wanted.map(pulses));
    }
    assert!(seen.rest_in_park());
}

fn sim_tops(to: &[String]) -> impl Iterator<Item = String> {
    to.iter().map(|to| to.split(',').next().expect("the address").to_owned())
}

#[test]
fn ten_and_twelve_axes_go_in_one_frame_each_to_seats_that_are_homed_first() {
    let folder = Folder::new();
    let heights: Vec<f64> = (1..=12).map(|axis| 0.01 * f64::from(axis)).collect();
    let cue = folder.nod(&heights);
    let (ten, twelve) = (Sim::one(&["--axes", "10"]), Sim::one(&["--axes", "12"]));
    let to = [format!("{},axes=10", ten.addresses[0]), twelve.addresses[0].clone()];
    let report = play(&cue, &to, &["--json"]).report_of(0);
    assert_all_acked(&report);
    for (seen, axes) in [(ten.end(), 10), (twelve.end(), 12)] {
        assert!(seen.rest_in_park());
        for (axis, height) in heights.iter().enumerate().take(axes) {
            assert_eq!(seen.farthest(axis), pulses(*height), "axis {axis} of {axes}: {report}");
        }
        assert_eq!(seen.rows[0].commanded.len(), axes);
        assert_eq!(seen.rows[0].time_ms, 3000, "axes past the sixth cannot tell where they are");
    }
    assert_eq!(report["controllers"][0]["park_frames"], 1);
}

#[test]
fn a_seat_that_is_led_to_where_either_order_of_words_is_inside_its_stroke_plays_on() {
    // One pulse, or 65,536 of 300,000.
    let (folder, sim) = (Folder::new(), Sim::one(&["--axes", "1"]));
    let cue = folder.nod(&[1.0 / STROKE]);
    let report = play(&cue, &sim.to(), &["--json"]).report_of(0);
    assert_all_acked(&report);
    assert!(!report["events"].to_string().contains("lost"), "{}", report["events"]);
    let seen = sim.end();
    assert_eq!(seen.farthest(0), 1);
    assert!(seen.rest_in_park());
}

#[test]
fn absolute_time_goes_on_by_one_period_from_frame_to_frame() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let args = ["--json", "--time", "absolute"];
    assert_all_acked(&play(&folder.nod(&[0.1]), &sim.to(), &args).report_of(0));
    let seen = sim.end();
    // The last frame is relative: whoever plays next begins a new sum.
    assert_eq!(functions(&seen), ["0x1301", "0x1401"]);
    let (last, before) = seen.rows.split_last().expect("frames came");
    for (row, k) in before.iter().zip(1..) {
        assert_eq!((row.frame, row.time_ms), (k, 10 * k));
    }
    assert_eq!((last.function.as_str(), last.time_ms), ("0x1401", 10));
    assert_eq!(seen.farthest(0), pulses(0.1));
    assert_eq!(seen.controllers[0]["executed"], seen.controllers[0]["motion"]);
}

#[test]
fn a_controller_whose_port_out_takes_four_bytes_with_vibration_shakes_and_switches() {
    let folder = Folder::new();
    let row = |at_ms: u32| format!("{at_ms},0.1{}\n", if at_ms < 2_200 { ",0,0,0" } else { ",20,0.003,1" });
    let rows: String = (0..=2_400).step_by(10).map(row).collect();
    let cue = folder.write("shake.csv", format!("time_ms,a1,v1_hz,v1_amp,fx_air\n{rows}"));
    let sim = Sim::one(&["--vibration-port-octets", "4"]);
    let to = [format!("{},vibration_port_octets=4", sim.addresses[0])];
    assert_all_acked(&play(&cue, &to, &["--json"]).report_of(0));
    let seen = sim.end();
    assert_eq!(functions(&seen), ["0x1901"]);
    assert!(seen.rows.iter().any(|row| row.outputs == 1), "Y01 is air");
    assert!(seen.rows.iter().all(|row| row.outputs <= 1), "and nothing else was on");
    assert!(seen.rest_in_park());
}

#[test]
fn vibration_goes_in_frames_of_its_own_kind_and_is_still_at_the_end() {
    let folder = Folder::new();
    // The seat stands at a tenth of its stroke, and in the last fifth of a second the first axis shakes.
    let row = |at_ms: u32| format!("{at_ms},0.1,0.1{}\n", if at_ms < 2_200 { ",0,0" } else { ",20,0.003" });
    let rows: String = (0..=2_400).step_by(10).map(row).collect();
    let cue = folder.write("shake.csv", format!("time_ms,a1,a2,v1_hz,v1_amp\n{rows}"));
    let sim = Sim::one(&[]);
    let relay = Relay::start(&sim.addresses[0]);
    let playing = Playing::start(&cue, &[relay.to()], &["--json"]);
    let shakes = |frame: u32| {
        let mut shaken = false;
        relay.wait_for(|seen| {
            let first = seen.vibration.as_ref().map(|all| all[0]).expect("each frame has room for it");
            shaken = first.period != 0;
            assert!(!shaken || (first.period, first.amplitude) == (400, 900), "{first:?}");
            seen.frame.0 == frame
        });
        shaken
    };
    assert!(!shakes(218));
    assert!(shakes(223));
    assert!(shakes(238));
    assert!(!shakes(242), "parking frames are still");
    assert_all_acked(&playing.finish().report_of(0));
    let seen = sim.end();
    assert_eq!(functions(&seen), ["0x1901"]);
    let sim = Sim::one(&[]);
    assert_all_acked(&play(&cue, &sim.to(), &["--json", "--time", "absolute"]).report_of(0));
    assert_eq!(functions(&sim.end()), ["0x1801", "0x1901"]);
}

#[test]
fn effects_are_outputs_while_the_cue_lasts_and_off_at_the_end() {
    let folder = Folder::new();
    let cells = |at_ms| format!(",{},1", u8::from((300..500).contains(&at_ms)));
    let cue = folder.nod_with(&[0.1], ",fx_wind,fx_leg", cells);
    let sim = Sim::one(&[]);
    play(&cue, &sim.to(), &["--json"]).report_of(0);
    let seen = sim.end();
    // Wind is Y03 and leg is Y04; effects act when their frame comes.
    for (frames, outputs) in [(1..=28, 8), (33..=48, 8 | 4), (53..=NOD_MS / 10 - 2, 8)] {
        for row in seen.rows.iter().filter(|row| frames.contains(&row.frame)) {
            assert_eq!(row.outputs, outputs, "frame {}", row.frame);
        }
    }
    assert!(seen.rows[seen.rows.len() - 3..].iter().all(|row| row.outputs == 0));
    assert!(seen.rest_in_park());
}

#[test]
fn analogue_outputs_are_set_while_the_cue_lasts_and_off_at_the_end_with_either_dialect() {
    let folder = Folder::new();
    let cells = |at_ms| format!(",{},1", if (300..500).contains(&at_ms) { 0.5 } else { 0.0 });
    let cue = folder.nod_with(&[0.1], ",dac1,dac2", cells);
    for dialect in ["smc", "mbox"] {
        let sim = Sim::one(&["--dialect", dialect]);
        let to = sim.to().iter().map(|to| format!("{to},dialect={dialect}")).collect::<Vec<_>>();
        play(&cue, &to, &["--json"]).report_of(0);
        let seen = sim.end();
        for (frames, extend) in [(3..=28, 0xffff), (33..=48, 0x8000_ffff), (53..=NOD_MS / 10 - 2, 0xffff)] {
            for row in seen.rows.iter().filter(|row| frames.contains(&row.frame)) {
                assert_eq!(row.extend, extend, "frame {} of {dialect}", row.frame);
            }
        }
        assert!(seen.rows[seen.rows.len() - 3..].iter().all(|row| row.extend == 0));
        assert!(seen.rest_in_park());
    }
}

/// Plays a nod at this rate: every frame's number, its Time and what the first axis is told.
fn at_rate(rate: &str) -> Vec<Row> {
    let (report, seen) = undisturbed(|| {
        let (folder, sim) = (Folder::new(), Sim::one(&[]));
        let report = play(&folder.nod(&[0.1]), &sim.to(), &["--json", "--rate", rate]).report_of(0);
        ((report.clone(), sim.end()), vec![report])
    });
    assert_all_acked(&report);
    assert_eq!(report["rate_hz"].as_f64(), rate.parse().ok());
    assert!(seen.rest_in_park());
    seen.rows
}

#[test]
fn times_sum_up_to_the_grid_and_each_pose_is_the_cues_at_that_sum() {
    // One after the other: a machine that is held up for 50 ms by the others makes a gap of its own.
    for (rate, times) in
        [("1000", 1..=1), ("600", 1..=2), ("59.94", 16..=17), ("30", 33..=34), ("10", 100..=100)]
    {
        let period_ms = 1000.0 / rate.parse::<f64>().expect("a number");
        let mut sum = 0;
        for row in at_rate(rate) {
            assert!(times.contains(&row.time_ms), "{rate} Hz: {row:?}");
            sum += row.time_ms;
            let grid = f64::from(row.frame) * period_ms;
            assert!((f64::from(sum) - grid).abs() <= 1.0, "{rate} Hz: {sum} against {grid}");
            let at_top = (NOD_TOP.start..NOD_TOP.end - 20).contains(&sum);
            assert!(!at_top || row.commanded[0] == pulses(0.1), "{rate} Hz: {row:?}");
        }
    }
}

#[test]
fn levels_scale_the_motion_and_loops_play_again_without_parking_in_between() {
    let folder = Folder::new();
    let cue = folder.nod(&[0.15, 0.1]);
    let (half, twice) = (Sim::one(&[]), Sim::one(&[]));
    let scaled = Playing::start(&cue, &half.to(), &["--json", "--level", "50%"]);
    let looped = play(&cue, &twice.to(), &["--json", "--loop", "2"]).report_of(0);
    assert_all_acked(&scaled.finish().report_of(0));
    assert_all_acked(&looped);
    let half = half.end();
    assert_eq!((half.farthest(0), half.farthest(1)), (pulses(0.075), pulses(0.05)));
    let seen = twice.end();
    let tops = seen.rows.windows(2).filter(|pair| {
        let [before, now] = [&pair[0], &pair[1]].map(|row| row.commanded[0] == pulses(0.15));
        now && !before
    });
    assert_eq!(tops.count(), 2, "two plays");
    assert!(seen.rest_in_park());
}
