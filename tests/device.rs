//! Registers and homing over real sockets of 127.0.0.1, in the library and as the program.

#[path = "common/said.rs"]
mod said;

use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use assert_cmd::Command;
use kinocue::harness::config::{Controller, Station, from_to_args};
use kinocue::harness::device::{Address, Patience, Talk, reads, table};
use kinocue::harness::sim::{Farm, Options, Setup};
use kinocue::wire::Dialect;
use said::Said;

const LOOPBACK: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0);

/// Virtual controllers that take frames from any port.
fn farm(setups: Vec<Setup>) -> Farm {
    let setups = setups.into_iter().map(|setup| Setup { host_port: 0, ..setup }).collect();
    Farm::start(Options::loopback(setups)).expect("free ports")
}

/// Runs the program on all controllers of a farm, named c1, c2 …
fn run(farm: &Farm, args: &[&str]) -> Said {
    let tos = farm.addresses().into_iter().flat_map(|address| ["--to".to_owned(), address.to_string()]);
    said(args, tos.collect())
}

fn said(args: &[&str], more: Vec<String>) -> Said {
    let mut command = Command::cargo_bin("kinocue").expect("it is built");
    let output = command.args(args).args(more).args(["--bind", "127.0.0.1:0"]).output().expect("it runs");
    Said::of(output)
}

fn controllers(farm: &Farm) -> Vec<Controller<Station>> {
    let tos: Vec<_> = farm.addresses().iter().map(ToString::to_string).collect();
    from_to_args(&tos, &[], 12).expect("addresses").stations()
}

#[test]
#[expect(clippy::disallowed_methods, reason = "it is the wall clock that people wait by")]
fn sixty_four_controllers_of_which_eight_are_dead_tell_all_they_hold_in_well_under_ten_seconds() {
    let setups = (0..64).map(|n| Setup { mute: n % 8 == 0, ..Setup::default() }).collect();
    let farm = farm(setups);
    let mut talk = Talk::open(LOOPBACK, &controllers(&farm)).expect("a free port");
    let addresses: Vec<Address> = table().of(Dialect::Smc).map(|register| register.address).collect();
    let reads = reads(&addresses);
    let requests = (0..64).flat_map(|lane| reads.iter().map(move |read| (lane, read.clone()))).collect();
    let begun = Instant::now();
    let outcomes = talk.ask(requests, Patience::default());
    assert!(begun.elapsed() < Duration::from_secs(8), "{:?}", begun.elapsed());
    for outcome in outcomes {
        assert_eq!(outcome.result.is_err(), outcome.lane % 8 == 0, "{}: {:?}", outcome.lane, outcome.result);
    }
}

#[test]
fn registers_are_read_as_a_table_or_as_json() {
    let farm = farm(vec![Setup { parameters: vec![(0x95, 6), (0x91, 2)], ..Setup::default() }; 2]);
    let said = run(&farm, &["register", "read", "PA95", "pa", "0x91", "dp", "06..0b", "dpf0"]);
    assert_eq!(said.exit, 0, "{}", said.err);
    assert!(said.out.contains("axis offset") && said.out.contains("holds until a reset"), "{}", said.out);
    let json = run(&farm, &["register", "read", "axis-offset", "--json"]).json();
    assert_eq!(json["controllers"][1]["name"], "c2");
    assert_eq!(json["controllers"][1]["registers"][0]["register"], "PA95");
    assert_eq!(json["controllers"][1]["registers"][0]["value"], 6);
}

