//! One datagram for all controllers of a network, over a bridge, each controller on a machine of its own; and somebody on it who is none
//! of them.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::process::ChildStderr;

use rustix::process::Signal;
use serde_json::Value;
use tempfile::TempDir;

use crate::hall::Turn;
use crate::net::Machine;
use crate::process::{Guarded, Run};

const SEATS: [u8; 3] = [2, 3, 4];
/// Somebody else's.
const STRANGER: u8 = 9;

/// A show machine and some others, each at a port of one bridge.
struct Town {
    dir: TempDir,
    show: Machine,
    hosts: Vec<Machine>,
    _turn: Turn,
}

struct Sim(Guarded, BufReader<ChildStderr>);

impl Sim {
    /// Ends it; gives what it counted.
    fn end(self) -> Value {
        self.0.signal(Signal::TERM);
        let Self(guarded, stderr) = self;
        let run = guarded.finish();
        drop(stderr);
        run.report_of(0)["controllers"][0].clone()
    }
}

impl Town {
    /// None where the machine refuses namespaces.
    fn open() -> Option<Self> {
        let turn = Turn::beside();
        let show = Machine::first()?;
        show.run("ip link add hub type bridge\nip address add 10.77.0.1/24 dev hub\nip link set hub up");
        let host = |last: &u8| {
            let host = show.beside();
            show.run(&format!(
                "ip link add port{last} type veth peer name far{last}\nip link set far{last} netns {}\nip link set port{last} master hub\n\
                 ip link set port{last} up",
                host.pid()
            ));
            host.run(&format!("ip address add 10.77.0.{last}/24 dev far{last}\nip link set far{last} up"));
            host
        };
        let hosts = SEATS.iter().chain([&STRANGER]).map(host).collect();
        Some(Self { dir: tempfile::tempdir().expect("a folder"), show, hosts, _turn: turn })
    }

    /// The virtual controller of an address, which hears broadcasts as it listens at any address of its machine.
    fn simulate(&self, last: u8) -> Sim {
        let place = SEATS.iter().chain([&STRANGER]).position(|one| *one == last).expect("it has a machine");
        self.simulate_at(place, last)
    }

    /// The same at the machine of that place, whose address it is.
    fn simulate_at(&self, place: usize, last: u8) -> Sim {
        let own = [10, 77, 0, last]
            .into_iter()
            .zip(0x10..)
            .map(|(octet, register)| format!("{register:x}={octet}"));
        let host =
            [10, 77, 0, 1].into_iter().zip(0x20..).map(|(octet, register)| format!("{register:x}={octet}"));
        let settings: Vec<String> = own.chain(host).collect();
        let mut args = vec!["sim", "--allow-lan", "--safe", "--json", "--listen", "0.0.0.0:7408"];
        args.extend(settings.iter().flat_map(|one| ["--pa", one]));
        let mut guarded = Guarded::start_by(&self.hosts[place].enter(), &args);
        let mut stderr = guarded.stderr();
        let mut line = String::new();
        stderr.read_line(&mut line).expect("text");
        assert!(line.starts_with("ready "), "{line}");
        Sim(guarded, stderr)
    }

    /// Datagrams that came to a machine so far.
    fn datagrams(&self, host: usize) -> u64 {
        let table = self.hosts[host].command("cat").arg("/proc/net/snmp").output().expect("it starts");
        let table = String::from_utf8(table.stdout).expect("text");
        let counts = table.lines().filter_map(|line| line.strip_prefix("Udp: ")).nth(1).expect("counts");
        counts.split(' ').next().and_then(|count| count.parse().ok()).expect("a count")
    }

    /// The machine of the stranger gets another address.
    fn disguise_stranger(&self, last: u8) {
        self.hosts[SEATS.len()].run(&format!(
            "ip address del 10.77.0.{STRANGER}/24 dev far{STRANGER}\nip address add 10.77.0.{last}/24 dev far{STRANGER}"
        ));
    }

    /// Waits until a show is under way: what is asked before it is far less.
    fn waits_for_the_show(&self) {
        while self.datagrams(0) < 200 {}
    }

    /// Begins to play so many seconds to the three seats.
    fn play(&self, seconds: u32) -> Guarded {
        self.play_with(seconds, "")
    }

