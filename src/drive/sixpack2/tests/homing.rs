//! How seats find their zero.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::bench::*;
use super::play::Play;
use crate::config::drive::SeatDrive;
use crate::config::drive::homing::{HomeWay, Side};
use crate::config::drive::sixpack2::PropDiv;
use crate::drive::link::{HomedAs, LinkTalk as _, Step};
use crate::drive::sixpack2::*;
use crate::motion::SeatType;
use crate::sim::serial::LineFaults;
use crate::sim::sixpack2::{ShaftSetup, SixpackFault, SixpackMotor, SixpackSetup};

/// What the counter of a motor reads.
fn counts(talk: &mut Talk<VirtualPort>, index: usize) -> i32 {
    motor(talk, index).position()
}

#[test]
fn a_seat_is_homed_by_the_edges_of_its_switches_and_stands_at_park_with_its_settings() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let (homed, steps) = home_as(&mut talk, &drive(SWITCH), &[0, 1, 2]);
    assert_eq!(homed, Ok(()));
    let order = [Step::Searching(0), Step::Found(0), Step::Searching(1), Step::Parking, Step::Set(2)];
    let at: Vec<_> = order.iter().map(|step| steps.iter().position(|told| told == step)).collect();
    assert!(at.is_sorted() && at[0].is_some(), "{steps:?}");
    for (index, at_low) in at_low(&drive(SWITCH), &[0, 1, 2], PERIOD).into_iter().enumerate() {
        assert!(place(&mut talk, index).abs() < 0.06, "{}", place(&mut talk, index));
        assert_eq!(counts(&mut talk, index), at_low);
        let motor = motor(&mut talk, index);
        let (written, executed) = (motor.written, motor.shaft.executed());
        assert!(is_set_up_for_shows(motor), "{written:?}");
        assert_eq!((written.kind.p5, written.kind.p6, written.start.div), (0x90, 0x72, 0));
        assert_eq!(written.currents.map(|it| [it.power_down, it.stand, it.run, it.ramp]), Some([2, 2, 1, 0]));
        assert_eq!(written.peak.map(|it| it.value), Some(238));
        assert!(executed.lost == 0.0 && executed.velocity <= 20.0 * MM, "{executed:?}");
        assert!(executed.lowest >= -2.55 * MM, "{executed:?}");
    }
    let books = unit(&mut talk).books;
    assert_eq!((books.unknown, books.settings_in_motion, books.left_alone, books.no_motor), (0, 0, 0, 0));
    assert_eq!(counts(&mut talk, 3), 0, "of no axis of this seat");
}

/// Nothing of a unit can be read but its counters: a seat that was homed with other settings would be led by a wrong scale, or the wrong way.
#[test]
fn a_seat_whose_settings_were_edited_after_it_was_homed_is_not_home() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let homed = drive(SWITCH);
    assert_eq!(home_as(&mut talk, &homed, &[0, 1, 2]).0, Ok(()));
    let facts = look_for(&mut talk, 1, &[0, 1, 2]).unwrap().unwrap();
    let strangers = |drive: &SeatDrive, seat: &SeatType, period: Duration| {
        on_motors(seat, drive, &[0, 1, 2], period).strangers(&facts)
    };
    assert_eq!(strangers(&homed, &seat(), PERIOD), [0; 0]);
    let edits: [fn(&mut SeatDrive); 9] = [
        |drive| drive.reverse[0] = true,
        |drive| drive.reverse[2] = true,
        |drive| drive.homing.zero_mm = -3.0,
        |drive| drive.homing.toward = Side::Up,
        |drive| drive.homing.travel_mm = 170.0,
        |drive| drive.sixpack2.as_mut().unwrap().clock_divider = 2,
        |drive| drive.sixpack2.as_mut().unwrap().propdiv = PropDiv::Fixed(9),
        |drive| drive.sixpack2.as_mut().unwrap().current.peak = 200,
        |drive| drive.sixpack2.as_mut().unwrap().current.stand = 75,
    ];
    for (number, edit) in edits.into_iter().enumerate() {
        let mut edited = homed.clone();
        edit(&mut edited);
        assert_eq!(strangers(&edited, &seat(), PERIOD), [0, 1, 2], "{number}");
    }
    for (lead, max_velocity, max_acceleration) in
        [(4.95, 240.0, 3_000.0), (5.0, 200.0, 3_000.0), (5.0, 240.0, 2_000.0)]
    {
        let other = seat().with_each(|axis| {
            (axis.lead, axis.max_velocity, axis.max_acceleration) = (lead, max_velocity, max_acceleration);
        });
        assert_eq!(strangers(&homed, &other, PERIOD), [0, 1, 2], "{lead} {max_velocity} {max_acceleration}");
    }
}

