//! Plays over bad lines, and to units in trouble.

use super::bench::*;
use super::play::*;
use std::cell::Cell;
use std::time::Duration;

use crate::drive::link::*;
use crate::drive::sixpack2::{HomeError, Homing, SeatMotors, home};
use crate::motion::SeatType;
use crate::sim::serial::LineFaults;
use crate::sim::sixpack2::SixpackFault;
use crate::wire::sixpack2::{ReferenceSearch, SixpackOrder, action};

fn riding(seconds: f64) -> Play {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.begin(ride);
    play.play(seconds, 0);
    play.judged = false;
    play
}

#[test]
fn a_stop_is_in_the_very_next_slice_and_ends_at_rest_within_the_limits() {
    let mut play = riding(10.0);
    let sent = play.stream.talk.port().sent.len();
    play.stream.stop().unwrap();
    let speed = play.speed();
    play.wait(0.03);
    // A question may be asked before it.
    let next = play.stream.talk.port().sent[sent..].iter().find(|(_, octets)| octets[1] == 0x24);
    assert_eq!(next.map(|(_, octets)| octets.len()), Some(27));
    play.wait(0.1);
    assert!(speed > 20.0 && play.speed() < speed, "{speed} {}", play.speed());
    play.wait(1.0);
    assert!(play.speed() == 0.0 && play.stream.is_ready(0) && play.has("Stopped"), "{:?}", play.rare());
    play.assert_gentle();
}

#[test]
fn unplugged_in_mid_course_it_is_at_rest_inside_its_stroke_and_comes_back_where_it_stands() {
    let mut play = riding(10.0);
    play.line().faults.unplugged = true;
    play.play(1.5, 0);
    let rest = play.places();
    play.play(1.0, 0);
    assert_eq!(play.places(), rest);
    assert!(play.has("Lost") && rest.iter().all(|place| (0.0..=150.0).contains(place)), "{rest:?}");
    play.line().faults.unplugged = false;
    play.wait(1.5);
    assert!(play.has("Back") && play.stream.is_ready(0), "{:?}", play.rare());
    assert_eq!(play.places(), rest);
    play.assert_gentle();
}

#[test]
fn where_only_its_answers_are_lost_a_seat_comes_to_rest_all_the_same() {
    for phase in 0..8 {
        let mut play = riding(8.0 + 0.173 * f64::from(phase));
        play.bus_mut().forget();
        play.line().faults.answer_lost = 1.0;
        play.play(2.0, 0);
        assert!(play.has("Lost") && play.speed() == 0.0, "{:?}", play.rare());
        play.assert_inside();
        // What its acceleration makes in a slice that waited for an answer in vain, and the whole units of speed.
        let motors = play.bus().units()[0].motors[..3].iter();
        let jump = motors.map(|motor| motor.shaft.executed().jump / MM).fold(0.0, f64::max);
        assert!(jump <= 3_000.0 * (PERIOD.as_secs_f64() + 0.009) + 3.5, "{phase}: {jump} mm/s at once");
    }
}

#[test]
fn a_port_that_is_gone_is_an_error_and_all_lanes_are_lost() {
    let mut play = riding(2.0);
    play.stream.talk.port().is_gone = true;
    let rounds: Vec<_> = (0..50).map(|_| play.stream.round()).collect();
    play.hear();
    assert!(rounds.contains(&Err(LinkFault)) && play.has("Lost"), "{:?}", play.rare());
}

#[test]
fn a_unit_that_restarted_is_told_and_stands_until_it_is_homed_again() {
    let mut play = riding(10.0);
    let now = play.now();
    play.line().bus_mut().suffer(None, SixpackFault::Reset, now);
    let rest = play.places();
    play.play(2.0, 0);
    assert!(play.has("Lost") && play.has("Restarted"), "{:?}", play.rare());
    assert_eq!(play.places(), rest, "it heard nothing that it could follow");
    assert!(!play.stream.is_ready(0));
    let homed = home_as(&mut play.stream.talk, &drive(SWITCH), &[0, 1, 2]).0;
    assert_eq!(homed, Ok(()));
    play.stream.rejoin(0);
    play.wait(1.0);
    assert!(play.stream.is_ready(0), "{:?}", play.rare());
}

