//! Emergency stops, errors and dead controllers while nothing moves, and what a person does about each.

use serde_json::Value;

use crate::hall::Hall;

fn health(status: &Value, controller: usize) -> &str {
    status["controllers"][controller]["health"].as_str().expect("a word")
}

/// Stopped by an emergency stop at the first controller, of which its replies alone tell.
fn pressed_at_rest() -> Hall {
    let hall = Hall::open();
    hall.wait(|status| [0, 1].iter().all(|one| health(status, *one) == "ok"));
    // It is over as soon as it is released.
    hall.happens("pa91=0");
    hall.happens("1@estop=1");
    let stopped = hall.comes_to("stopped");
    assert_eq!(stopped["cause"], "A1: emergency stop");
    hall
}

/// What is named to be done next is done, as far as it is a command.
fn cleared_and_parked(hall: &Hall) {
    hall.wait(|status| status["next"] == "clear, then park or home");
    hall.done(&["clear"]);
    hall.wait(|status| status["next"] == "park, or home");
    hall.done(&["park"]);
    hall.comes_to("parked");
}

#[test]
fn an_emergency_stop_pressed_at_rest_is_shown_and_nothing_is_armed_until_it_was_released_and_cleared() {
    let hall = pressed_at_rest();
    assert!(hall.status()["next"].as_str().expect("text").starts_with("release the emergency-stop button"));
    for refused in ["arm", "clear", "park"] {
        assert_eq!(hall.run(&[refused]).code, Some(75), "{refused}");
    }
    hall.happens("1@estop=0");
    cleared_and_parked(&hall);
    hall.happens("pa91=2");
    hall.arm("ride");
    assert!(hall.end().rest_in_park());
}

#[test]
fn an_emergency_stop_in_mid_show_is_cleared_once_it_was_released_though_no_frame_is_sent() {
    let hall = Hall::open();
    hall.play("night");
    hall.lives_on(100); // far from park
    hall.happens("pa91=0");
    hall.happens("2@estop=1");
    assert_eq!(hall.comes_to("stopped")["cause"], "A2: emergency stop");
    assert_eq!(hall.run(&["clear"]).code, Some(75));
    hall.happens("2@estop=0");
    cleared_and_parked(&hall);
    let seen = hall.end();
    assert!(seen.rest_in_park(), "{:?}", seen.controllers);
}

#[test]
fn what_is_pressed_stays_so_through_a_reload_and_clear_is_refused() {
    let hall = pressed_at_rest();
    hall.done(&["reload"]);
    hall.serving().heard(|line| line.contains("before the configuration was reloaded").then_some(()));
    // The first looks of the new hall may still be under way.
    assert_eq!(hall.run(&["clear"]).code, Some(75));
    hall.lives_on(30);
    let stopped = hall.wait(|status| status["cause"] == "A1: emergency stop");
    assert_eq!(stopped["state"], "stopped");
    assert_eq!(hall.run(&["clear"]).code, Some(75));
    hall.happens("1@estop=0");
    cleared_and_parked(&hall);
}

#[test]
fn a_dead_controller_holds_up_neither_clear_nor_park_of_the_others_be_it_out_or_not() {
    let hall = Hall::open();
    hall.play("night");
    hall.rises(0);
    hall.relay(1).pull();
    hall.wait(|status| health(status, 1) == "lost");
    hall.done(&["stop"]);
    hall.comes_to("stopped");
    cleared_and_parked(&hall);
    hall.done(&["disable", "A2"]);
    hall.done(&["stop"]);
    cleared_and_parked(&hall);
    let seen = hall.status();
    assert_eq!((health(&seen, 0), health(&seen, 1)), ("ok", "lost"));
}

#[test]
fn a_hall_whose_seats_are_all_out_says_that_none_takes_part() {
    let hall = Hall::open();
    let says_so = |status: &Value| {
        status["warnings"].as_array().expect("a list").iter().any(|one| one["id"] == "no-seat")
    };
    hall.done(&["disable", "A1"]);
    assert!(!says_so(&hall.lives_on(30)), "there is another");
    hall.done(&["disable", "A2"]);
    hall.wait(says_so);
    hall.done(&["enable", "A1"]);
    hall.wait(|status| !says_so(status));
}

#[test]
fn an_emergency_stop_at_a_seat_that_is_out_holds_up_nobody_and_the_seat_stays_out() {
    let hall = pressed_at_rest();
    hall.done(&["disable", "A1"]);
    cleared_and_parked(&hall);
    let refused = hall.run(&["enable", "A1"]);
    assert!(refused.code == Some(75) && refused.stderr.contains("release its button"), "{refused:?}");
    hall.happens("1@estop=0");
    hall.wait(|status| status["controllers"][0]["emergency_stop"] == false);
    hall.done(&["enable", "A1"]);
    cleared_and_parked(&hall);
    hall.wait(|status| health(status, 0) == "ok");
}

#[test]
fn an_error_while_parked_is_put_right_and_cleared_and_preflight_blames_nobody_else() {
    let hall = Hall::open();
    hall.happens("1@err=12");
    let put_right = "clear the error at the controller, then clear the hall; or disable its seat";
    let wrong = hall.wait(|status| status["next"] == put_right);
    assert_eq!((wrong["state"].as_str(), wrong["may_clear"].as_bool()), (Some("parked"), Some(false)));
    assert_eq!(health(&wrong, 0), "error");
    let refused = hall.run(&["clear"]);
    assert!(
        refused.code == Some(75) && refused.stderr.contains("clear the error at the controller"),
        "{refused:?}"
    );
    let preflight = hall.run(&["preflight"]);
    assert!(!preflight.stdout.contains("other-master"), "{preflight:?}");
    hall.happens("1@err=0");
    hall.wait(|status| status["may_clear"] == true);
    cleared_and_parked(&hall);
    hall.wait(|status| health(status, 0) == "ok");
    hall.arm("ride");
}

#[test]
fn an_emergency_stop_that_its_controller_holds_until_a_reset_is_cleared_and_its_seat_homed() {
    let hall = Hall::open();
    hall.play("night");
    hall.happens("1@X1=1");
    hall.comes_to("stopped");
    hall.lives_on(30);
    assert_eq!(hall.run(&["clear"]).code, Some(75), "it is pressed");
    hall.happens("1@X1=0");
    hall.wait(|status| status["next"] == "clear, then park or home");
    hall.done(&["clear"]);
    let out = hall.wait(|status| health(status, 0) == "excluded");
    assert!(out["controllers"][0]["why"].as_str().expect("text").contains("until a reset"), "{out}");
    hall.wait(|status| status["next"].as_str().is_some_and(|next| next.starts_with("home, with nobody")));
    hall.done(&["home", "--seats-empty"]);
    hall.wait(|status| status["state"] == "parked" && health(status, 0) == "ok");
    hall.arm("ride");
    hall.done(&["go"]);
    hall.wait(|status| status["cause"] == "the seats that take part have parked");
    assert!(hall.end().rest_in_park());
}
