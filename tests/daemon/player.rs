//! A hall that shows its films itself: mpv, started by the service, and led with the seats.

use std::fs;
use std::path::PathBuf;

use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open};
use serde_json::Value;

use crate::hall::{Hall, swell};
use crate::programs::is_installed;
use crate::wav::silent_film;

/// A hall without a screen and without a loudspeaker, whose films are ten minutes long, so that no slow machine comes to the end, and
/// eight seconds.
fn closed(on_stop: &str) -> Hall {
    let hall = Hall::closed(&[], |config| {
        let folder =
            config.split("library = \"").nth(1).and_then(|rest| rest.split("/cues\"").next()).unwrap();
        format!(
            "{config}[film]\nplayer = \"mpv\"\nfolder = \"{folder}/films\"\non_stop = \"{on_stop}\"\n\
             fullscreen = false\naudio_device = \"null\"\nvideo_output = \"null\"\n"
        )
    });
    fs::create_dir(hall.path("films")).unwrap();
    for (name, seconds) in [("night.wav", 600), ("short.wav", 8)] {
        fs::write(hall.path("films").join(name), silent_film(seconds)).unwrap();
    }
    hall.write("cues/long.csv", &swell(600));
    for (list, cue) in [("night", "long"), ("short", "night"), ("none", "night")] {
        let text = format!("title = \"{list}\"\n[[entry]]\ncue = \"{cue}\"\nmovie = \"{list}.wav\"\n");
        hall.write(&format!("playlists/{list}.toml"), &text);
    }
    hall
}

fn open(on_stop: &str) -> Hall {
    let mut hall = closed(on_stop);
    hall.serve();
    hall.comes_to("parked");
    hall
}

fn arm(hall: &Hall, list: &str) {
    hall.done(&["playlist", list]);
    hall.done(&["preflight"]);
    hall.done(&["arm"]);
}

fn at(status: &Value, what: &str) -> f64 {
    status[what]["position_s"].as_f64().unwrap_or(f64::NAN)
}

/// Seats and film are at the same place, after that one.
fn together(status: &Value, after_s: f64) -> bool {
    let (show, film) = (at(status, "show"), at(status, "film"));
    status["state"] == "playing" && show > after_s && (show - film).abs() < 0.25
}

fn stands(status: &Value) -> bool {
    status["film"]["state"] == "stopped"
}

fn warns(status: &Value, of: &str) -> bool {
    let warnings = status["warnings"].as_array().expect("a list");
    warnings.iter().any(|one| format!("{}; {}", one["text"], one["remedy"]).contains(of))
}

/// What the system tells of a process: a file in `/proc`.
fn proc(pid: Pid, file: &str) -> PathBuf {
    PathBuf::from(format!("/proc/{}/{file}", pid.as_raw_nonzero()))
}

/// A field of `/proc/PID/stat`, counted from the state, after the name.
fn stat(pid: Pid, field: usize) -> Option<String> {
    let stat = fs::read_to_string(proc(pid, "stat")).ok()?;
    stat.rsplit_once(") ")?.1.split(' ').nth(field).map(str::to_owned)
}

/// The player of a hall: the mpv that its service started.
fn mpv(hall: &Hall) -> Option<Pid> {
    let own = hall.path("hall.toml").to_str().unwrap().to_owned();
    let pids =
        fs::read_dir("/proc").unwrap().filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    pids.filter_map(Pid::from_raw).find(|pid| {
        let comm = fs::read_to_string(proc(*pid, "comm")).unwrap_or_default();
        let parent = stat(*pid, 1).and_then(|parent| parent.parse().ok()).and_then(Pid::from_raw);
        let told = parent.and_then(|parent| fs::read(proc(parent, "cmdline")).ok()).unwrap_or_default();
        comm == "mpv\n" && String::from_utf8_lossy(&told).contains(&own)
    })
}

/// Waits until a process is no more.
fn wait_for_end(pid: Pid) {
    let Ok(handle) = pidfd_open(pid, PidfdFlags::empty()) else { return };
    poll(&mut [PollFd::new(&handle, PollFlags::IN)], None).unwrap();
}

