//! The cue library with the real process that checks what is uploaded.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use kinocue::harness::control::{Code, Problem};
use kinocue::harness::library::{Awaited, Bounds, CueInfo, Hall, Library, Proved};
use kinocue::harness::playlist::Playlist;
use tempfile::TempDir;

#[path = "common/script.rs"]
mod script;

const GOOD: &str = "# title: Ride\ntime_ms,a1,a2,a3,fx_air\n0,0,0,0,0\n1000,0,0,0,1\n2000,0,0,0,0\n";
/// Out of the stroke in one row, and far too fast.
const BAD: &str = "# interpolation: linear\ntime_ms,a1,a2,a3,fx_mist\n0,0,0,0,0\n100,1,0,0,1\n2000,0,0,0,0\n";

/// A library in a folder of its own, beside a hall of one seat.
struct Fixture {
    dir: TempDir,
    library: Library,
}

impl Fixture {
    fn new() -> Self {
        Self::bounded(Bounds::default())
    }

    fn bounded(bounds: Bounds) -> Self {
        let dir = tempfile::tempdir().expect("a folder");
        let config = dir.path().join("hall.toml");
        fs::write(
            &config,
            "[seat.bench3]\naxes = 3\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\nmax_velocity_mm_s = 240.0\n\
             max_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n[effects]\nair = 1\n[preset.kids]\nmotion = 0.6\n\
             [[controller]]\nname = \"A1\"\nseat = \"bench3\"\naddress = \"127.0.0.1:7408\"\n",
        )
        .expect("the folder is ours");
        let program = PathBuf::from(env!("CARGO_BIN_EXE_kinocue"));
        let library = Library::open(&dir.path().join("cues"), Hall { config, program, bounds });
        let library = library.expect("the folder is ours");
        Self { dir, library }
    }

    fn upload(&self, id: &str, bytes: &[u8]) -> Result<CueInfo, Problem> {
        let mut upload = self.library.begin(&id.parse().expect("an id"))?;
        for part in bytes.chunks(1000) {
            upload.write(part)?;
        }
        upload.finish(None)
    }

    fn cues(&self) -> PathBuf {
        self.dir.path().join("cues")
    }

    /// What lies in the library, but for what it keeps of its own.
    fn files(&self) -> Vec<String> {
        let names = fs::read_dir(self.cues())
            .expect("it is ours")
            .map(|entry| entry.expect("it is ours").file_name());
        let mut names: Vec<_> = names.map(|name| name.into_string().expect("UTF-8")).collect();
        names.retain(|name| name != ".index.json");
        names.sort();
        names
    }
}

fn mcap(cue: &str) -> Vec<u8> {
    let cue =
        kinocue::cue::read(Path::new("x.csv"), cue.as_bytes(), &Default::default()).expect("a good cue");
    let mut file = std::io::Cursor::new(Vec::new());
    kinocue::cue::write_mcap(&cue, &mut file).expect("it fits in memory");
    file.into_inner()
}

#[test]
fn a_cue_that_passes_is_taken_in_with_all_that_is_known_of_it() {
    let fixture = Fixture::new();
    let info = fixture.upload("ride", GOOD.as_bytes()).unwrap();
    assert_eq!((info.title.as_deref(), info.length_s, info.axes), (Some("Ride"), Some(2.0), Some(3)));
    assert_eq!((info.effects.as_slice(), info.size), (["air".to_owned()].as_slice(), GOOD.len() as u64));
    assert_eq!(info.proof, Proved::Passed);
    assert_eq!(fixture.files(), ["ride.csv"]);
    assert_eq!(fixture.library.list(), std::slice::from_ref(&info));
    let (timeline, sha256) = fixture.library.read(&"ride".parse().unwrap()).unwrap();
    assert_eq!((Some(sha256), timeline.axes()), (info.sha256, 3));
}

