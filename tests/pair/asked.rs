//! What a desk asks of a hall whose machine has just died.

use rustix::process::Signal;

use crate::house::{House, pair_troubles};

#[test]
fn a_stop_that_is_asked_in_the_middle_of_a_takeover_is_taken_by_the_machine_that_leads_then() {
    let Some(mut house) = House::playing() else { return };
    house.shows[0].kill();
    let run = house.desk(&["stop"]);
    house.shows[1].leads("B", "stopped");
    house.shows[1].comes_to("stopped");
    assert!(matches!(run.code, Some(0 | 75)), "it came in time for an answer or not: {run:?}");
    assert_eq!(house.shows[1].run(&["resume"]).code, Some(75), "what was stopped stays so");
    house.ends();
}

#[test]
fn what_a_machine_was_about_for_a_desk_as_it_died_is_said_to_be_unanswered_and_not_waited_for() {
    let Some(mut house) = House::open() else { return };
    house.start(0);
    house.start(1);
    house.shows[0].leads("A", "parked");
    house.shows[0].wait(|status| status["state"] == "parked" && pair_troubles(status).is_empty());
    // Of one that is silent preflight waits for an answer.
    house.signal_seat(1, Signal::STOP);
    let asked = house.begin_at_desk(&["preflight", "all"]);
    house.shows[0].wait(|status| status["job"] == "preflight");
    house.shows[0].kill();
    let run = asked.finish();
    assert!(run.code == Some(75) && run.stdout.contains("hung up"), "its link has seen it: {run:?}");
    house.signal_seat(1, Signal::CONT);
    house.shows[1].leads("B", "recovering");
    house.ends();
}
