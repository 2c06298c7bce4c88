//! Several halls that start at one instant, judged by the frames that their seats get.

use std::env;
use std::fmt::Write as _;
use std::fs;
use std::net::UdpSocket;
use std::thread;
use std::time::Duration;

use kinocue::harness::sys::clock::{Monotonic, wall_now_ns};
use kinocue::harness::time::{Clock as _, MonoTime};
use kinocue::wire::MotionRequest;
use nkeys::KeyPair;
use serde_json::{Value, json};

use crate::fleet::{Engine, Link};
use crate::forged::key;
use crate::hall::Hall;
use crate::http::{Request, To};

/// The halls of the group.
const HALLS: [&str; 3] = ["h1", "h2", "h3"];
/// The speed of the ride between its ends, strokes a second, and when that begins and ends.
const SPEED: f64 = 0.2;
const EVEN_S: (f64, f64) = (0.8, 1.8);
/// The halls tick so far apart, ms.
const TICK_MS: f64 = 10.0;
/// What is in a stroke of the bench seat.
const PULSES: f64 = 300_000.0;

/// Rises evenly for a second, so that from each place then the time of the film is known; with ends that keep the limits.
fn ramp() -> String {
    let height = |t: f64| {
        let ease = |u: f64| 0.6 * (u - (std::f64::consts::PI * u).sin() / std::f64::consts::PI) / 2.0;
        let (from, to) = EVEN_S;
        SPEED
            * match t {
                t if t < 0.2 => 0.0,
                t if t < from => ease((t - 0.2) / 0.6),
                t if t < to => 0.3 + t - from,
                t if t < to + 0.6 => 0.3 + 1.0 + 0.3 - ease(1.0 - (t - to) / 0.6),
                _ => 1.6,
            }
    };
    let mut cue = String::from("# kinocue-csv: 1\n# title: Ramp\ntime_ms,a1,a2,a3\n");
    for ms in (0..=2_600).step_by(20) {
        let height = height(f64::from(ms) / 1e3);
        writeln!(cue, "{ms},{height:.7},{height:.7},{height:.7}").unwrap();
    }
    cue
}

/// When the film was at its beginning, ns of the machine's clock, as a frame shows it that is at its end there; none where the ride is not
/// even. What the frame came too late is in it.
fn film_zero_ns((at, frame): &(MonoTime, MotionRequest)) -> Option<f64> {
    let place = f64::from(frame.positions[0].0) / PULSES;
    let film_s = EVEN_S.0 + place / SPEED - 0.3;
    let ends_s = f64::from(frame.time_ms) / 1e3;
    let is_even = film_s > EVEN_S.0 + 0.1 && film_s < EVEN_S.1 - 0.1;
    is_even.then_some(float(at.as_nanos().into()) + (ends_s - film_s) * 1e9)
}

#[expect(clippy::cast_precision_loss, reason = "to a microsecond for a hundred days")]
fn float(ns: i128) -> f64 {
    ns as f64
}

/// When the film of a hall was at its beginning by the frames of its first seat: those that came soonest tell it best.
fn zero_of(hall: &Hall) -> f64 {
    let frames = hall.relay(0).seen();
    let zeros: Vec<f64> = frames.iter().filter_map(film_zero_ns).collect();
    assert!(zeros.len() > 50, "{} of {} frames", zeros.len(), frames.len());
    zeros.into_iter().fold(f64::INFINITY, f64::min)
}

/// Ticks that a hall has slept through.
fn missed_of(hall: &Hall) -> u32 {
    u32::try_from(hall.status()["missed_ticks"].as_u64().unwrap()).unwrap()
}

/// A time server on loopback, whose clock is so much ahead of ours; its address.
fn time_server(ahead: Duration) -> String {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap().to_string();
    thread::spawn(move || {
        let mut question = [0; 48];
        while let Ok((48, from)) = socket.recv_from(&mut question) {
            let now = u128::from(wall_now_ns()) + ahead.as_nanos();
            let (seconds, ns) = (now / 1_000_000_000 + 2_208_988_800, now % 1_000_000_000);
            let stamp = u64::try_from((seconds << 32) + (ns << 32) / 1_000_000_000).unwrap().to_be_bytes();
            let mut answer = [0; 48];
            (answer[0], answer[1]) = (0x24, 2);
            answer[24..32].copy_from_slice(&question[40..48]);
            answer[32..40].copy_from_slice(&stamp);
            answer[40..48].copy_from_slice(&stamp);
            socket.send_to(&answer, from).unwrap();
        }
    });
    address
}

/// An engine, and a desk that knows the group.
fn engine() -> Option<Engine> {
    let engine = Engine::start("h1,h2,h3")?;
    let desk = engine.path("fleet/office/desk.toml");
    let groups = "[groups]\ntrio = [\"berlin.h1\", \"berlin.h2\", \"berlin.h3\"]\n";
    fs::write(&desk, fs::read_to_string(&desk).unwrap() + groups).unwrap();
    Some(engine)
}

