//! Searches for zero: those that are asked for, and those that begin by themselves.

use super::*;

#[test]
fn homing_finds_the_edge_of_the_switch_and_the_lower_end_of_the_stroke_reads_a_million() {
    let mut shafts = [ShaftSetup::default(); MOTORS];
    shafts[1].start += 11.0;
    shafts[2].start += 23.0;
    let mut host = Host::of(SixpackSetup { shafts, ..setup() });
    for motor in 0..3 {
        host.settle(motor);
        host.order(search(motor));
        assert!((action::SEARCH..=action::LAST_SEARCH).contains(&host.position(motor).action));
        host.await_idle(motor, Duration::from_secs(30));
        assert_eq!(host.position(motor).position, 0);
        let place = host.motor(usize::from(motor)).shaft.place();
        assert!((place + 5.0 * MM).abs() < 10.0, "{place}");
        host.order(SixpackOrder::Preset(PositionPreset { motor, position: 1_000_000 }));
        let told = host.position(motor);
        assert_eq!(told, PositionTold { motor, position: 1_000_000, action: action::IDLE, stop: 0 });
    }
    assert_eq!(host.motor(3).shaft.place(), ShaftSetup::default().start);
    assert_eq!(host.unit().books.settings_in_motion, 0);
}

#[test]
fn a_search_that_begins_on_the_switch_leaves_it_first_and_ends_at_the_same_edge() {
    let mut host = Host::with(ShaftSetup { start: -8.0 * MM, ..ShaftSetup::default() });
    host.settle(0);
    host.order(search(0));
    assert_eq!(host.position(0).action, action::SEARCH);
    host.await_idle(0, Duration::from_secs(30));
    let place = host.motor(0).shaft.place();
    assert!((place + 5.0 * MM).abs() < 10.0, "{place}");
}

#[test]
fn a_reversed_axis_homes_to_its_lower_end_with_null_left_the_other_way_round() {
    let mut host = Host::with(ShaftSetup { is_reversed: true, ..ShaftSetup::default() });
    host.settle(0);
    let p6 = p6::FAST_REF | p6::NULL_POSITIVE;
    host.order(SixpackOrder::Motor(flags(p5::FILTER_SWITCH, p6)));
    host.order(search(0));
    host.await_idle(0, Duration::from_secs(30));
    assert!((host.motor(0).shaft.place() + 5.0 * MM).abs() < 10.0);
    host.order(target(0, -6_400));
    host.wait(Duration::from_secs(2));
    assert!((host.motor(0).shaft.place() - 5.0 * MM).abs() < 30.0);
}

#[test]
fn a_search_without_a_switch_goes_on_for_ever_until_it_is_aborted() {
    let mut host = Host::with(ShaftSetup::default());
    host.suffer(SixpackFault::BreakSwitch { motor: 0, is_broken: true });
    host.settle(0);
    host.order(search(0));
    host.wait(Duration::from_secs(60));
    let motor = host.motor(0);
    assert!(motor.shaft.executed().lost > 100_000.0 && motor.shaft.place() == -10.0 * MM, "{motor:?}");
    assert_eq!(host.position(0).action, action::SEARCH + 1);
    host.order(target(0, 0));
    assert_eq!(host.unit().books.left_alone, 1);
    host.order(SixpackOrder::AbortSearch(AbortSearch { motor: 0 }));
    assert_eq!(host.position(0).action, action::IDLE);
}

#[test]
fn the_worked_example_searches_by_itself_and_what_is_made_safe_of_it_does_not() {
    // TestNull, StopNull; FastRef, DelayTestNull, StopSoft, NullPositive: zero is where it woke, and no switch is there.
    let example = MotorSettings { motor: 0, poslimit: 400, p5: 0xc8, p6: 0x5a };
    let mut host = Host::with(ShaftSetup::default());
    host.order(SixpackOrder::Motor(example));
    host.wait(Duration::from_secs(1));
    assert_eq!((host.motor(0).own_searches, host.motor(0).shaft.executed().velocity), (0, 0.0));
    assert_eq!(host.position(0).stop, 0);
    host.tell(example);
    host.wait(Duration::from_secs(1));
    assert_eq!(host.motor(0).own_searches, 1);
    assert!(host.motor(0).shaft.executed().velocity > 0.0);
    assert_eq!((host.position(0).stop, host.position(0).stop), (1, 0));
}

#[test]
fn a_flag_to_search_now_is_obeyed_and_with_stop_no_ref_a_switch_only_stops() {
    let mut host = Host::with(ShaftSetup::default());
    host.tell(flags(p5::AUTONULL_CMD | p5::NULL_LEFT, p6::NULL_POSITIVE));
    host.wait(MS(100));
    assert_eq!(host.motor(0).own_searches, 1);
    let mut host = Host::with(ShaftSetup { start: -4.0 * MM, ..ShaftSetup::default() });
    host.tell(flags(p5::STOP_NULL, p6::NULL_POSITIVE | p6::STOP_NO_REF));
    host.order(target(0, -6_400));
    host.wait(Duration::from_secs(2));
    assert_eq!((host.motor(0).own_searches, host.position(0).action, host.position(0).stop), (0, 0, 1));
    let place = host.motor(0).shaft.place();
    assert!((-6.0 * MM..=-5.0 * MM).contains(&place), "{place}");
}

#[test]
fn a_preset_on_the_switch_starts_a_search_where_stop_null_is_set() {
    let mut host = Host::with(ShaftSetup { start: -8.0 * MM, ..ShaftSetup::default() });
    host.tell(flags(p5::STOP_NULL | p5::NULL_LEFT, p6::NULL_POSITIVE));
    host.wait(MS(100));
    assert_eq!(host.motor(0).own_searches, 0);
    host.order(SixpackOrder::Preset(PositionPreset { motor: 0, position: 1_000_000 }));
    host.wait(MS(100));
    assert_eq!(host.motor(0).own_searches, 1);
}
