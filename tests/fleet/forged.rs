//! Wishes and files that are not what they should be: each is refused in words, and the library stays as it is.

use std::fs;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nkeys::KeyPair;
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

use crate::cues::{cue, library};
use crate::fleet::Engine;
use crate::hall::swell;
use crate::lists;
use crate::rights::Member;

/// A desk that says whatever it is told to.
struct Forger {
    runtime: tokio::runtime::Runtime,
    desk: Member,
    pair: KeyPair,
}

impl Forger {
    fn of(engine: &Engine) -> Self {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let desk = runtime.block_on(Member::connect(engine, "office/desk.nk", "_INBOX_desk.office"));
        Self { runtime, desk, pair: key(engine, "office/letters.nk") }
    }

    /// Publishes something as a desk may.
    fn publish(&self, subject: &str, payload: Vec<u8>) {
        let subject = subject.to_owned();
        self.runtime.block_on(async {
            self.desk.client.publish(subject, payload.into()).await.unwrap();
            self.desk.client.flush().await.unwrap();
        });
    }

    fn wish(&self, letter: &Value) {
        self.publish("$JS.hub.API.$KV.kc_want.berlin.h1", letter.to_string().into_bytes());
    }
}

/// A key of the fleet, by its file.
pub(crate) fn key(engine: &Engine, name: &str) -> KeyPair {
    let seed = fs::read_to_string(engine.path(&format!("fleet/{name}"))).unwrap();
    KeyPair::from_seed(seed.trim()).unwrap()
}

pub(crate) fn letter(pair: &KeyPair, body: &Value) -> Value {
    let body = body.to_string();
    let sig = STANDARD.encode(pair.sign(&signed(&body)).unwrap());
    json!({ "key": pair.public_key(), "sig": sig, "body": body })
}

/// What a letter of that text has signed.
pub(crate) fn signed(body: &str) -> Vec<u8> {
    [b"kinocue letter 1\n", body.as_bytes()].concat()
}

fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn wish(rev: u64, id: &str, bytes: &[u8]) -> Value {
    json!({ "to": "berlin.h1", "rev": rev, "cues": { id: { "sha256": sha256(bytes), "bytes": bytes.len() } } })
}

#[test]
fn no_wish_counts_that_was_altered_is_another_s_is_old_or_names_a_path_and_nothing_changes() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let hall = engine.hall("h1", r#"["cues"]"#);
    let _link = engine.link("h1", &hall);
    let bytes = swell(3).into_bytes();
    let file = cue(&engine, "storm", &swell(3));
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "berlin.h1"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let rev = engine.has("berlin.h1", |_| true)["wished_rev"].as_u64().unwrap();
    let (before, forger) = (library(&hall), Forger::of(&engine));
    let own = |body: Value| letter(&forger.pair, &body);
    let next = wish(rev + 1, "other", &bytes);
    let mut altered = own(next.clone());
    altered["body"] = altered["body"].as_str().unwrap().replace("other", "ride").into();
    let stranger = letter(&KeyPair::new_service(), &next);
    let mut borrowed = stranger.clone();
    borrowed["key"] = forger.pair.public_key().into();
    let mut foreign = next.clone();
    foreign["to"] = "berlin.h2".into();
    let mut long = next.clone();
    long["cues"]["other"]["bytes"] = (1_u64 << 40).into();
    // The folder beside that of the hall is everybody's.
    let here = hall.folder().file_name().unwrap().to_str().unwrap();
    let outside = format!("../forged-{here}");
    let digest =
        json!({ "to": "berlin.h1", "rev": rev + 1, "cues": { "x": { "sha256": "../x", "bytes": 1 } } });
    for (what, says) in [
        (altered, "no key of [fleet] has signed this"),
        (stranger, "no key of [fleet] has signed this"),
        (borrowed, "no key of [fleet] has signed this"),
        (own(foreign), "the wish is for berlin.h2, and this hall is berlin.h1"),
        (own(wish(rev - 1, "other", &bytes)), "is older than the one that the hall keeps"),
        (own(wish(rev, "other", &bytes)), "there are two wishes of rev"),
        (own(wish(u64::MAX, "other", &bytes)), "is of more than a day from now"),
        (own(wish(rev + 1, &outside, &bytes)), "is not an id"),
        (own(wish(rev + 1, "x/../../y", &bytes)), "is not an id"),
        (own(digest), "is not 64 small hexadecimal digits"),
        (own(long), "more than the"),
        (json!({ "levels": 1 }), "the body is not valid here"),
    ] {
        forger.wish(&what);
        let told = engine.has("berlin.h1", |hall| {
            hall["report"]["refused"].as_str().is_some_and(|why| why.contains(says))
        });
        // What it has of the wish that it keeps is told on.
        assert_eq!(
            (&told["report"]["rev"], &told["report"]["cues"]["storm"]["state"]),
            (&rev.into(), &"ready".into())
        );
        assert_eq!(library(&hall), before, "{what}");
    }
    assert!(!hall.folder().join(&outside).exists() && !hall.path("x").exists());
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "berlin.h1"]);
    assert!(
        run.code == Some(1) && run.stderr.contains("what was wished before is no wish; --only"),
        "{run:?}"
    );
    // One hall whose wish cannot be added to keeps it from no other.
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "all", "--no-wait"]);
    assert!(run.code == Some(1) && run.stderr.contains("berlin.h1: what was wished before"), "{run:?}");
    engine.has("berlin.h2", |hall| hall["wished_rev"].is_u64());
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "berlin.h1", "--only"]);
    assert_eq!(run.code, Some(0), "{run:?}");
}

