//! Controllers that do not count the datagrams they receive: IMAX and MBOX.

use super::*;

/// What the hall of [`Hall::new`] is, at rest, with controllers that count nothing and have to be home.
fn at_rest() -> Hall {
    let mut hall = Hall::new(LossPolicy::Continue);
    let groups = Groups::named(["A1", "A1", "A2", "A3"]);
    hall.counts = false;
    hall.health = HealthTable::new(groups, LossPolicy::Continue, 1, TICK).of_a_hall();
    (0..3).for_each(|group| hall.health.look_anew(group));
    hall.run(2);
    (0..3).for_each(|group| hall.health.on_joined(group));
    assert_eq!(hall.standings(), [HealthState::Ok; 3]);
    hall.notices.clear();
    hall
}

/// A quarter of a second at rest, in which each controller is asked, and answers unless its plug is out.
fn beat(hall: &mut Hall) {
    hall.now = hall.now + Duration::from_millis(250);
    for controller in 0..4 {
        hall.health.on_beat_sent(controller, hall.now);
        if hall.ack_after[controller].is_some() {
            hall.health.on_status(controller, hall.now + Duration::from_millis(1));
        }
    }
    hall.look();
}

fn unplug(hall: &mut Hall, span: Duration) {
    hall.silence(&[2]);
    let until = hall.now + span;
    while hall.now < until {
        hall.tick();
    }
    hall.back();
}

#[test]
fn a_hall_that_counts_nothing_stays_well_at_rest_in_a_show_and_after_it() {
    let mut hall = at_rest();
    (0..240).for_each(|_| beat(&mut hall));
    let looks = hall.reads().len();
    assert!((200..=260).contains(&looks), "{looks} looks at four controllers in a minute");
    hall.run(6_000);
    (0..40).for_each(|_| beat(&mut hall));
    assert_eq!(hall.changes(), []);
    assert_eq!(hall.standings(), [HealthState::Ok; 3]);
}

#[test]
fn one_that_counts_nothing_is_well_after_homing_too_and_stays_so() {
    let mut hall = at_rest();
    for controller in 0..4 {
        hall.health.on_homed(controller);
    }
    (0..3).for_each(|group| hall.health.look_anew(group));
    hall.run(30);
    assert_eq!(hall.standings(), [HealthState::Rejoining; 3]);
    (0..3).for_each(|group| hall.health.on_joined(group));
    (0..40).for_each(|_| beat(&mut hall));
    assert_eq!(hall.standings(), [HealthState::Ok; 3]);
}

#[test]
fn one_that_counts_nothing_comes_back_after_a_silence_too_short_for_a_reboot_and_after_no_longer_one() {
    for (silent_ms, standing) in [(400, HealthState::Rejoining), (1_000, HealthState::Excluded)] {
        let mut hall = at_rest();
        hall.run(100);
        unplug(&mut hall, Duration::from_millis(silent_ms));
        assert_eq!(hall.health.standing(1), HealthState::Lost);
        hall.run(30);
        assert_eq!(hall.health.standing(1), standing, "{silent_ms} ms");
        if standing == HealthState::Excluded {
            assert_eq!(hall.health.why(1), Why::Gap(2));
            hall.health.look_anew(1);
            hall.run(30);
            assert_eq!(hall.health.why(1), Why::Gap(2), "clearing does not home");
            hall.health.on_homed(2);
            hall.run(30);
        }
        assert_eq!(hall.health.standing(1), HealthState::Rejoining);
    }
}

#[test]
fn one_that_counts_nothing_and_was_not_asked_for_a_while_has_left_nothing_unanswered() {
    let mut hall = at_rest();
    (0..8).for_each(|_| beat(&mut hall));
    hall.now = hall.now + Duration::from_secs(20);
    (0..8).for_each(|_| beat(&mut hall));
    assert_eq!(hall.changes(), []);
}

#[test]
fn one_that_counts_nothing_and_is_reset_in_mid_show_is_out_within_two_seconds() {
    let mut hall = at_rest();
    hall.run(500);
    hall.homed = false;
    hall.run(200);
    assert_eq!((hall.health.standing(1), hall.health.why(1)), (HealthState::Excluded, Why::NotHome(2)));
}

#[test]
fn an_alarm_of_the_drives_that_is_reported_or_read_parks_the_hall_until_it_is_over_and_cleared() {
    for reported in [true, false] {
        let mut hall = at_rest();
        hall.run(100);
        hall.alarm = 12;
        if reported {
            hall.observed(2, What::Alarm { register: DPFE, value: 12 });
        }
        hall.run(110);
        let alarm = Why::Alarm { controller: 2, register: DPFE, value: 12 };
        assert_eq!((hall.health.standing(1), hall.health.why(1)), (HealthState::Error, alarm));
        assert_eq!(alarm.to_string(), "alarm of the servo drives, kind 12 (DPFE)");
        assert!(hall.told_hall().contains(&Event::Policy(Demand::Park, 1)), "{:?}", hall.told_hall());
        hall.alarm = 0;
        hall.run(30);
        assert!(hall.told_hall().ends_with(&[Event::Latched(Latch::Over)]));
        assert_eq!(hall.health.standing(1), HealthState::Error, "latched");
        hall.health.look_anew(1);
        hall.run(30);
        assert_eq!(hall.health.standing(1), HealthState::Rejoining);
    }
}

#[test]
fn a_refusal_is_explained_by_the_alarm_that_is_read_and_then_the_hall_parks() {
    let mut hall = at_rest();
    hall.run(100);
    (hall.alarm, hall.answers_reads) = (12, false);
    hall.health.on_refused(2);
    hall.look();
    assert_eq!((hall.health.why(1), hall.told_hall()), (Why::Refuses(2), vec![Event::Latched(Latch::Held)]));
    hall.answers_reads = true;
    hall.run(30);
    assert_eq!(hall.health.why(1), Why::Alarm { controller: 2, register: DPFE, value: 12 });
    assert_eq!(hall.told_hall()[1..], [Event::Policy(Demand::Park, 1)], "once");
    let told = hall.changes();
    assert_eq!(told.iter().filter(|(standing, _)| *standing == HealthState::Error).count(), 2, "{told:?}");
}

#[test]
fn whatever_else_is_reported_unasked_is_an_error_until_a_look_finds_none() {
    let mut hall = at_rest();
    hall.observed(2, What::Alarm { register: 0x5e, value: 1 });
    hall.answers_reads = false;
    hall.look();
    assert_eq!(hall.health.why(1), Why::Alarm { controller: 2, register: 0x5e, value: 1 });
    assert_eq!(hall.told_hall(), [Event::Latched(Latch::Held)]);
    hall.answers_reads = true;
    hall.run(30);
    assert_eq!(hall.told_hall()[1..], [Event::Latched(Latch::Over)]);
}

#[test]
fn registers_of_32_bits_are_an_error_in_words_and_no_position() {
    let mut hall = at_rest();
    hall.health.on_wide_registers(3);
    hall.look();
    assert_eq!((hall.health.standing(2), hall.health.why(2)), (HealthState::Error, Why::Wide(3)));
    assert!(Why::Wide(3).next().unwrap().contains("disable it"));
}
