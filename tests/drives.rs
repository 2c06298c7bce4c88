//! Seats with serial drives: `kinocue home`, over pseudo-terminals to simulated units.

#[expect(dead_code, reason = "shared with tests that need more of it")]
#[path = "common/process.rs"]
mod process;

use std::fs;
use std::io::BufRead as _;
use std::path::Path;

use process::{Guarded, Sim, kinocue};
use rustix::process::Signal;

/// A hall with one seat of three axes, on the line at `port`, at a rate that is left where the other end answers late, on a busy machine.
fn hall(folder: &Path, port: &Path, dialect: &str) -> String {
    write(folder, &format!("[show]\nbind = \"127.0.0.1:0\"\n{}", seat_of("A1", port, dialect, 5)))
}

/// Writes a hall, and says where.
fn write(folder: &Path, text: &str) -> String {
    let path = folder.join("hall.toml");
    fs::write(&path, text).expect("a file");
    path.to_str().expect("text").to_owned()
}

/// A link that plays so many times a second, and a seat on it.
fn seat_of(name: &str, port: &Path, dialect: &str, rate_hz: u32) -> String {
    let units = if dialect == "silvermax" { "units = [16, 17, 18]" } else { "unit = 1\nmotors = [0, 1, 2]" };
    format!(
        r#"
[link.of_{name}]
port = "{}"
baud = {}
rate_hz = {rate_hz}

[seat.of_{name}]
axes = 3
stroke_mm = 150.0
lead_mm = 5.0
pulses_per_rev = 4000
max_velocity_mm_s = 160.0
max_acceleration_mm_s2 = 3000.0
max_jerk_mm_s3 = 60000.0

[seat.of_{name}.drive]
home = {{ way = "switch", {} toward = "down", speed_mm_s = 40, travel_mm = 165, zero_mm = -2.0 }}
torque = {{ hold = "60%", move = "100%", full = 20000 }}
current = {{ peak = 238 }}
clock_divider = 3

[[controller]]
name = "{name}"
seat = "of_{name}"
address = "link:of_{name}"
dialect = "{dialect}"
{units}
"#,
        port.display(),
        if dialect == "silvermax" { 57_600 } else { 56_818 },
        if dialect == "silvermax" { "input = 1, active = \"high\"," } else { "" },
    )
}

/// What `kinocue home` says as JSON, what else it says, and how it ends.
fn home(hall: &str) -> (serde_json::Value, String, Option<i32>) {
    let run = kinocue(&["home", "--config", hall, "--seats-empty", "--json"]);
    (serde_json::from_str(&run.stdout).expect("JSON"), run.stderr, run.code)
}

/// Virtual units, at the end of that line.
fn units(port: &Path, dialect: &str) -> Guarded {
    let tty = port.to_str().expect("text");
    let numbers = if dialect == "silvermax" { "16,17,18" } else { "1" };
    let sim = ["sim", "--dialect", dialect, "--tty", tty, "--units", numbers, "--seed", "1", "--json"];
    let mut sim = Guarded::start(&sim);
    let mut ready = String::new();
    sim.stderr().read_line(&mut ready).expect("text");
    assert_eq!(ready, format!("ready {tty}\n"));
    sim
}

/// A hall with virtual units.
struct Bench {
    hall: String,
    sim: Guarded,
    folder: tempfile::TempDir,
}

impl Bench {
    fn of(dialect: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let port = folder.path().join("stalls");
        let sim = units(&port, dialect);
        Self { hall: hall(folder.path(), &port, dialect), sim, folder }
    }
}

/// What the first unit says of itself once Ctrl-C has ended the search of its first axis.
fn stopped_in_its_search(dialect: &str) -> serde_json::Value {
    let Bench { hall, sim, folder: _folder } = Bench::of(dialect);
    let mut homing = Guarded::start(&["home", "--config", &hall, "--seats-empty"]);
    let mut said = homing.stderr().lines().map(|line| line.expect("text"));
    assert!(said.any(|line| line == "A1: axis 1 searches for its zero"));
    homing.signal(Signal::INT);
    assert!(said.any(|line| line.ends_with("homing was stopped; the seat is not home")));
    assert_eq!(homing.finish().code, Some(130));
    sim.signal(Signal::TERM);
    sim.finish().report_of(0)["units"][0].clone()
}