#[test]
fn at_the_rate_of_a_unit_that_restarted_nothing_is_played() {
    let talk = talk_at(&[unit_with(1, shaft())], 19_231);
    let refused = Play::to(talk, 1).map(|_| ()).unwrap_err().to_string();
    assert!(refused.starts_with("19231 baud is the rate of a restarted unit"), "{refused}");
}

#[test]
fn a_seat_that_is_not_home_is_told_so_at_each_look_and_never_led() {
    let talk = talk_to(&[unit_with(1, shaft())]);
    let mut play = Play::to(talk, 1).unwrap();
    // As it woke: told by its flag, which is gone then; and by its counters.
    for look in 0..2 {
        play.stream.look(0);
        (0..500).for_each(|_| play.stream.round().unwrap());
        let told = std::iter::from_fn(|| play.events.pop().ok()).map(|event| format!("{event:?}"));
        let told: Vec<_> = told.filter(|event| !event.starts_with("Read")).collect();
        assert_eq!(told, ["Homed { lane: 0, homed: false }"], "{look}");
    }
    let sent = play.stream.talk.port().sent.clone();
    assert!(!play.stream.is_ready(0) && sent.iter().all(|(_, octets)| octets[1] != 0x24), "{sent:?}");
}

#[test]
fn a_motor_that_searches_by_a_damaged_question_is_ended_and_out() {
    let mut play = riding(10.0);
    let search = SixpackOrder::Search(ReferenceSearch { motor: 1 });
    // Not amidst the frames of a slice.
    let does = |play: &mut Play| play.bus().units()[0].motors[1].action();
    while does(&mut play) < action::SEARCH {
        let now = play.now();
        play.line().send_break(now);
        play.line().send(&search.frame(1).octets(), now);
        play.play(0.01, 0);
    }
    // Each of three motors has its turn by then, and this one a second.
    play.play(0.3, 0);
    let action = does(&mut play);
    assert!(play.has("OffCourse { lane: 0, axis: 1") && action == action::IDLE, "{action} {:?}", play.rare());
}

#[test]
fn octets_that_are_damaged_lead_no_axis_out_of_its_stroke() {
    for (index, faults) in [
        LineFaults { lost: 0.000_5, ..LineFaults::default() },
        LineFaults { doubled: 0.000_5, ..LineFaults::default() },
        LineFaults { flipped: 0.000_5, ..LineFaults::default() },
        LineFaults { answer_lost: 0.02, ..LineFaults::default() },
    ]
    .into_iter()
    .enumerate()
    {
        let mut play = Play::homed(&[wired(1, false)], BAUD);
        play.begin(ride);
        play.play(6.0, 0);
        play.judged = false;
        play.line().faults = faults;
        play.bus_mut().forget();
        play.play(40.0, 0);
        play.assert_inside();
        // What came twice or flipped may be another order, which sets a counter anew, say: such a seat is out until it is homed.
        if index == 0 || index == 3 {
            // Two answers in a row may be lost.
            let is_loss = |event: &&String| event.starts_with("Lost") || event.starts_with("Back");
            let other = play.rare().into_iter().find(|event| !is_loss(&event));
            assert_eq!(other, None, "{index}");
        }
    }
}

/// The greatest jump of speed after a cut of so long in a ride, mm/s, at one of ten moments, and what was told.
fn jump_after(cut: Duration, phase: u32) -> (f64, Play) {
    let mut play = riding(8.0 + 0.173 * f64::from(phase));
    play.bus_mut().forget();
    play.line().faults.unplugged = true;
    play.play(cut.as_secs_f64(), 0);
    play.line().faults.unplugged = false;
    play.play(1.5, 0);
    play.assert_inside();
    let motors = play.bus().units()[0].motors[..3].iter();
    (motors.map(|motor| motor.shaft.executed().jump / MM).fold(0.0, f64::max), play)
}

