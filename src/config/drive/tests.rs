//! Halls with drives: what they read as, and every fault with its line and what to do.

use super::homing::{HomeWay, Side};
use super::sixpack2::{MotorCurrent, PropDiv};
use super::*;
use crate::config::drive_controller::Motors;
use crate::config::link::LinkWiring;
use crate::config::tests::parse;
use crate::config::{Config, Controller, Drives};

const LINK: &str = "[link.stalls]\nport = \"/dev/ttyUSB0\"\n";
const SEAT: &str = "[seat.s]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 4000\n\
    max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n";
const DRIVE: &str = "[seat.s.drive]\nhome = { way = \"switch\", input = 1, toward = \"down\", travel_mm = 165, zero_mm = -2 }\n\
    torque = { hold = \"60%\", move = 1.0, full = 20000 }\n";
const A1: &str = "[[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"link:stalls\"\ndialect = \"silvermax\"\n\
    units = [16, 17, 18]\n";

/// The line at which the table of the controller begins.
const CONTROLLER_LINE: usize = 14;

fn silver(more: &str) -> Result<Config, Vec<String>> {
    parse(&format!("{LINK}{SEAT}{DRIVE}{A1}{more}"))
}

/// The same with one text in it replaced.
fn instead(of: &str, new: &str) -> Result<Config, Vec<String>> {
    let text = format!("{LINK}{SEAT}{DRIVE}{A1}");
    assert!(text.contains(of), "{of}");
    parse(&text.replace(of, new))
}

fn six(controllers: &str, link: &str) -> Result<Config, Vec<String>> {
    parse(&sixpack_hall(controllers, &format!("{LINK}{link}")))
}

fn sixpack_hall(controllers: &str, link: &str) -> String {
    let seat = SEAT.replace("4000", "3200");
    let drive = "[seat.s.drive]\nclock_divider = 3\ncurrent = { peak = 238 }\n\
        home = { way = \"switch\", toward = \"down\", travel_mm = 165, zero_mm = -2 }\n";
    format!("{link}{seat}{drive}{controllers}")
}

const SIX: &str = "[[controller]]\nname = \"B1\"\nseat = \"s\"\naddress = \"link:stalls\"\ndialect = \"sixpack2\"\n\
    unit = 1\nmotors = [0, 1, 2]\n";

fn only(faults: Result<Config, Vec<String>>) -> String {
    let faults = faults.map(|_| ()).unwrap_err();
    let [fault] = &faults[..] else { panic!("{faults:?}") };
    fault.clone()
}

#[test]
fn a_seat_of_silvermax_units_reads_as_it_is_written_with_defaults_for_the_rest() {
    let hall = silver("axis_offset = 3\n").unwrap();
    let [link] = &hall.links[..] else { panic!("one link") };
    assert_eq!((link.wiring, link.baud, link.stop_bits), (LinkWiring::Rs232, 57_600, 2));
    assert_eq!((link.has_echo, link.rate_hz, link.family), (false, None, Some(DriveFamily::SilverMax)));
    let [one] = &hall.controllers[..] else { panic!("one seat") };
    let Drives { drive, link, motors, .. } = one.drives().unwrap();
    assert_eq!((one.name.as_str(), link.as_str(), one.group.as_str()), ("A1", "stalls", "A1"));
    assert_eq!((one.window(), one.address().as_str()), (3..6, "link:stalls"));
    assert_eq!(*motors, Motors::SilverMax(vec![16, 17, 18]));
    let homing = drive.homing;
    assert_eq!(homing.way, HomeWay::Switch { input: Some(1), active_high: true });
    assert_eq!((homing.toward, homing.speed_mm_s, homing.zero_mm), (Side::Down, 10.0, -2.0));
    let silver = drive.silvermax.as_ref().unwrap();
    assert_eq!(silver.torque, Torque { hold: 0.6, moving: 1.0, full: 20_000 });
    assert_eq!((silver.max_error_mm, silver.hold_error_mm, silver.settle_ms), (3.0, 1.0, 120));
    assert_eq!((drive.margin_mm, drive.sixpack2.as_ref()), (1.0, None));
    assert_eq!(hall.untaken_axes(6), [1, 2, 3]);
}