#[test]
fn a_seat_on_silvermax_units_is_homed_and_homed_again() {
    let Bench { hall, sim, folder: _folder } = Bench::of("silvermax");
    for time in ["from anywhere", "from park"] {
        let (told, said, exit) = home(&hall);
        assert_eq!(exit, Some(0), "{time}: {said}");
        let seat = &told["controllers"][0];
        assert_eq!(
            (&seat["name"], &seat["address"], &seat["home"]),
            (&"A1".into(), &"link:of_A1".into(), &true.into())
        );
        assert!(
            said.contains("A1: units 16, 17, 18 on link of_A1 look for their switch, down, at 40 mm/s"),
            "{said}"
        );
        assert!(said.contains("A1: axis 3 has found its zero") && said.contains("A1: home after"), "{said}");
    }
    sim.signal(Signal::TERM);
    let counts = sim.finish().report_of(0);
    for unit in counts["units"].as_array().expect("a list") {
        assert_eq!((&unit["kills"], &unit["position"]), (&0.into(), &0.into()), "{counts}");
    }
}

/// Two seconds of a gentle ride, in mm.
fn cue(folder: &Path) -> String {
    let mut text = "# kinocue-csv: 1\n# units: mm\ntime_ms,a1,a2,a3\n".to_owned();
    for row in 0..=100_u32 {
        let up = 20.0 * (1.0 - (std::f64::consts::TAU * f64::from(row) / 100.0).cos());
        text += &format!("{},{up:.3},{up:.3},{up:.3}\n", 20 * row);
    }
    let path = folder.join("gentle.csv");
    fs::write(&path, text).expect("a file");
    path.to_str().expect("text").to_owned()
}

/// Plays a cue; how it ended, what was reported and said.
fn play(cue: &str, hall: &str) -> (Option<i32>, serde_json::Value, String) {
    let run = kinocue(&["play", cue, "--config", hall, "--json"]);
    (run.code, serde_json::from_str(&run.stdout).unwrap_or_default(), run.stderr)
}

/// That a play was completed with each frame of each controller acked.
fn assert_whole((code, report, said): &(Option<i32>, serde_json::Value, String), controllers: usize) {
    assert_eq!((code, &report["result"]), (&Some(0), &"completed".into()), "{said} {report}");
    let all = report["controllers"].as_array().expect("a list");
    let whole = all.iter().filter(|one| one["sent"].as_u64() > Some(200) && one["acked"] == one["sent"]);
    assert_eq!((whole.count(), all.len()), (controllers, controllers), "{report}");
}

/// Where the counter of a SIXpack 2 may be at the lower end of the stroke: where is a matter of all its settings.
const AT_LOW: std::ops::RangeInclusive<i64> = 999_980..=7_000_020;

/// That its axes rode the cue, and are back: SilverMax units, or the first motors of a SIXpack 2.
fn assert_rode(sim: Guarded) {
    sim.signal(Signal::TERM);
    let ended = sim.finish().report_of(0);
    let units = ended["units"].as_array().expect("a list");
    // A motor of a SIXpack 2 jumps to each new speed, by no more than `jump_mm_s`.
    let (axes, parks, jump): (Vec<_>, _, _) = match units[0]["motors"].as_array() {
        Some(motors) => (motors[..3].iter().collect(), AT_LOW, 30.0),
        None => (units.iter().collect(), -20..=20, 0.0),
    };
    assert_eq!(axes.len(), 3);
    for axis in axes {
        // Homing is slower: 20 mm up and down in 2 s are 62.8 mm/s at the most.
        let velocity = axis["executed"]["velocity_per_s"].as_f64().expect("a number") / 800.0;
        assert!((61.3..64.3 + jump).contains(&velocity), "{velocity} mm/s: {axis}");
        assert!(parks.contains(&axis["position"].as_i64().expect("a number")), "beside park: {axis}");
        // Of a counter that begins anywhere it is the place that tells: -2 mm from the switch at -3,200.
        let is_beside = |place: f64| parks == AT_LOW && (place + 1_600.0).abs() >= 100.0;
        assert!(!axis["place"].as_f64().is_some_and(is_beside), "beside park: {axis}");
        for trouble in ["dry", "kills", "own_searches"] {
            assert!(axis[trouble].as_u64().is_none_or(|times| times == 0), "{trouble}: {axis}");
        }
    }
}

