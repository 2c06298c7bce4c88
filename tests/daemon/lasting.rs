//! What people set comes back with the service, whatever ended it; and what the configuration has out stays out.

use std::fs;

use serde_json::Value;

use crate::hall::Hall;

fn seat(status: &Value, controller: usize) -> &Value {
    &status["controllers"][controller]
}

/// Waits until what was set is on the disk.
fn kept(hall: &Hall, part: &str) {
    let file = hall.path("state/settings.json");
    hall.wait(|_| fs::read_to_string(&file).is_ok_and(|text| text.contains(part)));
}

const BROKEN: [&str; 4] = ["disable", "A2", "--why", "broken leg"];

#[test]
fn after_a_crash_a_broken_seat_is_out_levels_and_effects_are_as_they_were_and_the_first_arm_says_so() {
    let mut hall = Hall::open();
    hall.write(
        "playlists/day.toml",
        "title = \"Day\"\n[[entry]]\ncue = \"ride\"\n[[entry]]\ncue = \"night\"\n",
    );
    hall.done(&["playlist", "day"]);
    hall.done(&["select", "2"]);
    hall.done(&BROKEN);
    hall.done(&["level", "60%"]);
    hall.done(&["effects", "off", "water"]);
    hall.done(&["trim", "-40"]);
    kept(&hall, "\"trim_ms\": -40");
    hall.kill();
    hall.relay(1).count();
    // A broken seat may be at work on: nobody waits for it.
    hall.relay(1).pull();
    hall.serve();
    let status = hall.wait(|status| status["show"]["cue"] == "night" && status["next"] == "park, or home");
    assert_eq!((&seat(&status, 0)["enabled"], &seat(&status, 1)["enabled"]), (&true.into(), &false.into()));
    assert_eq!((&status["levels"]["motion"], &status["trim_ms"]), (&0.6.into(), &Value::from(-40)));
    assert_eq!(status["levels"]["effects"]["water"], false);
    assert_eq!((&status["playlist"]["id"], &status["playlist"]["current"]), (&"day".into(), &1.into()));

    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.done(&["preflight"]);
    let arm = hall.done(&["arm"]);
    assert!(arm.stderr.contains("A2: out since ") && arm.stderr.contains(": broken leg"), "{arm:?}");
    assert!(arm.stderr.contains("motion 60 %, vibration 60 %, water off, trim -40 ms, cue night"), "{arm:?}");
    hall.done(&["disarm"]);
    // Another configuration changes nothing of it either.
    hall.rewrite(|config| config.replace("Hall 1", "Hall 2"));
    hall.done(&["reload"]);
    let anew = hall.wait(|status| status["hall"] == "Hall 2" && status["show"]["cue"] == "night");
    assert_eq!((&anew["playlist"]["current"], &seat(&anew, 1)["enabled"]), (&1.into(), &false.into()));
    let lines = hall.close();
    assert!(lines.iter().any(|line| line.contains("A2 is out since ")), "{lines:?}");
    let acts = hall.journal("action");
    assert!(acts.iter().any(|act| act["what"] == "disable A2: broken leg"), "{acts:?}");
    let seen = hall.end();
    assert!(seen.rest_in_park() && seen.farthest(0) == 0, "{:?}", seen.controllers);
}

#[test]
fn a_stopped_show_goes_on_where_it_was_left_once_a_person_asks_and_not_before() {
    let mut hall = Hall::open();
    hall.play("night");
    hall.wait(|status| status["show"]["position_s"].as_f64() > Some(3.0));
    hall.done(&["stop"]);
    hall.comes_to("stopped");
    hall.done(&["clear"]);
    hall.wait(|status| status["next"] == "park, or home");
    hall.done(&["park"]);
    let parked = hall.comes_to("parked");
    let left = parked["show"]["resume_s"].as_f64().expect("a place");
    assert!((3.0..10.0).contains(&left), "{left} s");
    let told = hall.done(&["status"]).stdout;
    let (_, from) = told.split_once("kinocue go --from ").expect(&told);
    let from = from.split_whitespace().next().unwrap().to_owned();
    // Over an end in order as well.
    hall.close();
    hall.serve();
    hall.wait(|status| status["show"]["resume_s"].as_f64().is_some_and(|at| (at - left).abs() < 0.002));
    assert_eq!(hall.lives_on(50)["state"], "parked", "nothing starts by itself");
    hall.done(&["preflight"]);
    assert_eq!(hall.run(&["go", "--from", &from]).code, Some(75), "nobody has armed it");
    hall.done(&["arm"]);
    hall.done(&["go", "--from", &from]);
    let playing = hall.comes_to("playing");
    let at = playing["show"]["position_s"].as_f64().unwrap();
    assert!((left..left + 10.0).contains(&at), "{at} s, left at {left} s");
    assert!(playing["show"]["resume_s"].is_null());
    hall.done(&["park"]);
    hall.comes_to("parked");
    assert!(hall.end().rest_in_park());
}

