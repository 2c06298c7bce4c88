//! `--record`: the file that a play leaves, read by the library that viewers read with.

use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;

use mcap::{MessageStream, Summary};
use serde_json::Value;

use super::process::{Playing, Sim, kinocue, play};
use super::{Folder, STROKE, programs};

/// All messages of a topic.
fn messages(file: &[u8], topic: &str) -> Vec<Value> {
    let all = MessageStream::new(file).expect("a recording").map(|one| one.expect("it is whole"));
    let of_topic = all.filter(|one| one.channel.topic == topic);
    of_topic.map(|one| serde_json::from_slice(&one.data).expect("JSON")).collect()
}

fn sum(messages: &[Value], field: &str) -> u64 {
    messages.iter().map(|one| one[field].as_u64().expect("a count")).sum()
}

fn greatest(messages: &[Value], field: &str) -> f64 {
    let places = messages.iter().filter_map(|one| one[field].get(0)?.as_f64());
    places.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn a_recorded_play_leaves_a_file_whose_counts_and_places_are_those_of_report_and_controller() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let path = folder.path("nod.mcap");
    let to = [format!("{},name=F4", sim.addresses[0])];
    let args = ["--json", "--record", path.to_str().expect("UTF-8")];
    let report = play(&folder.nod(&[0.1]), &to, &args).report_of(0);
    let seen = sim.end();
    let file = std::fs::read(&path).expect("it is there");
    let (seat, ticks) = (messages(&file, "/seat/F4"), messages(&file, "/tick"));
    assert_eq!(Value::from(sum(&seat, "sent")), report["controllers"][0]["sent"]);
    assert_eq!(sum(&seat, "unsent") + sum(&seat, "clamps") + sum(&ticks, "dropped"), 0);
    let farthest = f64::from(seen.farthest(0)) * 150.0 / STROKE;
    assert!((greatest(&seat, "sent_mm") - farthest).abs() < 1e-3, "{farthest} mm");
    assert!((greatest(&seat, "asked_mm") - farthest).abs() < 1e-3, "no pose was held back");
    let states: Vec<_> = messages(&file, "/hall").iter().map(|one| one["state"].clone()).collect();
    assert!(states.len() > 2, "it was parked, played and parked: {states:?}");
    let summary = Summary::read(&file).expect("it is closed").expect("it has one");
    let index = &summary.attachment_indexes[0];
    let attached = mcap::read::attachment(&file, index).expect("it is whole");
    assert_eq!(serde_json::from_slice::<Value>(&attached.data).expect("JSON"), report);
    assert!(!folder.path("nod.part.mcap").exists());
}

#[test]
fn a_file_that_is_there_is_not_recorded_over_and_nothing_is_played() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let path = folder.write("yesterday.mcap", "yesterday");
    let run = play(&folder.nod(&[0.1]), &sim.to(), &["--record", path.to_str().expect("UTF-8")]);
    assert_eq!(run.code, Some(74), "{run:?}");
    assert!(run.stderr.contains("yesterday.mcap: there is such a file"), "{}", run.stderr);
    assert_eq!(std::fs::read(&path).expect("it is there"), b"yesterday");
    assert!(sim.end().rows.is_empty());
}

/// Records a nod in full, to whoever is there.
fn recorded_in_full(folder: &Folder, to: &str, more: &[&str]) -> (std::path::PathBuf, Value) {
    let path = folder.path("nod.mcap");
    let args = [&["--json", "--record", text(&path), "--record-mode", "full"], more].concat();
    let report = play(&folder.nod(&[0.1]), &[format!("{to},name=F4")], &args).report_of(0);
    (path, report)
}

fn text(path: &Path) -> &str {
    path.to_str().expect("UTF-8")
}

/// The datagrams of a capture of raw IPv4.
fn datagrams(pcap: &[u8]) -> Vec<Vec<u8>> {
    let (mut rest, mut all) = (&pcap[24..], Vec::new());
    while let Some((head, behind)) = rest.split_first_chunk::<16>() {
        let length = u32::from_le_bytes(head[8..12].try_into().expect("four octets")) as usize;
        all.push(behind[28..length].to_vec());
        rest = &behind[length..];
    }
    all
}

