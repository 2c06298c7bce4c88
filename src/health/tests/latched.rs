//! Emergency stops and errors.

use super::*;

#[test]
fn an_emergency_stop_stops_its_group_at_once_and_the_hall_is_told_once() {
    let mut hall = Hall::new(LossPolicy::Park);
    hall.run(100);
    hall.observed(1, ESTOP);
    hall.observed(2, ESTOP);
    hall.look();
    assert_eq!(hall.standings(), [HealthState::Stopped, HealthState::Stopped, HealthState::Ok]);
    assert_eq!(hall.told_hall(), [Event::EmergencyStop(1), Event::Latched(Latch::Held)]);
    hall.observed(1, What::EmergencyStopOver);
    hall.look();
    assert_eq!(hall.told_hall().len(), 2, "one is still pressed");
    hall.observed(2, What::EmergencyStopOver);
    hall.look();
    assert_eq!(hall.told_hall()[2..], [Event::AllReleased, Event::Latched(Latch::Over)]);
    assert_eq!(hall.standings(), [HealthState::Stopped, HealthState::Stopped, HealthState::Ok], "latched");
}

#[test]
fn an_emergency_stop_that_came_and_went_between_two_looks_is_told() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.observed(3, ESTOP);
    hall.observed(3, What::EmergencyStopOver);
    hall.look();
    assert_eq!(hall.health.standing(2), HealthState::Stopped);
    let told = hall.told_hall();
    assert_eq!(told, [Event::EmergencyStop(3), Event::AllReleased, Event::Latched(Latch::Over)]);
}

#[test]
fn a_cleared_group_takes_part_only_after_it_was_seen_and_not_while_it_is_pressed() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    hall.observed(3, ESTOP);
    hall.look();
    hall.health.look_anew(2);
    hall.run(1);
    assert_eq!(hall.health.standing(2), HealthState::Stopped, "pressed");
    hall.observed(3, What::EmergencyStopOver);
    hall.look();
    hall.health.look_anew(2);
    assert_eq!((hall.health.standing(2), hall.health.why(2)), (HealthState::Lost, Why::NotSeenYet));
    hall.run(2);
    assert_eq!(hall.health.standing(2), HealthState::Rejoining);
}

#[test]
fn a_power_cut_under_an_emergency_stop_is_a_reboot() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    hall.observed(2, ESTOP);
    hall.look();
    hall.packets[2] = 3;
    hall.observed(2, What::EmergencyStopOver);
    hall.run(30);
    hall.health.look_anew(1);
    hall.run(30);
    assert_eq!(hall.health.standing(1), HealthState::Excluded);
}

#[test]
fn an_error_stops_its_group_and_the_others_go_by_the_configuration() {
    let mut hall = Hall::new(LossPolicy::Pause);
    hall.run(100);
    hall.observed(0, What::Error(21));
    hall.look();
    assert_eq!(hall.health.standing(0), HealthState::Error);
    assert_eq!(hall.health.why(0), Why::Error { controller: 0, error: 21 });
    assert_eq!(hall.told_hall(), [Event::Policy(Demand::Pause, 0), Event::Latched(Latch::Held)]);
    hall.observed(0, What::Error(0));
    hall.look();
    assert_eq!(hall.health.standing(0), HealthState::Error);
    hall.health.look_anew(0);
    hall.run(2);
    assert_eq!(hall.health.standing(0), HealthState::Rejoining);
}

#[test]
fn a_drive_with_an_alarm_parks_whatever_the_configuration_says() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.observed(3, What::ServoError { axis: 2, error: 16 });
    hall.look();
    assert_eq!(hall.told_hall(), [Event::Policy(Demand::Park, 2), Event::Latched(Latch::Held)]);
    assert_eq!(hall.health.why(2).to_string(), "drive of axis 2: error 16");
}

#[test]
fn a_drive_whose_alarm_goes_on_keeps_its_seat_out_through_a_clear() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    hall.observed(3, What::ServoError { axis: 2, error: 16 });
    hall.look();
    hall.health.look_anew(2);
    hall.run(30);
    assert_eq!(hall.health.standing(2), HealthState::Error);
    hall.observed(3, What::ServoError { axis: 2, error: 0 });
    hall.health.look_anew(2);
    hall.run(30);
    assert_eq!(hall.health.standing(2), HealthState::Rejoining);
}

#[test]
fn one_of_a_seat_that_is_lost_already_parks_as_well() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.silence(&[3]);
    hall.answers_reads = false;
    hall.health.on_fell_out(3, crate::belief::Fall::Gap);
    hall.run(2);
    assert_eq!(hall.health.standing(2), HealthState::Lost);
    hall.observed(3, What::ServoError { axis: 2, error: 7 });
    hall.run(2);
    assert!(hall.told_hall().contains(&Event::Policy(Demand::Park, 2)), "{:?}", hall.told_hall());
}

