//! Links and engines that die, hang or come back while a show plays.

use std::time::Duration;

use async_nats::{Client, Subject};
use futures_util::StreamExt as _;
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::Clock as _;
use rustix::process::Signal;
use serde_json::{Value, json};

use crate::fleet::{ALL, Engine};
use crate::hall::swell;
use crate::rights::Member;

#[test]
fn no_frame_changes_though_link_and_engine_are_killed_stopped_and_started_again_in_mid_show() {
    let Some(mut engine) = Engine::start("h1") else { return };
    let mut hall = engine.hall("h1", ALL);
    let link = engine.link("h1", &hall);
    engine.hears_all();
    hall.write("cues/dozen.csv", &swell(30));
    hall.arm("dozen");
    hall.done(&["go"]);
    hall.comes_to("playing");
    engine.kill();
    hall.lives_on(100);
    engine.restart();
    engine.hears_all();
    link.signal(Signal::STOP);
    hall.lives_on(100);
    link.signal(Signal::CONT);
    drop(link);
    hall.lives_on(100);
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    assert_eq!(hall.status()["state"], "playing", "the show is still on");
    hall.wait(|status| status["cause"] == "the seats that take part have parked");
    hall.close();
    let shows = hall.journal("show");
    let figures = &shows[0]["outcome"];
    assert_eq!(figures["result"], "completed", "{figures}");
    for count in ["lost", "refused", "send_failed"] {
        assert_eq!(figures[count], 0, "{count}: {figures}");
    }
    assert_eq!(figures["sent"], figures["acked"], "{figures}");
    assert_eq!(hall.journal("action").len(), 4, "nobody else asked anything");
}

#[test]
fn a_desk_is_told_that_the_hall_behind_a_link_is_away_and_hears_it_again_once_it_is_back() {
    let Some(engine) = Engine::start("h1") else { return };
    let mut hall = engine.hall("h1", ALL);
    let link = engine.link("h1", &hall);
    engine.hears_all();
    hall.close();
    link.heard("the hall: ");
    engine.wait(|table| table[0]["silent"] == true && table[0]["status"]["state"] == "parked");
    let asked = Monotonic.now();
    for word in [&["pause", "all"][..], &["stop"], &["preflight", "all"], &["load", "ride", "all"]] {
        let run = engine.desk(word);
        assert_eq!(run.code, Some(75), "{run:?}");
        assert!(run.stdout.contains("look at the hall"), "{run:?}");
    }
    assert!(
        Monotonic.now().since(asked) < Duration::from_secs(60),
        "nobody is waited for as for a cue that is being proved"
    );
    // What a service left that was one of two machines: its link would wait for the other one.
    let left = ["pair.sock", "pair-journal.sock"].map(|name| hall.path(name));
    left.iter().for_each(|file| std::fs::write(file, "").unwrap());
    hall.serve();
    link.heard("the hall: well again");
    engine.hears_all();
    assert!(!left.iter().any(|file| file.exists()));
}

#[test]
fn of_two_machines_the_one_that_is_at_it_is_waited_for_though_the_other_has_no_service() {
    let Some(engine) = Engine::start("h1") else { return };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let machine =
        || runtime.block_on(Member::connect(&engine, "h1/fleet.nk", "_INBOX_hall.berlin.h1")).client;
    let (down, at_it) = (machine(), machine());
    let mut heard = [&down, &at_it].map(|machine| {
        let heard = runtime.block_on(machine.subscribe("kc.cmd.berlin.h1.office.*")).unwrap();
        runtime.block_on(machine.flush()).unwrap();
        heard
    });
    // Both hear what is asked.
    let mut hear =
        || heard.each_mut().map(|heard| runtime.block_on(heard.next()).unwrap().reply.unwrap())[0].clone();
    let say = |machine: &Client, to: &Subject, status| {
        let answer = json!({ "hall": "berlin.h1", "status": status, "reply": {} }).to_string();
        runtime.block_on(machine.publish(to.clone(), answer.into())).unwrap();
        runtime.block_on(machine.flush()).unwrap();
    };
    std::thread::scope(|scope| {
        let waiting = scope.spawn(|| engine.desk(&["preflight", "all"]));
        let to = hear();
        say(&down, &to, 502);
        say(&at_it, &to, 102);
        // What is asked later, and nobody is at, is given up before.
        let given_up = scope.spawn(|| engine.desk(&["load", "ride", "all"]));
        say(&down, &hear(), 502);
        let given_up = given_up.join().unwrap();
        assert_eq!(given_up.code, Some(75), "{given_up:?}");
        say(&at_it, &to, 200);
        let waiting = waiting.join().unwrap();
        assert_eq!(waiting.code, Some(0), "{waiting:?}");
    });
}

#[test]
fn a_hall_that_takes_its_time_says_that_it_is_at_it_and_then_what_came_of_it() {
    let Some(engine) = Engine::start("h1") else { return };
    let hall = engine.hall("h1", ALL);
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let inbox = "_INBOX_desk.office";
    let desk = runtime.block_on(Member::connect(&engine, "office/desk.nk", inbox)).client;
    let mut heard = runtime.block_on(desk.subscribe(format!("{inbox}.>"))).unwrap();
    runtime.block_on(desk.flush()).unwrap();
    hall.serving().signal(Signal::STOP);
    let run = std::thread::scope(|scope| {
        let asked = scope.spawn(|| engine.desk(&["preflight", "all"]));
        let first = runtime.block_on(heard.next()).unwrap();
        hall.serving().signal(Signal::CONT);
        assert_eq!(serde_json::from_slice::<Value>(&first.payload).unwrap()["status"], 102);
        asked.join().unwrap()
    });
    assert_eq!(run.code, Some(0), "{run:?}");
}
