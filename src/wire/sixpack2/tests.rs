//! The codec against golden octets, both ways, and against chance.

use std::collections::BTreeMap;
use std::time::Duration;

use proptest::prelude::*;
use serde::Deserialize;
use serde_json::Value;

use super::*;

#[derive(Deserialize)]
struct GoldenMessage {
    name: String,
    hex: String,
    fields: BTreeMap<String, Value>,
    reply: Option<GoldenAnswer>,
}

#[derive(Deserialize)]
struct GoldenAnswer {
    hex: String,
    fields: BTreeMap<String, Value>,
}

/// Those of a SIXpack 2 in a form.
fn golden(protocol: &str) -> Vec<GoldenMessage> {
    let file = include_str!("../../../tests/data/vectors-drives.json");
    let file: Value = serde_json::from_str(file).unwrap();
    let all = file["vectors"].as_array().unwrap().iter();
    let ours = all.filter(|vector| vector["family"] == "sixpack2" && vector["protocol"] == protocol);
    let ours: Vec<_> = ours.map(|vector| GoldenMessage::deserialize(vector).unwrap()).collect();
    assert!(!ours.is_empty());
    ours
}

fn octets<const N: usize>(hex: &str) -> [u8; N] {
    let octets: Vec<_> = hex.split(' ').map(|octet| u8::from_str_radix(octet, 16).unwrap()).collect();
    octets.try_into().unwrap()
}

