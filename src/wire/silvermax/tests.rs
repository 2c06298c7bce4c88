//! The golden messages in both directions, and any octets at all.

use proptest::prelude::*;
use serde_json::Value;

use super::*;

const GOLDEN: &str = include_str!("../../../tests/data/vectors-drives.json");

/// What is read and never sent, by the names of the golden messages. `@16` has no command: a poll is sent as `@16 0`.
const NEVER_SENT: [&str; 22] = [
    "poll_short",
    "velocity_mode_200_rpm",
    "move_absolute_time",
    "move_absolute_time_busy",
    "move_relative_time",
    "profile_move_continuous",
    "profile_move_exit",
    "position_input_mode",
    "zero_target_and_position",
    "check_internal_status",
    "torque_limits",
    "identity_group_10_unit_16",
    "baud_230400",
    "protocol_ascii",
    "ack_delay_20_ticks",
    "closed_loop",
    "input_filter",
    "output_1_on",
    "output_1_off",
    "output_3_low",
    "low_voltage_trip",
    "over_voltage_trip",
];

fn golden(protocol: &str) -> Vec<Value> {
    let all: Value = serde_json::from_str(GOLDEN).unwrap();
    let vectors = all["vectors"].as_array().unwrap();
    let ours = |vector: &&Value| vector["family"] == "silvermax" && vector["protocol"] == protocol;
    let found: Vec<Value> = vectors.iter().filter(ours).cloned().collect();
    assert!(found.len() >= 6, "{protocol}: {}", found.len());
    found
}

fn octets(message: &Value) -> Vec<u8> {
    let hex = message["hex"].as_str().unwrap();
    hex.split(' ').map(|octet| u8::from_str_radix(octet, 16).unwrap()).collect()
}

/// The one line that octets are.
fn line(mut collector: LineCollector, octets: &[u8]) -> Vec<u8> {
    let (last, first) = octets.split_last().unwrap();
    for octet in first {
        assert_eq!(collector.push(*octet), None);
    }
    match collector.push(*last) {
        Some(Collected::Line(line)) => line.to_vec(),
        other => panic!("{other:?}"),
    }
}

fn number(value: &Value) -> i64 {
    value.as_i64().unwrap()
}

/// The same request of the sending kind, if there is one; made of what was read.
fn sendable(any: &AnyRequest) -> Option<Request> {
    let parameters = any.parameters.as_slice();
    let at = |index: usize| parameters[index];
    let unsigned = |index: usize| u32::try_from(at(index)).unwrap();
    let word = |index: usize| u16::try_from(at(index)).unwrap();
    let signed = |index: usize| i32::try_from(at(index)).unwrap();
    Some(match any.number {
        0 => Request::Poll,
        1 => Request::ClearPoll { mask: word(0) },
        3 if at(0) < 0 => Request::StopAtOnce,
        3 => Request::Stop { deceleration: unsigned(0) },
        5 => Request::Revision,
        11 => Request::WriteRegister { register: u8::try_from(at(0)).unwrap(), value: signed(1) },
        12 => Request::ReadRegister { register: u8::try_from(at(0)).unwrap() },
        20 => Request::InternalStatus,
        21 => Request::IoStates,
        25 => Request::ImmediateSegment {
            ticks: unsigned(0),
            position: signed(1),
            acceleration: unsigned(2),
            velocity: unsigned(3),
        },
        134 => {
            Request::MoveAbsolute { position: signed(0), acceleration: unsigned(1), velocity: unsigned(2) }
        }
        135 => Request::MoveRelative {
            distance: signed(0),
            acceleration: unsigned(1),
            velocity: unsigned(2),
            stop: match at(3) {
                0 => StopOn::Nothing,
                code => StopOn::Input { input: u8::try_from(-code).unwrap(), is_high: at(4) == 1 },
            },
        },
        146 => Request::TargetToPosition,
        147 => Request::ClearMaxError,
        149 => Request::TorqueLimits { hold: word(0), moving: word(1) },
        151 => Request::ErrorLimits { moving: word(0), holding: word(1), delay_ticks: word(2) },
        163 => Request::ClearInternalStatus,
        165 => Request::SubtractAccumulator,
        167 => Request::KillConditions { enable: word(0), state: word(1) },
        214 => Request::MaxTemperature { celsius: u8::try_from(at(0)).unwrap() },
        221 => Request::SoftLimitsOn,
        225 => Request::EnableMultiTasking,
        227 => Request::EnableDriver,
        237 => Request::GravityOffset { offset: i16::try_from(at(0)).unwrap() },
        253 => Request::StartQueue,
        254 => Request::ClearQueue,
        _ => return None,
    })
}

