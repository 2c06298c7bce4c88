//! The description that is served, and what is served.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::client::{Request, problem};
use crate::hall::Hall;
use crate::programs::is_there;

const GETS: [&str; 19] = [
    "/api/v1/controllers",
    "/api/v1/controllers/{name}",
    "/api/v1/cues",
    "/api/v1/cues/{id}",
    "/api/v1/cues/{id}/curve",
    "/api/v1/events",
    "/api/v1/history",
    "/api/v1/openapi.json",
    "/api/v1/playlists",
    "/api/v1/recordings",
    "/api/v1/recordings/{name}",
    "/api/v1/recordings/{name}/picture",
    "/api/v1/reports/{day}",
    "/api/v1/status",
    "/api/v1/sync",
    "/api/v1/who",
    "/healthz",
    "/metrics",
    "/readyz",
];

const CHANGES: [(&str, &str); 24] = [
    ("post", "/api/v1/controllers/{name}/disable"),
    ("post", "/api/v1/controllers/{name}/enable"),
    ("post", "/api/v1/playlist/select"),
    ("post", "/api/v1/preflight"),
    ("post", "/api/v1/presets/{name}"),
    ("post", "/api/v1/record/dump"),
    ("post", "/api/v1/record/mark"),
    ("post", "/api/v1/reload"),
    ("post", "/api/v1/show/arm"),
    ("post", "/api/v1/show/clear"),
    ("post", "/api/v1/show/disarm"),
    ("post", "/api/v1/show/go"),
    ("post", "/api/v1/show/home"),
    ("post", "/api/v1/show/load"),
    ("post", "/api/v1/show/park"),
    ("post", "/api/v1/show/pause"),
    ("post", "/api/v1/show/resume"),
    ("post", "/api/v1/show/seek"),
    ("post", "/api/v1/show/stop"),
    ("post", "/api/v1/test"),
    ("put", "/api/v1/levels"),
    ("put", "/api/v1/playlist"),
    ("put", "/api/v1/sync/source"),
    ("put", "/api/v1/trim"),
];

/// Every operation of the description.
pub fn described(hall: &Hall) -> Vec<(String, String)> {
    let document = hall.socket().get("/api/v1/openapi.json").value();
    let paths = document["paths"].as_object().unwrap();
    let of_path = |(path, item): (&String, &Value)| {
        let methods: Vec<_> = item.as_object().unwrap().keys().cloned().collect();
        methods.into_iter().map(|method| (method, path.clone())).collect::<Vec<_>>()
    };
    paths.iter().flat_map(of_path).collect()
}

#[test]
fn the_description_has_every_route_and_every_route_is_served() {
    let hall = Hall::open();
    let mut wanted: Vec<_> = GETS.iter().map(|path| ("get", *path)).collect();
    wanted.extend(CHANGES);
    wanted.extend([("put", "/api/v1/cues/{id}"), ("delete", "/api/v1/recordings/{name}")]);
    let mut wanted: Vec<_> =
        wanted.iter().map(|(method, path)| ((*method).to_owned(), (*path).to_owned())).collect();
    let mut found = described(&hall);
    wanted.sort();
    found.sort();
    assert_eq!(found, wanted);
    for (_, path) in found.into_iter().filter(|(_, path)| path != "/api/v1/recordings/{name}") {
        let path = path.replace("{name}", "a").replace("{id}", "a").replace("{day}", "2026-01-31");
        let reply = Request::new("DELETE", &path).send(&hall.socket());
        assert_eq!(reply.problem(), problem(405, "method"), "{path}");
        assert!(reply.header("allow").is_some(), "{path}: {:?}", reply.headers);
    }
}

#[test]
fn every_operation_says_what_it_does_and_what_a_refusal_is() {
    let hall = Hall::open();
    let document = hall.socket().get("/api/v1/openapi.json").value();
    for (method, path) in described(&hall) {
        let operation = &document["paths"][&path][&method];
        assert!(operation["summary"].as_str().is_some_and(|text| !text.is_empty()), "{method} {path}");
        assert!(operation["responses"]["200"].is_object(), "{method} {path}");
        let problem = &operation["responses"]["default"]["content"]["application/problem+json"]["schema"];
        assert_eq!(problem["$ref"], "#/components/schemas/Problem", "{method} {path}");
    }
    assert!(document["components"]["schemas"]["Status"]["properties"]["controllers"].is_object());
}

#[test]
fn the_description_is_what_a_validator_takes() {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/readers/bin/python");
    if !is_there("python-mcap", python.is_file(), "tests/readers.sh installs it, and the validator") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("openapi.json");
    std::fs::write(&file, Hall::open().socket().get("/api/v1/openapi.json").text()).unwrap();
    let run = Command::new(python).args(["-m", "openapi_spec_validator"]).arg(&file).output().unwrap();
    let said = String::from_utf8_lossy(&run.stdout) + String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{said}");
}

#[test]
fn nothing_is_changed_by_a_get() {
    let hall = Hall::open();
    for (_, path) in CHANGES {
        let path = path.replace("{name}", "a");
        let reply = hall.socket().get(&path);
        assert_eq!(reply.problem(), problem(405, "method"), "{path}");
        let head = Request::new("HEAD", &path).send(&hall.socket());
        assert_eq!(head.status, 405, "{path}");
    }
    for path in GETS.iter().filter(|path| **path != "/api/v1/events") {
        let path = path.replace("{name}", "a").replace("{id}", "a").replace("{day}", "2026-01-31");
        assert!(hall.socket().get(&path).status < 600, "{path}");
    }
    assert!(hall.asks().is_empty() && !hall.desk.take_stop());
}
