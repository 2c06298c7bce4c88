//! Analogue outputs from a cue to the frames of shows in virtual time: as the cue has them while the seats follow it, and off
//! whenever they do not.

#![allow(clippy::unwrap_used, reason = "whatever fails here fails the test")]

use std::io::Cursor;
use std::path::Path;
use std::time::Duration;

use kinocue::cue::{self, Cue, CueFaults, Source};
use kinocue::harness::engine::Mix;
use kinocue::harness::proof::Digest;
use kinocue::harness::rt::Alarm;
use kinocue::harness::state::Transition;
use kinocue::harness::{Event, Played, Virtual, swell};
use kinocue::wire::Analogue;
use proptest::prelude::*;

const HALF: u32 = 0x8000_0000;
const BOTH: u32 = 0x8000_4000;

/// Twenty seconds of motion; the first output at one half throughout, the second at a quarter in the first ten seconds.
fn ride() -> Virtual {
    let motion = swell(1, 20, 60.0, 0.25);
    let mut rows = motion.lines().filter(|line| !line.starts_with('#'));
    let head = rows.next().expect("there is a header");
    let comments: String =
        motion.lines().filter(|line| line.starts_with('#')).map(|line| format!("{line}\n")).collect();
    let rows: Vec<_> = rows.collect();
    let dac2 = |row: usize| if 2 * row < rows.len() { "0.25" } else { "0" };
    let rows: Vec<String> =
        rows.iter().enumerate().map(|(n, row)| format!("{row},0.5,{}", dac2(n))).collect();
    Virtual::new(format!("{comments}{head},dac1,dac2\n{}\n", rows.join("\n")))
}

fn extends(played: &Played, lane: usize) -> Vec<u32> {
    played.lane(lane).map(|frame| frame.request.extend).collect()
}

fn all_off(extends: &[u32]) -> bool {
    !extends.is_empty() && extends.iter().all(|extend| *extend == 0)
}

#[test]
fn frames_carry_what_the_cue_says_and_nothing_once_it_has_ended() {
    let sent = extends(&ride().play(), 0);
    assert!(sent[1..990].iter().all(|extend| *extend == BOTH), "{:x?}", &sent[..5]);
    assert!(sent[1_010..1_990].iter().all(|extend| *extend == HALF));
    assert!(all_off(&sent[2_001..]), "off on the way to park, and there");
}

#[test]
fn a_stop_a_pause_and_a_park_take_them_away_at_once_and_a_pause_gives_them_back() {
    for event in [Event::Stop, Event::Ask(Transition::Pause)] {
        let sent = extends(&ride().with(600, event).with(800, Event::Leave).play(), 0);
        assert_eq!(sent[599], BOTH);
        assert!(all_off(&sent[600..]), "{event:?}");
    }
    let paused = ride().with(600, Event::Ask(Transition::Pause)).with(700, Event::Ask(Transition::Resume));
    let sent = extends(&paused.play(), 0);
    assert!(sent[620..].contains(&BOTH), "on again with the film");
}

#[test]
fn they_are_off_in_a_hold_at_a_lost_seat_and_at_one_that_is_out() {
    let late = extends(&ride().with(400, Event::Late(Duration::from_millis(800))).play(), 0);
    let first_off =
        late.iter().position(|extend| *extend == 0).filter(|at| *at < 900).expect("a hold is sent");
    assert!(
        late[..first_off].iter().skip(1).all(|extend| *extend == BOTH) && late[first_off..].contains(&BOTH)
    );

    let to = ["127.0.0.1:7408", "127.0.0.1:7409"].map(str::to_owned).to_vec();
    let off = Mix { on: false, ..Mix::FULL };
    for event in [Event::Mix(1, off), Event::Alarm(Alarm::Leave(1))] {
        let played = Virtual { to: to.clone(), ..ride() }.with(500, event).play();
        let sent = extends(&played, 1);
        // A seat follows the cue until its way out is planned.
        let out = 500 + sent[500..].iter().take_while(|extend| **extend == BOTH).count();
        assert!(out < 515 && all_off(&sent[out..]), "{event:?}: {out}");
        assert_eq!(extends(&played, 0)[600], BOTH, "the other seat goes on");
    }
}

