//! Plays that chase a film: timecode out of a file, and a player that speaks as mpv does.

use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, MonoTime, Rate};
use kinocue::harness::worst_of_lines;

use rustix::process::Signal;
use serde_json::{Value, json};

use super::motion::fastest;
use super::process::{Guarded, Playing, Row, Seen, Sim, kinocue};
use super::{Folder, STROKE, pulses, undisturbed};

/// A cue that rises a third of the stroke in so many seconds, from rest to rest, and stays there for one more.
fn rise(folder: &Folder, seconds: u32) -> std::path::PathBuf {
    let part = |ms: u32| (f64::from(ms) / f64::from(1_000 * seconds)).min(1.0);
    let row = |ms: u32| {
        let part = part(ms);
        format!("{ms},{:.7}\n", part.powi(3) * (10.0 - 15.0 * part + 6.0 * part * part) / 3.0)
    };
    let rows: String = (0..=1_000 * (seconds + 1)).step_by(20).map(row).collect();
    folder.write("rise.csv", format!("time_ms,a1\n{rows}"))
}

fn reel(folder: &Folder, start: &str, seconds: &str) -> String {
    let path = folder.write("reel.wav", String::new()).to_str().expect("text").to_owned();
    let made = kinocue(&["sync", "send", "--ltc", "--tc-start", start, "--seconds", seconds, "-o", &path]);
    assert_eq!(made.code, Some(0), "{made:?}");
    path
}

#[test]
fn a_reel_of_timecode_leads_the_seat_from_park_through_the_cue_and_back_to_park() {
    let (run, seen) = undisturbed(|| {
        let (folder, sim) = (Folder::new(), Sim::one(&[]));
        let chase = format!("ltc:{}", reel(&folder, "00:59:58:00", "9"));
        let args = ["--json", "--chase", &chase, "--film-fps", "25", "--tc-start", "01:00:00:00"];
        let run = Playing::start(&rise(&folder, 4), &sim.to(), &args).finish();
        let report = run.report_of(0);
        assert_eq!(report["result"], "completed", "{}", run.stderr);
        ((run, sim.end()), vec![report])
    });
    assert!(
        run.stderr.contains("waiting: ") && run.stderr.contains("parking: the cue is over"),
        "{}",
        run.stderr
    );
    assert!(seen.rest_in_park());
    // While they wait and join, too, it is said where the film is, and who says so.
    for state in ["waiting: ", "joining: the seats join the film", "playing: "] {
        let lines = || run.stderr.lines().filter(|line| line.starts_with(&format!("kinocue: {state}")));
        let says = |line: &str| line.contains("; film ") && line.contains(" by ltc:/");
        assert!(lines().count() > 0 && lines().all(says), "{state}: {}", run.stderr);
    }
    assert!(run.stderr.contains(" the cue by ltc:/"), "{}", run.stderr);
    let said = |what: &str| run.stderr.find(what).unwrap_or_else(|| panic!("{what}: {}", run.stderr));
    assert!(
        said("joining: the seats join the film") < said("playing: the seats that take part are on the cue")
    );
    let (count, spread_s) = followed(&seen, 4, 0.1);
    // A frame of the film lasts 40 ms: it stays nearer to its own than to any other. How near is judged in virtual time and, on a
    // machine of which more is known, by `benches/film`.
    assert!(count > 50 && spread_s < 0.02, "{count} frames, {spread_s} s");
}

