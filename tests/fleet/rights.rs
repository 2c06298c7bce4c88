//! What the key of a hall, or of a desk, may at the engine, and what not.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use async_nats::{Client, ConnectOptions, Event};
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::Clock as _;
use nkeys::KeyPair;
use serde_json::{Value, json};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use tokio::time::{sleep, timeout};

use crate::fleet::Engine;
use crate::http::Request;
use crate::process::PATIENCE;

/// A member that says whatever it is told to.
pub(crate) struct Member {
    pub(crate) client: Client,
    refused: UnboundedReceiver<String>,
}

impl Member {
    pub(crate) async fn connect(engine: &Engine, key: &str, inbox: &str) -> Self {
        let seed = fs::read_to_string(engine.path(&format!("fleet/{key}"))).unwrap().trim().to_owned();
        let (tell, refused) = unbounded_channel();
        let options =
            ConnectOptions::with_nkey(seed).custom_inbox_prefix(inbox).event_callback(move |event| {
                if let Event::ServerError(error) = event {
                    let _ = tell.send(error.to_string());
                }
                async {}
            });
        Self { client: options.connect(engine.url()).await.unwrap(), refused }
    }

    /// Whether it may publish there.
    async fn may_publish(&mut self, subject: &str) -> bool {
        self.may_publish_text(subject, "x").await
    }

    /// The same of a text.
    pub(crate) async fn may_publish_text(&mut self, subject: &str, text: &str) -> bool {
        self.client.publish(subject.to_owned(), text.to_owned().into()).await.unwrap();
        self.is_let().await
    }

    async fn may_hear(&mut self, subject: &str) -> bool {
        let _heard = self.client.subscribe(subject.to_owned()).await.unwrap();
        self.is_let().await
    }

    /// The engine refuses in order: once it has refused what nobody may, it has told of what came before.
    async fn is_let(&mut self) -> bool {
        self.client.publish("kc.nobody", "x".into()).await.unwrap();
        self.client.flush().await.unwrap();
        let mut is_let = true;
        loop {
            let why = timeout(PATIENCE, self.refused.recv()).await.unwrap().unwrap();
            if why.contains("kc.nobody") {
                return is_let;
            }
            is_let = false;
        }
    }
}

/// A member that sends octets of its own.
struct RawMember(TcpStream);

impl RawMember {
    fn connect(engine: &Engine, key: &str) -> Self {
        let seed = fs::read_to_string(engine.path(&format!("fleet/{key}"))).unwrap();
        let pair = KeyPair::from_seed(seed.trim()).unwrap();
        let mut stream = TcpStream::connect(engine.address()).unwrap();
        let mut info = String::new();
        BufReader::new(&stream).read_line(&mut info).unwrap();
        let info: Value = serde_json::from_str(info.strip_prefix("INFO ").unwrap()).unwrap();
        let sig = URL_SAFE_NO_PAD.encode(pair.sign(info["nonce"].as_str().unwrap().as_bytes()).unwrap());
        let connect = json!({ "verbose": false, "headers": true, "nkey": pair.public_key(), "sig": sig });
        write!(stream, "CONNECT {connect}\r\n").unwrap();
        Self(stream)
    }

    /// Asks the engine, which is to answer there.
    fn ask(&mut self, subject: &str, to: &str, text: &str) {
        let _ = write!(self.0, "PUB {subject} {to} {}\r\n{text}\r\n", text.len());
    }

    /// Publishes with headers that are none.
    fn garble(&mut self, subject: &str) {
        let headers = "NATS/1.0\r\nno header\r\n\r\n";
        let length = headers.len();
        let _ = write!(self.0, "HPUB {subject} {length} {length}\r\n{headers}\r\n"); // it may be let in no more
    }
}

