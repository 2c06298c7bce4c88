//! What comes late: answers and acks from before a seat was moved by hand, or from before the program was started anew.

use std::collections::BTreeMap;

use kinocue::harness::state::{LedBefore, State, Transition};

use super::cues::{KINDS, Kind};
use super::ether::{Ether, Weather};
use super::hall::{Hall, breaches, open};
use super::named::ether;
use super::seat::MS;

/// Three axes, six, two seats, and one axis at 1,000 frames a second.
const ALL: [Kind; 4] = [KINDS[0], KINDS[1], KINDS[6], KINDS[7]];

fn lead(kind: Kind, ether: &Ether, before: LedBefore, lead: impl FnOnce(&mut Hall<'_, '_>)) {
    open(ether, kind, before, &BTreeMap::new(), |hall| {
        hall.load(0);
        assert!(hall.comes_to(|state| matches!(state, State::Parked | State::Recovering), 1_500));
        lead(hall);
    });
}

#[track_caller]
fn assert_no_breach(kind: Kind, ether: &Ether) {
    let found: Vec<String> = breaches(ether).iter().take(4).map(ToString::to_string).collect();
    assert!(found.is_empty(), "{:?} at {} Hz: {found:#?}", kind.axes, kind.hz);
}

#[test]
fn an_ack_from_before_a_crash_is_not_taken_for_one_of_the_frame_of_that_number_after_it() {
    for kind in [KINDS[0], KINDS[7]] {
        let ether = ether(kind, |_| {});
        ether.world().lines[0].seat.put(0, 120.0);
        lead(kind, &ether, LedBefore::Ended, |hall| {
            hall.ask(Transition::Park);
            hall.pass(380);
            hall.ether.turns(0, Weather::HeldBack, 30);
            hall.pass(20);
        });
        ether.pass_to(ether.ns() + 50 * MS);
        lead(kind, &ether, LedBefore::Crashed, |hall| {
            hall.ask(Transition::Park);
            // About the time of the frame that was the last before.
            hall.pass(350);
            hall.ether.turns(0, Weather::Lost, 90);
            hall.pass(4_000);
        });
        assert_no_breach(kind, &ether);
    }
}

#[test]
fn a_seat_that_was_moved_while_its_answers_were_held_back_is_not_led_from_where_it_was_before() {
    for (kind, request) in ALL.iter().flat_map(|kind| [(*kind, Transition::Park), (*kind, Transition::Go)]) {
        let ether = ether(kind, |_| {});
        lead(kind, &ether, LedBefore::Ended, |hall| {
            hall.pass(400);
            if request == Transition::Go {
                hall.ask(Transition::HomeAndArm);
                assert!(hall.comes_to(|state| state == State::Armed, 10_000), "{:?}", hall.state);
                hall.pass(400);
            }
            hall.ether.turns(0, Weather::HeldBack, 700);
            hall.pass(370);
            assert!(hall.ether.jog(0, 0, 40.0, hall.ether.ns()));
            hall.pass(33);
            hall.ask(request);
            hall.pass(3_000);
        });
        assert_no_breach(kind, &ether);
    }
}

#[test]
fn nor_is_one_that_was_moved_while_its_way_was_planned() {
    for kind in ALL {
        let ether = ether(kind, |_| {});
        ether.world().lines.iter_mut().for_each(|line| line.seat.put(0, 60.0));
        lead(kind, &ether, LedBefore::Ended, |hall| {
            hall.planner_ns = 700 * MS;
            hall.ask(Transition::Park);
            hall.pass(450);
            hall.ether.turns(0, Weather::HeldBack, 600);
            hall.pass(50);
            assert!(hall.ether.jog(0, 0, 40.0, hall.ether.ns()));
            hall.pass(4_000);
        });
        assert_no_breach(kind, &ether);
    }
}

#[test]
fn whoever_closes_a_hall_in_a_pause_has_asked_for_its_park() {
    for kind in ALL {
        let ether = ether(kind, |_| {});
        open(&ether, kind, LedBefore::Ended, &BTreeMap::new(), |hall| {
            hall.ride(0);
            hall.pass(1_000);
            hall.ask(Transition::Pause);
            hall.pass(3_000);
            hall.leave();
            hall.pass(5_000);
        });
        assert_no_breach(kind, &ether);
    }
}

#[test]
fn whoever_is_refused_one_thing_has_asked_for_the_next_all_the_same() {
    for kind in ALL {
        let ether = ether(kind, |_| {});
        ether.world().lines[0].seat.put(0, 60.0);
        lead(kind, &ether, LedBefore::Ended, |hall| {
            hall.ask(Transition::Pause);
            hall.ask(Transition::Park);
            hall.pass(3_000);
        });
        assert_no_breach(kind, &ether);
    }
}
