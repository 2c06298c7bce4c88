//! A hall whose film leads its shows: Art-Net timecode as a cinema server sends it.

use crate::hall::Hall;
use crate::http::Request;
use crate::process::{Guarded, kinocue};

/// Where timecode is heard, and from whom: addresses of this machine that no other test and no other run of them has.
fn network(test: u8) -> (String, String) {
    let [_, _, high, low] = std::process::id().to_be_bytes();
    let place = |net: u8| format!("127.{}.{high}.{}", net + test, low.max(1));
    (place(40), format!("{}:6454", place(50)))
}

/// A film that runs from that label on, until it is dropped.
fn film(test: u8, start: &str) -> Guarded {
    let (from, to) = network(test);
    let args = ["sync", "send", "--seconds", "600", "--artnet", &to, "--from", &from, "--tc-start", start];
    Guarded::start(&args)
}

fn hall(test: u8) -> Hall {
    let (from, bind) = network(test);
    Hall::open_with(|config| {
        format!(
            "{config}[sync]\nsources = [\"artnet\"]\nfilm_fps = \"25\"\nstart = \"01:00:00:00\"\n\
             [sync.artnet]\nfrom = \"{from}\"\nbind = \"{bind}\"\n"
        )
    })
}

#[test]
fn a_show_follows_the_film_of_its_hall_once_a_person_has_let_it_go_and_moves_nobody_before() {
    let mut hall = hall(0);
    let absent = hall.wait(|status| status["film"]["state"] == "absent");
    assert_eq!(absent["film"]["leads"], false, "nothing is loaded");
    let reel = film(0, "01:00:05:00");
    hall.wait(|status| status["film"]["state"] == "locked");
    hall.arm("night");
    let armed = hall.wait(|status| status["film"]["position_s"].as_f64().is_some_and(|at| at > 7.0));
    assert_eq!(
        (&armed["state"], &armed["film"]["leads"]),
        (&"armed".into(), &true.into()),
        "{}",
        armed["film"]
    );
    assert_eq!((hall.relay(0).count(), hall.relay(1).count()), (0, 0), "the film moves nobody");
    hall.done(&["go"]);
    let at = |status: &serde_json::Value, what: &str| status[what]["position_s"].as_f64().unwrap_or(f64::MAX);
    let follows = |status: &serde_json::Value| (at(status, "film") - at(status, "show")).abs() < 0.25;
    let led = hall.wait(|status| {
        let error = status["film"]["error_ms"].as_f64();
        status["state"] == "playing" && follows(status) && error.is_some_and(|error| error.abs() < 45.0)
    });
    let code = led["film"]["timecode"].as_str().expect("Art-Net has labels");
    assert!(code.starts_with("01:00:"), "{code}");
    assert_eq!((&led["film"]["disagrees"], &led["film"]["chosen"]), (&().into(), &().into()));
    assert_eq!(led["film"]["sources"][0]["jumps"], 0, "{}", led["film"]);

    drop(reel);
    let waits = hall.wait(|status| status["state"] == "waiting" && status["film"]["state"] == "lost");
    assert_eq!(waits["film"]["error_ms"], serde_json::Value::Null, "seats that wait follow nothing");
    assert_eq!(waits["film"]["joins"], 1, "{}", waits["film"]);
    assert_eq!(waits["cause"], "no position is received from the film any more");
    assert!(waits["next"].as_str().is_some_and(|next| next.contains("check the film")), "{}", waits["next"]);
    let reel = film(0, "01:00:30:00");
    let again = hall
        .wait(|status| status["state"] == "playing" && status["show"]["position_s"].as_f64() > Some(29.0));
    assert_eq!(again["film"]["joins"], 2, "{}", again["film"]);
    assert!(again["film"]["sources"][0]["freewheel_s"].as_f64() > Some(1.0), "{}", again["film"]);
    let follows = |status: &serde_json::Value| status["film"]["error_ms"].is_number();
    hall.wait(follows);
    for seat in ["A1", "A2"] {
        hall.done(&["disable", seat]);
    }
    let alone = hall.wait(|status| !follows(status));
    assert_eq!(alone["state"], "playing", "the show goes on without a seat whose error there could be");
    hall.done(&["enable", "A1"]);
    hall.wait(follows);
    drop(reel);
    let _trailer = film(0, "02:00:00:00");
    let parked = hall.wait(|status| status["state"] == "parked");
    assert_eq!(parked["film"]["leads"], true, "the show is still loaded");
    let lines = hall.close();
    assert!(lines.iter().any(|line| line.contains("the film has left the cue")), "{lines:?}");
    let config = hall.path("hall.toml").to_str().expect("text").to_owned();
    let report = kinocue(&["report", "--day", "today", "--json", "--config", &config]).report_of(0);
    let (show, artnet) = (&report["shows"][0], format!("artnet:{}", network(0).0));
    assert_eq!(show["result"], "stopped", "the film was not over");
    let proof = &show["outcome"]["film"];
    assert!(proof["sources"][0].as_str().is_some_and(|source| source.starts_with(&artnet)), "{proof}");
    assert!(proof["greatest_error_ms"].as_f64().is_some_and(|ms| ms > 0.0 && ms < 1000.0), "{proof}");
    assert!(hall.end().rest_in_park());
}