#[test]
fn no_playlist_counts_that_was_altered_is_another_s_is_old_or_names_a_path_and_nothing_changes() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", r#"["cues", "playlists"]"#);
    let _link = engine.link("h1", &hall);
    let run = lists::send(&engine, "today", &lists::of("Today", "ride"), &[]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let rev = engine.has("berlin.h1", |_| true)["wished_rev"].as_u64().unwrap();
    let (before, forger) = (lists::lists(&hall), Forger::of(&engine));
    let own = |body: Value| letter(&forger.pair, &body);
    let of = |rev: u64, id: &str, more: Value| {
        let mut list = json!({ "text": lists::of("Night", "night") });
        list.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        json!({ "to": "berlin.h1", "rev": rev, "cues": {}, "playlists": { id: list } })
    };
    let drops =
        |id: &str| json!({ "to": "berlin.h1", "rev": rev + 1, "cues": {}, "drops": { "playlists": [id] } });
    let next = of(rev + 1, "today", json!({}));
    let mut altered = own(next.clone());
    altered["body"] = altered["body"].as_str().unwrap().replace("night", "ride").into();
    let mut foreign = next.clone();
    foreign["to"] = "berlin.h2".into();
    for (what, says) in [
        (altered, "no key of [fleet] has signed this"),
        (letter(&KeyPair::new_service(), &next), "no key of [fleet] has signed this"),
        (own(foreign), "the wish is for berlin.h2, and this hall is berlin.h1"),
        (own(of(rev - 1, "today", json!({}))), "is older than the one that the hall keeps"),
        (own(of(rev, "today", json!({}))), "there are two wishes of rev"),
        (own(of(rev + 1, "../today", json!({}))), "is not an id"),
        (own(of(rev + 1, "today", json!({ "from_ms": u64::MAX }))), "is no time"),
        (own(of(rev + 1, "today", json!({ "load": true }))), "unknown field"),
        (letter(&KeyPair::new_service(), &drops("today")), "no key of [fleet] has signed this"),
        (own(drops("../today")), "is not an id"),
    ] {
        forger.wish(&what);
        engine.has("berlin.h1", |hall| {
            hall["report"]["refused"].as_str().is_some_and(|why| why.contains(says))
        });
        assert_eq!(lists::lists(&hall), before, "{what}");
    }
    assert!(!hall.path("today.toml").exists());
}