#[test]
fn a_seat_on_a_sixpack_reads_as_it_is_written_and_its_link_has_the_rate_that_is_made_of_57600() {
    let hall = six(SIX, "").unwrap();
    let drives = hall.controllers[0].drives().unwrap();
    assert_eq!(drives.motors, Motors::Sixpack2 { unit: 1, motors: vec![0, 1, 2] });
    let link = &hall.links[0];
    assert_eq!((link.baud, link.stop_bits), (56_818, 1));
    assert_eq!(link.asked_baud, 57_600);
    let drive = drives.drive.sixpack2.clone().unwrap();
    assert_eq!(drive.current, MotorCurrent { peak: 238, stand: 50, run: 75, ramp: 100 });
    assert_eq!((drive.clock_divider, drive.propdiv, drive.jump_mm_s), (3, PropDiv::Auto, None));
    let bus = LINK.replace("/dev/ttyUSB0", "can0") + "wiring = \"can\"\n";
    let can = parse(&sixpack_hall(SIX, &bus)).unwrap();
    assert_eq!((can.links[0].wiring, can.links[0].baud), (LinkWiring::Can, 500_000));
    let slow = only(parse(&sixpack_hall(SIX, &(bus + "baud = 20000\n"))));
    assert!(slow.contains("baud: 20000 is outside 50000..=1000000, the bit rates of a CAN bus"), "{slow}");
}

#[test]
fn a_hall_mixes_families_and_what_asks_the_network_alone_names_those_on_links() {
    let udp = "[[controller]]\nname = \"A2\"\nseat = \"s\"\naddress = \"10.0.0.1:7408\"\naxis_offset = 3\n";
    let hall = silver(udp).unwrap();
    let names = |all: Vec<&Controller>| all.iter().map(|one| one.name.clone()).collect::<Vec<_>>().join(" ");
    assert_eq!(names(hall.controllers.iter().collect()), "A2 A1", "those on links come last");
    assert_eq!(names(hall.on_links().collect()), "A1");
    assert_eq!(hall.untaken_axes(6), [0; 0]);
    let refused = hall.without_drives().unwrap_err().to_string();
    assert!(refused.starts_with("A1 on serial links, which this does not reach"), "{refused}");
    let by_udp = hall.controllers[..1].to_vec();
    assert_eq!(Config { controllers: by_udp, ..hall }.without_drives(), Ok(()));
}

#[test]
fn a_drive_moves_one_axis() {
    let twin = A1.replace("A1", "A2").replace("[16, 17, 18]", "[19, 17, 20]");
    let fault = only(silver(&twin));
    assert!(
        fault.starts_with("hall.toml:25:14: units: unit 17 of link stalls moves another axis"),
        "{fault}"
    );
    assert!(fault.contains(&format!("on line {}", CONTROLLER_LINE + 5)), "{fault}");
    assert!(only(instead("[16, 17, 18]", "[16, 17, 16]")).contains("unit 16 of link stalls"));
    let fault = only(six(&SIX.replace("[0, 1, 2]", "[0, 1, 1]"), ""));
    assert!(fault.contains("motors: motor 1 of unit 1 of link stalls moves another axis"), "{fault}");
    let other_motors = SIX.replace("B1", "B2").replace("[0, 1, 2]", "[3, 4, 5]");
    assert!(six(&format!("{SIX}{other_motors}"), "").is_ok());
}

#[test]
fn seats_on_one_sixpack_share_its_clock_and_their_current() {
    let other = |drive: &str| {
        let seat = SEAT.replace("seat.s", "seat.t").replace("4000", "3200");
        let drive = format!(
            "[seat.t.drive]\n{drive}\nhome = {{ way = \"switch\", toward = \"down\", travel_mm = 165, zero_mm = -2 }}\n"
        );
        let second = SIX.replace("B1", "B2").replace("[0, 1, 2]", "[3, 4, 5]").replace("\"s\"", "\"t\"");
        six(&format!("{seat}{drive}{SIX}{second}"), "")
    };
    assert!(other("clock_divider = 3\ncurrent = { peak = 238, run = \"100%\" }").is_ok());
    for unlike in
        ["clock_divider = 2\ncurrent = { peak = 238 }", "clock_divider = 3\ncurrent = { peak = 200 }"]
    {
        let fault = only(other(unlike));
        assert!(fault.contains("unit: unit 1 moves B1, too, with another clock_divider"), "{fault}");
    }
}

