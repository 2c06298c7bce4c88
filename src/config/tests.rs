//! What is accepted, what is refused, and how a fault reads.

use proptest::prelude::*;

use super::*;

const SEAT: &str = "[seat.s]\naxes = 6\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
    max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n";
const CONTROLLER: &str = "[[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"10.0.0.1:7408\"\n";

pub(super) fn parse(text: &str) -> Result<Config, Vec<String>> {
    read::document(Path::new("hall.toml"), text).map_err(|faults| match faults {
        ConfigFaults::Bad(faults) => faults.iter().map(ToString::to_string).collect(),
        ConfigFaults::Unreadable { .. } => unreachable!("a text is no file"),
    })
}

/// A sound configuration with `more` at the end of its one controller.
pub(super) fn with(more: &str) -> Result<Config, Vec<String>> {
    parse(&format!("{SEAT}{CONTROLLER}{more}"))
}

/// A sound configuration with `more` behind all else.
pub(super) fn hall_with(more: &str) -> Config {
    with(more).unwrap()
}

/// What is wrong with a configuration that is sound but for `more`.
pub(super) fn faults_of(more: &str) -> Vec<String> {
    with(more).unwrap_err()
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/config").join(name)
}

#[test]
fn a_hall_reads_as_it_is_written() {
    let hall = load(&data("hall.toml")).unwrap();
    assert_eq!(hall.show.rate_hz, 59.94);
    assert_eq!((hall.show.timing, hall.show.loss_policy), (Timing::Absolute, LossPolicy::Park));
    assert_eq!((hall.show.ack_every, hall.show.spin_us), (2, 200));
    assert_eq!(hall.show.library, Path::new("/srv/cues"));
    let [a1, a2, b1, b2] = hall.controllers.as_slice() else { panic!("four controllers") };
    let [of_a1, of_a2, of_b1, of_b2] = [a1, a2, b1, b2].map(|one| one.station().unwrap());
    assert_eq!((a1.row.as_deref(), a1.group.as_str(), of_a1.fan_out), (Some("A"), "A1", FanOut::Slice));
    assert_eq!((of_a2.dialect, of_a2.code()), (Dialect::Mbox, 0x0fc9));
    assert_eq!((b1.group.as_str(), of_b1.code()), ("B", 0x0001));
    assert_eq!((b2.axis_offset, of_b2.fan_out), (6, FanOut::Shared));
    assert_eq!(b2.seat.each.map(|axis| axis.park)[..7], [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.0]);
    assert_eq!(b2.seat.each[5].neutral, 0.5);
    assert_eq!(a1.seat, Arc::new(SeatType::bench3(3)));
    assert_eq!(hall.untaken_axes(12), [0; 0]);
}

#[test]
fn a_controller_that_is_out_for_good_takes_no_part_and_its_axes_still_belong_to_somebody() {
    let more = "[[controller]]\nname = \"A2\"\nseat = \"s\"\naddress = \"10.0.0.2:7408\"\naxis_offset = 6\n\
        enabled = false\n[[controller]]\nname = \"A3\"\nseat = \"s\"\naddress = \"10.0.0.3:7408\"\nenabled = true\n";
    let hall = hall_with(more);
    let names: Vec<_> = hall.controllers.iter().map(|one| one.name.as_str()).collect();
    let [absent] = &hall.absent[..] else { panic!("one: {:?}", hall.absent) };
    assert_eq!((names, absent.controller.name.as_str(), absent.after), (vec!["A1", "A3"], "A2", 1));
    assert_eq!(hall.untaken_axes(12), [0; 0]);
}

#[test]
fn not_all_are_out_for_good_and_no_seat_loses_a_part_of_its_controllers() {
    let [fault] = &faults_of("enabled = false\n")[..] else { panic!("one fault") };
    assert!(fault.contains("enable at least one"), "{fault}");
    let more = "group = \"g\"\n[[controller]]\nname = \"A2\"\nseat = \"s\"\naddress = \"10.0.0.2:7408\"\ngroup = \"g\"\n\
        enabled = false\n";
    let [fault] = &faults_of(more)[..] else { panic!("one fault") };
    assert!(fault.starts_with("hall.toml:19:") && fault.contains("give A1 the same"), "{fault}");
    let [fault] = &faults_of("enabled = 0\n")[..] else { panic!("one fault") };
    assert!(fault.contains("expected true or false"), "{fault}");
}