#[test]
fn a_source_that_a_person_chose_is_followed_though_it_is_lost_until_the_ranking_decides_again() {
    let (from, bind) = network(2);
    let hall = Hall::open_with(|config| {
        format!(
            "{config}[sync]\nsources = [\"artnet\", \"mtc\"]\nfilm_fps = \"25\"\nstart = \"01:00:00:00\"\n\
             [sync.artnet]\nfrom = \"{from}\"\nbind = \"{bind}\"\n[sync.mtc]\ndevice = \"/nowhere/midi\"\n"
        )
    });
    let _reel = film(2, "01:00:05:00");
    let led = hall.wait(|status| status["film"]["state"] == "locked");
    let name = |place: usize| led["film"]["sources"][place]["source"].clone();
    let choose = |source: serde_json::Value| {
        let body = serde_json::json!({ "source": source }).to_string();
        Request::new("PUT", "/api/v1/sync/source").json(body).send(&hall.socket())
    };
    assert_eq!(choose(name(1)).status, 200);
    let chosen = hall.wait(|status| status["film"]["state"] == "absent");
    assert_eq!((&chosen["film"]["chosen"], &chosen["film"]["source"]), (&name(1), &name(1)));
    assert_eq!(choose("nobody".into()).status, 404);
    assert_eq!(hall.status()["film"]["chosen"], name(1), "there is no such source");
    assert_eq!(choose(serde_json::Value::Null).status, 200);
    assert_eq!(hall.socket().get("/api/v1/sync").status, 200);
    let by_ranking = hall.wait(|status| status["film"]["state"] == "locked");
    assert_eq!(by_ranking["film"]["chosen"], serde_json::Value::Null);
}

#[test]
fn each_entry_of_a_playlist_waits_for_its_own_place_in_one_reel() {
    let mut hall = hall(1);
    let entry = |start: &str, then: &str| {
        format!("[[entry]]\ncue = \"ride\"\nfilm = \"{start}\"\nthen = \"{then}\"\n")
    };
    hall.write(
        "playlists/reel.toml",
        &format!("title = \"Reel\"\n{}{}", entry("01:10:00:00", "go"), entry("01:10:08:00", "hold")),
    );
    hall.done(&["playlist", "reel"]);
    hall.done(&["preflight"]);
    hall.done(&["arm"]);
    // Only now: it goes on however long these take.
    let _reel = film(1, "01:09:52:00");
    hall.done(&["go"]);
    let first = hall.comes_to("playing");
    assert_eq!(first["playlist"]["current"], 0);
    let second = hall.wait(|status| status["state"] == "waiting" && status["playlist"]["current"] == 1);
    assert!(second["film"]["position_s"].as_f64() < Some(0.0), "it has not begun: {}", second["film"]);
    hall.comes_to("playing");
    hall.comes_to("parked");
    hall.close();
    assert!(hall.end().rest_in_park());
}

#[test]
fn a_film_that_comes_to_the_place_of_another_entry_has_that_loaded_and_nobody_armed() {
    let mut hall = hall(3);
    let entry = |start: &str| format!("[[entry]]\ncue = \"night\"\nfilm = \"{start}\"\n");
    let entries = ["01:10:00:00", "01:20:00:00"].map(entry).concat();
    hall.write("playlists/reel.toml", &format!("title = \"Reel\"\n{entries}"));
    hall.done(&["playlist", "reel"]);
    let _reel = film(3, "01:20:00:00");
    let loaded = hall.wait(|status| status["playlist"]["current"] == 1);
    assert_eq!(loaded["state"], "parked");
    hall.lives_on(100);
    assert_eq!((hall.relay(0).count(), hall.relay(1).count()), (0, 0), "the film moves nobody");
    hall.done(&["preflight"]);
    hall.done(&["arm"]);
    hall.done(&["go"]);
    let led = hall.comes_to("playing");
    assert_eq!(led["playlist"]["current"], 1);
    hall.done(&["trim", "+2f"]);
    assert_eq!(hall.done(&["trim", "-1f"]).code, Some(0));
    assert_eq!(hall.status()["trim_ms"], 40, "a frame of 25 a second is left");
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.close();
    assert!(hall.end().rest_in_park());
}

#[test]
fn a_hall_opens_without_the_source_of_its_film_and_says_what_is_wrong_with_it() {
    let hall = Hall::open_with(|config| {
        format!("{config}[sync]\nsources = [\"mtc\"]\n[sync.mtc]\ndevice = \"/nowhere/midi\"\n")
    });
    let cause = |status: &serde_json::Value| status["film"]["sources"][0]["cause"].to_string();
    let status = hall.wait(|status| cause(status).contains("/nowhere/midi cannot be opened: No such file"));
    let warnings = status["warnings"].as_array().expect("a list");
    let of_the_film =
        warnings.iter().find(|one| one["id"] == "film").expect("whoever looks at no source is told as well");
    assert!(of_the_film["text"].to_string().contains("/nowhere/midi"), "{of_the_film}");
}
