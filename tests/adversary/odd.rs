//! Histories by chance in which something happens that is not of every day, each kind in a test of its own and from the same
//! seeds. `KINOCUE_SEED` and the others tell and shorten them as in `chance`; a test's name chooses the kind.

use super::bent::Bent;
use super::chance::{assert_at_most, setting, tell};

/// Where the histories begin that are always the same, and how many of them are played.
const FIXED_ODD: u64 = 13_000_000;
const COUNT: u64 = 500;

/// No more of them than are open yet, of the fixed ones, and of any others than that share, break the judge.
#[track_caller]
fn assert_no_more(bent: Bent, open: usize, share: f64) {
    let (seed, count) = (setting("KINOCUE_SEED"), setting("KINOCUE_HISTORIES").unwrap_or(COUNT));
    let first = seed.unwrap_or(FIXED_ODD);
    if count == 1 {
        return tell(first, Some(bent));
    }
    let is_fixed = seed.is_none() && count == COUNT;
    let most = if is_fixed { open } else { (share * count as f64).ceil() as usize };
    assert_at_most(most, first, count, Some(bent));
}

// Open: nothing tells of another master that moves a seat after its last answer, while the answers are on their way. What waits behind
// that master's long frame is not judged: no reading tells of a queue.
#[test]
fn no_more_histories_than_are_open_move_a_seat_too_fast_while_another_master_sends_to_it() {
    assert_no_more(Bent::Master, 0, 0.005);
}

#[test]
fn none_does_whose_seats_exchange_their_addresses() {
    assert_no_more(Bent::Exchange, 0, 0.0);
}

#[test]
fn none_does_whose_hall_opens_anew_with_another_configuration() {
    assert_no_more(Bent::Reload, 0, 0.0);
}

#[test]
fn none_does_whose_hall_takes_its_seats_to_have_fewer_axes_than_they_have() {
    assert_no_more(Bent::Fewer, 0, 0.0);
}

#[test]
fn none_does_of_imax_and_mbox_controllers() {
    assert_no_more(Bent::Mbox, 0, 0.0);
}

#[test]
fn none_does_whose_controllers_say_after_a_reboot_that_they_know_their_zero() {
    assert_no_more(Bent::Lie, 0, 0.0);
}

// Open: what was read of some axes may be some tenths of a second old where others are waited for; and at 1,000 frames a second
// 60 ms are too old.
#[test]
fn no_more_than_are_open_do_whose_controllers_answer_with_where_they_were_up_to_60_ms_before() {
    assert_no_more(Bent::Stale, 4, 0.02);
}

// Open: where the network repeats or loses answers as well it takes longer to see it.
#[test]
fn none_does_whose_seats_are_jogged_or_home_by_themselves_in_a_show_and_ack_what_they_do_not_execute() {
    assert_no_more(Bent::Deaf, 0, 0.002);
}

#[test]
fn nor_does_a_chair_with_a_turntable_that_is_turned_by_hand_while_its_power_is_off() {
    assert_no_more(Bent::Table, 0, 0.0);
}
