//! A seat on serial drives beside two on the network, in one hall.

use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use rustix::process::Signal;
use serde_json::Value;

use crate::hall::Hall;
use crate::process::Guarded;

/// A link, and a seat on it, at a rate that is left where the other end answers late, on a busy machine.
fn with_drives(config: &str, port: &Path, dialect: &str) -> String {
    let (input, units) = match dialect {
        "silvermax" => ("input = 1, active = \"high\", ", "units = [16, 17, 18]"),
        _ => ("", "unit = 1\nmotors = [0, 1, 2]"),
    };
    format!(
        r#"{config}
[link.stalls]
port = "{}"
rate_hz = 25

[seat.lift]
axes = 3
stroke_mm = 150.0
lead_mm = 5.0
pulses_per_rev = 4000
max_velocity_mm_s = 160.0
max_acceleration_mm_s2 = 3000.0
max_jerk_mm_s3 = 60000.0

[seat.lift.drive]
home = {{ way = "switch", {input}toward = "down", speed_mm_s = 40, travel_mm = 165, zero_mm = -2.0 }}
torque = {{ hold = "60%", move = "100%", full = 20000 }}
vibration = "0%"
max_deviation_mm = 5.0
current = {{ peak = 238 }}
clock_divider = 3

[[controller]]
name = "L1"
seat = "lift"
address = "link:stalls"
dialect = "{dialect}"
{units}
"#,
        port.display()
    )
}

/// Virtual units, at the end of that line.
fn units(port: &Path, dialect: &str) -> Guarded {
    let tty = port.to_str().expect("text");
    let numbers = if dialect == "silvermax" { "16,17,18" } else { "1" };
    let control = control_of(port);
    let control = control.to_str().expect("text");
    let args = ["sim", "--dialect", dialect, "--tty", tty, "--units", numbers, "--seed", "1", "--json"];
    let args = [&args[..], &["--control", control]].concat();
    let mut sim = Guarded::start(&args);
    let mut ready = String::new();
    sim.stderr().read_line(&mut ready).expect("text");
    assert_eq!(ready, format!("ready {tty}\n"));
    sim
}

/// Where units take commands that are at the end of that line.
fn control_of(port: &Path) -> PathBuf {
    port.with_extension("control")
}

/// Has the units at the end of a line obey a command.
fn tell_units(port: &Path, command: &str) {
    let mut socket = UnixStream::connect(control_of(port)).expect("the sim listens");
    socket.write_all(format!("{command}\n").as_bytes()).expect("it is taken");
    let mut answer = String::new();
    BufReader::new(socket).read_line(&mut answer).expect("it answers");
    assert_eq!(answer, "ok\n", "{command}");
}

fn of_lift(status: &Value) -> &Value {
    let controllers = status["controllers"].as_array().expect("a list");
    controllers.iter().find(|one| one["name"] == "L1").expect("it is there")
}

/// What the units executed.
fn executed(sim: Guarded) -> Vec<Value> {
    sim.signal(Signal::TERM);
    sim.finish().report_of(0)["units"].as_array().expect("a list").clone()
}

#[test]
fn silvermax_units_beside_controllers_are_homed_played_stopped_read_and_parked_by_the_same_commands() {
    let units = evening("silvermax");
    let was_hurt = |unit: &Value| unit["kills"] != 0 || unit["executed"]["jumps"] != 0;
    assert_eq!((units.len(), units.iter().filter(|unit| was_hurt(unit)).count()), (3, 0), "{units:?}");
}

#[test]
fn a_sixpack_2_beside_controllers_is_homed_played_stopped_read_and_parked_by_the_same_commands() {
    let units = evening("sixpack2");
    let was_hurt = |motor: &&Value| motor["own_searches"] != 0 || motor["executed"]["lost"] != 0.0;
    let motors = units[0]["motors"].as_array().expect("a list");
    assert_eq!(motors.iter().find(was_hurt), None, "{units:?}");
}

/// Homes, plays, pauses, stops and parks; the units as they are afterwards.
fn evening(dialect: &str) -> Vec<Value> {
    let folder = tempfile::tempdir().expect("a folder");
    let port = folder.path().join("stalls");
    let sim = units(&port, dialect);
    let mut hall = Hall::closed(&[], |config| with_drives(&config, &port, dialect));
    hall.serve();
    let found = hall.comes_to("recovering");
    assert_eq!((&of_lift(&found)["health"], &of_lift(&found)["homed"]), (&"excluded".into(), &false.into()));
    hall.done(&["home", "--seats-empty"]);
    hall.comes_to("parked");

    hall.play("ride");
    hall.wait(|status| status["cause"] == "the seats that take part have parked");
    let parked = hall.wait(|status| of_lift(status)["acked"] == of_lift(status)["asked"]);
    let lift = of_lift(&parked);
    assert_eq!((&lift["health"], &lift["lost"]), (&"ok".into(), &0.into()), "{lift}");
    let axes = parked["links"][0]["axes"].as_array().expect("a list");
    assert_eq!(axes.len(), 3);
    assert!(axes.iter().all(|axis| axis["made"].as_u64() > Some(20) && axis["refused"] == 0), "{axes:?}");

    hall.play("night");
    hall.wait(|status| of_lift(status)["positions_mm"][0].as_f64() > Some(5.0));
    hall.done(&["pause"]);
    let paused = hall.wait(|status| status["state"] == "paused" && status["since_s"].as_f64() > Some(1.5));
    let controllers = paused["controllers"].as_array().expect("a list");
    assert!(controllers.iter().all(|one| one["health"] == "ok"), "nobody was moved: {controllers:?}");
    hall.done(&["resume"]);
    hall.comes_to("playing");
    hall.done(&["stop"]);
    hall.comes_to("stopped");
    hall.wait(|status| of_lift(status)["health"] == "rejoining");
    hall.done(&["clear"]);
    hall.wait(|status| status["next"].as_str().is_some_and(|next| next.contains("park, or")));
    hall.done(&["park"]);
    hall.comes_to("parked");
    hall.wait(|status| of_lift(status)["health"] == "ok");
    hall.close();
    let [show, ..] = &hall.journal("show")[..] else { panic!("it was played") };
    let outcome = &show["outcome"];
    assert_eq!((&outcome["acked"], &outcome["lost"]), (&outcome["asked"], &0.into()), "{outcome}");
    hall.end();
    executed(sim)
}