#[test]
fn a_link_has_one_dialect_and_by_rs232_one_sixpack() {
    let seat = "[seat.t]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 3200\nmax_velocity_mm_s = 240\n\
        max_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n[seat.t.drive]\nclock_divider = 3\n\
        current = { peak = 1 }\nhome = { way = \"here\", zero_mm = 0 }\n";
    let fault = only(silver(&format!("{seat}{}", SIX.replace("\"s\"", "\"t\""))));
    assert!(
        fault.contains("dialect: link stalls has silvermax already, by A1") && fault.contains("put sixpack2"),
        "{fault}"
    );
    let second = SIX.replace("B1", "B2").replace("unit = 1", "unit = 2");
    let fault = only(six(&format!("{SIX}{second}"), ""));
    assert!(fault.contains("unit: link stalls is RS-232, which has one SIXpack 2; use wiring"), "{fault}");
    assert!(six(&format!("{SIX}{second}"), "wiring = \"rs485\"\n").is_ok());
}

#[test]
fn a_baud_rate_that_cannot_be_made_is_refused_with_the_nearest() {
    let baud = |link: &str| only(parse(&format!("{LINK}{link}{SEAT}{DRIVE}{A1}")));
    let fault = baud("baud = 56000\n");
    assert!(
        fault.starts_with(
            "hall.toml:3:8: baud: 56000 is not a rate of a SilverMax (BRT); the nearest is 57600"
        )
    );
    let bus = format!("{LINK}wiring = \"can\"\n{SEAT}{DRIVE}{A1}").replace("/dev/ttyUSB0", "can0");
    assert!(only(parse(&bus)).contains("wiring: a SilverMax has no CAN; use \"rs485\" or \"rs232\""));
    for (asked, made) in
        [(19_200, Ok(19_231)), (115_200, Ok(113_636)), (125_000, Ok(125_000)), (230_400, Err(()))]
    {
        let hall = six(SIX, &format!("baud = {asked}\n"));
        assert_eq!(hall.as_ref().map(|hall| hall.links[0].baud).map_err(|_| ()), made, "{hall:?}");
    }
    let fault = only(six(SIX, "baud = 230400\n"));
    assert!(
        fault.contains("baud: 230400 cannot be made") && fault.contains("the nearest is 250000"),
        "{fault}"
    );
    for baud in [625_000, 1_000_000, 9_500] {
        let fault = only(six(SIX, &format!("baud = {baud}\n")));
        assert!(fault.contains(&format!("{baud} is outside 9600..=250000")), "{fault}");
    }
}

#[test]
fn what_drives_do_not_have_is_refused_by_name() {
    for (more, why) in [
        ("fan_out = \"shared\"\n", "fan_out: drives do not share frames"),
        ("accept = \"ffff\"\n", "accept: drives have no accept code"),
        ("effects = [\"air\"]\n[effects]\nair = 1\n", "effects: drives switch no effects"),
        ("dac1 = 0.5\n", "dac1: drives have no such output"),
        ("belt_inputs = [1]\n", "belt_inputs: kinocue reads no belts through drives"),
        ("estop_inputs = [2]\n", "estop_inputs: kinocue reads no inputs of drives"),
        ("motors = [1]\n", "motors: a SilverMax is one motor; list the unit of each axis as units"),
        ("axes = 3\n", "axes: unknown key in [[controller]]"),
        ("[show]\nack_every = 2\n", "ack_every: drives answer each segment"),
        (
            "[seat.s.axis3]\nunit = \"deg\"\nrange = [-90, 90]\npulses_per_rev = 4000\nmax_velocity_deg_s = 60\n\
            max_acceleration_deg_s2 = 120\nmax_jerk_deg_s3 = 600\n",
            "seat: axis 3 of s turns; serial drives move cylinders",
        ),
    ] {
        let fault = only(silver(more));
        assert!(fault.contains(why), "{more}: {fault}");
    }
    assert!(silver("fan_out = \"slice\"\neffects = []\n").is_ok());
}

#[test]
fn a_zero_on_the_wrong_side_is_told_and_no_travel_for_it() {
    let drive = "[seat.s.drive]\ntorque = { hold = \"60%\", move = 1.0, full = 20000 }\n[seat.s.drive.home]\nway = \"switch\"\n\
        input = 1\ntoward = \"up\"\ntravel_mm = 165\nzero_mm = -2\n";
    let fault = only(parse(&format!("{LINK}{SEAT}{drive}{A1}")));
    assert!(fault.contains("zero_mm: -2 mm is below 150 mm, the upper end"), "{fault}");
}

