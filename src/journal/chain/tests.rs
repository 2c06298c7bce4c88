use std::fs;
use std::path::{Path, PathBuf};

use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};
use nkeys::KeyPair;
use tempfile::TempDir;

use super::*;
use crate::control::model::Ending;
use crate::journal::report::{JournalReport, ReportBounds};
use crate::journal::seal::{KEY, Sealer};
use crate::journal::tests::{LIMITS, ended, zoned};
use crate::journal::{Journal, JournalPart, Limits, check_told, report_by, tail};

const FIRST: &str = "kinocue-2026-11-21-000.jsonl";
const SECOND: &str = "kinocue-2026-11-22-000.jsonl";

/// The folders of a service that seals.
struct Kept(TempDir);

impl Kept {
    fn new() -> Self {
        let kept = Self(TempDir::new().unwrap());
        fs::create_dir(kept.state()).unwrap();
        kept
    }

    fn state(&self) -> PathBuf {
        self.0.path().join("state")
    }

    fn log(&self) -> PathBuf {
        self.0.path().join("log")
    }

    fn key(&self) -> String {
        Sealer::of(&self.state()).unwrap().public_key()
    }

    /// The service starts, plays shows on a day, from this hour on, and ends.
    fn plays(&self, day: &str, hour: u32, shows: u32, limits: Limits) {
        let sealer = Sealer::of(&self.state()).ok();
        let mut journal =
            Journal::open_with(&self.log(), limits, &zoned(&format!("{day}T{hour:02}:00:00Z")), sealer);
        for show in 0..shows {
            let at = |second: u32| format!("{day}T{hour:02}:{show:02}:{second:02}.000+00:00");
            let show = ended(&at(1), &at(30), Ending::Completed);
            journal.begin(&show);
            journal.show(&show);
        }
    }

    /// Two days with a restart in the middle of each, ten lines a day.
    fn two_days() -> Self {
        let kept = Self::new();
        for day in ["2026-11-21", "2026-11-22"] {
            kept.plays(day, 9, 2, LIMITS);
            kept.plays(day, 19, 2, LIMITS);
        }
        kept
    }

    fn lines(&self, file: &str) -> Vec<String> {
        let text = fs::read_to_string(self.log().join(file)).unwrap();
        text.lines().map(str::to_owned).collect()
    }

    fn put(&self, file: &str, lines: &[String]) {
        fs::write(self.log().join(file), lines.join("\n") + "\n").unwrap();
    }

    /// Changes the lines of the first day.
    fn change(&self, change: impl FnOnce(&mut Vec<String>)) {
        let mut lines = self.lines(FIRST);
        change(&mut lines);
        self.put(FIRST, &lines);
    }

    fn report(&self) -> JournalReport {
        report_of(&self.log(), JournalKeys::default())
    }
}

fn report_of(log: &Path, keys: JournalKeys) -> JournalReport {
    let days = ("2026-11-20".parse().unwrap(), "2026-11-23".parse().unwrap());
    report_by(log, days, ReportBounds::ALL, keys).unwrap()
}

/// What is wrong with two days of which the first was changed so, and how many shows count.
fn after(change: impl FnOnce(&mut Vec<String>)) -> (Vec<String>, usize) {
    let kept = Kept::two_days();
    kept.change(change);
    let report = kept.report();
    (report.faults, report.shows.len())
}

#[test]
fn what_was_written_over_starts_days_and_full_files_is_whole_and_names_its_one_key() {
    let kept = Kept::two_days();
    let report = kept.report();
    assert_eq!((report.faults, report.unsealed, report.shows.len()), (vec![], 0, 8));
    assert_eq!((report.keys, report.notes), (vec![kept.key()], vec![]));

    let kept = Kept::new();
    kept.plays("2026-11-21", 9, 9, Limits { max_size: 4_000, ..LIMITS });
    let files = fs::read_dir(kept.log()).unwrap().count();
    let report = kept.report();
    assert!(files > 3 && report.faults.is_empty() && report.shows.len() == 9, "{files} {:?}", report.faults);
    // Of one day, the first file of which follows one that is not read.
    let kept = Kept::new();
    for day in 10..=20 {
        kept.plays(&format!("2026-11-{day}"), 9, 1, LIMITS);
    }
    let day = "2026-11-18".parse().unwrap();
    let report = report_by(&kept.log(), (day, day), ReportBounds::ALL, JournalKeys::default()).unwrap();
    assert_eq!((report.faults, report.shows.len()), (vec![], 1));
}