#[test]
fn an_operator_switches_each_of_them_by_itself() {
    let first_off = Mix { switches: 0b10, ..Mix::FULL };
    let sent =
        extends(&ride().with(300, Event::Mix(0, first_off)).with(400, Event::Mix(0, Mix::FULL)).play(), 0);
    assert_eq!([sent[299], sent[300], sent[399], sent[400]], [BOTH, 0x4000, 0x4000, BOTH]);
    let none = Mix { effects: 0, vibration: 0.0, ..Mix::FULL };
    assert_eq!(
        extends(&ride().with(300, Event::Mix(0, none)).play(), 0)[350],
        BOTH,
        "no effect, and no vibration"
    );
}

fn read(text: &str) -> Result<Cue, CueFaults> {
    cue::read(Path::new("t.csv"), text.as_bytes(), &Source::Native)
}

/// A cue that went through MCAP, and one that went through CSV.
fn again(cue: &Cue) -> [Cue; 2] {
    let (mut mcap, mut csv) = (Cursor::new(Vec::new()), Vec::new());
    cue::write_mcap(cue, &mut mcap).unwrap();
    cue::write_csv(cue, &mut csv).unwrap();
    let mcap = cue::read(Path::new("t.mcap"), mcap.get_ref().as_slice(), &Source::Native).unwrap();
    [mcap, read(std::str::from_utf8(&csv).unwrap()).unwrap()]
}

#[test]
fn what_a_cue_without_them_was_digested_to_it_still_is() {
    let text = "time_ms,a1,v1_hz,v1_amp,fx_air\n0,0.5,20,0.01,1\n10,0.6,20,0.01,0\n";
    let digest = Digest::of(&read(text).unwrap()).to_string();
    assert_eq!(digest, "b009636eeb1cafa92e67a7f399afe671e6f648bb07f465de2e7608112287eaa2");
    let word = Digest::of(&read("# units: mm\ntime_ms,a1,a2,io\n0,5,6,3\n10,7,8,0\n").unwrap()).to_string();
    assert_eq!(word, "476fcbc705c873f5c2026f629141ec33d32326261814ad588931ec71af16341b");
    let with = |dac1| Digest::of(&read(&format!("time_ms,a1,dac1\n0,0.5,{dac1}\n10,0.6,0\n")).unwrap());
    assert_ne!(with("0.5"), with("0.6"));
}

#[test]
fn the_vendors_sample_value_is_refused_in_either_kind_of_file() {
    let [dac1, dac2] = Analogue::of_extend(0x5678_abcd).levels();
    let told = read(&format!("time_ms,a1,dac1,dac2\n0,0,0,0\n10,0,{dac1},{dac2}\n")).unwrap_err().to_string();
    assert!(told.starts_with("t.csv:3:6: dac1: dac1 and dac2 make 0x5678abcd"), "{told}");
    let held = read(&format!("time_ms,a1,dac1,dac2\n0,0,{dac1},0\n10,0,,{dac2}\n")).unwrap_err().to_string();
    assert!(held.starts_with("t.csv:3:6"), "{held}");
}

#[test]
fn a_level_that_is_none_is_refused_with_its_place_and_the_range() {
    for (cell, told) in [
        ("1.01", "t.csv:3:6: dac2: a level of 1.01 is outside 0 to 1"),
        ("-0.1", "t.csv:3:6: dac2: a level of -0.1"),
    ] {
        let fault = read(&format!("time_ms,a1,dac2\n0,0,0\n10,0,{cell}\n")).unwrap_err().to_string();
        assert!(fault.starts_with(told), "{fault}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_level_comes_back_from_mcap_and_csv_and_leaves_in_the_frame_as_it_was_meant(
        levels in prop::collection::vec((0.0..=1.0_f64, 0.0..=1.0_f64), 2..20),
    ) {
        let rows = levels.iter().enumerate().map(|(n, (dac1, dac2))| format!("{},0,{dac1},{dac2}\n", n * 100));
        let text = format!("time_ms,a1,dac1,dac2\n{}", rows.collect::<String>());
        let cue = read(&text).unwrap();
        for again in again(&cue) {
            prop_assert_eq!(again.tracks(), cue.tracks());
            prop_assert_eq!(Digest::of(&again), Digest::of(&cue));
        }
        let played = Virtual::new(text).play();
        let meant: Vec<u32> = levels.iter().map(|(dac1, dac2)| Analogue::from_levels([*dac1, *dac2]).extend()).collect();
        let sent = extends(&played, 0);
        prop_assert!(sent.iter().all(|extend| *extend != 0x5678_abcd && (*extend == 0 || meant.contains(extend))));
        prop_assert!(meant[..meant.len() - 1].iter().all(|extend| sent.contains(extend)));
        prop_assert_eq!(sent.last(), Some(&0));
    }
}