#[test]
fn a_cue_that_does_not_pass_is_refused_with_every_fault_and_leaves_nothing() {
    let fixture = Fixture::new();
    let problem = fixture.upload("ride", BAD.as_bytes()).unwrap_err();
    assert_eq!(problem.code, Code::Cue);
    let told = |part: &str| problem.faults.iter().any(|fault| fault.contains(part));
    assert!(told("fx_mist: unknown effect") && told("velocity") && told("jerk"), "{problem}");
    assert!(problem.faults.iter().all(|fault| !fault.contains(".upload")), "{problem}");
    let problem = fixture.upload("ride", b"time_ms,a1\n0,0\n10,2\n20,3\n").unwrap_err();
    assert!(problem.faults[0].starts_with("3:4: a1: 2"), "{problem}");
    assert_eq!(problem.faults.len(), 2, "{problem}");
    assert_eq!(fixture.upload("ride", b"").unwrap_err().code, Code::Cue);
    assert!(fixture.files().is_empty());
    assert!(fixture.library.list().is_empty());
}

#[test]
fn what_is_uploaded_is_known_by_its_content_and_replaces_what_was_there() {
    let fixture = Fixture::new();
    fixture.upload("ride", GOOD.as_bytes()).unwrap();
    let first = fixture.library.read(&"ride".parse().unwrap()).unwrap().1;
    fixture.upload("ride", &mcap(GOOD)).unwrap();
    assert_eq!(fixture.files(), ["ride.mcap"]);
    assert_ne!(fixture.library.read(&"ride".parse().unwrap()).unwrap().1, first);
    fixture.upload("ride", BAD.as_bytes()).unwrap_err();
    assert_eq!(fixture.files(), ["ride.mcap"], "a refused cue takes the place of nothing");
    fixture.upload("ride", GOOD.as_bytes()).unwrap();
    assert_eq!(fixture.files(), ["ride.csv"]);
}

#[test]
fn what_is_known_lasts_over_a_restart_until_the_hall_changes() {
    let fixture = Fixture::new();
    fixture.upload("ride", GOOD.as_bytes()).unwrap();
    let config = fixture.dir.path().join("hall.toml");
    let hall = Hall { config: config.clone(), program: "/nonexistent".into(), bounds: Bounds::default() };
    let again = Library::open(&fixture.cues(), hall).unwrap();
    let ride = "ride".parse().unwrap();
    assert_eq!(again.examine(&ride).unwrap().proof, Proved::Passed, "without checking it again");
    let text = fs::read_to_string(&config).unwrap();
    fs::write(&config, text.replace("air = 1", "mist = 1")).unwrap();
    assert_eq!(again.get(&ride).unwrap().proof, Proved::Unknown);
    fixture.library.examine_all();
    let Proved::Failed { faults } = fixture.library.get(&ride).unwrap().proof else { panic!("air is gone") };
    assert!(faults[0].contains("fx_air: unknown effect"), "{faults:?}");
    assert_eq!(fixture.files(), ["ride.csv"], "what was taken in stays");
}

#[test]
fn a_hall_with_faults_proves_nothing() {
    let fixture = Fixture::new();
    fs::write(fixture.dir.path().join("hall.toml"), "nonsense = 1\n").unwrap();
    let problem = fixture.upload("ride", GOOD.as_bytes()).unwrap_err();
    assert!(problem.detail.contains("configuration of the hall has faults"), "{problem}");
    assert!(fixture.files().is_empty());
}

/// A chunk of 60 MiB, of which so many bytes do not pack.
fn bomb(noise: usize) -> Vec<u8> {
    let mut message = vec![b' '; 60 << 20];
    let mut seed = 1_u32;
    for byte in &mut message[..noise] {
        seed ^= seed << 13;
        seed ^= seed >> 17;
        seed ^= seed << 5;
        *byte = seed.to_le_bytes()[1];
    }
    let mut file = std::io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new()
        .compression(Some(mcap::Compression::Zstd))
        .chunk_size(Some(128 << 20))
        .create(&mut file)
        .expect("it fits in memory");
    let channel = writer.add_channel(0, "/cue/axes", "json", &Default::default()).expect("it fits in memory");
    let header =
        mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, &message).expect("it fits in memory");
    writer.finish().expect("it fits in memory");
    drop(writer);
    file.into_inner()
}

