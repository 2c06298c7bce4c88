//! What dies, stands still or is cut off, and who leads then.

use std::io::Write as _;
use std::time::Duration;

use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, MonoTime};
use rustix::process::Signal;

use crate::house::{House, pair_troubles};
use crate::process::Row;

/// Numbers of the second machine are so far above those of the first, at the least.
const ABOVE: u32 = 100_000;
/// The greatest speed of the bench seat, pulses in a millisecond, with its roundings.
const FASTEST: f64 = 240.0 * 2.0 * 1.01;

/// How many takeovers of each kind there are; a night has more.
fn trials(usual: usize) -> usize {
    std::env::var("KINOCUE_TAKEOVERS").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

fn tell(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Of the frames that came to a seat: none of the first machine came once one of the second had, and none leads faster than the seat may
/// from where it was.
fn judge(rows: &[Row], takes_over: bool) {
    let is_second = |row: &Row| row.frame >= ABOVE;
    let from = rows.iter().position(is_second);
    assert_eq!(from.is_some(), takes_over);
    if let Some(from) = from {
        let back = rows[from..].iter().find(|row| !is_second(row));
        assert!(back.is_none(), "a frame of the first machine after the second led: {back:?}");
    }
    for pair in rows.windows(2) {
        let [before, row] = pair else { continue };
        let far =
            pair[0].commanded.iter().zip(&row.commanded).map(|(from, to)| f64::from(to.abs_diff(*from)));
        let ms = if row.frame == before.frame + 1 { row.time_ms } else { row.time_ms.max(80) };
        let far = far.fold(0.0, f64::max);
        assert!(far <= f64::from(ms) * FASTEST + 2.0, "it leaps: {pair:?}");
    }
}

/// Lets so much time pass, which is what a test is about.
fn passes(length: Duration) {
    Monotonic.sleep_until(Monotonic.now() + length);
}

/// Waits until the second machine leads and knows where its seats are; gives when it did.
fn second_leads(house: &House) -> MonoTime {
    let at = house.shows[1].leads("B", "recovering");
    let status = house.shows[1].wait(|status| {
        status["state"] == "recovering"
            && status["next"] == "resume, or park"
            && status["show"]["cue"] == "night"
    });
    let notes = status["warnings"].to_string();
    assert!(notes.contains("took over from A: its seats were moving"), "{notes}");
    assert_eq!(status["levels"]["motion"], 0.6, "{status}");
    at
}

/// A person has the seats parked by the second machine; then all ends, and the frames are judged.
fn parks_and_ends(mut house: House) {
    let _ = house.shows[1].run(&["park"]); // they may be on their way
    house.shows[1].comes_to("parked");
    house.shows[1].kill();
    house.ends().iter().for_each(|rows| judge(rows, true));
}

#[test]
fn a_machine_that_is_killed_is_replaced_and_its_seats_rest_until_a_person_parks_them() {
    let mut took = Vec::new();
    for _ in 0..trials(1) {
        let Some(mut house) = House::playing() else { return };
        let killed = Monotonic.now();
        house.shows[0].kill();
        let leads = second_leads(&house).since(killed);
        let knows = Monotonic.now().since(killed);
        assert!(leads < Duration::from_secs(5), "{leads:?}");
        took.push((leads, knows));
        parks_and_ends(house);
    }
    took.sort_unstable();
    tell(&format!(
        "killed: leads and knows its seats after {:?} (p50), {:?} (worst)",
        took[took.len() / 2],
        took.last()
    ));
}

#[test]
fn a_show_whose_machine_died_goes_on_at_the_other_one_where_its_film_is_by_then_once_a_person_resumes_it() {
    for _ in 0..trials(1) {
        let Some(mut house) = House::playing() else { return };
        let place = |status: &serde_json::Value| status["show"]["position_s"].as_f64().unwrap();
        let at_first = place(&house.shows[0].wait(|_| true));
        let asked = Monotonic.now();
        house.shows[0].kill();
        second_leads(&house);
        house.shows[1].done(&["resume"]);
        let goes_on = house.shows[1].comes_to("playing");
        let (film, passed) = (place(&goes_on) - at_first, Monotonic.now().since(asked).as_secs_f64());
        // Its own clock goes on from where the machine was heard last; the status is told ten times a second.
        assert!((film - passed).abs() < 0.5, "{film} s of film in {passed} s");
        parks_and_ends(house);
    }
}

#[test]
fn a_seek_in_the_moment_before_is_gone_on_with_and_a_test_of_the_seats_is_not() {
    let Some(mut house) = House::playing() else { return };
    house.shows[0].done(&["seek", "1:00"]);
    passes(Duration::from_millis(300)); // fifteen beats
    house.shows[0].kill();
    second_leads(&house);
    house.shows[1].done(&["resume"]);
    let at = house.shows[1].comes_to("playing")["show"]["position_s"].as_f64().unwrap();
    assert!(at > 61.0, "{at}");
    parks_and_ends(house);

    let Some(mut house) = House::playing() else { return };
    house.shows[0].done(&["park"]);
    house.shows[0].comes_to("parked");
    house.shows[0].done(&["arm"]);
    let sweep = house.shows[0].begin(&["test", "sweep", "--seats-empty"]);
    house.shows[0].wait(|status| status["moving"] == true && status["job"] == "test");
    house.shows[0].kill();
    drop(sweep);
    house.shows[1].leads("B", "recovering");
    house.shows[1].wait(|status| status["show"]["cue"] == "night" && status["next"] == "park, or home");
    assert_eq!(house.shows[1].run(&["resume"]).code, Some(75));
    house.shows[1].kill();
    house.ends().iter().for_each(|rows| judge(rows, false));
}

#[test]
fn what_a_machine_heard_before_it_stood_still_is_no_news_once_it_goes_on() {
    let Some(mut house) = House::playing() else { return };
    house.shows[1].serving().signal(Signal::STOP);
    passes(Duration::from_secs(1));
    house.shows[0].kill();
    passes(Duration::from_secs(4));
    house.shows[1].serving().signal(Signal::CONT);
    house.shows[1].leads("B", "recovering");
    let note = note(&house);
    let ms = note.split(" ms before").next().and_then(|text| text.rsplit(' ').next()?.parse::<u64>().ok());
    assert!(ms.is_some_and(|ms| ms > 4_500), "{note}");
    assert_eq!(house.shows[1].run(&["resume"]).code, Some(75), "A may have been stopped since");
    parks_and_ends(house);
}

/// What the second machine says of how it took over.
fn note(house: &House) -> String {
    let status = house.shows[1].wait(|status| status["warnings"].to_string().contains("took over from A"));
    let warnings = status["warnings"].as_array().unwrap();
    let notes = warnings.iter().map(|one| one["text"].as_str().unwrap_or_default());
    notes
        .filter(|text| text.contains("took over from A") || text.contains("is not loaded"))
        .collect::<Vec<_>>()
        .join("; ")
}

#[test]
fn what_a_person_set_just_before_and_the_place_of_a_paused_show_are_those_of_the_machine_that_died() {
    let Some(mut house) = House::playing() else { return };
    house.shows[0].done(&["pause"]);
    let paused = house.shows[0].comes_to("paused");
    let place = paused["show"]["position_s"].as_f64().unwrap();
    house.shows[0].done(&["effects", "off", "water"]);
    house.shows[0].done(&["trim", "40ms"]);
    house.shows[0].done(&["level", "35%"]);
    house.shows[0].kill();
    house.shows[1].leads("B", "recovering");
    let status = house.shows[1].wait(|status| status["show"]["resume_s"].is_f64());
    assert_eq!((&status["levels"]["motion"], &status["trim_ms"]), (&0.35.into(), &40.into()), "{status}");
    assert_eq!(status["levels"]["effects"]["water"], false, "{status}");
    let resumes = status["show"]["resume_s"].as_f64().unwrap();
    assert!((resumes - place).abs() < 0.05, "{resumes} for {place}");
    let note = note(&house);
    let says = "are as A told them last, ";
    assert!(note.contains(says) && note.contains(" ms before this machine led"), "{note}");
    parks_and_ends(house);
}

#[test]
fn another_file_under_the_name_of_the_cue_is_not_gone_on_with() {
    let Some(mut house) = House::playing() else { return };
    let cue = house.shows[1].path("state/cues/night.csv");
    let text = std::fs::read_to_string(&cue).unwrap();
    std::fs::write(&cue, text.replace("title: Swing", "title: Other")).unwrap();
    house.shows[0].kill();
    house.shows[1].leads("B", "recovering");
    house.shows[1]
        .wait(|status| status["warnings"].to_string().contains("night is not loaded: the file here"));
    let note = note(&house);
    assert!(note.contains("is another than the one that was played before, at 00:"), "{note}");
    let status = house.shows[1].wait(|_| true);
    assert!(status["show"].is_null(), "{status}");
    parks_and_ends(house);
}

#[test]
fn a_machine_with_another_configuration_does_not_lead_not_even_after_a_restart_unless_a_person_says_so() {
    let Some(mut house) = House::playing() else { return };
    house.shows[1].kill();
    let config = house.shows[1].path("hall.toml");
    let text = std::fs::read_to_string(&config).unwrap();
    std::fs::write(&config, text.clone() + "# another one\n").unwrap();
    house.start(1);
    let heard = |house: &House, says: &str| {
        house.shows[1].serving().heard(|line| line.contains(says).then_some(()));
    };
    heard(&house, "A has another configuration; B takes nothing over");
    house.shows[0]
        .wait(|status| pair_troubles(status).iter().any(|one| one.contains("B has another configuration")));
    house.shows[0].kill();
    heard(&house, "whoever led last had another configuration than B has now");
    // Started again it knows of no other machine, and of the key alone.
    house.shows[1].kill();
    house.start(1);
    heard(&house, "whoever led last had another configuration than B has now");
    house.shows[1].kill();
    std::fs::write(&config, text).unwrap();
    house.start(1);
    house.shows[1].leads("B", "recovering");
    // And where another one is meant, a person says so.
    house.shows[1].kill();
    let other = std::fs::read_to_string(&config).unwrap() + "# another one\n";
    std::fs::write(&config, other).unwrap();
    house.start(1);
    heard(&house, "whoever led last had another configuration than B has now");
    std::fs::write(house.shows[1].path("state/alone"), "").unwrap();
    house.shows[1].leads("B", "recovering");
    house.ends();
}

#[test]
fn a_machine_that_stands_still_for_long_ends_without_a_frame_once_it_wakes_up() {
    for trial in 0..trials(1) {
        let Some(mut house) = House::playing() else { return };
        house.shows[0].serving().signal(Signal::STOP);
        second_leads(&house);
        // It wakes up while the other one looks on, or while that moves the seats.
        if trial % 2 == 0 {
            house.shows[1].done(&["park"]);
        }
        house.shows[0].serving().signal(Signal::CONT);
        let (code, lines) = house.shows[0].ended();
        assert_eq!(code, Some(75), "{lines:?}");
        assert!(lines.iter().any(|line| line.contains("leads the hall no more")), "{lines:?}");
        // Started again, it stands by.
        house.start(0);
        house.shows[0].serving().heard(|line| line.contains("A stands by").then_some(()));
        parks_and_ends(house);
    }
}

#[test]
fn a_machine_that_loses_both_the_other_one_and_the_engine_brakes_and_the_other_one_takes_over() {
    for trial in 0..trials(1) {
        let Some(mut house) = House::playing() else { return };
        if trial % 2 == 0 {
            house.cut_engine(0, true);
            house.cut_pair(true);
        } else {
            house.cut_pair(true);
            house.cut_engine(0, true);
        }
        let (code, lines) = house.shows[0].ended();
        assert_eq!(code, Some(75), "{lines:?}");
        assert!(
            lines.iter().any(|line| line.contains("neither the other show machine nor the engine")),
            "{lines:?}"
        );
        let _ = std::fs::remove_file(house.shows[0].path("lead"));
        second_leads(&house);
        parks_and_ends(house);
    }
}

#[test]
fn a_desk_sees_stops_and_reports_the_hall_whichever_machine_leads_it() {
    let Some(mut house) = House::playing() else { return };
    house.seen(|hall| hall["status"]["state"] == "playing");
    let stops = |house: &House| {
        let run = house.desk(&["stop"]);
        assert_eq!(run.code, Some(0), "the machine that stands by says nothing: {run:?}");
    };
    stops(&house);
    house.shows[0].comes_to("stopped");
    for words in [&["clear"][..], &["park"]] {
        house.shows[0].wait(|status| status["state"] == "stopped" || status["next"] == "park, or home");
        house.shows[0].done(words);
    }
    house.shows[0].comes_to("parked");
    house.played(|totals| totals["shows"] == 1 && totals["running"] == 0);
    house.cut_engine(0, true);
    for words in [&["arm"][..], &["go"]] {
        house.shows[0].done(words);
    }
    house.shows[0].comes_to("playing");
    house.shows[0].kill();
    second_leads(&house);
    house.seen(|hall| hall["status"]["state"] == "recovering");
    house.shows[1].done(&["resume"]);
    house.shows[1].comes_to("playing");
    stops(&house);
    house.shows[1].comes_to("stopped");
    house.played(|totals| totals["shows"] == 2);
    // What the first could not tell before it died it tells once it is back, though it stands by. Each journal is a chain of its own, of which
    // nothing is missing.
    house.cut_engine(0, false);
    house.start(0);
    let totals = house.played(|totals| totals["shows"] == 3 && totals["running"] == 0);
    assert_eq!((&totals["interrupted"], &totals["stopped"]), (&1.into(), &2.into()), "{totals:#}");
    let run = house.desk(&["report"]);
    assert_eq!(run.code, Some(0), "a record is missing: {run:?}");
    house.shows[1].done(&["clear"]);
    house.shows[1].wait(|status| status["next"] == "park, or home");
    parks_and_ends(house);
}

#[test]
fn with_either_of_them_away_the_show_goes_on_and_what_is_away_is_told() {
    let Some(mut house) = House::playing() else { return };
    let goes_on = |house: &House, says: &str| {
        let told = |status: &serde_json::Value| pair_troubles(status).iter().any(|text| text.contains(says));
        let first = house.shows[0].wait(told);
        let until = first["ticks"].as_u64().unwrap() + 300;
        let later = house.shows[0].wait(|status| status["ticks"].as_u64().unwrap() >= until);
        assert_eq!(later["state"], "playing", "{later}");
    };
    let is_well = |house: &House| drop(house.shows[0].wait(|status| pair_troubles(status).is_empty()));
    house.cut_pair(true);
    goes_on(&house, "B is not heard");
    house.cut_pair(false);
    is_well(&house);
    house.kill_engine();
    goes_on(&house, "the engine does not answer");
    house.start_engine();
    is_well(&house);
    house.shows[1].kill();
    goes_on(&house, "B is not heard");
    house.start(1);
    is_well(&house);
    house.shows[0].done(&["park"]);
    house.shows[0].comes_to("parked");
    house.ends().iter().for_each(|rows| judge(rows, false));
}

#[test]
fn one_machine_alone_leads_only_on_a_persons_word_where_the_engine_knows_of_no_lead() {
    let Some(mut house) = House::open() else { return };
    house.start(1);
    house.shows[1].serving().heard(|line| line.contains("B stands by, and sends nothing").then_some(()));
    std::fs::write(house.shows[1].path("state/alone"), "").unwrap();
    house.shows[1].leads("B", "parked");
    house.ends().iter().for_each(|rows| assert!(rows.is_empty()));
}

#[test]
fn where_somebody_else_still_sends_to_a_seat_the_second_machine_moves_nothing_and_ends() {
    let Some(mut house) = House::playing() else { return };
    let stranger = house.stranger();
    house.shows[0].kill();
    let (code, lines) = house.shows[1].ended();
    assert_eq!(code, Some(79), "{lines:?}");
    assert!(lines.iter().any(|line| line.contains("another master sends to A1")), "{lines:?}");
    drop(stranger);
    house.ends().iter().for_each(|rows| judge(rows, false));
}