/// A hall that the fleet may start, with the ride.
fn hall(engine: &Engine, name: &str) -> Hall {
    let table = fs::read_to_string(engine.path(&format!("fleet/{name}/kinocue-fleet.toml"))).unwrap();
    let table = table.replace("allow = []", "allow = []\nstart = true");
    let hall = Hall::open_with(|config| config + &table);
    hall.write("cues/ramp.csv", &ramp());
    hall
}

/// Its link, which asks that time server.
fn link(engine: &Engine, name: &str, hall: &Hall, server: &str) -> Link {
    let file = engine.path(&format!("fleet/{name}/fleet.toml"));
    let settings = fs::read_to_string(&file).unwrap() + &format!("time_server = \"{server}\"\n");
    fs::write(&file, settings).unwrap();
    engine.link(name, hall)
}

/// A person in the hall arms it for the group.
fn arm(hall: &Hall) {
    hall.done(&["load", "ramp"]);
    hall.done(&["preflight"]);
    hall.done(&["arm", "--fleet", "trio"]);
}

/// Waits until the hall has been told how far its clock is off.
fn knows_its_clock(hall: &Hall) {
    hall.wait(|status| status["fleet"]["clock"]["bound_us"].is_f64());
}

#[test]
fn three_halls_start_at_one_instant_and_no_seat_can_tell_which_was_first() {
    let Some(engine) = engine() else { return };
    let halls = HALLS.map(|name| hall(&engine, name));
    let server = time_server(Duration::ZERO);
    let _links: Vec<_> =
        HALLS.iter().zip(&halls).map(|(name, hall)| link(&engine, name, hall, &server)).collect();
    halls.iter().for_each(knows_its_clock);
    engine.hears_all();
    // Processes of the tests live for a minute, in which five starts have room.
    let rounds = env::var("KINOCUE_STARTS").map_or(2, |count| count.parse().unwrap());
    let (mut skews, mut offs) = (Vec::new(), Vec::new());
    for round in 0..rounds {
        halls.iter().for_each(arm);
        halls.iter().for_each(|hall| drop(hall.relay(0).seen()));
        let before = halls.each_ref().map(missed_of);
        let run = engine.desk(&["start", "--group", "trio", "--at", "+4s", "--json"]);
        assert_eq!(run.code, Some(0), "{run:?}");
        let told = run.report();
        halls.iter().for_each(|hall| drop(hall.comes_to("parked")));
        let zeros = halls.each_ref().map(zero_of);
        let most = zeros.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let least = zeros.into_iter().fold(f64::INFINITY, f64::min);
        // The instant by the machine's clock, read now: nobody sets the clock of this machine meanwhile.
        let (wall_ns, now) = (i128::from(wall_now_ns()), i128::from(Monotonic.now().as_nanos()));
        let instant_ns = float(i128::from(told["at_ms"].as_i64().unwrap()) * 1_000_000 - wall_ns + now);
        let (skew_ms, within_ms) = ((most - least) / 1e6, told["within_ms"].as_f64().unwrap());
        skews.push(skew_ms);
        offs.extend(zeros.map(|zero| (zero - instant_ns) / 1e6));
        // Ticks that a hall sleeps through in its show put its film behind, and are taken back slowly.
        let missed = halls.iter().zip(before).map(|(hall, before)| missed_of(hall) - before).max().unwrap();
        println!("round {round}: skew {skew_ms:.3} ms, told within {within_ms:.3} ms, {missed} ticks missed");
        for hall in told["halls"].as_array().unwrap() {
            assert_eq!(hall["done"], true, "{hall}");
            assert!(hall["bound_ms"].as_f64().unwrap() <= 2.0, "{hall}");
        }
        let most_ms = 2.0 + within_ms + TICK_MS * f64::from(missed);
        assert!(skew_ms <= most_ms, "skew of film zero {skew_ms:.3} ms, at most {most_ms:.3} ms");
        for hall in &halls {
            let status = hall.status();
            assert_eq!(status["fleet"]["start"]["phase"], "started");
            assert_eq!(status["fleet"]["armed_for"], Value::Null, "once");
        }
    }
    for (name, list) in [("skew of film zero", &mut skews), ("film zero less the instant", &mut offs)] {
        list.sort_by(f64::total_cmp);
        let middle = list[list.len() / 2];
        println!(
            "{name}, ms: least {:.3}, middle {middle:.3}, most {:.3} of {}",
            list[0],
            list[list.len() - 1],
            list.len()
        );
    }
    let mut halls = halls;
    halls[0].close();
    let shows = halls[0].journal("show");
    assert!(shows.last().unwrap().to_string().contains("office (fleet, operate)"), "{shows:?}");
}