#[test]
fn a_bomb_is_refused_within_its_bounds() {
    // Over 60 MiB of it are the program itself, as it is built for tests.
    let fixture = Fixture::bounded(Bounds { memory_mib: 80, ..Bounds::default() });
    fixture.upload("ride", GOOD.as_bytes()).unwrap();
    // What packs better than any cue is not even unpacked.
    let problem = fixture.upload("bomb", &bomb(0)).unwrap_err();
    assert!(problem.faults[0].contains("damaged: a chunk of "), "{problem}");
    let bytes = bomb(1 << 20);
    assert!(bytes.len() < 2 << 20, "{} bytes", bytes.len());
    let problem = fixture.upload("bomb", &bytes).unwrap_err();
    assert_eq!(problem.code, Code::Check);
    assert!(problem.detail.contains("signal 6; it may take 80 MiB of memory"), "{problem}");
    assert_eq!(fixture.files(), ["ride.csv"]);
    let roomy = Fixture::new();
    let problem = roomy.upload("bomb", &bytes).unwrap_err();
    assert!(problem.faults[0].contains("65536"), "with room it is a message that is too long: {problem}");
}

/// An upload whose check is a script.
fn upload_with(text: &str, time: Duration, awaited: Option<&Awaited>) -> Problem {
    let fixture = Fixture::new();
    let program = fixture.dir.path().join("check");
    script::make(&program, &format!("#!/bin/sh\n{text}\n"));
    let bounds = Bounds { time, ..Bounds::default() };
    let hall = Hall { config: fixture.dir.path().join("hall.toml"), program, bounds };
    let library = Library::open(&fixture.cues(), hall).expect("the folder is ours");
    let mut upload = library.begin(&"ride".parse().expect("an id")).expect("it is the first");
    upload.write(GOOD.as_bytes()).expect("it is ours");
    let problem = upload.finish(awaited).expect_err("it is refused");
    assert!(fixture.files().is_empty());
    problem
}

#[test]
fn a_check_that_nobody_waits_for_any_more_is_ended() {
    let (waits, awaited) = Awaited::pair().expect("a pipe");
    drop(waits);
    let problem = upload_with("exec sleep 60", Duration::from_secs(60), Some(&awaited));
    assert!(problem.detail.contains("nobody waits"), "{problem}");
}

#[test]
fn a_check_that_hangs_or_prints_without_end_is_ended() {
    let problem = upload_with("exec sleep 60", Duration::from_millis(50), None);
    assert!(problem.detail.contains("took more than"), "{problem}");
    let problem = upload_with("exec >&-; exec sleep 60", Duration::from_millis(50), None);
    assert!(problem.detail.contains("took more than"), "{problem}");
    let problem = upload_with("exec yes", Duration::from_secs(60), None);
    assert!(problem.detail.contains("longer than any verdict"), "{problem}");
}

#[test]
fn a_check_that_fails_takes_nothing_in() {
    for script in ["exit 0", "kill -9 $$", "echo '{\"passed\":true}'"] {
        let problem = upload_with(script, Duration::from_secs(60), None);
        assert!(problem.detail.contains("the check of the cue ended with"), "{problem}");
    }
    let foreign = r#"echo '{"passed":true,"faults":[],"more":0,"led_faults":[],"sha256":"00","effects":[],"mcap":false}'"#;
    assert!(
        upload_with(foreign, Duration::from_secs(60), None)
            .detail
            .contains("changed while it was being checked")
    );
}

/// A command on a cue that stands still with its answer: the pipe for it is full of blanks. With the end that reads them.
fn held_at_its_answer(command: &[&str], cue: &Path) -> (std::process::Child, std::io::PipeReader) {
    let (answer, mut full) = std::io::pipe().expect("a pipe");
    let flags = rustix::fs::fcntl_getfl(&full).expect("the flags of a pipe");
    rustix::fs::fcntl_setfl(&full, flags | rustix::fs::OFlags::NONBLOCK).expect("a pipe that does not block");
    while std::io::Write::write(&mut full, b" ").is_ok() {}
    rustix::fs::fcntl_setfl(&full, flags).expect("a pipe that blocks");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_kinocue"));
    let child = child.args(command).arg(cue).stdout(full).spawn().expect("the program starts");
    let call = || fs::read_to_string(format!("/proc/{}/syscall", child.id())).expect("its system call");
    let of_write = format!("{} 0x1 ", libc::SYS_write);
    while !call().starts_with(&of_write) {
        std::thread::yield_now();
    }
    (child, answer)
}

