use super::*;
use crate::wire::{AXES_PER_BLOCK, motion_channel_and_slots};

fn ms(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

fn claim(at: u64) -> Claim {
    Claim { oldest: ms(at), newest: ms(at), is_count: false }
}

/// It is asked, and answers at once, by both sources.
fn look(positions: &mut Positions, first: usize, told: &[Pulses], at: u64) {
    PositionSource::ALL.into_iter().for_each(|source| look_by(source, positions, first, told, at));
}

fn look_by(source: PositionSource, positions: &mut Positions, first: usize, told: &[Pulses], at: u64) {
    for (index, block) in told.chunks(AXES_PER_BLOCK).enumerate() {
        positions.answer(first + index * AXES_PER_BLOCK, block, source, claim(at), ms(at));
    }
}

fn seat(axes: usize) -> Positions {
    Positions::new(Arc::new(SeatType::bench3(axes)), 0, motion_channel_and_slots(axes).1, 0.0)
}

#[test]
fn a_seat_rests_where_three_answers_over_a_tenth_of_a_second_see_it() {
    let mut positions = seat(1);
    let looks = [
        (0, 30_000, false),   // the first
        (200, 32_000, false), // it moves
        (201, 32_000, false), // of the same burst
        (202, 32_000, false),
        (401, 32_000, true),
        (601, 32_100, true),
        (801, 35_000, false),
        (5_000, 35_000, false), // what was between nobody knows
        (5_200, 35_000, false), // one of the two may be an older one
        (5_400, 35_000, true),
    ];
    for (at, pulses, rests) in looks {
        look(&mut positions, 0, &[Pulses(pulses)], at);
        assert_eq!(positions.reading(ms(at)).map(|reading| reading.rests), Some(rests), "at {at} ms");
    }
}

#[test]
fn a_seat_that_was_cut_off_sways_if_it_swings_about_one_place_for_half_a_second_by_no_more_than_it_was_told_to()
 {
    let swings = |shakes: f64, places: [i32; 7]| {
        let mut positions = seat(1);
        positions.may_shake(shakes);
        for (at, pulses) in (0..).step_by(100).zip(places) {
            look(&mut positions, 0, &[Pulses(pulses)], at);
        }
        let reading = positions.reading(ms(600)).unwrap();
        (reading.rests, reading.sways, reading.pose[0])
    };
    let (swinging, standing) = ([30_000, 32_500, 27_500, 31_000, 29_000, 32_000, 28_000], [30_000; 7]);
    assert_eq!(swings(0.01, swinging), (false, 2.0 * 0.01 + STILL, 0.1), "about the middle of it");
    let (_, sways, _) = swings(0.1, swinging);
    assert!(
        (sways - 2.0 * 5_000.0 / 300_000.0 - STILL).abs() < 1e-9,
        "by no more than it was seen to: {sways}"
    );
    assert_eq!(swings(0.007, swinging).1, 0.0, "it swings farther than that");
    assert_eq!(swings(0.0, swinging).1, 0.0, "no frame told it to");
    let rising = [30_000, 31_000, 32_000, 33_000, 34_000, 35_000, 36_000];
    assert_eq!(swings(0.1, rising).1, 0.0, "somebody jogs it");
    let turning = [30_000, 31_000, 32_000, 33_000, 32_000, 31_000, 30_000];
    assert_eq!(swings(0.1, turning).1, 0.0, "or jogs it back");
    assert_eq!((swings(0.01, standing).0, swings(0.01, standing).1), (true, 0.0), "it rests");
}

#[test]
fn one_that_may_vibrate_rests_only_where_more_answers_see_it_in_one_place_for_half_a_second() {
    let mut positions = seat(1);
    positions.may_shake(0.01);
    for (at, rests) in [(0, false), (120, false), (240, false), (360, false), (480, false), (510, true)] {
        look(&mut positions, 0, &[Pulses(30_000)], at);
        assert_eq!(positions.reading(ms(at)).unwrap().rests, rests, "at {at} ms");
    }
}

#[test]
fn a_seat_of_six_axes_is_read_once_both_halves_are_and_is_as_old_as_the_older() {
    let mut positions = seat(6);
    look(&mut positions, 3, &[Pulses(4), Pulses(5), Pulses(6)], 10);
    assert_eq!(positions.reading(ms(10)), None);
    look(&mut positions, 0, &[Pulses(1), Pulses(2), Pulses(3)], 260);
    let reading = positions.reading(ms(260)).unwrap();
    assert_eq!((reading.slots, reading.at), (0b11_1111, ms(10)));
    assert!((reading.pose[5] - 6.0 / 300_000.0).abs() < 1e-12);
}

#[test]
fn axes_without_a_register_are_known_from_a_report_or_right_after_homing_alone() {
    let mut positions = seat(8);
    look(&mut positions, 0, &[Pulses(0); 6], 0);
    assert_eq!(positions.reading(ms(0)).unwrap().slots, 0b11_1111);
    positions.on_homed();
    look(&mut positions, 0, &[Pulses(0); 6], 100);
    let homed = positions.reading(ms(100)).unwrap();
    assert_eq!((homed.slots, homed.by), (0xff, Source::Homing));
    positions.on_sent(ms(100));
    assert_eq!(positions.reading(ms(100)), None, "frames have led them since");
    look(&mut positions, 0, &[Pulses(0); 6], 150);
    assert_eq!(positions.reading(ms(150)).unwrap().slots, 0b11_1111);
    positions.report(&[Pulses(9); 8], ms(200));
    assert_eq!(positions.reading(ms(200)).unwrap().slots, 0xff);
}

/// A seat whose last axis turns to either side of its zero.
fn turntable(axes: usize) -> Positions {
    let mut seat = SeatType::bench3(axes);
    (seat.each[axes - 1].low, seat.each[axes - 1].high) = (-75.0, 75.0);
    Positions::new(Arc::new(seat), 0, motion_channel_and_slots(axes).1, 0.0)
}

#[test]
fn an_axis_with_its_zero_inside_its_range_is_where_its_pulses_say_to_either_side() {
    for (pulses, place) in [(-150_000, 0.0), (-75_000, 0.25), (0, 0.5), (75_000, 0.75), (150_000, 1.0)] {
        let mut positions = turntable(2);
        look(&mut positions, 0, &[Pulses(150_000), Pulses(pulses)], 0);
        let reading = positions.reading(ms(0)).expect("both axes told");
        assert_eq!(reading.pose[..2], [0.5, place]);
        let told = positions.told().expect("both axes told");
        assert_eq!(told.iter().copied().collect::<Vec<_>>(), [Pulses(150_000), Pulses(pulses)]);
    }
    let mut positions = turntable(2);
    look(&mut positions, 0, &[Pulses(0), Pulses(-151_000)], 0);
    assert_eq!((positions.reading(ms(0)), positions.outside()), (None, Some((1, Pulses(-151_000)))));
}

#[test]
fn an_axis_without_a_register_that_is_home_stands_at_its_zero_and_not_at_the_end_of_its_range() {
    let homed = |first: i32| {
        let mut positions = turntable(8);
        positions.on_homed();
        look(&mut positions, 0, &[Pulses(first); 6], 0);
        positions.reading(ms(0)).expect("its registers told")
    };
    let home = homed(0);
    assert_eq!((home.slots, home.by, home.pose[7]), (0xff, Source::Homing, 0.5));
    assert_eq!(homed(90_000).slots, 0b11_1111, "an axis that is elsewhere was not homed");
}

#[test]
fn a_turntable_that_tells_its_zero_is_home_and_one_at_the_end_of_its_range_is_not() {
    let slots = |pulses: i32| {
        let mut seat = SeatType::bench3(8);
        (seat.each[0].low, seat.each[0].high) = (-75.0, 75.0);
        let mut positions = Positions::new(Arc::new(seat), 0, motion_channel_and_slots(8).1, 0.0);
        positions.on_homed();
        look(&mut positions, 0, &[pulses, 0, 0, 0, 0, 0].map(Pulses), 0);
        positions.reading(ms(0)).expect("its registers told").slots
    };
    assert_eq!([0, -150_000].map(slots), [0xff, 0b11_1111]);
}

#[test]
fn an_answer_is_as_old_as_the_oldest_request_that_is_open_and_in_passing_as_the_newest() {
    let mut positions = seat(1);
    look(&mut positions, 0, &[Pulses(7)], 0);
    let claim = Claim { oldest: ms(250), newest: ms(500), is_count: false };
    for source in PositionSource::ALL {
        assert_eq!(positions.answer(0, &[Pulses(7)], source, claim, ms(501)).at, ms(500));
    }
    assert_eq!(positions.reading(ms(501)).unwrap().at, ms(250));
    assert!(!positions.on_repeated(0, &[Pulses(7)], ms(502)));
    let claim = Claim { newest: ms(510), ..claim };
    let passing = positions.answer(0, &[Pulses(7)], PositionSource::Blocks, claim, ms(511));
    assert_eq!(passing.at, ms(210), "while answers are repeated it may be an older one");
}

#[test]
fn a_place_that_one_source_alone_tells_is_none_and_one_of_two_is_as_old_as_the_older() {
    let mut positions = seat(3);
    let told = [Pulses(7); 3];
    for at in [0, 200, 400, 600] {
        look_by(PositionSource::Blocks, &mut positions, 0, &told, at);
        assert_eq!(positions.reading(ms(at)), None, "an old answer may come again and again");
    }
    look_by(PositionSource::Parts, &mut positions, 0, &told[..1], 601);
    assert_eq!(positions.reading(ms(601)), None, "it tells of the first axis alone");
    look_by(PositionSource::Parts, &mut positions, 1, &told[1..], 602);
    let reading = positions.reading(ms(602)).unwrap();
    assert_eq!((reading.at, reading.rests, reading.moves), (ms(600), false, false));
    look_by(PositionSource::Blocks, &mut positions, 0, &[Pulses(9_000); 3], 800);
    assert!(positions.reading(ms(800)).unwrap().moves, "that it is elsewhere one tells");
}

#[test]
fn a_place_is_none_while_a_second_answer_to_one_request_or_a_report_has_the_seat_elsewhere() {
    let away = [Pulses(7), Pulses(9_000), Pulses(7)];
    let by_answer = |positions: &mut Positions, at| assert!(positions.on_repeated(0, &away, ms(at)));
    let by_report = |positions: &mut Positions, at| positions.report(&away, ms(at));
    for contradicts in [&by_answer as &dyn Fn(&mut Positions, u64), &by_report] {
        let mut positions = seat(3);
        [0, 60, 120].into_iter().for_each(|at| look(&mut positions, 0, &[Pulses(7); 3], at));
        assert!(positions.reading(ms(120)).unwrap().rests);
        contradicts(&mut positions, 121);
        let reading = positions.reading(ms(121)).unwrap();
        assert!(reading.moves && !reading.rests, "it is at either place");
        [180, 240, 300].into_iter().for_each(|at| look(&mut positions, 0, &[Pulses(7); 3], at));
        contradicts(&mut positions, 301);
        assert!(!positions.reading(ms(301)).unwrap().rests, "and as long as that goes on");
        for at in (360..=1_400).step_by(60) {
            look(&mut positions, 0, &[Pulses(7); 3], at);
        }
        let reading = positions.reading(ms(1_400)).unwrap();
        assert!(reading.rests && !reading.moves, "fresh answers resolve it");
    }
}

#[test]
fn a_report_that_registers_contradict_tells_nothing_of_axes_that_have_none() {
    let mut positions = seat(8);
    look(&mut positions, 0, &[Pulses(7); 6], 0);
    let mut told = [Pulses(7); 8];
    told[2] = Pulses(9_000);
    positions.report(&told, ms(1));
    assert_eq!(positions.reading(ms(1)).unwrap().slots, 0b11_1111);
    look(&mut positions, 0, &[Pulses(7); 6], 60);
    positions.report(&[Pulses(7); 8], ms(61));
    assert_eq!(positions.reading(ms(61)).unwrap().slots, 0xff);
}

#[test]
fn a_seat_is_looked_at_for_longer_while_answers_are_repeated() {
    let mut positions = seat(1);
    look(&mut positions, 0, &[Pulses(7)], 0);
    assert!(!positions.on_repeated(0, &[Pulses(7)], ms(90)));
    for (at, rests) in [(200, false), (450, false), (501, true)] {
        look(&mut positions, 0, &[Pulses(7)], at);
        assert_eq!(positions.reading(ms(at)).unwrap().rests, rests, "at {at} ms");
    }
}

#[test]
fn a_report_is_as_old_as_the_answer_before_it() {
    let mut positions = seat(8);
    look(&mut positions, 0, &[Pulses(0); 6], 100);
    positions.report(&[Pulses(0); 8], ms(900));
    assert_eq!(positions.reading(ms(900)).unwrap().at, ms(100));
}

#[test]
fn a_position_outside_the_stroke_is_none_and_is_named() {
    let mut positions = seat(2);
    look(&mut positions, 0, &[Pulses(-20), Pulses(300_050)], 0);
    assert_eq!(positions.reading(ms(0)).unwrap().pose[..2], [0.0, 1.0], "rounding is not outside");
    look(&mut positions, 0, &[Pulses(-20_000), Pulses(7)], 1);
    assert_eq!((positions.reading(ms(1)), positions.outside()), (None, Some((0, Pulses(-20_000)))));
    look(&mut positions, 0, &[Pulses(0)], 2);
    assert_eq!(positions.outside(), None);
}

#[test]
fn a_seat_with_an_axis_beyond_those_of_its_type_that_is_not_at_0_is_nowhere() {
    let mut positions = seat(2);
    look(&mut positions, 0, &[Pulses(7), Pulses(7), Pulses(90_000)], 0);
    assert_eq!((positions.reading(ms(0)), positions.outside()), (None, Some((2, Pulses(90_000)))));
    look(&mut positions, 0, &[Pulses(7), Pulses(7), Pulses(0)], 1);
    assert!(positions.reading(ms(1)).is_some());
    let mut many = seat(8);
    look(&mut many, 0, &[Pulses(0); 6], 0);
    many.report(
        &[
            Pulses(0),
            Pulses(0),
            Pulses(0),
            Pulses(0),
            Pulses(0),
            Pulses(0),
            Pulses(0),
            Pulses(0),
            Pulses(900),
        ],
        ms(1),
    );
    assert_eq!(many.outside(), Some((8, Pulses(900))));
}

#[test]
fn a_position_that_either_order_of_words_puts_inside_the_stroke_is_none_before_something_tells_the_order() {
    // 1 pulse, or 32.8 mm.
    let ambiguous = || {
        let mut positions = seat(2);
        look(&mut positions, 0, &[Pulses(1), Pulses(0)], 0);
        assert!(positions.reading(ms(0)).is_none() && positions.is_ambiguous());
        positions
    };
    let mut told = ambiguous();
    look(&mut told, 0, &[Pulses(1), Pulses(45_000)], 1);
    look(&mut told, 0, &[Pulses(1), Pulses(0)], 2);
    assert!(told.reading(ms(2)).is_some(), "its other axis has told");
    let mut reported = ambiguous();
    reported.report(&[Pulses(1), Pulses(0)], ms(1));
    assert!(reported.reading(ms(1)).is_some());
    let mut reversed = ambiguous();
    reversed.report(&[Pulses(1 << 16), Pulses(0)], ms(1));
    look(&mut reversed, 0, &[Pulses(1), Pulses(0)], 2);
    assert!(reversed.reading(ms(2)).is_none(), "the report says that the registers come the other way round");
    let mut homed = ambiguous();
    homed.on_homed();
    look(&mut homed, 0, &[Pulses(1), Pulses(0)], 1);
    assert!(homed.reading(ms(1)).is_some());
    let mut at_zero = seat(2);
    look(&mut at_zero, 0, &[Pulses(0), Pulses(0)], 0);
    assert!(at_zero.reading(ms(0)).is_some(), "both orders say the same");
}