#[test]
fn every_datagram_comes_back_from_a_whole_recording_as_the_controller_received_it() {
    let folder = Folder::new();
    let controller = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let address = controller.local_addr().expect("it is bound");
    let received = std::thread::spawn(move || {
        let (mut all, mut octets) = (Vec::new(), [0; 2_000]);
        loop {
            let (length, _) = controller.recv_from(&mut octets).expect("loopback works");
            if &octets[..length] == b"end" {
                return all;
            }
            all.push(octets[..length].to_vec());
        }
    });
    let (path, report) = recorded_in_full(&folder, &address.to_string(), &["--no-acks"]);
    UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.send_to(b"end", address)).expect("sent");
    let received = received.join().expect("it ends");
    let pcap = folder.path("nod.pcap");
    let run = kinocue(&["record", "cut", text(&path), "--pcap", "-o", text(&pcap)]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let kept = datagrams(&std::fs::read(&pcap).expect("it is there"));
    assert_eq!(Value::from(kept.len()), report["controllers"][0]["sent"]);
    assert!(kept == received, "{} kept, {} received", kept.len(), received.len());
    let run = kinocue(&["decode", text(&pcap), "--all"]);
    assert!(run.code == Some(0) && run.stdout.lines().count() >= kept.len(), "{run:?}");
}

#[test]
fn a_recorded_play_is_told_cut_compared_drawn_and_made_a_cue_again() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let (path, report) = recorded_in_full(&folder, &sim.addresses[0], &[]);
    let of = |arguments: &[&str]| {
        let run = kinocue(arguments);
        assert_eq!(run.code, Some(0), "{run:?}");
        run.stdout
    };
    let info: Value = serde_json::from_str(&of(&["record", "info", text(&path), "--json"])).expect("JSON");
    assert_eq!(info["seats"][0]["sent"], report["controllers"][0]["sent"]);
    assert_eq!(
        info["end"]["frames"].as_str().map(str::to_owned),
        Some(report["controllers"][0]["sent"].to_string())
    );
    let most: Value = serde_json::from_str(info["end"]["most"].as_str().expect("JSON in it")).expect("JSON");
    assert_eq!(most, info["most"], "measured again, the same comes nearest");
    assert!(of(&["record", "list", text(path.parent().expect("a folder"))]).contains("nod.mcap"));
    // Each curve of the layout for viewers has figures in the file.
    let layout: Value = serde_json::from_str(&of(&["record", "layout", "--seat", "F4"])).expect("JSON");
    let file = std::fs::read(&path).expect("it is there");
    let panels = layout["configById"].as_object().expect("panels").values();
    let is_named =
        |one: &Value| ["foxglovePanelTitle", "lichtblickPanelTitle"].iter().all(|key| one[key].is_string());
    assert!(panels.clone().filter(|one| !one["xAxisVal"].is_null()).all(is_named), "{layout}");
    let paths: Vec<&str> = panels
        .flat_map(|one| one["paths"].as_array().expect("paths"))
        .filter_map(|one| one["value"].as_str())
        .collect();
    assert_eq!(paths.len(), 6 + 2 + 4 + 2, "{paths:?}");
    for path in paths {
        let (topic, field) = path.split_once('.').expect("a field");
        let field = field.split('[').next().expect("a name");
        assert!(messages(&file, topic).iter().any(|one| !one[field].is_null()), "{path}");
    }
    let said = of(&["plot", text(&path), "--seat", "F4"]);
    let sentence = said.lines().nth(1).expect("a sentence");
    assert!(sentence.starts_with("F4: sent as it was asked for; "), "{sentence}");
    let picture: Value = serde_json::from_str(&of(&["plot", text(&path), "--json"])).expect("JSON");
    let speed = picture["panels"]
        .as_array()
        .expect("panels")
        .iter()
        .find(|one| one["name"] == "Speed")
        .expect("of limits");
    let of_info = info["most"].as_array().expect("all").iter().filter(|one| one["quantity"] == "speed");
    let of_info = of_info
        .map(|one| one["value"].as_f64().expect("a number") / one["limit"].as_f64().expect("a number"));
    let worst = of_info.fold(0.0, f64::max);
    assert!(
        (speed["marks"][0]["value"].as_f64().expect("a number") / 100.0 - worst).abs() < 1e-12,
        "{speed}"
    );
    let cut = folder.path("cut.mcap");
    of(&["record", "cut", text(&path), "--film", "0..0.5", "--anonymous", "--whole", "-o", text(&cut)]);
    let octets = std::fs::read(&cut).expect("it is there");
    assert!(!octets.windows(2).any(|pair| pair == b"F4"), "no name is in it");
    let seat = messages(&octets, "/seat/S1");
    assert!(
        seat.len() >= 50
            && seat.iter().all(|one| (0.0..=0.5).contains(&one["film_s"].as_f64().expect("a time")))
    );
    let rows = folder.path("rows.csv");
    of(&["record", "cut", text(&path), "--seat", "F4", "--csv", "-o", text(&rows)]);
    let rows = std::fs::read_to_string(rows).expect("it is there");
    let frames = report["controllers"][0]["sent"].as_u64().expect("a count");
    assert_eq!(rows.lines().count() as u64, frames + 1);
    of(&["record", "compare", text(&path), text(&path), "--tolerance", "0mm"]);
    let again = folder.path("again.csv");
    of(&["convert", text(&path), text(&again), "--seat", "F4", "--take", "sent"]);
    of(&["info", text(&again)]);
    assert_eq!(kinocue(&["plot", text(&path), "--seat", "nobody"]).code, Some(66));
    drop(sim.end());
}