#[test]
fn every_golden_request_is_read_with_its_command_and_parameters_by_name() {
    for vector in golden("ascii") {
        let fields = &vector["fields"];
        let request = AnyRequest::parse(&line(LineCollector::of_requests(), &octets(&vector))).unwrap();
        assert_eq!(i64::from(request.unit), number(&fields["unit"]), "{vector}");
        assert_eq!(i64::from(request.number), number(&fields["command"]), "{vector}");
        let command = request.command().unwrap();
        assert_eq!(command.mnemonic, fields["mnemonic"], "{vector}");
        let expected = fields["parameters"].as_object().unwrap();
        assert_eq!(request.parameters.as_slice().len(), expected.len(), "{vector}");
        assert_eq!(command.parameters.len(), expected.len(), "{vector}");
        for (parameter, found) in command.parameters.iter().zip(request.parameters.as_slice()) {
            assert_eq!(number(&expected[parameter.name]), *found, "{vector}");
            assert!(parameter.takes(*found), "{vector}");
        }
    }
}

#[test]
fn every_golden_request_that_may_be_sent_is_written_octet_for_octet_and_no_other() {
    for vector in golden("ascii") {
        let octets = octets(&vector);
        let read = AnyRequest::parse(&octets[..octets.len() - 1]).unwrap();
        let mut buf = [0xa5; MAX_LINE];
        let written = sendable(&read).map(|request| request.emit(read.unit, &mut buf).to_vec());
        let name = vector["name"].as_str().unwrap();
        assert_eq!(written.as_ref() != Some(&octets), NEVER_SENT.contains(&name), "{name}");
    }
}

#[test]
fn every_golden_answer_is_read_and_written() {
    let mut answers = 0;
    for vector in golden("ascii") {
        let answer = &vector["reply"];
        if answer.is_null() {
            assert_eq!(vector["fields"]["unit"], ALL_UNITS, "only a group stays silent: {vector}");
            continue;
        }
        answers += 1;
        let octets = octets(answer);
        let reply = Reply::parse(&line(LineCollector::of_replies(), &octets)).unwrap();
        let fields = &answer["fields"];
        let words: Vec<u16> = fields["words"].as_array().map_or_else(Vec::new, |words| {
            words.iter().map(|word| u16::try_from(number(word)).unwrap()).collect()
        });
        let unit = u8::try_from(number(&fields["unit"])).unwrap();
        let command = fields["command"].as_u64().map(|command| u16::try_from(command).unwrap());
        assert_eq!((reply.unit(), reply.command()), (unit, command), "{vector}");
        match (reply, fields["kind"].as_str().unwrap()) {
            (Reply::Ack { .. }, "ack") => {}
            (Reply::Data { words: found, .. }, "data") => {
                assert_eq!(found.as_slice(), words, "{vector}");
                let value = fields["value"].as_i64();
                assert!(value.is_none() || found.value().map(i64::from) == value, "{vector}");
            }
            (Reply::Nak { reason, .. }, "nak") => {
                assert_eq!(i64::from(reason.number()), number(&fields["reason"]), "{vector}");
            }
            other => panic!("{other:?}: {vector}"),
        }
        assert_eq!(reply.emit(&mut [0xa5; MAX_LINE]), octets, "{vector}");
    }
    assert!(answers > 60, "{answers}");
}

#[test]
fn every_golden_message_in_nine_bits_is_read() {
    for vector in golden("9-bit") {
        let fields = vector["fields"].as_object().unwrap();
        let Ok(NineBit::Request(request)) = NineBit::request(&octets(&vector)) else { panic!("{vector}") };
        assert_eq!(i64::from(request.unit), number(&fields["unit"]), "{vector}");
        let named = request.command().unwrap().parameters.iter().zip(request.parameters.as_slice());
        for (parameter, found) in named {
            assert_eq!(number(&fields[parameter.name]), *found, "{vector}");
        }
        let Ok(NineBit::Reply(reply)) = NineBit::reply(&octets(&vector["reply"])) else { panic!("{vector}") };
        assert_eq!(reply.unit(), request.unit);
        if let (Reply::Data { words, .. }, Some(value)) = (reply, fields.get("reply_value")) {
            assert_eq!(words.value().map(i64::from), value.as_i64());
        }
    }
    let damaged = [0x10, 0x03, 0x0c, 0x00, 0x02, 0xe0];
    assert_eq!(NineBit::request(&damaged), Err(LineError::Sum { found: 1 }));
}

