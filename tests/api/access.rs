//! Who may do what, and from where.

use kinocue::harness::control::{Command, Role, Surface};

use crate::client::{Reply, Request, problem};
use crate::hall::{Hall, TOKENS};

fn as_role(hall: &Hall, role: Role, method: &str, path: &str) -> Reply {
    let (token, _) = TOKENS[role as usize];
    Request::new(method, path).token(token).sent_ago(0).send(&hall.port())
}

#[test]
fn whoever_asks_is_told_who_they_are_and_what_they_may() {
    let hall = Hall::open();
    for role in [Role::View, Role::Operate, Role::Engineer] {
        let who = as_role(&hall, role, "GET", "/api/v1/who").value();
        assert_eq!(
            who,
            serde_json::json!({"name": format!("{role}'s"), "role": role.to_string(), "surface": "http"})
        );
    }
}

#[test]
fn each_role_may_do_what_is_its_own_and_no_more() {
    let hall = Hall::open();
    let least = [
        ("stop", Role::View),
        ("go", Role::Operate),
        ("pause", Role::Operate),
        ("park", Role::Operate),
        ("disarm", Role::Operate),
        ("arm", Role::Engineer),
        ("home", Role::Engineer),
        ("clear", Role::Engineer),
    ];
    for (word, least) in least {
        for role in [Role::View, Role::Operate, Role::Engineer] {
            let reply = as_role(&hall, role, "POST", &format!("/api/v1/show/{word}"));
            if role < least {
                assert_eq!(reply.problem(), problem(403, "role"), "{word} by {role}");
            } else {
                assert_eq!(reply.status, 200, "{word} by {role}: {}", reply.text());
            }
        }
    }
    let asked = hall.asked.lock().unwrap();
    assert!(asked.iter().all(|one| one.who.surface == Surface::Http));
    assert!(
        asked
            .iter()
            .filter(|one| matches!(one.ask, Command::Arm { .. }))
            .all(|one| one.who.name == "engineer's")
    );
}

#[test]
fn without_a_token_there_is_nothing_but_the_page_and_whether_it_is_well() {
    let hall = Hall::open();
    for path in ["/api/v1/status", "/api/v1/events", "/api/v1/cues", "/metrics", "/api/v1/nothing"] {
        let reply = hall.port().get(path);
        assert_eq!(reply.problem(), problem(401, "token"), "{path}");
        assert_eq!(reply.header("www-authenticate"), Some("Bearer"));
        assert!(reply.value().get("state").is_none(), "nothing of the hall: {}", reply.text());
    }
    assert_eq!(hall.port().post("/api/v1/show/stop").problem(), problem(401, "token"));
    hall.is_well();
    for path in ["/", "/console.js", "/healthz", "/api/v1/openapi.json"] {
        assert_eq!(hall.port().get(path).status, 200, "{path}");
    }
    assert!(hall.asks().is_empty() && !hall.desk.take_stop());
}

#[test]
fn who_may_look_without_a_token_may_stop_too_and_nothing_else() {
    let hall = Hall::with(crate::hall::with_controller(), |api| kinocue::harness::config::Api {
        open_role: Some(Role::View),
        ..api
    });
    assert_eq!(hall.port().get("/api/v1/status").state(), "parked");
    assert_eq!(hall.port().post("/api/v1/show/pause").problem(), problem(403, "role"));
    assert_eq!(hall.port().post("/api/v1/show/stop").state(), "stopping");
    assert!(hall.desk.take_stop());
    // Not even a token that is no more, nor too many of them, keep anybody from what they could do without one.
    for n in 0..7 {
        let stop = Request::new("POST", "/api/v1/show/stop").token("of-last-year").send(&hall.port());
        assert_eq!(stop.state(), "stopping", "try {n}");
        assert!(hall.desk.take_stop());
    }
    let look = Request::new("GET", "/api/v1/status").token("of-last-year").send(&hall.port());
    assert_eq!(look.problem(), problem(429, "busy"));
    let stop = Request::new("POST", "/api/v1/show/stop")
        .token("of-last-year")
        .header("Origin", "http://evil.example");
    assert_eq!(stop.send(&hall.port()).problem(), problem(403, "origin"));
}

#[test]
fn who_guesses_tokens_waits_and_shuts_nobody_out_who_has_one() {
    let hall = Hall::open();
    let guess = |token: &str| Request::new("GET", "/api/v1/status").token(token).send(&hall.port());
    assert_eq!(guess("booth-token").status, 200);
    for n in 0..5 {
        assert_eq!(guess(&format!("guess-{n}")).problem(), problem(401, "token"));
    }
    assert_eq!(guess("guess-6").problem(), problem(429, "busy"));
    assert_eq!(guess("booth-token").status, 200, "from the same address");
    let stop = Request::new("POST", "/api/v1/show/stop").token("guest-token");
    assert_eq!(stop.send(&hall.port()).state(), "stopping");
    assert!(hall.desk.take_stop());
    assert_eq!(guess("guess-7").problem(), problem(429, "busy"), "a right one ends no waiting for the wrong");
}

#[test]
fn a_server_is_asked_by_its_own_name_and_from_its_own_pages() {
    let hall = Hall::open();
    let port = hall.address().port();
    let get = |host: &str| Request::new("GET", "/").host(host).send(&hall.port());
    assert_eq!(get(&format!("localhost:{port}")).status, 200);
    assert_eq!(get("evil.example").problem(), problem(403, "origin"));
    assert_eq!(get(&format!("localhost:{port}\r\nHost: evil.example")).problem(), problem(400, "value"));
    let stop = |origin: &str| {
        Request::new("POST", "/api/v1/show/stop")
            .token("booth-token")
            .header("Origin", origin)
            .send(&hall.port())
    };
    for other in
        ["http://evil.example", "null", "http://localhost", &format!("https://localhost:{port}.evil.example")]
    {
        assert_eq!(stop(other).problem(), problem(403, "origin"), "{other}");
    }
    assert!(!hall.desk.take_stop());
    assert_eq!(stop(&format!("http://localhost:{port}")).state(), "stopping");
    let by_socket = Request::new("POST", "/api/v1/show/stop").header("Origin", "http://evil.example");
    assert_eq!(
        by_socket.send(&hall.socket()).problem(),
        problem(403, "origin"),
        "also through a forwarded socket"
    );
}