#[test]
fn a_cue_is_played_to_drives_that_are_home_with_an_ack_for_each_frame_and_to_no_others() {
    for (dialect, rate_hz) in [("silvermax", 20), ("sixpack2", 40)] {
        let folder = tempfile::tempdir().expect("a folder");
        let (port, cue) = (folder.path().join("stalls"), cue(folder.path()));
        let sim = units(&port, dialect);
        let link = seat_of("A1", &port, dialect, rate_hz);
        let hall = write(folder.path(), &format!("[show]\nbind = \"127.0.0.1:0\"\n{link}"));
        let (code, _, said) = play(&cue, &hall);
        assert!(said.contains("A1: does not report that it is home"), "{said}");
        assert_eq!(code, Some(75));
        assert_eq!(home(&hall).2, Some(0));
        assert_whole(&play(&cue, &hall), 1);
        assert_rode(sim);
    }
}

#[test]
fn drives_that_never_answered_are_named_as_silent_and_not_as_not_home() {
    let dead = "16@dead=1, 17@dead=1, 18@dead=1";
    for (dialect, numbers, rate_hz, dead) in
        [("silvermax", "16,17,18", 20, dead), ("sixpack2", "1", 40, "1@dead=1")]
    {
        let folder = tempfile::tempdir().expect("a folder");
        let port = folder.path().join("stalls");
        let tty = port.to_str().expect("text");
        let sim = ["sim", "--dialect", dialect, "--tty", tty, "--units", numbers, "--faults", dead];
        let mut sim = Guarded::start(&sim);
        let mut ready = String::new();
        sim.stderr().read_line(&mut ready).expect("text");
        let link = seat_of("A1", &port, dialect, rate_hz);
        let hall = write(folder.path(), &format!("[show]\nbind = \"127.0.0.1:0\"\n{link}"));
        let run = kinocue(&["play", &cue(folder.path()), "--config", &hall]);
        assert!(run.stderr.contains("A1: nobody answers, so nothing is played"), "{dialect}: {}", run.stderr);
        assert_eq!(run.code, Some(69), "{dialect}");
        sim.signal(Signal::TERM);
        sim.finish();
    }
}

#[test]
fn a_hall_of_both_families_and_a_controller_on_the_network_plays_one_cue() {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, other] = ["one", "other"].map(|name| folder.path().join(name));
    let (silvermax, sixpack2) = (units(&one, "silvermax"), units(&other, "sixpack2"));
    let controller = Sim::one(&["--safe"]);
    let text = format!(
        "[show]\nbind = \"127.0.0.1:0\"\n{}{}\n[[controller]]\nname = \"A3\"\nseat = \"of_A1\"\naddress = \"{}\"\n",
        seat_of("A1", &one, "silvermax", 20),
        seat_of("A2", &other, "sixpack2", 40),
        controller.addresses[0],
    );
    let hall = write(folder.path(), &text);
    let (told, said, exit) = home(&hall);
    assert_eq!(exit, Some(0), "{told}{said}");
    assert_whole(&play(&cue(folder.path()), &hall), 3);
    assert_rode(silvermax);
    assert_rode(sixpack2);
    let seen = controller.end();
    assert!(seen.rest_in_park() && seen.farthest(0) > 0);
}

#[test]
fn ctrl_c_brakes_the_axis_that_searches_and_the_seat_is_not_home() {
    let axis = stopped_in_its_search("silvermax");
    assert!(axis["executed"]["lowest"].as_f64() > Some(3_200.0), "it was braked before its switch: {axis}");
}

#[test]
fn a_port_that_is_not_there_is_told_with_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let hall = hall(folder.path(), &folder.path().join("none"), "silvermax");
    let (told, said, exit) = home(&hall);
    assert_eq!((exit, &told["controllers"][0]["home"]), (Some(69), &false.into()), "{said}");
    assert!(said.contains("there is no such port; plug the adapter in"), "{said}");
}

#[test]
fn a_seat_on_a_sixpack_that_woke_is_switched_homed_and_homed_again() {
    let Bench { hall, sim, folder: _folder } = Bench::of("sixpack2");
    for time in ["as it woke", "from park"] {
        let (told, said, exit) = home(&hall);
        assert_eq!(exit, Some(0), "{time}: {said}");
        assert_eq!(told["controllers"][0]["home"], true);
        assert!(
            said.contains(
                "A1: motors 0, 1, 2 of unit 1 on link of_A1 look for their switch, down, at 40 mm/s"
            ),
            "{said}"
        );
        assert!(said.contains("A1: axis 3 has found its zero") && said.contains("A1: home after"), "{said}");
    }
    sim.signal(Signal::TERM);
    let unit = sim.finish().report_of(0)["units"][0].clone();
    assert_eq!(
        (&unit["baud"], &unit["unknown"], &unit["settings_in_motion"]),
        (&56_818.into(), &0.into(), &0.into())
    );
    for motor in &unit["motors"].as_array().expect("a list")[..3] {
        let position = motor["position"].as_i64().expect("a number");
        assert!(AT_LOW.contains(&position) && motor["own_searches"] == 0, "{unit}");
        // The switch is at -3,200, and -2 mm of 800 microsteps.
        let place = motor["place"].as_f64().expect("a number");
        assert!((place + 1_600.0).abs() < 100.0, "{unit}");
    }
}