#[test]
fn what_has_no_golden_message_is_written_as_its_page_has_it() {
    let index = Request::MoveRelative { distance: 8, acceleration: 5, velocity: 9, stop: StopOn::Index };
    let stalled =
        Request::MoveRelative { distance: 8, acceleration: 5, velocity: 9, stop: StopOn::MovingError };
    for (request, line) in [
        (Request::ReadSupply, &b"@16 193 7 10\r"[..]),
        (Request::SoftLimitsOff, b"@16 221 0\r"),
        (index, b"@16 135 8 5 9 -9 1\r"),
        (stalled, b"@16 135 8 5 9 -11 1\r"),
        (Request::TorqueLimits { hold: 12_000, moving: 20_000 }, b"@16 149 12000 20000 12000 20000\r"),
    ] {
        assert_eq!(request.emit(16, &mut [0xa5; MAX_LINE]), line);
    }
}

#[test]
fn commands_stand_in_the_order_of_their_numbers() {
    for (number, mnemonic) in [(0, "POL"), (25, "IMW"), (135, "MRV"), (253, "IMS"), (254, "IMQ")] {
        assert_eq!(command(number).map(|command| command.mnemonic), Some(mnemonic));
    }
    let known: Vec<u8> = (0..=255).filter(|number| command(*number).is_some()).collect();
    assert_eq!(known.len(), 129, "{known:?}");
    assert_eq!(command(16), None);
}

#[test]
fn each_example_of_the_reference_is_a_command_with_its_parameters_in_their_range() {
    for (line, mnemonic) in [
        ("@16 137 32 1200 10", "JRE"),
        ("@16 138 10 122", "WCL"),
        ("@16 148 0 10 10 10 10 200 1000", "CTC"),
        ("@16 150 10 4", "AHC"),
        ("@16 152 0", "OLP"),
        ("@16 156 150", "LRP"),
        ("@16 162 5 1 10", "JMP/JOI"),
        ("@16 162 112 112 0", "JMP/JOI"),
        ("@16 168 1631 14843 31816 2057 1758 2329 32767 8213", "MCT"),
        ("@16 169 23000 24000 30000", "FLC"),
        ("@16 170", "EEM"),
        ("@16 171", "DEM/DDB"),
        ("@16 172 5 160 37", "PAC"),
        ("@16 180 1024", "SSD"),
        ("@16 184 0", "DIR"),
        ("@16 191 1", "MDT"),
        ("@16 194 1 0", "WBS"),
        ("@16 195 10813", "SCF"),
        ("@16 201 50 2 1", "PCL/PCI"),
        ("@16 201 50 16 16", "PCL/PCI"),
        ("@16 202 7 0", "PRT/PRI"),
        ("@16 204 1 1", "WBE"),
        ("@16 208 200", "PLR"),
        ("@16 211 65524", "CAI"),
        ("@16 215 5 10", "CLC"),
        ("@16 222 20000 5", "TRU"),
        ("@16 223 11", "RSD"),
        ("@16 230 83", "AHD"),
        ("@16 236 20 0 0", "XAT"),
        ("@16 238 61440 61440 10", "JNA"),
        ("@16 245 28", "PCP"),
        ("@16 251", "EDH"),
    ] {
        let request = AnyRequest::parse(line.as_bytes()).unwrap();
        let command = request.command().unwrap();
        assert_eq!(
            (command.mnemonic, command.parameters.len()),
            (mnemonic, request.parameters.as_slice().len())
        );
        let all = command.parameters.iter().zip(request.parameters.as_slice());
        all.for_each(|(parameter, value)| assert!(parameter.takes(*value), "{line}: {}", parameter.name));
    }
}

#[test]
fn what_is_no_request_is_refused_with_its_place() {
    for (text, why) in [
        ("", "begins neither"),
        ("*16 0", "begins neither"),
        ("@", "octet 1: no unit"),
        ("@0 0", "octet 1: unit 0 is outside 1..=255"),
        ("@256 0", "octet 1: unit 256 is outside"),
        ("@16 256", "octet 4: command 256 is outside"),
        ("@16  0", "octet 4: no command"),
        ("@16 11 4294967296 1", "octet 7: parameter 4294967296 is outside"),
        ("@16 11 40 1x", "octet 10: no parameter"),
        ("@16 11 40 ", "octet 10: no parameter"),
        ("@16 0 1 2 3 4 5 6 7 8 9", "octet 21: more than 8 parameters"),
    ] {
        let refused = AnyRequest::parse(text.as_bytes()).unwrap_err().to_string();
        assert!(refused.contains(why), "{text}: {refused}");
    }
}

