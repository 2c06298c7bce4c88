//! What a desk asks of a hall whose machine has just died.

use crate::house::House;

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
