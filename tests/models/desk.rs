//! What operators set, and the stop: from anyone to the tick thread.

use std::collections::BTreeSet;

use loom::sync::Arc;
use loom::thread;

use super::engine::Mix;
use super::every_order;

#[allow(dead_code, reason = "models need a part of it")]
#[path = "../../src/rt/desk.rs"]
mod program;

use program::Desk;

const OFF: Mix = Mix { motion: 1.0, vibration: 1.0, effects: 0, switches: 0, on: false };
const ON: Mix = Mix { motion: 0.25, vibration: 0.5, effects: 1, switches: 1, on: true };

#[test]
fn no_stop_is_lost_and_each_is_taken_once_whoever_asks_for_it_meanwhile() {
    let taken = every_order(|| {
        let desk = Arc::new(Desk::new(std::iter::empty()));
        let [tick, other] = [(), ()].map(|()| Arc::clone(&desk));
        let ticks = thread::spawn(move || [tick.take_stop(), tick.take_stop()]);
        let person = thread::spawn(move || other.stop());
        desk.stop();
        person.join().unwrap();
        let before = ticks.join().unwrap();
        let after = [desk.take_stop(), desk.take_stop()];
        assert!(!after[1], "a stop that was taken is over");
        before.into_iter().chain(after).filter(|taken| *taken).count()
    });
    assert_eq!(taken, BTreeSet::from([1, 2]), "both at once are one");
}

#[test]
fn a_seat_that_is_put_on_at_another_level_is_never_on_at_the_one_before() {
    let seen = every_order(|| {
        let desk = Arc::new(Desk::new([OFF].into_iter()));
        let tick = Arc::clone(&desk);
        let reads = thread::spawn(move || tick.mix(0));
        desk.set(0, ON);
        let seen = reads.join().unwrap();
        assert!(!seen.on || seen == ON, "{seen:?}");
        seen.on
    });
    assert_eq!(seen, BTreeSet::from([false, true]));
}

#[test]
fn a_seat_that_is_left_out_stays_so_while_somebody_else_sets_its_level() {
    let on = every_order(|| {
        let desk = Arc::new(Desk::new([ON].into_iter()));
        let keys = Arc::clone(&desk);
        let sets = thread::spawn(move || keys.set_levels(0, 0.5, 0.5));
        desk.leave_out(0);
        sets.join().unwrap();
        assert_eq!(desk.mix(0), Mix { motion: 0.5, vibration: 0.5, on: false, ..ON });
        desk.mix(0).on
    });
    assert_eq!(on, BTreeSet::from([false]));
}