#[test]
fn a_line_that_was_taken_out_is_missed_wherever_it_stood() {
    for gone in 0..10 {
        let (faults, _) = after(|lines| drop(lines.remove(gone)));
        if gone == 0 {
            // What is older may have been deleted by age.
            assert_eq!(faults, [""; 0]);
            continue;
        }
        let [fault] = &faults[..] else { panic!("{gone}: {faults:?}") };
        assert!(fault.starts_with(&format!("line {} is missing, between ", gone + 1)), "{fault}");
    }
    let (faults, shows) = after(|lines| drop(lines.drain(3..7)));
    assert!(faults.len() == 1 && faults[0].starts_with("4 lines, 4 to 7, are missing"), "{faults:?}");
    assert!(shows < 8);
}

#[test]
fn a_line_that_was_put_in_does_not_count() {
    let invented = r#"{"kind":"begin","start":"2026-11-21T23:00:00.000+00:00","hall":"one","cue":"storm","sha256":"","title":null,"playlist":null,"level":1.0,"vibration":1.0,"trim_ms":0,"effects_off":[],"seats_total":4,"seats_available":4,"operator":"eve","scheduled":false,"out_of_hours":false,"outcome":null}"#;
    let (faults, shows) = after(|lines| lines.insert(4, invented.to_owned()));
    assert!(
        shows == 8 && faults.len() == 1 && faults[0].contains(":5: without a seal: put in"),
        "{faults:?}"
    );
    // Of a service with a key of its own.
    let other = Kept::two_days();
    let (faults, shows) = after(|lines| lines.extend(other.lines(FIRST)));
    assert!(shows == 8 && faults.len() == 1, "{faults:?}");
    assert!(
        faults[0].contains(&format!("10 lines from {FIRST}:11 on: sealed by {}", other.key())),
        "{faults:?}"
    );
    // One of its own once more, and one of its own under another number.
    let (faults, shows) = after(|lines| lines.push(lines[4].clone()));
    assert!(
        shows == 8 && faults.len() == 1 && faults[0].contains(":11: a second line 5, beside"),
        "{faults:?}"
    );
    let (faults, shows) = after(|lines| lines.push(lines[4].replace("\"n\":5", "\"n\":11")));
    assert!(shows == 8 && faults[0].contains(":11: altered, or put in"), "{faults:?}");
}

#[test]
fn a_line_that_was_altered_does_not_count_and_is_missed() {
    let (faults, shows) = after(|lines| lines[2] = lines[2].replace("\"acked\":3990", "\"acked\":4000"));
    assert_eq!(shows, 8, "its begin counts");
    assert!(
        faults[0].contains(":3: altered, or put in") && faults[1].starts_with("line 3 is missing"),
        "{faults:?}"
    );
    for octet in ["seal", "prev", "sig", "key"] {
        let (faults, _) =
            after(|lines| lines[2] = lines[2].replace(&format!("\"{octet}\":"), &format!("\"{octet}x\":")));
        assert!(!faults.is_empty(), "{octet}");
    }
}

#[test]
fn lines_in_another_order_and_files_in_each_others_place_are_named() {
    let (faults, _) = after(|lines| lines.swap(2, 5));
    assert!(faults.iter().any(|fault| fault.contains("stands behind line 6")), "{faults:?}");
    let kept = Kept::two_days();
    let [first, second] = [FIRST, SECOND].map(|file| kept.lines(file));
    kept.put(FIRST, &second);
    kept.put(SECOND, &first);
    let faults = kept.report().faults;
    assert!(faults.iter().all(|fault| fault.contains("a line of another day stands here")), "{faults:?}");
    assert_eq!(faults.len(), 20);
    // Two of one day.
    let kept = Kept::new();
    kept.plays("2026-11-21", 9, 9, Limits { max_size: 4_000, ..LIMITS });
    let other = "kinocue-2026-11-21-001.jsonl";
    let [first, second] = [FIRST, other].map(|file| kept.lines(file));
    kept.put(FIRST, &second);
    kept.put(other, &first);
    let faults = kept.report().faults;
    assert!(
        !faults.is_empty() && faults.iter().all(|fault| fault.contains("stands behind line")),
        "{faults:?}"
    );
}