#[test]
fn the_check_has_lowered_itself_by_the_time_it_answers() {
    let fixture = Fixture::new();
    let hall = fixture.dir.path().join("hall.toml");
    let cue = fixture.dir.path().join("ride.csv");
    fs::write(&cue, GOOD).unwrap();
    let (mut child, mut answer) =
        held_at_its_answer(&["prove", "--json", "--config", hall.to_str().unwrap()], &cue);
    let of = |name: &str| fs::read_to_string(format!("/proc/{}/{name}", child.id())).unwrap();
    let stat = of("stat");
    let fields: Vec<_> = stat.rsplit_once(") ").unwrap().1.split(' ').collect();
    assert_eq!((fields[16], fields[38]), ("19", "5"), "nice 19, SCHED_IDLE: {stat}");
    let limits = of("limits");
    let limit = |name: &str| limits.lines().find(|line| line.starts_with(name)).unwrap().to_owned();
    assert!(limit("Max address space").contains(&(4096_u64 << 20).to_string()), "{limits}");
    assert!(limit("Max cpu time").contains("300"), "{limits}");
    for none in ["Max file size", "Max core file size"] {
        assert_eq!(limit(none).trim_start_matches(none).split_whitespace().next(), Some("0"), "{limits}");
    }
    assert_eq!(of("oom_score_adj").trim(), "1000");
    std::io::Read::read_to_end(&mut answer, &mut Vec::new()).unwrap();
    child.wait().unwrap();
}

/// How many filters of system calls a process is under; `None` where it has ended.
fn filters(process: &str) -> Option<u32> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let of = |name: &str| status.lines().find_map(|line| line.strip_prefix(name)).map(str::trim);
    if of("State:")?.starts_with('Z') { None } else { of("Seccomp_filters:")?.parse().ok() }
}

/// What it may do then is tried in `sys::confined`, by threads that are confined in the same way.
#[test]
fn what_takes_a_file_from_outside_apart_is_confined() {
    let doctor = assert_cmd::Command::new(env!("CARGO_BIN_EXE_kinocue"))
        .args(["doctor", "--seconds", "0", "--json"])
        .output()
        .unwrap();
    let report: serde_json::Value = serde_json::from_slice(&doctor.stdout).unwrap();
    let lines = report["lines"].as_array().unwrap();
    let is_seen = |line: &serde_json::Value| line["id"] == "confinement" && line["verdict"] == "ok";
    let own = filters("self").filter(|_| lines.iter().any(is_seen));
    let Some(own) = own else {
        let words = b"skipped: the kernel takes no filter of system calls, or does not count them\n";
        let _ = std::io::Write::write_all(&mut std::io::stderr(), words);
        return;
    };
    let fixture = Fixture::new();
    let hall = fixture.dir.path().join("hall.toml");
    let cue = fixture.dir.path().join("ride.csv");
    fs::write(&cue, GOOD).unwrap();
    let hall = hall.to_str().unwrap();
    for command in [
        &["prove", "--json", "--config", hall][..],
        &["prove", "--config", hall, "--curve", "10"],
        &["draw-recording"],
    ] {
        let (mut child, mut answer) = held_at_its_answer(command, &cue);
        assert_eq!(filters(&child.id().to_string()), Some(own + 1), "{command:?}");
        let mut told = String::new();
        std::io::Read::read_to_string(&mut answer, &mut told).unwrap();
        assert!(child.wait().unwrap().code().is_some(), "{command:?}: ended by a signal");
        let told: serde_json::Value =
            serde_json::from_str(&told).unwrap_or_else(|_| panic!("{command:?}: {told}"));
        assert!(told.is_object(), "{told}");
    }
}

