//! What a desk sees of halls and asks of them.

use crate::fleet::{ALL, Engine};

#[test]
fn a_desk_sees_all_halls_worst_first_and_stops_one_or_all() {
    let Some(engine) = Engine::start("h1,h2,h3") else { return };
    let (one, two) = (engine.hall("h1", "[]"), engine.hall("h2", "[]"));
    let _links = [engine.link("h1", &one), engine.link("h2", &two)];
    let heard = |table: &serde_json::Value| {
        table.as_array().is_some_and(|halls| halls.iter().filter(|hall| hall["silent"] == false).count() == 2)
    };
    let table = engine.wait(heard);
    assert_eq!(table[0]["name"], "berlin.h3", "the one that was never heard is first: {table}");
    assert_eq!((&table[0]["silent"], &table[0]["age_s"]), (&true.into(), &serde_json::Value::Null));
    assert_eq!(engine.desk(&["status"]).code, Some(75), "one is silent");
    for hall in [&table[1], &table[2]] {
        assert_eq!(hall["status"]["state"], "parked", "{hall}");
        assert!(hall["age_s"].as_f64().unwrap() < 1.5, "{hall}");
    }
    two.play("night");
    let run = engine.desk(&["stop", "berlin.h2"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "berlin.h2: stopping\n"));
    two.comes_to("stopped");
    assert_eq!(one.status()["state"], "parked");
    let table = engine.wait(|table| table[1]["status"]["state"] == "stopped");
    assert_eq!(table[1]["name"], "berlin.h2", "{table}");
    let run = engine.desk(&["stop"]);
    assert_eq!(run.code, Some(75), "{run:?}");
    let lines: Vec<_> = run.stdout.lines().collect();
    assert_eq!(lines[..2], ["berlin.h1: stopping", "berlin.h2: stopping"]);
    assert!(lines[2].starts_with("berlin.h3: nobody hears it there"), "{lines:?}");
    one.comes_to("stopped");
}

#[test]
fn a_hall_does_what_it_allows_and_refuses_the_rest_with_what_to_do() {
    let Some(engine) = Engine::start("h1,h2") else { return };
    let (open, closed) = (engine.hall("h1", ALL), engine.hall("h2", "[]"));
    let _links = [engine.link("h1", &open), engine.link("h2", &closed)];
    engine.hears_all();
    let run = engine.desk(&["level", "50%", "all"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stdout.starts_with("berlin.h1: parked"), "{run:?}");
    assert!(run.stdout.contains("berlin.h2: refused: the fleet may not levels: allow of [fleet]"), "{run:?}");
    assert_eq!(open.status()["levels"]["motion"], 0.5);
    assert_eq!(engine.desk(&["load", "night", "berlin.h1"]).code, Some(0));
    assert_eq!(engine.desk(&["trim", "+40ms", "berlin.h1"]).code, Some(0));
    assert_eq!(open.status()["trim_ms"], 40);
    let run = engine.desk(&["park", "berlin.h1"]);
    assert_eq!(run.code, Some(1));
    assert!(run.stdout.contains("nobody has armed the seats"), "{run:?}");
    let run = engine.desk(&["preflight", "all"]);
    let lines: Vec<_> = run.stdout.lines().collect();
    assert!(lines[0].starts_with("berlin.h1: parked") && lines[0].contains("next: arm;"), "{run:?}");
    assert!(lines[1].starts_with("berlin.h2: refused: the fleet may not preflight"), "{run:?}");
    open.done(&["arm"]);
    assert_eq!(engine.desk(&["load", "ride", "all"]).code, Some(1), "what a person armed stays");
    assert_eq!(engine.desk(&["preflight", "berlin.h1"]).code, Some(1));
    open.done(&["go"]);
    open.comes_to("playing");
    assert_eq!(engine.desk(&["pause", "berlin.h1"]).code, Some(0));
    open.comes_to("paused");
    assert_eq!(engine.desk(&["park", "berlin.h1"]).code, Some(0));
    open.comes_to("parked");
    // A key that is taken out of the hall counts for nothing from the next reload on.
    open.rewrite(|config| config.split("[[fleet.key]]").next().unwrap().to_owned());
    open.done(&["reload"]);
    let run = engine.desk(&["level", "40%", "berlin.h1"]);
    assert!(run.stdout.contains("no key of [fleet] has signed this"), "{run:?}");
    assert_eq!(open.status()["levels"]["motion"], 0.5);
    let run = engine.desk(&["stop", "berlin.h1"]);
    assert_eq!(run.code, Some(0), "a stop needs no key of the hall's: {run:?}");
}

#[test]
fn a_link_whose_service_is_down_answers_for_no_hall_that_another_machine_serves() {
    let Some(engine) = Engine::start_with("h1", &["--pairs", "h1"]) else { return };
    let hall = engine.hall("h1", ALL);
    let nothing = tempfile::tempdir().unwrap();
    let down = engine.link_in("h1", nothing.path());
    down.heard("the hall: ");
    let _link = engine.link("h1", &hall);
    engine.hears_all();
    for tries in 0..20 {
        let run = engine.desk(&["level", &format!("{}%", 50 + tries), "all"]);
        assert_eq!(run.code, Some(0), "{tries}: {run:?}");
    }
    let run = engine.desk(&["load", "night", "all"]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let run = engine.desk(&["stop"]);
    assert_eq!((run.code, run.stdout.as_str()), (Some(0), "berlin.h1: stopping\n"), "{run:?}");
    hall.comes_to("stopped");
}
