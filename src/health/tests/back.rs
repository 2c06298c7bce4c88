//! How lost groups come back, or do not.

use super::*;

#[test]
fn lost_controllers_are_read_five_times_a_second() {
    let mut hall = Hall::with_lost();
    hall.run(1_000);
    let reads = hall.reads();
    assert!(reads.iter().all(|controller| *controller == 2));
    assert!((49..=51).contains(&reads.len()), "{} in ten seconds", reads.len());
}

#[test]
fn a_lost_controller_that_comes_back_as_it_was_rejoins() {
    let mut hall = Hall::with_lost();
    hall.back();
    hall.run(21);
    assert_eq!(hall.changes(), [(HealthState::Rejoining, Why::SeenAgain)]);
    hall.run(200);
    assert_eq!(hall.health.standing(1), HealthState::Rejoining, "until it has joined");
    hall.health.on_joined(1);
    assert_eq!(hall.health.standing(1), HealthState::Ok);
    hall.silence(&[2]);
    hall.run(30);
    assert_eq!(hall.health.standing(1), HealthState::Lost);
}

#[test]
fn a_controller_that_is_lost_again_while_it_rejoins_is_lost() {
    let mut hall = Hall::with_lost();
    hall.back();
    hall.run(21);
    hall.silence(&[2]);
    hall.run(40);
    assert_eq!(hall.health.standing(1), HealthState::Lost);
}

#[test]
fn a_controller_that_rebooted_is_out_until_it_was_homed_and_seen() {
    let mut hall = Hall::with_lost();
    hall.packets[2] = 40;
    hall.back();
    hall.run(21);
    assert_eq!(hall.changes(), [(HealthState::Excluded, Why::Rebooted(2))]);
    assert_eq!(hall.told_hall(), [Event::Rebooted(2)]);
    hall.run(300);
    assert_eq!(hall.health.standing(1), HealthState::Excluded);
    hall.health.look_anew(1);
    hall.run(30);
    assert_eq!(hall.health.standing(1), HealthState::Excluded, "clearing does not home");
    hall.health.on_homed(2);
    hall.run(2);
    assert_eq!(hall.health.standing(1), HealthState::Rejoining);
}

#[test]
fn a_controller_that_is_not_home_or_is_another_is_out() {
    let same = Hall::with_lost().sighting(2);
    let other = Identity { work_mode: 5, ..IDENTITY };
    for (sighting, why) in [
        (Sighting { homed: false, ..same }, Why::NotHome(2)),
        (Sighting { identity: other, ..same }, Why::Other(2)),
        (Sighting { continuity: Continuity::Answers, ..same }, Why::Unproved(2)),
    ] {
        let mut hall = Hall::with_lost();
        hall.health.on_read_sent(2, 1);
        hall.health.on_sighting(2, &sighting, hall.now);
        hall.look();
        assert_eq!((hall.health.standing(1), hall.health.why(1)), (HealthState::Excluded, why));
    }
}

#[test]
fn a_controller_that_was_never_read_before_it_was_lost_cannot_prove_that_it_did_not_reboot() {
    let mut health = Hall {
        health: HealthTable::new(Groups::named(["A"; 4]), LossPolicy::Park, 1, TICK),
        ..Hall::with_lost()
    };
    health.answers_reads = false;
    health.run(100);
    assert_eq!(health.health.standing(0), HealthState::Lost);
    health.answers_reads = true;
    health.ack_after = vec![Some(TICK); 4];
    health.run(30);
    assert_eq!(health.health.standing(0), HealthState::Excluded);
    assert!(matches!(health.health.why(0), Why::Unproved(_)));
}

#[test]
fn acks_and_reports_do_not_bring_a_lost_controller_back_nor_does_a_sighting_that_nobody_asked_for() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.answers_reads = false;
    hall.silence(&[2]);
    hall.run(40);
    assert_eq!(hall.changes().pop(), Some((HealthState::Lost, Why::Silent(2))));
    hall.notices.clear();
    for frame in 1..=hall.frame + 50 {
        hall.health.on_ack(2, FrameNo(frame), hall.now);
        hall.health.on_status(2, hall.now);
    }
    let sighting = hall.sighting(2);
    hall.now = hall.now + TICK;
    hall.health.on_sighting(2, &sighting, hall.now);
    hall.look();
    assert_eq!(hall.changes(), []);
}

#[test]
fn a_counter_is_read_again_before_too_many_frames_that_did_not_ask_make_it_prove_nothing() {
    let period = Duration::from_millis(1);
    let mut hall = Hall::asking(LossPolicy::Continue, 10, period);
    (0..30_000).for_each(|_| hall.tick_after(period));
    let reads = hall.reads().into_iter().filter(|controller| *controller == 2).count();
    // Sooner at first, while it has counted little.
    assert!((2..=8).contains(&reads), "{reads} in 30 s");
    hall.silence(&[2]);
    (0..400).for_each(|_| hall.tick_after(period));
    hall.back();
    (0..300).for_each(|_| hall.tick_after(period));
    assert_eq!(hall.health.standing(1), HealthState::Rejoining);
}

#[test]
fn repeated_and_reordered_acks_do_not_shake_the_proof_by_the_counter() {
    let mut hall = Hall::new(LossPolicy::Continue);
    for _ in 0..200 {
        hall.tick();
        let newest = hall.frame;
        for frame in newest.saturating_sub(20)..=newest {
            hall.health.on_ack(2, FrameNo(frame), hall.now);
        }
    }
    hall.silence(&[2]);
    hall.run(40);
    hall.back();
    hall.run(30);
    assert_eq!(hall.health.standing(1), HealthState::Rejoining);
}

