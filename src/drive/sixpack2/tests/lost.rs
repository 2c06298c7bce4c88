//! Units that do not answer: what becomes of their own seats, and of those beside them.

use std::time::Duration;

use super::bench::*;
use super::play::*;
use crate::drive::link::*;
use crate::drive::sixpack2::{Homing, OrderGap, Reach, SeatMotors, home, read_every};
use crate::sim::serial::LineFaults;
use crate::sim::sixpack2::SixpackFault;
use crate::wire::sixpack2::{PiTarget, SixpackCommand};

/// Has a unit not answer any more.
fn kill(play: &mut Play, unit: u8) {
    let now = play.now();
    play.bus_mut().suffer(Some(unit), SixpackFault::Dead(true), now);
}

#[test]
fn units_that_are_lost_do_not_keep_a_seat_that_plays_from_being_read() {
    let setups: Vec<_> = (1..=7).map(|unit| wired(unit, true)).collect();
    let mut play = Play::homed(&setups, 113_636);
    play.judged = false;
    // With this there is time for one question in a slice, and for fewer than there are units to be looked for.
    play.stream.terms.period = Duration::from_millis(20);
    (2..=7).for_each(|unit| kill(&mut play, unit));
    play.begin(ride);
    play.play(4.0, 0);
    assert_eq!(play.rare().len(), 6, "{:?}", play.rare());
    play.told.clear();
    play.play(6.0, 0);
    let read =
        |(at, event): &(_, StreamEvent)| matches!(event, StreamEvent::Read { lane: 0, .. }).then_some(*at);
    let reads: Vec<_> = play.told.iter().filter_map(read).collect();
    let most = read_every(play.terms.period, 7, 21);
    assert!(
        reads.len() > 18 && reads.windows(2).all(|pair| pair[1].since(pair[0]) < most),
        "{}",
        reads.len()
    );
    assert!(play.rare().is_empty(), "{:?}", play.rare());
}

#[test]
fn all_motors_of_a_link_are_told_to_stop_before_a_unit_that_is_silent_is_waited_for() {
    let mut play = Play::homed(&[wired(1, true), wired(2, true)], 113_636);
    let from = play.places()[3];
    kill(&mut play, 1);
    let far = SixpackCommand::from(PiTarget { motor: 0, target: 261_000_910 }).frame(2).octets();
    play.stream.talk.port().damage = Some(Box::new(move |sent| {
        let target = sent.chunks_exact_mut(9).find(|frame| frame[..3] == [2, 0x24, 0]);
        target.map(|frame| frame.copy_from_slice(&far)).is_some()
    }));
    while play.stream.talk.port().damage.is_some() {
        play.stream.round().unwrap();
    }
    play.stream.settle().unwrap();
    let settled = play.now() + Duration::from_secs(2);
    play.stream.talk.port().sleep_until(settled);
    let octets = [Duration::from_secs(10) / 113_636; 2];
    let gap = OrderGap { period: play.terms.period, octets, motors: 6, delay: play.stream.talk.delay_p99() };
    let (mm, most) = (play.places()[3] - from, Reach::of(&seat().own()[0], 3).stopped_mm(gap.longest()));
    assert!(mm > 1.0 && mm <= most, "{mm} of {most} mm");
}

