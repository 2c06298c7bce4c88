//! The two keys of a desk: what an engine that is none has the first one sign, and how a desk of an earlier version gets the second.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpListener;
use std::process::Command;

use base64::Engine as _;
use base64::engine::general_purpose::{STANDARD, URL_SAFE_NO_PAD};
use kinocue::harness::sys::clock::wall_now_ns;
use nkeys::KeyPair;
use serde_json::{Value, json};

use crate::fleet::{ALL, Engine};
use crate::forged;
use crate::http::{Request, To, problem};
use crate::process::{Guarded, kinocue};

/// Takes the signature of a desk that comes as to its engine, of whatever text is sent as the challenge; and the key.
fn signature_of(engine: &Engine, text: &str) -> (String, Vec<u8>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    engine.reached_at("office", &listener.local_addr().unwrap().to_string());
    let mut desk = Command::new(env!("CARGO_BIN_EXE_kinocue"));
    desk.args(["fleet", "status"]).env("KINOCUE_DESK", engine.path("fleet/office/desk.toml"));
    let _desk = Guarded::start_command(&mut desk);
    let (stream, _) = listener.accept().unwrap();
    let info = json!({ "server_id": "x", "version": "2.9.10", "proto": 1, "headers": true, "max_payload": 1 << 20,
        "auth_required": true, "nonce": text });
    write!(&stream, "INFO {info}\r\n").unwrap();
    let mut lines = BufReader::new(stream).lines();
    let connect = lines.find_map(|line| line.unwrap().strip_prefix("CONNECT ").map(str::to_owned)).unwrap();
    let connect: Value = serde_json::from_str(&connect).unwrap();
    let sig = URL_SAFE_NO_PAD.decode(connect["sig"].as_str().unwrap()).unwrap();
    (connect["nkey"].as_str().unwrap().to_owned(), sig)
}

#[test]
fn what_an_engine_that_is_none_has_a_desk_sign_as_a_challenge_is_no_letter() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", ALL);
    let letters = forged::key(&engine, "office/letters.nk").public_key();
    for domain in ["", "kinocue letter 1\n"] {
        let now_ms = wall_now_ns() / 1_000_000;
        let order = json!({ "id": format!("n{}", domain.len()), "to": "berlin.h1", "word": "pause", "args": {}, "sent_ms": now_ms });
        let body = order.to_string();
        let text = format!("{domain}{body}");
        let (login, sig) = signature_of(&engine, &text);
        KeyPair::from_public_key(&login).unwrap().verify(text.as_bytes(), &sig).expect("it was signed");
        for key in [&login, &letters] {
            let letter = json!({ "key": key, "sig": STANDARD.encode(&sig), "body": body });
            let order = Request::new("POST", "/api/v1/fleet/order").json(letter.to_string());
            assert_eq!(
                order.send(&To::Unix(hall.path("fleet.sock"))).problem(),
                problem(401, "token"),
                "{domain}{key}"
            );
        }
    }
}

#[test]
fn a_desk_of_an_earlier_version_is_asked_to_migrate_and_leads_halls_again_once_they_have_its_second_key() {
    let Some(engine) = Engine::start("h1") else { return };
    let file = engine.path("fleet/office/desk.toml");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replace("letters = \"letters.nk\"\n", "")).unwrap();
    fs::remove_file(engine.path("fleet/office/letters.nk")).unwrap();
    let run = engine.desk(&["status"]);
    assert!(run.code == Some(78) && run.stderr.contains("`kinocue fleet init --migrate "), "{run:?}");
    let migrate = || kinocue(&["fleet", "init", "--migrate", file.to_str().unwrap()]);
    let run = migrate();
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(fs::read_to_string(&file).unwrap(), text);
    let public = run.stdout.lines().find(|line| line.starts_with("public = \"V")).expect("it prints the key");
    let again = migrate();
    assert!(again.code == Some(64) && again.stderr.contains("already"), "{again:?}");
    let file = engine.path("fleet/h1/kinocue-fleet.toml");
    let table = fs::read_to_string(&file).unwrap();
    let lines = table.lines().map(|line| if line.starts_with("public") { public } else { line });
    fs::write(&file, lines.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let hall = engine.hall("h1", ALL);
    let _link = engine.link("h1", &hall);
    engine.hears_one();
    let run = engine.desk(&["level", "50%", "berlin.h1"]);
    assert_eq!(run.code, Some(0), "{run:?}");
}