#[test]
fn a_recording_that_finds_no_room_ends_early_and_the_report_says_so_also_to_programs() {
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let path = folder.path("nod.mcap");
    let args = ["--json", "--record", text(&path), "--record-mode", "full"];
    let report =
        Playing::start_cramped(&folder.nod(&[0.1]), &sim.addresses[0], 16, &args).finish().report_of(0);
    let trouble = report["recording_trouble"].as_str().expect("it says why");
    assert!(trouble.contains("the recording ended early") && trouble.contains("nod.part.mcap"), "{trouble}");
    assert_eq!(report["result"], "completed", "the play went on");
    assert!(!path.exists() && folder.path("nod.part.mcap").exists());
    drop(sim.end());
}

#[test]
fn what_is_made_of_a_recording_that_is_cut_short_or_damaged_is_said_to_be_less_and_no_recording_is_replaced()
{
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let (path, _) = recorded_in_full(&folder, &sim.addresses[0], &[]);
    drop(sim.end());
    let list = kinocue(&["record", "list", text(path.parent().expect("a folder")), "--json"]).stdout;
    assert_eq!(serde_json::from_str::<Value>(&list).expect("JSON")[0]["marks"], 0);
    let whole = std::fs::read(&path).expect("it is there");
    let last = Summary::read(&whole).expect("it is closed").expect("it has one").chunk_indexes.pop();
    let place = last.expect("chunks").compressed_data_offset().expect("an offset");
    let place = usize::try_from(place).expect("it is short");
    let mut changed = whole.clone();
    changed[place] ^= 4;
    for (name, octets, says) in
        [("half.mcap", &whole[..whole.len() / 2], "is cut short"), ("bit.mcap", &changed, "is damaged")]
    {
        let half = folder.path(name);
        std::fs::write(&half, octets).expect("there is room");
        let [cut, rows, pcap, cue] =
            ["cut.mcap", "cut.csv", "cut.pcap", "cue.csv"].map(|one| folder.path(one));
        for args in [
            &["record", "cut", text(&half), "-o", text(&cut), "--force"][..],
            &["record", "cut", text(&half), "--csv", "-o", text(&rows), "--force"],
            &["record", "cut", text(&half), "--pcap", "-o", text(&pcap), "--force"],
            &["convert", text(&half), text(&cue), "--seat", "F4", "--take", "sent", "--force"],
            &["record", "compare", text(&path), text(&half)],
            &["record", "compare", text(&half), text(&path), "--json"],
        ] {
            let run = kinocue(args);
            assert_eq!(run.code, Some(1), "{args:?}: {run:?}");
            assert!(run.stderr.contains(&format!("{name}: the file {says}")), "{args:?}: {run:?}");
        }
        let drawn = kinocue(&["plot", text(&path), text(&half)]).stdout;
        assert!(drawn.contains(&format!("The recording laid over it: the file {says}")), "{drawn}");
        assert!([cut, rows, pcap, cue].iter().all(|made| made.exists()), "what precedes is of use");
    }
    let link = folder.path("again.mcap");
    std::os::unix::fs::symlink(&path, &link).expect("a link");
    for args in [
        &["record", "cut", text(&path), "--film", "0..0.5", "-o", text(&path), "--force"][..],
        &["record", "cut", text(&path), "-o", text(&link), "--force"],
        &["convert", text(&path), text(&path), "--seat", "F4", "--take", "sent", "--force"],
        &["convert", text(&link), text(&path), "--recover", "--force"],
    ] {
        let run = kinocue(args);
        assert!(run.code == Some(64) && run.stderr.contains("is the file that is read"), "{args:?}: {run:?}");
    }
    assert!(std::fs::read(&path).expect("it is there") == whole);
}