#[test]
fn ctrl_c_ends_the_search_of_a_motor_that_would_go_on_for_ever() {
    let motor = &stopped_in_its_search("sixpack2")["motors"][0];
    assert_eq!(motor["action"], 0, "{motor}");
    assert!(motor["executed"]["lowest"].as_f64() > Some(0.0), "it stands above its switch: {motor}");
}

#[test]
fn a_sixpack_that_is_not_there_is_told_with_what_to_do() {
    let Bench { hall, sim, folder: _folder } = Bench::of("sixpack2");
    let text = fs::read_to_string(&hall).expect("a file").replace("unit = 1", "unit = 7");
    fs::write(&hall, text).expect("a file");
    let (told, said, exit) = home(&hall);
    assert_eq!((exit, &told["controllers"][0]["home"]), (Some(69), &false.into()), "{said}");
    assert!(said.contains("unit 7 answers neither at 56818 nor at 19231 baud"), "{said}");
    sim.signal(Signal::TERM);
    assert_eq!(sim.finish().code, Some(0));
}

/// What `kinocue preflight` says of a hall as JSON, the checks that the seat A1 fails, and how it ends.
fn preflight(hall: &str) -> (serde_json::Value, Vec<String>, Option<i32>) {
    let run = kinocue(&["preflight", "--config", hall, "--json"]);
    let told: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
    let findings = told["controllers"][0]["findings"].as_array().expect("a list");
    let fails = findings.iter().filter(|one| one["severity"] == "fail");
    let fails = fails.map(|one| one["check"].as_str().expect("text").to_owned()).collect();
    (told, fails, run.code)
}

#[test]
fn preflight_passes_a_seat_once_it_is_homed_and_takes_one_that_was_never_for_not_home() {
    let Bench { hall, sim, folder: _folder } = Bench::of("silvermax");
    let (told, fails, exit) = preflight(&hall);
    assert_eq!((fails, exit), (vec!["not-home".to_owned()], Some(1)), "{told}");
    let text = kinocue(&["preflight", "--config", &hall]);
    assert!(
        text.stdout.contains("link:of_A1") && text.stdout.contains("home it, with nobody on the seat"),
        "{}",
        text.stdout
    );
    let (_, said, _) = home(&hall);
    let (told, fails, exit) = preflight(&hall);
    assert_eq!((fails, exit), (vec![], Some(0)), "{said}{told}");
    let registers = &told["controllers"][0]["registers"];
    assert_eq!((&registers["16.38"], &registers["18.39"]), (&(-800).into(), &120_800.into()), "{told}");
    sim.signal(Signal::TERM);
    let counts = sim.finish().report_of(0);
    assert!(counts["units"].as_array().is_some_and(|units| units.len() == 3), "{counts}");
}

#[test]
fn preflight_passes_a_seat_on_a_sixpack_once_it_is_homed_and_leaves_one_as_it_woke() {
    let Bench { hall, sim, folder: _folder } = Bench::of("sixpack2");
    for _ in 0..2 {
        let (told, fails, exit) = preflight(&hall);
        assert_eq!((fails, exit), (vec!["not-home".to_owned()], Some(1)), "as it woke: {told}");
    }
    assert_eq!(home(&hall).2, Some(0));
    let (told, fails, exit) = preflight(&hall);
    assert_eq!((fails, exit), (vec![], Some(0)), "{told}");
    let place = told["controllers"][0]["registers"]["1.motor2"].as_i64().expect("it was read");
    assert!(AT_LOW.contains(&place), "{told}");
    sim.signal(Signal::TERM);
    assert_eq!(sim.finish().code, Some(0));
}