#[test]
fn what_is_left_out_has_its_default() {
    let config = with("").unwrap();
    assert_eq!(config.show, Show::default());
    let controller = &config.controllers[0];
    assert_eq!((controller.group.as_str(), controller.axis_offset), ("A1", 0));
    let station = controller.station().unwrap();
    assert_eq!((station.fan_out, station.dialect, station.code()), (FanOut::Slice, Dialect::Smc, 0xffff));
    assert!(controller.seat.each.iter().all(|axis| axis.park == 0.0));
    assert_eq!(config.untaken_axes(8), [7, 8]);
}

#[test]
fn a_missing_neutral_is_the_park_pose() {
    let seat = SEAT.replace("axes = 6", "axes = 1\npark = [0.25]");
    let config = parse(&format!("{seat}{CONTROLLER}")).unwrap();
    assert_eq!(config.seats[0].each[0].neutral, 0.25);
}

#[test]
fn a_controller_switches_its_own_effects_alone() {
    let hall = load(&data("hall.toml")).unwrap();
    let [a1, a2, _, b2] = hall.controllers.as_slice() else { panic!("four controllers") };
    assert_eq!(hall.effect_outputs(a1, "air"), Some(1));
    assert_eq!(hall.effect_outputs(a1, "water"), Some(0));
    assert_eq!(hall.effect_outputs(a2, "water"), Some(2));
    assert_eq!(hall.effect_outputs(a2, "mist"), Some(2));
    assert_eq!(hall.effect_outputs(a2, "snow"), None);
    assert_eq!(hall.allowed_outputs(a1), 0b1);
    assert_eq!(hall.allowed_outputs(a2), ALL_OUTPUTS);
    assert_eq!(hall.allowed_outputs(b2), 0);
}

#[test]
fn what_motion_and_vibration_may_reach_together_has_defaults_and_is_no_less_than_motion_alone_may() {
    let seat = |more: &str| parse(&format!("{SEAT}{more}{CONTROLLER}")).map(|hall| hall.seats[0].each[0]);
    let usual = seat("").unwrap();
    assert_eq!((usual.shaken_velocity(), usual.shaken_acceleration()), (250.0, 9_806.65));
    let own = seat("max_shaken_velocity_mm_s = 245\nmax_shaken_acceleration_mm_s2 = 20000\n").unwrap();
    assert_eq!((own.shaken_velocity(), own.shaken_acceleration()), (245.0, 20_000.0));
    let faults = seat("max_shaken_velocity_mm_s = 200\n").unwrap_err();
    let [fault] = &faults[..] else { panic!("{faults:?}") };
    assert!(
        fault.starts_with("hall.toml:9:28: max_shaken_velocity_mm_s: 200 is below max_velocity_mm_s, 240"),
        "{fault}"
    );
}

#[test]
fn acks_are_asked_for_so_often_that_a_loss_is_seen_in_time() {
    let hall = |hz: u32, every: u32| {
        parse(&format!("[show]\nrate_hz = {hz}\nack_every = {every}\n{SEAT}{CONTROLLER}"))
    };
    for (hz, most) in [(1_000, 51), (100, 6), (20, 2), (5, 1)] {
        assert!(hall(hz, most).is_ok(), "{hz}");
        let faults = hall(hz, most + 1).unwrap_err();
        assert!(faults[0].ends_with(&format!("{most} is the most at {hz} Hz")), "{faults:?}");
    }
}

#[test]
fn every_fault_is_shown_with_its_place() {
    let Err(ConfigFaults::Bad(faults)) = load(&data("every_fault.toml")) else { panic!("faults") };
    let shown: Vec<_> = faults.iter().map(|f| format!("{}:{}: {}", f.line, f.column, f.message)).collect();
    let expected = [
        "2:11: rate_hz: 2000 is outside 1..=1000",
        "3:8: time: \"relativ\" is not one of relative, absolute; did you mean relative?",
        "4:8: bind: \"0.0.0.0\" is not an IPv4 address and port, such as 192.168.15.201:7408",
        "5:1: ack_evry: unknown key in [show]; did you mean ack_every?",
        "6:11: spin_us: -1 is outside 0..=900",
        "8:1: [seat.bench3] has no max_jerk_mm_s3, which is needed",
        "11:11: lead_mm: nan is not a finite number",
        "13:21: max_velocity_mm_s: 0 is not above 0",
        "14:26: max_acceleration_mm_s2: expected a number, not a string",
        "15:8: park: 2 values for 3 axes; give one for each",
        "18:7: air: 13 is outside 1..=12",
        "22:8: seat: there is no [seat.bench]; did you mean bench3?",
        "24:10: accept: 0000 means that no station accepts the frame; use \"ffff\"",
        "25:12: effects: airr is not in [effects]; did you mean air?",
        "28:8: name: A1 is also that of another controller, on line 21",
        "30:11: address: 192.168.15.201:7408 is also that of another controller, on line 23",
        "31:15: axis_offset: 12 is outside 0..=11",
        "33:3: controler: unknown key in the file; did you mean controller?",
    ];
    assert_eq!(shown, expected);
}

