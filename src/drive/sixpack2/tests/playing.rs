//! Plays over a good line.

use super::bench::*;
use super::play::*;
use std::time::Duration;

use crate::drive::link::*;
use crate::drive::sixpack2::read_every;

#[test]
fn a_ride_is_executed_within_a_fifth_of_a_millimetre_by_axes_that_do_not_wait_for_each_other() {
    for (baud, is_two_wires) in [(BAUD, false), (113_636, false), (BAUD, true)] {
        let mut play = Play::homed(&[wired(1, is_two_wires)], baud);
        play.begin(ride);
        play.play(30.0, 0);
        assert!(play.worst.iter().all(|worst| *worst <= 0.2), "{baud} {is_two_wires}: {:?}", play.worst);
        let figures = [0, 1, 2].map(|axis| play.stream.axis(0, axis).unwrap());
        assert!(
            figures.iter().all(|axis| axis.off_course_mm < 0.6 && axis.account.acked == 0),
            "{figures:?}"
        );
        assert!(play.rare().is_empty(), "{:?}", play.rare());
        play.assert_gentle();
    }
}

#[test]
fn frames_are_confirmed_once_they_are_executed_and_a_motor_was_read_where_they_lead() {
    for (units, wires) in [(1, false), (2, true)] {
        let setups: Vec<_> = (1..=units).map(|unit| wired(unit, wires)).collect();
        let mut play = Play::homed(&setups, if units > 1 { 113_636 } else { BAUD });
        play.begin(ride);
        play.play(10.0, 0);
        play.judged = false;
        play.wait(1.5);
        let mut next = vec![0; setups.len()];
        for (at, event) in &play.told {
            let StreamEvent::Confirmed { lane, first, last } = event else { continue };
            let executed = play.origin + TICK * last.0;
            assert_eq!(first.0, std::mem::replace(&mut next[usize::from(*lane)], last.0 + 1));
            assert!(*at >= executed, "{last:?} {at:?}");
            let (seats, every) = (u32::from(play.seats), play.terms.period);
            let latest = play.origin + TICK * first.0 + read_every(every, seats, 3 * seats);
            assert!(*at < latest + Duration::from_millis(15), "{first:?} {:?}", at.since(latest));
        }
        assert!(next.iter().all(|next| *next > 990), "{next:?}: what it braked from is not executed");
    }
}

#[test]
fn it_moves_once_and_says_so() {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.begin(ride);
    play.play(10.0, 0);
    let moves = play.told.iter().filter(|(_, event)| matches!(event, StreamEvent::Moves { .. })).count();
    assert_eq!(moves, 1);
}

#[test]
fn it_ends_at_rest_where_the_poses_ended_and_begins_again_from_there() {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.begin(there);
    play.play(2.5, 0);
    play.judged = false;
    play.wait(1.0);
    assert!(
        play.stream.is_ready(0) && play.off([40.0, 50.0, 60.0]) < 0.1,
        "{}",
        play.off([40.0, 50.0, 60.0])
    );
    play.begin(back);
    play.judged = true;
    play.play(2.5, 0);
    play.judged = false;
    play.wait(1.0);
    assert!(play.stream.is_ready(0) && play.off([0.0; 3]) < 0.1, "{}", play.off([0.0; 3]));
    assert!(play.worst.iter().all(|worst| *worst < 0.2), "{:?}", play.worst);
    assert!(play.rare().is_empty(), "{:?}", play.rare());
}

#[test]
fn poses_that_end_in_motion_brake_it_within_the_limits() {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.begin(ride);
    play.play(8.0, 0);
    play.judged = false;
    play.wait(1.5);
    let braked =
        |event: &StreamEvent| matches!(event, StreamEvent::Braked { why: BrakeReason::PosesEnded, .. });
    assert!(play.told.iter().any(|(_, event)| braked(event)), "{:?}", play.rare());
    assert!(play.stream.is_ready(0));
    play.assert_gentle();
}

#[test]
fn missed_ticks_cost_lead_that_is_regained() {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.begin(ride);
    play.play(8.0, 0);
    play.play(12.0, 2);
    assert!(play.rare().is_empty(), "{:?}", play.rare());
    play.worst = [0.0; 3];
    play.origin = play.origin + 2 * TICK;
    play.play(5.0, 0);
    assert!(play.worst.iter().all(|worst| *worst <= 0.2), "{:?}", play.worst);
}

#[test]
fn a_first_pose_elsewhere_moves_nothing() {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.judged = false;
    play.begin(|_, _| 70.0);
    play.play(1.0, 0);
    assert!(play.off([0.0; 3]) < 0.06);
    assert_eq!(play.rare().len(), 1, "{:?}", play.rare());
    assert!(play.stream.figures().poses_skipped > 90);
}

#[test]
fn two_units_on_two_wires_ride_together() {
    let mut play = Play::homed(&[wired(1, true), wired(2, true)], 113_636);
    play.begin(ride);
    play.play(20.0, 0);
    assert!(play.worst.iter().all(|worst| *worst <= 0.2), "{:?}", play.worst);
    let books: Vec<_> =
        play.bus().units().iter().map(|unit| (unit.books.collisions, unit.books.unknown)).collect();
    assert_eq!(books, [(0, 0), (0, 0)]);
    assert!(play.rare().is_empty(), "{:?}", play.rare());
    play.assert_gentle();
}

/// Three axes at 56,818 baud; `KINOCUE_SHOWS` is how many shows, 60 for an hour.
#[test]
fn no_motor_runs_out_of_targets_in_shows_whose_thread_is_held_up_as_a_real_time_thread_is() {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.shows(soaks(), |at, axis| ride_for_a_minute(72.0, at, axis));
    play.assert_gentle();
}
