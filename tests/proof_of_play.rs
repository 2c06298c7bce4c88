//! `kinocue report` as a person runs it.

use std::path::Path;

use assert_cmd::Command;
use jiff::Timestamp;
use jiff::tz::TimeZone;
use kinocue::harness::control::model::{Ending, FrameCounts, Percentiles};
use kinocue::harness::journal::{Action, FilmProof, Journal, Limits, Outcome, SeatOut, ShowRecord};
use serde_json::Value;

const LIMITS: Limits = Limits { max_size: 1 << 20, max_total: 1 << 24, max_age_days: 400 };

struct Run {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

fn report(args: &[&str]) -> Run {
    let output =
        Command::new(env!("CARGO_BIN_EXE_kinocue")).arg("report").args(args).output().expect("kinocue runs");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Run { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

fn show(start: &str, cue: &str, title: &str, end: Option<(&str, Ending)>) -> ShowRecord {
    let percentiles =
        Percentiles { p50_us: Some(3.0), p99_us: Some(9.5), max_us: Some(60.0), ..Percentiles::default() };
    // One show was stopped while its drives had motion ahead.
    let withdrawn = if cue == "ride" { 3 } else { 0 };
    ShowRecord {
        start: start.to_owned(),
        hall: "one".to_owned(),
        cue: cue.to_owned(),
        sha256: "ab".repeat(32),
        title: Some(title.to_owned()),
        playlist: None,
        level: 0.6,
        vibration: 1.0,
        trim_ms: 40,
        effects_off: vec!["water".to_owned()],
        seats_total: 4,
        seats_available: 3,
        operator: "ann".to_owned(),
        scheduled: false,
        out_of_hours: false,
        outcome: end.map(|(end, result)| Outcome {
            end: end.to_owned(),
            result,
            events: vec!["A2 was lost at 00:12.000".to_owned()],
            seats_out: Vec::new(),
            ticks: 1000,
            missed_ticks: 1,
            frames: FrameCounts {
                sent: 4000,
                asked: 4000,
                acked: 3999 - withdrawn,
                refused: 0,
                lost: 1,
                withdrawn,
            },
            send_failed: 0,
            lateness: percentiles,
            ack: percentiles,
            film: (cue == "ride").then(|| FilmProof {
                sources: vec!["ltc:alsa:hw:2,0".to_owned(), "artnet:10.0.0.20".to_owned()],
                switches: 1,
                greatest_error_ms: Some(1.254),
            }),
        }),
    }
}

/// A day with a show that was played, one that a person stopped, and one that a crash ended.
fn journal(dir: &Path) {
    let now = "2026-11-21T08:00:00Z".parse::<Timestamp>().expect("RFC 3339").to_zoned(TimeZone::UTC);
    let mut journal = Journal::open(dir, LIMITS, &now);
    let (seven, eight) = ("2026-11-21T19:00:00.000+01:00", "2026-11-21T20:00:00.000+01:00");
    journal.note(&Action {
        at: "2026-11-21T18:59:30.000+01:00".to_owned(),
        who: "ann (socket, engineer)".to_owned(),
        what: "arm".to_owned(),
        result: "done".to_owned(),
        state: "armed\u{1b}[31m".to_owned(),
        times: 1,
    });
    let ends = [
        show(seven, "storm", "=Storm, \"II\"", Some(("2026-11-21T19:10:00.000+01:00", Ending::Completed))),
        show(eight, "ride", "Ride", Some(("2026-11-21T20:00:30.000+01:00", Ending::Stopped))),
    ];
    for end in &ends {
        journal.begin(end);
        journal.show(end);
    }
    journal.begin(&show("2026-11-21T21:00:00.000+01:00", "ride", "Ride", None));
}

#[test]
fn a_day_is_a_table_with_a_line_for_all_together() {
    let dir = tempfile::tempdir().unwrap();
    journal(dir.path());
    let run = report(&["--day", "2026-11-21", "--dir", dir.path().to_str().unwrap()]);
    let unsealed = "7 lines were written without a seal: nothing proves by whom";
    assert!(
        run.code == Some(0) && run.stderr.contains(unsealed),
        "named once, not as forged: {}",
        run.stderr
    );
    for part in
        ["2026-11-21 19:00:00", "storm", "completed", "00:10:00", "60 %", "3/4", "99.97 %", "interrupted"]
    {
        assert!(run.stdout.contains(part), "{part}: {}", run.stdout);
    }
    assert!(run.stdout.contains("ride: A2 was lost at 00:12.000"), "{}", run.stdout);
    let film = "ride: followed the film by ltc:alsa:hw:2,0, artnet:10.0.0.20, at the most 1.25 ms from it, the source changed once\n";
    assert!(run.stdout.contains(film) && !run.stdout.contains("storm: followed"), "{}", run.stdout);
    let totals = "3 shows on 2026-11-21 (UTC+01:00): 1 completed, 1 stopped, 1 interrupted; 00:10:30 in all; 8000 frames sent, 7995 \
                  acked, 0 refused, 2 lost";
    assert_eq!(run.stdout.lines().last(), Some(totals));
    let run = report(&["--from", "2026-11-01", "--to", "2026-11-20", "--dir", dir.path().to_str().unwrap()]);
    assert_eq!(
        (run.code, run.stdout.as_str()),
        (Some(0), "nothing was played from 2026-11-01 to 2026-11-20\n")
    );
}

#[test]
fn what_was_asked_is_shown_without_what_a_terminal_obeys() {
    let dir = tempfile::tempdir().unwrap();
    journal(dir.path());
    let run = report(&["--day", "2026-11-21", "--actions", "--dir", dir.path().to_str().unwrap()]);
    assert!(
        run.stdout.contains("ann (socket, engineer)") && run.stdout.contains("armed?[31m"),
        "{}",
        run.stdout
    );
    assert!(!run.stdout.contains('\u{1b}'));
}

#[test]
fn a_day_of_twelve_shows_in_which_every_seat_fell_out_twice_is_a_few_lines_a_show_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let now = "2026-11-21T08:00:00Z".parse::<Timestamp>().expect("RFC 3339").to_zoned(TimeZone::UTC);
    let mut journal = Journal::open(dir.path(), LIMITS, &now);
    let seats: Vec<String> =
        "ABCDEFGH".chars().flat_map(|row| (1..=8).map(move |seat| format!("{row}{seat}"))).collect();
    for hour in 9..21 {
        let at = |minute: u32| format!("2026-11-21T{hour:02}:{minute:02}:00.000+01:00");
        let mut show = show(&at(0), "storm", "Storm", Some((at(10).as_str(), Ending::Completed)));
        (show.seats_total, show.seats_available) = (64, 64);
        let outcome = show.outcome.as_mut().unwrap();
        let clock = |minute: u32| format!("{hour:02}:{minute:02}:00");
        // As an older version wrote them, one by one.
        let one_by_one = seats.iter().map(|seat| format!("{} {seat} lost: no answer", clock(3)));
        let usual =
            ["playing: go by ann", "parking: the cue is over"].map(|text| format!("{} {text}", clock(1)));
        let odd = [format!("{} paused: by ann", clock(5)), format!("{} playing: resume by ann", clock(6))];
        outcome.events = usual.into_iter().chain(one_by_one).chain(odd).collect();
        let out = seats.iter().zip(1..).map(|(seat, s)| SeatOut {
            seat: seat.clone(),
            times: 2,
            out_s: f64::from(s),
        });
        outcome.seats_out = out.collect();
        journal.begin(&show);
        journal.show(&show);
    }
    drop(journal);
    let run = report(&["--day", "2026-11-21", "--dir", dir.path().to_str().unwrap()]);
    assert!(run.stdout.lines().count() <= 5 + 12 * 3, "{}", run.stdout);
    let row = run.stdout.lines().find(|line| line.starts_with(" 2026-11-21 09:00:00")).unwrap();
    assert!(row.contains("64/64") && row.contains("64, 00:01:04"), "{row}");
    let fallen = "2026-11-21 09:00:00 storm: out: H8 64.0 s in 2 falls, H7 63.0 s in 2 falls, ";
    assert!(run.stdout.contains(fallen) && run.stdout.contains(", and 58 more\n"), "{}", run.stdout);
    assert!(run.stdout.contains("storm: 09:05:00 paused: by ann\n"), "{}", run.stdout);
    let json = report(&["--day", "2026-11-21", "--json", "--dir", dir.path().to_str().unwrap()]);
    let json: Value = serde_json::from_str(&json.stdout).unwrap();
    assert_eq!(json["shows"][11]["outcome"]["seats_out"].as_array().unwrap().len(), 64);
}

#[test]
fn csv_reads_back_whatever_a_title_holds() {
    let dir = tempfile::tempdir().unwrap();
    journal(dir.path());
    let run = report(&["--day", "2026-11-21", "--csv", "--dir", dir.path().to_str().unwrap()]);
    assert!(run.stdout.lines().count() == 4 && run.stdout.ends_with("\r\n"), "{}", run.stdout);
    let mut reader = csv::Reader::from_reader(run.stdout.as_bytes());
    let head = reader.headers().unwrap().clone();
    let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
    let cell = |row: usize, name: &str| {
        let column = head.iter().position(|column| column == name).unwrap_or_else(|| panic!("{name}"));
        rows[row][column].to_owned()
    };
    assert_eq!(cell(0, "title"), "'=Storm, \"II\"");
    assert_eq!(
        (cell(0, "took_s"), cell(0, "acked"), cell(0, "lateness_p99_us")),
        ("600".into(), "3999".into(), "9.5".into())
    );
    assert_eq!(
        (cell(1, "result"), cell(2, "result"), cell(2, "end")),
        ("stopped".into(), "interrupted".into(), String::new())
    );
    assert_eq!([0, 1, 2].map(|row| cell(row, "withdrawn")), ["0", "3", ""]);
    let film =
        |row: usize| ["film_sources", "film_switches", "film_error_max_ms"].map(|name| cell(row, name));
    assert_eq!(film(0), ["", "", ""]);
    assert_eq!(film(1), ["ltc:alsa:hw:2,0 artnet:10.0.0.20", "1", "1.254"]);
}

#[test]
fn json_has_every_figure_and_notes_what_was_cut() {
    let dir = tempfile::tempdir().unwrap();
    journal(dir.path());
    let file = dir.path().join("kinocue-2026-11-21-000.jsonl");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, &text[..text.len() - 5]).unwrap();
    let run = report(&["--day", "2026-11-21", "--json", "--dir", dir.path().to_str().unwrap()]);
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["totals"]["shows"], 2, "the begin of the third was cut");
    assert_eq!(report["shows"][0]["outcome"]["lateness"]["p99_us"], 9.5);
    assert_eq!(report["shows"][0]["result"], "completed");
    assert_eq!(report["actions"][0]["what"], "arm");
    assert!(report["notes"][0].as_str().unwrap().ends_with("is cut short, skipped"), "{report}");
}

#[test]
fn wrong_use_and_a_missing_journal_have_their_exit_codes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().to_str().unwrap();
    let code = |args: &[&str]| report(args).code;
    assert_eq!(code(&["--dir", &format!("{path}/none")]), Some(66));
    assert_eq!(code(&["--day", "tomorrow", "--dir", path]), Some(64));
    assert_eq!(code(&["--from", "2026-11-02", "--to", "2026-11-01", "--dir", path]), Some(64));
    assert_eq!(code(&["--config", &format!("{path}/none.toml")]), Some(66));
    assert_eq!(report(&["--dir", path]).stdout.split(' ').next(), Some("nothing"));
    let config = dir.path().join("hall.toml");
    let hall =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/config/hall.toml"))
            .unwrap();
    std::fs::write(&config, format!("[log]\ndir = \"{path}/logs\"\n{hall}")).unwrap();
    std::fs::create_dir(dir.path().join("logs")).unwrap();
    journal(&dir.path().join("logs"));
    let run = report(&["--day", "2026-11-21", "--config", config.to_str().unwrap()]);
    assert!(run.stdout.contains("3 shows on 2026-11-21"), "{} {}", run.stdout, run.stderr);
}