/// Of a seat that was led through a rise of so many seconds: its frames from a height on to the top, and by how much the instants of
/// the cue that they were made for go on other than the frames do, seconds.
fn followed(seen: &Seen, seconds: u32, from: f64) -> (usize, f64) {
    // Where an ack is late one frame may take the time of several.
    let ends_s = seen.rows.iter().scan(0.0, |end, row| {
        *end += f64::from(row.time_ms) * 1e-3;
        Some(*end)
    });
    let rows: Vec<_> = ends_s.zip(seen.rows.iter().map(|row| row.commanded[0])).collect();
    let media_s = |at: i32| {
        let wanted = f64::from(at) / STROKE * 3.0;
        let (mut low, mut high) = (0.0_f64, 1.0_f64);
        for _ in 0..60 {
            let part = f64::midpoint(low, high);
            let risen = part.powi(3) * (10.0 - 15.0 * part + 6.0 * part * part);
            if risen < wanted { low = part } else { high = part }
        }
        f64::from(seconds) * low
    };
    // What comes down to park after the cue is no part of it.
    let top = rows.iter().position(|(_, at)| *at >= pulses(0.33)).expect("it comes to the top");
    let rising = rows[..top].iter().filter(|(_, at)| *at > pulses(from));
    let off: Vec<f64> = rising.map(|(end_s, at)| media_s(*at) - end_s).collect();
    let (least, most) =
        off.iter().fold((f64::MAX, f64::MIN), |(least, most), off| (least.min(*off), most.max(*off)));
    (off.len(), most - least)
}

#[test]
fn the_delay_of_a_capture_chain_is_measured_against_one_that_has_none() {
    let folder = Folder::new();
    let sound = std::fs::read(reel(&folder, "01:00:00:00", "9")).expect("it was written");
    let [late, prompt] = ["late", "prompt"].map(|name| {
        let path = folder.path(name);
        rustix::fs::mkfifoat(rustix::fs::CWD, &path, rustix::fs::Mode::RWXU).expect("there is room");
        path
    });
    let source = |fifo: &Path| format!("ltc:fifo:{}", fifo.display());
    let (measured, against) = (source(&late), source(&prompt));
    let args = [
        "sync",
        "calibrate",
        &measured,
        "--against",
        &against,
        "--seconds",
        "2",
        "--tc-start",
        "01:00:00:00",
        "--json",
    ];
    let measuring = Guarded::start(&args);
    let line = |fifo: &Path| std::fs::OpenOptions::new().write(true).open(fifo).expect("it is read");
    let (mut late, mut prompt) = (line(&late), line(&prompt));
    // 10 ms of sound at a time; the one line has each four blocks after the other.
    let blocks: Vec<&[u8]> = sound[44..].chunks(960).collect();
    let begun = Monotonic.now();
    for (at, block) in (0_u32..).zip(&blocks) {
        Monotonic.sleep_until(begun + Duration::from_millis(10) * at);
        // Once enough was heard nobody reads any more.
        let before = at.checked_sub(4).map_or(Ok(()), |before| late.write_all(blocks[before as usize]));
        if prompt.write_all(block).and(before).is_err() {
            break;
        }
    }
    let run = measuring.finish();
    assert_eq!(run.code, Some(0), "{run:?}");
    let late_ms = run.report()["median_ms"].as_f64().expect("a number");
    assert!((late_ms - 40.0).abs() < 5.0, "{run:?}");
}

/// A player that speaks as mpv does: its film runs until it is told.
struct Player {
    told: Sender<Value>,
}

impl Player {
    /// Its film is at `media_s` now.
    fn start(socket: &Path, media_s: f64) -> Self {
        let listener = UnixListener::bind(socket).expect("the socket is free");
        let (told, tells) = channel();
        std::thread::spawn(move || {
            let (stream, _) = listener.accept().expect("kinocue connects");
            serve(stream, media_s, &tells);
        });
        Self { told }
    }

    fn tell(&self, what: Value) {
        self.told.send(what).expect("it lives");
    }

    fn pause(&self, paused: bool) {
        self.tell(json!({ "event": "property-change", "id": 0, "name": "pause", "data": paused }));
    }
}

fn serve(stream: UnixStream, media_s: f64, tells: &Receiver<Value>) {
    let mut out = stream.try_clone().expect("it can be cloned");
    stream.set_read_timeout(Some(Duration::from_millis(5))).expect("it can be set");
    let (mut lines, mut line) = (BufReader::new(stream), String::new());
    // Where the film is at an instant, while it runs.
    let (mut at, mut runs) = ((Monotonic.now(), media_s), true);
    let media = |at: (MonoTime, f64), runs: bool| {
        at.1 + if runs { Monotonic.now().since(at.0).as_secs_f64() } else { 0.0 }
    };
    loop {
        for what in tells.try_iter() {
            if what["name"] == "pause" {
                at = (Monotonic.now(), media(at, runs));
                runs = what["data"] == false;
            }
            if writeln!(out, "{what}").is_err() {
                return;
            }
        }
        match lines.read_line(&mut line) {
            Ok(0) => return,
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => continue,
            Err(_) => return,
            Ok(_) => {}
        }
        let asked: Value = serde_json::from_str(&line).expect("JSON");
        line.clear();
        let answer =
            json!({ "data": media(at, runs), "error": "success", "request_id": asked["request_id"] });
        if asked["command"][0] == "get_property" && writeln!(out, "{answer}").is_err() {
            return;
        }
    }
}

