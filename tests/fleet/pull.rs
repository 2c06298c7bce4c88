//! Cues out of halls to the desk: verified, over nothing, and only where people there allow it.

use std::fs;
use std::sync::Mutex;
use std::thread;

use futures_util::StreamExt as _;
use serde_json::{Value, json};

use crate::cues::cue;
use crate::fleet::Engine;
use crate::hall::swell;
use crate::rights::Member;

const PULL: &str = r#"["cues", "pull"]"#;

/// A gentle cue of three pieces.
fn long() -> String {
    let words = format!("# note: {}\n", "x".repeat(1000)).repeat(300);
    swell(2).replace("# title: Swell\n", &format!("# title: Swell\n{words}"))
}

#[test]
fn a_cue_comes_back_from_a_hall_as_it_is_and_over_no_file_that_is_there() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", PULL);
    let _link = engine.link("h1", &hall);
    let file = cue(&engine, "storm", &long());
    assert_eq!(engine.desk(&["push", file.to_str().unwrap(), "--to", "all"]).code, Some(0));
    let out = engine.path("back.csv");
    let pull = |cue: &str, more: &[&str]| {
        engine.desk(&[&["pull", "berlin.h1", cue, "--out", out.to_str().unwrap()][..], more].concat())
    };
    let run = pull("storm", &[]);
    assert!(
        run.code == Some(0) && run.stdout.ends_with("; the very file that this desk wished there\n"),
        "{run:?}"
    );
    assert_eq!(fs::read_to_string(&out).unwrap(), long());
    let run = pull("ride", &[]);
    assert!(run.code == Some(64) && run.stderr.contains("exists; --force replaces it"), "{run:?}");
    assert_eq!(fs::read_to_string(&out).unwrap(), long());
    let other = ["--force", "--sha256", &"0".repeat(64)];
    // The cues that were there are checked one after the other once the service has begun.
    engine.wait(|_| !pull("ride", &other).stderr.contains("not checked yet"));
    let run = pull("ride", &other);
    assert!(run.code == Some(1) && run.stderr.contains("it has another cue of that id"), "{run:?}");
    assert_eq!(fs::read_to_string(&out).unwrap(), long());
    let run = pull("ride", &["--force"]);
    assert!(run.code == Some(0) && run.stdout.contains("; as the hall has it; "), "{run:?}");
    assert_eq!(fs::read(&out).unwrap(), fs::read(hall.path("cues/ride.csv")).unwrap());
    let run = pull("nothing", &["--force"]);
    assert!(run.code == Some(1) && run.stderr.contains("there is no cue"), "{run:?}");
    hall.arm("ride");
    let run = pull("ride", &["--force"]);
    assert!(
        run.code == Some(1) && run.stderr.contains("the hall is armed, and gives nothing out"),
        "{run:?}"
    );
    let left = fs::read_dir(engine.path("")).unwrap().map(|entry| entry.unwrap().file_name());
    assert!(left.into_iter().all(|name| !name.to_str().unwrap().ends_with(".part")), "no part is left");
}

#[test]
fn a_hall_gives_nothing_out_that_its_people_do_not_allow() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", r#"["cues", "load", "playlists"]"#);
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    let out = engine.path("back.csv");
    let run = engine.desk(&["pull", "berlin.h1", "ride", "--out", out.to_str().unwrap()]);
    assert!(run.code == Some(1) && run.stderr.contains("allow of [fleet] does not name pull"), "{run:?}");
    assert!(!out.exists());
}

#[test]
fn whoever_has_the_key_of_a_hall_makes_the_desk_write_nothing_but_the_file_that_was_named() {
    let Some(engine) = Engine::start("h1") else { return };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let thief = runtime.block_on(Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1")).client;
    let mut orders = runtime.block_on(thief.subscribe("kc.cmd.berlin.h1.*.*")).unwrap();
    runtime.block_on(thief.flush()).unwrap();
    let says = Mutex::new(Value::Null);
    let said = |says: &Mutex<Value>| says.lock().unwrap().clone();
    let (end, ended) = tokio::sync::oneshot::channel::<()>();
    let answers = async {
        while let Some(order) = orders.next().await {
            let reply = json!({ "hall": "berlin.h1", "status": 200, "reply": said(&says) });
            thief.publish(order.reply.unwrap(), reply.to_string().into()).await.unwrap();
        }
    };
    thread::scope(|scope| {
        scope.spawn(|| {
            runtime.block_on(async {
                tokio::select! { () = answers => {}, _ = ended => {} }
            })
        });
        let _end = end;
        asks_the_thief(&engine, &says);
    });
}

/// Has the desk pull from somebody who says what no hall would.
fn asks_the_thief(engine: &Engine, says: &Mutex<Value>) {
    let out = engine.path("out/back.csv");
    fs::create_dir(out.parent().unwrap()).unwrap();
    let named = "0".repeat(64);
    for (lie, why) in [
        (json!({ "sha256": "../../x", "bytes": 3, "mcap": false, "data": "eHh4" }), "is no SHA-256"),
        (json!({ "sha256": named, "bytes": u64::MAX, "mcap": false, "data": "eHh4" }), "is outside 1..="),
        (json!({ "sha256": named, "bytes": 4, "mcap": false, "data": "eHh4" }), "does not fit"),
        (
            json!({ "sha256": named, "bytes": 3, "mcap": false, "data": "eHh4" }),
            "is not the file that it names",
        ),
        (json!({ "sha256": named, "bytes": 3, "mcap": false, "data": "?" }), "no base64"),
        (json!({ "sha256": named, "bytes": 3, "mcap": "../x", "data": "eHh4" }), "no piece of a cue"),
        (json!([1]), "no piece of a cue"),
    ] {
        says.lock().unwrap().clone_from(&lie);
        let run = engine.desk(&["pull", "berlin.h1", "storm", "--out", out.to_str().unwrap()]);
        assert!(run.code == Some(1) && run.stderr.contains(why), "{lie}: {run:?}");
        assert!(!out.exists(), "{lie}");
    }
}
