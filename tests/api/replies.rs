//! What each request does, and what it is answered.

use std::io::Write as _;

use kinocue::harness::control::{Command, LevelsChange, Role, Surface};
use kinocue::harness::time::ShowTime;

use crate::client::{Reply, Request, problem};
use crate::hall::{Hall, with_controller};

fn put(path: &str, body: &str) -> Request {
    Request::new("PUT", path).json(body)
}

fn post(path: &str, body: &str) -> Request {
    Request::new("POST", path).json(body)
}

#[test]
fn every_change_reaches_the_hall_as_it_was_asked() {
    let hall = Hall::open();
    let plain = |path: &str| Request::new("POST", path);
    let levels = LevelsChange {
        motion: Some(0.6),
        effects: [("water".to_owned(), false)].into(),
        rows: [("A".to_owned(), 0.0)].into(),
        ..LevelsChange::default()
    };
    let requests = [
        (plain("/api/v1/show/home"), Command::Home),
        (post("/api/v1/show/load", r#"{"cue":"storm_2"}"#), Command::Load { cue: "storm_2".to_owned() }),
        (plain("/api/v1/show/arm"), Command::Arm { seats_empty: false }),
        (post("/api/v1/show/arm", "{}"), Command::Arm { seats_empty: false }),
        (post("/api/v1/show/arm", r#"{"seats_empty":true}"#), Command::Arm { seats_empty: true }),
        (post("/api/v1/show/arm", r#"{"fleet":"trio"}"#), Command::ArmFor("trio".to_owned())),
        (plain("/api/v1/show/go"), Command::Go),
        (post("/api/v1/show/go", r#"{"from_s":12.5}"#), Command::GoFrom(ShowTime::from_millis(12_500))),
        (post("/api/v1/show/pause", "{}"), Command::Pause),
        (post("/api/v1/show/seek", r#"{"position_s":750.5}"#), Command::Seek(ShowTime::from_millis(750_500))),
        (plain("/api/v1/show/stop"), Command::Stop),
        (plain("/api/v1/show/park"), Command::Park),
        (plain("/api/v1/show/disarm"), Command::Disarm),
        (plain("/api/v1/show/clear"), Command::Clear),
        (put("/api/v1/trim", r#"{"offset_s":0.08}"#), Command::Trim(80)),
        (put("/api/v1/trim", r#"{"frames":-2}"#), Command::Nudge(-2)),
        (put("/api/v1/sync/source", r#"{"source":"ltc"}"#), Command::Source(Some("ltc".to_owned()))),
        (put("/api/v1/sync/source", r#"{"source":null}"#), Command::Source(None)),
        (
            put("/api/v1/levels", r#"{"motion":0.6,"effects":{"water":false},"rows":{"A":0}}"#),
            Command::Levels(levels),
        ),
        (plain("/api/v1/presets/kids"), Command::Preset("kids".to_owned())),
        (plain("/api/v1/controllers/A%201/disable"), Command::Disable { name: "A 1".to_owned(), why: None }),
        (
            post("/api/v1/controllers/A1/disable", r#"{"why":"broken leg"}"#),
            Command::Disable { name: "A1".to_owned(), why: Some("broken leg".to_owned()) },
        ),
        (plain("/api/v1/controllers/A1/enable"), Command::Enable("A1".to_owned())),
        (plain("/api/v1/preflight"), Command::Preflight),
        (post("/api/v1/test", r#"{"rows":["A","B"]}"#), Command::Test { rows: vec!["A".into(), "B".into()] }),
        (post("/api/v1/test", "{}"), Command::Test { rows: Vec::new() }),
        (put("/api/v1/playlist", r#"{"id":"today"}"#), Command::Playlist { id: Some("today".to_owned()) }),
        (put("/api/v1/playlist", r#"{"id":null}"#), Command::Playlist { id: None }),
        (post("/api/v1/playlist/select", r#"{"entry":2}"#), Command::Select { entry: 2 }),
        (plain("/api/v1/reload"), Command::Reload),
        (plain("/api/v1/record/mark"), Command::Mark { text: None }),
        (
            post("/api/v1/record/mark", r#"{"text":"F4 jerked"}"#),
            Command::Mark { text: Some("F4 jerked".to_owned()) },
        ),
        (plain("/api/v1/record/dump"), Command::Dump),
    ];
    for (request, ask) in &requests {
        let reply = request.send(&hall.socket());
        assert_eq!(reply.value()["cause"], format!("asked: {}", ask.word()), "{request:?}");
    }
    assert_eq!(hall.asks(), requests.map(|(_, ask)| ask));
    assert!(hall.desk.take_stop());
    let asked = hall.asked.lock().unwrap();
    assert!(asked.iter().all(|one| one.who.role == Role::Engineer && one.who.surface == Surface::Socket));
}

#[test]
fn a_change_replies_with_the_state_that_it_led_to() {
    let hall = Hall::open();
    assert_eq!(hall.socket().post("/api/v1/show/arm").state(), "armed");
    assert_eq!(hall.socket().get("/api/v1/status").state(), "armed");
}

#[test]
fn a_refusal_says_why_what_to_do_and_how_the_hall_is() {
    let hall = Hall::with(with_controller(), |api| api);
    let reply = post("/api/v1/show/load", r#"{"cue":"bad"}"#).send(&hall.socket());
    assert_eq!(reply.problem(), problem(422, "check"));
    let body = reply.value();
    assert_eq!(body["faults"].as_array().unwrap().len(), 2);
    assert_eq!((body["state"].as_str(), body["position_s"].as_f64()), (Some("parked"), None));
    assert!(body["next"].is_string() && body["cause"].is_string());
    let reply = hall.socket().post("/api/v1/show/resume");
    assert_eq!(reply.problem(), problem(409, "state"));
    assert_eq!(reply.value()["detail"], "cannot resume while armed");
}

#[test]
fn what_is_not_as_it_may_be_is_refused_and_reaches_nobody() {
    let hall = Hall::open();
    let to = hall.socket();
    let json = "application/json";
    let cases = [
        ("POST", "/api/v1/show/load", json, r#"{"cue":"../x"}"#, 400, "value"),
        ("POST", "/api/v1/show/load", json, r#"{"cue":"a","to":1}"#, 400, "value"),
        ("POST", "/api/v1/show/load", json, r#"{"cue":"a""#, 400, "value"),
        ("POST", "/api/v1/show/load", json, "\"a\"", 400, "value"),
        ("POST", "/api/v1/show/load", json, "", 400, "value"),
        ("POST", "/api/v1/show/load", "text/plain", r#"{"cue":"a"}"#, 415, "media"),
        ("POST", "/api/v1/show/go", json, r#"{"now":true}"#, 400, "value"),
        ("POST", "/api/v1/show/go", json, "\u{0}", 400, "value"),
        ("POST", "/api/v1/show/go", json, r#"{"from_s":-1}"#, 400, "value"),
        ("POST", "/api/v1/controllers/A1/disable", json, r#"{"because":"it is broken"}"#, 400, "value"),
        ("POST", "/api/v1/show/seek", json, r#"{"position_s":-1}"#, 400, "value"),
        ("POST", "/api/v1/show/seek", json, r#"{"position_s":1e999}"#, 400, "value"),
        ("POST", "/api/v1/show/seek", json, r#"{"position_s":"1"}"#, 400, "value"),
        ("PUT", "/api/v1/trim", json, r#"{"offset_s":0.6}"#, 400, "value"),
        ("PUT", "/api/v1/trim", json, r#"{"frames":13}"#, 400, "value"),
        ("PUT", "/api/v1/trim", json, r#"{"offset_s":0.1,"frames":1}"#, 400, "value"),
        ("PUT", "/api/v1/trim", json, "{}", 400, "value"),
        ("PUT", "/api/v1/levels", json, r#"{"motion":1.1}"#, 400, "value"),
        ("PUT", "/api/v1/levels", json, r#"{"movement":1}"#, 400, "value"),
        ("PUT", "/api/v1/playlist", json, "{}", 400, "value"),
        ("PUT", "/api/v1/playlist", json, r#"{"id":"Today"}"#, 400, "value"),
        ("POST", "/api/v1/playlist/select", json, r#"{"entry":-1}"#, 400, "value"),
        ("POST", "/api/v1/show/go?now", json, "", 400, "value"),
        ("GET", "/api/v1/status?full", json, "", 400, "value"),
        ("POST", "/api/v1/presets/%00", json, "", 400, "value"),
        ("POST", "/api/v1/presets/%ff", json, "", 400, "value"),
        ("GET", "/api/v1/controllers/B9", json, "", 404, "unknown"),
        ("GET", "/api/v1/nothing", json, "", 404, "unknown"),
        ("POST", "/api/v1/show/jump", json, "", 404, "unknown"),
        ("POST", "/api/v1/show/go/", json, "", 404, "unknown"),
        ("GET", "/nothing", json, "", 404, "unknown"),
        ("POST", "/", json, "", 404, "unknown"),
        ("DELETE", "/api/v1/status", json, "", 405, "method"),
        ("GET", "/api/v1/reports/2026-02-30", json, "", 400, "value"),
        ("GET", "/api/v1/reports/yesterday", json, "", 400, "value"),
    ];
    for (method, path, content_type, body, status, code) in cases {
        let reply = Request::new(method, path).header("Content-Type", content_type).body(body).send(&to);
        assert_eq!(reply.problem(), problem(status, code), "{method} {path} {body}");
    }
    assert!(hall.asks().is_empty());
}

#[test]
fn a_stop_is_a_stop_whatever_comes_with_it() {
    let hall = Hall::open();
    let stop = Request::new("POST", "/api/v1/show/stop").header("Content-Type", "text/plain").body("{broken");
    let odd = stop.clone().header("Idempotency-Key", "a b").header("X-Kinocue-Sent", "soon");
    let asked = Request::new("POST", "/api/v1/show/stop?now");
    for request in [stop.sent_ago(60_000), odd, asked] {
        assert_eq!(request.send(&hall.socket()).state(), "stopping", "{request:?}");
        assert!(hall.desk.take_stop());
    }
}

#[test]
fn controllers_are_told_one_by_one_and_all_together() {
    let hall = Hall::with(with_controller(), |api| api);
    let all = hall.socket().get("/api/v1/controllers").value();
    assert_eq!(all[0]["name"], "A1");
    assert_eq!(hall.socket().get("/api/v1/controllers/A1").value(), all[0]);
}

#[test]
fn the_service_says_whether_it_is_well_and_ready_and_gives_its_figures() {
    let hall = Hall::open();
    assert_eq!(hall.socket().get("/readyz").problem(), problem(503, "state"));
    hall.socket().post("/api/v1/show/park");
    assert_eq!(hall.socket().get("/readyz").state(), "parked");
    hall.is_well();
    assert_eq!(hall.socket().get("/healthz").state(), "parked");
    let figures = hall.socket().get("/metrics");
    assert!(figures.header("content-type").unwrap().starts_with("text/plain; version=0.0.4"));
    assert!(figures.text().contains("kinocue_state{"), "{}", figures.text());
}

#[test]
fn a_connection_is_good_for_one_request_after_another() {
    let hall = Hall::open();
    let mut connection = hall.socket().connect();
    let first = b"POST /api/v1/show/pause HTTP/1.1\r\nHost: localhost\r\n\r\n";
    connection.write_all(first).unwrap();
    connection.write_all(&Request::new("POST", "/api/v1/show/park").bytes(&hall.socket())).unwrap();
    let both = String::from_utf8(Reply::read(&mut *connection).body).unwrap();
    assert!(both.contains("asked: pause") && both.contains("asked: park"), "{both}");
    assert_eq!(hall.asks(), [Command::Pause, Command::Park]);
}

#[test]
fn a_page_is_served_with_what_keeps_others_out_of_it() {
    let hall = Hall::open();
    let page = hall.port().get("/?from=bookmark");
    assert_eq!((page.status, page.text().as_str()), (200, "<!doctype html>"));
    assert_eq!(page.header("content-type"), Some("text/html; charset=utf-8"));
    assert!(page.header("content-security-policy").unwrap().starts_with("default-src 'self'"));
    assert_eq!(page.header("x-frame-options"), Some("DENY"));
    assert_eq!(page.header("x-content-type-options"), Some("nosniff"));
    assert_eq!(page.header("cache-control"), Some("no-store"));
    assert!(page.headers.iter().all(|(name, _)| !name.starts_with("access-control")));
    assert!(page.header("x-kinocue-time").unwrap().parse::<u64>().unwrap() > 1_700_000_000_000);
    assert_eq!(hall.port().get("/console.js").header("content-type"), Some("text/javascript"));
}

#[test]
fn a_handler_that_panics_ends_neither_the_program_nor_the_others() {
    let hall = Hall::open();
    assert_eq!(hall.port().get("/broken").problem(), problem(500, "internal"));
    assert_eq!(hall.socket().get("/broken").problem(), problem(500, "internal"));
    assert_eq!(hall.socket().get("/api/v1/status").status, 200);
}