#[test]
fn a_player_leads_the_seat_which_rests_while_it_is_paused_and_parks_when_its_film_is_over() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let cue = rise(&folder, 20);
    let socket = cue.with_file_name("mpv.sock");
    let player = Player::start(&socket, 1.0);
    player.pause(false);
    let chase = format!("mpv:{}", socket.display());
    let mut playing = Playing::start(&cue, &sim.to(), &["--json", "--chase", &chase]);
    playing.wait_for("playing: ");
    player.pause(true);
    playing.wait_for("waiting: the film is stopped");
    player.pause(false);
    playing.wait_for("playing: ");
    player.tell(json!({ "event": "end-file", "reason": "eof" }));
    playing.wait_for("parked");
    let run = playing.finish();
    assert_eq!((&run.report_of(0)["result"], run.code), (&"stopped".into(), Some(0)), "part of the cue");
    let seen = sim.end();
    assert!(seen.rest_in_park() && seen.rows.iter().any(|row| row.commanded[0] > pulses(0.001)));
}

#[test]
fn a_reel_that_ends_before_it_has_reached_the_cue_ends_the_play_and_moves_nobody() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let chase = format!("ltc:{}", reel(&folder, "00:10:00:00", "2"));
    let args = ["--json", "--chase", &chase, "--film-fps", "25", "--tc-start", "01:00:00:00"];
    let run = Playing::start(&rise(&folder, 4), &sim.to(), &args).finish();
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(run.stderr.contains("no source can report another"), "{}", run.stderr);
    assert!(sim.end().rows.iter().all(|row| row.commanded[0] == 0));
}

#[test]
fn a_relay_ends_with_its_lines() {
    let folder = Folder::new();
    let at = folder.write("none", String::new()).parent().expect("it lies in the folder").to_owned();
    let run = kinocue(&["sync", "relay", "ltc:-", "--folder", at.to_str().expect("text")]);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.stderr.contains("every line has ended"), "{run:?}");
}

#[test]
fn a_recording_that_is_none_of_16_bits_is_refused_with_what_it_is_and_what_to_do() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let reel = reel(&folder, "01:00:00:00", "2");
    let mut wav = std::fs::read(&reel).expect("it was made");
    wav[34] = 24;
    std::fs::write(&reel, wav).expect("it can be written");
    let run = Playing::start(&rise(&folder, 4), &sim.to(), &["--chase", &format!("ltc:{reel}")]).finish();
    assert_eq!(run.code, Some(65), "{run:?}");
    for said in ["reel.wav cannot be read", "uncompressed sound of 24 bits", "-c:a pcm_s16le"] {
        assert!(run.stderr.contains(said), "{said}: {run:?}");
    }
    assert_eq!(sim.end().rows.len(), 0, "nobody was moved");
}

