//! The library without the process that checks; tests/library.rs has the rest.

use std::fs;
use std::os::unix::fs::symlink;

use super::*;

const CUE: &str = "# title: Ride\ntime_ms,a1\n0,0.5\n100,0.5\n";

fn library(dir: &Path) -> Library {
    let program = PathBuf::from("/nonexistent/kinocue");
    let bounds = Bounds { max_bytes: 1000, ..Bounds::default() };
    Library::open(dir, Hall { config: dir.join("hall.toml"), program, bounds }).unwrap()
}

fn id(text: &str) -> CueId {
    text.parse().unwrap()
}

fn left(dir: &Path) -> Vec<String> {
    Folder::open(dir).unwrap().names().unwrap()
}

#[test]
fn cues_are_the_regular_files_with_an_id_for_a_name() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["b.csv", "a.mcap", "Bad.csv", "c.txt", ".csv", "hall.toml"] {
        fs::write(dir.path().join(name), CUE).unwrap();
    }
    symlink("/etc/passwd", dir.path().join("link.csv")).unwrap();
    fs::create_dir(dir.path().join("folder.csv")).unwrap();
    let library = library(dir.path());
    let ids: Vec<_> = library.list().into_iter().map(|info| info.id).collect();
    assert_eq!(ids, ["a", "b"]);
    assert!(library.get(&id("link")).is_none());
    assert_eq!(library.read(&id("folder")).unwrap_err().code, Code::Unknown);
    assert_eq!(library.get(&id("b")).unwrap().proof, Proved::Unknown);
}

#[test]
fn a_cue_is_read_with_the_hash_of_what_was_read() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("ride.csv"), CUE).unwrap();
    let (timeline, sha256) = library(dir.path()).read(&id("ride")).unwrap();
    assert_eq!(timeline.cue().title(), Some("Ride"));
    assert_eq!(sha256, hex(&Sha256::digest(CUE)));
    assert_eq!(sha256.len(), 64);
}

#[test]
fn a_cue_with_faults_is_a_problem_that_names_each() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("bad.csv"), "time_ms,a1\n0,2\n100,3\n").unwrap();
    let problem = library(dir.path()).read(&id("bad")).unwrap_err();
    assert_eq!(problem.code, Code::Cue);
    assert_eq!(problem.faults.len(), 2, "{problem}");
    assert!(problem.faults[1].contains("bad.csv:3:5: a1"), "{problem}");
}

#[test]
fn an_upload_that_is_given_up_or_too_long_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let library = library(dir.path());
    let mut upload = library.begin(&id("a")).unwrap();
    upload.write(CUE.as_bytes()).unwrap();
    assert_eq!(left(dir.path()).len(), 1);
    drop(upload);
    let mut upload = library.begin(&id("a")).unwrap();
    let problem = upload.write(&[b'#'; 1001]).unwrap_err();
    assert_eq!(problem.code, Code::Size);
    drop(upload);
    assert!(left(dir.path()).is_empty());
}

#[test]
fn uploads_beyond_the_second_wait_their_turn() {
    let dir = tempfile::tempdir().unwrap();
    let library = library(dir.path());
    let first = library.begin(&id("a")).unwrap();
    let _second = library.begin(&id("a")).unwrap();
    assert_eq!(library.begin(&id("b")).unwrap_err().code, Code::Busy);
    drop(first);
    library.begin(&id("b")).unwrap();
}

#[test]
fn what_a_crash_left_of_an_upload_is_removed_at_the_next_start() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join(".upload-1-0"), "half").unwrap();
    fs::write(dir.path().join("ride.csv"), CUE).unwrap();
    let library = library(dir.path());
    assert_eq!(left(dir.path()), ["ride.csv"]);
    let upload = library.begin(&id("new")).unwrap();
    self::library(dir.path());
    assert_eq!(left(dir.path()).len(), 2, "one that goes on elsewhere stays");
    drop(upload);
}

#[test]
fn a_check_that_cannot_be_started_is_a_problem_and_keeps_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let mut upload = library(dir.path()).begin(&id("a")).unwrap();
    upload.write(CUE.as_bytes()).unwrap();
    let problem = upload.finish(None).unwrap_err();
    assert!(problem.detail.starts_with("cannot start the check"), "{problem}");
    assert!(left(dir.path()).is_empty());
}

#[test]
fn no_curve_is_drawn_in_this_process() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("ride.csv"), CUE).unwrap();
    let library = library(dir.path());
    for points in [0, MAX_POINTS + 1] {
        assert_eq!(library.curve(&id("ride"), points, None).unwrap_err().code, Code::Value);
    }
    let problem = library.curve(&id("ride"), 10, None).unwrap_err();
    assert!(problem.detail.starts_with("cannot start the check"), "{problem}");
}

#[test]
fn what_is_large_and_unknown_is_not_read_in_this_process() {
    let dir = tempfile::tempdir().unwrap();
    let file = fs::File::create(dir.path().join("vast.csv")).unwrap();
    file.set_len(SMALL + 1).unwrap();
    let problem = library(dir.path()).read(&id("vast")).unwrap_err();
    assert!(problem.detail.starts_with("cannot start the check"), "{problem}");
}
