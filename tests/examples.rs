//! Every example of every help page runs as it stands beside the shipped cues and examples, but for those that name what only the reader
//! has. They run on a machine of their own: a network namespace with nothing but loopback, where ports are free and nothing leaves.

#[path = "common/programs.rs"]
mod programs;

use std::fmt::Write as _;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output};
use std::thread;

use programs::is_installed;

/// What only the reader has: devices, films, captures, a packaged service; programs of others.
const YOURS: [&str; 25] = [
    "arm --fleet", // a hall of a fleet
    "offset=6",    // controllers of six axes
    "alsa:",
    "/dev/snd",
    "film.mkv",
    "storm.wav",
    "storm.mkv",
    "film.sock",
    "ride.bin",
    "--from csv saved.csv",
    "before.mcap",
    "ride.part.mcap",
    "| jq",
    "show.pcapng",
    "tcpdump",
    "xxd",
    "/etc/kinocue",
    "~/.local",
    "/var/lib",
    "/run/kinocue",
    "man ",
    "/dev/input",
    "buttons watch",
    "--config examples/silvermax.toml --name",
    "--config examples/sixpack2.toml --name",
];
/// What each page needs beside it, in the order in which they run.
const STAGES: [(&str, &[&str]); 3] = [
    (
        "",
        &[
            "check",
            "info",
            "fit",
            "edit",
            "decode",
            "doctor",
            "token",
            "buttons",
            "completions",
            "demo",
            "sim",
        ],
    ),
    (
        "sim --safe --count 2",
        &["play", "plot", "convert", "preflight", "home", "register", "sync", "record", "replay", "latency"],
    ),
    (
        "serve --rehearse",
        &[
            "status",
            "watch",
            "preflight",
            "sync",
            "record",
            "cues",
            "upload",
            "load",
            "playlist",
            "select",
            "level",
            "trim",
            "effects",
            "preset",
            "disable",
            "enable",
            "arm",
            "go",
            "pause",
            "resume",
            "seek",
            "stop",
            "clear",
            "park",
            "disarm",
            "test",
            "mark",
            "reload",
            "report",
            "home",
        ],
    ),
];

/// Pages whose examples are for the service, unless they say with these what they are for.
const SHARED: [&str; 4] = ["preflight", "home", "sync", "record"];
const ITSELF: [&str; 14] = [
    "--to",
    "--config",
    "--explain",
    "sync send",
    "sync check",
    "sync index",
    "sync watch",
    "sync relay",
    "record list",
    "record cut",
    "record compare",
    "record info",
    "record recover",
    "record layout",
];

/// Pages whose examples run until they are ended.
const ENDLESS: [&str; 9] = ["demo", "sim", "latency", "doctor", "play", "watch", "status", "sync", "serve"];

fn kinocue(args: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_kinocue")).args(args).output().expect("kinocue runs");
    assert!(output.status.success(), "{args:?}");
    String::from_utf8(output.stdout).expect("text")
}

/// The examples of a page and of those below it: each a line, without what is said of it.
fn examples(page: &[&str]) -> Vec<String> {
    let help = kinocue(&[page, &["--help"]].concat());
    let mut found: Vec<String> = Vec::new();
    let below = help.split_once("\nCommands:\n").map_or("", |(_, after)| after);
    let below = below.lines().take_while(|line| !line.is_empty());
    let below = below.filter_map(|line| {
        line.strip_prefix("  ")?.split_whitespace().next().filter(|_| !line.starts_with("   "))
    });
    for name in below.filter(|name| *name != "help") {
        found.extend(examples(&[page, &[name]].concat()));
    }
    let after = help.split_once("\nExample").map_or("", |(_, after)| after);
    for line in after.lines().skip(1).take_while(|line| line.starts_with("  ")) {
        match found.last_mut() {
            // What the width of the page broke.
            Some(last)
                if !["kinocue", "tcpdump", "xxd", "printf", "mkdir"]
                    .iter()
                    .any(|word| line.trim_start().starts_with(word)) =>
            {
                *last += &format!(" {}", line.trim());
            }
            _ => found.push(line.trim().to_owned()),
        }
    }
    found
}

/// The command of an example: what stands before two blanks, outside quotes.
fn command(example: &str) -> &str {
    let mut quoted = None;
    let bytes = example.as_bytes();
    for (at, byte) in bytes.iter().enumerate() {
        match (quoted, byte) {
            (None, b'\'' | b'"') => quoted = Some(*byte),
            (Some(open), byte) if open == *byte => quoted = None,
            (None, b' ') if bytes.get(at + 1) == Some(&b' ') => return &example[..at],
            _ => {}
        }
    }
    example
}