#[test]
fn a_source_that_is_none_is_refused_and_so_is_what_a_film_cannot_be_led_with() {
    let (folder, to) = (Folder::new(), ["127.0.0.1:9".to_owned()]);
    let cue = rise(&folder, 2);
    let refused = [
        (&["--chase", "tape:1"][..], 64, "is not a source; use mpv:SOCKET"),
        (&["--chase", "mpv:/s", "--chase", "ltc:-", "--chase", "mpv:/s"], 64, "mpv:/s is named twice"),
        (&["--chase", "ltc:nothing.wav"], 66, "nothing.wav cannot be opened: No such file"),
        (&["--chase", "ltc:-", "--start", "1"], 64, "cannot be used with"),
        (&["--chase", "ltc:-", "--film-fps", "26"], 64, "is not a frame rate; take"),
        (&["--chase", "ltc:-", "--film-fps", "25", "--tc-start", "01:00:00:25"], 64, "outside 0..=24"),
        (&["--film-fps", "25"], 64, "--chase"),
        (&["--chase", "artnet:anybody"], 64, "has no sender"),
        (&["--chase", "mtc:/nowhere/midi"], 66, "ls /dev/snd/midi*"),
        (&["--at", "soon"], 64, "is not a time; write"),
        (&["--at", "19:00", "--chase", "ltc:-"], 64, "cannot be used with"),
        (&["--at", "19:00,max_error=0ms"], 71, "have chrony or"),
    ];
    for (args, code, says) in refused {
        let run = Playing::start(&cue, &to, args).finish();
        assert_eq!(run.code, Some(code), "{args:?}: {}", run.stderr);
        assert!(run.stderr.contains(says), "{args:?}: {}", run.stderr);
    }
}

#[test]
fn a_source_that_is_no_input_ends_the_play_with_what_is_wrong_and_what_to_do_before_anybody_moves() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let cue = rise(&folder, 2);
    let path = |name: &str, octets: &[u8]| folder.write(name, octets).to_str().expect("text").to_owned();
    let (text, empty) = (path("notes.txt", b"01:00:00:00 reel one"), path("empty.wav", b""));
    let deaf = path("deaf.wav", &film_sound(1));
    let place = folder.path("").to_str().expect("text").to_owned();
    let refused = [
        (format!("ltc:{text}"), 65, "notes.txt cannot be read: it is not a WAV file; make one of it"),
        (format!("ltc:{empty}"), 65, "empty.wav cannot be read: it is empty; make it again"),
        (format!("ltc:{place}"), 66, "it is not a file; give a WAV file"),
        (
            format!("ltc:fifo:{text}"),
            66,
            "notes.txt cannot be opened: it is not a FIFO; make one with mkfifo",
        ),
        (format!("ltc:fifo:{place}none"), 66, "No such file or directory (os error 2); make one with mkfifo"),
        (
            format!("ltc:relay:{text}"),
            66,
            "it is not a socket; give the path of a socket of `kinocue sync relay`",
        ),
        (
            format!("mtc:relay:{text}"),
            66,
            "it is not a socket; give the path of a socket of `kinocue sync relay`",
        ),
        (
            format!("mtc:{text}"),
            66,
            "it is neither a raw MIDI device nor a FIFO; see with `ls /dev/snd/midi*`",
        ),
        (format!("mpv:{text}"), 66, "it is not a socket; give the path that mpv has as --input-ipc-server"),
        (
            format!("sound:-,index={text}"),
            65,
            "notes.txt cannot be used: this is not an index of a film's sound",
        ),
        (
            format!("sound:-,index={place}"),
            66,
            "it is not a file; make the index with `kinocue sync index FILM",
        ),
        (format!("sound:-,index={place}none"), 66, "No such file or directory (os error 2); make the index"),
        (format!("ltc:{deaf}"), 65, "deaf.wav: ended, and nothing of a film was heard in it; see with"),
        ("ltc:pipe:true".to_owned(), 65, "ltc:pipe: ended, and nothing of a film was heard in it; see with"),
    ];
    for (source, code, says) in refused {
        let run = Playing::start(&cue, &sim.to(), &["--chase", &source]).finish();
        assert_eq!(run.code, Some(code), "{source}: {}", run.stderr);
        assert!(run.stderr.contains(says), "{source}: {}", run.stderr);
    }
    assert!(sim.end().rows.iter().all(|row| row.commanded[0] == 0), "nobody was moved");
}