#[test]
fn where_one_hall_cannot_take_part_none_starts_and_the_others_do_where_the_desk_wants_that() {
    let Some(engine) = engine() else { return };
    let halls = HALLS.map(|name| hall(&engine, name));
    let (server, other) = (time_server(Duration::ZERO), time_server(Duration::from_millis(5)));
    let mut links: Vec<_> = HALLS
        .iter()
        .zip(&halls)
        .map(|(name, hall)| link(&engine, name, hall, if *name == "h3" { &other } else { &server }))
        .collect();
    halls.iter().for_each(knows_its_clock);
    engine.hears_all();
    // Nobody has armed the third; then its clock is off; then nobody hears it.
    halls[..2].iter().for_each(arm);
    let start =
        |more: &[&str]| engine.desk(&[&["start", "--group", "trio", "--at", "+4s"][..], more].concat());
    let run = start(&[]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(
        run.stdout.contains("berlin.h3: refused: parked, and nobody there has armed it for trio"),
        "{run:?}"
    );
    assert!(run.stdout.contains("berlin.h1: not asked: too few halls are ready"), "{run:?}");
    arm(&halls[2]);
    let run = start(&[]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stdout.contains("berlin.h3: refused: its clock may be 5."), "{run:?}");
    assert!(run.stdout.contains("more than the 2 ms of its start_bound_ms"), "{run:?}");
    // The hall itself refuses it as well, whatever a desk looked at.
    let digest = halls[2].status()["show"]["sha256"].as_str().unwrap().to_owned();
    let order = json!({ "ticket": "t1", "group": "trio", "sha256": digest, "at_ms": now_ms() + 5_000 });
    let (status, reply) = letter(&engine, &halls[2], "berlin.h3", "start", &order);
    assert_eq!(status, 409, "{reply}");
    assert!(reply["detail"].as_str().unwrap().starts_with("the clock may be 5."), "{reply}");
    drop(links.pop());
    let run = start(&[]);
    assert_eq!(run.code, Some(75), "{run:?}");
    assert!(run.stdout.contains("berlin.h3: nobody hears it there"), "{run:?}");
    for hall in &halls {
        assert_eq!((hall.status()["state"].as_str(), hall.relay(0).count()), (Some("armed"), 0));
    }
    let run = start(&["--quorum", "2"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    for hall in ["berlin.h1: started ramp, its clock within ", "berlin.h2: started ramp, its clock within "] {
        assert!(run.stdout.contains(hall), "{run:?}");
    }
    assert!(run.stdout.contains("the films began within "), "{run:?}");
    assert_eq!((halls[2].status()["state"].as_str(), halls[2].relay(0).count()), (Some("armed"), 0));
}

fn now_ms() -> i64 {
    i64::try_from(wall_now_ns() / 1_000_000).unwrap()
}

/// Has a hall take a letter of the desk, at its own socket.
fn letter(engine: &Engine, hall: &Hall, to: &str, word: &str, args: &Value) -> (u16, Value) {
    let id = KeyPair::new_user().public_key();
    let body = json!({ "id": id, "to": to, "word": word, "args": args, "sent_ms": now_ms() });
    let letter = crate::forged::letter(&key(engine, "office/letters.nk"), &body).to_string();
    let socket = To::Unix(hall.path("fleet.sock"));
    let reply = Request::new("POST", "/api/v1/fleet/order").json(letter).send(&socket);
    (reply.status, reply.value())
}

#[test]
fn what_the_desk_does_not_commit_and_what_a_person_disarms_does_not_start() {
    let Some(engine) = engine() else { return };
    let hall = hall(&engine, "h1");
    let _link = link(&engine, "h1", &hall, &time_server(Duration::ZERO));
    knows_its_clock(&hall);
    let order = |ticket: &str| {
        let digest = hall.status()["show"]["sha256"].as_str().unwrap().to_owned();
        json!({ "ticket": ticket, "group": "trio", "sha256": digest, "at_ms": now_ms() + 3_000 })
    };
    let ask = |word: &str, args: &Value| letter(&engine, &hall, "berlin.h1", word, args);
    arm(&hall);
    let (status, ready) = ask("ready", &json!({}));
    assert_eq!((status, &ready["fleet"]["armed_for"]["group"]), (200, &"trio".into()), "{ready}");
    assert!(ready["show"]["join_s"].is_f64(), "{ready}");
    assert_eq!(ask("start", &order("t1")).0, 200);
    let is_over = |status: &Value| status["fleet"]["start"]["phase"] == "called-off";
    let status = hall.wait(is_over);
    assert_eq!(
        (&status["state"], &status["fleet"]["start"]["why"]),
        (&"armed".into(), &"desk not heard".into())
    );
    hall.wait(|status| status["warnings"].to_string().contains("was called off: desk not heard"));
    // Committed, and then somebody in the hall wants it not to be.
    assert_eq!(ask("start", &order("t2")).0, 200);
    assert_eq!(ask("commit", &json!({ "ticket": "t2" })).0, 200);
    hall.done(&["disarm"]);
    let status = hall.wait(|status| is_over(status) && status["fleet"]["start"]["ticket"] == "t2");
    assert_eq!((&status["state"], &status["fleet"]["armed_for"]), (&"parked".into(), &Value::Null));
    hall.lives_on(350);
    assert_eq!((hall.status()["state"].as_str(), hall.relay(0).count()), (Some("parked"), 0));
    let (status, reply) = ask("start", &order("t3"));
    assert_eq!(status, 403, "{reply}");
    assert!(reply["detail"].as_str().unwrap().contains("nobody has armed it"), "{reply}");
}