#[test]
fn what_is_no_answer_is_refused() {
    for text in [
        "",
        "@16 0",
        "*",
        "* 1",
        "*10",
        "* 10 ",
        "* 100",
        "# 10 00C 0001",
        "# 10 000C 1",
        "! 10 0019",
        "# 10",
    ] {
        assert!(Reply::parse(text.as_bytes()).is_err(), "{text}");
    }
}

#[test]
fn octets_that_are_no_line_are_shown_and_cost_no_line_after_them() {
    let mut collector = LineCollector::of_requests();
    let mut found = Vec::new();
    for octet in *b"x\r@16 12 \x00@16 0\r@17 0\r" {
        found.extend(collector.push(octet).map(|collected| format!("{collected:?}")));
    }
    let shown = |collected: Collected<'_>| format!("{collected:?}");
    assert_eq!(
        found,
        [
            shown(Collected::Stray(b"x\r")),
            shown(Collected::Stray(b"@16 12 \x00")),
            shown(Collected::Line(b"@16 0")),
            shown(Collected::Line(b"@17 0")),
        ]
    );
    assert_eq!(collector.rest(), b"");
    let long = [b'1'; 3 * MAX_LINE];
    collector.push(b'@');
    let strays = long.iter().filter(|octet| collector.push(**octet).is_some()).count();
    assert_eq!((strays, collector.rest().len()), (3, 1), "no line grows without end");
}

#[test]
fn the_inputs_are_where_the_manual_has_them() {
    // The printed answer F0F0: inputs 4 to 7 and 1 to 3 high, not hot (page 20).
    let io = Io(0xf0f0);
    assert!((1..=7).all(|input| io.has(Io::input_bit(input))));
    assert_eq!(Io::input_bit(0) | Io::input_bit(8), 0);
    assert_eq!(
        (1..=7).map(Io::input_bit).collect::<Vec<_>>(),
        [0x10, 0x20, 0x40, 0x1000, 0x2000, 0x4000, 0x8000]
    );
    assert_eq!(Poll(0x1008).names().collect::<Vec<_>>(), ["program error or dry queue", "killed"]);
    assert!(Internal(0x0100).is_hot() && !Internal(0x00f3).is_hot());
}

proptest! {
    #[test]
    fn any_octets_are_read_without_a_panic(octets in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = (AnyRequest::parse(&octets), Reply::parse(&octets));
        let _ = (NineBit::request(&octets), NineBit::reply(&octets));
        for mut collector in [LineCollector::of_requests(), LineCollector::of_replies()] {
            let mut seen = Vec::new();
            for octet in &octets {
                match collector.push(*octet) {
                    Some(Collected::Line(line)) => {
                        seen.extend_from_slice(line);
                        seen.push(b'\r');
                    }
                    Some(Collected::Stray(stray)) => seen.extend_from_slice(stray),
                    None => {}
                }
            }
            seen.extend_from_slice(collector.rest());
            prop_assert_eq!(&seen, &octets, "no octet is lost");
        }
    }

    #[test]
    fn lines_of_any_characters_of_the_protocol_are_read_without_a_panic(line in "[@*#! 0-9A-F-]{0,60}") {
        let _ = (AnyRequest::parse(line.as_bytes()), Reply::parse(line.as_bytes()));
    }

    #[test]
    fn what_is_written_is_read_as_the_same(
        unit in 1_u8..=255, ticks in 0..=u32::MAX, position: i32, acceleration: u32, velocity: u32
    ) {
        let request = Request::ImmediateSegment { ticks, position, acceleration, velocity };
        let mut buf = [0xa5; MAX_LINE];
        let line = line(LineCollector::of_requests(), request.emit(unit, &mut buf));
        let read = AnyRequest::parse(&line).unwrap();
        prop_assert_eq!((read.unit, read.number, read.parameters), (unit, 25, request.parameters()));
        prop_assert_eq!(sendable(&read), Some(request));
    }

    #[test]
    fn answers_are_read_as_they_were_written(
        unit: u8, command: u16, words in prop::collection::vec(any::<u16>(), 0..=8), reason: u16
    ) {
        let data = Reply::Data { unit, command, words: Words::of(&words) };
        for reply in [Reply::Ack { unit }, data, Reply::Nak { unit, command, reason: NakReason::of(reason) }] {
            let mut buf = [0xa5; MAX_LINE];
            let octets = reply.emit(&mut buf);
            prop_assert_eq!(Reply::parse(&octets[..octets.len() - 1]), Ok(reply));
        }
    }

    #[test]
    fn a_register_survives_its_two_words(value: i32) {
        prop_assert_eq!(Words::of_value(value).value(), Some(value));
    }
}