/// What runs a command for so many seconds at most, and notes how it ended.
fn step(command: &str, longest: u32, page: &str) -> String {
    let quoted = command.replace('\'', "'\\''");
    format!(
        "timeout --preserve-status -s INT -k 30 {longest} sh -c '{quoted}' >out.log 2>&1 </dev/null; code=$?; \
         grep -q 'Nobody can be asked' out.log && code=0; echo \"$code {page}\" >>ended.log\n\
         test -s out.log && tail -c 600 out.log >>said.log; echo '' >>said.log\n"
    )
}

/// A script that runs each for a few seconds at most, and says how it ended.
fn script() -> (String, Vec<String>) {
    let mut script = "ip link set lo up\nexport COLUMNS=100\n".to_owned();
    let mut all = Vec::new();
    for (beside, pages) in STAGES {
        if !beside.is_empty() {
            let ready = if beside.starts_with("sim") { "ready 127.0.0.1:7409" } else { "parked: " };
            writeln!(script, "kinocue {beside} >beside.log 2>&1 & beside=$!\nuntil grep -q '{ready}' beside.log; do sleep 0.1; done").expect("memory");
            // What examples of one page need of another.
            let first = if beside.starts_with("sim") {
                "register save hall-settings.toml --config examples/hall.toml"
            } else {
                "preflight"
            };
            writeln!(script, "kinocue {first} >/dev/null 2>&1").expect("memory");
        }
        for page in pages {
            let longest = if ENDLESS.contains(page) { 3 } else { 30 };
            for example in examples(&[page]) {
                let command = command(&example);
                let of_service =
                    SHARED.contains(page) && !ITSELF.iter().any(|option| example.contains(option));
                if SHARED.contains(page) && of_service != beside.starts_with("serve") {
                    continue;
                }
                if YOURS.iter().any(|yours| example.contains(yours)) {
                    continue;
                }
                // On two pages, it runs once.
                if all.iter().any(|one| one == command) {
                    continue;
                }
                script += &step(command, longest, page);
                all.push(command.to_owned());
            }
        }
        if !beside.is_empty() {
            writeln!(script, "kill -TERM $beside; wait $beside").expect("memory");
        }
    }
    (script, all)
}

/// A folder with the program, and the shipped cues and examples.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for name in ["cues", "examples"] {
        symlink(root.join(name), folder.path().join(name)).expect("it is ours");
    }
    symlink(env!("CARGO_BIN_EXE_kinocue"), folder.path().join("kinocue")).expect("it is ours");
    folder
}

/// Runs a script there, on a machine of its own.
fn run(folder: &Path, script: &str) -> Output {
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--net", "sh", "-c", script]).current_dir(folder);
    for (name, below) in [("HOME", "home"), ("XDG_STATE_HOME", "home/state"), ("XDG_RUNTIME_DIR", "home/run")]
    {
        command.env(name, folder.join(below));
    }
    command.env("PATH", path).env_remove("KINOCUE_SOCKET").output().expect("unshare runs")
}

fn read(folder: &Path, name: &str) -> String {
    String::from_utf8_lossy(&std::fs::read(folder.join(name)).unwrap_or_default()).into_owned()
}

/// The text of a page of the project.
fn page(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).expect("it ships")
}

/// The blocks of a page in a language.
fn blocks<'p>(page: &'p str, language: &str) -> Vec<&'p str> {
    page.split(&format!("```{language}\n")).skip(1).filter_map(|rest| rest.split("```").next()).collect()
}

/// The commands of a block, without what is said of them.
fn commands(block: &str) -> Vec<&str> {
    let all = block.lines().map(|line| line.split_once(" #").map_or(line, |(command, _)| command).trim_end());
    all.filter(|command| !command.is_empty()).collect()
}

