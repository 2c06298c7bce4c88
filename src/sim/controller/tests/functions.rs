use super::*;

/// An emergency stop at X01 that takes this way (PA91), without filter.
fn at_x1(way: u16, more: &[(u8, u16)]) -> Bench {
    let mut parameters =
        vec![(pa::INPUT_FUNCTIONS, 1), (pa::ESTOP_INPUTS, 1), (pa::INPUT_FILTER, 0), (pa::ESTOP_WAY, way)];
    parameters.extend_from_slice(more);
    Bench::with(&parameters)
}

#[test]
fn a_forced_emergency_stop_holds_and_answers_x_4() {
    let estop_at = Some(Duration::from_millis(50));
    let mut bench = Bench::new(&Setup { estop_at, ..Setup::default() });
    assert_eq!(bench.x(&FRAME), (2, 0));
    assert_eq!(bench.wait(80).x(&FRAME), (4, 0));
    assert_eq!(bench.positions(), [500, 1_000, -1_500]);
    assert_eq!((bench.read(0, 6, 2), bench.write(2, 0, &[0])), ((4, vec![500, 0]), 4));
    assert_eq!(bench.wait(600).positions(), [500, 1_000, -1_500]);
    assert_eq!(bench.refused().emergency_stop, 2);
    let here = at(bench.at_ms);
    bench.controller.act(&Action::EmergencyStop(false), here);
    assert_eq!(bench.x(&FRAME).0, 2);
}

#[test]
fn an_mbox_has_no_x_for_it() {
    let mut bench =
        Bench::new(&Setup { dialect: Dialect::Mbox, estop_at: Some(Duration::ZERO), ..Setup::default() });
    assert_eq!((bench.x(&FRAME).0, bench.read(0, 6, 1).0, bench.write(2, 0, &[0])), (3, 2, 3));
}

#[test]
fn pa90_alone_stops_an_mbox_but_no_smc() {
    for (dialect, stopped) in [(Dialect::Mbox, 3), (Dialect::Smc, 2)] {
        let mut bench = Bench::new(&Setup { dialect, ..Setup::default() });
        let channel = if dialect == Dialect::Mbox { 0 } else { 1 };
        bench.write(channel, 0x90, &[1]);
        assert_eq!(bench.x(&FRAME).0, stopped, "{dialect:?}");
        bench.write(channel, 0x90, &[0]);
        assert_eq!(bench.x(&FRAME).0, 2);
    }
}

#[test]
fn a_homing_that_an_emergency_stop_cuts_short_never_ends_by_itself() {
    let mut bench = at_x1(0, &[]);
    bench.play(&FRAME);
    bench.wait(100).write(2, 0, &[0]);
    bench.controller.set_switches(1, at(350));
    bench.controller.set_switches(0, at(400));
    assert_eq!((bench.wait(5_000).word(0, 0xf0), bench.positions()), (1, vec![500, 1_000, -1_500]));
    bench.write(2, 0, &[0]);
    assert_eq!((bench.wait(500).word(0, 0xf0), bench.positions()), (2, vec![0, 0, 0]));
}

#[test]
fn inputs_stop_it_once_pa90_pa92_and_pa93_agree() {
    let mut bench = Bench::with(&[(pa::ESTOP_INPUTS, 3)]);
    bench.controller.set_switches(3, at(0));
    assert_eq!(bench.wait(300).x(&FRAME), (2, 0), "PA90 does not enable it");
    bench.write(1, u16::from(pa::INPUT_FUNCTIONS), &[1]);
    assert_eq!(bench.x(&FRAME).0, 4);

    let mut bench = Bench::with(&[(pa::ESTOP_INPUTS, 3), (pa::INPUT_FUNCTIONS, 1)]);
    bench.controller.set_switches(3, at(0));
    assert_eq!(bench.wait(199).x(&FRAME).0, 2, "the filter has not passed");
    assert_eq!(bench.wait(1).x(&FRAME).0, 4);
    bench.controller.set_switches(1, at(200));
    assert_eq!(bench.wait(199).x(&FRAME).0, 4, "a release is filtered, too");
    assert_eq!(bench.wait(1).x(&FRAME).0, 2, "one input of two is none, and PA91 = 0 goes on");
}

#[test]
fn open_inputs_are_active_where_pa04_is_0() {
    let mut bench = at_x1(0, &[(pa::INPUT_POLARITY, 0)]);
    assert_eq!((bench.x(&FRAME).0, bench.word(0, 0x5e)), (4, 0xfff));
    bench.controller.set_switches(1, at(0));
    assert_eq!((bench.x(&FRAME).0, bench.word(0, 0x5e)), (2, 0xffe));
    bench.write(1, u16::from(pa::INPUT_POLARITY), &[1]);
    assert_eq!((bench.x(&FRAME).0, bench.word(0, 0x5e)), (4, 1));
}

#[test]
fn a_released_stop_ends_although_another_is_to_come() {
    let estop_at = Some(Duration::from_secs(60));
    let parameters = vec![(pa::INPUT_FUNCTIONS, 1), (pa::ESTOP_INPUTS, 1), (pa::INPUT_FILTER, 0)];
    let mut bench = Bench::new(&Setup { parameters, estop_at, ..Setup::default() });
    bench.controller.set_switches(1, at(0));
    assert_eq!(bench.x(&FRAME).0, 4);
    bench.controller.set_switches(0, at(0));
    assert_eq!((bench.x(&FRAME).0, bench.wait(60_000).x(&FRAME).0), (2, 4));
}