#[test]
fn what_was_not_heard_while_a_line_was_cut_is_not_made_up_for_at_once() {
    for ms in [60, 100, 240, 400] {
        for phase in [0, 3, 6] {
            let (jump, play) = jump_after(Duration::from_millis(ms), phase);
            assert!(
                jump <= 32.0 && play.has("Lost") && play.has("Back"),
                "{ms} ms: {jump} mm/s {:?}",
                play.rare()
            );
        }
    }
}

/// Nobody knows that it did not hear them, before two questions were not answered: it makes up for all of it at once.
#[expect(clippy::print_stdout, reason = "the figures are for who asks to see them")]
#[test]
fn after_a_cut_that_nobody_notices_a_motor_jumps_by_no_more_than_its_speed_over_its_lag_for_as_long() {
    // 25 units of the distance: 81.9 ms; whole units of speed and the loop of its unit beside.
    let (lag, fastest) = (0.081_9, 195.0);
    for ms in [10, 25, 40, 50, 60, 70] {
        let jumps = [0, 4].map(|phase| jump_after(Duration::from_millis(ms), phase));
        let most = jumps.iter().map(|(jump, _)| *jump).fold(0.0, f64::max);
        let lost = jumps.iter().filter(|(_, play)| play.has("Lost")).count();
        println!("{ms} ms: {most:.0} mm/s, {lost} of 2 lost");
        let bound = fastest * (ms as f64 * 1e-3 + PERIOD.as_secs_f64()) / lag + 5.0;
        assert!(most <= bound.max(32.0), "{ms} ms: {most} of {bound}");
    }
}

#[test]
fn what_a_seat_was_not_told_while_its_thread_was_held_up_is_not_made_up_for_at_once() {
    for ms in [60, 100, 400, 1_000] {
        for phase in [0, 3, 6] {
            let mut play = riding(8.0 + 0.173 * f64::from(phase));
            play.bus_mut().forget();
            let until = play.now() + Duration::from_millis(ms);
            play.stream.talk.port().sleep_until(until);
            play.play(3.0, 0);
            let motors = play.bus().units()[0].motors[..3].iter();
            let jump = motors.map(|motor| motor.shaft.executed().jump / MM).fold(0.0, f64::max);
            assert!(jump <= 32.0 && play.has("Dry"), "{ms} ms: {jump} mm/s {:?}", play.rare());
            play.assert_inside();
        }
    }
}

/// The greatest jump of speed in a ride at one of some moments of which the thread, and the ticks with it or not, were held up for so long, mm/s.
fn jump_held_up(us: u64, is_whole: bool) -> f64 {
    let mut play = riding(8.0 + 0.000_037_3 * (us % 40_000) as f64);
    play.bus_mut().forget();
    let until = play.now() + Duration::from_micros(us);
    play.stream.talk.port().sleep_until(until);
    play.play(2.0, if is_whole { (us / 10_000) as u32 } else { 0 });
    play.assert_inside();
    let motors = play.bus().units()[0].motors[..3].iter();
    motors.map(|motor| motor.shaft.executed().jump / MM).fold(0.0, f64::max)
}

/// What the acceleration of its seat makes in a slice, 28.5 mm/s, and the whole units of speed and the loop of its unit, which falls
/// anywhere.
#[expect(clippy::print_stdout, reason = "the figure is for who asks to see it")]
#[test]
fn however_long_its_thread_is_held_up_a_motor_is_asked_for_no_greater_jump_than_its_seat_may() {
    let lengths = (0..20).map(|index| 1_000 + 3_449 * index);
    let jumps = lengths.map(|us| {
        let is_whole = us % 2 == 0;
        (jump_held_up(us, is_whole), us, is_whole)
    });
    let most = jumps.max_by(|one, other| one.0.total_cmp(&other.0));
    println!("{most:?}");
    assert!(most.is_some_and(|(jump, ..)| jump <= 32.0), "mm/s, us, whole program: {most:?}");
}

