//! What is written is read back, whatever became of the files in between.

use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::PathBuf;

use jiff::tz::TimeZone;
use jiff::{SignedDuration, Timestamp};
use proptest::prelude::*;

use super::report::ShowResult;
use super::*;
use crate::control::model::{Ending, FrameCounts, Percentiles};

pub(super) const LIMITS: Limits = Limits { max_size: 1 << 20, max_total: 1 << 24, max_age_days: 400 };

pub(super) fn zoned(time: &str) -> Zoned {
    time.parse::<Timestamp>().unwrap().to_zoned(TimeZone::UTC)
}

fn day(text: &str) -> Date {
    text.parse().unwrap()
}

pub(super) fn action(at: &str, what: &str) -> Action {
    let [at, what] = [at, what].map(str::to_owned);
    Action {
        at,
        who: "root (socket, engineer)".to_owned(),
        what,
        result: "done".to_owned(),
        state: "armed".to_owned(),
        times: 1,
    }
}

fn record(start: &str) -> ShowRecord {
    ShowRecord {
        start: start.to_owned(),
        hall: "one".to_owned(),
        cue: "storm".to_owned(),
        sha256: "00".repeat(32),
        title: Some("Storm".to_owned()),
        playlist: Some(PlaylistPlace { id: "day".to_owned(), entry: 1 }),
        level: 0.6,
        vibration: 0.5,
        trim_ms: -40,
        effects_off: vec!["water".to_owned()],
        seats_total: 4,
        seats_available: 3,
        operator: "ann".to_owned(),
        scheduled: false,
        out_of_hours: true,
        outcome: None,
    }
}

fn outcome(end: &str, result: Ending) -> Outcome {
    Outcome {
        end: end.to_owned(),
        result,
        events: vec!["A2 lost".to_owned()],
        seats_out: Vec::new(),
        ticks: 1000,
        missed_ticks: 1,
        frames: FrameCounts { sent: 4000, asked: 4000, acked: 3990, refused: 1, lost: 9, withdrawn: 0 },
        send_failed: 0,
        lateness: Percentiles { p50_us: Some(3.0), p99_us: Some(9.5), p999_us: None, max_us: Some(60.0) },
        ack: Percentiles::default(),
        film: Some(FilmProof {
            sources: vec!["artnet:10.0.0.20".to_owned()],
            switches: 0,
            greatest_error_ms: Some(1.25),
        }),
    }
}

pub(super) fn ended(start: &str, end: &str, result: Ending) -> ShowRecord {
    ShowRecord { outcome: Some(outcome(end, result)), ..record(start) }
}