#[test]
fn preflight_tells_a_unit_that_is_not_there_and_an_adapter_that_repeats_what_is_sent() {
    let folder = tempfile::tempdir().expect("a folder");
    let port = folder.path().join("stalls");
    let tty = port.to_str().expect("text");
    let mut sim = Guarded::start(&[
        "sim",
        "--dialect",
        "silvermax",
        "--tty",
        tty,
        "--units",
        "16,17",
        "--faults",
        "echo=1",
        "--json",
    ]);
    let mut ready = String::new();
    sim.stderr().read_line(&mut ready).expect("text");
    let (told, mut fails, exit) = preflight(&hall(folder.path(), &port, "silvermax"));
    fails.sort();
    assert_eq!(
        (fails, exit),
        (["echo-differs", "no-answer", "not-home"].map(str::to_owned).to_vec(), Some(1)),
        "{told}"
    );
    sim.signal(Signal::TERM);
    sim.finish();
}

#[test]
fn preflight_tells_a_port_that_is_missing_and_one_that_another_program_has() {
    let folder = tempfile::tempdir().expect("a folder");
    let port = folder.path().join("stalls");
    let hall = hall(folder.path(), &port, "silvermax");
    let (told, fails, exit) = preflight(&hall);
    assert_eq!((fails, exit), (vec!["port-missing".to_owned()], Some(69)), "{told}");
    let sim = units(&port, "silvermax");
    let mut homing = Guarded::start(&["home", "--config", &hall, "--seats-empty"]);
    let mut said = homing.stderr().lines().map(|line| line.expect("text"));
    assert!(said.any(|line| line == "A1: axis 1 searches for its zero"));
    let (told, fails, exit) = preflight(&hall);
    assert_eq!((fails, exit), (vec!["port-taken".to_owned()], Some(69)), "{told}");
    homing.signal(Signal::INT);
    assert!(said.any(|line| line.ends_with("the seat is not home")));
    homing.finish();
    sim.signal(Signal::TERM);
    sim.finish();
}

/// What `kinocue register` says of a hall: what it prints, what else it says, and how it ends.
fn register(args: &[&str], hall: &str) -> (String, String, Option<i32>) {
    let run = kinocue(&[&["register"], args, &["--config", hall]].concat());
    (run.stdout, run.stderr, run.code)
}

