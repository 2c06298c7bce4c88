//! Playlists: what one may hold, and when an entry is due.

use std::fs;
use std::path::Path;

use jiff::{SignedDuration, Timestamp, Zoned};
use proptest::prelude::*;

use super::schedule::due;
use super::*;
use crate::config::ConfigFaults;
use crate::config::from_to_args;
use crate::control::Code;
use crate::library::{Bounds, Hall, Library};

/// Central Europe, without asking the machine: clocks go on at 01:00 UTC of 29 March and back at 01:00 UTC of 25 October 2026.
fn europe() -> TimeZone {
    TimeZone::posix("CET-1CEST,M3.5.0,M10.5.0/3").unwrap()
}

fn at(time: &str) -> Zoned {
    time.parse::<Timestamp>().unwrap().to_zoned(europe())
}

fn parse(text: &str) -> Result<Playlist, Vec<String>> {
    Playlist::parse(Path::new("day.toml"), text)
        .map_err(|faults| faults.to_string().lines().map(str::to_owned).collect())
}

fn list(entries: &[&str]) -> Playlist {
    let entry = |more: &&str| format!("[[entry]]\ncue = \"c\"\n{more}\n");
    parse(&format!("title = \"Day\"\n{}", entries.iter().map(entry).collect::<String>())).unwrap()
}

fn faults_of(entry: &str) -> Vec<String> {
    parse(&format!("title = \"Day\"\n[[entry]]\n{entry}\n")).unwrap_err()
}

const DAY: &str = r#"
title = "Saturday"
timezone = "UTC"

[[entry]]
cue = "seat-demo"
preset = "kids"
then = "go"

[[entry]]
cue = "storm"
level = "60%"
vibration = 0.5
trim_ms = -40
effects = { water = false }
at = "19:00"
days = ["fri", "sat"]
"#;

#[test]
fn a_playlist_reads_as_it_is_written() {
    let day = parse(DAY).unwrap();
    assert_eq!((day.title.as_str(), day.timezone), ("Saturday", Some(TimeZone::UTC)));
    let [demo, storm] = &day.entries[..] else { panic!("two entries") };
    assert_eq!((demo.cue.as_str(), demo.then, demo.preset.as_deref()), ("seat-demo", Then::Go, Some("kids")));
    assert_eq!((demo.level, &demo.at), (None, &None));
    assert_eq!((storm.level, storm.vibration, storm.trim_ms), (Some(0.6), Some(0.5), Some(-40)));
    assert_eq!((storm.effects["water"], storm.then), (false, Then::Hold));
    let at = storm.at.as_ref().unwrap();
    assert_eq!((at.time.to_string().as_str(), at.days.len()), ("19:00:00", 2));
    assert!(at.is_on(Weekday::Saturday) && !at.is_on(Weekday::Sunday));
}

#[test]
fn every_fault_is_named_with_its_line() {
    let faults = parse(
        "titel = \"x\"\n[[entry]]\ncue = \"../etc/passwd\"\nlevel = 2\nat = \"25:00\"\nthen = \"stop\"\n\
         [[entry]]\ntrim_ms = 900\ndays = [\"someday\"]\n",
    )
    .unwrap_err();
    for wanted in [
        "day.toml:1:1: the playlist has no title",
        "day.toml:1:1: titel: unknown key in the playlist; did you mean title?",
        "day.toml:3:7: cue: \"../etc/passwd\" is not an id",
        "day.toml:4:9: level: 2 is outside 0..=1",
        "day.toml:5:6: at: \"25:00\" is not a time of day",
        "day.toml:6:8: then: \"stop\" is not one of hold, go",
        "day.toml:7:1: [[entry]] has no cue",
        "day.toml:8:11: trim_ms: 900 is outside -500..=500",
        "day.toml:9:8: days: there is no time to start at",
        "day.toml:9:9: days: \"someday\" is not one of mon",
    ] {
        assert!(faults.iter().any(|fault| fault.starts_with(wanted)), "{wanted}: {faults:#?}");
    }
    assert_eq!(faults.len(), 10, "{faults:#?}");
}

#[test]
fn times_of_day_are_spelt_in_full() {
    for bad in
        ["7:00", "19", "19:00:00.5", "24:00", "19:60", "19:00:60", "23:59:60", "T19:00", "19:00Z", "noon"]
    {
        let faults = faults_of(&format!("cue = \"c\"\nat = \"{bad}\""));
        assert!(faults[0].contains("is not a time of day"), "{bad}: {faults:?}");
    }
    assert!(faults_of("cue = \"c\"\nat = 19:00:00")[0].contains("expected a string, not a date or time"));
}