#[test]
fn a_file_that_was_lost_is_a_gap_and_so_is_one_at_the_end_once_something_is_written_behind_it() {
    let kept = Kept::two_days();
    kept.plays("2026-11-23", 9, 1, LIMITS);
    fs::remove_file(kept.log().join(SECOND)).unwrap();
    let faults = kept.report().faults;
    assert!(faults.len() == 1 && faults[0].starts_with("10 lines, 11 to 20, are missing"), "{faults:?}");

    // All of the journal: its disk was lost. It goes on where it was, which is what is said of the rest.
    let kept = Kept::two_days();
    fs::remove_file(kept.log().join(SECOND)).unwrap();
    kept.plays("2026-11-23", 9, 1, LIMITS);
    let faults = kept.report().faults;
    assert!(faults.len() == 1 && faults[0].starts_with("10 lines, 11 to 20, are missing"), "{faults:?}");
}

#[test]
fn a_line_that_a_power_cut_tore_is_a_note_and_one_that_it_took_is_one_missing_line() {
    for cut in [1, 40, 400] {
        let kept = Kept::two_days();
        let path = kept.log().join(SECOND);
        let text = fs::read(&path).unwrap();
        fs::write(&path, &text[..text.len() - cut]).unwrap();
        // Nothing tells how far it was but the journal.
        fs::remove_file(kept.state().join("journal.tips")).unwrap();
        kept.plays("2026-11-22", 21, 1, LIMITS);
        let report = kept.report();
        // A line without its end is a whole one otherwise.
        assert_eq!((report.faults, report.notes.len()), (vec![], usize::from(cut > 1)), "{cut}");
    }
    let kept = Kept::two_days();
    let mut lines = kept.lines(SECOND);
    lines.pop();
    kept.put(SECOND, &lines);
    kept.plays("2026-11-22", 21, 1, LIMITS);
    let faults = kept.report().faults;
    assert!(faults.len() == 1 && faults[0].starts_with("line 20 is missing"), "{faults:?}");
}

#[test]
fn a_new_key_counts_where_the_old_one_has_signed_it_and_is_named_where_it_has_not() {
    let kept = Kept::two_days();
    let old = kept.key();
    fs::rename(kept.state().join(KEY), kept.state().join("journal.old.nk")).unwrap();
    kept.plays("2026-11-23", 9, 1, LIMITS);
    let report = kept.report();
    assert_eq!((report.faults, report.shows.len()), (vec![], 9));
    assert!(report.keys.len() == 2 && report.keys.contains(&old) && report.keys.contains(&kept.key()));
    assert!(!kept.state().join("journal.old.nk").exists(), "it signs nothing more");
    kept.plays("2026-11-23", 12, 1, LIMITS);
    assert_eq!(kept.report().faults, [""; 0]);
    assert_eq!(report_of(&kept.log(), JournalKeys::only([old.clone()])).faults, [""; 0]);

    let kept = Kept::two_days();
    fs::remove_file(kept.state().join(KEY)).unwrap();
    kept.plays("2026-11-23", 9, 1, LIMITS);
    let report = kept.report();
    assert_eq!(report.shows.len(), 8);
    let [fault] = &report.faults[..] else { panic!("{:?}", report.faults) };
    assert!(
        fault.contains(&format!("4 lines from kinocue-2026-11-23-000.jsonl:1 on: sealed by {}", kept.key())),
        "{fault}"
    );
    let both = JournalKeys::any_of([kept.key(), report.keys[0].clone()]);
    assert_eq!(
        (report_of(&kept.log(), both).faults, report_of(&kept.log(), JournalKeys::default()).faults.len()),
        (vec![], 1)
    );
}

#[test]
fn a_journal_from_before_there_were_seals_is_named_once_and_nothing_without_one_counts_behind_the_first() {
    let kept = Kept::new();
    let unsealed = |day: &str| {
        let mut journal = Journal::open(&kept.log(), LIMITS, &zoned(&format!("{day}T07:00:00Z")));
        journal.show(&ended(
            &format!("{day}T07:01:00.000+00:00"),
            &format!("{day}T07:02:00.000+00:00"),
            Ending::Completed,
        ));
    };
    unsealed("2026-11-21");
    kept.plays("2026-11-21", 9, 1, LIMITS);
    let report = kept.report();
    assert_eq!((report.faults, report.unsealed, report.shows.len()), (vec![], 2, 2));
    unsealed("2026-11-22");
    let report = kept.report();
    assert_eq!((report.unsealed, report.shows.len()), (2, 2));
    assert!(
        report.faults[0].starts_with(&format!("2 lines from {SECOND}:1 on: without a seal")),
        "{:?}",
        report.faults
    );
    // Also where nothing of the sealed ones is read.
    let day = "2026-11-26".parse().unwrap();
    unsealed("2026-11-26");
    kept.put(SECOND, &kept.lines(FIRST)[2..]);
    let report = report_by(&kept.log(), (day, day), ReportBounds::ALL, JournalKeys::default()).unwrap();
    assert_eq!((report.faults.len(), report.shows.len()), (1, 0), "{:?}", report.faults);
}