#[test]
fn go_pause_resume_seek_and_stop_lead_film_and_seats_together() {
    if !is_installed("mpv") {
        return;
    }
    let mut hall = open("pause");
    arm(&hall, "night");
    let armed = hall.wait(stands);
    assert!(at(&armed, "film").abs() < 0.1, "it waits at its beginning: {}", armed["film"]);
    assert_eq!(armed["film"]["next"], "nothing; seats follow it once a person starts or resumes the show");
    assert_eq!((hall.relay(0).count(), hall.relay(1).count()), (0, 0), "a film that is loaded moves nobody");
    hall.done(&["go"]);
    hall.wait(|status| together(status, 2.0));

    hall.done(&["pause"]);
    let paused = hall.wait(|status| status["state"] == "paused" && stands(status));
    let later = hall.lives_on(100);
    assert!((at(&later, "film") - at(&paused, "film")).abs() < 0.1, "{}", later["film"]);
    hall.done(&["resume"]);
    hall.wait(|status| together(status, at(&paused, "film")));

    hall.done(&["seek", "30"]);
    hall.wait(|status| together(status, 30.0));
    hall.done(&["stop"]);
    hall.wait(|status| status["state"] == "stopped" && stands(status));
    let lines = hall.close();
    assert!(!lines.iter().any(|line| line.contains("start mpv")), "the service does: {lines:?}");
    hall.end();
}

#[test]
fn a_film_that_is_kept_when_the_seats_stop_runs_on_and_they_join_it_where_it_is() {
    if !is_installed("mpv") {
        return;
    }
    let mut hall = open("keep");
    arm(&hall, "night");
    hall.done(&["go"]);
    let before = hall.wait(|status| together(status, 1.0));
    hall.done(&["stop"]);
    hall.comes_to("stopped");
    hall.wait(|status| at(status, "film") > at(&before, "film") + 2.0);
    hall.done(&["clear"]);
    hall.wait(|status| status["next"] == "park, or home");
    hall.done(&["park"]);
    let parked = hall.comes_to("parked");
    hall.done(&["preflight"]);
    hall.done(&["arm"]);
    hall.done(&["go"]);
    hall.wait(|status| together(status, at(&parked, "film")));
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.close();
    assert!(hall.end().rest_in_park());
}

#[test]
fn a_playlist_of_two_films_runs_from_one_go_to_the_park_at_the_end() {
    if !is_installed("mpv") {
        return;
    }
    let mut hall = open("pause");
    let entry = |movie: &str, then: &str| {
        format!("[[entry]]\ncue = \"six\"\nmovie = \"{movie}\"\nthen = \"{then}\"\n")
    };
    let text = format!("title = \"Day\"\n{}{}", entry("night.wav", "go"), entry("short.wav", "hold"));
    hall.write("cues/six.csv", &swell(6));
    hall.write("playlists/day.toml", &text);
    arm(&hall, "day");
    assert_eq!(hall.status()["playlist"]["entries"][0]["movie"], "night.wav");
    hall.done(&["go"]);
    hall.wait(|status| status["playlist"]["current"] == 0 && together(status, 0.0));
    // Whatever the film before does meanwhile, they join the next one inside its cue.
    hall.wait(|status| status["playlist"]["current"] == 1 && together(status, 0.0));
    hall.comes_to("parked");
    assert_eq!(hall.status()["playlist"]["current"], 1);
    hall.close();
    let shows = hall.journal("show");
    let results: Vec<_> = shows.iter().map(|show| &show["outcome"]["result"]).collect();
    assert_eq!(results, ["completed"; 2], "{shows:?}");
    assert!(hall.end().rest_in_park());
}

#[test]
fn the_end_of_the_film_parks_and_that_it_is_shorter_than_its_cue_was_said_at_load() {
    if !is_installed("mpv") {
        return;
    }
    let mut hall = open("pause");
    arm(&hall, "short");
    hall.wait(|status| warns(status, "short.wav is 8.0 s long, and night ends at 60.0 s of it"));
    hall.done(&["go"]);
    hall.comes_to("playing");
    hall.comes_to("parked");
    let lines = hall.close();
    assert!(lines.iter().any(|line| line.contains("the film is over")), "{lines:?}");
    assert_eq!(hall.journal("show").last().expect("it was played")["outcome"]["result"], "stopped");
    assert!(hall.end().rest_in_park());
}

