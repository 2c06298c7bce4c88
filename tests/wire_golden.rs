//! The protocol against bytes from the manuals and from public programs, both ways.

use kinocue::harness::motion::Pulses;
use kinocue::wire::{
    Access, Analogue, Code, FrameNo, ImaxMotion, ImaxRegisters, MAX_LEN, Message, MotionReply, MotionRequest,
    PerAxis, ReadRequest, RegisterReply, RegisterReport, ReplyCode, ServoRead, ServoReply, ServoWrite,
    Status, Timing, Vibration, VibrationPort, WireError, Words, WriteRequest,
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Golden {
    vectors: Vec<Vector>,
}

#[derive(Deserialize)]
struct Vector {
    name: String,
    kind: String,
    #[serde(default)]
    dialect: String,
    fields: Fields,
    hex: String,
}

/// The fields of every kind together; each uses its own.
#[derive(Deserialize, Default)]
#[serde(default)]
struct Fields {
    x: u8,
    channel: u16,
    servo: u16,
    accept: u16,
    reply: u16,
    error: u16,
    frame: u32,
    time: u32,
    pos: Vec<i32>,
    port: u16,
    ext: u32,
    period: Vec<u16>,
    amplitude: Vec<u16>,
    start: u16,
    num: u16,
    data: Vec<u16>,
    tail: String,
    id: u16,
    force: Vec<i16>,
    servo_error: Vec<u16>,
    port_out: u16,
    port_in: u16,
    reason: String,
}

impl Vector {
    /// How its vibration frames have Port Out.
    fn port(&self) -> VibrationPort {
        if self.dialect == "port4" { VibrationPort::Four } else { VibrationPort::Two }
    }
}

impl Fields {
    fn positions(&self) -> PerAxis<Pulses> {
        PerAxis::from_fn(self.pos.len(), |axis| Pulses(self.pos[axis]))
    }

    fn vibration(&self) -> PerAxis<Vibration> {
        PerAxis::from_fn(self.period.len(), |axis| Vibration {
            period: self.period[axis],
            amplitude: self.amplitude[axis],
        })
    }

    fn code(&self) -> ReplyCode {
        ReplyCode::from_byte(self.x).expect("the golden file gives a reply its x")
    }

    fn motion(&self, timing: Timing, vibrating: bool) -> Message<'_> {
        Message::Motion(MotionRequest {
            timing,
            channel: self.channel,
            accept: Code(self.accept),
            reply: Code(self.reply),
            frame: FrameNo(self.frame),
            time_ms: self.time,
            positions: self.positions(),
            outputs: self.port,
            extend: self.ext,
            vibration: vibrating.then(|| self.vibration()),
        })
    }

    fn motion_reply(&self, timing: Timing, vibrating: bool) -> Message<'_> {
        Message::MotionReply(MotionReply {
            timing,
            code: self.code(),
            channel: self.channel,
            error: self.error,
            frame: FrameNo(self.frame),
            time_ms: self.time,
            positions: self.positions(),
            inputs: self.port,
            extend: self.ext,
            vibration: vibrating.then(|| self.vibration()),
        })
    }

    fn register_reply(&self, access: Access) -> Message<'_> {
        Message::RegisterReply(RegisterReply {
            access,
            code: self.code(),
            channel: self.channel,
            error: self.error,
            start: self.start,
            num: self.num,
            data: self.words(),
        })
    }

    fn servo_reply(&self, access: Access) -> Message<'_> {
        Message::ServoReply(ServoReply {
            access,
            code: self.code(),
            servo: self.servo,
            error: self.error,
            start: self.start,
            num: self.num,
            data: self.words(),
        })
    }

    fn words(&self) -> Words<'_> {
        Words::from(&self.data[..])
    }

    fn message(&self, kind: &str) -> Message<'_> {
        let (accept, reply) = (Code(self.accept), Code(self.reply));
        let (channel, servo, start, num) = (self.channel, self.servo, self.start, self.num);
        match kind {
            "motion_abs" => self.motion(Timing::Absolute, false),
            "motion_rel" => self.motion(Timing::Relative, false),
            "vib_abs" => self.motion(Timing::Absolute, true),
            "vib_rel" => self.motion(Timing::Relative, true),
            "motion_abs_reply" => self.motion_reply(Timing::Absolute, false),
            "motion_rel_reply" => self.motion_reply(Timing::Relative, false),
            "vib_abs_reply" => self.motion_reply(Timing::Absolute, true),
            "vib_rel_reply" => self.motion_reply(Timing::Relative, true),
            "reg_read" => Message::Read(ReadRequest { channel, accept, reply, start, num }),
            "reg_write" => Message::Write(WriteRequest { channel, accept, reply, start, data: self.words() }),
            "reg_read_reply" => self.register_reply(Access::Read),
            "reg_write_reply" => self.register_reply(Access::Write),
            "servo_read" => Message::ServoRead(ServoRead { channel: servo, accept, reply, start, num }),
            "servo_write" => {
                Message::ServoWrite(ServoWrite { channel: servo, accept, reply, start, data: self.words() })
            }
            "servo_read_reply" => self.servo_reply(Access::Read),
            "servo_write_reply" => self.servo_reply(Access::Write),
            "report" => Message::Report(RegisterReport { channel, accept, reply, start, data: self.words() }),
            "status" => Message::Status(Status {
                station: Code(self.id),
                positions: self.positions(),
                forces: PerAxis::new(&self.force),
                servo_errors: PerAxis::new(&self.servo_error),
                error: self.error,
                outputs: self.port_out,
                inputs: self.port_in,
            }),
            other => panic!("the golden file has a kind that no test knows: {other}"),
        }
    }
}