/// Each whole, with the ride of 18 seconds: on a busy machine a virtual seat may fall out of that, and preflight tells of late answers.
#[test]
fn the_walks_of_readme_lead_virtual_drives_and_a_chair_from_home_to_the_end_of_a_ride_as_they_stand() {
    if !is_installed("unshare") || !is_installed("ip") {
        return;
    }
    let readme = page("README.md");
    let walks: Vec<_> =
        blocks(&readme, "sh").into_iter().filter(|block| block.contains("home --config examples/")).collect();
    let walks: Vec<_> =
        walks.into_iter().filter(|block| block.starts_with("kinocue sim")).map(commands).collect();
    assert_eq!(walks.len(), 3, "SilverMax, SIXpack 2, a chair with a turntable");
    let walk = |commands: &[&str]| {
        let folder = folder();
        let mut script = "ip link set lo up\n".to_owned();
        for command in commands {
            writeln!(
                script,
                "{{ {command}; }} >>said.log 2>&1 </dev/null; echo \"$? {command}\" >>ended.log"
            )
            .expect("memory");
        }
        run(folder.path(), &format!("{script}kill $!; wait"));
        let (ended, said) = (read(folder.path(), "ended.log"), read(folder.path(), "said.log"));
        let codes: Vec<&str> = ended.lines().filter_map(|line| line.split(' ').next()).collect();
        let [_, "0", "0" | "1", "0" | "75"] = codes[..] else { panic!("{ended}{said}") };
        assert!(said.contains("home after") && said.contains("result     completed"), "{ended}{said}");
    };
    thread::scope(|scope| walks.iter().for_each(|commands| drop(scope.spawn(move || walk(commands)))));
}

/// Beside three virtual units, which the page's own hall is wired to; nobody homes them, as that asks a person first.
#[test]
fn each_command_of_the_page_on_drives_runs_as_it_stands() {
    if !is_installed("unshare") || !is_installed("ip") {
        return;
    }
    let (folder, page) = (folder(), page("docs/drives.md"));
    let hall =
        blocks(&page, "toml")[0].replace("/dev/serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0", "./stalls");
    std::fs::write(folder.path().join("hall.toml"), hall).expect("it is ours");
    let named = page.split('`').skip(1).step_by(2).filter(|code| code.starts_with("kinocue "));
    let named = named.filter(|code| code.contains("hall.toml") || code.contains("register list"));
    let all = named.chain(blocks(&page, "sh").into_iter().flat_map(commands));
    // Of a bus that this machine may not have.
    let (sims, others): (Vec<_>, Vec<_>) = all
        .filter(|command| command.starts_with("kinocue "))
        .partition(|command| command.starts_with("kinocue sim"));
    assert!(sims.len() >= 5 && others.len() >= 8, "{sims:?} {others:?}");
    let mut script = "ip link set lo up\nkinocue sim --dialect silvermax --tty ./stalls --units 16,17,18 --baud 115200 >beside.log 2>&1 & beside=$!\n\
        until grep -q ready beside.log; do sleep 0.1; done\n"
        .to_owned();
    others.iter().for_each(|command| script += &step(command, 60, command));
    script += "kill -TERM $beside; wait $beside\n";
    sims.iter().for_each(|command| script += &step(&format!("exec {command}"), 3, "sim"));
    run(folder.path(), &script);
    let (ended, said) = (read(folder.path(), "ended.log"), read(folder.path(), "said.log"));
    assert_eq!(ended.lines().count(), sims.len() + others.len(), "{ended}{said}");
    for line in ended.lines() {
        // What is not home fails preflight, and is not played to.
        let is_well = match line.split_once(' ') {
            Some((code, command)) if command.contains(" preflight ") => code == "1",
            Some((code, command)) if command.contains(" play ") => code == "75",
            Some((code, _)) => code == "0",
            None => false,
        };
        assert!(is_well, "{line}\n{said}");
    }
}

#[test]
fn every_example_of_every_help_page_runs_as_it_stands() {
    if !is_installed("unshare") || !is_installed("ip") {
        return;
    }
    let folder = folder();
    let (script, all) = script();
    let ran = run(folder.path(), &script);
    let read = |name: &str| read(folder.path(), name);
    let (ended, said) = (read("ended.log"), read("said.log"));
    assert_eq!(ended.lines().count(), all.len(), "{ran:?}\n{}\n{said}", read("beside.log"));
    // A hall may be in another state than an example needs; what runs for long was ended; a verdict on machine or hall is none here.
    // The hall of a rehearsal follows no film.
    let verdicts = ["1 doctor", "1 preflight", "66 sync"];
    let is_well = |code: &str| {
        ["0 ", "75 ", "130 "].iter().any(|well| code.starts_with(well)) || verdicts.contains(&code)
    };
    let failed: Vec<_> = ended.lines().zip(&all).filter(|(code, _)| !is_well(code)).collect();
    assert!(failed.is_empty(), "{failed:#?}\n{said}");
}
