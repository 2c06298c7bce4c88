//! Homing, limits, kills and resets.

use super::*;

/// As homing searches: down for 165 mm at 10 mm/s until input 1 is high.
const SEARCH: Request = Request::MoveRelative {
    distance: -132_000,
    acceleration: 77_309,
    velocity: 64_424_509,
    stop: StopOn::Input { input: 1, is_high: true },
};

#[test]
fn a_search_ends_at_the_switch_and_remembers_where_that_was() {
    let mut host = Host::of(16);
    host.tell(16, SEARCH);
    host.at_rest();
    assert_ne!(host.word(16, Request::InternalStatus) & Internal::INPUT_FOUND, 0);
    assert_ne!(host.word(16, Request::Poll) & Poll::ENDED_BY_SENSOR, 0);
    // The switch is 2 mm above the lower stop, the axis stood 79 mm above that.
    let edge = host.read(16, register::INPUT_POSITION);
    assert!((-61_602..=-61_600).contains(&edge), "{edge}");
    assert!(host.unit().position() < edge, "it overshoots");
    // The edge is -2 mm from now on, whatever the overshoot.
    host.tell(16, Request::WriteRegister { register: register::ACCUMULATOR, value: edge + 2 * MM });
    host.tell(16, Request::SubtractAccumulator);
    let beside = f64::from(host.unit().position() + 2 * MM) - (host.unit().place() - f64::from(2 * MM));
    assert!(beside.abs() <= 1.0, "{beside}");
    assert_eq!(host.unit().position(), host.unit().target());
}

#[test]
fn a_search_without_a_switch_ends_after_its_distance_and_says_that_nothing_was_found() {
    let mut host =
        Host::with(&[UnitSetup { switch: None, top: 200_000, place: 150_000, ..UnitSetup::new(16) }]);
    host.act(Action::Input { input: 1, is_high: false });
    host.tell(16, SEARCH);
    host.at_rest();
    assert_eq!(host.word(16, Request::InternalStatus) & Internal::INPUT_FOUND, 0);
    assert_eq!(host.unit().position(), -132_000);
}

#[test]
fn a_hard_stop_is_found_by_the_moving_error() {
    let mut host = Host::with(&[UnitSetup { switch: None, place: 4_000, ..UnitSetup::new(16) }]);
    host.tell(16, Request::ErrorLimits { moving: 400, holding: 200, delay_ticks: 1_000 });
    host.tell(
        16,
        Request::MoveRelative {
            distance: -132_000,
            acceleration: 77_309,
            velocity: 64_424_509,
            stop: StopOn::MovingError,
        },
    );
    host.at_rest();
    assert!(host.unit().place() == 0.0 && host.unit().target() < -4_400, "{:?}", host.unit().target());
    host.tell(16, Request::TargetToPosition);
    assert_eq!(host.unit().target(), -4_000);
}

#[test]
fn a_blocked_axis_is_killed_by_its_moving_error_and_says_by_which() {
    let mut host = Host::of(16);
    host.tell(16, Request::ErrorLimits { moving: 500, holding: 100, delay_ticks: 1_000 });
    host.tell(16, Request::KillConditions { enable: 896, state: 768 });
    host.act(Action::Blocked(true));
    host.tell(16, Request::MoveAbsolute { position: 8_000, acceleration: 77_309, velocity: 64_424_509 });
    host.at_rest();
    assert_ne!(host.word(16, Request::Poll) & Poll::KILLED, 0);
    assert_eq!(host.read(16, register::KILL_CAUSE), 0x0100_0100);
    assert_eq!((host.unit().tally().kills, host.unit().position()), (1, 0));
}

#[test]
fn heat_kills_where_it_is_a_condition_and_the_bit_is_low_then() {
    let mut host = Host::of(16);
    host.tell(16, Request::KillConditions { enable: 128, state: 0 });
    host.wait(10);
    assert_eq!(host.unit().tally().kills, 0);
    host.act(Action::Hot(true));
    host.wait(1);
    assert_eq!(host.read(16, register::KILL_CAUSE), 0x0080_0000);
    assert_eq!(host.word(16, Request::IoStates) & Io::COOL, 0);
}

#[test]
fn the_driver_jumps_to_its_target_unless_that_was_made_the_position() {
    for is_careful in [false, true] {
        let mut host = Host::of(16);
        host.tell(16, Request::KillConditions { enable: 128, state: 0 });
        host.act(Action::Hot(true));
        host.wait(1);
        host.act(Action::Hot(false));
        host.tell(16, Request::MoveAbsolute { position: 800, acceleration: 77_309, velocity: 64_424_509 });
        host.at_rest();
        assert_eq!((host.unit().position(), host.unit().target()), (0, 800), "nothing drives it");
        if is_careful {
            host.tell(16, Request::TargetToPosition);
        }
        host.tell(16, Request::EnableDriver);
        let executed = host.unit().executed();
        let expected = if is_careful { (0, 0.0) } else { (1, 800.0) };
        assert_eq!((executed.jumps, executed.farthest_jump), expected);
    }
}

#[test]
fn soft_limits_stop_the_target_hard_and_let_it_back() {
    let mut host = Host::of(16);
    host.tell(16, Request::WriteRegister { register: register::SOFT_LIMIT_LOW, value: -800 });
    host.tell(16, Request::WriteRegister { register: register::SOFT_LIMIT_HIGH, value: 4_000 });
    host.tell(16, Request::SoftLimitsOn);
    let to = |position| Request::MoveAbsolute { position, acceleration: 77_309, velocity: 64_424_509 };
    host.tell(16, to(8_000));
    host.at_rest();
    assert_eq!(host.unit().position(), 4_000);
    assert_ne!(host.word(16, Request::Poll) & Poll::SOFT_LIMIT, 0);
    host.tell(16, to(-8_000));
    host.at_rest();
    assert_eq!(host.unit().position(), -800);
    host.tell(16, Request::SoftLimitsOff);
    host.tell(16, to(-1_600));
    host.at_rest();
    assert_eq!(host.unit().position(), -1_600);
}

#[test]
fn a_reset_moves_the_rotor_and_leaves_nothing_but_the_place() {
    let mut host = Host::of(16);
    host.tell(16, Request::WriteRegister { register: register::CANARY, value: 4_711 });
    host.tell(16, Request::MoveAbsolute { position: 800, acceleration: 77_309, velocity: 64_424_509 });
    host.at_rest();
    host.act(Action::Reset);
    assert_eq!(host.ask(16, Request::Poll), None, "it starts");
    host.wait(600);
    assert_eq!(host.unit().executed().jumps, 1);
    host.line.bus_mut().units_mut()[0].forget_executed();
    assert_eq!(host.read(16, register::CANARY), 0);
    assert_eq!(host.read(16, register::POSITION), 0);
    let executed = host.unit().executed();
    assert_eq!((executed.jumps, executed.lowest), (0, f64::from(63_200 + 800 + 37)));
}