/// A stop in the middle of a move with another waiting; released after a second.
fn stopped_and_released(way: u16, more: &[(u8, u16)]) -> Bench {
    let mut bench = at_x1(way, more);
    bench.play(&FRAME);
    bench.play(&Motion { positions: &[Pulses(2_000), Pulses(4_000), Pulses(-6_000)], ..FRAME });
    bench.controller.set_switches(1, at(50));
    assert_eq!(bench.wait(1_050).x(&FRAME).0, 4, "what comes meanwhile is dropped");
    bench
}

#[test]
fn pa91_0_holds_and_goes_on_by_itself() {
    let mut bench = stopped_and_released(0, &[]);
    assert_eq!(bench.positions(), [500, 1_000, -1_500]);
    bench.controller.set_switches(0, at(1_050));
    assert_eq!(bench.wait(25).positions(), [750, 1_500, -2_250]);
    assert_eq!(bench.wait(125).positions(), [2_000, 4_000, -6_000]);
    assert_eq!(bench.x(&FRAME).0, 2);
}

#[test]
fn pa91_1_goes_to_zero_and_goes_on_by_itself() {
    let mut bench = stopped_and_released(1, &[]);
    assert_eq!(bench.positions(), [0, 0, 0]);
    bench.controller.set_switches(0, at(1_050));
    assert_eq!(bench.wait(50).positions(), [1_000, 2_000, -3_000]);
    assert_eq!(bench.wait(100).positions(), [2_000, 4_000, -6_000]);
}

#[test]
fn pa91_2_holds_until_a_reset_and_forgets_what_waited() {
    let mut bench = stopped_and_released(2, &[]);
    assert_eq!(bench.write(2, 0, &[0]), 4, "no reset while the button is pressed");
    bench.controller.set_switches(0, at(1_050));
    assert_eq!((bench.wait(1_000).x(&FRAME).0, bench.positions()), (4, vec![500, 1_000, -1_500]));
    assert_eq!((bench.write(2, 0, &[0]), bench.x(&FRAME).0), (2, 2));
    assert_eq!((bench.wait(500).word(0, 0xf0), bench.positions()), (2, vec![0, 0, 0]));
}

#[test]
fn pa94_slows_what_follows_a_release_until_the_seat_has_arrived() {
    // 60 rpm are 10 pulses/ms.
    let mut bench = stopped_and_released(0, &[(pa::RELEASE_RPM, 60)]);
    bench.controller.set_switches(0, at(1_050));
    assert_eq!(bench.wait(75).positions(), [750, 1_500, -2_250]);
    assert_eq!(bench.wait(75 + 300).positions(), [2_000, 4_000, -6_000]);
    bench.play(&Motion { time_ms: 10, ..FRAME });
    assert_eq!(bench.wait(10).positions(), [1_000, 2_000, -3_000], "the release is over");
}

#[test]
fn an_emergency_reset_homes_when_its_inputs_come_but_not_during_a_stop() {
    let more = [(pa::INPUT_FUNCTIONS, 0b1001), (pa::RESET_INPUTS, 0b110)];
    let mut bench = at_x1(2, &more);
    bench.play(&FRAME);
    bench.controller.set_switches(0b111, at(100));
    assert_eq!(bench.wait(700).positions(), [1_000, 2_000, -3_000]);
    bench.controller.set_switches(0b010, at(700));
    assert_eq!(bench.wait(300).x(&FRAME).0, 4);
    bench.controller.set_switches(0b110, at(1_000));
    assert_eq!((bench.x(&FRAME).0, bench.word(0, 0xf0)), (2, 1));
    assert_eq!((bench.wait(500).positions(), bench.word(0, 0xf0)), (vec![0, 0, 0], 2));
}

#[test]
fn a_seat_at_rest_jogs_out_at_its_safe_speed_and_back_to_zero() {
    let parameters = [
        (pa::INPUT_FUNCTIONS, 2),
        (pa::INPUT_FILTER, 0),
        (pa::JOG_OUT_INPUTS, 1),
        (pa::JOG_BACK_INPUTS, 2),
        (pa::SAFE_RPM, 30), // axis 1: 5 pulses/ms; the others jog at 60 rpm
    ];
    let mut bench = Bench::with(&parameters);
    bench.controller.set_switches(1, at(0));
    assert_eq!(bench.wait(100).positions(), [500, 1_000, 1_000]);
    bench.controller.set_switches(0, at(100));
    assert_eq!(bench.wait(400).positions(), [500, 1_000, 1_000]);
    bench.controller.set_switches(2, at(500));
    assert_eq!(bench.wait(1_000).positions(), [0, 0, 0]);
    bench.controller.set_switches(1, at(1_500));
    bench.wait(100).play(&FRAME);
    assert_eq!(bench.wait(100).positions(), FRAME.positions.iter().map(|p| p.0).collect::<Vec<_>>());
}

#[test]
fn a_controller_that_starts_with_the_button_pressed_stays_where_it_is() {
    let mut bench = stopped_and_released(2, &[]);
    bench.controller.act(&Action::Reboot, at(1_050));
    assert_eq!((bench.wait(1_500).x(&FRAME).0, bench.word(0, 0xf0)), (4, 1));
    assert_eq!(bench.positions(), [500, 1_000, -1_500]);
}

#[test]
fn inputs_that_stop_the_seat_do_not_jog_it() {
    let mut bench = at_x1(0, &[(pa::INPUT_FUNCTIONS, 3), (pa::ESTOP_INPUTS, 3), (pa::JOG_OUT_INPUTS, 1)]);
    bench.controller.set_switches(1, at(0));
    assert_eq!(bench.wait(1_000).positions(), [0, 0, 0]);
}
