//! `kinocue play` as a real process, to virtual seats on real sockets.

use std::thread;

use super::cues::{KINDS, swing};
use super::ether::Weather;
use super::hall::{breaches, seats};
use super::judge::PULSES_PER_MM;
use super::process::Playing;
use super::seat::Settings;
use super::town::Town;

/// Plays a cue of three axes to seats that stand at those heights of their first axis, mm, and gives how it ended.
fn play(heights: &[f64], set: impl Fn(&mut Settings), weather: impl Fn(&Town)) -> (Town, Option<i32>) {
    let mut settings: Vec<Settings> = heights.iter().flat_map(|_| seats(&KINDS[0])).collect();
    for (index, seat) in settings.iter_mut().enumerate() {
        seat.address.0[3] = index as u8 + 1;
        set(seat);
    }
    let town = Town::open(&settings, 1);
    for (line, mm) in town.ether.world().lines.iter_mut().zip(heights) {
        line.seat.put(0, *mm);
    }
    weather(&town);
    let folder = tempfile::tempdir().expect("a folder");
    let cue = folder.path().join("ride.csv");
    let short: Vec<String> = swing(3, 0.5, 20.0, 60.0).lines().take(120).map(str::to_owned).collect();
    std::fs::write(&cue, short.join("\n")).expect("the folder is ours");
    let to: Vec<String> = town.addresses.iter().map(|address| format!("{address},axes=3")).collect();
    let code = Playing::start(&cue, &to, &["--rate", "100"]).finish().code;
    (town, code)
}

#[track_caller]
fn assert_no_breach(town: &Town, code: Option<i32>) {
    let found: Vec<String> = breaches(&town.ether).iter().map(ToString::to_string).collect();
    assert!(found.is_empty(), "exit {code:?}, moves that no seat may make: {found:#?}");
}

/// Where the first axis of a seat stands, mm.
fn height(town: &Town, seat: usize) -> f64 {
    town.ether.world().lines[seat].seat.place(town.ether.ns())[0] / PULSES_PER_MM
}

// D7: the one slow frame to park.

#[test]
fn a_play_whose_slow_frame_to_park_is_lost_does_not_begin_as_if_the_seat_were_there() {
    let lost = |town: &Town| town.ether.turns(0, Weather::Slow(200), 60_000);
    let (town, code) = play(&[100.0], |_| {}, lost);
    assert_no_breach(&town, code);
    assert!(code != Some(0) || height(&town, 0).abs() < 0.5, "exit {code:?} at {} mm", height(&town, 0));
}

#[test]
fn nor_does_one_to_two_seats_of_which_one_was_cut_off_while_it_was_to_park() {
    let cut = |town: &Town| town.ether.turns(1, Weather::Slow(200), 60_000);
    let (town, code) = play(&[0.0, 60.0], |_| {}, cut);
    assert_no_breach(&town, code);
}

#[test]
fn nor_does_one_whose_seat_answers_everything_but_where_it_is() {
    let lost = |town: &Town| town.ether.turns(0, Weather::Slow(200), 60_000);
    let (town, code) = play(&[100.0], |seat| seat.shy = true, lost);
    assert_no_breach(&town, code);
    assert_eq!(code, Some(75), "at {} mm", height(&town, 0));
}

#[test]
fn a_play_that_leaves_a_seat_where_nobody_knows_does_not_end_as_if_it_were_at_park() {
    let cut_off = |town: &Town| {
        let ether = town.ether.clone();
        thread::spawn(move || {
            // The one slow frame, and some of the ride.
            while ether.world().lines[0].frames < 60 {
                thread::yield_now();
            }
            ether.turns(0, Weather::Cut, 120);
        });
    };
    let (town, code) = play(&[0.0], |seat| seat.shy = true, cut_off);
    assert_no_breach(&town, code);
    // Lost, since it does not tell where it is; or left somewhere, if it was not lost yet.
    assert!(matches!(code, Some(69 | 75)), "exit {code:?} at {} mm", height(&town, 0));
}

// D14: a controller that cuts what takes long.

#[test]
fn a_controller_that_cuts_a_long_time_is_not_sent_to_park_faster_than_its_type_allows() {
    let (town, code) = play(&[150.0], |seat| seat.cut_ms = 500, |_| {});
    assert_no_breach(&town, code);
}

#[test]
fn nor_is_one_that_cuts_it_to_a_tenth_of_a_second() {
    let (town, code) = play(&[40.0], |seat| seat.cut_ms = 100, |_| {});
    assert_no_breach(&town, code);
}