#[test]
fn a_stolen_key_of_a_hall_that_sends_what_nobody_can_read_takes_no_stop_of_another_hall_from_the_page() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let two = engine.hall("h2", "[]");
    let _link = engine.link("h2", &two);
    let page = engine.page("open_role = \"view\"");
    page.wait(|page| page["halls"].as_array().unwrap().iter().any(|hall| hall["silent"] == false));
    let mut thief = RawMember::connect(&engine, "h1/fleet.nk");
    let ends = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !ends.load(Ordering::Relaxed) {
                (0..20).for_each(|_| thief.garble("kc.status.berlin.h1"));
                Monotonic.sleep_until(Monotonic.now() + Duration::from_millis(2));
            }
        });
        page.wait(|page| page["engine"] == false);
        let stop = json!({ "halls": ["berlin.h2"] }).to_string();
        let stop = || Request::new("POST", "/api/v1/fleet/stop").json(stop.clone()).send(page.to()).value();
        let answers: Vec<_> = (0..5).map(|_| stop()).collect();
        ends.store(true, Ordering::Relaxed);
        assert!(answers.iter().all(|stop| stop[0]["done"] == true), "{answers:?}");
    });
    two.comes_to("stopped");
}

#[test]
fn what_nobody_can_read_the_engine_keeps_for_a_stolen_key_and_sends_to_no_other_hall() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let two = engine.hall("h2", "[]");
    let _link = engine.link("h2", &two);
    engine.hears_one();
    let mut thief = RawMember::connect(&engine, "h1/fleet.nk");
    let ends = AtomicBool::new(false);
    let stops: Vec<_> = thread::scope(|scope| {
        scope.spawn(|| {
            thief.garble("kc.log.berlin.h1");
            let last = json!({ "last_by_subj": "kc.log.berlin.h1" }).to_string();
            while !ends.load(Ordering::Relaxed) {
                thief.ask("$JS.hub.API.DIRECT.GET.kc_log.kc.log.berlin.h1", "kc.stop.berlin.h2.office", "");
                thief.ask("$JS.hub.API.STREAM.MSG.GET.kc_log", "kc.stop.berlin.h2.office", &last);
                Monotonic.sleep_until(Monotonic.now() + Duration::from_millis(2));
            }
        });
        let stops = (0..5).map(|_| engine.desk(&["stop", "berlin.h2"])).collect();
        ends.store(true, Ordering::Relaxed);
        stops
    });
    assert!(stops.iter().all(|stop| stop.code == Some(0)), "{stops:?}");
    two.comes_to("stopped");
}

/// Whoever makes a stream says of which subjects, and to whom the engine answers.
#[test]
fn what_the_engine_answers_is_no_answer_of_a_hall_and_no_stop_whatever_the_key_of_a_pair_has_it_keep() {
    let Some(engine) = Engine::start_with("h1,h2", &["--pairs", "h1"]) else { return };
    let hall = engine.hall("h2", "[]");
    let link = engine.link("h2", &hall);
    engine.hears_one();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let pair = Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1").await;
        let all = r#"{"name":"kc_lease_berlin=h1","subjects":["kc.cmd.>","kc.stop.>"],"storage":"memory"}"#;
        let create = pair.client.request("$JS.API.STREAM.CREATE.kc_lease_berlin=h1", all.into());
        let made = timeout(PATIENCE, create).await.unwrap().unwrap();
        assert!(String::from_utf8_lossy(&made.payload).contains("\"subjects\":[\"kc.cmd."), "{made:?}");
        let info = "$JS.API.STREAM.INFO.kc_lease_berlin=h1";
        pair.client.publish_with_reply(info, "kc.stop.berlin.h2.office", "".into()).await.unwrap();
        pair.client.flush().await.unwrap();
    });
    link.heard("no stop: a member had the engine answer here");
    assert_eq!(hall.status()["state"], "parked");
    let run = engine.desk(&["stop", "berlin.h2"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "berlin.h2: stopping\n"), "{run:?}");
    hall.comes_to("stopped");
    let run = engine.desk(&["level", "50%", "berlin.h2"]);
    assert!(run.stdout.contains("refused: the fleet may not levels"), "{run:?}");
}