    /// The same with more in the configuration.
    fn play_with(&self, seconds: u32, more: &str) -> Guarded {
        let (cue, config) = (self.dir.path().join("ride.csv"), self.dir.path().join("hall.toml"));
        let height = |ms: u32| (1.0 - (std::f64::consts::TAU * 0.4 * f64::from(ms) / 1e3).cos()) / 4.0;
        let rows = (0..=seconds * 20).map(|row| (50 * row, height(50 * row)));
        let rows: String = rows.map(|(ms, at)| format!("{ms},{at:.6},{at:.6},{at:.6}\n")).collect();
        fs::write(&cue, format!("# kinocue-csv: 1\ntime_ms,a1,a2,a3\n{rows}")).expect("the folder is ours");
        let mut text = "[show]\nrate_hz = 50\nbind = \"10.77.0.1:8410\"\n[broadcast.stalls]\nalone = true\nnetwork = \"10.77.0.0/24\"\n\
             [seat.bench3]\naxes = 3\nstroke_mm = 150.0\nlead_mm = 5.0\npulses_per_rev = 10000\nmax_velocity_mm_s = 240.0\n\
             max_acceleration_mm_s2 = 3000.0\nmax_jerk_mm_s3 = 60000.0\n"
            .to_owned();
        for last in SEATS {
            text += &format!(
                "[[controller]]\nname = \"A{last}\"\nseat = \"bench3\"\naddress = \"10.77.0.{last}:7408\"\n"
            );
        }
        text += more;
        fs::write(&config, text).expect("the folder is ours");
        let [cue, config] = [&cue, &config].map(|path| path.to_str().expect("text"));
        Guarded::start_by(&self.show.enter(), &["play", cue, "--config", config, "--json"])
    }
}

/// Ticks as one datagram, and as one for each.
fn ticks(report: &Value) -> [u64; 2] {
    ["together", "apart"].map(|key| report["broadcasts"][0][key].as_u64().expect("a count"))
}

#[track_caller]
fn report(run: &Run) -> Value {
    let report = run.report_of(0);
    for one in report["controllers"].as_array().expect("controllers") {
        let count = |key: &str| one[key].as_u64().expect("a count");
        assert_eq!(count("asked"), count("acked") + count("refused") + count("lost"), "{one}");
        assert_eq!((count("stray"), count("send_failed")), (0, 0), "{one}");
    }
    report
}

#[test]
fn seats_on_a_bridge_get_one_datagram_each_tick_and_every_ack_is_that_of_its_seat() {
    let Some(town) = Town::open() else { return };
    let sims: Vec<Sim> = SEATS.iter().map(|last| town.simulate(*last)).collect();
    let report = report(&town.play(8).finish());
    assert!(ticks(&report)[0] > 100, "{report:#}");
    for (sim, one) in sims.into_iter().zip(report["controllers"].as_array().expect("controllers")) {
        let outcome = sim.end();
        assert_eq!(outcome["motion"], one["sent"], "{outcome} {one}");
    }
}

#[test]
fn where_somebody_else_answers_a_broadcast_each_seat_gets_its_own_and_who_it_is_is_told() {
    let Some(town) = Town::open() else { return };
    let sims: Vec<Sim> = SEATS.iter().chain([&STRANGER]).map(|last| town.simulate(*last)).collect();
    let mut play = town.play(3);
    let stderr = play.stderr();
    let report = report(&play.finish());
    assert_eq!(ticks(&report)[0], 0, "{report:#}");
    let told = report["broadcasts"][0]["not_now"].as_str().expect("a reason");
    assert!(told.contains("10.77.0.9:7408 is no controller that this hall plays"), "{told}");
    let said: Vec<String> = stderr.lines().map_while(Result::ok).collect();
    assert!(said.iter().any(|line| line.contains("10.77.0.9") && line.contains("find it")), "{said:#?}");
    let moves: Vec<Value> = sims.into_iter().map(Sim::end).collect();
    assert_eq!(moves[3]["motion"], 0, "no frame of motion reached it: {}", moves[3]);
}