#[test]
fn an_empty_list_an_unknown_zone_and_two_starts_at_once_are_refused() {
    assert!(parse("title = \"x\"\n").unwrap_err()[0].contains("has no entry"));
    assert!(parse("title = \"x\"\nentry = []\n").unwrap_err()[0].contains("0 entries"));
    let zone = parse("title = \"x\"\ntimezone = \"Mars/Olympus\"\n[[entry]]\ncue = \"c\"\n").unwrap_err();
    assert!(zone[0].contains("is not a time zone"), "{zone:?}");
    let twice =
        faults_of("cue = \"c\"\nat = \"19:00\"\n[[entry]]\ncue = \"d\"\nat = \"19:00:00\"\ndays = [\"sun\"]");
    assert!(twice[0].ends_with("starts at 19:00:00 on sun, as the one on line 2 does"), "{twice:?}");
}

#[test]
fn an_entry_sets_its_preset_and_over_that_its_own() {
    let mut config = from_to_args(&["127.0.0.1:1".to_owned()], &[], 1).unwrap();
    let effects = [("air".to_owned(), false), ("water".to_owned(), false)].into();
    config.presets =
        vec![Preset { name: "kids".to_owned(), motion: Some(0.6), vibration: Some(0.5), effects }];
    let day = list(&["preset = \"kids\"\nlevel = 0.4\neffects = { air = true }", "", "preset = \"gone\""]);
    let change = day.entries[0].levels(&config);
    assert_eq!((change.motion, change.vibration), (Some(0.4), Some(0.5)));
    assert_eq!((change.effects["air"], change.effects["water"]), (true, false));
    assert_eq!(day.entries[1].levels(&config), LevelsChange::default());
    assert_eq!(day.entries[2].levels(&config), LevelsChange::default());
}

#[test]
fn what_only_library_and_hall_can_tell_is_found_when_it_is_loaded() {
    let dir = tempfile::tempdir().unwrap();
    let hall = Hall {
        config: dir.path().join("hall.toml"),
        program: "/nonexistent".into(),
        bounds: Bounds::default(),
    };
    let library = Library::open(dir.path(), hall).unwrap();
    let config = from_to_args(&["127.0.0.1:1".to_owned()], &[], 1).unwrap();
    let day = list(&["preset = \"kids\"", "effects = { watr = false }"]);
    let unseen = list(&["preset = \"kids\u{a0}\""]).check(&library, &config);
    assert!(unseen[0].to_string().contains("[preset.kids\\u{a0}]"), "{unseen:?}");
    let faults: Vec<_> = day.check(&library, &config).iter().map(ToString::to_string).collect();
    let [preset, cue, effect] = &faults[..] else { panic!("a cue is looked at once: {faults:#?}") };
    assert!(preset.starts_with("day.toml:4:10: preset: there is no [preset.kids]"), "{preset}");
    assert!(cue.starts_with("day.toml:3:7: cue: there is no cue c; upload it"), "{cue}");
    assert!(
        effect.ends_with("watr: is not in [effects] of the configuration; did you mean water?"),
        "{effect}"
    );
}

#[test]
fn a_shelf_lists_all_playlists_and_names_the_faults_of_bad_ones() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(dir.path().join(name), text).unwrap();
    write("day.toml", DAY);
    write("bad.toml", "title = 1\n[[entry]]\ncue = \"c\"\n");
    write("notes.txt", "");
    std::os::unix::fs::symlink("/etc/passwd", dir.path().join("link.toml")).unwrap();
    let shelf = Shelf::new(dir.path());
    let [bad, day] = &shelf.all().unwrap()[..] else { panic!("two playlists") };
    assert_eq!((day.id.as_str(), day.title.as_deref()), ("day", Some("Saturday")));
    assert_eq!(day.cues, ["seat-demo", "storm"]);
    assert!(bad.faults[0].contains("bad.toml:1:9: title: expected a string"), "{bad:?}");
    assert_eq!(shelf.read(&"link".parse().unwrap()).unwrap_err().code, Code::Unknown);
    assert_eq!(shelf.read(&"bad".parse().unwrap()).unwrap_err().code, Code::Check);
    assert!(Shelf::new(&dir.path().join("none")).all().unwrap().is_empty());
    let problem = Shelf::new(&dir.path().join("notes.txt")).all().unwrap_err();
    assert!(problem.code == Code::File && problem.detail.contains("notes.txt"), "{problem}");
}

#[test]
fn of_a_playlist_with_a_fault_in_each_of_its_lines_some_hundred_are_told_and_the_rest_is_not_looked_at() {
    let many = "[[entry]]\nx=1\n".repeat(18_000);
    let broken = "= 1\n".repeat(60_000);
    let alike = "[[entry]]\ncue = \"c\"\nat = \"19:00\"\n".repeat(900);
    for (text, most) in [(many, 200), (broken, 200), (alike, 200)] {
        let Err(ConfigFaults::Bad(faults)) = Playlist::parse(Path::new("day.toml"), &text) else {
            panic!("it has faults")
        };
        assert_eq!(faults.len(), most);
        assert!(faults[most - 1].message.ends_with("; there may be more: correct these first"), "{faults:?}");
    }
}