#[test]
fn motors_of_a_seat_that_takes_no_part_go_no_farther_by_an_order_that_was_damaged() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let (seat, drive) = (seat(), drive(SWITCH));
    let sixpack2 = drive.sixpack2.clone().unwrap();
    let of = |motors| SeatMotors {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &drive,
        sixpack2: &sixpack2,
        unit: 1,
        motors,
        period: PERIOD,
    };
    for motors in [&[3, 4, 5], &[0, 1, 2]] {
        assert_eq!(home_as(&mut talk, &drive, motors).0, Ok(()));
    }
    let period = 2 * PERIOD;
    let mut play = Play::over(talk, period, &[of(&[0, 1, 2])], |_, _| {}).unwrap();
    play.stream.stand_by(std::iter::once(of(&[3, 4, 5])));
    play.wait(1.0);
    let far = SixpackCommand::from(PiTarget { motor: 3, target: 261_000_910 }).frame(1).octets();
    let mut farthest = 0.0_f64;
    for is_last in [false, true] {
        let from = place(&mut play.stream.talk, 3);
        play.stream.talk.port().damage = Some(Box::new(move |sent| {
            let target = sent.chunks_exact_mut(9).find(|frame| frame[..3] == [1, 0x24, 0]);
            target.map(|frame| frame.copy_from_slice(&far)).is_some()
        }));
        while play.stream.talk.port().damage.is_some() {
            play.stream.round().unwrap();
        }
        if is_last {
            play.stream.settle().unwrap();
            let later = play.now() + Duration::from_secs(2);
            play.stream.talk.port().sleep_until(later);
        } else {
            play.wait(1.0);
        }
        farthest = farthest.max(place(&mut play.stream.talk, 3) - from);
        assert_eq!(motor(&mut play.stream.talk, 3).speed(), 0);
    }
    let octets = [Duration::from_secs(10) / BAUD; 2];
    let gap = OrderGap { period, octets, motors: 6, delay: play.stream.talk.delay_p99() };
    let most = Reach::of(&seat.own()[0], 3).stopped_mm(gap.longest());
    assert!(farthest > 1.0 && farthest <= most, "{farthest} of {most} mm");
    assert!(play.stream.is_ready(0) && play.rare().is_empty(), "{:?}", play.rare());
}

/// A ride of a seat with so much acceleration at the most, up to where it does not answer and is told to stop.
fn lost_in_a_ride(mm_s2: f64, seconds: f64) -> Play {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let seat = seat().with_each(|axis| axis.max_acceleration = mm_s2);
    let drive = drive(SWITCH);
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
    assert_eq!(home(&mut talk, of, Homing { goes_on: &|| true, told: &mut |_| {} }), Ok(()));
    let mut play = Play::over(talk, PERIOD, &[of], |_, _| {}).unwrap();
    play.wait(1.0);
    play.begin(ride);
    play.play(seconds, 0);
    play.line().faults.answer_lost = 1.0;
    while !play.has("Lost") {
        play.play(0.01, 0);
    }
    play.line().faults = LineFaults::default();
    play
}

#[test]
fn a_seat_whose_ramp_is_long_is_not_out_while_it_brakes() {
    let mut fastest = 0.0_f64;
    for phase in 0..6 {
        let mut play = lost_in_a_ride(400.0, 8.0 + 0.173 * f64::from(phase));
        // A ramp of 3,000 mm/s² would be over.
        play.wait(0.25);
        fastest = fastest.max(play.speed());
        play.wait(2.0);
        assert!(play.stream.is_ready(0) && !play.has("OffCourse"), "{phase}: {:?}", play.rare());
    }
    assert!(fastest > 50.0, "{fastest}");
}

#[test]
fn a_seat_that_nothing_led_for_an_hour_is_not_reckoned_loop_by_loop() {
    let mut play = Play::homed(&[wired(1, false)], BAUD);
    play.stream.put_out(0, StreamEvent::OffCourse { lane: 0, axis: 0, by_mm: 1.0 });
    let later = play.now() + Duration::from_secs(3_600);
    play.stream.talk.port().sleep_until(later);
    play.stream.look(0);
    while play.stream.lanes[0].stage == Stage::Out {
        play.stream.round().unwrap();
    }
    let now = play.now();
    assert!(play.stream.lanes[0].axes.iter().all(|axis| axis.owes(now) < Duration::from_secs(3)));
    play.wait(1.0);
    assert!(play.stream.is_ready(0) && play.off([0.0; 3]) < 0.06, "{:?}", play.rare());
}