#[test]
fn a_seat_is_homed_again_from_its_switch_and_from_anywhere() {
    for start in [-5.0, -2.0, 20.0, 150.0] {
        let shaft = ShaftSetup { start: start * MM, ..shaft() };
        let mut talk = talk_to(&[unit_with(1, shaft)]);
        for _ in 0..2 {
            assert_eq!(home_as(&mut talk, &drive(SWITCH), &[2, 4]).0, Ok(()), "{start}");
            assert!(place(&mut talk, 2).abs() < 0.06 && place(&mut talk, 4).abs() < 0.06, "{start}");
        }
    }
}

#[test]
fn a_reversed_axis_and_one_whose_zero_is_up_find_theirs() {
    let mut reversed = drive(SWITCH);
    reversed.reverse[0] = true;
    let mut talk = talk_to(&[unit_with(1, ShaftSetup { is_reversed: true, ..shaft() })]);
    assert_eq!(home_as(&mut talk, &reversed, &[0]).0, Ok(()));
    assert!(place(&mut talk, 0).abs() < 0.06, "{}", place(&mut talk, 0));
    assert_eq!(counts(&mut talk, 0), at_low(&reversed, &[0], PERIOD)[0]);
    assert_eq!(motor(&mut talk, 0).written.kind.p5, 0x80);
    // The virtual switch is below: up, for an axis that goes the other way than its motor is said to.
    let mut up = drive(SWITCH);
    (up.homing.toward, up.homing.zero_mm, up.reverse[0]) = (Side::Up, 152.0, true);
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    assert_eq!(home_as(&mut talk, &up, &[0]).0, Ok(()));
    assert!((place(&mut talk, 0) - 150.0).abs() < 0.06, "{}", place(&mut talk, 0));
}

#[test]
fn a_hard_stop_is_run_into_gently_and_a_person_says_here() {
    let mut stop = drive(HomeWay::HardStop);
    stop.homing.zero_mm = -10.0;
    let mut talk = talk_to(&[unit_with(1, ShaftSetup { switch: None, ..shaft() })]);
    assert_eq!(home_as(&mut talk, &stop, &[0]).0, Ok(()));
    assert!(place(&mut talk, 0).abs() < 0.06, "{}", place(&mut talk, 0));
    let mut here = drive(HomeWay::Here);
    here.homing.zero_mm = 75.0;
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    assert_eq!(home_as(&mut talk, &here, &[0]).0, Ok(()));
    assert!((place(&mut talk, 0) - 5.0).abs() < 0.06, "80 mm were called 75: {}", place(&mut talk, 0));
}

#[test]
fn a_search_is_made_with_less_current_and_a_show_with_all_of_it() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let (seat, drive) = (SeatType { axes: 1, ..seat() }, drive(SWITCH));
    let sixpack2 = drive.sixpack2.clone().unwrap();
    let of = SeatMotors {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &drive,
        sixpack2: &sixpack2,
        unit: 1,
        motors: &[0],
        period: PERIOD,
    };
    // It searches by then.
    let at = talk.now() + Duration::from_secs(2);
    talk.port().script = Some((at, |line, _| {
        let SixpackMotor { written, .. } = &line.bus().units()[0].motors[0];
        assert_eq!(written.currents.map(|it| [it.stand, it.run, it.ramp]), Some([2, 3, 3]));
        assert_eq!(written.ramp.vmax, 41);
    }));
    let ready = home(&mut talk, of, Homing { goes_on: &|| true, told: &mut |_| {} });
    assert!(ready == Ok(()) && talk.port().script.is_none() && is_set_up_for_shows(motor(&mut talk, 0)));
}