#[test]
fn a_write_shows_the_change_and_needs_a_yes_and_is_read_back() {
    let farm = farm(vec![Setup::default()]);
    let unasked = run(&farm, &["register", "write", "PA95=6"]);
    assert_eq!(unasked.exit, 64);
    assert!(unasked.err.contains("PA95") && unasked.err.contains("--yes"), "{}", unasked.err);
    let json = run(&farm, &["register", "read", "PA95", "--json"]).json();
    assert_eq!(json["controllers"][0]["registers"][0]["value"], 0, "nothing was written");

    let written = run(&farm, &["register", "write", "PA95=6", "--yes", "--json"]);
    assert_eq!(written.exit, 0, "{}", written.err);
    let change = &written.json()["controllers"][0]["changes"][0];
    assert_eq!(
        (change["old"].as_u64(), change["new"].as_u64(), change["reads"].as_u64()),
        (Some(0), Some(6), Some(6))
    );
    let again = run(&farm, &["register", "write", "PA95=6"]);
    assert_eq!(
        (again.exit, again.err.as_str()),
        (0, "nothing to change: all registers already have these values\n")
    );
}

#[test]
fn what_must_not_be_written_is_refused_before_anything_is_sent() {
    let farm = farm(vec![Setup::default()]);
    for (given, told) in [
        ("PA95=12", "PA95=12 is outside 0..=11"),
        ("PA14=7409", "network setting"),
        ("PA24=9000", "--force"),
        ("PA0f=1", "--force"),
        ("DP06=1", "measured"),
        ("PA99=1", "in neither manual"),
        ("PA95=x", "whole number"),
    ] {
        let said = run(&farm, &["register", "write", given, "--yes"]);
        assert_eq!(said.exit, 64, "{given}: {}", said.err);
        assert!(said.err.contains(told) && said.err.lines().count() == 1, "{given}: {}", said.err);
    }
    let outcome = farm.stop().expect("no log to fail").remove(0);
    assert_eq!(outcome.counts.received, 0);
}

#[test]
fn where_one_register_is_refused_none_is_written() {
    let farm = farm(vec![Setup::default(); 2]);
    let said = run(&farm, &["register", "write", "PA95=1", "servo", "9", "508=7", "--yes"]);
    assert_eq!(said.exit, 76, "{}", said.err);
    assert!(
        said.err.contains("c2: cannot read servo 9 508") && said.err.contains("nothing written"),
        "{}",
        said.err
    );
    let json = run(&farm, &["register", "read", "PA95", "--json"]).json();
    assert_eq!(json["controllers"][1]["registers"][0]["value"], 0);
}

#[test]
fn an_address_is_never_given_to_two_controllers() {
    let farm = farm(vec![Setup::default(); 2]);
    let said = run(&farm, &["register", "write", "PA13=7", "--yes", "--force"]);
    assert_eq!(said.exit, 64);
    assert!(said.err.contains("one controller at a time"), "{}", said.err);
}