#[test]
fn a_line_that_is_no_toml_does_not_hide_the_faults_of_others() {
    let faults = parse(&format!("[show]\nrate_hz = \nspin_us = 1000\n{SEAT}{CONTROLLER}")).unwrap_err();
    assert_eq!(faults.len(), 2, "{faults:?}");
    assert!(faults[0].starts_with("hall.toml:2:"), "{faults:?}");
    assert_eq!(faults[1], "hall.toml:3:11: spin_us: 1000 is outside 0..=900");
}

#[test]
fn a_key_given_twice_is_refused_once() {
    let faults = with("row = \"A\"\nrow = \"B\"\n").unwrap_err();
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(faults[0].starts_with("hall.toml:14:1: row stands there already"), "{faults:?}");
}

#[test]
fn an_output_has_what_its_controller_says_and_no_effect_has_its_name() {
    let hall = with("dac2 = 0.8\n").unwrap();
    assert_eq!(hall.controllers[0].at_most, [0.0, 0.8]);
    assert!(hall.switch_names().eq(["dac2"]), "nobody switches what no controller has");
    assert_eq!(with("dac1 = 1.5\n").unwrap_err(), ["hall.toml:13:8: dac1: 1.5 is outside 0..=1"]);
    let faults = parse(&format!("[effects]\ndac1 = 1\n{SEAT}{CONTROLLER}")).unwrap_err();
    assert!(
        faults[0].ends_with("dac1\": is the name of an output in cues; call the effect otherwise"),
        "{faults:?}"
    );
}

#[test]
fn columns_are_counted_in_characters() {
    let faults = with("row = \"é\" # é\neffects = [\"é\", 1]\n").unwrap_err();
    assert_eq!(
        faults,
        [
            "hall.toml:14:12: effects: é is not in [effects]",
            "hall.toml:14:17: effects: expected a string, not a whole number"
        ]
    );
}

#[test]
fn a_configuration_without_controllers_is_refused() {
    let faults = parse(SEAT).unwrap_err();
    assert_eq!(faults, ["hall.toml:1:1: there is no [[controller]]; add at least one"]);
    let faults =
        parse(&format!("{SEAT}{}", CONTROLLER.replace("[[controller]]", "[controller]"))).unwrap_err();
    assert_eq!(faults.len(), 1);
    assert!(faults[0].contains("[[controller]], with two brackets"), "{faults:?}");
}

#[test]
fn an_address_that_is_no_single_controller_is_refused() {
    for address in ["10.0.0.1:0", "255.255.255.255:7408", "224.0.0.1:7408", "0.0.0.0:7408", "seat-a1:7408"] {
        let text = format!("{SEAT}{CONTROLLER}").replace("10.0.0.1:7408", address);
        let faults = parse(&text).unwrap_err();
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].starts_with("hall.toml:12:11: address: "), "{faults:?}");
    }
}

#[test]
fn the_same_address_spelt_in_two_ways_is_one_address() {
    let other = CONTROLLER.replace("A1", "A2").replace("7408", "07408");
    let faults = with(&other).unwrap_err();
    assert_eq!(
        faults,
        ["hall.toml:16:11: address: 10.0.0.1:7408 is also that of another controller, on line 12"]
    );
}