fn golden() -> Vec<Vector> {
    let golden: Golden =
        serde_json::from_str(include_str!("golden/wire.json")).expect("the golden file is as its about says");
    golden.vectors
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len())
        .step_by(2)
        .map(|at| u8::from_str_radix(&hex[at..at + 2], 16).expect("the golden file is hex"))
        .collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn emitted(message: &Message<'_>, port: VibrationPort) -> Vec<u8> {
    let mut buf = [0xa5; MAX_LEN];
    match message {
        Message::Motion(motion) => motion.emit_as(port, &mut buf).to_vec(),
        Message::MotionReply(reply) => reply.emit_as(port, &mut buf).to_vec(),
        other => other.emit(&mut buf).to_vec(),
    }
}

#[test]
fn golden_bytes_say_what_they_should_and_are_written_the_same() {
    let mut kinds = std::collections::BTreeSet::new();
    for vector in golden().iter().filter(|v| v.kind != "malformed" && v.dialect != "imax") {
        let (name, fields) = (&vector.name, &vector.fields);
        let bytes = bytes(&vector.hex);
        let message = fields.message(&vector.kind);
        assert_eq!(Message::parse_as(vector.port(), &bytes), Ok(message), "{name}");
        assert_eq!(hex(&emitted(&message, vector.port())) + &fields.tail, vector.hex, "{name}");
        kinds.insert(vector.kind.clone());
    }
    assert_eq!(kinds.len(), 18, "every kind of message has its bytes: {kinds:?}");
}

#[test]
fn a_host_writes_the_golden_frames_but_never_the_extend_of_the_vendors_sample() {
    let mut meant = std::collections::BTreeSet::new();
    for vector in golden().iter().filter(|v| v.dialect != "imax" && v.fields.x == 1) {
        let Message::Motion(request) = (match vector.kind.as_str() {
            "motion_abs" | "motion_rel" | "vib_abs" | "vib_rel" => vector.fields.message(&vector.kind),
            _ => continue,
        }) else {
            panic!("{}: these kinds are frames", vector.name);
        };
        let frame = kinocue::wire::Motion {
            timing: request.timing,
            channel: request.channel,
            accept: request.accept,
            reply: request.reply,
            frame: request.frame,
            time_ms: request.time_ms,
            positions: &request.positions,
            outputs: request.outputs,
            analogue: Analogue::of_extend(request.extend),
            vibration: request.vibration.as_deref(),
        };
        let extend = if request.extend == 0x5678_abcd { 0 } else { request.extend };
        meant.insert(extend);
        let expected = Message::Motion(MotionRequest { extend, ..request });
        let mut buf = [0xa5; MAX_LEN];
        let written = hex(frame.emit_as(vector.port(), &mut buf));
        assert_eq!(written, hex(&emitted(&expected, vector.port())), "{}", vector.name);
    }
    assert!(meant.len() > 1, "an analogue output that is on is among them: {meant:x?}");
}

