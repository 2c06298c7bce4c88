//! A hall whose film leads its shows: Art-Net timecode as a cinema server sends it.

use crate::hall::Hall;
use crate::process::Guarded;

/// Where timecode is heard, and from whom: addresses of this machine that no other run of the test has.
fn network() -> (String, String) {
    let [_, _, high, low] = std::process::id().to_be_bytes();
    (format!("127.40.{high}.{}", low.max(1)), format!("127.41.{high}.{}:6454", low.max(1)))
}

/// A film that runs from that label on, until it is dropped.
fn film(start: &str) -> Guarded {
    let (from, to) = network();
    let args = ["sync", "send", "--seconds", "600", "--artnet", &to, "--from", &from, "--tc-start", start];
    Guarded::start(&args)
}

fn hall() -> Hall {
    let (from, bind) = network();
    Hall::open_with(|config| {
        format!(
            "{config}[sync]\nsources = [\"artnet\"]\nfilm_fps = \"25\"\nstart = \"01:00:00:00\"\n\
             [sync.artnet]\nfrom = \"{from}\"\nbind = \"{bind}\"\n"
        )
    })
}

#[test]
fn a_show_follows_the_film_of_its_hall_once_a_person_has_let_it_go_and_moves_nobody_before() {
    let mut hall = hall();
    let absent = hall.wait(|status| status["film"]["state"] == "absent");
    assert_eq!(absent["film"]["leads"], false, "nothing is loaded");
    let reel = film("01:00:05:00");
    hall.wait(|status| status["film"]["state"] == "locked");
    hall.arm("night");
    let armed = hall.wait(|status| status["film"]["position_s"].as_f64().is_some_and(|at| at > 7.0));
    assert_eq!((&armed["state"], &armed["film"]["leads"]), (&"armed".into(), &true.into()), "{}", armed["film"]);
    assert_eq!((hall.relay(0).count(), hall.relay(1).count()), (0, 0), "the film moves nobody");
    hall.done(&["go"]);
    let plays = hall.wait(|status| status["state"] == "playing");
    let at = |what: &str| plays[what]["position_s"].as_f64().expect("it is known");
    assert!((at("film") - at("show")).abs() < 0.25, "{} {}", plays["film"], plays["show"]);

    drop(reel);
    let waits = hall.wait(|status| status["state"] == "waiting" && status["film"]["state"] == "lost");
    assert_eq!(waits["cause"], "nothing is heard of the film any more");
    assert!(waits["next"].as_str().is_some_and(|next| next.contains("see to the film")), "{}", waits["next"]);
    let reel = film("01:00:30:00");
    hall.wait(|status| status["state"] == "playing" && status["show"]["position_s"].as_f64() > Some(29.0));
    drop(reel);
    let _trailer = film("02:00:00:00");
    let parked = hall.wait(|status| status["state"] == "parked");
    assert_eq!(parked["film"]["leads"], true, "the show is still loaded");
    let lines = hall.close();
    assert!(lines.iter().any(|line| line.contains("the film has left the cue")), "{lines:?}");
    assert!(hall.end().rest_in_park());
}

#[test]
fn a_hall_opens_without_the_source_of_its_film_and_says_what_is_wrong_with_it() {
    let hall = Hall::open_with(|config| {
        format!("{config}[sync]\nsources = [\"mtc\"]\n[sync.mtc]\ndevice = \"/nowhere/midi\"\n")
    });
    let cause = |status: &serde_json::Value| status["film"]["sources"][0]["cause"].to_string();
    hall.wait(|status| cause(status).contains("/nowhere/midi cannot be opened: No such file"));
}