#[test]
fn names_and_rows_choose_controllers_of_a_configuration() {
    let farm = farm(vec![Setup::default(); 3]);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("hall.toml");
    let mut text = String::from(
        "[seat.s]\naxes = 3\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\n\
         max_velocity_mm_s = 240.0\nmax_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n",
    );
    for ((name, row), address) in [("A1", "A"), ("A2", "A"), ("B1", "B")].into_iter().zip(farm.addresses()) {
        text += &format!(
            "[[controller]]\nname = \"{name}\"\nrow = \"{row}\"\nseat = \"s\"\naddress = \"{address}\"\n"
        );
    }
    std::fs::write(&file, text).expect("a file");
    let config = file.to_str().expect("text");
    let chosen = |more: &[&str]| {
        let args = [&["register", "read", "PA02", "--json", "--config", config], more].concat();
        let said = said(&args, vec![]);
        assert_eq!(said.exit, 0, "{}", said.err);
        let json = said.json();
        let names = json["controllers"].as_array().expect("an array").iter();
        names.filter_map(|one| one["name"].as_str().map(str::to_owned)).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(chosen(&[]), "A1 A2 B1");
    assert_eq!(chosen(&["--row", "A"]), "A1 A2");
    assert_eq!(chosen(&["--name", "B1"]), "B1");
    let unknown = said(&["register", "read", "PA02", "--config", config, "--row", "C"], vec![]);
    assert_eq!((unknown.exit, unknown.err.as_str()), (66, "kinocue: there is no row C; there are: A, B\n"));
}

#[test]
fn settings_are_kept_over_a_power_cycle_where_that_is_asked_for() {
    for dialect in [Dialect::Smc, Dialect::Mbox] {
        let farm = farm(vec![Setup { dialect, ..Setup::default() }]);
        let name = if dialect == Dialect::Smc { "smc" } else { "mbox" };
        let to = format!("{},dialect={name}", farm.addresses()[0]);
        let write = ["register", "write", "PA07=2500", "--yes", "--keep"];
        let said = said(&write, vec!["--to".to_owned(), to]);
        assert_eq!(said.exit, 0, "{}", said.err);
        assert!(said.err.contains("kept over a power cycle"), "{}", said.err);
    }
}

#[test]
fn a_settings_file_names_exactly_the_registers_in_which_another_controller_differs() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("settings.toml");
    let file = file.to_str().expect("text");
    let before = farm(vec![Setup::default()]);
    let saved = run(&before, &["register", "save", file]);
    assert_eq!(saved.exit, 0, "{}", saved.err);
    let same = run(&before, &["register", "diff", file]);
    assert_eq!(same.exit, 0, "{}{}", same.out, same.err);

    let parameters = vec![(0x07, 2_000), (0x55, 5), (0x92, 3)];
    let other = farm(vec![Setup { parameters, ..Setup::default() }]);
    let said = run(&other, &["register", "diff", file, "--json"]);
    assert_eq!(said.exit, 1, "{}", said.err);
    let json = said.json();
    let differences = json["controllers"][0]["differences"].as_array().expect("an array");
    let named: Vec<_> = differences.iter().filter_map(|one| one["register"].as_str()).collect();
    assert_eq!(named, ["PA07", "PA55", "PA92"]);

    let written = run(&other, &["register", "write", "--file", file, "--yes"]);
    assert_eq!(written.exit, 0, "{}", written.err);
    assert_eq!(run(&other, &["register", "diff", file]).exit, 0, "it has become the same");
}

#[test]
fn a_file_that_is_missing_or_no_settings_ends_in_words() {
    let farm = farm(vec![Setup::default()]);
    assert_eq!(run(&farm, &["register", "diff", "/nonexistent/settings.toml"]).exit, 66);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("odd.toml");
    std::fs::write(&file, "[show]\nrate_hz = 100\n").expect("a file");
    let said = run(&farm, &["register", "diff", file.to_str().expect("text")]);
    assert_eq!(said.exit, 78);
    assert!(said.err.contains("is not a settings file"), "{}", said.err);
}

#[test]
fn the_exit_code_tells_silence_from_refusal() {
    let dead = farm(vec![Setup { mute: true, ..Setup::default() }]);
    let said = run(&dead, &["register", "read", "PA95"]);
    assert_eq!((said.exit, said.err.lines().count()), (69, 1), "{}", said.err);
    let live = farm(vec![Setup::default()]);
    let refused = run(&live, &["register", "read", "servo", "9", "508"]);
    assert_eq!((refused.exit, refused.err.lines().count()), (76, 1), "{}", refused.err);
    assert_eq!(run(&live, &["register", "read", "PA999"]).exit, 64);
}

#[test]
fn while_another_program_holds_the_port_register_and_home_say_so_and_end_with_75() {
    let farm = farm(vec![Setup::default()]);
    let holder = UdpSocket::bind(LOOPBACK).expect("a free port");
    let held = holder.local_addr().expect("it is bound").to_string();
    let to = farm.addresses()[0].to_string();
    for args in [&["register", "read", "PA95"][..], &["home", "--seats-empty"]] {
        let mut command = Command::cargo_bin("kinocue").expect("it is built");
        let output = command.args(args).args(["--to", &to, "--bind", &held]).output().expect("it runs");
        let err = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(75), "{err}");
        assert!(err.contains("frame port") && err.contains("another program holds"), "{err}");
    }
}

