//! A chair of three cylinders and a turntable on one controller, which is judged by the virtual controller that it plays to.

use kinocue::wire::FrameNo;

use super::jog::JoggedTo;
use super::process::{Sim, kinocue};
use super::{Folder, nod_part, pulses};

/// The chair at that controller.
fn chair(address: &str) -> String {
    format!(
        "[show]\nbind = \"127.0.0.1:0\"\n[seat.chair]\naxes = 4\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
         max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
         [seat.chair.axis4]\nunit = \"deg\"\nrange = [-180, 180]\npulses_per_rev = 36000\n\
         max_velocity_deg_s = 400\nmax_acceleration_deg_s2 = 4000\nmax_jerk_deg_s3 = 200000\n\
         [[controller]]\nname = \"C1\"\nseat = \"chair\"\naddress = \"{address}\"\n"
    )
}

/// Up by 15 mm and round to `turn_deg`, and back.
fn cue(folder: &Folder, from_deg: f64, turn_deg: f64) -> std::path::PathBuf {
    let mut text = "# units: mm, mm, mm, deg\ntime_ms,a1,a2,a3,a4\n".to_owned();
    for at_ms in (0..=800).step_by(10) {
        let part = nod_part(at_ms);
        let (up, turned) = (15.0 * part, from_deg + (turn_deg - from_deg) * part);
        text += &format!("{at_ms},{up:.6},{up:.6},{up:.6},{turned:.6}\n");
    }
    folder.write("turn.csv", text)
}

fn sim() -> Sim {
    Sim::one(&["--axes", "4", "--pa", "03=4"])
}

#[test]
fn a_chair_with_a_turntable_goes_up_and_round_to_either_side_and_rests_where_its_zero_is() {
    for turn_deg in [30.0, -30.0] {
        let (folder, sim) = (Folder::new(), sim());
        let config = folder.write("hall.toml", chair(&sim.addresses[0]));
        let cue = cue(&folder, 0.0, turn_deg);
        let [cue, config] = [&cue, &config].map(|path| path.to_str().expect("text"));
        let report = kinocue(&["play", cue, "--config", config, "--json"]).report_of(0);
        assert_eq!(report["controllers"][0]["park_frames"], 0, "it was read, and stood at park");
        let seen = sim.end();
        assert_eq!(seen.farthest(0), pulses(0.1));
        let turned = seen.rows.iter().map(|row| row.executed[3]).max_by_key(|pulses| pulses.abs());
        let most = if turn_deg > 0.0 { 3_000 } else { -3_000 };
        assert_eq!(turned, Some(most), "100 pulses a degree, to the side that the cue says");
        assert!(seen.rest_in_park(), "{:?}", seen.controllers);
    }
}

/// The number of frames that are nobody's show.
const JOGGED: FrameNo = FrameNo(900_000_000);

/// Has the turntable of that controller turn there, as somebody does who jogs it.
fn turn_to(address: &str, turned: i32) {
    let positions = &[0, 0, 0, turned, 0, 0];
    JoggedTo { channel: 1, frame: JOGGED, positions, axis: 3, register: 0x21 }.to(address);
}

#[test]
fn a_turntable_is_led_to_park_from_where_it_is_read_and_not_from_an_end_of_its_range() {
    let (folder, sim) = (Folder::new(), sim());
    let config = folder.write("hall.toml", chair(&sim.addresses[0]));
    let cue = cue(&folder, 0.0, 0.0);
    let [cue, config] = [&cue, &config].map(|path| path.to_str().expect("text"));
    for turned in [-800, 500] {
        turn_to(&sim.addresses[0], turned);
        kinocue(&["play", cue, "--config", config, "--json"]).report_of(0);
    }
    let seen = sim.end();
    let shows: Vec<Vec<i32>> = (seen.rows.split(|row| row.frame == JOGGED.0).skip(1))
        .map(|show| show.iter().map(|row| row.commanded[3]).collect())
        .collect();
    assert_eq!(shows.len(), 2);
    for (show, turned) in shows.iter().zip([-800_i32, 500]) {
        let led: Vec<i32> = [turned].iter().chain(show).copied().collect();
        let (least, most) = (turned.min(0), turned.max(0));
        assert!(led.iter().all(|at| (least..=most).contains(at)), "no farther than that: {led:?}");
        let leap = led.windows(2).map(|pair| pair[0].abs_diff(pair[1])).max();
        // 10 degrees a second are 10 pulses in a frame of 10 ms, the last frame of a Time and rounding left aside.
        assert!(leap.is_some_and(|leap| leap <= 21), "{leap:?}");
        assert_eq!(led.last(), Some(&0));
    }
}

#[test]
fn a_turntable_that_nobody_asked_where_it_is_is_sent_nothing() {
    let (folder, sim) = (Folder::new(), sim());
    let config = folder.write("hall.toml", chair(&sim.addresses[0]));
    let cue = cue(&folder, 0.0, 30.0);
    let [cue, config] = [&cue, &config].map(|path| path.to_str().expect("text"));
    let run = kinocue(&["play", cue, "--config", config, "--no-acks"]);
    assert_eq!(run.code, Some(75), "{run:?}");
    assert!(run.stderr.contains("C1: has a rotary axis, and does not report"), "{}", run.stderr);
    assert_eq!(sim.end().motion(), 0);
}

#[test]
fn a_cue_in_millimetres_is_no_cue_for_a_turntable() {
    let folder = Folder::new();
    let config = folder.write("hall.toml", chair("127.0.0.1:9"));
    let rows = "# units: mm\ntime_ms,a1,a2,a3,a4\n0,0,0,0,0\n1000,0,0,0,0\n";
    let cue = folder.write("mm.csv", rows);
    let [cue, config] = [&cue, &config].map(|path| path.to_str().expect("text"));
    for command in ["check", "play"] {
        let run = kinocue(&[command, cue, "--config", config]);
        let told = format!("{}{}", run.stdout, run.stderr);
        assert_eq!(run.code, Some(65), "{run:?}");
        assert!(told.contains("3:9: a4: is in mm, and this axis of seat chair is measured in deg"), "{told}");
    }
}