#[test]
fn registers_of_units_are_read_by_their_numbers_kept_and_compared_and_nothing_is_written() {
    let Bench { hall, sim, folder } = Bench::of("silvermax");
    assert_eq!(home(&hall).2, Some(0));
    let (text, said, exit) = register(&["read", "R38..40", "R1"], &hall);
    assert_eq!(exit, Some(0), "{said}");
    for words in ["16.R38", "lower soft limit", "-1.00 mm", "18.R39", "151.00 mm", "17.R1"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let file = folder.path().join("kept.toml");
    let file = file.to_str().expect("text");
    assert_eq!(register(&["save", file], &hall).2, Some(0));
    let (_, said, exit) = register(&["diff", file], &hall);
    assert_eq!((exit, said.contains("nothing differs")), (Some(0), true), "{said}");
    let kept = fs::read_to_string(file).expect("it was written");
    fs::write(file, kept.replace("\"17.R38\" = -800", "\"17.R38\" = -801")).expect("a file");
    let (text, said, exit) = register(&["diff", file], &hall);
    assert_eq!(exit, Some(1), "{said}");
    assert!(text.contains("17.R38") && text.contains("-801") && !text.contains("18.R38"), "{text}");
    sim.signal(Signal::TERM);
    let counts = sim.finish().report_of(0);
    assert!(counts["units"].as_array().is_some_and(|units| units.iter().all(|unit| unit["kills"] == 0)));
}

#[test]
fn a_sixpack_is_read_by_its_queries_and_its_settings_are_refused_by_name() {
    let Bench { hall, sim, folder } = Bench::of("sixpack2");
    let (_, said, exit) = register(&["read"], &hall);
    assert_eq!(exit, Some(69), "as it woke: {said}");
    assert!(said.contains("is at its power-on baud, 19,200; home it"), "{said}");
    assert_eq!(home(&hall).2, Some(0));
    let (text, said, exit) = register(&["read", "$20", "$43", "$30"], &hall);
    assert_eq!(exit, Some(0), "{said}");
    for words in ["1.$20.motor2.position", "1.$43.celsius", "1.$30.input7", " V"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let (_, said, exit) = register(&["read", "$15"], &hall);
    assert_eq!(exit, Some(64));
    assert!(said.contains("no command that reads its settings back"), "{said}");
    let (_, said, exit) = register(&["read", "R1"], &hall);
    assert_eq!(exit, Some(64));
    assert!(said.contains("none of these controllers has such registers"), "{said}");
    let file = folder.path().join("kept.toml");
    let (_, said, exit) = register(&["save", file.to_str().expect("text")], &hall);
    assert_eq!((exit, file.exists()), (Some(64), false), "{said}");
    assert!(said.contains("A1: left out, as the settings of a SIXpack 2 cannot be read"), "{said}");
    sim.signal(Signal::TERM);
    sim.finish();
}

#[test]
fn a_port_that_another_program_has_is_named_with_what_to_do_before_registers_are_read() {
    let Bench { hall, sim, folder: _folder } = Bench::of("silvermax");
    let mut homing = Guarded::start(&["home", "--config", &hall, "--seats-empty"]);
    let mut said = homing.stderr().lines().map(|line| line.expect("text"));
    assert!(said.any(|line| line == "A1: axis 1 searches for its zero"));
    let (_, told, exit) = register(&["read", "R1"], &hall);
    assert_eq!(exit, Some(75), "{told}");
    assert!(told.contains("another program has it") && told.contains("systemctl stop kinocue"), "{told}");
    homing.signal(Signal::INT);
    assert!(said.any(|line| line.ends_with("the seat is not home")));
    homing.finish();
    sim.signal(Signal::TERM);
    sim.finish();
}

#[test]
fn where_another_program_has_a_link_no_seat_of_the_hall_is_homed() {
    let Bench { hall, sim, folder } = Bench::of("silvermax");
    let controller = Sim::one(&[]);
    let mut homing = Guarded::start(&["home", "--config", &hall, "--seats-empty"]);
    let mut said = homing.stderr().lines().map(|line| line.expect("text"));
    assert!(said.any(|line| line == "A1: axis 1 searches for its zero"));
    let text = fs::read_to_string(&hall).expect("it was written");
    let seat = format!(
        "\n[[controller]]\nname = \"A3\"\nseat = \"of_A1\"\naddress = \"{}\"\n",
        controller.addresses[0]
    );
    let both = write(folder.path(), &(text + &seat));
    let run = kinocue(&["home", "--config", &both, "--seats-empty"]);
    assert_eq!(run.code, Some(75), "{}", run.stderr);
    assert!(run.stderr.contains("another program has it"), "{}", run.stderr);
    assert!(!run.stderr.contains("A3: has begun"), "{}", run.stderr);
    homing.signal(Signal::INT);
    assert!(said.any(|line| line.ends_with("the seat is not home")));
    homing.finish();
    sim.signal(Signal::TERM);
    sim.finish();
}

/// Two seats that are set alike, and whose units have the same numbers.
#[test]
fn where_two_adapters_have_changed_places_no_seat_is_led_or_homed_as_the_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, other] = ["one", "other"].map(|name| folder.path().join(name));
    let sims = [units(&one, "silvermax"), units(&other, "silvermax")];
    let text = |first: &Path, second: &Path| {
        let seats = [seat_of("A1", first, "silvermax", 20), seat_of("A2", second, "silvermax", 20)];
        format!("[show]\nbind = \"127.0.0.1:0\"\n{}", seats.concat())
    };
    let hall = write(folder.path(), &text(&one, &other));
    assert_eq!(home(&hall).2, Some(0));
    let (told, fails, exit) = preflight(&hall);
    assert_eq!((fails, exit), (vec![], Some(0)), "{told}");
    let hall = write(folder.path(), &text(&other, &one));
    let (told, fails, exit) = preflight(&hall);
    assert_eq!((fails, exit), (vec!["not-home".to_owned()], Some(1)), "{told}");
    let (code, _, said) = play(&cue(folder.path()), &hall);
    assert!(code == Some(75) && said.contains("A1, A2: does not report that it is home"), "{said}");
    let (_, said, exit) = home(&hall);
    assert!(
        exit != Some(0) && said.contains("A1: its drives were homed as A2: adapters or plugs have changed"),
        "{said}"
    );
    // Put back, each is as it was.
    let hall = write(folder.path(), &text(&one, &other));
    let (told, fails, exit) = preflight(&hall);
    assert_eq!((fails, exit), (vec![], Some(0)), "{told}");
    for sim in sims {
        sim.signal(Signal::TERM);
        sim.finish();
    }
}