#[test]
fn the_next_start_is_the_first_to_come() {
    let day =
        list(&["at = \"19:00\"", "at = \"21:30\"\ndays = [\"sat\"]", "", "at = \"10:00\"\ndays = [\"mon\"]"]);
    let next = |now: &str| {
        let (entry, start) = next_start(&day, &at(now)).unwrap();
        (entry, start.timestamp().to_string())
    };
    // 2026-11-21 is a Saturday; Central Europe is an hour ahead of UTC.
    assert_eq!(next("2026-11-21T17:59:59Z"), (0, "2026-11-21T18:00:00Z".to_owned()));
    assert_eq!(next("2026-11-21T18:00:00Z"), (1, "2026-11-21T20:30:00Z".to_owned()));
    assert_eq!(next("2026-11-21T20:30:00Z"), (0, "2026-11-22T18:00:00Z".to_owned()));
    assert_eq!(next("2026-11-22T18:00:00Z"), (3, "2026-11-23T09:00:00Z".to_owned()));
    assert!(next_start(&list(&[""]), &at("2026-11-21T18:00:00Z")).is_none());
    let weekly = list(&["at = \"19:00\"\ndays = [\"sat\"]"]);
    let (_, start) = next_start(&weekly, &at("2026-11-21T18:00:00Z")).unwrap();
    assert_eq!(start.timestamp().to_string(), "2026-11-28T18:00:00Z");
}

#[test]
fn a_playlist_with_a_zone_of_its_own_keeps_to_it() {
    let mut day = list(&["at = \"19:00\""]);
    day.timezone = Some(europe());
    let now = "2026-07-01T16:59:00Z".parse::<Timestamp>().unwrap().to_zoned(TimeZone::UTC);
    assert_eq!(next_start(&day, &now).unwrap().1.timestamp().to_string(), "2026-07-01T17:00:00Z");
    let later = now.checked_add(SignedDuration::from_secs(60)).unwrap();
    assert_eq!(due(&day, &now, &later), Some(0));
}

#[test]
fn what_is_long_past_is_let_go() {
    let day = list(&["at = \"19:00\""]);
    let due = |previous: &str, now: &str| due(&day, &at(previous), &at(now));
    assert_eq!(due("2026-11-21T17:59:59.9Z", "2026-11-21T18:00:00Z"), Some(0));
    assert_eq!(due("2026-11-21T18:00:00Z", "2026-11-21T18:00:00.1Z"), None);
    assert_eq!(due("2026-11-21T09:00:00Z", "2026-11-21T18:00:02Z"), Some(0), "a sleep that ended in time");
    assert_eq!(due("2026-11-21T09:00:00Z", "2026-11-21T18:00:02.1Z"), None);
    assert_eq!(due("2026-11-20T09:00:00Z", "2026-11-22T09:00:00Z"), None);
    assert_eq!(due("2026-11-21T18:00:01Z", "2026-11-21T17:59:00Z"), None, "the clock was set back");
}

#[test]
fn a_start_seen_is_not_seen_again_when_the_clock_is_set_back() {
    let day = list(&["at = \"19:00\"", "at = \"19:30\""]);
    let mut schedule = Schedule::default();
    let mut due = |now: &str| schedule.due(&day, &at(now));
    assert_eq!(due("2026-11-21T18:00:00Z"), None, "nothing is known of what was before");
    assert_eq!(due("2026-11-21T17:59:59Z"), None);
    assert_eq!(due("2026-11-21T18:00:00Z"), Some(0));
    assert_eq!(due("2026-11-21T17:30:00Z"), None);
    assert_eq!(due("2026-11-21T17:59:59.5Z"), None);
    assert_eq!(due("2026-11-21T18:00:00.5Z"), None);
    assert_eq!(due("2026-11-21T18:29:59Z"), None);
    assert_eq!(due("2026-11-21T18:30:00Z"), Some(1));
}

#[test]
fn a_clock_that_was_years_ahead_takes_no_start_away_once_it_is_right() {
    let day = list(&["at = \"19:00\""]);
    let mut schedule = Schedule::default();
    let mut due = |now: &str| schedule.due(&day, &at(now));
    assert_eq!(due("2036-11-21T17:59:59Z"), None);
    assert_eq!(due("2036-11-21T18:00:00Z"), Some(0));
    assert_eq!(due("2026-11-21T17:59:59Z"), None);
    assert_eq!(due("2026-11-21T18:00:00Z"), Some(0));
    assert_eq!(due("2026-11-21T17:59:59Z"), None);
    assert_eq!(due("2026-11-21T18:00:00Z"), None, "that one was seen");
}