#[test]
fn what_may_still_come_is_waited_for_and_why_it_is_not_there_is_said() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let cue = rise(&folder, 2);
    let place = folder.path("none.sock").to_str().expect("text").to_owned();
    for (source, says) in [
        (format!("mpv:{place}"), "no player is there; start mpv with --input-ipc-server="),
        (
            format!("ltc:relay:{place}"),
            "no relay is there; start kinocue-sync.service, or `kinocue sync relay`",
        ),
        (
            "ltc:pipe:exit 3".to_owned(),
            "its command has failed (exit status: 3), and is started again each second",
        ),
    ] {
        let mut playing = Playing::start(&cue, &sim.to(), &["--chase", &source]);
        playing.wait_for(says);
        playing.signal(Signal::INT);
        let run = playing.finish();
        assert_eq!(run.code, Some(0), "{source}: {}", run.stderr);
    }
    assert!(sim.end().rows.iter().all(|row| row.commanded[0] == 0), "nobody was moved");
}

/// Addresses of this machine that no other test and no other run of them has.
fn addresses(test: u8) -> [String; 3] {
    let [_, _, high, low] = std::process::id().to_be_bytes();
    [0, 1, 2].map(|n| format!("127.{}.{high}.{}", 128 + 3 * test + n, low.max(1)))
}

/// Sends timecode until it is dropped.
fn sent(args: &[&str]) -> Guarded {
    Guarded::start(&[&["sync", "send", "--seconds", "600"], args].concat())
}

#[test]
fn artnet_of_the_named_sender_leads_the_seat_and_whoever_else_sends_is_named_and_moves_nobody() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let [named, foreign, here] = addresses(0);
    let chase = format!("artnet:{named},bind={here}:6454");
    let args = ["--json", "--chase", &chase, "--film-fps", "25", "--tc-start", "01:00:00:00"];
    let to = format!("{here}:6454");
    let _other = sent(&["--artnet", &to, "--from", &foreign, "--tc-start", "01:00:01:00"]);
    let mut playing = Playing::start(&rise(&folder, 4), &sim.to(), &args);
    playing.wait_for(&format!("{foreign} sends as well, and is ignored"));
    let _film = sent(&["--artnet", &to, "--from", &named, "--tc-start", "01:00:00:00"]);
    playing.wait_for("playing: ");
    playing.wait_for("parking: the cue is over");
    assert_eq!(playing.finish().report_of(0)["result"], "completed");
    assert!(sim.end().rest_in_park());
}

#[test]
fn midi_timecode_of_a_fifo_leads_the_seat_which_rests_once_it_falls_silent() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let cue = rise(&folder, 60);
    let fifo = cue.with_file_name("midi");
    assert!(std::process::Command::new("mkfifo").arg(&fifo).status().expect("mkfifo runs").success());
    let fifo = fifo.to_str().expect("text");
    let mut playing = Playing::start(&cue, &sim.to(), &["--json", "--chase", &format!("mtc:{fifo}")]);
    let film = sent(&["--mtc", fifo]);
    playing.wait_for("playing: ");
    drop(film);
    playing.wait_for("waiting: no position is received from the film any more");
    playing.signal(Signal::INT);
    let run = playing.finish();
    assert_eq!(run.code, Some(0), "{}", run.stderr);
    assert!(sim.end().rest_in_park());
}

#[test]
fn a_technician_sees_timecode_move_with_no_hall_and_no_cue() {
    let [named, _, here] = addresses(1);
    let _film = sent(&["--artnet", &format!("{here}:6454"), "--from", &named, "--film-fps", "24"]);
    let source = format!("artnet:{named},bind={here}:6454");
    let seen = kinocue(&["sync", "watch", &source, "--film-fps", "24", "--seconds", "3", "--json"]);
    assert_eq!(seen.code, Some(0), "{seen:?}");
    let last: Value = serde_json::from_str(seen.stdout.lines().last().expect("it is said")).expect("JSON");
    let row = &last["sources"][0];
    assert_eq!((row["state"].as_str(), last["leads"].as_u64()), (Some("locked"), Some(0)), "{last}");
    let text = kinocue(&["sync", "watch", &source, "--seconds", "1"]).stdout;
    assert!(text.contains(&format!("artnet:{named}: ")), "{text}");
}

