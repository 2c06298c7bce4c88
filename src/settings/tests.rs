//! What is kept comes back as it was, or not at all.

use std::fs;
use std::time::Duration;

use jiff::Zoned;
use jiff::civil::date;
use proptest::prelude::*;

use super::*;
use crate::sys::clock::Monotonic;
use crate::time::Clock as _;

fn broken() -> Out {
    let at = "2026-11-21T21:14:00Z".to_owned();
    Out { who: "the operator".to_owned(), surface: Surface::Http, at, why: Some("broken leg".to_owned()) }
}

fn set() -> Settings {
    let mut set = Settings::default();
    set.levels.motion = 0.6;
    set.levels.effects = [("air".to_owned(), true), ("water".to_owned(), false)].into();
    set.levels.rows = [("A".to_owned(), 1.0), ("B".to_owned(), 0.5)].into();
    set.trim_ms = -40;
    set.out = [("B2".to_owned(), broken())].into();
    let playlist = Some(PlaylistPlace { id: "saturday".to_owned(), entry: 1 });
    let (cue, sha256) = ("night".to_owned(), "00ff".to_owned());
    let movie = Some("ride.mkv".to_owned());
    set.show =
        Some(LoadedShow { cue, sha256, playlist, film_ms: Some(12_340), begins_ms: Some(600_000), movie });
    set
}

fn at(day: i8, hour: i8) -> Zoned {
    date(2026, 11, day).at(hour, 0, 0, 0).in_tz("UTC").unwrap()
}

/// Waits until a file is as it should be; the thread that writes it says nothing.
#[track_caller]
fn becomes(store: &SettingsFile, is_so: impl Fn(&SettingsFile) -> bool) {
    let until = Monotonic.now() + Duration::from_secs(20);
    while !is_so(store) {
        assert!(Monotonic.now() < until, "{store:?}");
        std::thread::yield_now();
    }
}

fn file(folder: &std::path::Path) -> std::path::PathBuf {
    folder.join("settings.json")
}

#[test]
fn what_is_set_is_said_with_who_when_and_why() {
    let words = |now: Zoned| seats_out(&["B2"], &broken(), &now);
    assert_eq!(words(at(22, 9)), "B2 is out since yesterday 21:14, by the operator: broken leg");
    assert_eq!(words(at(21, 23)), "B2 is out since 21:14, by the operator: broken leg");
    assert_eq!(words(at(25, 9)), "B2 is out since Saturday, by the operator: broken leg");
    assert_eq!(words(at(28, 9)), "B2 is out since 2026-11-21, by the operator: broken leg");
    // A clock that was set back.
    assert_eq!(words(at(20, 9)), "B2 is out since 2026-11-21, by the operator: broken leg");
    let silent = Out { why: None, at: "?".to_owned(), ..broken() };
    assert_eq!(seats_out(&["B1", "B2"], &silent, &at(22, 9)), "B1, B2 are out since ?, by the operator");
    let expected = "motion 60 %, row B 50 %, water off, trim -40 ms, cue night (playlist saturday, entry 2), left at 00:12.340";
    assert_eq!(set().words().as_deref(), Some(expected));
    assert_eq!(Settings::default().words(), None);
}

#[test]
fn a_reason_is_a_line_that_can_be_read() {
    assert_eq!(Out::reason("  broken leg "), Ok(Some("broken leg".to_owned())));
    assert_eq!(Out::reason(" "), Ok(None));
    assert!(Out::reason("a\u{1b}[2J").is_err() && Out::reason("a\nb").is_err());
    assert_eq!(Out::reason(&"é".repeat(LONGEST_WHY)).map(|why| why.is_some()), Ok(true));
    assert!(Out::reason(&"é".repeat(LONGEST_WHY + 1)).is_err());
}

#[test]
fn what_nobody_can_have_set_is_no_text_of_settings() {
    let text = set().text();
    assert_eq!(Settings::parse(&text), Ok(set()));
    for (was, is) in [
        ("\"version\": 1", "\"version\": 2"),
        ("\"motion\": 0.6", "\"motion\": 1.6"),
        ("\"B\": 0.5", "\"B\": -0.5"),
        ("-40", "-501"),
        ("broken leg", "broken\\u001bleg"),
        ("\"trim_ms\"", "\"trim\""),
    ] {
        assert!(text.contains(was), "{was}: {text}");
        assert!(Settings::parse(&text.replace(was, is)).is_err(), "{is}");
    }
    assert!(Settings::parse(&text[..text.len() / 2]).is_err() && Settings::parse("").is_err());
}