#[test]
fn a_stolen_key_of_a_hall_tells_of_that_hall_alone_and_hears_no_other() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let work = async {
            let mut hall = Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1").await;
            for may in [
                "kc.status.berlin.h1",
                "kc.log.berlin.h1",
                "$JS.hub.API.$KV.kc_seen.berlin.h1",
                "$JS.hub.API.$KV.kc_have.berlin.h1",
                "$JS.hub.API.STREAM.MSG.GET.kc_log",
                "$JS.hub.API.DIRECT.GET.KV_kc_want.$KV.kc_want.berlin.h1",
                "$JS.hub.API.DIRECT.GET.kc_cues.kc.cue.5f.0",
            ] {
                assert!(hall.may_publish(may).await, "{may}");
            }
            for may_not in [
                "$JS.API.STREAM.CREATE.kc_lease_berlin=h1",
                "$JS.hub.API.STREAM.CREATE.kc_lease_berlin=h1",
                "$JS.hub.API.STREAM.INFO.kc_lease_berlin=h1",
                "kc.lease.berlin.h1",
                "kc.status.berlin.h2",
                "kc.log.berlin.h2",
                "kc.cmd.berlin.h2.office.pause",
                "kc.cmd.berlin.h1.office.pause",
                "kc.stop.berlin.h2.office",
                "kc.stop.berlin.all.office",
                "$KV.kc_seen.berlin.h2",
                "$JS.hub.API.$KV.kc_seen.berlin.h2",
                "$JS.API.STREAM.DELETE.kc_log",
                "$JS.hub.API.STREAM.DELETE.kc_log",
                "$JS.hub.API.STREAM.PURGE.kc_log",
                "$JS.hub.API.STREAM.INFO.kc_log",
                "$JS.hub.API.DIRECT.GET.kc_log.kc.log.berlin.h1",
                "$JS.hub.API.STREAM.MSG.GET.KV_kc_want",
                "$JS.hub.API.STREAM.MSG.GET.KV_kc_have",
                "$JS.hub.API.CONSUMER.CREATE.kc_log",
                "$JS.hub.API.CONSUMER.CREATE.kc_cues",
                "$JS.hub.API.CONSUMER.CREATE.KV_kc_want",
                "$JS.hub.API.DIRECT.GET.KV_kc_want",
                "$JS.hub.API.DIRECT.GET.kc_cues",
                "$JS.hub.API.DIRECT.GET.KV_kc_want.$KV.kc_want.berlin.h2",
                "$JS.hub.API.DIRECT.GET.KV_kc_have.$KV.kc_have.berlin.h1",
                "$JS.hub.API.STREAM.INFO.kc_cues",
                "$JS.hub.API.STREAM.PURGE.kc_cues",
                "$JS.hub.API.STREAM.MSG.DELETE.kc_cues",
                "$JS.hub.API.$KV.kc_have.berlin.h2",
                "$JS.hub.API.$KV.kc_want.berlin.h1",
                "$KV.kc_have.berlin.h2",
                "$KV.kc_want.berlin.h1",
                "kc.cue.5f.0",
            ] {
                assert!(!hall.may_publish(may_not).await, "{may_not}");
            }
            for may in ["kc.cmd.berlin.h1.*.*", "kc.stop.berlin.h1.*", "kc.stop.berlin.all.*"] {
                assert!(hall.may_hear(may).await, "{may}");
            }
            for may_not in [
                "kc.cmd.berlin.h2.*.*",
                "kc.status.berlin.h2",
                "kc.>",
                "_INBOX_hall.berlin.h2.>",
                "_INBOX_desk.office.>",
                ">",
            ] {
                assert!(!hall.may_hear(may_not).await, "{may_not}");
            }
            let mut desk = Member::connect(&engine, "office/desk.nk", "_INBOX_desk.office").await;
            for may in [
                "kc.cmd.berlin.h1.office.pause",
                "kc.stop.berlin.all.office",
                "kc.cue.5f.0",
                "$JS.hub.API.$KV.kc_want.berlin.h1",
            ] {
                assert!(desk.may_publish(may).await, "{may}");
            }
            for may_not in [
                "kc.cmd.berlin.h1.boss.pause",
                "kc.stop.berlin.h1.boss",
                "kc.status.berlin.h1",
                "kc.log.berlin.h1",
                "$JS.hub.API.STREAM.DELETE.kc_log",
                "$JS.hub.API.STREAM.PURGE.kc_log",
                "$JS.hub.API.STREAM.PURGE.kc_cues",
                "$JS.hub.API.STREAM.UPDATE.kc_cues",
                "$JS.hub.API.STREAM.DELETE.kc_cues",
                "$JS.hub.API.STREAM.MSG.DELETE.kc_cues",
                "$JS.hub.API.$KV.kc_have.berlin.h1",
                "$KV.kc_have.berlin.h1",
            ] {
                assert!(!desk.may_publish(may_not).await, "{may_not}");
            }
            let stranger = ConnectOptions::new().connect(engine.url()).await;
            assert!(stranger.is_err(), "nobody comes in without a key");
        };
        timeout(PATIENCE, work).await.unwrap();
    });
}