/// Plays until a unit is blocked, and the drive lets go of its motor.
fn is_killed_in_a_show(hall: &mut Hall, port: &Path) {
    hall.play("night");
    hall.wait(|status| of_lift(status)["positions_mm"][0].as_f64() > Some(5.0));
    tell_units(port, "16@blocked=1");
    let killed = hall.wait(|status| of_lift(status)["health"] == "error");
    let lift = of_lift(&killed);
    assert!(
        lift["why"].as_str().is_some_and(|why| why.contains("its axis 1 was killed by moving error")),
        "{lift}"
    );
    tell_units(port, "16@blocked=0");
}

#[test]
fn a_seat_whose_drive_let_go_of_its_motor_is_home_again_once_it_was_homed_in_this_run_or_the_next() {
    let folder = tempfile::tempdir().expect("a folder");
    let port = folder.path().join("stalls");
    let sim = units(&port, "silvermax");
    let mut hall = Hall::closed(&[], |config| with_drives(&config, &port, "silvermax"));
    hall.serve();
    hall.comes_to("recovering");
    hall.done(&["home", "--seats-empty"]);
    hall.comes_to("parked");
    for restarts in [false, true] {
        is_killed_in_a_show(&mut hall, &port);
        hall.done(&["stop"]);
        hall.comes_to("stopped");
        if restarts {
            hall.close();
            hall.serve();
        } else {
            hall.done(&["clear"]);
        }
        // What was loaded before is loaded again at a start, and has the line until then.
        let may_home = |status: &Value| of_lift(status)["homed"] == false && status["job"].is_null();
        hall.wait(|status| status["state"] == "recovering" && may_home(status));
        hall.done(&["home", "--seats-empty"]);
        hall.comes_to("parked");
        hall.wait(|status| of_lift(status)["health"] == "ok");
    }
    hall.end();
    drop(sim);
}

#[test]
fn a_stop_ends_a_search_and_the_seat_is_not_home() {
    let folder = tempfile::tempdir().expect("a folder");
    let port = folder.path().join("stalls");
    let sim = units(&port, "silvermax");
    let mut hall = Hall::closed(&[], |config| with_drives(&config, &port, "silvermax"));
    hall.serve();
    hall.wait(|status| of_lift(status)["health"] == "excluded");
    hall.done(&["home", "--seats-empty"]);
    // The first axis is two seconds from its switch: it searches by then.
    hall.wait(|status| status["state"] == "homing" && status["since_s"].as_f64() > Some(1.0));
    hall.done(&["stop"]);
    hall.comes_to("stopped");
    // Its units are asked anew after the search: until they have answered, nobody knows.
    hall.wait(|status| of_lift(status)["health"] == "excluded" && of_lift(status)["homed"] == false);
    // Nothing goes on by itself.
    hall.done(&["clear"]);
    let cleared = hall.wait(|status| status["state"] == "recovering");
    assert!(cleared["next"].as_str().expect("text").starts_with("home"), "{cleared}");
    hall.end();
    let units = executed(sim);
    let searched = units.iter().filter(|unit| unit["executed"]["velocity_per_s"].as_f64() > Some(0.0));
    assert_eq!(searched.count(), 1, "the others had not begun: {units:?}");
}

#[test]
fn a_port_that_is_not_there_is_named_with_what_to_do_and_its_seat_is_back_once_it_is_plugged_in() {
    let folder = tempfile::tempdir().expect("a folder");
    let port = folder.path().join("stalls");
    let mut hall = Hall::closed(&[], |config| with_drives(&config, &port, "silvermax"));
    hall.launch();
    hall.serving().heard(|line| line.contains("[link.stalls]").then_some(()));
    let is_missing = |status: &Value| {
        let warnings = status["warnings"].as_array().expect("a list");
        warnings.iter().any(|one| {
            one["id"] == "link" && one["text"].as_str().is_some_and(|it| it.contains("[link.stalls]"))
        })
    };
    hall.wait(|status| is_missing(status) && of_lift(status)["health"] == "lost");
    // The others go on without it.
    hall.done(&["disable", "L1"]);
    hall.comes_to("parked");
    let sim = units(&port, "silvermax");
    let found = hall.wait(|status| !is_missing(status));
    assert_eq!(found["state"], "parked");
    let is_looked_at = |status: &Value| of_lift(status)["homed"] == false;
    hall.wait(is_looked_at);
    drop(sim);
    hall.wait(is_missing);
    hall.end();
}