#[test]
fn settings_that_cannot_be_read_are_put_aside_with_a_word_and_the_hall_opens() {
    let mut hall = Hall::open();
    hall.done(&BROKEN);
    kept(&hall, "broken leg");
    hall.kill();
    let file = hall.path("state/settings.json");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, &text[..text.len() / 2]).unwrap();
    hall.serve();
    let status = hall.lives_on(50);
    let note = status["warnings"].as_array().unwrap().iter().find(|one| one["id"] == "note").expect("a word");
    assert!(note["text"].as_str().unwrap().contains("it is now settings.json.bad"), "{note}");
    assert_eq!(seat(&status, 1)["enabled"], true);
    assert!(hall.path("state/settings.json.bad").exists());
}

#[test]
fn a_folder_that_takes_no_settings_is_told_of_and_harms_nothing() {
    let hall = Hall::open();
    fs::create_dir(hall.path("state/settings.json.new")).unwrap();
    hall.done(&BROKEN);
    hall.wait(|status| status["warnings"].as_array().unwrap().iter().any(|one| one["id"] == "settings"));
    hall.arm("ride");
    hall.done(&["go"]);
    hall.wait(|status| status["cause"] == "the seats that take part have parked");
    let said = hall.serving().lines();
    let told = said.iter().filter(|line| line.contains("cannot be kept over a restart")).count();
    assert_eq!(told, 1, "{said:?}");
}

#[test]
fn a_controller_that_is_out_for_good_gets_no_datagram_and_is_waited_for_by_nobody() {
    let mut hall = Hall::closed(&[], |config| config + "enabled = false\n");
    hall.serve();
    let status = hall.comes_to("parked");
    assert_eq!((&seat(&status, 1)["name"], &seat(&status, 1)["health"]), (&"A2".into(), &"out".into()));
    let refused = hall.run(&["enable", "A2"]);
    assert!(
        refused.code == Some(75) && refused.stderr.contains("disabled in the configuration"),
        "{refused:?}"
    );
    hall.play("night");
    hall.done(&["stop"]);
    hall.comes_to("stopped");
    hall.done(&["clear"]);
    hall.wait(|status| status["next"] == "park, or home");
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.close();
    assert_eq!(
        (&hall.journal("show")[0]["seats_available"], &hall.journal("show")[0]["seats_total"]),
        (&1.into(), &2.into())
    );
    let seen = hall.end();
    assert_eq!(seen.controllers[1]["received"], 0, "{}", seen.controllers[1]);
}

#[test]
fn a_controller_goes_out_for_good_and_comes_back_with_another_configuration() {
    let hall = Hall::open();
    hall.done(&["load", "ride"]);
    let reads = |status: &Value, health: &str| {
        let all = [seat(status, 0), seat(status, 1)].map(|one| one["health"].as_str().unwrap());
        status["state"] == "parked" && status["show"]["cue"] == "ride" && all == ["ok", health]
    };
    hall.rewrite(|config| config + "enabled = false\n");
    hall.done(&["reload"]);
    hall.wait(|status| reads(status, "out"));
    hall.rewrite(|config| config.replace("enabled = false", "enabled = true"));
    hall.done(&["reload"]);
    hall.wait(|status| reads(status, "ok"));
    hall.arm("ride");
    assert_eq!(hall.end().motion(), 0);
}
