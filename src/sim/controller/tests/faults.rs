use super::*;

#[test]
fn an_error_stops_the_play_and_stands_in_every_answer_until_its_event() {
    for (number, outlasts_reset, outlasts_power) in [
        (1, true, true),
        (6, true, true),
        (7, true, true),
        (10, true, false),
        (15, true, false),
        (17, false, false),
    ] {
        let mut bench = Bench::with(&[]);
        bench.play(&FRAME);
        bench.controller.act(&Action::Error(number), at(50));
        assert_eq!((bench.wait(100).x(&FRAME), bench.positions()[0]), ((3, number), 500));
        assert_eq!((bench.read(1, 2, 1), bench.refused().fault), ((3, vec![3]), 1));
        let after_reset = if outlasts_reset { (3, number) } else { (2, 0) };
        bench.write(2, 0, &[0]);
        assert_eq!(bench.wait(500).x(&FRAME), after_reset, "Err{number} after a reset");
        assert_eq!(bench.word(0, 0xf0), if outlasts_reset { 1 } else { 2 });
        let here = at(bench.at_ms);
        bench.controller.act(&Action::Reboot, here);
        let after_power = if outlasts_power { (3, number) } else { (2, 0) };
        assert_eq!(bench.wait(1_500).x(&FRAME), after_power, "Err{number} after the power was off");
        let here = at(bench.at_ms);
        bench.controller.act(&Action::Error(0), here);
        assert_eq!(bench.x(&FRAME), (2, 0));
    }
}

#[test]
fn a_play_that_begins_with_too_long_a_time_is_err17_unless_it_resets_by_itself() {
    let mut bench = Bench::with(&[]);
    assert_eq!(bench.x(&absolute(30_001)), (3, 17));
    assert_eq!((bench.wait(3_000).positions(), bench.x(&FRAME)), (vec![0, 0, 0], (3, 17)));
    bench.write(2, 0, &[0]);
    assert_eq!(bench.wait(500).x(&absolute(30_000)), (2, 0));
    assert_eq!(bench.wait(100).x(&absolute(60_000)), (2, 0), "it is not the first any more");
    assert_eq!(Bench::with(&[(pa::AUTO_RESET, 60_000)]).x(&absolute(90_000)), (2, 0));
    let invented = Invented { first_time_max_ms: 50, ..Invented::default() };
    assert_eq!(Bench::new(&Setup { invented, ..Setup::default() }).x(&absolute(51)), (3, 17));
}

#[test]
fn a_flood_is_err20_which_goes_by_itself() {
    let invented = Invented { udp_memory: 3, ..Invented::default() };
    let mut bench = Bench::new(&Setup { invented, ..Setup::default() });
    assert_eq!([(); 3].map(|()| bench.x(&FRAME).0), [2; 3]);
    assert_eq!(bench.x(&FRAME), (3, 20));
    assert_eq!(bench.wait(50).positions(), [500, 1_000, -1_500], "what has come goes on");
    assert_eq!(bench.wait(49).x(&FRAME), (3, 20));
    assert_eq!(bench.wait(99).x(&FRAME), (3, 20));
    assert_eq!(bench.wait(1).x(&FRAME), (2, 0));
}

#[test]
fn the_depth_of_the_queue_is_an_option() {
    let invented = Invented { queue_depth: 2, ..Invented::default() };
    let mut bench = Bench::new(&Setup { invented, ..Setup::default() });
    assert_eq!([(); 4].map(|()| bench.x(&FRAME)), [(2, 0), (2, 0), (2, 0), (3, 21)]);
}

#[test]
fn a_muted_controller_obeys_and_speaks_again() {
    let mut bench = Bench::with(&[]);
    bench.controller.act(&Action::Mute(true), at(0));
    assert_eq!(bench.play(&FRAME), None);
    bench.controller.act(&Action::Mute(false), at(0));
    assert_eq!((bench.word(0, 0x34), bench.wait(100).positions()), (2, vec![1_000, 2_000, -3_000]));
}

#[test]
fn a_parameter_set_at_its_keys_is_not_checked_and_kept() {
    let mut bench = Bench::with(&[]);
    bench.controller.act(&Action::Parameter(pa::ESTOP_WAY, 9), at(0));
    bench.controller.act(&Action::Reboot, at(0));
    assert_eq!(bench.wait(1_500).word(1, u16::from(pa::ESTOP_WAY)), 9);
}