proptest! {
    #[test]
    fn no_text_makes_the_reader_panic(text in ".{0,200}", cut in 0_usize..400, with in any::<u8>()) {
        let _ = Settings::parse(&text);
        let mut bytes = set().text().into_bytes();
        let place = cut % bytes.len();
        bytes[place] = with;
        if let Ok(text) = String::from_utf8(bytes) {
            let _ = Settings::parse(&text);
        }
    }
}

#[test]
fn what_was_put_is_there_at_the_next_start() {
    let folder = tempfile::tempdir().unwrap();
    let (mut store, kept) = SettingsFile::open(folder.path());
    assert_eq!(kept, Kept::default());
    store.put(Settings::default());
    store.put(set());
    drop(store);
    let (_store, kept) = SettingsFile::open(folder.path());
    assert_eq!(kept, Kept { settings: Some(set()), said: Vec::new() });
    let names: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|one| one.unwrap().file_name()).collect();
    assert_eq!(names, ["settings.json"], "nothing unfinished stays");
}

#[test]
fn a_file_that_cannot_be_read_is_put_aside_with_a_word_and_what_is_set_then_is_kept() {
    let half = &set().text()[..100];
    let old = set().text().replace("\"version\": 1", "\"version\": 0");
    for bad in [half, &old, "", "\u{0}"] {
        let folder = tempfile::tempdir().unwrap();
        fs::write(file(folder.path()), bad).unwrap();
        let (mut store, kept) = SettingsFile::open(folder.path());
        assert_eq!(kept.settings, None);
        assert!(kept.said[0].contains("it is now settings.json.bad. Look which seats"), "{:?}", kept.said);
        assert_eq!(fs::read_to_string(folder.path().join("settings.json.bad")).unwrap(), bad);
        store.put(set());
        drop(store);
        assert_eq!(SettingsFile::open(folder.path()).1.settings, Some(set()));
    }
}

#[test]
fn what_stands_in_the_place_of_the_file_is_put_aside_too() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(file(folder.path())).unwrap();
    let (_, kept) = SettingsFile::open(folder.path());
    assert!(kept.said[0].contains("it is no regular file"), "{:?}", kept.said);
    assert!(!file(folder.path()).exists());
    let (_, kept) = SettingsFile::open(&folder.path().join("nowhere"));
    assert!(kept.settings.is_none() && kept.said.len() == 1, "{kept:?}");
}

#[test]
fn a_disk_that_takes_nothing_is_told_once_and_what_was_kept_stays() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(file(folder.path()), set().text()).unwrap();
    // What has to be made anew cannot be.
    let in_the_way = folder.path().join("settings.json.new");
    fs::create_dir(&in_the_way).unwrap();
    let (mut store, _) = SettingsFile::open(folder.path());
    store.put(Settings::default());
    becomes(&store, |store| store.trouble().is_some());
    for trim_ms in 1..5 {
        store.put(Settings { trim_ms, ..Settings::default() });
        std::thread::yield_now();
    }
    assert!(store.trouble().unwrap().contains("; make room in") && store.news().is_none(), "{store:?}");
    assert_eq!(fs::read_to_string(file(folder.path())).unwrap(), set().text());

    fs::remove_dir(&in_the_way).unwrap();
    store.put(Settings { trim_ms: 7, ..Settings::default() });
    becomes(&store, |store| store.trouble().is_none());
    assert_eq!([store.news(), store.news()], [Some("what people set is kept again"), None]);
    drop(store);
    assert_eq!(SettingsFile::open(folder.path()).1.settings.unwrap().trim_ms, 7);
}

#[test]
fn what_ended_the_program_while_it_was_loaded_is_not_loaded_at_each_start() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(file(folder.path()), set().text()).unwrap();
    let (store, kept) = SettingsFile::open(folder.path());
    assert!(kept.settings.unwrap().show.is_some());
    // A crash: neither of them is dropped.
    std::mem::forget(SettingsFile::loading(folder.path()));
    std::mem::forget(store);
    let (store, kept) = SettingsFile::open(folder.path());
    let settings = kept.settings.unwrap();
    assert_eq!((settings.show, settings.trim_ms), (None, -40));
    assert!(kept.said[0].contains("night is not loaded"), "{:?}", kept.said);
    // An end in order is none.
    std::mem::forget(SettingsFile::loading(folder.path()));
    drop(store);
    assert_eq!(SettingsFile::open(folder.path()).1.said, Vec::<String>::new());
}
