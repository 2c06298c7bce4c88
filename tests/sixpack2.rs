//! `kinocue sim --dialect sixpack2`: the program, over a pseudo-terminal.

#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "common/process.rs"]
mod process;

use std::fs::File;
use std::io::{BufRead as _, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::os::unix::net::UnixStream;

use process::{Guarded, kinocue};
use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::Signal;
use rustix::time::Timespec;

/// What a line answers to octets: nine.
fn exchange(mut line: &File, octets: [u8; 9]) -> [u8; 9] {
    line.write_all(&octets).expect("it takes octets");
    let (mut answer, mut count) = ([0; 9], 0);
    while count < answer.len() {
        let mut polled = [PollFd::new(line, PollFlags::IN)];
        let patience = Timespec { tv_sec: 10, tv_nsec: 0 };
        assert_eq!(poll(&mut polled, Some(&patience)), Ok(1), "an answer in time: {answer:?}");
        count += line.read(&mut answer[count..]).expect("octets");
    }
    answer
}

#[test]
fn the_program_runs_a_unit_on_a_line_lets_things_happen_to_it_and_says_what_became_of_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, socket) = (folder.path().join("stalls"), folder.path().join("sim.sock"));
    let (tty, control) = (path.to_str().expect("text"), socket.to_str().expect("text"));
    let mut sim = Guarded::start(&[
        "sim",
        "--dialect",
        "sixpack2",
        "--tty",
        tty,
        "--seed",
        "1",
        "--control",
        control,
        "--faults",
        "jump=100, volts=51, blocked2=1",
        "--json",
    ]);
    let mut stderr = sim.stderr();
    let mut ready = String::new();
    stderr.read_line(&mut ready).expect("text");
    assert_eq!(ready, format!("ready {tty}\n"));
    let line = File::options().read(true).write(true).custom_flags(libc::O_NOCTTY).open(&path);
    let line = line.expect("the link leads to it");
    let unit = [1, 0x43, 2, 0, 0, 0, 0, 0, 0];
    assert_eq!(exchange(&line, unit), [2, 0x43, 148, 1, 30, 0xe9, 3, 0, 0]);
    assert_eq!(exchange(&line, unit)[3], 0, "the reset is told once");
    assert_eq!(exchange(&line, [1, 0x30, 7, 2, 0, 0, 0, 0, 0])[3..5], u16::to_le_bytes(51 * 22));
    (&line).write_all(&[1, 0x24, 0, 0x40, 0x1f, 0, 0, 0, 0]).expect("it takes octets");
    let position = || {
        let [_, _, _, a, b, c, d, action, _] = exchange(&line, [1, 0x20, 0, 2, 0, 0, 0, 0, 0]);
        (i32::from_le_bytes([a, b, c, d]), action)
    };
    assert!((0..1_000).any(|_| position() >= (7_990, 10)), "{:?}", position());
    let control = UnixStream::connect(&socket).expect("it listens");
    let mut answers = std::io::BufReader::new(&control).lines();
    let mut command = |text: &str| {
        writeln!(&control, "{text}").expect("it takes lines");
        answers.next().expect("an answer").expect("text")
    };
    assert_eq!(command("1@reset"), "ok");
    assert_eq!(command("1@blocked6=1"), "error \"6\" is not a motor; they are 0 to 5");
    assert_eq!(command("2@reset"), "error there is no unit 2; the line has [1]");
    assert_eq!(exchange(&line, unit)[3], 1, "it was reset");
    assert_eq!(position(), (0, 0));
    sim.signal(Signal::TERM);
    let report = sim.finish().report_of(0);
    let unit = &report["units"][0];
    assert_eq!((&unit["unit"], &unit["unknown"], &unit["stray_octets"]), (&1.into(), &0.into(), &0.into()));
    let executed = &unit["motors"][0]["executed"];
    assert!(executed["lost"].as_f64() > Some(7_000.0), "it cannot jump: {executed}");
    assert!(!path.is_symlink() && !socket.exists());
}

#[test]
fn what_means_nothing_to_a_sixpack_2_is_refused_with_64() {
    for wrong in [
        &["--dialect", "sixpack2"][..],
        &["--dialect", "sixpack2", "--tty", "./never", "--baud", "57600"],
        &["--dialect", "sixpack2", "--tty", "./never", "--axes", "3"],
        &["--dialect", "sixpack2", "--tty", "./never", "--faults", "jump=-1"],
        &["--dialect", "sixpack2", "--tty", "./never", "--faults", "hot=1"],
        &["--dialect", "sixpack2", "--tty", "./never", "--script", "1:2@reset"],
    ] {
        let run = kinocue(&[&["sim"], wrong].concat());
        assert_eq!(run.code, Some(64), "{wrong:?}: {}", run.stderr);
    }
}
