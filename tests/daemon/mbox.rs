//! A hall of IMAX and MBOX controllers, which tell no count of their datagrams (DP34), no error number and no emergency stop.

use serde_json::Value;

use crate::hall::Hall;
use crate::printed::PrintedImax;

/// Serving and parked; the controllers say by an input that an emergency stop is pressed.
fn open() -> Hall {
    let mut hall = closed();
    hall.serve();
    hall.wait(|status| status["state"] == "parked" && all_stand(status, "ok"));
    hall
}

fn closed() -> Hall {
    Hall::closed(&["--dialect", "mbox"], as_mbox)
}

fn as_mbox(config: String) -> String {
    config.replace("seat = \"bench3\"", "seat = \"bench3\"\ndialect = \"mbox\"\nestop_inputs = [1]")
}

fn health(status: &Value, controller: usize) -> &str {
    // Right after the start nothing is told yet.
    status["controllers"][controller]["health"].as_str().unwrap_or_default()
}

fn all_stand(status: &Value, word: &str) -> bool {
    [0, 1].iter().all(|one| health(status, *one) == word)
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
        assert!([0, 1].iter().all(|one| ["ok", "degraded"].contains(&health(status, *one))), "{status}");
        status["cause"] == "the seats that take part have parked"
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
    let out = hall.wait(|status| health(status, 1) == "excluded");
    assert_eq!((out["state"].as_str(), health(&out, 0)), (Some("parked"), "ok"));
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
    hall.wait(|status| health(status, 1) == "error");
    hall.comes_to("parked");
    hall.wait(|status| told(status, "A2").contains("alarm of the servo drives, kind 12 (DPFE)"));
    hall.wait(|status| health(status, 0) == "ok");
    // Between shows the same alarm is found by the next look.
    hall.happens("1@err=11");
    let out = hall.wait(|status| health(status, 0) == "error");
    assert!(told(&out, "A1").contains("alarm of the servo drives, kind 11"), "{out}");
}

#[test]
fn an_emergency_stop_of_an_mbox_controller_is_seen_by_its_input_pressed_and_released_in_a_show_and_at_rest() {
    let hall = open();
    hall.play("night");
    // A few pulses up, its position would be a place in its stroke in either order of its words, and nobody would know where it is.
    hall.rises(1);
    hall.happens("2@X1=1");
    let pressed = hall.wait(|status| health(status, 1) == "stopped");
    assert_eq!(pressed["controllers"][1]["emergency_stop"], true, "{pressed}");
    hall.comes_to("stopped");
    hall.happens("2@X1=0");
    hall.wait(|status| status["controllers"][1]["emergency_stop"] == false);
    hall.done(&["clear"]);
    hall.wait(|status| status["state"] == "recovering" && health(status, 1) == "rejoining");
    // It holds until a reset (PA91 = 2).
    hall.done(&["home", "--seats-empty"]);
    hall.wait(|status| status["state"] == "parked" && all_stand(status, "ok"));
    // Pressed at rest it is shown at rest, though no frame goes.
    hall.happens("1@X1=1");
    let pressed = hall.wait(|status| health(status, 0) == "stopped");
    assert_eq!(pressed["controllers"][0]["emergency_stop"], true, "{pressed}");
}

#[test]
fn an_emergency_stop_is_heard_of_while_seats_home() {
    let mut hall = Hall::closed(&["--dialect", "mbox", "--homing-ms", "20000"], as_mbox);
    hall.serve();
    hall.wait(|status| status["state"] == "parked" && all_stand(status, "ok"));
    hall.done(&["home", "--seats-empty"]);
    hall.comes_to("homing");
    // What was known of their positions is over, and none is home before it was found at its zero.
    let unknown = |one: &Value| one["homed"] != true;
    hall.wait(|status| status["controllers"].as_array().expect("a list").iter().all(unknown));
    hall.happens("2@X1=1");
    let stopped = hall.comes_to("stopped");
    assert!(stopped["cause"].as_str().expect("text").contains("emergency stop"), "{stopped}");
}

#[test]
fn no_register_of_a_seat_that_another_machine_plays_is_written() {
    let hall = open();
    hall.play("night");
    hall.rises(1);
    let to = format!("{},name=A2,axes=3,dialect=mbox", hall.address(1));
    for value in ["dpf0=0", "PA95=3"] {
        let run = hall.run(&["register", "write", value, "--to", &to, "--bind", "127.0.0.1:0", "--yes"]);
        assert_eq!(run.code, Some(79), "{run:?}");
        assert!(run.stderr.contains("A2: moves, though nothing was sent to it from here"), "{run:?}");
    }
    assert_eq!(hall.status()["state"], "playing");
    assert!(all_stand(&hall.status(), "ok"));
}

#[test]
fn a_controller_with_registers_of_32_bits_is_out_in_words_and_nothing_moves() {
    let mut hall = closed();
    let (before, wide) = (hall.relay(1).to(), PrintedImax::start());
    hall.rewrite(|config| config.replace(&before, &wide.address));
    hall.launch();
    hall.serving().heard(|line| line.contains("registers of 32 bits").then_some(()));
    let out = hall.wait(|status| health(status, 1) == "error");
    assert!(told(&out, "A2").contains("answers with registers of 32 bits"), "{out}");
    assert_eq!(hall.run(&["arm"]).code, Some(75));
    assert_eq!((hall.relay(0).count(), wide.frames()), (0, 0), "no motion frame");
    assert!(wide.reads() > 0 && wide.writes() <= 1, "{} writes", wide.writes());
}