#[test]
fn a_time_that_is_skipped_comes_later_and_one_that_comes_twice_counts_once() {
    let day = list(&["at = \"02:30\""]);
    let start = |now: &str| next_start(&day, &at(now)).unwrap().1.timestamp().to_string();
    assert_eq!(start("2026-03-29T00:00:00Z"), "2026-03-29T01:30:00Z", "03:30 in summer time");
    assert_eq!(start("2026-10-25T00:00:00Z"), "2026-10-25T00:30:00Z", "02:30 in summer time");
    assert_eq!(start("2026-10-25T00:30:00Z"), "2026-10-26T01:30:00Z", "and not again in winter time");
}

/// The days on which the clocks change, and one between.
fn day() -> impl Strategy<Value = Timestamp> {
    prop::sample::select(vec!["2026-03-29T00:00:00Z", "2026-10-25T00:00:00Z", "2026-06-10T00:00:00Z"])
        .prop_map(|day| day.parse().unwrap())
}

fn millis(ms: i64) -> SignedDuration {
    SignedDuration::from_millis(ms)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn every_start_is_seen_once_while_the_clock_runs_on(
        day in day(),
        minute in 0_u32..240,
        steps in prop::collection::vec(1_i64..1_900, 50),
    ) {
        let list = list(&[&format!("at = \"{:02}:{:02}\"", minute / 60, minute % 60)]);
        let (from, mut schedule, mut seen) = (day - SignedDuration::from_hours(2), Schedule::default(), Vec::new());
        // Two minutes about the start that is next, and about the hour after, where the clock may say the same.
        let next = next_start(&list, &from.to_zoned(europe())).unwrap().1.timestamp();
        for about in [next, next + SignedDuration::from_hours(1)] {
            let (mut now, mut step) = (about - SignedDuration::from_mins(1), steps.iter().cycle());
            while now < about + SignedDuration::from_mins(1) {
                if schedule.due(&list, &now.to_zoned(europe())).is_some() {
                    prop_assert!(now >= next && now.duration_since(next) < millis(1_900));
                    seen.push(now);
                }
                now += millis(*step.next().unwrap());
            }
        }
        prop_assert_eq!(seen.len(), 1);
    }

    #[test]
    fn however_the_clock_is_set_no_start_is_seen_twice_or_late(
        day in day(),
        steps in prop::collection::vec(prop_oneof![4 => 1_i64..2_500, 1 => -7_200_000_i64..7_200_000], 300),
    ) {
        let list = list(&["at = \"02:00\"", "at = \"02:01\"", "at = \"02:30\"", "at = \"03:00\""]);
        let mut now = day + SignedDuration::from_mins(45);
        let (mut schedule, mut last) = (Schedule::default(), None);
        for step in steps {
            now += millis(step);
            if let Some(entry) = schedule.due(&list, &now.to_zoned(europe())) {
                let before = (now - SignedDuration::from_millis(2_001)).to_zoned(europe());
                let (_, start) = next_start(&list, &before).unwrap();
                prop_assert!(start.timestamp() <= now, "entry {} at {}", entry, now);
                prop_assert!(last < Some(start.timestamp()), "{} again", start);
                last = Some(start.timestamp());
            }
        }
    }
}

#[test]
fn an_entry_may_have_a_note_of_one_line_for_whoever_runs_the_show() {
    let playlist = parse("title = \"x\"\n[[entry]]\ncue = \"c\"\nnote = \"doors first\"\n").unwrap();
    assert_eq!(playlist.entries[0].note.as_deref(), Some("doors first"));
    let faults = faults_of(&format!("cue = \"c\"\nnote = \"{}\"", "x".repeat(201)));
    assert!(faults.iter().any(|fault| fault.contains("201 characters are outside 1..=200")), "{faults:?}");
    let faults = faults_of("cue = \"c\"\nnote = \"two\\nlines\"");
    assert!(faults.iter().any(|fault| fault.contains("has control characters")), "{faults:?}");
}

#[test]
fn a_movie_is_a_file_below_the_folder_of_films_and_needs_somebody_to_show_it() {
    let playlist = parse("title = \"x\"\n[[entry]]\ncue = \"c\"\nmovie = \"reel/feature.mkv\"\n").unwrap();
    assert_eq!(playlist.entries[0].film.movie.as_deref(), Some("reel/feature.mkv"));
    for (entry, says) in [
        ("movie = \"../feature.mkv\"", "is not a file in the folder of films"),
        ("movie = \"/srv/feature.mkv\"", "is not a file in the folder of films"),
        ("movie = \"a.mkv\"\nfilm = \"01:00:00:00\"", "omit one of them"),
    ] {
        let faults = faults_of(&format!("cue = \"c\"\n{entry}"));
        assert!(faults.iter().any(|fault| fault.contains(says)), "{entry}: {faults:?}");
    }
}