#[test]
fn homing_waits_until_every_seat_is_home_and_says_what_pa0e_does() {
    let farm = farm(vec![Setup::default(), Setup { parameters: vec![(0x0e, 1)], ..Setup::default() }]);
    let said = run(&farm, &["home", "--seats-empty"]);
    assert_eq!(said.exit, 0, "{}", said.err);
    for line in [
        "c1: PA0e = 0: searches zero",
        "c2: PA0e = 1: goes to zero without a search",
        "c1: home after",
        "c2: home after",
    ] {
        assert!(said.err.contains(line), "{line}: {}", said.err);
    }
}

#[test]
fn nobody_is_moved_without_a_word_that_the_seats_are_empty() {
    let farm = farm(vec![Setup::default()]);
    let said = run(&farm, &["home"]);
    assert_eq!(said.exit, 64);
    assert!(said.err.contains("--seats-empty"), "{}", said.err);
    assert_eq!(run(&farm, &["home", "nobody", "--seats-empty"]).exit, 66);
    let outcome = farm.stop().expect("no log to fail").remove(0);
    assert_eq!(outcome.counts.received, 0);
}

#[test]
fn a_seat_in_emergency_stop_does_not_home_and_says_so() {
    let farm = farm(vec![Setup { estop_at: Some(Duration::ZERO), ..Setup::default() }]);
    let said = run(&farm, &["home", "--seats-empty"]);
    assert_eq!(said.exit, 76, "{}", said.err);
    assert!(said.err.contains("cannot home: an emergency stop is in effect (x = 4)"), "{}", said.err);
    let outcome = farm.stop().expect("no log to fail").remove(0);
    assert_eq!(outcome.counts.received, 1, "it was asked how it is, and not told to move");
}

#[test]
fn homing_as_json_tells_of_each_seat() {
    let farm = farm(vec![Setup::default(), Setup { mute: true, ..Setup::default() }]);
    let said = run(&farm, &["home", "--seats-empty", "--json"]);
    assert_eq!(said.exit, 69, "{}", said.err);
    let json = said.json();
    assert_eq!(json["controllers"][0]["home"], true);
    assert!(json["controllers"][0]["seconds"].as_f64().is_some_and(|s| s >= 0.5), "{json}");
    assert!(
        json["controllers"][1]["fault"].as_str().is_some_and(|line| line.contains("no answer")),
        "{json}"
    );
}

/// Asks a controller something every few milliseconds, as whoever plays to it sends, until this is dropped.
struct OtherMaster(Option<(Sender<()>, JoinHandle<()>)>);

impl OtherMaster {
    fn of(farm: &Farm) -> Self {
        let (end, ended) = channel::<()>();
        let mut talk = Talk::open(LOOPBACK, &controllers(farm)).expect("a free port");
        let question = reads(&[Address::Pa(0x95)]).remove(0);
        let sending = move || {
            while ended.recv_timeout(Duration::from_millis(10)) == Err(RecvTimeoutError::Timeout) {
                talk.ask(vec![(0, question.clone())], Patience::default());
            }
        };
        Self(Some((end, thread::spawn(sending))))
    }
}

impl Drop for OtherMaster {
    fn drop(&mut self) {
        if let Some((end, sending)) = self.0.take() {
            drop(end);
            sending.join().expect("it ends");
        }
    }
}

#[test]
fn seats_that_another_machine_plays_to_are_neither_homed_nor_written_to() {
    let farm = farm(vec![Setup::default()]);
    let master = OtherMaster::of(&farm);
    for args in [&["home", "--seats-empty"][..], &["register", "write", "PA95=6", "--yes"], &["latency"]] {
        let said = run(&farm, args);
        assert_eq!(said.exit, 79, "{args:?}: {}", said.err);
        assert!(said.err.contains("datagrams (DP34) that were not sent from here"), "{}", said.err);
        assert!(!said.err.contains("has begun"), "{}", said.err);
    }
    drop(master);
    assert_eq!(run(&farm, &["home", "--seats-empty"]).exit, 0, "it is alone now");
}
