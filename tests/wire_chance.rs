//! The protocol against chance: what was written is read again, and no bytes whatever make a parser panic.

use kinocue::harness::motion::Pulses;
use kinocue::wire::{
    Access, Code, FrameNo, FromController, ImaxMotion, ImaxRegisters, MAX_LEN, Message, MotionReply,
    MotionRequest, PerAxis, ReadRequest, RegisterReply, RegisterReport, ReplyCode, ServoRead, ServoReply,
    ServoWrite, Status, Timing, Vibration, VibrationPort, Words, WriteRequest, is_printed_imax,
};
use proptest::prelude::*;

fn emitted(message: &Message<'_>) -> Vec<u8> {
    let mut buf = [0xa5; MAX_LEN];
    message.emit(&mut buf).to_vec()
}

fn code() -> impl Strategy<Value = Code> {
    any::<u16>().prop_map(Code)
}

fn reply_code() -> impl Strategy<Value = ReplyCode> {
    (2..=5_u8).prop_map(|x| ReplyCode::from_byte(x).expect("2 to 5 are codes"))
}

fn per_axis<T: Copy + Default + std::fmt::Debug>(
    axes: impl Into<proptest::collection::SizeRange>,
    value: impl Strategy<Value = T>,
) -> impl Strategy<Value = PerAxis<T>> {
    proptest::collection::vec(value, axes).prop_map(|values| PerAxis::new(&values))
}

fn pulses() -> impl Strategy<Value = Pulses> {
    any::<i32>().prop_map(Pulses)
}

fn timing() -> impl Strategy<Value = Timing> {
    prop_oneof![Just(Timing::Absolute), Just(Timing::Relative)]
}

fn vibration(axes: usize) -> impl Strategy<Value = Option<PerAxis<Vibration>>> {
    let one = (any::<u16>(), any::<u16>()).prop_map(|(period, amplitude)| Vibration { period, amplitude });
    proptest::option::of(per_axis(axes, one))
}

/// Channels and the axes that go with them: 0 three, 1 six, 2 any, others their own number.
fn channel_and_axes() -> impl Strategy<Value = (u16, usize)> {
    prop_oneof![
        Just((0, 3)),
        Just((1, 6)),
        (1..=12_usize).prop_map(|axes| (2, axes)),
        (3..=12_u16).prop_map(|axes| (axes, usize::from(axes))),
    ]
}

fn motion() -> impl Strategy<Value = Message<'static>> {
    channel_and_axes().prop_flat_map(|(channel, axes)| {
        let values = (per_axis(axes, pulses()), vibration(axes), any::<u32>());
        let head = (timing(), code(), code(), any::<u32>(), any::<u32>(), any::<u16>());
        (values, head).prop_map(move |((positions, vibration, extend), head)| {
            let (timing, accept, reply, frame, time_ms, outputs) = head;
            Message::Motion(MotionRequest {
                timing,
                channel,
                accept,
                reply,
                frame: FrameNo(frame),
                time_ms,
                positions,
                outputs,
                extend: if vibration.is_some() { 0 } else { extend },
                vibration,
            })
        })
    })
}

fn motion_reply() -> impl Strategy<Value = Message<'static>> {
    (1..=12_usize).prop_flat_map(|axes| {
        let values = (per_axis(axes, pulses()), vibration(axes), any::<u32>());
        let head = (timing(), reply_code(), any::<u16>(), any::<u32>(), any::<u32>(), any::<u16>());
        (values, head).prop_map(|((positions, vibration, extend), head)| {
            let (timing, code, slot, frame, time_ms, inputs) = head;
            let running = code == ReplyCode::Running;
            Message::MotionReply(MotionReply {
                timing,
                code,
                channel: if running { slot } else { 0 },
                error: if running { 0 } else { slot },
                frame: FrameNo(frame),
                time_ms,
                positions,
                inputs,
                extend: if vibration.is_some() { 0 } else { extend },
                vibration,
            })
        })
    })
}