#[test]
fn a_controller_names_a_link_a_dialect_and_a_drive_for_each_axis() {
    for (of, new, why) in [
        ("link:stalls", "link:stall", "address: there is no [link.stall]; did you mean stalls?"),
        ("\"silvermax\"", "\"smc\"", "dialect: is for UDP"),
        ("dialect = \"silvermax\"\n", "", "[[controller]] has no dialect, which is needed"),
        ("[16, 17, 18]", "[16, 17]", "units: 2 numbers for 3 axes; give one for each"),
        ("[16, 17, 18]", "[16, 17, 255]", "units: 255 is outside 1..=254"),
        ("units = [16, 17, 18]\n", "", "[[controller]] has no units, which is needed"),
        (
            "link:stalls",
            "10.0.0.1:7408",
            "dialect: silvermax is on a serial line; write address = \"link:NAME\"",
        ),
    ] {
        let faults = instead(of, new).map(|_| ()).unwrap_err();
        assert!(faults.iter().any(|fault| fault.contains(why)), "{new}: {faults:?}");
    }
    let fault = only(parse(&format!("{LINK}{SEAT}{A1}")));
    assert!(fault.contains("seat: s has no [seat.s.drive], which says how silvermax move it"), "{fault}");
}

#[test]
fn a_rigid_seat_is_on_one_link() {
    let [first, second] = ["A1", "A2"].map(|name| {
        let one = A1.replace("A1", name) + "group = \"g\"\n";
        if name == "A1" { one } else { one.replace("16, 17, 18", "19, 20, 21") }
    });
    let hall = |second: &str| {
        parse(&format!("{LINK}[link.circle]\nport = \"/dev/ttyUSB1\"\n{SEAT}{DRIVE}{first}{second}"))
    };
    assert!(hall(&second).is_ok());
    let fault = only(hall(&second.replace("link:stalls", "link:circle")));
    assert!(fault.contains("group: A1 of the group g is on another link"), "{fault}");
    let udp = "[[controller]]\nname = \"A3\"\nseat = \"s\"\naddress = \"10.0.0.1:7408\"\ngroup = \"g\"\n";
    assert!(only(hall(udp)).contains("group: A3 of the group g is on the network"));
    assert!(
        only(hall(&format!("{second}enabled = false\n"))).contains("A1 of the group g and this are not both")
    );
}

#[test]
fn a_way_home_says_where_it_ends_and_how_far_it_may_go() {
    let home = |of: &str, new: &str| only(instead(of, new));
    for (of, new, why) in [
        (
            "travel_mm = 165",
            "travel_mm = 150",
            "travel_mm: 150 mm do not reach -2 mm from the far end; 152 do",
        ),
        ("travel_mm = 165", "travel_mm = 500", "travel_mm: 500 mm are over 228"),
        ("zero_mm = -2", "zero_mm = 2", "zero_mm: 2 mm is above 0 mm, the lower end of the stroke"),
        ("\"down\"", "\"up\"", "zero_mm: -2 mm is below 150 mm, the upper end"),
        (", input = 1", "", "drive: home: a SilverMax needs the input of the switch"),
        ("input = 1", "input = 8", "input: 8 is outside 1..=7"),
        (", zero_mm = -2", "", "home has no zero_mm, which is needed"),
        ("\"switch\", input = 1", "\"hard-stop\"", "home has no torque, which is needed"),
        ("way = \"switch\", input = 1", "way = \"here\", torque = \"40%\"", "travel_mm: nothing moves"),
        ("zero_mm = -2", "zero_mm = -2, speed_mm_s = 100", "speed_mm_s: 100 is outside 0.1..=50"),
    ] {
        let faults = instead(of, new).map(|_| ()).unwrap_err();
        assert!(faults.iter().any(|fault| fault.contains(why)), "{new}: {faults:?}");
    }
    assert!(home("hold = \"60%\"", "hold = 0").contains("hold: 0 holds nothing up: the seat would drop"));
    assert!(home("move = 1.0", "move = 1.2").contains("move: 1.2 is outside 0..=1"));
}

