//! What the service manager sends: SIGTERM ends it, SIGHUP has it read its configuration anew.

use std::net::UdpSocket;

use rustix::process::Signal;
use serde_json::Value;

use crate::hall::Hall;

fn notes(status: &Value) -> String {
    let warnings = status["warnings"].as_array().expect("a list").iter();
    warnings.filter(|one| one["id"] == "note").map(|one| one["text"].as_str().expect("text")).collect()
}

#[test]
fn told_to_end_in_mid_show_it_parks_the_seats_however_often_it_is_told_and_the_next_start_is_parked() {
    let mut hall = Hall::open();
    hall.play("night");
    hall.rises(0);
    hall.serving().signal(Signal::TERM);
    hall.serving().heard(|line| line.contains("parking: ").then_some(()));
    let lines = hall.close();
    assert!(lines.iter().any(|line| line.contains("parked: ")), "{lines:?}");
    assert_eq!(hall.journal("show")[0]["outcome"]["result"], "stopped");
    hall.serve();
    hall.comes_to("parked");
    let seen = hall.end();
    assert!(seen.rest_in_park(), "{:?}", seen.controllers);
}

#[test]
fn a_configuration_is_read_anew_upon_a_signal_and_what_was_set_stays() {
    let mut hall = Hall::open();
    hall.done(&["level", "motion", "60%"]);
    hall.done(&["load", "ride"]);
    hall.rewrite(|config| config.replace("Hall 1", "Hall 2"));
    hall.serving().signal(Signal::HUP);
    let is_well = |status: &Value| status["state"] == "parked" && status["controllers"][1]["health"] == "ok";
    let anew = hall.wait(|status| status["hall"] == "Hall 2" && is_well(status));
    assert_eq!(anew["levels"]["motion"], 0.6);
    hall.wait(|status| status["show"]["cue"] == "ride");
    hall.arm("ride");
    hall.close();
    let acts = hall.journal("action");
    let act = acts.iter().find(|act| act["what"] == "reload").expect("it is written down");
    assert!(act["who"].as_str().unwrap().contains("signal"), "{act}");
    assert_eq!(hall.end().motion(), 0);
}

#[test]
fn a_bad_configuration_is_kept_out_with_file_line_and_reason_each_time() {
    let hall = Hall::open();
    for (bad, reason) in [("rate_hz = 2000", "2000"), ("rate_hz = 3000", "3000")] {
        hall.rewrite(|config| {
            config
                .lines()
                .map(|line| if line.starts_with("rate_hz") { bad } else { line })
                .collect::<Vec<_>>()
                .join("\n")
        });
        hall.serving().signal(Signal::HUP);
        hall.serving().heard(|line| (line.contains("hall.toml:4:") && line.contains(reason)).then_some(()));
        let status = hall.wait(|status| notes(status).contains(reason));
        assert_eq!((status["state"].as_str(), status["rate_hz"].as_f64()), (Some("parked"), Some(100.0)));
    }
    let run = hall.run(&["reload"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stderr.contains("hall.toml:4:"), "{run:?}");
}

#[test]
fn no_configuration_is_read_while_the_hall_is_armed() {
    let hall = Hall::open();
    hall.arm("ride");
    hall.rewrite(|config| config.replace("Hall 1", "Hall 2"));
    hall.serving().signal(Signal::HUP);
    let status = hall.wait(|status| notes(status).contains("while armed"));
    assert_eq!((status["hall"].as_str(), status["state"].as_str()), (Some("Hall 1"), Some("armed")));
    assert_eq!(hall.run(&["reload"]).code, Some(75));
    hall.done(&["disarm"]);
    hall.done(&["reload"]);
    hall.wait(|status| status["hall"] == "Hall 2" && status["state"] == "parked");
}

#[test]
fn a_configuration_whose_port_is_taken_is_given_up_and_the_hall_goes_on_with_the_old_one() {
    let hall = Hall::open();
    let held = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = held.local_addr().unwrap().to_string();
    hall.rewrite(|config| config.replace("Hall 1", "Hall 2").replace("127.0.0.1:0", &port));
    hall.serving().signal(Signal::HUP);
    hall.serving().heard(|line| (line.contains("has the old one") && line.contains(&port)).then_some(()));
    let status = hall.lives_on(50);
    assert_eq!((status["hall"].as_str(), status["state"].as_str()), (Some("Hall 1"), Some("parked")));
    hall.arm("ride");
    assert_eq!(hall.end().motion(), 0);
}

#[test]
fn a_reload_is_over_once_the_hall_has_opened_with_the_new_configuration_or_has_the_old_one_again() {
    let hall = Hall::open();
    for name in ["Hall 2", "Hall 3"] {
        hall.rewrite(|config| {
            let line = |line: &str| {
                if line.starts_with("name = \"Hall") { format!("name = \"{name}\"") } else { line.to_owned() }
            };
            config.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
        });
        let run = hall.done(&["reload"]);
        assert!(run.stderr.contains("has opened with this configuration"), "{run:?}");
        let status = hall.status();
        assert_eq!((&status["hall"], &status["state"]), (&name.into(), &"parked".into()));
    }
    let held = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = held.local_addr().unwrap().to_string();
    hall.rewrite(|config| config.replace("Hall 3", "Hall 4").replace("127.0.0.1:0", &port));
    let run = hall.run(&["reload"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stderr.contains("has the old one") && run.stderr.contains(&port), "{run:?}");
    assert_eq!(hall.status()["hall"], "Hall 3");
    hall.end();
}

/// A hall whose seats stand up, stopped in mid-show, and which has read its configuration anew, changed like that.
fn reloaded_up(change: fn(String) -> String) -> Hall {
    let hall = Hall::open();
    hall.play("night");
    (0..2).for_each(|seat| hall.rises(seat));
    hall.done(&["stop"]);
    hall.comes_to("stopped");
    hall.rewrite(|config| change(config).replace("Hall 1", "Hall 2"));
    for seat in 0..2 {
        hall.relay(seat).count();
    }
    hall.done(&["reload"]);
    // What was latched stays so.
    hall.wait(|status| status["hall"] == "Hall 2" && status["next"] == "clear, then park or home");
    hall.done(&["clear"]);
    hall.comes_to("recovering");
    hall
}

#[test]
fn seats_that_stand_up_while_the_configuration_is_read_anew_are_parked_from_where_they_are() {
    let changes: [fn(String) -> String; 3] = [
        |config| config,
        |config| config.replace("stroke_mm = 150.0", "stroke_mm = 100.0"),
        |config| config.replace("park = [0.0, 0.0, 0.0]", "park = [0.1, 0.1, 0.1]"),
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let hall = reloaded_up(change);
        hall.lives_on(30);
        assert_eq!(hall.relay(0).count() + hall.relay(1).count(), 0, "nothing moves by itself");
        hall.wait(|status| status["next"] == "park, or home");
        hall.done(&["park"]);
        let parked = hall.comes_to("parked");
        assert!((0..2).all(|seat| parked["controllers"][seat]["health"] == "ok"), "{parked}");
        let seen = hall.end();
        assert_eq!(seen.rest_in_park(), index < 2, "{:?}", seen.controllers);
    }
}
