use super::*;

#[test]
fn a_reset_homes_and_drops_motion_meanwhile() {
    let mut bench = Bench::with(&[]);
    bench.play(&FRAME);
    bench.wait(100);
    assert_eq!(bench.word(0, 0xf0), 2);
    assert_eq!(bench.write(2, 0, &[0]), 2);
    assert_eq!(bench.word(0, 0xf0), 1);
    assert_eq!(bench.wait(250).positions(), [500, 1_000, -1_500]);
    assert_eq!(bench.x(&FRAME), (2, 0));
    assert_eq!((bench.wait(250).positions(), bench.word(0, 0xf0)), (vec![0, 0, 0], 2));
    assert_eq!(bench.refused().homing, 1);
    assert_eq!(bench.duration(&absolute(2_900)), 100, "absolute time begins anew");
}

#[test]
fn pa08_reads_1_until_its_homing_is_done() {
    let mut bench = Bench::with(&[(pa::RESET_WAY, 1)]);
    assert_eq!((bench.write(1, u16::from(pa::RESET), &[1]), bench.word(1, u16::from(pa::RESET))), (2, 1));
    assert_eq!((bench.wait(499).word(0, 0xf0), bench.wait(1).word(0, 0xf0)), (1, 2), "PA0e is for DPF0");
    assert_eq!(bench.word(1, u16::from(pa::RESET)), 0);
}

#[test]
fn with_pa0e_dpf0_goes_to_zero_without_homing() {
    let mut bench = Bench::with(&[(pa::RESET_WAY, 1)]);
    bench.play(&FRAME);
    bench.wait(100).write(2, 0, &[0]);
    // 3,000 pulses at 500 pulses/ms.
    assert_eq!((bench.word(0, 0xf0), bench.wait(6).word(0, 0xf0)), (1, 2));
    assert_eq!(bench.positions(), [0, 0, 0]);
}

#[test]
fn a_reboot_is_silent_for_a_while_and_forgets_what_was_not_kept() {
    let mut bench = Bench::with(&[(pa::START_OUTPUTS, 8)]);
    bench.write(1, u16::from(pa::AMPLITUDE), &[5]);
    assert_eq!(bench.write(2, 2, &[1]), 2);
    assert_eq!(bench.wait(1_499).play(&FRAME), None);
    bench.wait(1);
    assert_eq!((bench.word(1, u16::from(pa::AMPLITUDE)), bench.controller.outputs()), (0, 8));
    assert_eq!(bench.refused().rebooting, 1);
}

#[test]
fn the_commands_stop_and_pa0d_later_it_resets() {
    let mut bench = Bench::with(&[(pa::AUTO_RESET, 1_000)]);
    assert_eq!(bench.wait(5_000).word(0, 0xf0), 2, "no command has come yet");
    bench.play(&FRAME);
    bench.wait(900).play(&FRAME);
    assert_eq!(bench.wait(999).word(0, 0xf0), 2);
    assert_eq!((bench.positions(), bench.wait(1).word(0, 0xf0)), (vec![1_000, 2_000, -3_000], 1));
    assert_eq!((bench.wait(250).positions(), bench.x(&FRAME)), (vec![500, 1_000, -1_500], (2, 0)));
    assert_eq!((bench.wait(250).positions(), bench.word(0, 0xf0)), (vec![0, 0, 0], 2));
}

#[test]
fn the_unit_of_pa0d_is_an_option() {
    let invented = Invented { auto_reset_unit: Duration::from_secs(1), ..Invented::default() };
    let parameters = vec![(pa::AUTO_RESET, 2)];
    let mut bench = Bench::new(&Setup { invented, parameters, ..Setup::default() });
    bench.play(&FRAME);
    assert_eq!((bench.wait(1_999).word(0, 0xf0), bench.wait(1).word(0, 0xf0)), (2, 1));
}

#[test]
fn whether_reads_put_off_the_automatic_reset_is_an_option() {
    for (auto_reset, dpf0) in [(Commands::Motion, 1), (Commands::Any, 2)] {
        let invented = Invented { auto_reset, ..Invented::default() };
        let parameters = vec![(pa::AUTO_RESET, 1_000)];
        let mut bench = Bench::new(&Setup { invented, parameters, ..Setup::default() });
        bench.play(&FRAME);
        bench.wait(800).word(0, 6);
        assert_eq!(bench.wait(400).word(0, 0xf0), dpf0, "{auto_reset:?}");
    }
}

#[test]
fn the_rotary_axis_takes_where_it_is_for_zero() {
    let mut bench = Bench::with(&[(pa::ROTARY_AXIS, 3)]);
    bench.play(&FRAME);
    bench.wait(100).write(2, 0, &[0]);
    assert_eq!(bench.wait(250).positions(), [500, 1_000, 0]);
}

#[test]
fn homing_takes_as_long_as_the_setup_says_or_as_the_speed_limits_ask_for() {
    let invented = Invented { homing: Duration::from_millis(2_000), ..Invented::default() };
    let mut bench = Bench::new(&Setup { invented, ..Setup::default() });
    bench.write(2, 0, &[0]);
    assert_eq!((bench.wait(1_999).word(0, 0xf0), bench.wait(1).word(0, 0xf0)), (1, 2));
    let mut slow = Bench::with(&[(pa::MAX_RPM, 6)]); // 1 pulse/ms
    slow.play(&FRAME);
    slow.wait(3_000).write(2, 0, &[0]);
    assert_eq!((slow.wait(2_999).word(0, 0xf0), slow.wait(1).word(0, 0xf0)), (1, 2));
}

#[test]
fn a_power_cycle_is_silent_for_pa3d_and_homing_and_counts_anew() {
    let mut bench = Bench::with(&[(pa::START_DELAY, 300)]);
    bench.play(&FRAME);
    bench.wait(100).controller.act(&Action::Reboot, at(100));
    assert_eq!(bench.wait(300).positions(), [1_000, 2_000, -3_000], "it homes after its delay");
    assert_eq!((bench.wait(499).play(&FRAME), bench.wait(1).word(0, 0x34)), (None, 1));
    assert_eq!((bench.positions(), bench.read(0, 0x48, 2).1), (vec![0, 0, 0], vec![0, 0]));
}

#[test]
fn pa9e_switches_outputs_by_hand() {
    let mut bench = Bench::with(&[]);
    assert_eq!((bench.write(1, 0x9e, &[0x801]), bench.word(0, 0x66)), (2, 0x801));
}