#[test]
fn somebody_who_comes_onto_the_network_in_mid_show_ends_it_with_the_first_answer() {
    let Some(town) = Town::open() else { return };
    let _sims: Vec<Sim> = SEATS.iter().map(|last| town.simulate(*last)).collect();
    let play = town.play(12);
    town.waits_for_the_show();
    let stranger = town.simulate(STRANGER);
    let report = report(&play.finish());
    let [together, apart] = ticks(&report);
    let reached = stranger.end()["motion"].as_u64().expect("a count");
    println!(
        "{together} as one, {apart} as one for each, {reached} frames reached a stranger before it was heard"
    );
    assert!(together > 20 && apart > 100 && reached >= 1, "{report:#}");
    // A tick or two; a busy machine reads later.
    assert!(reached < 50, "{reached}");
    assert!(
        report["broadcasts"][0]["not_now"].as_str().is_some_and(|why| why.contains("10.77.0.9")),
        "{report:#}"
    );
}

fn not_now(report: &Value) -> &str {
    report["broadcasts"][0]["not_now"].as_str().unwrap_or("")
}

#[test]
fn a_second_controller_with_the_address_of_one_is_found_before_anything_goes_to_both() {
    let Some(town) = Town::open() else { return };
    town.disguise_stranger(3);
    let sims: Vec<Sim> = SEATS.iter().map(|last| town.simulate(*last)).collect();
    let second = town.simulate_at(SEATS.len(), 3);
    let mut play = town.play(3);
    let stderr = play.stderr();
    let run = play.finish();
    let report = run.report();
    assert_eq!(ticks(&report)[0], 0, "{report:#}");
    assert!(not_now(&report).contains("two answer as A3 (10.77.0.3:7408)"), "{report:#}");
    let said: Vec<String> = stderr.lines().map_while(Result::ok).collect();
    assert!(
        said.iter().any(|line| line.contains("10.77.0.3:7408") && line.contains("find the second")),
        "{said:#?}"
    );
    // What goes to the address alone reaches one of them.
    let [one, other] = [sims.into_iter().nth(1).expect("three").end(), second.end()];
    let moves = [&one, &other].map(|sim| sim["motion"].as_u64().expect("a count"));
    assert!(moves.contains(&0), "{moves:?}");
}

#[test]
fn a_second_controller_with_the_address_of_one_that_comes_in_mid_show_ends_it_with_its_first_ack() {
    let Some(town) = Town::open() else { return };
    town.disguise_stranger(3);
    town.hosts[SEATS.len()].run("ip link set far9 down");
    let _sims: Vec<Sim> = SEATS.iter().map(|last| town.simulate(*last)).collect();
    let second = town.simulate_at(SEATS.len(), 3);
    let play = town.play(12);
    town.waits_for_the_show();
    town.hosts[SEATS.len()].run("ip link set far9 up");
    let report = play.finish().report();
    let reached = second.end()["motion"].as_u64().expect("a count");
    println!("{:?}: {reached} frames reached the second", ticks(&report));
    assert!(
        ticks(&report)[0] > 20 && not_now(&report).contains("two answer as A3 (10.77.0.3:7408)"),
        "{report:#}"
    );
}

#[test]
fn a_seat_that_is_disabled_is_reached_by_nothing_though_it_is_on_the_wire() {
    let Some(town) = Town::open() else { return };
    let sims: Vec<Sim> = SEATS.iter().chain([&STRANGER]).map(|last| town.simulate(*last)).collect();
    let disabled =
        "[[controller]]\nname = \"A9\"\nseat = \"bench3\"\naddress = \"10.77.0.9:7408\"\nenabled = false\n";
    let report = report(&town.play_with(3, disabled).finish());
    assert_eq!(ticks(&report)[0], 0, "{report:#}");
    assert!(not_now(&report).contains("disabled"), "{report:#}");
    let moves: Vec<Value> = sims.into_iter().map(Sim::end).collect();
    assert_eq!(moves[3]["motion"], 0, "{}", moves[3]);
}

#[test]
fn a_plug_that_is_moved_to_another_network_in_mid_show_ends_it_within_some_frames() {
    let Some(town) = Town::open() else { return };
    town.show.run(&format!("ip link set port{STRANGER} nomaster"));
    let _sims: Vec<Sim> = SEATS.iter().map(|last| town.simulate(*last)).collect();
    let stranger = town.simulate(STRANGER);
    let play = town.play(12);
    town.waits_for_the_show();
    town.show.run(&format!("ip link set port3 nomaster\nip link set port{STRANGER} master hub"));
    let report = play.finish().report();
    let reached = stranger.end()["motion"].as_u64().expect("a count");
    println!("{:?}: {reached} frames reached a stranger", ticks(&report));
    assert!(ticks(&report)[0] > 20 && reached < 50, "{reached}: {report:#}");
}