/// The sound of a film: chords over noise, 48,000 samples a second, one channel.
fn film_sound(seconds: u32) -> Vec<u8> {
    let mut dice = 7_u32;
    let mut throw = || {
        dice = dice.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(dice >> 8) / f64::from(1 << 24)
    };
    let samples = seconds * 48_000;
    let mut wav =
        [b"RIFF".as_slice(), &(36 + 2 * samples).to_le_bytes(), b"WAVEfmt \x10\0\0\0\x01\0\x01\0"].concat();
    wav.extend([48_000_u32.to_le_bytes(), 96_000_u32.to_le_bytes()].concat());
    wav.extend([b"\x02\0\x10\0data".as_slice(), &(2 * samples).to_le_bytes()].concat());
    let mut chord = [0.0; 4];
    for n in 0..samples {
        if n % 14_400 == 0 {
            chord = [(); 4].map(|()| 120.0 * 20_f64.powf(throw()));
        }
        let turn = std::f64::consts::TAU * f64::from(n) / 48_000.0;
        let notes: f64 = chord.iter().map(|hertz| (turn * hertz).sin()).sum();
        let value = 2_000.0 * notes + 3_000.0 * (throw() - 0.5);
        wav.extend(format!("{value:.0}").parse::<i16>().expect("it is within 16 bits").to_le_bytes());
    }
    wav
}

#[test]
fn a_film_is_found_by_its_sound_with_the_index_that_was_made_of_it() {
    let folder = Folder::new();
    let path = |name: &str, octets: Vec<u8>| folder.write(name, octets).to_str().expect("text").to_owned();
    let (film, index) = (path("storm.wav", film_sound(12)), path("storm.kidx", Vec::new()));
    let made = kinocue(&["sync", "index", &film, "-o", &index, "--name", "The Storm", "--json"]);
    assert_eq!(made.code, Some(0), "{made:?}");
    let made: Value = serde_json::from_str(&made.stdout).expect("JSON");
    assert!(made["seconds"].as_f64().is_some_and(|seconds| (seconds - 12.0).abs() < 0.1), "{made}");
    let source = format!("sound:{film},index={index}");
    let seen = kinocue(&["sync", "watch", &source, "--seconds", "9", "--json"]);
    assert_eq!(seen.code, Some(0), "{seen:?}");
    let tables = seen.stdout.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let leads = |table: &Value| {
        let row = &table["sources"][0];
        row["state"] == "locked" && row["film"] == "The Storm" && table["leads"] == 0
    };
    assert!(tables.into_iter().any(|table| leads(&table)), "{}", seen.stdout);
    for (foreign, says) in
        [(film.as_str(), "not an index of a film's sound"), ("/nowhere.kidx", "cannot be opened")]
    {
        let refused = kinocue(&["sync", "watch", &format!("sound:-,index={foreign}")]);
        assert!(refused.code != Some(0) && refused.stderr.contains(says), "{refused:?}");
    }
    let foreign = kinocue(&["sync", "index", &path("text.mkv", b"no film".to_vec()), "-o", &index]);
    assert!(foreign.code != Some(0) && foreign.stderr.contains("mpv"), "{foreign:?}");
    let short = kinocue(&["sync", "index", &path("short.wav", film_sound(2)), "-o", &index]);
    assert!(short.code != Some(0) && short.stderr.contains("s are needed"), "{short:?}");
}

#[test]
fn a_film_that_is_found_by_its_sound_leads_the_seat_through_its_cue_and_back_to_park() {
    let (run, seen) = undisturbed(|| {
        let (folder, sim) = (Folder::new(), Sim::one(&[]));
        let path =
            |name: &str, octets: Vec<u8>| folder.write(name, octets).to_str().expect("text").to_owned();
        let (film, index) = (path("storm.wav", film_sound(15)), path("storm.kidx", Vec::new()));
        let made = kinocue(&["sync", "index", &film, "-o", &index]);
        assert_eq!(made.code, Some(0), "{made:?}");
        let chase = format!("sound:{film},index={index}");
        let run = Playing::start(&rise(&folder, 12), &sim.to(), &["--json", "--chase", &chase]).finish();
        let report = run.report_of(0);
        assert_eq!(report["result"], "completed", "{}", run.stderr);
        ((run, sim.end()), vec![report])
    });
    assert!(run.stderr.contains("joining: the seats join the film"), "{}", run.stderr);
    // It has joined by the middle of the rise.
    let (count, spread_s) = followed(&seen, 12, 0.2);
    assert!(count > 300 && spread_s < 0.02, "{count} frames, {spread_s} s");
    assert!(seen.rest_in_park());
}