#[test]
fn a_search_that_is_ended_stops_where_it_is() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let (seat, drive) = (SeatType { axes: 1, ..seat() }, drive(SWITCH));
    let sixpack2 = drive.sixpack2.clone().unwrap();
    let of = SeatMotors {
        name: "A1",
        twins: &[],
        seat: &seat,
        drive: &drive,
        sixpack2: &sixpack2,
        unit: 1,
        motors: &[0],
        period: PERIOD,
    };
    let abort = AtomicBool::new(false);
    let mut told = |step| abort.store(matches!(step, Step::Searching(_)), Ordering::Relaxed);
    let homed = home(&mut talk, of, Homing { goes_on: &|| !abort.load(Ordering::Relaxed), told: &mut told });
    assert_eq!(homed, Err(HomeError::Aborted));
    let stood = place(&mut talk, 0);
    assert!(stood > 79.0, "it had hardly begun to move: {stood}");
    talk.pause(Duration::from_secs(9));
    assert_eq!(place(&mut talk, 0), stood);
}

#[test]
fn a_switch_that_is_not_found_ends_the_search_and_is_told_in_words() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    suffer(&mut talk, SixpackFault::BreakSwitch { motor: 1, is_broken: true });
    let begun = talk.now();
    let words = home_as(&mut talk, &drive(SWITCH), &[0, 1]).0.unwrap_err().to_string();
    assert_eq!(
        words,
        "motor 1 of unit 1: its switch not found within 16 s, 165 mm at 19.6 mm/s; the search was ended; check it, its wiring, \
         `active` and `toward`"
    );
    assert!(talk.now().since(begun).as_secs_f64() < 30.0);
    let place = place(&mut talk, 1);
    talk.pause(Duration::from_secs(5));
    assert_eq!(motor(&mut talk, 1).action(), 0);
    assert!((motor(&mut talk, 1).shaft.place() / MM - place).abs() < 1.0);
}

#[test]
fn a_unit_that_restarts_while_it_homes_is_not_home() {
    for (after, baud) in
        [(500, BAUD), (500, 19_231), (3_000, 19_231), (7_000, 19_231), (9_300, 19_231), (9_800, 19_231)]
    {
        let mut talk = talk_at(&[unit_with(1, shaft())], baud);
        let at = talk.now() + Duration::from_millis(after);
        talk.port().script = Some((at, |line, now| line.bus_mut().suffer(None, SixpackFault::Reset, now)));
        let (homed, steps) = home_as(&mut talk, &drive(SWITCH), &[0, 1]);
        assert!(talk.port().script.is_none(), "it was over after {:?}", talk.now());
        assert!(homed.is_err(), "{after} ms: a unit that lost its place is taken for home");
        let restarted = Err(HomeError::Restarted { unit: 1 });
        assert!(after > 9_000 || !steps.contains(&Step::Parking), "{after} ms: {steps:?}");
        assert!(baud == BAUD || after > 9_000 || homed == restarted, "{after} ms: {homed:?}");
        talk.pause(Duration::from_secs(1));
        assert_eq!(motor(&mut talk, 0).speed(), 0);
    }
}

/// Whoever looks next, a day later, has nothing but the counters.
#[test]
fn wherever_a_homing_is_cut_off_counters_that_have_places_of_the_seat_are_of_motors_set_up_for_shows() {
    let begins = |talk: &mut Talk<VirtualPort>| {
        assert_eq!(home_as(talk, &drive(SWITCH), &[0, 1]).0, Ok(()));
        talk.now()
    };
    let mut whole = talk_to(&[unit_with(1, shaft())]);
    let (begun, ends) = (begins(&mut whole), begins(&mut whole));
    let (mut known, mut unknown) = (0, 0);
    // In steps of less than an exchange, where there is one after the other.
    let lasts = ends.since(begun);
    let early = (0..120).map(|step| Duration::from_millis(4 * step));
    let late = (0..180).map(|step| lasts.saturating_sub(Duration::from_millis(4 * step)));
    for after in early.chain(late) {
        let mut talk = talk_to(&[unit_with(1, shaft())]);
        let at = begins(&mut talk) + after;
        talk.port().script = Some((at, |line, _| line.faults.unplugged = true));
        let (homed, _) = home_as(&mut talk, &drive(SWITCH), &[0, 1]);
        for index in 0..2 {
            let motor = motor(&mut talk, index);
            let is_known = (999_000..8_000_000).contains(&motor.position());
            assert!(!is_known || is_set_up_for_shows(motor), "{after:?} {homed:?}: {:?}", motor.written);
            *if is_known { &mut known } else { &mut unknown } += 1;
        }
    }
    assert!(known > 20 && unknown > 400, "{known} {unknown}");
}