#[test]
fn a_playlist_of_proved_cues_has_no_faults_and_unknown_ones_are_proved_when_it_is_loaded() {
    let fixture = Fixture::new();
    fs::write(fixture.cues().join("ride.csv"), GOOD).unwrap();
    fs::write(fixture.cues().join("wild.csv"), BAD).unwrap();
    let config = kinocue::harness::config::load(&fixture.dir.path().join("hall.toml")).unwrap();
    let check = |text: &str| {
        let playlist = Playlist::parse(Path::new("day.toml"), text).unwrap();
        playlist.check(&fixture.library, &config).iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let good = "title = \"Day\"\n[[entry]]\ncue = \"ride\"\npreset = \"kids\"\neffects = { air = false }\n";
    assert!(check(good).is_empty());
    assert_eq!(fixture.library.get(&"ride".parse().unwrap()).unwrap().proof, Proved::Passed);
    let faults = check("title = \"Day\"\n[[entry]]\ncue = \"wild\"\n[[entry]]\ncue = \"gone\"\n");
    assert!(faults[0].starts_with("day.toml:3:7: cue: wild does not pass: "), "{faults:?}");
    assert!(faults[1].starts_with("day.toml:5:7: cue: there is no cue gone"), "{faults:?}");
}

/// A ride at 239 mm/s of 240.
fn just_within() -> String {
    let row = |ms: u32| {
        let t = f64::from(ms) * 1e-3;
        let u = (t.min(12.0 - t) / 2.0).clamp(0.0, 1.0);
        let swell = u * u * (3.0 - 2.0 * u);
        let turn = std::f64::consts::TAU / 1.6;
        format!("{ms},{:.9}\n", 0.5 + 239.0 / turn / 150.0 * swell * (turn * t).sin())
    };
    format!("time_ms,a1\n{}", (0..=12_000).step_by(20).map(row).collect::<String>())
}

#[test]
fn a_playlist_is_checked_for_every_pace_that_the_film_of_an_entry_may_ask_for() {
    let fixture = Fixture::new();
    fs::write(fixture.cues().join("ride.csv"), just_within()).unwrap();
    let path = fixture.dir.path().join("hall.toml");
    let hall = fs::read_to_string(&path).unwrap();
    let check = |sync: &str, film: &str| {
        fs::write(&path, format!("{hall}{sync}")).unwrap();
        let config = kinocue::harness::config::load(&path).unwrap();
        let day = format!("title = \"Day\"\n[[entry]]\ncue = \"ride\"\n{film}");
        let playlist = Playlist::parse(Path::new("day.toml"), &day).unwrap();
        playlist.check(&fixture.library, &config).iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let film = "film = \"01:00:00:00\"\n";
    let sync = "[sync]\nsources = [\"mpv:/s\"]\nfilm_fps = \"25\"\n";
    assert_eq!((check("", ""), check(sync, "")), (vec![], vec![]), "no film leads it");
    let faults = check("", film);
    assert!(faults[0].starts_with("day.toml:4:8: film = \"01:00:00:00\", but the"), "{faults:?}");
    let led = check(sync, film);
    let says =
        "day.toml:3:7: cue: ride does not pass at every pace that its film may ask for: 122:6: a1: velocity";
    assert!(led.len() == 1 && led[0].starts_with(says), "{led:?}");
    let all_led = check(&format!("{sync}start = \"01:00:00:00\"\n"), "");
    assert!(all_led.len() == 1 && all_led[0].contains("cue: ride does not pass"), "{all_led:?}");
}

#[test]
fn curves_are_drawn_once_until_the_file_changes() {
    let fixture = Fixture::new();
    let id = "ride".parse().unwrap();
    let put = |text: &str| {
        fs::write(fixture.cues().join("new"), text).unwrap();
        fs::rename(fixture.cues().join("new"), fixture.cues().join("ride.csv")).unwrap();
    };
    put("time_ms,a1\n0,0.5\n100,0.5\n");
    let first = fixture.library.curve(&id, 10, None).unwrap();
    assert!(std::sync::Arc::ptr_eq(&first, &fixture.library.curve(&id, 10, None).unwrap()));
    assert_eq!(fixture.library.curve(&id, 20, None).unwrap().t_s.len(), 20);
    put("# units: mm\ntime_ms,a1\n0,15\n100,15\n");
    assert_eq!(fixture.library.curve(&id, 10, None).unwrap().axes[0].max[0], 0.1);
    put("time_ms,a1\n0,0.5\n100,7\n");
    let problem = fixture.library.curve(&id, 10, None).unwrap_err();
    assert_eq!(problem.code, Code::Cue);
    assert!(problem.faults.concat().contains("ride.csv:3:5: a1"), "{problem}");
}

#[test]
fn a_curve_that_takes_too_much_memory_is_given_up_by_the_child_alone() {
    let fixture = Fixture::bounded(Bounds { memory_mib: 48, ..Bounds::default() });
    let rows: String = (0..1_000_000).map(|row| format!("{row},0.5\n")).collect();
    fs::write(fixture.cues().join("long.csv"), format!("time_ms,a1\n{rows}")).unwrap();
    let problem = fixture.library.curve(&"long".parse().unwrap(), 100, None).unwrap_err();
    assert!(problem.remedy.contains("max_memory_mib in [library]"), "{problem}");
}