#[test]
fn a_key_of_a_hall_has_the_engine_neither_stop_another_nor_speak_for_it() {
    let Some(engine) = Engine::start("h1,h2,h3") else { return };
    let two = engine.hall("h2", "[]");
    let link = engine.link("h2", &two);
    engine.hears_one();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let thief = runtime.block_on(Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1")).client;
    // The engine answers each of these, to wherever it is asked to answer.
    let answered =
        ["kc.log.berlin.h1", "$JS.hub.API.STREAM.MSG.GET.kc_log", "$JS.hub.API.$KV.kc_seen.berlin.h1"];
    let status = r#"{"format":2,"state":"parked","cause":"all is well"}"#;
    let speak = move |to: &'static str| {
        let thief = thief.clone();
        async move {
            for subject in answered {
                thief.publish_with_reply(subject, to, status.into()).await.unwrap();
            }
            thief.flush().await.unwrap();
        }
    };
    runtime.block_on(speak("kc.stop.berlin.h2.office"));
    runtime.block_on(speak("kc.stop.berlin.all.office"));
    for _ in 0..2 * answered.len() {
        link.heard("no stop");
    }
    assert_eq!(two.status()["state"], "parked");
    let ends = AtomicBool::new(false);
    let run = thread::scope(|scope| {
        scope.spawn(|| {
            runtime.block_on(async {
                while !ends.load(Ordering::Relaxed) {
                    speak("kc.status.berlin.h3").await;
                    sleep(Duration::from_millis(100)).await;
                }
            });
        });
        let run = engine.desk(&["status", "--json"]);
        ends.store(true, Ordering::Relaxed);
        run
    });
    let table: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let three = table.as_array().unwrap().iter().find(|hall| hall["name"] == "berlin.h3").unwrap();
    assert_eq!((&three["silent"], &three["status"]), (&true.into(), &serde_json::Value::Null), "{table}");
    assert_eq!(engine.desk(&["stop", "berlin.h2"]).code, Some(0));
    two.comes_to("stopped");
}