#[test]
fn nothing_plays_to_motors_that_a_homing_left_as_it_searches_whether_they_or_their_answers_were_cut_off() {
    let begins = || {
        let mut talk = talk_to(&[unit_with(1, shaft())]);
        assert_eq!(home_as(&mut talk, &drive(SWITCH), &[0, 1, 2]).0, Ok(()));
        talk
    };
    let mut whole = begins();
    let begun = whole.now();
    assert_eq!(home_as(&mut whole, &drive(SWITCH), &[0, 1, 2]).0, Ok(()));
    let lasts = whole.now().since(begun);
    let (seat, drive) = (seat(), drive(SWITCH));
    let of = on_motors(&seat, &drive, &[0, 1, 2], PERIOD);
    let (mut ready, mut searching) = (0, 0);
    let near_its_ends = (0..16).map(|step| Duration::from_millis(25 * step));
    let afters = near_its_ends.clone().chain(near_its_ends.map(|ago| lasts.saturating_sub(ago)));
    for (after, is_deaf) in
        afters.chain([lasts / 4, lasts / 2]).flat_map(|after| [(after, false), (after, true)])
    {
        let mut talk = begins();
        let at = talk.now() + after;
        talk.port().script = Some(if is_deaf {
            (at, |line, _| line.faults.answer_lost = 1.0)
        } else {
            (at, |line, _| line.faults.unplugged = true)
        });
        let (homed, _) = home_as(&mut talk, &drive, &[0, 1, 2]);
        talk.pause(Duration::from_secs(1));
        talk.port().line.faults = LineFaults::default();
        let are_set = (0..3).all(|index| is_set_up_for_shows(motor(&mut talk, index)));
        let passes =
            look_for(&mut talk, 1, &[0, 1, 2]).unwrap().is_some_and(|it| of.strangers(&it).is_empty());
        let mut play = Play::to(talk, 1).unwrap();
        play.wait(2.0);
        assert!(are_set || !passes && !play.all_ready(), "{after:?} {is_deaf} {homed:?}: {:?}", play.rare());
        assert_eq!(passes, play.all_ready(), "{after:?} {is_deaf} {homed:?}: {:?}", play.rare());
        *if passes { &mut ready } else { &mut searching } += 1;
    }
    assert!(ready > 2 && searching > 30, "{ready} {searching}");
}

#[test]
fn settings_that_do_not_fit_the_seat_are_refused_before_anything_is_said() {
    let mut slow = drive(SWITCH);
    slow.sixpack2.as_mut().unwrap().clock_divider = 5;
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let words = home_as(&mut talk, &slow, &[0]).0.unwrap_err().to_string();
    assert_eq!(words, "240 mm/s needs clock_divider 3 or less, it is 5");
    let mut still = drive(SWITCH);
    still.sixpack2.as_mut().unwrap().jump_mm_s = Some(0.5);
    let words = home_as(&mut talk, &still, &[0]).0.unwrap_err().to_string();
    assert!(words.starts_with("axis 1: with clock_divider 3 no propdiv keeps the jumps of speed"), "{words}");
    assert_eq!(talk.counts().asked, 0);
    let mut fixed = drive(SWITCH);
    fixed.sixpack2.as_mut().unwrap().propdiv = PropDiv::Fixed(8);
    assert_eq!(home_as(&mut talk, &fixed, &[0]).0, Ok(()));
    assert_eq!(motor(&mut talk, 0).written.pi.propdiv, 8);
}

