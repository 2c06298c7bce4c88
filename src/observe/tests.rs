use super::*;
use crate::wire::{Access, DP_INPUTS, FrameNo, RegisterReply, Timing, VibrationPort, Words};

const X01: u16 = 0b0001;
const STATION: Code = Code(0x0fc9);

fn at(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

fn observer(dialect: Dialect) -> Observer {
    Observer::new(vec![Watched {
        address: "192.168.15.201:7408".parse().unwrap(),
        dialect,
        vibration_port: VibrationPort::Two,
        estop_inputs: X01,
    }])
}

fn reply() -> MotionReply {
    MotionReply {
        timing: Timing::Relative,
        code: ReplyCode::Running,
        channel: 0,
        error: 0,
        frame: FrameNo::FIRST,
        time_ms: 10,
        positions: PerAxis::new(&[Pulses(7); 3]),
        inputs: 0,
        extend: 0,
        vibration: None,
    }
}

/// The first reply to the frame of that number.
fn answers(observer: &mut Observer, frame: u32, code: ReplyCode, error: u16, inputs: u16, at: MonoTime) {
    observer.on_answer(0, &FirstAnswer { frame: FrameNo(frame), code, error, inputs }, at);
}

const CALM: Look = Look { stop: StopSign::Over, inputs: None };

fn status(station: Code, error: u16, servo_errors: [u16; 3]) -> Status {
    Status {
        station,
        positions: PerAxis::new(&[Pulses(100), Pulses(200), Pulses(300)]),
        forces: PerAxis::new(&[1, -2, 3]),
        servo_errors: PerAxis::new(&servo_errors),
        error,
        outputs: 0b11,
        inputs: 0,
    }
}

fn happened(observer: &Observer) -> Vec<(u64, String)> {
    observer.events().map(|event| (event.at.as_nanos() / 1_000_000, event.what.to_string())).collect()
}

#[test]
fn an_emergency_stop_is_one_event_however_many_replies_say_so_and_only_looks_end_it() {
    let mut observer = observer(Dialect::Smc);
    for frame in 1..5 {
        answers(&mut observer, frame, ReplyCode::EmergencyStop, 0, 0, at(u64::from(frame)));
    }
    assert!(observer.states()[0].emergency_stop());
    answers(&mut observer, 9, ReplyCode::Running, 0, 0, at(9));
    assert!(observer.states()[0].emergency_stop(), "it may have been asked before it was pressed");
    observer.on_look(0, Look { stop: StopSign::Unsure, inputs: None }, at(10));
    assert!(observer.states()[0].emergency_stop());
    observer.on_look(0, CALM, at(11));
    assert!(!observer.states()[0].emergency_stop());
    let words = ["emergency stop in effect (x = 4)", "emergency stop over"].map(str::to_owned);
    assert_eq!(happened(&observer), [(1, words[0].clone()), (11, words[1].clone())]);
}

#[test]
fn a_register_answer_tells_of_an_emergency_stop_where_no_input_is_named_and_no_frame_is_sent() {
    let mut observer = observer(Dialect::Smc);
    observer.on_code(0, ReplyCode::EmergencyStop, at(1));
    assert!(observer.states()[0].emergency_stop());
    observer.on_code(0, ReplyCode::Fault, at(2));
    assert!(observer.states()[0].emergency_stop());
}

#[test]
fn an_answer_to_a_frame_older_than_the_newest_that_was_answered_says_nothing() {
    let mut observer = observer(Dialect::Smc);
    answers(&mut observer, 7, ReplyCode::Running, 0, 0, at(1));
    for frame in [6, 7] {
        answers(&mut observer, frame, ReplyCode::EmergencyStop, 21, X01, at(2));
    }
    assert!(!observer.states()[0].emergency_stop() && happened(&observer).is_empty());
}

#[test]
fn a_configured_input_means_an_emergency_stop_until_a_look_finds_no_sign_of_it() {
    let mut observer = observer(Dialect::Smc);
    answers(&mut observer, 1, ReplyCode::Running, 0, X01, at(1));
    answers(&mut observer, 2, ReplyCode::EmergencyStop, 0, X01, at(2));
    answers(&mut observer, 3, ReplyCode::Running, 0, 0, at(3));
    observer.on_look(0, Look { stop: StopSign::Asked, inputs: Some(X01) }, at(4));
    assert!(observer.states()[0].emergency_stop());
    observer.on_look(0, Look { stop: StopSign::Over, inputs: Some(0) }, at(5));
    let words: Vec<u64> = happened(&observer).into_iter().map(|(ms, _)| ms).collect();
    assert_eq!(words, [1, 5]);
}

#[test]
fn one_that_is_held_until_a_reset_is_told_once_and_pressed_anew_is_one_again() {
    let mut observer = observer(Dialect::Smc);
    let look = |observer: &mut Observer, stop, ms| observer.on_look(0, Look { stop, inputs: None }, at(ms));
    look(&mut observer, StopSign::Held, 1);
    observer.on_code(0, ReplyCode::EmergencyStop, at(2));
    for ms in 3..6 {
        look(&mut observer, StopSign::Held, ms);
    }
    assert!(observer.states()[0].emergency_stop());
    look(&mut observer, StopSign::Asked, 7);
    look(&mut observer, StopSign::Over, 8);
    let expected = [
        (2, "emergency stop in effect (x = 4)"),
        (3, "emergency stop released, and held until a reset"),
        (7, "emergency stop in effect (inputs)"),
        (8, "emergency stop over"),
    ];
    assert_eq!(happened(&observer), expected.map(|(ms, words)| (ms, words.to_owned())));
}

#[test]
fn an_input_that_is_read_tells_of_an_emergency_stop_too_and_looks_alone_that_it_is_over() {
    let mut observer = observer(Dialect::Mbox);
    let mut read = |ms, channel, code, inputs: u16| {
        let (data, access) = ([inputs], Access::Read);
        let data = Words::from(&data[..]);
        let reply = RegisterReply { access, code, channel, error: 0, start: DP_INPUTS, num: 1, data };
        assert!(!observer.hear(0, &FromController::Registers(reply), at(ms)), "somebody asked for it");
        observer.states()[0].emergency_stop()
    };
    assert!(read(1, 0, ReplyCode::Running, X01));
    assert!(read(2, 1, ReplyCode::Running, 0), "of another table");
    assert!(read(3, 0, ReplyCode::Fault, 0), "no value, but an error number");
    assert!(read(4, 0, ReplyCode::Running, !X01));
    observer.on_look(0, Look { stop: StopSign::Over, inputs: Some(!X01) }, at(5));
    assert!(!observer.states()[0].emergency_stop());
}

#[test]
fn other_inputs_mean_nothing() {
    let mut observer = observer(Dialect::Smc);
    answers(&mut observer, 1, ReplyCode::Running, 0, !X01, at(1));
    assert!(!observer.states()[0].emergency_stop() && happened(&observer).is_empty());
}

#[test]
fn on_mbox_x_4_is_no_emergency_stop() {
    let mut observer = observer(Dialect::Mbox);
    answers(&mut observer, 1, ReplyCode::EmergencyStop, 17, 0, at(1));
    observer.on_code(0, ReplyCode::EmergencyStop, at(2));
    assert!(!observer.states()[0].emergency_stop() && happened(&observer).is_empty());
}

#[test]
fn a_status_report_is_measured_and_a_reply_only_echoes() {
    let mut observer = observer(Dialect::Smc);
    observer.on_reply(0, &reply(), at(1));
    assert_eq!(observer.states()[0].measured, None);
    assert!(observer.on_status(0, &status(STATION, 0, [0; 3]), at(2)));
    let state = &observer.states()[0];
    assert_eq!(state.measured.unwrap().value[..], [Pulses(100), Pulses(200), Pulses(300)]);
    assert_eq!(state.echoed.unwrap().value[..], [Pulses(7); 3]);
    assert_eq!((state.outputs.unwrap().value, state.reports), (0b11, 1));
    assert_eq!(state.measured.unwrap().age(at(7)), std::time::Duration::from_millis(5));
}

#[test]
fn a_report_of_another_station_is_not_taken() {
    let mut observer = observer(Dialect::Smc);
    assert!(!observer.on_status(0, &status(Code(0x0fca), 12, [0; 3]), at(2)));
    assert_eq!(observer.states()[0], ControllerState::default());
}

#[test]
fn errors_come_and_go_as_events_in_words() {
    let mut observer = observer(Dialect::Smc);
    observer.on_status(0, &status(STATION, 12, [0, 33, 0]), at(1));
    observer.on_status(0, &status(STATION, 12, [0, 33, 0]), at(2));
    answers(&mut observer, 3, ReplyCode::Running, 0, 0, at(3));
    observer.on_status(0, &status(STATION, 0, [0; 3]), at(4));
    answers(&mut observer, 5, ReplyCode::Fault, 21, 0, at(5));
    answers(&mut observer, 6, ReplyCode::Running, 0, 0, at(6));
    let expected = [
        (1, "drive of axis 2: error 33"),
        (1, "Err12: alarm of the servo of axis 3"),
        (4, "drive of axis 2: error gone"),
        (4, "error gone"),
        (5, "Err21: UDP data buffer overflow; needs a reset"),
        (6, "error gone"),
    ];
    assert_eq!(happened(&observer), expected.map(|(ms, words)| (ms, words.to_owned())));
}

#[test]
fn a_report_of_registers_is_an_alarm_of_an_mbox_controller_and_else_an_event() {
    let say = |dialect, start, data: &[u16]| {
        let mut observer = observer(dialect);
        let data = Words::from(data);
        let report = RegisterReport { channel: 0, accept: Code::NONE, reply: Code::NONE, start, data };
        observer.on_report(0, &report, at(5));
        happened(&observer).remove(0).1
    };
    assert_eq!(say(Dialect::Smc, 0xfe, &[17]), "report of register fe: 0x0011");
    assert_eq!(say(Dialect::Mbox, 0xfe, &[17]), "alarm: DPfe is 17 (0x1001)");
    assert_eq!(say(Dialect::Mbox, 0xfe, &[0]), "alarm over (DPfe is 0)");
    assert_eq!(say(Dialect::Mbox, 0xf5, &[3, 0, 0, 0, 0, 0, 0, 0, 0, 12]), "alarm: DPfe is 12 (0x1001)");
    assert_eq!(say(Dialect::Mbox, 0x5e, &[1]), "alarm: DP5e is 1 (0x1001)");
}

#[test]
fn of_too_many_events_the_oldest_go_and_are_counted() {
    let mut observer = observer(Dialect::Smc);
    for ms in 0..1_001 {
        let error = if ms % 2 == 0 { 12 } else { 0 };
        observer.on_status(0, &status(STATION, error, [0; 3]), at(ms));
    }
    assert_eq!((observer.events().count(), observer.forgotten()), (1_000, 1));
}

#[test]
fn a_report_from_another_port_is_its_senders_unless_two_could_have_sent_it() {
    let watched = |host: u8, port: u16| Watched {
        address: SocketAddrV4::new(Ipv4Addr::new(192, 168, 15, host), port),
        dialect: Dialect::Smc,
        vibration_port: VibrationPort::Two,
        estop_inputs: 0,
    };
    let observer =
        Observer::new(vec![watched(201, 7408), watched(202, 7408), watched(203, 1), watched(203, 2)]);
    let sender = |host: u8, station| observer.sender_of_report(Ipv4Addr::new(192, 168, 15, host), station);
    assert_eq!(sender(202, Some(Code(0x0fca))), Some(1));
    assert_eq!(sender(202, None), Some(1));
    assert_eq!(sender(202, Some(Code(0x0fc9))), None, "it says that it is another");
    assert_eq!((sender(203, Some(Code(0x0fcb))), sender(99, None)), (None, None));
}