#[test]
fn a_shared_frame_reaches_no_axis_past_the_twelfth() {
    let faults = with("axis_offset = 7\nfan_out = \"shared\"\n").unwrap_err();
    assert_eq!(faults.len(), 1);
    assert!(faults[0].starts_with("hall.toml:13:15: axes 8 to 13 reach past axis 12"), "{faults:?}");
    assert_eq!(with("axis_offset = 7\n").unwrap().untaken_axes(12), [1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn port_out_of_vibration_frames_has_two_bytes_or_four_and_mbox_controllers_have_none() {
    let port = |more: &str| with(more).map(|hall| hall.controllers[0].station().unwrap().vibration_port);
    assert_eq!(port(""), Ok(VibrationPort::Two));
    assert_eq!(port("vibration_port_octets = 4\n"), Ok(VibrationPort::Four));
    assert_eq!(
        with("dialect = \"imax\"\n"),
        Err(vec!["hall.toml:13:11: dialect: an IMAX controller is \"mbox\" here".to_owned()])
    );
    let place = "hall.toml:13:25: vibration_port_octets: ";
    assert_eq!(port("vibration_port_octets = 3\n"), Err(vec![format!("{place}3 is neither 2 nor 4")]));
    let faults = port("vibration_port_octets = 2\ndialect = \"mbox\"\n").unwrap_err();
    assert_eq!(faults, [format!("{place}mbox controllers have no vibration frames; omit it")]);
}

#[test]
fn a_stroke_of_more_pulses_than_a_register_holds_is_refused() {
    let faults = parse(&format!("{}{CONTROLLER}", SEAT.replace("= 150", "= 1e9"))).unwrap_err();
    assert_eq!(
        faults,
        ["hall.toml:3:13: stroke_mm: the stroke is 2000000000000.0 pulses, outside 1..=2147483647"]
    );
    assert!(parse(&format!("{}{CONTROLLER}", SEAT.replace("= 150", "= 1e999"))).is_err());
}

#[test]
fn a_missing_file_and_a_folder_are_unreadable_and_other_bytes_a_fault() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().join("none.toml"), folder.path().to_owned()] {
        assert!(matches!(load(&path), Err(ConfigFaults::Unreadable { .. })), "{}", path.display());
    }
    let path = folder.path().join("latin.toml");
    std::fs::write(&path, b"[show]\n# caf\xe9\n").unwrap();
    let Err(ConfigFaults::Bad(faults)) = load(&path) else { panic!("a fault") };
    assert_eq!((faults[0].line, faults[0].column), (2, 6));
}

fn to(targets: &[&str], cue_axes: usize, effects: &[&str]) -> Result<Config, String> {
    let own = |texts: &[&str]| texts.iter().map(ToString::to_string).collect::<Vec<_>>();
    from_to_args(&own(targets), &own(effects), cue_axes).map_err(|error| error.to_string())
}

#[test]
fn a_target_takes_the_axes_of_the_cue_from_its_offset_on() {
    let config =
        to(&["127.0.0.1:7408", "127.0.0.1:7409,offset=6,name=B,fan_out=shared,dialect=mbox"], 12, &[]);
    let config = config.unwrap();
    let [c1, b] = config.controllers.as_slice() else { panic!("two controllers") };
    assert_eq!((c1.name.as_str(), c1.seat.axes, c1.axis_offset), ("c1", 12, 0));
    assert_eq!((b.name.as_str(), b.seat.axes, b.axis_offset), ("B", 6, 6));
    let station = b.station().unwrap();
    assert_eq!((station.fan_out, station.dialect, b.group.as_str()), (FanOut::Shared, Dialect::Mbox, "B"));
    assert_eq!(to(&["localhost:7408,axes=10"], 3, &[]).unwrap().controllers[0].seat.axes, 10);
}

#[test]
fn a_target_that_cannot_be_used_says_why() {
    for (targets, why) in [
        (&["127.0.0.1"][..], "the port is missing"),
        (&["127.0.0.1:99999"], "cannot find"),
        (&["[::1]:7408"], "cannot find"),
        (&["127.0.0.1:7408,offset=3"], "offset 3 is past the cue's 3 axes"),
        (&["127.0.0.1:7408,axes=13"], "axes=13 is not one of 1..=12"),
        (&["127.0.0.1:7408,axis=3"], "did you mean axes?"),
        (&["127.0.0.1:7408,axes"], "\"axes\" is not key=value"),
        (
            &["127.0.0.1:7408", "127.0.0.1:7408,name=B"],
            "the address 127.0.0.1:7408 is also that of an earlier",
        ),
        (&["127.0.0.1:7408,name=c2", "127.0.0.1:7409"], "the name c2 is also that of an earlier"),
        (&["255.255.255.255:7408"], "not the address of one controller"),
        (&[], "no controller"),
    ] {
        let error = to(targets, 3, &[]).unwrap_err();
        assert!(error.contains(why), "{targets:?}: {error}");
    }
}

#[test]
fn effects_of_unknown_wiring_stay_off_away_from_this_machine() {
    let config = to(&["127.0.0.1:7408", "10.0.0.1:7408"], 3, &[]).unwrap();
    let [here, there] = config.controllers.as_slice() else { panic!("two controllers") };
    assert_eq!(config.effect_outputs(here, "light"), Some(1 << 5));
    assert_eq!(config.allowed_outputs(here), ALL_OUTPUTS);
    assert_eq!((config.effect_outputs(there, "air"), config.allowed_outputs(there)), (Some(0), 0));
    let dark: Vec<_> = config.without_effects().map(|(one, what)| (one.name.as_str(), what)).collect();
    assert_eq!(dark, [("c2", "name its outputs with --effect NAME=N or [effects]")]);
    let drives = load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/silvermax.toml"))).unwrap();
    let dark: Vec<_> = drives.without_effects().map(|(_, what)| what).collect();
    assert!(!dark.is_empty() && dark.iter().all(|what| *what == "drives have no outputs"), "{dark:?}");
}

#[test]
fn a_named_effect_is_all_that_is_switched_away_from_this_machine() {
    let config = to(&["127.0.0.1:7408", "10.0.0.1:7408"], 3, &["water=7", "snow=12"]).unwrap();
    let [here, there] = config.controllers.as_slice() else { panic!("two controllers") };
    assert_eq!(config.effect_outputs(here, "water"), Some(1 << 6));
    assert_eq!(config.effect_outputs(here, "air"), Some(1));
    assert_eq!(config.effect_outputs(there, "snow"), Some(1 << 11));
    assert_eq!(config.allowed_outputs(there), (1 << 6) | (1 << 11));
    for effect in ["water", "water=0", "water=13", "=1", "a b=1"] {
        assert!(to(&["10.0.0.1:7408"], 3, &[effect]).unwrap_err().starts_with("--effect"), "{effect}");
    }
    assert!(to(&["10.0.0.1:7408"], 3, &["air=1", "air=2"]).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_text_panics(lines in prop::collection::vec(0..FRAGMENTS.len(), 0..12), noise in "\\PC{0,12}") {
        let mut text: String = lines.into_iter().map(|index| FRAGMENTS[index]).collect();
        let _ = parse(&text);
        text.push_str(&noise);
        let _ = parse(&text);
    }
}

const FRAGMENTS: [&str; 31] = [
    "[link.l]\nport = \"/dev/x\"\n",
    "wiring = \"can\"\n",
    "baud = 57600\n",
    "[seat.s.drive]\n",
    "home = { way = \"switch\", toward = \"up\", travel_mm = 1e300, zero_mm = -1e300 }\n",
    "reverse = [0, 13, 1, 1]\n",
    "address = \"link:l\"\n",
    "dialect = \"sixpack2\"\n",
    "unit = 1\nmotors = [0, 255, []]\n",
    "[show]\n",
    "[seat.s]\n",
    "[seat]\n",
    "[[controller]]\n",
    "[controller]\n",
    "[effects]\n",
    "[[seat.s]]\n",
    "axes = 3\n",
    "axes = 0x7fffffffffffffff\n",
    "park = [",
    "[0.5, 1]\n",
    "{ x = 1 }\n",
    "name = \"a\"\n",
    "seat = \"s\"\n",
    "air = ",
    "1\n",
    "\"\n",
    "'''\n",
    "controller = []\n",
    "controller.name = 1\n",
    "= ",
    "]]\n",
];

#[test]
fn emergency_stop_inputs_are_a_list_of_inputs() {
    assert_eq!(with("estop_inputs = [1, 12]").unwrap().controllers[0].estop_inputs, 0b1000_0000_0001);
    let faults = with("estop_inputs = [0, 13]").unwrap_err();
    assert_eq!(faults.len(), 2, "{faults:?}");
    assert!(faults[0].ends_with("estop_inputs: 0 is outside 1..=12"), "{faults:?}");
}

#[test]
fn a_pose_of_fractions_does_not_say_where_an_axis_rests_that_has_its_zero_inside_its_range() {
    let ranged = "[seat.s.axis2]\nrange = [-75, 75]\n";
    let seat = SEAT.replace("axes = 6", "axes = 2\npark = [0.1, 0.0]");
    let [fault] = &parse(&format!("{seat}{CONTROLLER}{ranged}")).unwrap_err()[..] else {
        panic!("one fault")
    };
    assert!(fault.starts_with("hall.toml:3:8: park: a fraction of the range of axis 2"), "{fault}");
    assert!(fault.ends_with("give axis2 park of its own, in mm"), "{fault}");
    let own = parse(&format!("{seat}{CONTROLLER}{ranged}park = 0\n")).unwrap().seats[0].each;
    assert_eq!((own[0].park, own[1].park, own[1].neutral), (0.1, 0.5, 0.5));
}

#[test]
fn a_pipe_in_the_place_of_a_configuration_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("hall.toml");
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RWXU).unwrap();
    let ConfigFaults::Unreadable { source, .. } = load(&pipe).unwrap_err() else { panic!("it was read") };
    assert!(source.to_string().contains("it is a pipe or a device, not a file"), "{source}");
    assert!(load(folder.path()).is_err());
}
