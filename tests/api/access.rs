//! Who may do what, and from where.

use kinocue::harness::control::{Command, Role, Surface};

use crate::client::{Reply, Request, problem};
use crate::hall::{Hall, TOKENS};
use crate::routes::described;

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

/// What nobody needs a token for.
const OPEN: [&str; 3] = ["get /api/v1/openapi.json", "get /healthz", "get /readyz"];

/// What whoever may look may not; all else that changes something, but a stop, stands below.
const OF_OPERATORS: [&str; 18] = [
    "post /api/v1/controllers/{name}/disable",
    "post /api/v1/controllers/{name}/enable",
    "post /api/v1/playlist/select",
    "post /api/v1/preflight",
    "post /api/v1/presets/{name}",
    "post /api/v1/record/dump",
    "post /api/v1/record/mark",
    "post /api/v1/show/disarm",
    "post /api/v1/show/go",
    "post /api/v1/show/load",
    "post /api/v1/show/park",
    "post /api/v1/show/pause",
    "post /api/v1/show/resume",
    "post /api/v1/show/seek",
    "put /api/v1/levels",
    "put /api/v1/playlist",
    "put /api/v1/sync/source",
    "put /api/v1/trim",
];

const OF_ENGINEERS: [&str; 8] = [
    "delete /api/v1/recordings/{name}",
    "get /api/v1/recordings/{name}",
    "post /api/v1/reload",
    "post /api/v1/show/arm",
    "post /api/v1/show/clear",
    "post /api/v1/show/home",
    "post /api/v1/test",
    "put /api/v1/cues/{id}",
];

const STOP: &str = "post /api/v1/show/stop";

/// A request for each operation of the description, in all the ways in which one can come that is to be refused without a look into it: with
/// a body that is none, one that is too long, a key, and nothing. With them the role that it needs; none where nobody has to say who they are.
fn operations(hall: &Hall) -> Vec<(String, Option<Role>, Vec<Request>)> {
    let of = |(method, path): (String, String)| {
        let name = format!("{method} {path}");
        let least = match name.as_str() {
            open if OPEN.contains(&open) => None,
            one if OF_OPERATORS.contains(&one) => Some(Role::Operate),
            one if OF_ENGINEERS.contains(&one) => Some(Role::Engineer),
            _ => Some(Role::View),
        };
        assert!(method == "get" || name == STOP || least > Some(Role::View), "{name} stands in no table");
        let path = path.replace("{name}", "a").replace("{id}", "a").replace("{day}", "2026-01-31");
        let plain = Request::new(&method.to_uppercase(), &path);
        let mut ways = vec![plain.clone()];
        if method != "get" {
            let long = plain.clone().json("7".repeat(100_000));
            ways.extend([plain.clone().json("{"), long, plain.json("{").header("Idempotency-Key", "k")]);
        }
        (name, least, ways)
    };
    described(hall).into_iter().map(of).collect()
}

#[test]
fn who_may_not_is_refused_by_every_route_before_a_look_at_the_body_and_who_may_is_not() {
    let hall = Hall::open();
    let operations = operations(&hall);
    let named: Vec<&str> = operations.iter().map(|(name, ..)| name.as_str()).collect();
    let tables = [&OPEN[..], &OF_OPERATORS, &OF_ENGINEERS].concat();
    assert!(tables.iter().all(|name| named.contains(name)), "the tables name what is there");
    for (name, least, ways) in &operations {
        for request in ways {
            let refusal = || request.send(&hall.port());
            match least {
                None => assert_ne!(refusal().status, 401, "{name}"),
                Some(_) => assert_eq!(refusal().problem(), problem(401, "token"), "{name}"),
            }
            for (token, role) in TOKENS {
                if Some(role) < *least {
                    let refusal = request.clone().token(token).send(&hall.port());
                    assert_eq!(refusal.problem(), problem(403, "role"), "{name} by {role}: {request:?}");
                } else if name != "get /api/v1/events" {
                    let status = request.clone().token(token).send(&hall.port()).status;
                    assert!(status != 401 && status != 403, "{name} by {role}: {status}");
                }
            }
        }
    }
}

#[test]
fn the_head_of_what_may_not_be_read_is_not_told_either() {
    let hall = Hall::open();
    assert_eq!(as_role(&hall, Role::Operate, "HEAD", "/api/v1/recordings/a").status, 403);
    assert_eq!(as_role(&hall, Role::Engineer, "HEAD", "/api/v1/recordings/a").status, 404);
}

#[test]
fn what_is_no_file_in_the_folder_of_recordings_is_none_and_holds_nobody_up() {
    let hall = Hall::open();
    let folder = hall.dir.path().join("recordings");
    std::fs::create_dir(&folder).unwrap();
    std::fs::create_dir_all(hall.dir.path().join("journal")).unwrap();
    let [pipe, link] = ["2026-01-01T10-00-00-show-pipe.mcap", "2026-01-01T10-00-00-show-link.mcap"];
    let made = std::process::Command::new("mkfifo").arg(folder.join(pipe)).status().unwrap();
    assert!(made.success());
    std::os::unix::fs::symlink("/etc/passwd", folder.join(link)).unwrap();
    let get = |path: &str| as_role(&hall, Role::Engineer, "GET", path);
    for name in [pipe, link] {
        assert_eq!(get(&format!("/api/v1/recordings/{name}")).status, 404, "{name}");
        assert_eq!(get(&format!("/api/v1/recordings/{name}/picture")).problem().0, 404, "{name}");
    }
    assert_eq!(get("/api/v1/recordings").value(), serde_json::json!([]));
    assert_eq!(get("/api/v1/history").status, 200);
    std::fs::write(folder.join("2026-01-01T10-00-00-show-one.mcap"), b"x").unwrap();
    assert_eq!(get("/api/v1/recordings/2026-01-01T10-00-00-show-one.mcap").body, b"x");
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