/// A seat that was ridden to 40, 50 and 60 mm and waits there.
fn away() -> Play {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.begin(there);
    play.play(2.5, 0);
    play.judged = false;
    play.wait(1.0);
    assert!(play.stream.is_ready(0) && play.off([40.0, 50.0, 60.0]) < 0.1, "{:?}", play.rare());
    play
}

/// Has it homed as its thread does, until this step.
fn home_until(play: &mut Play, ends: Option<Step>) -> Result<(), HomeError> {
    let (seat, drive) = (seat(), drive(SWITCH));
    let sixpack2 = drive.sixpack2.clone().unwrap();
    let motors = &[0, 1, 2];
    let of = SeatMotors {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &drive,
        sixpack2: &sixpack2,
        unit: 1,
        motors,
        period: PERIOD,
    };
    let is_over = Cell::new(false);
    let goes_on = || !is_over.get();
    let mut told = |step: Step| is_over.set(is_over.get() || Some(step) == ends);
    let homed = play.stream.home_seat(0, of, Homing { goes_on: &goes_on, told: &mut told });
    play.stream.look(0);
    homed
}

/// The farthest that a motor goes in so many seconds from now on, mm.
fn goes_in(play: &mut Play, seconds: f64) -> f64 {
    play.bus_mut().forget();
    play.wait(seconds);
    let motors = play.bus().units()[0].motors[..3].iter();
    let ways = motors.map(|motor| (motor.shaft.executed().highest - motor.shaft.executed().lowest) / MM);
    ways.fold(0.0, f64::max)
}

#[test]
fn a_seat_that_is_homed_again_away_from_park_stays_at_park() {
    let mut play = away();
    assert_eq!(home_until(&mut play, None), Ok(()));
    let mm = goes_in(&mut play, 3.0);
    assert!(mm < 0.06 && play.off([0.0; 3]) < 0.1, "{mm} mm: it was led back to where it stood");
    assert!(play.stream.is_ready(0), "{:?}", play.rare());
}

#[test]
fn a_seat_whose_homing_is_ended_or_fails_away_from_park_is_not_led_back_to_where_it_stood() {
    for ends in [Some(Step::Searching(0)), Some(Step::Searching(1)), Some(Step::Parking), None] {
        let mut play = away();
        if ends.is_none() {
            suffer(&mut play.stream.talk, SixpackFault::BreakSwitch { motor: 1, is_broken: true });
        }
        let homed = home_until(&mut play, ends);
        assert!(homed.is_err(), "{ends:?}");
        // What a search brakes from.
        let mm = goes_in(&mut play, 3.0);
        assert!(mm < 4.0 && play.speed() == 0.0, "{ends:?} {homed:?}: {mm} mm");
        assert!(play.has("Homed { lane: 0, homed: false }") && !play.stream.is_ready(0), "{:?}", play.rare());
        assert!(
            play.bus().units()[0].motors[..3].iter().all(is_set_up_for_shows),
            "{ends:?}: its stops are slow"
        );
    }
}

#[test]
fn a_seat_of_one_axis_is_looked_for_though_its_slices_take_longer_than_their_period() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let (seat, drive) = (SeatType { axes: 1, ..seat() }, drive(SWITCH));
    let sixpack2 = drive.sixpack2.clone().unwrap();
    // Two orders behind a break take 3.52 ms.
    let period = Duration::from_micros(3_160);
    let of = SeatMotors {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &drive,
        sixpack2: &sixpack2,
        unit: 1,
        motors: &[0],
        period,
    };
    assert_eq!(home(&mut talk, of, Homing { goes_on: &|| true, told: &mut |_| {} }), Ok(()));
    let mut play = Play::over(talk, period, &[of], |_, _| {}).unwrap();
    play.wait(1.0);
    assert!(play.all_ready(), "{:?}", play.rare());
    play.line().faults.answer_lost = 1.0;
    play.wait(2.0);
    assert!(play.has("Lost"), "{:?}", play.rare());
    play.line().faults.answer_lost = 0.0;
    play.wait(2.0);
    assert!(play.has("Back") && play.stream.is_ready(0), "{:?}", play.rare());
}