#[test]
fn a_seat_says_of_its_motors_what_their_family_needs() {
    let without = DRIVE.lines().filter(|line| !line.starts_with("torque")).collect::<Vec<_>>().join("\n");
    let fault = only(parse(&format!("{LINK}{SEAT}{without}\n{A1}")));
    assert!(fault.starts_with("hall.toml:11:") && fault.contains("a SilverMax needs torque"), "{fault}");
    let six = |of: &str, new: &str| {
        let text = format!(
            "{SEAT}[seat.s.drive]\ncurrent = {{ peak = 9, run = \"75%\" }}\nclock_divider = 3\n\
            home = {{ way = \"here\", zero_mm = 0 }}\nreverse = [2]\n{LINK}{SIX}"
        )
        .replace("4000", "3200");
        assert!(text.contains(of) && parse(&text).is_ok(), "{of}: {:?}", parse(&text).err());
        only(parse(&text.replace(of, new)))
    };
    assert!(six("clock_divider = 3", "").contains("240 mm/s needs clock_divider 3 or less, it is 5"));
    assert!(
        six("pulses_per_rev = 3200", "pulses_per_rev = 6400").contains("microsteps a second, over 200000")
    );
    let long = "stroke_mm = 150\nlead_mm = 5";
    assert!(six(long, "stroke_mm = 1500\nlead_mm = 5").contains("are 960000 microsteps, over 900000"));
    assert!(six("\"75%\"", "\"70%\"").contains("run: \"70%\" is not one of 100%, 75%, 50%"));
    assert!(six("current = { peak = 9, run = \"75%\" }", "").contains("a SIXpack 2 needs current"));
    assert!(six("[2]", "[4]").contains("reverse: 4 is outside 1..=3"));
    assert!(six("[2]", "[2, 2]").contains("reverse: axis 2 stands there twice"));
    let fast = only(instead("max_velocity_mm_s = 240", "max_velocity_mm_s = 340"));
    assert!(fast.contains("seat: 340 mm/s at a lead of 5 mm are 4080 rpm, over 4000"), "{fast}");
}

#[test]
fn a_link_is_a_line_of_its_own_by_its_whole_path() {
    let port = |port: &str| only(instead("/dev/ttyUSB0", port));
    assert!(port("ttyUSB0").contains("port: \"ttyUSB0\" is not a device; write a path such as"));
    let can = LINK.replace("[link.stalls]", "[link.bus]").replace("ttyUSB0", "can0") + "wiring = \"can\"\n";
    assert!(only(silver(&can)).contains("port: \"/dev/can0\" is not an interface like \"can0\""));
    let twin = LINK.replace("stalls", "circle");
    let fault = only(silver(&twin));
    assert!(fault.starts_with("hall.toml:21:8: port: [link.stalls] uses it already"), "{fault}");
    let folder = tempfile::tempdir().unwrap();
    let (device, name) = (folder.path().join("ttyUSB0"), folder.path().join("by-id"));
    std::fs::write(&device, "").unwrap();
    std::os::unix::fs::symlink(&device, &name).unwrap();
    let spelled = device.display().to_string().replace("/ttyUSB0", "/.//ttyUSB0");
    for (one, other) in [("/dev/ttyUSB0", "//dev/./ttyUSB0"), (&spelled, name.to_str().unwrap())] {
        let link = |link: &str, port: &str| format!("[link.{link}]\nport = \"{port}\"\n");
        let fault =
            only(parse(&format!("{}{}{SEAT}{DRIVE}{A1}", link("stalls", one), link("circle", other))));
        assert!(fault.contains("port: [link.stalls] uses it already"), "{fault}");
    }
}

#[test]
fn no_value_of_any_key_panics() {
    let six = sixpack_hall(SIX, LINK);
    for hall in [format!("{LINK}wiring = \"rs485\"\nbaud = 57600\nrate_hz = 20\n{SEAT}{DRIVE}{A1}"), six] {
        assert!(parse(&hall).is_ok(), "{:?}", parse(&hall).err());
        let ends = |from: usize| hall[from..].find([',', '\n', '}']).map_or(hall.len(), |end| from + end);
        for (at, sign) in hall.match_indices("= ") {
            let value = at + sign.len();
            for odd in [
                "0",
                "-1",
                "1e300",
                "-1e-300",
                "nan",
                "\"\"",
                "\"link:\"",
                "[]",
                "[0, 1e9, {}]",
                "{}",
                "9223372036854775807",
            ] {
                let text = format!("{}{odd}{}", &hall[..value], &hall[ends(value)..]);
                if let Err(faults) = parse(&text) {
                    assert!(faults.iter().all(|fault| fault.starts_with("hall.toml:")), "{faults:?}");
                }
            }
        }
    }
}
