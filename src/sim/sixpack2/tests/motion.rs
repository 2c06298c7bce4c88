//! What its motors make of what they are told, and what becomes of it.

use super::*;
use crate::drive::{Lag, Middle, Motor, TargetMaker};

#[test]
fn a_course_of_targets_is_executed_as_the_model_of_the_proof_says() {
    let lag = Lag::new(3, 12);
    let mut host = Host::with(ShaftSetup { start: 0.0, ..ShaftSetup::default() });
    host.settle(0);
    let mut makes = TargetMaker::at_rest(lag, (0.0, 96_000.0), 0.0);
    let mut model = Motor::at_rest(lag, 0.0);
    // In the middle between two loops.
    host.wait(Duration::from_nanos(3_000_000 - host.now.as_nanos() % 2_000_000));
    let (period, mut next, mut slice, mut fastest) = (0.0075, 0, 0.0, 0.0_f64);
    for round in 0..3_000 {
        if f64::from(round) * 0.002 >= slice * period {
            let (sin, cos) = (2.0 * (slice + 0.5) * period).sin_cos();
            next = makes.push(Middle { position: 40_000.0 * (1.0 - cos), velocity: 80_000.0 * sin });
            let now = host.now;
            target(0, next).frame(UNIT).octets().into_iter().for_each(|octet| host.bus.on_octet(octet, now));
            slice += 1.0;
        }
        host.wait(MS(2));
        // What a motor chose in a loop is made by the next.
        assert!((f64::from(host.motor(0).position()) - model.position()).abs() <= 0.5, "{round}");
        model.run(next);
        fastest = fastest.max(model.velocity().abs());
        assert!((f64::from(host.motor(0).speed()) * steps_of_a_unit(3) - model.velocity()).abs() < 1e-9);
    }
    let executed = host.motor(0).shaft.executed();
    assert!(fastest > 70_000.0 && (executed.velocity - fastest).abs() < 1.0, "{fastest} {executed:?}");
    assert!(executed.lowest >= 0.0 && executed.highest <= 80_020.0 && executed.lost == 0.0, "{executed:?}");
}

#[test]
fn a_motor_that_is_asked_to_jump_by_more_than_it_can_loses_steps_and_its_unit_does_not_know() {
    let mut host = Host::with(ShaftSetup { start: 0.0, ..ShaftSetup::default() });
    host.suffer(SixpackFault::Jump(22.5 * MM));
    host.settle(0);
    // 60 ms at 12 and 3: 1 mm begins with 25 mm a second.
    for step in 1..=10 {
        host.order(target(0, 320 * step));
        host.wait(MS(200));
    }
    let gentle = host.motor(0).shaft.executed();
    assert!(gentle.lost == 0.0 && gentle.jump < 22.5 * MM, "{gentle:?}");
    host.bus.forget();
    assert_eq!(host.motor(0).shaft.executed().jump, 0.0);
    host.order(target(0, 9_600));
    host.wait(Duration::from_secs(2));
    let (told, motor) = (host.position(0).position, host.motor(0));
    let executed = motor.shaft.executed();
    assert!((9_588..=9_600).contains(&told) && executed.lost > 1_000.0, "{told} {executed:?}");
    assert!((f64::from(told) - motor.shaft.place() - executed.lost).abs() < 1.0, "{motor:?}");
    assert!(executed.jump > 200.0 * MM, "{executed:?}");
}

#[test]
fn what_blocks_an_axis_or_ends_its_travel_is_seen_by_nobody_but_the_books() {
    let mut host = Host::with(ShaftSetup { start: 0.0, ..ShaftSetup::default() });
    host.settle(0);
    host.suffer(SixpackFault::Block { motor: 0, is_blocked: true });
    host.order(target(0, 6_400));
    host.wait(Duration::from_secs(2));
    assert!(host.position(0).position > 6_380 && host.motor(0).shaft.place() == 0.0);
    host.suffer(SixpackFault::Block { motor: 0, is_blocked: false });
    host.order(target(0, 200_000));
    host.wait(Duration::from_secs(5));
    assert_eq!(host.motor(0).shaft.place(), 155.0 * MM);
    let executed = host.motor(0).shaft.executed();
    assert!(executed.lost > 100_000.0 - 60.0 && executed.highest == 155.0 * MM, "{executed:?}");
}

#[test]
fn where_the_line_is_dead_the_last_target_is_reached_and_held() {
    let mut host = Host::with(ShaftSetup { start: 0.0, ..ShaftSetup::default() });
    host.settle(0);
    host.order(target(0, 6_400));
    host.wait(Duration::from_secs(60));
    let place = host.motor(0).shaft.place();
    assert!((6_388.0..=6_400.0).contains(&place), "{place}");
    assert_eq!(host.motor(0).action(), action::PI);
}

#[test]
fn a_ramped_stop_brakes_by_the_acceleration_and_a_joint_move_arrives_at_one_instant() {
    let mut host = Host::with(ShaftSetup { start: 0.0, ..ShaftSetup::default() });
    (0..3).for_each(|motor| host.settle(motor));
    host.tell(Rotation { motor: 0, velocity: 100 });
    host.wait(Duration::from_secs(1));
    assert_eq!(host.motor(0).speed(), 100);
    host.order(SixpackOrder::RampedStop { motor: 0 });
    host.wait(MS(20));
    assert!((1..100).contains(&host.motor(0).speed()));
    host.await_idle(0, Duration::from_secs(1));
    let steps = 5.0 * steps_of_a_unit(3);
    assert!(host.motor(0).shaft.executed().jump <= steps + 1e-6);
    host.order(SixpackOrder::Preset(PositionPreset { motor: 0, position: 0 }));
    for (motor, target) in [(0, 9_600), (1, 4_800), (2, -300)] {
        host.order(SixpackOrder::JointTarget(JointTarget { motor, target }));
    }
    host.order(SixpackOrder::JointStart(JointStart { mask: 0b11 }));
    host.wait(MS(120));
    let ways = [0, 1].map(|motor| f64::from(host.motor(motor).position()));
    assert!(ways[0] > 1_000.0 && (ways[0] / ways[1] - 2.0).abs() < 0.2, "{ways:?}");
    host.await_idle(0, Duration::from_secs(5));
    assert_eq!([0, 1, 2].map(|motor| host.motor(motor).position()), [9_600, 4_800, 0]);
}