fn files(dir: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// How many starts of the program can be read.
fn starts(file: &Path) -> usize {
    let text = fs::read_to_string(file).unwrap();
    let lines = text.lines().filter_map(|line| serde_json::from_str::<Line>(line).ok());
    lines.filter(|line| matches!(line, Line::Start { .. })).count()
}

fn of_day(dir: &Path, text: &str) -> JournalReport {
    report(dir, day(text), day(text), ReportBounds::ALL).unwrap()
}

const START: &str = "2026-11-21T19:00:03.250+01:00";
const END: &str = "2026-11-21T19:05:03.250+01:00";

#[test]
fn a_show_is_reported_as_it_was_recorded() {
    let dir = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z"));
    journal.note(&action("2026-11-21T18:59:00.000+01:00", "arm"));
    journal.begin(&record(START));
    let show = ended(START, END, Ending::Completed);
    journal.show(&show);
    drop(journal);
    let report = of_day(dir.path(), "2026-11-21");
    let [shown] = &report.shows[..] else { panic!("one show: {report:?}") };
    assert_eq!((shown.result, shown.took_s), (ShowResult::Completed, Some(300.0)));
    assert_eq!(shown.record, show);
    assert_eq!(report.actions, [action("2026-11-21T18:59:00.000+01:00", "arm")]);
    assert_eq!((report.totals.shows, report.totals.completed, report.totals.frames.lost), (1, 1, 9));
    assert!(report.notes.is_empty(), "{:?}", report.notes);
    assert!(of_day(dir.path(), "2026-11-20").shows.is_empty());
}

#[test]
fn of_two_machines_the_start_of_one_ends_what_the_other_one_played_in_whatever_order_they_told_it() {
    let began = |start: &str| Line::Begin(Box::new(record(start)));
    let start = |at: &str| Line::Start { at: at.to_owned(), version: "1".to_owned() };
    let later = "2026-11-21T19:30:00.000+01:00";
    // The first one died in its show, and could tell it only once it was back.
    let first = [start("2026-11-21T08:00:00.000Z"), began(START)];
    let second = [start("2026-11-21T18:02:00.000Z"), began(later)];
    let told = |journal: &[Line]| journal.iter().map(|line| serde_json::to_value(line).unwrap()).collect();
    for journals in [[&first, &second], [&second, &first]] {
        let date = day("2026-11-21");
        let report = report_of(journals.map(|journal| told(journal)), ChainFindings::default(), date, date);
        let shows: Vec<_> =
            report.shows.iter().map(|show| (show.record.start.as_str(), show.result)).collect();
        assert_eq!(shows, [(START, ShowResult::Interrupted), (later, ShowResult::Running)]);
    }
}

#[test]
fn a_show_that_goes_on_is_running_and_one_without_an_end_was_interrupted() {
    let dir = tempfile::tempdir().unwrap();
    let result = |dir: &Path| {
        let report = of_day(dir, "2026-11-21");
        report.shows.iter().map(|show| show.result).collect::<Vec<_>>()
    };
    let mut journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z"));
    journal.begin(&record(START));
    let (to, thread) = (journal.to.take(), journal.thread.take().unwrap());
    drop(to);
    thread.join().unwrap();
    // The thread is gone and with it the claim on the folder, as after a crash.
    assert_eq!(result(dir.path()), [ShowResult::Interrupted]);
    let folder = crate::sys::folder::Folder::open(dir.path()).unwrap();
    assert!(folder.claim());
    assert_eq!(result(dir.path()), [ShowResult::Running]);
    drop(folder);
    drop(Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T18:30:00Z")));
    let folder = crate::sys::folder::Folder::open(dir.path()).unwrap();
    assert!(folder.claim());
    assert_eq!(
        result(dir.path()),
        [ShowResult::Interrupted],
        "a program that started later does not play it"
    );
    drop(folder);
    let mut journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T19:00:00Z"));
    journal.begin(&record("2026-11-21T20:00:00.000+01:00"));
    journal.show(&ended("2026-11-21T20:00:00.000+01:00", "2026-11-21T20:00:09.000+01:00", Ending::Stopped));
    drop(journal);
    assert_eq!(result(dir.path()), [ShowResult::Interrupted, ShowResult::Stopped]);
}

#[test]
fn a_show_over_midnight_belongs_to_the_day_it_began() {
    let dir = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z"));
    let start = "2026-11-21T23:50:00.000+01:00";
    journal.begin(&record(start));
    journal.show(&ended(start, "2026-11-22T00:10:00.000+01:00", Ending::Fault));
    drop(journal);
    assert_eq!(files(dir.path()).len(), 2, "each day has its own file");
    assert_eq!(of_day(dir.path(), "2026-11-21").shows[0].result, ShowResult::Fault);
    assert!(of_day(dir.path(), "2026-11-22").shows.is_empty());
}

#[test]
fn a_line_that_a_crash_cut_is_passed_over_and_the_next_is_whole() {
    let dir = tempfile::tempdir().unwrap();
    let write = |what: &str| {
        let mut journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z"));
        journal.note(&action("2026-11-21T09:00:00.000+00:00", what));
    };
    write("arm");
    let file = files(dir.path()).remove(1);
    let length = fs::metadata(&file).unwrap().len();
    OpenOptions::new().write(true).open(&file).unwrap().set_len(length - 7).unwrap();
    write("go");
    let report = of_day(dir.path(), "2026-11-21");
    let asked: Vec<_> = report.actions.iter().map(|action| action.what.as_str()).collect();
    assert_eq!(asked, ["go"]);
    let [note] = &report.notes[..] else { panic!("one note: {:?}", report.notes) };
    assert!(note.starts_with("kinocue-asked-2026-11-21-000.jsonl:1: "), "{note}");
}

#[test]
fn a_cut_line_at_the_end_is_named_as_cut() {
    let dir = tempfile::tempdir().unwrap();
    drop(Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z")));
    let mut file = OpenOptions::new().append(true).open(&files(dir.path())[0]).unwrap();
    file.write_all(b"{\"kind\":\"act").unwrap();
    assert!(of_day(dir.path(), "2026-11-21").notes[0].ends_with("is cut short, skipped"));
}

#[test]
fn files_end_at_their_size_and_the_oldest_go() {
    let dir = tempfile::tempdir().unwrap();
    let limits = Limits { max_size: 1_000, max_total: 4_000, max_age_days: 2 };
    let mut journal = Journal::open(dir.path(), limits, &zoned("2026-11-18T08:00:00Z"));
    fs::write(dir.path().join("notes.txt"), "not ours").unwrap();
    for of in ["2026-11-18", "2026-11-19", "2026-11-21"] {
        for serial in 0..40 {
            journal.note(&action(&format!("{of}T09:00:00.000+00:00"), &format!("trim {serial}")));
        }
    }
    drop(journal);
    let sizes: Vec<_> = files(dir.path()).iter().map(|file| fs::metadata(file).unwrap().len()).collect();
    assert!(sizes.iter().all(|size| *size <= 1_000) && sizes.iter().sum::<u64>() <= 4_100, "{sizes:?}");
    assert!(dir.path().join("notes.txt").exists());
    let report = report(dir.path(), day("2026-11-18"), day("2026-11-21"), ReportBounds::ALL).unwrap();
    assert_eq!(report.actions.last().unwrap().what, "trim 39");
    assert!(report.actions.iter().all(|action| action.at.starts_with("2026-11-21")), "the oldest are gone");
}

#[test]
fn files_go_by_age() {
    let dir = tempfile::tempdir().unwrap();
    for today in ["2026-11-18", "2026-11-19", "2026-11-21"] {
        let limits = Limits { max_age_days: 2, ..LIMITS };
        drop(Journal::open_by(dir.path(), limits, &zoned(&format!("{today}T08:00:00Z")), None, || true));
    }
    let names: Vec<_> = files(dir.path()).iter().map(|file| file.file_name().unwrap().to_owned()).collect();
    assert_eq!(names, ["kinocue-2026-11-19-000.jsonl", "kinocue-2026-11-21-000.jsonl"]);
}

#[test]
fn nothing_goes_by_age_while_the_clock_may_be_wrong_or_has_leapt_and_what_goes_is_said_with_its_reason() {
    let dir = tempfile::tempdir().unwrap();
    let limits = Limits { max_age_days: 10, ..LIMITS };
    let open = |of: Date, is_synchronised: fn() -> bool| {
        let now = of.to_zoned(TimeZone::UTC).unwrap();
        let mut journal = Journal::open_by(dir.path(), limits, &now, None, is_synchronised);
        journal.note(&action(&format!("{of}T09:00:00.000+00:00"), "pause"));
        let standing = Arc::clone(&journal.standing);
        drop(journal);
        std::mem::take(&mut *standing.news.lock().unwrap())
    };
    let of = |days: i32| day("2026-11-01").checked_add(jiff::Span::new().days(days)).unwrap();
    let files_of_shows =
        || files(dir.path()).iter().filter(|file| !file.to_string_lossy().contains("asked")).count();
    (0..20).for_each(|days| assert_eq!(open(of(days), || false), [""; 0], "nobody holds the clock"));
    assert_eq!(files_of_shows(), 20);
    for ahead in ["2035-01-01", "2061-07-01"] {
        assert_eq!(open(day(ahead), || true), [""; 0], "{ahead}: two years after the newest file");
    }
    assert_eq!(files_of_shows(), 22);
    let words = |name: &str| format!("the journal's file {name} was deleted: older than max_age_days");
    let mut gone = open(of(20), || true);
    gone.sort();
    let names = ["2026-11-01", "2026-11-02"];
    let names = ["-", "-asked-"].map(|kind| names.map(|day| format!("kinocue{kind}{day}-000.jsonl")));
    let mut expected: Vec<String> = names.iter().flatten().map(|name| words(name)).collect();
    expected.sort();
    assert_eq!(gone, expected, "of each kind no more on a day");
    assert_eq!(open(of(20), || true), [""; 0], "though it is started again");
}

#[test]
fn a_disk_that_takes_nothing_is_told_once_and_counted_and_nothing_stops() {
    let dir = tempfile::tempdir().unwrap();
    let blocked = dir.path().join("journal");
    fs::write(&blocked, "a file where the folder belongs").unwrap();
    let mut journal = Journal::open(&blocked, LIMITS, &zoned("2026-11-21T08:00:00Z"));
    for _ in 0..10 {
        journal.note(&action("2026-11-21T09:00:00.000+00:00", "pause"));
    }
    let standing = Arc::clone(&journal.standing);
    let mut news = Vec::new();
    while journal.lost() < 11 {
        std::thread::yield_now();
    }
    news.extend(journal.news());
    assert_eq!(news.len(), 1, "{news:?}");
    assert!(journal.trouble().unwrap().contains("cannot be written"));
    fs::remove_file(&blocked).unwrap();
    journal.note(&action("2026-11-21T09:00:01.000+00:00", "resume"));
    drop(journal);
    assert_eq!(*lock(&standing.trouble), None);
    assert!(lock(&standing.news)[0].contains("written again; 11 lines were lost"));
    let report = of_day(&blocked, "2026-11-21");
    assert_eq!(report.actions.len(), 1);
    assert!(report.notes[0].contains("11 lines had been lost"), "{:?}", report.notes);
}

#[test]
fn a_full_disk_cuts_no_later_line() {
    // /dev/full is no regular file, so a link to it is refused as any other link is.
    let dir = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink("/dev/full", dir.path().join("kinocue-2026-11-21-000.jsonl")).unwrap();
    let journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z"));
    while journal.trouble().is_none() {
        std::thread::yield_now();
    }
    assert!(of_day(dir.path(), "2026-11-21").notes.is_empty(), "and nobody reads over it");
}

#[test]
fn what_is_asked_washes_no_show_out_and_a_disk_is_shared() {
    let dir = tempfile::tempdir().unwrap();
    let limits = Limits { max_size: 10_000, max_total: 100_000, max_age_days: 400 };
    let mut journal = Journal::open(dir.path(), limits, &zoned("2026-11-21T08:00:00Z"));
    for minute in 0..7 {
        let (start, end) =
            [":03.000+01:00", ":33.000+01:00"].map(|at| format!("2026-11-21T19:0{minute}{at}")).into();
        journal.begin(&record(&start));
        journal.show(&ended(&start, &end, Ending::Completed));
    }
    for _ in 0..600 {
        journal.note(&action("2026-11-21T20:00:00.000+01:00", &"x".repeat(300)));
    }
    drop(journal);
    let report = of_day(dir.path(), "2026-11-21");
    assert_eq!((report.totals.shows, report.totals.completed), (7, 7));
    let size: u64 = files(dir.path()).iter().map(|file| fs::metadata(file).unwrap().len()).sum();
    assert!(report.actions.len() > 50 && size < limits.max_total, "{} {size}", report.actions.len());
}

#[test]
fn of_a_great_day_the_newest_is_taken_and_the_rest_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z"));
    for minute in 0..5 {
        let start = format!("2026-11-21T19:0{minute}:03.000+01:00");
        journal.begin(&record(&start));
        journal.show(&ended(&start, &start, Ending::Completed));
        journal.note(&action(&start, &format!("trim {minute}")));
    }
    drop(journal);
    let day = day("2026-11-21");
    let report = report(dir.path(), day, day, ReportBounds { shows: 2, actions: 3 }).unwrap();
    assert_eq!((report.shows.len(), report.actions.len()), (2, 3));
    assert_eq!((report.actions[0].what.as_str(), &report.shows[1].record.start[14..16]), ("trim 2", "04"));
    assert!(
        report.notes[0].starts_with("3 earlier shows") && report.notes[1].starts_with("2 earlier commands")
    );
}

#[test]
fn a_long_ask_is_shortened() {
    let long = action(START, &"ä".repeat(65_000)).shortened();
    assert_eq!(
        (long.what.chars().count(), long.what.ends_with('…'), long.result.as_str()),
        (300, true, "done")
    );
    assert_eq!(action(START, "arm").shortened(), action(START, "arm"));
}

#[test]
fn a_long_tale_is_shortened() {
    let mut show = ended(START, END, Ending::Completed);
    show.outcome.as_mut().unwrap().events = vec!["x".repeat(10_000); 1_000];
    let events = show.shortened().outcome.unwrap().events;
    assert_eq!((events.len(), events[0].len(), events[100].as_str()), (101, 502, "and 900 more"));
}

#[test]
fn no_journal_is_told_from_an_empty_one() {
    let dir = tempfile::tempdir().unwrap();
    assert!(of_day(dir.path(), "2026-11-21").shows.is_empty());
    let missing = report(&dir.path().join("none"), day("2026-11-21"), day("2026-11-21"), ReportBounds::ALL)
        .unwrap_err();
    assert_eq!(missing.source.kind(), std::io::ErrorKind::NotFound);
}

#[test]
fn a_time_is_stamped_with_its_zone() {
    let zone = TimeZone::posix("CET-1CEST,M3.5.0,M10.5.0/3").unwrap();
    let at = zoned("2026-11-21T18:00:03.250Z").with_time_zone(zone);
    assert_eq!(stamp(&at), START);
    assert_eq!(day_of(&stamp(&(at + SignedDuration::from_hours(5)))), Some(day("2026-11-22")));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Whatever is cut off at a crash, all lines before the cut and all after it are read back.
    #[test]
    fn only_what_was_cut_is_lost(before in 1_usize..6, after in 1_usize..4, cut in 0_u64..900) {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, count: usize| {
            let mut journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z"));
            for serial in 0..count {
                journal.note(&action("2026-11-21T09:00:00.000+00:00", &format!("{name} {serial}")));
            }
        };
        write("before", before);
        let file = files(dir.path()).remove(1);
        let text = fs::read_to_string(&file).unwrap();
        let left = text.len().saturating_sub(usize::try_from(cut).unwrap());
        fs::write(&file, &text[..left]).unwrap();
        write("after", after);
        let report = of_day(dir.path(), "2026-11-21");
        // A line whose end alone was cut is whole.
        let whole = text[..left].lines().filter(|line| line.ends_with('}') && line.contains("before")).count();
        let asked: Vec<_> = report.actions.iter().map(|action| action.what.clone()).collect();
        let wanted = (0..whole).map(|serial| format!("before {serial}"));
        let wanted: Vec<_> = wanted.chain((0..after).map(|serial| format!("after {serial}"))).collect();
        prop_assert_eq!(asked, wanted);
        prop_assert!(report.notes.len() <= 1, "{:?}", report.notes);
        prop_assert_eq!(starts(&files(dir.path())[0]), 2);
    }

    /// Whatever a file holds, a report is made of what can be read.
    #[test]
    fn no_file_is_too_damaged_for_a_report(bytes in prop::collection::vec(any::<u8>(), 0..2_000)) {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("kinocue-2026-11-21-000.jsonl"), &bytes).unwrap();
        let mut journal = Journal::open(dir.path(), LIMITS, &zoned("2026-11-21T08:00:00Z"));
        journal.note(&action("2026-11-21T09:00:00.000+00:00", "go"));
        drop(journal);
        let report = of_day(dir.path(), "2026-11-21");
        prop_assert_eq!(report.actions.len(), 1);
        prop_assert!(report.notes.len() <= 21);
    }
}

/// What 0.1 wrote: its states have the words of then.
const OF_0_1: [&str; 3] = [
    r#"{"kind":"start","at":"2026-11-20T08:00:00.000+01:00","version":"0.1.0"}"#,
    concat!(
        r#"{"kind":"show","start":"2026-11-20T19:00:03.250+01:00","hall":"one","cue":"storm","sha256":"00","title":null,"#,
        r#""playlist":null,"level":0.6,"vibration":0.5,"trim_ms":-40,"effects_off":[],"seats_total":4,"seats_available":3,"#,
        r#""operator":"ann","scheduled":false,"out_of_hours":false,"outcome":{"end":"2026-11-20T19:05:03.250+01:00","#,
        r#""result":"completed","events":["A2 lost"],"ticks":1000,"missed_ticks":1,"sent":4000,"asked":4000,"acked":3990,"#,
        r#""refused":1,"lost":9,"send_failed":0,"lateness":{"p50_us":3.0,"p99_us":9.5,"max_us":60.0},"#,
        r#""ack":{"p50_us":null,"p99_us":null,"max_us":null}}}"#,
    ),
    concat!(
        r#"{"kind":"action","at":"2026-11-20T19:01:00.000+01:00","who":"root (socket, engineer)","what":"pause","#,
        r#""result":"done","state":"freewheeling"}"#,
    ),
];

#[test]
fn a_journal_of_0_1_is_still_read() {
    let dir = tempfile::tempdir().unwrap();
    let [start, show, action] = OF_0_1;
    fs::write(dir.path().join("kinocue-2026-11-20-000.jsonl"), format!("{start}\n{show}\n")).unwrap();
    fs::write(dir.path().join("kinocue-asked-2026-11-20-000.jsonl"), format!("{action}\n")).unwrap();
    let report = of_day(dir.path(), "2026-11-20");
    assert_eq!(report.notes, [""; 0]);
    let [shown] = &report.shows[..] else { panic!("one show: {report:?}") };
    assert_eq!((shown.result, shown.took_s), (ShowResult::Completed, Some(300.0)));
    assert_eq!(shown.record.outcome.as_ref().unwrap().frames.acked, 3990);
    let [paused] = &report.actions[..] else { panic!("one action: {report:?}") };
    assert_eq!((paused.what.as_str(), paused.state.as_str()), ("pause", "freewheeling"));
}