#[test]
fn a_seat_that_falls_out_and_back_three_times_in_a_minute_stays_out_and_one_that_is_out_falls_no_more() {
    for comes_back in [false, true] {
        let mut hall = Hall::new(LossPolicy::Continue);
        hall.run(30);
        for _ in 0..3 {
            hall.health.on_fell_out(2, crate::belief::Fall::Gap);
            hall.answers_reads = comes_back;
            hall.run(60);
            hall.health.on_joined(1);
        }
        let is_unsteady = hall.health.why(1) == Why::Unsteady(2);
        assert_eq!(is_unsteady, comes_back, "{:?}", hall.changes());
    }
}

#[test]
fn a_drive_that_let_go_of_its_motor_is_told_until_its_seat_was_homed_and_holds_up_no_clear() {
    let cause = 0x0100; // a moving error
    for clears in [false, true] {
        let mut hall = Hall::new(LossPolicy::Continue);
        hall.run(30);
        hall.health.on_killed(2, 1, cause);
        hall.health.on_lost_zero(2);
        hall.run(2);
        let why = hall.health.why(1);
        assert_eq!((hall.health.standing(1), why.code()), (HealthState::Error, "killed"));
        assert_eq!(why.to_string(), "the drive of its axis 1 was killed by moving error (register 211)");
        assert!(why.next().is_some_and(|next| next.contains("then home")));
        assert!(hall.told_hall().contains(&Event::Latched(Latch::Over)), "{:?}", hall.told_hall());
        if clears {
            hall.health.look_anew(1);
            hall.run(30);
            assert_eq!(hall.health.standing(1), HealthState::Excluded, "clearing does not home");
        }
        hall.health.on_homed(2);
        hall.run(30);
        assert_eq!(hall.health.standing(1), HealthState::Rejoining, "{clears}: {:?}", hall.changes());
    }
}

#[test]
fn a_controller_that_refuses_frames_is_in_error_until_a_read_finds_none() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(10);
    hall.answers_reads = false;
    hall.health.on_refused(2);
    hall.look();
    assert_eq!(hall.changes(), [(HealthState::Error, Why::Refuses(2))]);
    assert_eq!(hall.told_hall(), [Event::Latched(Latch::Held)]);
    hall.answers_reads = true;
    hall.run(30);
    assert_eq!(hall.health.standing(1), HealthState::Error);
    assert_eq!(hall.told_hall()[1..], [Event::Latched(Latch::Over)]);
}

#[test]
fn an_emergency_stop_at_a_controller_that_is_out_stops_the_hall_and_holds_up_nobody_until_it_takes_part() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.health.on_part(3, false);
    hall.observed(3, ESTOP);
    hall.look();
    assert_eq!(hall.told_hall(), [Event::EmergencyStop(3), Event::AllReleased]);
    hall.notices.clear();
    hall.look();
    assert_eq!(hall.told_hall(), []);
    hall.health.on_part(3, true);
    hall.look();
    assert_eq!(hall.told_hall(), [Event::EmergencyStop(3), Event::Latched(Latch::Held)]);
}

#[test]
fn the_hall_is_told_when_groups_that_take_part_are_held_and_when_they_wait_to_be_cleared() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.answers_reads = false;
    let latches = |hall: &mut Hall| {
        hall.look();
        let told = hall.told_hall();
        hall.notices.clear();
        told.into_iter().filter(|event| matches!(event, Event::Latched(_))).collect::<Vec<_>>()
    };
    hall.observed(0, What::Error(21));
    hall.observed(3, What::Error(12));
    assert_eq!(latches(&mut hall), [Event::Latched(Latch::Held)]);
    hall.observed(0, What::Error(0));
    assert_eq!(latches(&mut hall), []);
    hall.observed(3, What::Error(0));
    assert_eq!(latches(&mut hall), [Event::Latched(Latch::Over)]);
    [0, 1, 3].into_iter().for_each(|one| hall.health.on_part(one, false));
    assert_eq!(latches(&mut hall), [Event::Latched(Latch::Free)]);
}

#[test]
fn a_released_stop_that_holds_until_a_reset_holds_up_no_clear_and_its_seat_is_out_until_it_was_homed() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    hall.observed(3, ESTOP);
    hall.look();
    hall.observed(3, What::EmergencyStopHeld);
    hall.look();
    assert!(hall.told_hall().contains(&Event::AllReleased));
    assert_eq!(hall.health.standing(2), HealthState::Stopped, "latched");
    hall.health.look_anew(2);
    hall.run(30);
    assert_eq!(
        (hall.health.standing(2), hall.health.why(2)),
        (HealthState::Excluded, Why::HeldUntilReset(3))
    );
    hall.health.on_homed(3);
    hall.observed(3, What::EmergencyStopOver);
    hall.run(30);
    assert_eq!(hall.health.standing(2), HealthState::Rejoining);
}
