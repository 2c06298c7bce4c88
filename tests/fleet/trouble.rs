//! Links and engines that die, hang or come back while a show plays.

use std::time::{Duration, Instant};

use rustix::process::Signal;

use crate::fleet::{ALL, Engine};
use crate::hall::swell;

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
    let asked = Instant::now();
    for word in [&["pause", "all"][..], &["stop"], &["preflight", "all"], &["load", "ride", "all"]] {
        let run = engine.desk(word);
        assert_eq!(run.code, Some(75), "{run:?}");
        assert!(run.stdout.contains("look at the hall"), "{run:?}");
    }
    assert!(
        asked.elapsed() < Duration::from_secs(60),
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