#[test]
fn a_player_that_is_killed_leaves_the_seats_holding_and_is_back_paused_until_a_person_resumes() {
    if !is_installed("mpv") {
        return;
    }
    let mut hall = open("pause");
    arm(&hall, "night");
    hall.done(&["go"]);
    let before = hall.wait(|status| together(status, 2.0));
    let killed = mpv(&hall).expect("it runs");
    kill_process(killed, Signal::KILL).unwrap();
    hall.wait(|status| status["state"] == "waiting" && warns(status, "once the film is back"));
    let back = hall.wait(stands);
    assert_eq!(back["state"], "waiting", "nothing runs by itself");
    assert!((at(&back, "film") - at(&before, "film")).abs() < 2.0, "where it was: {}", back["film"]);
    assert_ne!(mpv(&hall), Some(killed));
    hall.done(&["resume"]);
    hall.wait(|status| together(status, at(&back, "film")));
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.close();
    assert!(hall.end().rest_in_park());
}

#[test]
fn a_player_that_hangs_holds_up_neither_a_stop_nor_the_hall() {
    if !is_installed("mpv") {
        return;
    }
    let mut hall = open("pause");
    arm(&hall, "night");
    hall.done(&["go"]);
    hall.wait(|status| together(status, 1.0));
    let hung = mpv(&hall).expect("it runs");
    kill_process(hung, Signal::STOP).unwrap();
    hall.done(&["trim", "20"]);
    hall.done(&["pause"]);
    hall.done(&["stop"]);
    hall.comes_to("stopped");
    assert_eq!(stat(hung, 0).as_deref(), Some("T"), "all that was done while it hung");
    wait_for_end(hung);
    hall.wait(stands);
    hall.close();
    hall.end();
}

#[test]
fn a_film_that_is_missing_is_named_at_load_and_the_seats_stay_parked() {
    if !is_installed("mpv") {
        return;
    }
    let mut hall = open("pause");
    arm(&hall, "none");
    hall.wait(|status| warns(status, "none.wav") && warns(status, "copy it there"));
    hall.done(&["go"]);
    hall.comes_to("waiting");
    hall.lives_on(100);
    assert_eq!((hall.relay(0).count(), hall.relay(1).count()), (0, 0));
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.close();
    assert!(hall.end().rest_in_park());
}

#[test]
fn the_player_shares_nothing_with_the_service_and_ends_with_it_however_that_ends() {
    if !is_installed("mpv") {
        return;
    }
    let mut hall = open("pause");
    hall.done(&["playlist", "night"]);
    hall.wait(stands);
    let player = mpv(&hall).expect("it runs");
    let service = stat(player, 1).and_then(|pid| pid.parse().ok()).and_then(Pid::from_raw).unwrap();
    let sockets = |pid: Pid| {
        let open =
            fs::read_dir(proc(pid, "fd")).unwrap().filter_map(|fd| fs::read_link(fd.ok()?.path()).ok());
        open.filter(|file| file.to_string_lossy().starts_with("socket:")).collect::<Vec<_>>()
    };
    let (own, shared) = (sockets(player), sockets(service));
    assert!(own.iter().all(|socket| !shared.contains(socket)), "{own:?} {shared:?}");
    assert_eq!(stat(player, 38).as_deref(), Some("0"), "an ordinary process");
    let told = String::from_utf8(fs::read(proc(player, "cmdline")).unwrap()).unwrap();
    let socket = told.split('\0').find_map(|arg| arg.strip_prefix("--input-ipc-server=")).unwrap().to_owned();
    let folder = PathBuf::from(&socket).parent().unwrap().to_owned();
    let mode = std::os::unix::fs::PermissionsExt::mode(&fs::metadata(&folder).unwrap().permissions());
    assert_eq!(mode & 0o777, 0o700);
    hall.close();
    assert!(stat(player, 0).is_none(), "it was waited for");
    assert!(!folder.exists());

    hall.serve();
    hall.comes_to("parked");
    hall.wait(|_| mpv(&hall).is_some());
    let player = mpv(&hall).expect("it runs");
    hall.kill();
    wait_for_end(player);
}

#[test]
fn a_hall_without_a_player_says_what_to_install_and_plays_its_cues() {
    let mut hall = closed("pause");
    hall.serve_alone();
    hall.wait(|status| warns(status, "mpv is not installed") && warns(status, "apt-get install mpv"));
    hall.play("ride");
    hall.comes_to("parked");
    let lines = hall.close();
    assert!(lines.iter().any(|line| line.contains("mpv is not installed")), "{lines:?}");
    assert!(hall.end().rest_in_park());
}
