//! The page of all halls of a desk.

use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

use crate::browser::Browser;
use crate::fleet::Engine;
use crate::http::{Reply, Request};

/// Whoever comes may look and stop.
const OPEN: &str = "open_role = \"view\"";

fn names(page: &Value) -> Vec<&str> {
    page["halls"].as_array().unwrap().iter().map(|hall| hall["name"].as_str().unwrap()).collect()
}

fn are_heard(page: &Value, count: usize) -> bool {
    page["halls"]
        .as_array()
        .is_some_and(|all| all.iter().filter(|hall| hall["silent"] == false).count() == count)
}

#[test]
fn the_page_has_a_tile_for_each_hall_worst_first_and_a_stop_for_one_and_for_all() {
    let Some(mut engine) = Engine::start("h1,h2,h3") else { return };
    let Some(browser) = Browser::start() else { return };
    let (one, two) = (engine.hall("h1", "[]"), engine.hall("h2", "[]"));
    let _links = [engine.link("h1", &one), engine.link("h2", &two)];
    let page = engine.page(OPEN);
    page.wait(|page| are_heard(page, 2));
    browser.open(&page.url());
    browser.wait("document.querySelectorAll('.hall .state').length === 3");
    let states = "[...document.querySelectorAll('.hall')].map((hall) => `${hall.ariaLabel} ${hall.querySelector('.state').textContent}`).join()";
    browser.wait(&format!("{states} === 'berlin.h3 silent,berlin.h1 parked,berlin.h2 parked'"));
    two.play("night");
    browser.press("[aria-label='STOP berlin.h2']");
    two.comes_to("stopped");
    browser.reads("said", "berlin.h2: stopping");
    assert_eq!(one.status()["state"], "parked", "nobody else was stopped");
    browser.wait(&format!("{states} === 'berlin.h3 silent,berlin.h2 stopped,berlin.h1 parked'"));
    for (width, name) in [(1280, "fleet"), (400, "fleet-narrow")] {
        browser.resize(width, 800);
        assert_eq!(browser.eval("return document.documentElement.scrollWidth <= innerWidth"), true, "{name}");
        browser.shot(name);
    }
    browser.press("#stop-all");
    one.comes_to("stopped");
    browser.wait("document.querySelector('#said').textContent.includes('berlin.h3: NOT STOPPED: nobody hears it there')");
    engine.kill();
    browser.wait(
        "!document.querySelector('#lost').hidden && document.querySelectorAll('.hall.silent').length === 3",
    );
    assert_eq!(browser.complaints(), Vec::<String>::new());
    drop(page);
    browser.wait("document.querySelector('#lost').textContent.startsWith('No answer from this desk for')");
}

#[test]
fn who_has_no_token_sees_nothing_and_no_page_of_others_stops_a_hall() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", "[]");
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    let token =
        Sha256::digest("correct-horse").iter().map(|octet| format!("{octet:02x}")).collect::<String>();
    let page =
        engine.page(&format!("[[api.token]]\nname = \"booth\"\nrole = \"view\"\nsha256 = \"{token}\""));
    let stop = |body: &str| Request::new("POST", "/api/v1/fleet/stop").json(body.to_owned());
    let status = |request: Request| request.send(page.to()).status;
    for path in ["/api/v1/fleet/halls", "/metrics"] {
        assert_eq!(page.to().get(path).status, 401, "{path}");
        assert_eq!(status(Request::new("GET", path).token("wrong")), 401, "{path}");
        assert_eq!(status(Request::new("GET", path).token("correct-horse")), 200, "{path}");
    }
    let all = json!({ "halls": ["all"] }).to_string();
    assert_eq!(status(stop(&all)), 401);
    assert_eq!(status(stop(&all).token("correct-horse").header("Origin", "http://evil.example")), 403);
    assert_eq!(status(stop(&all).token("correct-horse").host("evil.example")), 403);
    for bad in [
        "",
        "{",
        "{}",
        "[]",
        r#"{"halls":[]}"#,
        r#"{"halls":["berlin.h9"]}"#,
        r#"{"halls":"all"}"#,
        r#"{"halls":["all"],"x":1}"#,
    ] {
        assert_eq!(status(stop(bad).token("correct-horse")), 400, "{bad:?}");
    }
    assert_eq!(status(stop(&"x".repeat(100_000)).token("correct-horse")), 413);
    for (method, path, wanted) in [
        ("GET", "/api/v1/fleet/stop", 405),
        ("POST", "/", 405),
        ("GET", "/js/main.js", 404),
        ("GET", "/../Cargo.toml", 404),
        ("GET", "/", 200),
    ] {
        let Reply { status, headers, .. } = Request::new(method, path).token("correct-horse").send(page.to());
        assert_eq!(status, wanted, "{method} {path}");
        assert!(
            headers.iter().any(|(name, _)| name.eq_ignore_ascii_case("content-security-policy")),
            "{headers:?}"
        );
    }
    assert_eq!(hall.status()["state"], "parked", "none of it stopped it");
    let answers = stop(&all).token("correct-horse").send(page.to()).value();
    assert_eq!((&answers[0]["hall"], &answers[0]["done"]), (&"berlin.h1".into(), &true.into()), "{answers}");
    hall.comes_to("stopped");
    let figures = Request::new("GET", "/metrics").token("correct-horse").send(page.to());
    let figures = String::from_utf8(figures.body).unwrap();
    assert!(figures.contains("kinocue_fleet_stops_total{result=\"done\"} 1"), "{figures}");
}