#[test]
fn datagrams_that_the_network_holds_back_are_not_another_masters_when_they_come_after_the_seat_is_back() {
    for (rival, is_alone) in [(0, true), (200, false)] {
        let mut hall = Hall::new(LossPolicy::Continue);
        hall.run(150);
        hall.silence(&[2]);
        hall.run(40);
        hall.health.on_other_sent(2, 300); // all of them are held back
        hall.back();
        hall.run(30);
        hall.health.on_joined(1);
        hall.run(150);
        assert_eq!(hall.health.standing(1), HealthState::Ok);
        hall.notices.clear();
        hall.packets[2] += 300 + rival;
        hall.run(200);
        let told = hall.told_hall().contains(&Event::Trouble(Trouble::OtherMaster(2)));
        assert_eq!(told, !is_alone, "{:?}", hall.changes());
    }
}

#[test]
fn old_acks_that_come_late_keep_nobody_alive() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    let first = hall.frame + 1;
    for _ in 0..30 {
        hall.frame += 1;
        hall.health.on_sent(2, FrameNo(hall.frame), true, hall.now);
    }
    // The newest is acked first, and the others one by one, whenever a frame is sent.
    hall.health.on_ack(2, FrameNo(hall.frame), hall.now);
    hall.silence(&[2]);
    for old in first..first + 29 {
        hall.tick();
        hall.health.on_ack(2, FrameNo(old), hall.now);
    }
    assert_eq!(hall.health.standing(1), HealthState::Lost);
}

#[test]
fn a_seat_is_back_only_when_all_its_controllers_are() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    hall.silence(&[0, 1]);
    hall.run(40);
    hall.ack_after[1] = Some(TICK);
    hall.run(100);
    assert_eq!(hall.health.standing(0), HealthState::Lost);
    hall.ack_after[0] = Some(TICK);
    hall.run(30);
    assert_eq!(hall.health.standing(0), HealthState::Rejoining);
}

#[test]
fn a_seat_that_was_moved_at_rest_is_out_until_it_was_seen_and_says_so_until_it_has_joined() {
    let mut hall = Hall::new(LossPolicy::Park);
    hall.health.on_moved(2);
    hall.run(1);
    assert_eq!(hall.changes(), [(HealthState::Lost, Why::Moved(2))]);
    hall.notices.clear();
    hall.run(21);
    assert_eq!(hall.changes(), [(HealthState::Rejoining, Why::Moved(2))]);
    hall.run(100);
    hall.health.on_joined(1);
    hall.run(100);
    assert_eq!(
        (hall.health.standing(1), hall.health.why(1)),
        (HealthState::Ok, Why::Acked),
        "it was moved once"
    );
}

#[test]
fn another_master_is_a_fault_of_the_hall_and_its_seat_has_to_be_homed() {
    let mut hall = Hall::with_lost();
    hall.packets[2] += 5_000;
    hall.back();
    hall.run(21);
    assert_eq!(hall.changes(), [(HealthState::Excluded, Why::OtherMaster(2))]);
    assert_eq!(hall.told_hall(), [Event::Trouble(Trouble::OtherMaster(2)), Event::Rebooted(2)]);
    hall.notices.clear();
    hall.health.look_anew(1);
    hall.run(100);
    assert_eq!(hall.changes(), [(HealthState::Excluded, Why::OtherMaster(2))]);
    assert_eq!(hall.told_hall(), [Event::Rebooted(2)], "once cleared it is no fault any more");
}

#[test]
fn a_hall_moves_no_controller_that_does_not_know_its_zero_whenever_it_is_first_seen() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.health =
        HealthTable::new(Groups::named(["A1", "A1", "A2", "A3"]), LossPolicy::Continue, 1, TICK).of_a_hall();
    hall.homed = false;
    hall.health.look_anew(1);
    hall.run(2);
    assert_eq!((hall.health.standing(1), hall.health.why(1)), (HealthState::Excluded, Why::NotHome(2)));
    hall.homed = true;
    hall.health.on_homed(2);
    hall.run(30);
    assert_eq!(hall.health.standing(1), HealthState::Rejoining);
}

#[test]
fn a_controller_that_is_reset_while_nothing_moves_is_out_within_two_seconds() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.health =
        HealthTable::new(Groups::named(["A1", "A1", "A2", "A3"]), LossPolicy::Continue, 1, TICK).of_a_hall();
    let beat = |hall: &mut Hall| {
        hall.now = hall.now + Duration::from_millis(250);
        for controller in 0..4 {
            hall.health.on_beat_sent(controller, hall.now);
            hall.packets[controller] += 1;
            hall.health.on_status(controller, hall.now);
        }
        hall.look();
    };
    (0..8).for_each(|_| beat(&mut hall));
    let reads = hall.reads().len();
    assert!((8..=16).contains(&reads), "{reads} reads of four controllers in two seconds");
    assert_eq!(hall.standings(), [HealthState::Ok; 3]);
    hall.homed = false;
    (0..8).for_each(|_| beat(&mut hall));
    assert_eq!(hall.standings(), [HealthState::Excluded; 3]);
    assert_eq!(hall.health.why(1), Why::NotHome(2));
}