#[test]
fn what_is_asked_has_a_chain_of_its_own_with_the_keys_of_the_shows() {
    let kept = Kept::new();
    let asks = |hour: u32| {
        let now: Zoned =
            format!("2026-11-21T{hour:02}:00:00Z").parse::<Timestamp>().unwrap().to_zoned(TimeZone::UTC);
        let mut journal = Journal::open_with(&kept.log(), LIMITS, &now, Sealer::of(&kept.state()).ok());
        for minute in 0..3 {
            journal.note(&crate::journal::tests::action(
                &format!("2026-11-21T{hour:02}:{minute:02}:00.000+00:00"),
                "arm",
            ));
        }
    };
    asks(9);
    fs::rename(kept.state().join(KEY), kept.state().join("journal.old.nk")).unwrap();
    asks(10);
    let report = kept.report();
    assert_eq!((report.faults, report.actions.len()), (vec![], 6));
    let file = "kinocue-asked-2026-11-21-000.jsonl";
    let mut lines = kept.lines(file);
    lines.remove(2);
    kept.put(file, &lines);
    let report = kept.report();
    assert!(
        report.faults.len() == 1 && report.faults[0].starts_with("line 3 is missing"),
        "{:?}",
        report.faults
    );
    assert_eq!(report.actions.len(), 5);
}

#[test]
fn who_has_the_key_of_a_link_alone_invents_nothing_and_replaces_nothing_at_the_desk() {
    let kept = Kept::two_days();
    let told = tail(&kept.log(), &Default::default(), 100).unwrap();
    let only = || JournalKeys::only([kept.key()]);
    let (lines, found) = check_told(told.clone(), &only());
    assert_eq!((lines.len(), found.faults), (20, vec![]));
    // Told again, and in any order.
    let again = told.iter().rev().chain(&told).cloned().collect();
    let (lines, found) = check_told(again, &only());
    assert_eq!((lines.len(), found.faults), (20, vec![]));
    let forge = |change: &dyn Fn(&mut Vec<JournalPart>)| {
        let mut parts = told.clone();
        change(&mut parts);
        let (lines, found) = check_told(parts, &only());
        (lines.len(), found.faults)
    };
    // Invented: without a seal, with that of another key, with one of the hall for another line.
    let bare = |part: &JournalPart| {
        let mut part = part.clone();
        part.record.as_object_mut().unwrap().remove("seal");
        part
    };
    let (count, faults) = forge(&|parts| parts.push(bare(&parts[3])));
    assert!(count == 20 && faults[0].contains("without a seal"), "{faults:?}");
    let other = Kept::two_days();
    let of_other = tail(&other.log(), &Default::default(), 100).unwrap();
    let (count, faults) = forge(&|parts| parts.extend(of_other.clone()));
    assert!(count == 20 && faults[0].contains(&other.key()), "{faults:?}");
    let (count, faults) = forge(&|parts| {
        let seal = parts[5].record["seal"].clone();
        let mut part = bare(&parts[3]);
        part.record["seal"] = seal;
        parts.push(part);
    });
    assert!(count == 20 && faults[0].contains("altered"), "{faults:?}");
    // Replaced, or withheld: the true one is missed.
    let (count, faults) = forge(&|parts| parts[5].record["cue"] = "calm".into());
    assert!(count == 19 && faults.len() == 2 && faults[1].starts_with("line 6 is missing"), "{faults:?}");
    let (count, faults) = forge(&|parts| drop(parts.remove(5)));
    assert!(count == 19 && faults[0].starts_with("line 6 is missing"), "{faults:?}");
    // All of it is of a hall whose key the desk does not know.
    let (lines, found) = check_told(told.clone(), &JournalKeys::only([KeyPair::new_module().public_key()]));
    assert!(lines.is_empty() && found.faults.len() == 1, "{:?}", found.faults);
}

#[test]
fn a_state_folder_that_takes_no_key_and_a_key_that_others_may_read_are_named() {
    let kept = Kept::new();
    let why = Sealer::of(&kept.state().join("none")).unwrap_err();
    assert!(why.contains("journal.nk cannot be made"), "{why}");
    let _ = kept.key();
    let open = std::os::unix::fs::PermissionsExt::from_mode(0o644);
    fs::set_permissions(kept.state().join(KEY), open).unwrap();
    assert!(Sealer::of(&kept.state()).unwrap_err().contains("chmod 600"));
}