#[test]
fn malformed_bytes_are_refused_for_their_own_fault() {
    for vector in golden().iter().filter(|v| v.kind == "malformed") {
        let bytes = bytes(&vector.hex);
        let error = Message::parse(&bytes).unwrap_err();
        let reason = match error {
            WireError::Short { .. } => "short",
            WireError::Confirm { .. } => "confirm",
            WireError::Axes { .. } => "axes",
            WireError::Length { .. } => "length",
            _ => "other",
        };
        assert_eq!(reason, vector.fields.reason, "{}: {error}", vector.name);
        assert!(error.offset() <= bytes.len(), "{}: {error}", vector.name);
    }
}

#[test]
fn the_literal_imax_layout_is_read() {
    let mut seen = 0;
    for vector in golden().iter().filter(|v| v.dialect == "imax") {
        let (name, fields) = (&vector.name, &vector.fields);
        let bytes = bytes(&vector.hex);
        seen += 1;
        if vector.kind == "reg_read_reply" {
            let reply = ImaxRegisters::parse(&bytes).unwrap();
            assert_eq!(reply.values().collect::<Vec<_>>(), [3, 0], "{name}");
            assert!(reply.is_wide(), "{name}");
            let need = bytes.len() - 4;
            let surplus = WireError::Surplus { len: bytes.len(), need };
            assert_eq!(Message::parse(&bytes), Err(surplus), "{name}: nobody reads it as words of 16 bits");
            continue;
        }
        let motion = ImaxMotion::parse(&bytes).unwrap();
        assert_eq!(motion.code, ReplyCode::from_byte(fields.x), "{name}");
        assert_eq!(motion.timing, Timing::Relative, "{name}");
        assert_eq!((motion.channel, motion.time_ms), (fields.channel, fields.time), "{name}");
        assert_eq!(motion.positions, fields.positions(), "{name}");
        assert_eq!((motion.port, motion.dac), (u32::from(fields.port), fields.ext), "{name}");
    }
    assert_eq!(seen, 4);
}

#[test]
fn the_ack_path_takes_all_replies_to_motion_and_nothing_else() {
    for vector in golden().iter().filter(|v| v.dialect != "imax") {
        let bytes = bytes(&vector.hex);
        let is_reply = matches!(Message::parse_as(vector.port(), &bytes), Ok(Message::MotionReply(_)));
        let parsed = MotionReply::parse_as(vector.port(), &bytes);
        assert_eq!(parsed.is_ok(), is_reply, "{}", vector.name);
    }
}

#[test]
fn a_channel_that_means_no_axes_is_refused_where_it_stands() {
    let mut frame = bytes(&golden()[0].hex);
    frame[7] = 13;
    let error = Message::parse(&frame).unwrap_err();
    assert_eq!(error, WireError::Axes { at: 6, found: 13 });
    assert_eq!(error.to_string(), "byte 6: 13 does not fit 3 to 12 axes");
}

#[test]
fn every_length_of_every_golden_message_is_taken_or_refused() {
    for vector in golden() {
        let bytes = bytes(&vector.hex);
        for len in 0..=bytes.len() {
            if let Err(error) = Message::parse(&bytes[..len]) {
                assert!(error.offset() <= len, "{} cut to {len}: {error}", vector.name);
            }
        }
    }
}