#[test]
fn what_is_no_record_keeps_no_later_show_from_the_log_and_each_show_is_reported_once() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", "[]");
    let link = engine.link("h1", &hall);
    engine.hears_all();
    let told = |shows: usize| {
        engine.wait(|_| engine.desk(&["report"]).stdout.matches(" night ").count() == shows);
    };
    let play = || {
        hall.play("night");
        hall.done(&["park"]);
        hall.comes_to("parked");
    };
    play();
    told(1);
    drop(link);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let mut thief = runtime.block_on(Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1"));
    assert!(runtime.block_on(thief.may_publish("kc.log.berlin.h1")));
    play();
    let link = engine.link("h1", &hall);
    link.heard("no record of ours");
    told(2);
    let run = engine.desk(&["report"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stderr.contains("a record is none of ours"), "{run:?}");
}

#[test]
fn the_key_of_a_link_invents_no_show_and_replaces_none_and_a_hall_whose_key_nobody_knows_proves_nothing() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", "[]");
    let link = engine.link("h1", &hall);
    engine.hears_all();
    hall.play("night");
    hall.done(&["park"]);
    hall.comes_to("parked");
    engine.wait(|_| engine.desk(&["report"]).stdout.matches(" night ").count() == 1);
    let run = engine.desk(&["report"]);
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{run:?}");

    drop(link);
    let log = engine.log("h1");
    let begin = log.iter().find(|record| record["record"]["kind"] == "begin").unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let mut thief = runtime.block_on(Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1"));
    for (n, change) in (log.len() as u64 + 1..).zip(["invented", "replaced", "bare"]) {
        let mut forged = begin.clone();
        (forged["n"], forged["record"]["cue"]) = (n.into(), change.into());
        forged["line"] = n.into();
        match change {
            "bare" => drop(forged["record"].as_object_mut().unwrap().remove("seal")),
            "invented" => {
                forged["record"]["start"] =
                    begin["record"]["start"].as_str().unwrap().replace("T", "T0").into()
            }
            _ => {}
        }
        assert!(runtime.block_on(thief.may_publish_text("kc.log.berlin.h1", &forged.to_string())));
    }
    let run = engine.desk(&["report"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert_eq!(run.stdout.matches(" night ").count(), 1, "{run:?}");
    assert!(!["invented", "replaced", "bare"].iter().any(|cue| run.stdout.contains(cue)), "{run:?}");
    assert!(run.stderr.contains("altered, or put in") && run.stderr.contains("without a seal"), "{run:?}");

    let desk = engine.path("fleet/office/desk.toml");
    let text = fs::read_to_string(&desk).unwrap();
    let kept: Vec<&str> = text.lines().filter(|line| !line.starts_with("\"berlin.h1\" = [")).collect();
    fs::write(&desk, kept.join("\n")).unwrap();
    let run = engine.desk(&["report"]);
    assert!(run.code == Some(1) && run.stderr.contains("the desk knows no key of this hall"), "{run:?}");
}

#[test]
fn over_a_network_the_engine_is_known_by_its_certificate_and_nobody_speaks_to_another_or_in_the_open() {
    let Some(engine) = Engine::start_over_tls("h1") else { return };
    let hall = engine.hall("h1", "[]");
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    assert_eq!(engine.desk(&["stop"]).stdout, "berlin.h1: stopping\n");
    // An authority that signed nothing here: another engine, or somebody between.
    let other = [
        "req",
        "-x509",
        "-newkey",
        "ed25519",
        "-nodes",
        "-subj",
        "/CN=other",
        "-keyout",
        "other.key",
        "-out",
        "fleet-ca.pem",
    ];
    let office = engine.path("fleet/office");
    let made = std::process::Command::new("openssl").args(other).current_dir(&office).output().unwrap();
    assert!(made.status.success(), "{made:?}");
    let run = engine.desk(&["stop"]);
    assert_eq!(run.code, Some(69), "{run:?}");
    assert!(run.stderr.contains("certificate"), "{run:?}");
    // In the open nothing is said, not even to the right one.
    let settings = office.join("desk.toml");
    std::fs::write(&settings, std::fs::read_to_string(&settings).unwrap().replace("tls://", "nats://"))
        .unwrap();
    assert_ne!(engine.desk(&["status"]).code, Some(0));
}