#[test]
fn over_a_bad_line_a_homing_ends_at_the_edge_or_says_what_is_wrong() {
    let mut homes = 0;
    for seed in 0..12_u64 {
        let shaft = ShaftSetup { start: (20.0 + seed as f64) * MM, ..shaft() };
        let mut talk = talk_to(&[unit_with(1, shaft)]);
        talk.port().line.faults =
            LineFaults { lost: 0.001, doubled: 0.001, answer_lost: 0.02, ..LineFaults::default() };
        let (homed, _) = home_as(&mut talk, &drive(SWITCH), &[0, 1]);
        talk.port().line.faults = LineFaults::default();
        if homed == Ok(()) {
            homes += 1;
            let places = [0, 1].map(|index| place(&mut talk, index));
            assert!(places.iter().all(|place| place.abs() < 0.06), "{seed}: {places:?}");
            let pi = [0, 1].map(|index| motor(&mut talk, index).written.pi.propdiv);
            assert_eq!(pi, [25, 25], "{seed}");
        }
    }
    assert!(homes >= 8, "{homes}");
}

#[test]
fn a_seat_is_not_homed_over_a_line_that_leads_to_another_one_until_its_unit_was_off() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let (seat, drive, twins) = (seat(), drive(SWITCH), ["A1".to_owned(), "B1".to_owned()]);
    let of = |name| SeatMotors { name, twins: &twins, ..on_motors(&seat, &drive, &[0, 1, 2], PERIOD) };
    let home_as = |talk: &mut Talk<VirtualPort>, name| {
        home(talk, of(name), Homing { goes_on: &|| true, told: &mut |_| {} })
    };
    assert_eq!(home_as(&mut talk, "B1"), Ok(()));
    talk.port().line.bus_mut().forget();
    assert_eq!(home_as(&mut talk, "A1"), Err(HomeError::Another(HomedAs("B1".to_owned()))));
    let facts = look_for(&mut talk, 1, &[0, 1, 2]).unwrap().unwrap();
    assert_eq!(of("B1").strangers(&facts), [0; 0], "it is home as it was");
    assert_eq!(of("A1").strangers(&facts), [0, 1, 2]);
    assert_eq!(motor(&mut talk, 1).shaft.executed().velocity, 0.0);
    assert_eq!(home_as(&mut talk, "B1"), Ok(()), "itself it is homed again");
    suffer(&mut talk, SixpackFault::Reset);
    assert_eq!(home_as(&mut talk, "A1"), Ok(()));
}

#[test]
fn two_units_with_one_number_are_told_before_either_moves() {
    for is_two_wires in [false, true] {
        let setup = SixpackSetup { is_two_wires, ..unit_with(1, shaft()) };
        let mut talk = talk_to(&[setup, SixpackSetup { serial: 7, ..setup }]);
        let words = home_as(&mut talk, &drive(SWITCH), &[0, 1, 2]).0.unwrap_err().to_string();
        assert!(words.starts_with("two units answer as unit 1; connect each alone"), "{words}");
        let motors = talk.port().line.bus().units().iter().flat_map(|unit| &unit.motors);
        assert!(motors.into_iter().all(|motor| motor.shaft.executed().velocity == 0.0));
    }
}

/// What it makes of frames are octets that are no line: nothing but a line that begins with @ is a request.
#[test]
fn a_silvermax_where_a_sixpack_was_is_told_and_moves_by_nothing_that_is_said_there() {
    use crate::drive::link::TalkTerms;
    use crate::sim::serial::SerialLine;
    use crate::sim::silvermax::{SilverBus, UnitSetup};
    let now = crate::time::MonoTime::from_nanos(3_000_000_000);
    let setups: Vec<_> = (1..=254).map(UnitSetup::new).collect();
    let line = SerialLine::new(SilverBus::new(&setups, BAUD, now), 10, LineFaults::default(), 7);
    let terms = TalkTerms { baud: BAUD, octet_bits: 10, has_echo: false, is_two_wires: false, is_bus: false };
    let mut talk = Talk::new(crate::drive::link::VirtualPort::new(line, now), terms);
    let (drive, seat) = (drive(SWITCH), seat());
    let of = on_motors(&seat, &drive, &[0, 1, 2], PERIOD);
    let homed = home(&mut talk, of, Homing { goes_on: &|| true, told: &mut |_| {} });
    assert!(homed.unwrap_err().to_string().starts_with("unit 1 answers neither at 56818 nor at 19231 baud"));
    let units = talk.port().line.bus().units();
    assert!(units.iter().all(|unit| unit.executed().velocity == 0.0 && unit.tally().requests == 0));
}