#[test]
fn a_play_that_was_recorded_is_judged_again_as_its_report_says_and_so_is_a_cut_of_it_that_names_nobody() {
    let (folder, sim) = (Folder::new(), Sim::one(&["--loss", "0.05", "--seed", "7"]));
    let (path, report) = recorded_in_full(&folder, &sim.addresses[0], &[]);
    let judged = |path: &Path| {
        let run = kinocue(&["replay", text(path), "--json"]);
        let told: Value = serde_json::from_str(&run.stdout).expect("JSON");
        assert_eq!((run.code, &told["equal"]), (Some(0), &true.into()), "{told}");
        told
    };
    let whole = judged(&path);
    let (seat, reported) = (&whole["seats"][0], &report["controllers"][0]);
    for key in ["sent", "asked", "acked", "refused", "lost"] {
        assert_eq!(seat[key], reported[key], "{key}");
    }
    assert!(seat["lost"].as_u64() > Some(0), "some were lost: {seat}");
    assert_eq!((&whole["from_the_start"], &whole["gaps"]), (&true.into(), &0.into()));
    let cut = folder.path("case.mcap");
    let film = ["--film", "0.2..1.5", "--anonymous", "--whole"];
    let run = kinocue(&[&["record", "cut", text(&path), "-o", text(&cut)], &film[..]].concat());
    assert_eq!(run.code, Some(0), "{run:?}");
    let part = judged(&cut);
    assert!(part["fates"].as_u64() > Some(20) && part["from_the_start"] == false, "{part}");
    assert!(kinocue(&["replay", text(&path)]).stdout.contains("no difference"));
    let sampled = folder.path("sampled.mcap");
    let run = kinocue(&["record", "cut", text(&path), "-o", text(&sampled)]);
    assert_eq!(run.code, Some(0), "{run:?}");
    let run = kinocue(&["replay", text(&sampled)]);
    assert!(run.code == Some(64) && run.stderr.contains("no replies to judge again"), "{run:?}");
    drop(sim.end());
}

/// What a reader of others, run by this program on a script beside this file, finds in a recording.
fn read_by(program: &Path, script: &str, path: &Path) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/play").join(script);
    let run = Command::new(program).args([&script, path]).output().expect("it runs");
    assert!(run.status.success(), "{run:?}");
    serde_json::from_slice(&run.stdout).expect("JSON")
}

/// That a reader of others finds as many messages, the same metadata and the same attachments as we tell; gives what we tell.
fn told_as_by(theirs: &Value, path: &Path) -> Value {
    let ours = kinocue(&["record", "info", text(path), "--json"]);
    let ours: Value = serde_json::from_str(&ours.stdout).expect("JSON");
    assert_eq!(theirs["messages"], ours["messages"]);
    let all: u64 = ours["messages"].as_object().expect("topics").values().filter_map(Value::as_u64).sum();
    assert_eq!(theirs["statistics"], Value::from(all));
    assert_eq!(theirs["metadata"]["kinocue"], ours["metadata"]);
    assert_eq!(theirs["metadata"]["kinocue.end"], ours["end"]);
    assert_eq!(theirs["attachments"], ours["attachments"]);
    ours
}

#[test]
fn the_official_python_reader_reads_a_recording_with_the_counts_that_we_tell() {
    let python = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/readers/bin/python");
    if !programs::is_there("python-mcap", python.is_file(), "tests/readers.sh installs it") {
        return;
    }
    let (folder, sim) = (Folder::new(), Sim::one(&[]));
    let (path, report) = recorded_in_full(&folder, &sim.addresses[0], &[]);
    let theirs = read_by(&python, "read_recording.py", &path);
    let ours = told_as_by(&theirs, &path);
    assert_eq!(theirs["ticks"], ours["ticks"]);
    assert_eq!(theirs["frames"]["0"], report["controllers"][0]["sent"]);
    let numbers: Vec<i64> =
        theirs["numbers"].as_array().expect("of frames").iter().filter_map(Value::as_i64).collect();
    assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "two running sums give frame numbers");
    drop(sim.end());
}

#[test]
fn the_official_typescript_reader_reads_a_recording_with_the_counts_of_its_report() {
    let reader = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/readers/node_modules/@mcap/core");
    if !programs::is_there("node-mcap", reader.is_dir(), "tests/readers.sh installs it, by npm") {
        return;
    }
    let (folder, sim) = (Folder::new(), Sim::one(&["--loss", "0.05", "--seed", "7"]));
    let (path, report) = recorded_in_full(&folder, &sim.addresses[0], &[]);
    let theirs = read_by(Path::new("node"), "read_recording.mjs", &path);
    told_as_by(&theirs, &path);
    let (seat, reported) = (&theirs["seats"]["F4"], &report["controllers"][0]);
    assert_eq!(seat["unsent"], reported["send_failed"]);
    for key in ["sent", "acked", "refused", "lost"] {
        assert_eq!(seat[key], reported[key], "{key}");
    }
    assert!(seat["lost"].as_u64() > Some(0), "some were lost: {seat}");
    drop(sim.end());
}