/// The fields that were read, as the file writes them.
fn fields(
    head: (&str, u16),
    command: u8,
    tell: impl FnOnce(&mut dyn FnMut(&'static str, i64)),
) -> BTreeMap<String, Value> {
    let mut told: BTreeMap<String, Vec<i64>> = BTreeMap::new();
    tell(&mut |name, value| told.entry(name.to_owned()).or_default().push(value));
    let (one, many): (Vec<_>, Vec<_>) = told.into_iter().partition(|(_, values)| values.len() == 1);
    let one = one.into_iter().map(|(name, values)| (name, Value::from(values[0])));
    let many = many.into_iter().map(|(name, values)| (name, Value::from(values)));
    let head = [(head.0.to_owned(), Value::from(head.1)), ("command".to_owned(), Value::from(command))];
    one.chain(many).chain(head).collect()
}

/// What of `all` the file names: it leaves out what it does not know.
fn named(all: BTreeMap<String, Value>, by: &BTreeMap<String, Value>) -> BTreeMap<String, Value> {
    all.into_iter().filter(|(name, _)| by.contains_key(name)).collect()
}

#[test]
fn every_golden_command_is_read_and_written_as_it_is_printed() {
    for vector in golden("serial") {
        let frame = SixpackFrame::from_octets(octets(&vector.hex));
        let command = SixpackCommand::of(frame);
        let read = fields(("unit", frame.address.into()), frame.command, |to| command.tell(to));
        assert_eq!(read, vector.fields, "{}", vector.name);
        assert_eq!(command.frame(frame.address).octets(), octets(&vector.hex), "{}", vector.name);
        assert!(command.words().is_some(), "{}", vector.name);
    }
}

#[test]
fn every_golden_answer_is_read_written_and_known_for_that_of_its_query() {
    for vector in golden("serial") {
        let query = SixpackCommand::of(SixpackFrame::from_octets(octets(&vector.hex)));
        let Some(answer) = vector.reply else { continue };
        let frame = SixpackFrame::from_octets(octets(&answer.hex));
        let reply = query.answered_by(frame).expect(&vector.name);
        let read = fields(("response", frame.address.into()), frame.command, |to| reply.tell(to));
        assert_eq!(named(read, &answer.fields), answer.fields, "{}", vector.name);
        assert_eq!(reply.frame(frame.address), frame, "{}", vector.name);
        let elsewhere = SixpackFrame { address: 3, ..frame };
        assert_eq!(query.answered_by(elsewhere), None, "{}", vector.name);
        let other = SixpackFrame { command: frame.command + 1, ..frame };
        assert_eq!(query.answered_by(other), None, "{}", vector.name);
    }
}

#[test]
fn an_answer_of_another_motor_or_input_is_none() {
    let of = |motor| PositionTold { motor, position: 8_000, action: 0, stop: 0 };
    let query = SixpackOrder::AskPosition(PositionQuery { motor: 0, response: 2 });
    assert!(query.answered_by(SixpackReply::from(of(0)).frame(2)).is_some());
    assert_eq!(query.answered_by(SixpackReply::from(of(1)).frame(2)), None);
    let supply = SixpackOrder::AskInput(InputQuery { channel: 7, response: 2 });
    let told = InputTold { channel: 6, value: 528, others: [0; 4] };
    assert_eq!(supply.answered_by(SixpackReply::from(told).frame(2)), None);
}

#[test]
fn every_golden_can_frame_is_read_and_written_as_it_is_printed() {
    for vector in golden("can") {
        let id = vector.fields["can_id"].as_u64().and_then(|id| u16::try_from(id).ok()).unwrap();
        let can = CanFrame { id, octets: octets(&vector.hex) };
        let frame = SixpackFrame::try_from(can).unwrap();
        let command = SixpackCommand::of(frame);
        let read = fields(("can_id", id), frame.command, |to| command.tell(to));
        assert_eq!(read, vector.fields, "{}", vector.name);
        assert_eq!(CanFrame::from(command.frame(frame.address)), can, "{}", vector.name);
    }
}

#[test]
fn the_worked_example_of_the_manual_is_only_sent_with_its_searches_off() {
    let vectors = golden("serial");
    let named =
        |name: &str| vectors.iter().find(|vector| vector.name == name).map(|vector| octets(&vector.hex));
    let dangerous = SixpackFrame::from_octets(named("motor_parameters_manual_example").unwrap());
    let SixpackCommand::MotorSettings(settings) = SixpackCommand::of(dangerous) else {
        panic!("{dangerous:?}")
    };
    let sent = SixpackOrder::Motor(settings).frame(1);
    assert_eq!(Some(sent.octets()), named("motor_parameters_made_safe"));
}

#[test]
fn settings_are_sent_as_their_golden_messages() {
    let vectors = golden("serial");
    let currents = CurrentSettings { motor: 0, power_down: 8, stand: 2, run: 1, ramp: 0, t0: 500 };
    for (name, order) in [
        ("peak_current", SixpackOrder::Peak(PeakCurrent { motor: 0, value: 238 })),
        ("current_control", SixpackOrder::Currents(currents)),
        ("start_velocity", SixpackOrder::Start(StartSettings { motor: 0, vmin: 0, vstart: 16, div: 2 })),
        ("clock_divider_3", SixpackOrder::Clock(ClockDivider { divider: 3 })),
        ("zero_offset_and_range", SixpackOrder::Zero(ZeroSettings { motor: 0, offset: -160, range: 64 })),
    ] {
        let golden = vectors.iter().find(|vector| vector.name == name).expect(name);
        assert_eq!(order.frame(1).octets(), octets(&golden.hex), "{name}");
    }
}

#[test]
fn a_stop_is_the_golden_one_and_all_actions_are_never_asked_for_later() {
    let stop = SixpackOrder::RampedStop { motor: 0 }.frame(1);
    assert_eq!(stop.octets(), octets("01 25 00 00 00 00 00 00 00"));
    let actions = SixpackOrder::AskActions { response: 2 }.frame(1);
    assert_eq!(actions.octets(), octets("01 28 02 00 00 00 00 00 00"));
}

#[test]
fn a_motor_that_no_unit_has_and_a_travel_past_its_range_are_faults() {
    let fault = |text: &str| SixpackCommand::of(SixpackFrame::from_octets(octets(text))).fault();
    assert_eq!(fault("01 15 05 FF FF FF 7F 00 20"), None);
    assert_eq!(fault("01 15 06 00 00 00 00 00 20"), Some("no such motor: a unit has 0 to 5"));
    assert_eq!(fault("01 15 00 00 00 00 80 00 20"), Some("Poslimit goes up to 0x7fffffff"));
    assert_eq!(fault("01 24 06 40 1F 00 00 00 00"), Some("no such motor: a unit has 0 to 5"));
}

#[test]
fn a_lost_octet_shifts_frames_until_a_silence_or_a_break() {
    let order = SixpackOrder::Target(PiTarget { motor: 0, target: 8_000 }).frame(1);
    let (soon, long) = (Duration::from_millis(1), Duration::from_millis(21));
    let mut collector = FrameCollector::new(Some(Duration::from_millis(20)));
    let lost = |collector: &mut FrameCollector| {
        for octet in &order.octets()[1..] {
            assert_eq!(collector.push(*octet, soon), None);
        }
        assert_eq!(collector.begun(), &order.octets()[1..]);
    };
    let whole = |collector: &mut FrameCollector, silence| {
        let octets = order.octets().into_iter().enumerate();
        let frames = octets.map(|(at, octet)| collector.push(octet, if at == 0 { silence } else { soon }));
        frames.flatten().last()
    };
    lost(&mut collector);
    assert_ne!(whole(&mut collector, soon), Some(order));
    collector.clear();
    lost(&mut collector);
    assert_eq!(whole(&mut collector, long), Some(order));
    lost(&mut collector);
    collector.clear();
    assert_eq!(whole(&mut collector, soon), Some(order));
    assert_eq!(collector.strays(), 8 + 8 + 8);
    collector.set_timeout(None);
    lost(&mut collector);
    assert_ne!(whole(&mut collector, long), Some(order));
}

#[test]
fn identifiers_that_are_eight_times_no_address_are_none_of_a_unit() {
    for id in [0, 1, 7, 9, 0x7f9, 0x800, u16::MAX] {
        let frame = CanFrame { id, octets: [0; 8] };
        assert_eq!(SixpackFrame::try_from(frame), Err(CanFrameError { id }));
    }
}

proptest! {
    #[test]
    fn any_nine_octets_are_read_and_what_was_read_is_written_the_same(octets: [u8; 9]) {
        let frame = SixpackFrame::from_octets(octets);
        prop_assert_eq!(frame.octets(), octets);
        let command = SixpackCommand::of(frame);
        prop_assert_eq!(SixpackCommand::of(command.frame(frame.address)), command);
        let reply = SixpackReply::of(frame);
        prop_assert_eq!(SixpackReply::of(reply.frame(frame.address)), reply);
        command.tell(|_, _| ());
        let _ = command.answered_by(frame);
    }

    #[test]
    fn any_octets_at_any_times_make_a_frame_of_nine_or_are_counted(
        octets in prop::collection::vec((any::<u8>(), 0_u64..40), 0..200),
    ) {
        let mut collector = FrameCollector::new(Some(Duration::from_millis(20)));
        let frames = octets.iter().filter(|(octet, ms)| {
            collector.push(*octet, Duration::from_millis(*ms)).is_some()
        }).count();
        prop_assert_eq!(frames as u64 * 9 + collector.strays() + collector.begun().len() as u64, octets.len() as u64);
    }

    #[test]
    fn an_address_has_one_identifier_on_a_bus(octets: [u8; 9]) {
        let frame = SixpackFrame::from_octets(octets);
        let back = SixpackFrame::try_from(CanFrame::from(frame));
        prop_assert_eq!(back.ok(), Some(frame).filter(|frame| frame.address > 0));
    }

    #[test]
    fn whatever_flags_are_asked_for_none_that_searches_by_itself_is_sent(motor: u8, poslimit: u32, p5: u8, p6: u8) {
        let asked = MotorSettings { motor, poslimit, p5, p6 };
        let sent = SixpackCommand::of(SixpackOrder::Motor(asked).frame(1));
        let SixpackCommand::MotorSettings(sent) = sent else { panic!("{sent:?}") };
        prop_assert_eq!((sent.p5 & 0b0100_1100, sent.p6 & 0b0010_0000), (0, 0b0010_0000));
        prop_assert_eq!((sent.p5 | 0b0100_1100, sent.p6 | 0b0010_0000), (p5 | 0b0100_1100, p6 | 0b0010_0000));
    }
}