fn status() -> impl Strategy<Value = Message<'static>> {
    (1..=12_usize).prop_flat_map(|axes| {
        let values = (per_axis(axes, pulses()), per_axis(axes, any::<i16>()), per_axis(axes, any::<u16>()));
        (values, code(), any::<[u16; 3]>()).prop_map(
            |((positions, forces, servo_errors), station, [error, outputs, inputs])| {
                Message::Status(Status { station, positions, forces, servo_errors, error, outputs, inputs })
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn what_was_written_is_read_again(message in prop_oneof![motion(), motion_reply(), status()]) {
        let bytes = emitted(&message);
        prop_assert_eq!(Message::parse(&bytes), Ok(message));
        assert_told_apart(&bytes);
    }

    #[test]
    fn surplus_bytes_after_a_frame_change_nothing(
        message in motion().prop_filter("2 takes its axes from the length", |message| {
            !matches!(message, Message::Motion(motion) if motion.channel == 2)
        }),
        surplus in proptest::collection::vec(any::<u8>(), 0..64),
    ) {
        let mut bytes = emitted(&message);
        bytes.extend(surplus);
        prop_assert_eq!(Message::parse(&bytes), Ok(message));
    }

    #[test]
    fn register_messages_are_read_again(
        data in proptest::collection::vec(any::<u16>(), 0..=256),
        (channel, start, asked) in any::<(u16, u16, u16)>(),
        (accept, reply) in (code(), code()),
        (code, read) in (reply_code(), any::<bool>()),
    ) {
        let running = code == ReplyCode::Running;
        let access = if read { Access::Read } else { Access::Write };
        let words = Words::from(&data[..]);
        let there = u16::try_from(data.len()).unwrap();
        let num = if running { there } else { there.saturating_add(asked % 300) };
        let (slot, error) = if running { (channel, 0) } else { (0, channel) };
        for message in [
            Message::Read(ReadRequest { channel, accept, reply, start, num: asked }),
            Message::Write(WriteRequest { channel, accept, reply, start, data: words }),
            Message::RegisterReply(RegisterReply { access, code, channel: slot, error, start, num, data: words }),
            Message::ServoRead(ServoRead { channel, accept, reply, start, num: asked }),
            Message::ServoWrite(ServoWrite { channel, accept, reply, start, data: words }),
            Message::ServoReply(ServoReply { access, code, servo: slot, error, start, num, data: words }),
            Message::Report(RegisterReport { channel, accept, reply, start, data: words }),
        ] {
            let bytes = emitted(&message);
            prop_assert_eq!(Message::parse(&bytes), Ok(message));
            assert_told_apart(&bytes);
        }
    }
}

/// Reads bytes in every way there is.
fn read_all_ways(bytes: &[u8]) {
    let _ = Message::parse(bytes);
    let _ = MotionReply::parse(bytes);
    let _ = ImaxMotion::parse(bytes);
    if let Ok(reply) = ImaxRegisters::parse(bytes) {
        let _ = reply.values().count();
    }
    assert_told_apart(bytes);
}

/// What a controller may send is told apart at once as each reader of one message alone would tell.
fn assert_told_apart(bytes: &[u8]) {
    let told = FromController::parse(VibrationPort::Two, bytes);
    let (reply, registers) = (MotionReply::parse(bytes).ok(), RegisterReply::parse(bytes).ok());
    let (status, report) = (Status::parse(bytes).ok(), RegisterReport::parse(bytes).ok());
    let alone = match (reply, registers, status, report) {
        (Some(reply), None, None, None) => FromController::Reply(reply),
        (None, Some(registers), None, None) => FromController::Registers(registers),
        (None, None, Some(status), None) => FromController::Status(status),
        (None, None, None, Some(report)) => FromController::Report(report),
        (None, None, None, None) if is_printed_imax(bytes) => FromController::PrintedImax,
        (None, None, None, None) => FromController::Other,
        more => panic!("two readers take it: {more:?}"),
    };
    assert_eq!(told, alone);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn no_bytes_whatever_are_too_much(bytes in proptest::collection::vec(any::<u8>(), 0..=2048)) {
        read_all_ways(&bytes);
    }

    #[test]
    fn no_bytes_after_a_true_opening_are_too_much(
        family in prop::sample::select(&[0x10, 0x11, 0x12, 0x13, 0x14, 0x18, 0x19, 0x21, 0x22, 0x31][..]),
        x in 0..=6_u8,
        slot in prop_oneof![0..16_u16, any::<u16>()],
        rest in proptest::collection::vec(any::<u8>(), 0..=2040),
    ) {
        let confirm: u16 = if matches!(family, 0x21 | 0x22 | 0x31) { 0x33cc } else { 0x55aa };
        let mut bytes = confirm.to_be_bytes().to_vec();
        bytes.extend([0, 0, family, x]);
        bytes.extend(slot.to_be_bytes());
        bytes.extend(rest);
        read_all_ways(&bytes);
    }
}
