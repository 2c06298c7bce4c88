//! A hall of IMAX and MBOX controllers, which tell no count of their datagrams (DP34), no error number and no emergency stop.

use serde_json::Value;

use crate::hall::Hall;

/// Serving and parked; the controllers say by an input that an emergency stop is pressed.
fn open() -> Hall {
    let mut hall = closed();
    hall.serve();
    hall.wait(|status| status["state"] == "parked" && all_stand(status, "ok"));
    hall
}

fn closed() -> Hall {
    Hall::closed(&["--dialect", "mbox"], |config| {
        config.replace("seat = \"bench3\"", "seat = \"bench3\"\ndialect = \"mbox\"\nestop_inputs = [1]")
    })
}

fn standing(status: &Value, controller: usize) -> &str {
    status["controllers"][controller]["standing"].as_str().expect("a word")
}

fn all_stand(status: &Value, word: &str) -> bool {
    [0, 1].iter().all(|one| standing(status, *one) == word)
}

/// What the status says of a controller that is out.
fn told(status: &Value, controller: &str) -> String {
    let warnings = status["warnings"].as_array().expect("a list");
    let of = |one: &&Value| one["controller"] == controller && one["severity"] == "error";
    warnings.iter().find(of).map_or_else(String::new, |one| one["text"].as_str().expect("text").to_owned())
}

/// Lives on for seconds, in each of which all are looked at, and never hears that one stands otherwise than well.
fn stays_well(hall: &Hall, seconds: u64) {
    let ticks = |status: &Value| status["ticks"].as_u64();
    let mut until = None;
    hall.wait(|status| {
        let now = ticks(status).expect("a count");
        assert!(all_stand(status, "ok"), "{status}");
        now >= *until.get_or_insert(now + 100 * seconds)
    });
}

#[test]
fn a_hall_of_mbox_controllers_rests_homes_and_plays_and_is_well_all_the_while() {
    let mut hall = open();
    stays_well(&hall, 5);
    hall.done(&["home", "--seats-empty"]);
    hall.wait(|status| status["state"] == "parked" && all_stand(status, "ok"));
    stays_well(&hall, 4);
    hall.arm("ride");
    stays_well(&hall, 2);
    hall.done(&["go"]);
    hall.wait(|status| {
        assert!([0, 1].iter().all(|one| ["ok", "degraded"].contains(&standing(status, *one))), "{status}");
        status["cause"] == "the seats have parked"
    });
    hall.wait(|status| all_stand(status, "ok"));
    stays_well(&hall, 2);
    let lines = hall.close();
    assert!(!lines.iter().any(|line| line.contains("excluded")), "{lines:?}");
    let show = hall.journal("show").remove(0);
    assert_eq!(show["outcome"]["result"], "completed", "{show}");
    assert_eq!(show["outcome"]["refused"], 0, "{show}");
    let seen = hall.end();
    assert!(seen.farthest(0) > 25_000, "15 mm are 30,000 pulses: {}", seen.farthest(0));
    assert!(seen.rest_in_park(), "{:?}", seen.controllers);
}

#[test]
fn an_mbox_controller_that_reboots_between_shows_is_out_until_it_was_homed() {
    let hall = open();
    hall.happens("2@reboot");
    let out = hall.wait(|status| standing(status, 1) == "excluded");
    assert_eq!((out["state"].as_str(), standing(&out, 0)), (Some("parked"), "ok"));
    assert!(told(&out, "A2").contains("it may have rebooted"), "{out}");
    hall.done(&["home", "--seats-empty"]);
    hall.wait(|status| status["state"] == "parked" && all_stand(status, "ok"));
    stays_well(&hall, 2);
}

#[test]
fn an_alarm_of_the_servo_drives_is_named_and_parks_a_hall_of_mbox_controllers() {
    let hall = open();
    hall.play("night");
    hall.rises(0);
    hall.happens("2@err=12");
    hall.wait(|status| standing(status, 1) == "error");
    hall.comes_to("parked");
    hall.wait(|status| told(status, "A2").contains("alarm of the servo drives, kind 12 (DPFE)"));
    hall.wait(|status| standing(status, 0) == "ok");
    // Between shows the same alarm is found by the next look.
    hall.happens("1@err=11");
    let out = hall.wait(|status| standing(status, 0) == "error");
    assert!(told(&out, "A1").contains("alarm of the servo drives, kind 11"), "{out}");
}