#[test]
fn a_hall_that_allows_cues_alone_takes_no_playlist_and_its_cues_come_all_the_same() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", r#"["cues"]"#);
    let _link = engine.link("h1", &hall);
    let run = lists::send(&engine, "today", &lists::of("Today", "ride"), &[]);
    let says = "berlin.h1: playlist today: refused: allow of [fleet] does not name playlists";
    assert!(run.code == Some(1) && run.stdout.contains(says), "{run:?}");
    let file = cue(&engine, "storm", &swell(3));
    assert_eq!(engine.desk(&["push", file.to_str().unwrap(), "--to", "all"]).code, Some(0));
    let run = engine.desk(&["have"]);
    assert!(run.code == Some(1) && run.stdout.contains("1 of 2") && run.stdout.contains(says), "{run:?}");
    assert!(lists::lists(&hall).is_empty());
}

#[test]
fn bytes_that_are_not_those_of_the_wish_never_reach_a_library_and_cannot_be_pushed_over() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", r#"["cues"]"#);
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    let (before, forger) = (library(&hall), Forger::of(&engine));
    let true_bytes = swell(3).into_bytes();
    let altered = swell(3).replace("0.05", "0.06").into_bytes();
    let subject = format!("kc.cue.{}.0", sha256(&true_bytes));
    forger.publish(&subject, altered);
    forger.publish(&subject, true_bytes.clone());
    forger.wish(&letter(&forger.pair, &wish(7, "storm", &true_bytes)));
    let other = "the engine has another file under that digest";
    engine.has("berlin.h1", |hall| {
        hall["cues"][0]["text"]
            .as_str()
            .is_some_and(|text| text.starts_with("refused: ") && text.contains(other))
    });
    assert_eq!(library(&hall), before);
    let file = cue(&engine, "storm", &swell(3));
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "all"]);
    assert!(run.code == Some(1) && run.stderr.contains("has another file under the digest"), "{run:?}");
    assert_eq!(library(&hall), before);
}

#[test]
fn the_socket_takes_no_file_that_no_wish_names_whoever_opens_it() {
    let hall =
        crate::hall::Hall::open_with(|config| config + "[fleet]\nname = \"berlin.h1\"\nallow = [\"cues\"]\n");
    let before = library(&hall);
    let socket = crate::http::To::Unix(hall.path("fleet.sock"));
    for id in ["storm", "ride", "..%2fx", "UPPER"] {
        let request = crate::http::Request::new("PUT", &format!("/api/v1/fleet/cues/{id}"));
        let (status, _) = request.header("Content-Type", "text/csv").body(swell(3)).send(&socket).problem();
        assert!([400, 404].contains(&status), "{id}: {status}");
    }
    assert_eq!(library(&hall), before);
}

#[test]
fn a_hall_whose_key_was_stolen_has_no_other_told_of_and_no_cue_written_over() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let hall = engine.hall("h2", r#"["cues"]"#);
    let link = engine.link("h2", &hall);
    let file = cue(&engine, "storm", &swell(3));
    assert_eq!(engine.desk(&["push", file.to_str().unwrap(), "--to", "berlin.h2"]).code, Some(0));
    drop(link);
    let told = |hall: &Value| hall["report"]["version"] == env!("CARGO_PKG_VERSION");
    engine.has("berlin.h2", told);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut thief = Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1").await;
        // What it says of itself, the engine is to say of another.
        let forged = r#"{"version":"forged","rev":1,"cues":{}}"#;
        assert!(thief.may_publish_text("kc.log.berlin.h1", forged).await);
        for to in ["$KV.kc_have.berlin.h2", &format!("kc.cue.{}.0", sha256(swell(3).as_bytes()))] {
            let last = r#"{"last_by_subj":"kc.log.berlin.h1"}"#;
            let asks = "$JS.hub.API.STREAM.MSG.GET.kc_log";
            thief.client.publish_with_reply(asks, to.to_owned(), last.into()).await.unwrap();
        }
        thief.client.flush().await.unwrap();
    });
    let now = engine.has("berlin.h2", |now| !told(now));
    assert_eq!(now["report"], Value::Null, "what the engine answered is no report of the hall");
    let run = engine.desk(&["push", file.to_str().unwrap(), "--to", "berlin.h2", "--no-wait"]);
    assert!(run.code == Some(0) && run.stderr.contains("; 0 messages"), "its file is as it was: {run:?}");
}