/// Serves positions of a film that runs as it should for 4 s, and then lies about everything, a while each.
fn lie(stream: UnixStream, seed: u32) {
    let mut out = stream.try_clone().expect("it can be cloned");
    let (mut lines, mut line, mut dice) = (BufReader::new(stream), String::new(), seed);
    let mut throw = |sides: u32| {
        dice = dice.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (dice >> 8) % sides
    };
    let (begun, mut from, mut rate, mut lie, mut until_s) = (Monotonic.now(), (0.0, 5.0), 1.0, 99, 4.0);
    while lines.read_line(&mut line).is_ok_and(|count| count > 0) {
        let now_s = Monotonic.now().since(begun).as_secs_f64();
        if now_s > 10.0 {
            let _ = writeln!(out, "{}", json!({ "event": "end-file", "reason": "eof" })); // it may have left
            return;
        }
        let media_s = from.1 + rate * (now_s - from.0);
        if now_s > until_s {
            let step_s = [0.0, 0.03, -0.04, 0.3, -5.0, 9.0][throw(6) as usize];
            (from, lie, until_s) = ((now_s, media_s + step_s), throw(9), now_s + 0.1 * f64::from(throw(12)));
            rate = [1.0, 1.0, 1.0, 1.02, 0.9, 3.0, -1.0, 0.0][throw(8) as usize];
            let speed = [1.0, 0.99, 1e300, -2.0][throw(4) as usize];
            let told = [
                json!({ "event": "property-change", "name": "speed", "data": speed }),
                json!({ "event": "property-change", "name": "pause", "data": throw(3) == 0 }),
                json!({ "event": "seek" }),
                json!({ "event": "playback-restart" }),
                json!({ "garbage": "x".repeat(1_000_000) }),
            ];
            if writeln!(out, "{}", told[throw(5) as usize]).is_err() {
                return;
            }
        }
        let asked: Value = serde_json::from_str(&line).expect("JSON");
        line.clear();
        let said = match lie {
            0 => json!(media_s + 1e-3 * f64::from(throw(100))),
            1 => json!(throw(100_000)),
            2 => json!("soon"),
            3 => json!(media_s.floor()),
            4 => continue,
            _ => json!(media_s),
        };
        let answer = json!({ "data": said, "error": "success", "request_id": asked["request_id"] });
        if asked["command"][0] == "get_property" && writeln!(out, "{answer}").is_err() {
            return;
        }
    }
}

#[test]
fn a_player_that_lies_moves_its_seat_no_faster_and_no_more_suddenly_than_that_may_by_the_times_of_its_frames()
{
    for seed in 1..3 {
        let (folder, sim) = (Folder::new(), Sim::one(&["--pa", "06=0"]));
        let socket = folder.path("mpv.sock");
        let listener = UnixListener::bind(&socket).expect("the socket is free");
        std::thread::spawn(move || lie(listener.accept().expect("kinocue connects").0, seed));
        let chase = format!("mpv:{}", socket.display());
        let run = Playing::start(&folder.wave(40), &sim.to(), &["--chase", &chase]).finish();
        assert_eq!(run.code, Some(0), "seed {seed}: {}", run.stderr);
        let seen = sim.end();
        assert!(seen.rest_in_park(), "seed {seed}");
        let line = |row: &Row| {
            (Duration::from_millis(row.time_ms.into()), f64::from(row.commanded[0]) / STROKE * 150.0)
        };
        let worst = worst_of_lines(Rate::from_hz(100.0), 0.0, seen.rows.iter().map(line));
        let shares = [worst.velocity, worst.acceleration, worst.jerk];
        assert!(seen.motion() > 300, "seed {seed}: {} frames", seen.motion());
        assert!(shares.iter().all(|share| *share <= 1.01), "seed {seed}: {shares:?} of its limits");
        let (_, executed) = fastest(&seen.rows);
        assert!(executed < 2_000.0 * 240.0, "seed {seed}: its motors moved at {executed} pulses/s");
    }
}