#[test]
fn a_token_of_another_day_keeps_nobody_from_a_stop_that_needs_none() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", "[]");
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    let page = engine.page(OPEN);
    let look = Request::new("GET", "/api/v1/fleet/halls").token("of-last-year").send(page.to());
    assert_eq!(look.status, 401);
    let all = json!({ "halls": ["all"] }).to_string();
    let stop = Request::new("POST", "/api/v1/fleet/stop").token("of-last-year").json(all).send(page.to());
    assert_eq!(stop.value()[0]["done"], true, "{}", stop.status);
    hall.comes_to("stopped");
}

#[test]
fn a_page_is_served_before_its_engine_is_there_and_hears_halls_once_it_is() {
    let Some(mut engine) = Engine::start("h1,h2") else { return };
    let hall = engine.hall("h1", "[]");
    engine.kill();
    let _link = engine.link("h1", &hall);
    let page = engine.page(OPEN);
    let shown = page.wait(|page| names(page).len() == 2);
    assert_eq!(shown["engine"], false);
    assert!(are_heard(&shown, 0));
    engine.restart();
    page.wait(|page| page["engine"] == true && are_heard(page, 1) && names(page)[0] == "berlin.h2");
}

#[test]
fn a_stop_that_is_pressed_while_the_engine_is_away_is_said_to_be_none_and_stops_no_hall_once_that_is_back() {
    let Some(mut engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", "[]");
    let link = engine.link("h1", &hall);
    let page = engine.page(OPEN);
    page.wait(|page| are_heard(page, 1));
    engine.kill();
    page.wait(|page| page["engine"] == false);
    let all = json!({ "halls": ["all"] }).to_string();
    let stop = || Request::new("POST", "/api/v1/fleet/stop").json(all.clone()).send(page.to()).value();
    let answers = stop();
    assert_eq!((&answers[0]["done"], &answers[0]["answered"]), (&false.into(), &false.into()), "{answers}");
    assert_eq!(answers[0]["text"], "not asked: the engine is away");
    engine.restart();
    page.wait(|page| page["engine"] == true && are_heard(page, 1));
    // Of two stops the engine passes on the first one first.
    assert_eq!(stop()[0]["done"], true);
    hall.comes_to("stopped");
    link.heard("office asks for a stop");
    assert!(!link.has_said("office asks for a stop"), "the other one was asked later");
}

#[test]
fn a_desk_without_a_place_for_its_page_says_what_to_add() {
    let Some(engine) = Engine::start("h1") else { return };
    let run = engine.desk(&["desk"]);
    assert_eq!(run.code, Some(78), "{run:?}");
    assert!(run.stderr.contains("[api]") && run.stderr.contains("listen"), "{run:?}");
}
