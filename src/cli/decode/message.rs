//! The messages of the protocol to their sheets.

use super::names::{motion_name, space_name};
use super::sheet::{self, FieldSheet};
use crate::wire::{
    Access, Dialect, ImaxMotion, ImaxRegisters, MAX_SERVO_READ, Message, MotionReply, MotionRequest,
    RegisterReply, ReplyCode, Space, Status, VibrationPort, WireError,
};

/// How to read a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum MessageReading {
    Smc,
    Mbox,
    Imax,
    Silvermax,
    Sixpack2,
}

impl MessageReading {
    const fn dialect(self) -> Dialect {
        match self {
            Self::Mbox | Self::Imax => Dialect::Mbox,
            // Serial drives have a decoder of their own.
            Self::Smc | Self::Silvermax | Self::Sixpack2 => Dialect::Smc,
        }
    }
}

/// The fields of a message.
///
/// # Errors
/// At which byte, and why, these bytes are none.
pub(super) fn sheet(
    bytes: &[u8],
    reading: MessageReading,
    port: VibrationPort,
) -> Result<FieldSheet, WireError> {
    let mut sheet = FieldSheet::default();
    if reading == MessageReading::Imax {
        if let Ok(motion) = ImaxMotion::parse(bytes) {
            sheet.imax_motion(bytes, &motion);
            return Ok(sheet);
        }
        if let Ok(reply) = ImaxRegisters::parse(bytes) {
            sheet.imax_registers(bytes, &reply);
            return Ok(sheet);
        }
    }
    let message = Message::parse_as(port, bytes)?;
    sheet.message(bytes, &message, reading.dialect(), port);
    Ok(sheet)
}

/// Bytes of a message about registers before its words.
const WORDS: usize = 16;

impl FieldSheet {
    fn message(&mut self, bytes: &[u8], message: &Message<'_>, dialect: Dialect, port: VibrationPort) {
        match message {
            Message::Motion(motion) => {
                self.motion(bytes, motion);
                self.surplus(bytes, motion.layout_len(port));
            }
            Message::MotionReply(reply) => {
                self.motion_reply(bytes, reply, dialect);
                self.surplus(bytes, reply.layout_len(port));
            }
            Message::Read(read) => {
                self.head(bytes, "read registers", true);
                self.codes(read.accept, read.reply);
                let space = Space::of_read(read.channel);
                self.channel(read.channel, space_name(space));
                self.asked(read.start, read.num, space);
                self.surplus(bytes, WORDS);
            }
            Message::Write(write) => {
                self.head(bytes, "write registers", true);
                self.codes(write.accept, write.reply);
                let space = Space::of_write(write.channel, dialect);
                self.channel(write.channel, space_name(space));
                self.registers(write.start, write.data, space);
                self.surplus(bytes, WORDS + 2 * write.data.len());
            }
            Message::RegisterReply(reply) => self.register_reply(bytes, reply, dialect),
            Message::ServoRead(_) | Message::ServoWrite(_) | Message::ServoReply(_) => {
                self.servo(bytes, message, dialect);
            }
            Message::Status(status) => self.status(bytes, status),
            Message::Report(report) => {
                self.head(bytes, "report of registers", false);
                let space = Space::of_read(report.channel);
                self.channel(report.channel, space_name(space));
                self.registers(report.start, report.data, space);
                self.surplus(bytes, WORDS + 2 * report.data.len());
            }
        }
    }

    fn register_reply(&mut self, bytes: &[u8], reply: &RegisterReply<'_>, dialect: Dialect) {
        let (what, space) = match reply.access {
            Access::Read => ("reply to read registers", Space::of_read(reply.channel)),
            Access::Write => ("reply to write registers", Space::of_write(reply.channel, dialect)),
        };
        let space = space.filter(|_| reply.code == ReplyCode::Running);
        self.head(bytes, what, false);
        self.answer(reply.code, dialect);
        self.slot(reply.code, reply.channel, space_name(space), reply.error, dialect);
        self.told(reply.start, reply.num, reply.values(dialect), space);
        if dialect == Dialect::Mbox && reply.code.refused() {
            // In place of words, of 16 or 32 bits (IMAX manual 2.2.2.3).
            self.error(reply.data.iter().find(|word| *word != 0).unwrap_or(0));
        }
        if reply.access == Access::Read && space == Some(Space::Monitor) {
            self.monitored_positions(reply.start, reply.data, dialect);
        }
        self.surplus(bytes, WORDS + 2 * reply.data.len());
    }

    fn motion(&mut self, bytes: &[u8], motion: &MotionRequest) {
        self.head(bytes, motion_name(motion.timing, motion.vibration.is_some()), true);
        self.codes(motion.accept, motion.reply);
        self.channel(motion.channel, &format!("{} axes", motion.positions.len()));
        self.numbered("frame", motion.frame.0);
        self.time(motion.timing, motion.time_ms);
        self.positions(&motion.positions);
        self.bits("outputs", 'Y', u32::from(motion.outputs));
        self.tail(motion.extend, motion.vibration.as_deref());
    }

    fn motion_reply(&mut self, bytes: &[u8], reply: &MotionReply, dialect: Dialect) {
        let what = format!("reply to {}", motion_name(reply.timing, reply.vibration.is_some()));
        self.head(bytes, &what, false);
        self.answer(reply.code, dialect);
        let axes = format!("{} axes", reply.positions.len());
        self.slot(reply.code, reply.channel, &axes, reply.error, dialect);
        self.numbered("frame", reply.frame.0);
        self.time(reply.timing, reply.time_ms);
        self.positions(&reply.positions);
        self.bits("inputs", 'X', u32::from(reply.inputs));
        self.tail(reply.extend, reply.vibration.as_deref());
    }

    fn servo(&mut self, bytes: &[u8], message: &Message<'_>, dialect: Dialect) {
        match message {
            Message::ServoRead(read) => {
                self.head(bytes, "read servo registers", true);
                self.codes(read.accept, read.reply);
                self.numbered("servo", u32::from(read.channel));
                self.asked(read.start, read.num, None);
                if read.num > MAX_SERVO_READ {
                    self.line(
                        "note",
                        format!("a controller answers at most {MAX_SERVO_READ} registers at once"),
                    );
                }
                self.surplus(bytes, WORDS);
            }
            Message::ServoWrite(write) => {
                self.head(bytes, "write servo registers", true);
                self.codes(write.accept, write.reply);
                self.numbered("servo", u32::from(write.channel));
                self.registers(write.start, write.data, None);
                self.surplus(bytes, WORDS + 2 * write.data.len());
            }
            Message::ServoReply(reply) => {
                let what = match reply.access {
                    Access::Read => "reply to read servo registers",
                    Access::Write => "reply to write servo registers",
                };
                self.head(bytes, what, false);
                self.answer(reply.code, dialect);
                if reply.code == ReplyCode::Running {
                    self.numbered("servo", u32::from(reply.servo));
                } else {
                    self.error(reply.error);
                }
                self.told(reply.start, reply.num, reply.data, None);
                self.surplus(bytes, WORDS + 2 * reply.data.len());
            }
            _ => {}
        }
    }

    fn status(&mut self, bytes: &[u8], status: &Status) {
        self.head(bytes, "status report", false);
        self.station(status.station);
        self.positions(&status.positions);
        self.forces(&status.forces);
        self.servo_errors(&status.servo_errors);
        match status.error {
            0 => self.field("error", "none", 0),
            number => self.error(number),
        }
        self.bits("outputs", 'Y', u32::from(status.outputs));
        self.bits("inputs", 'X', u32::from(status.inputs));
    }

    fn imax_motion(&mut self, bytes: &[u8], motion: &ImaxMotion) {
        let name = motion_name(motion.timing, false);
        let reply = if motion.code.is_some() { "reply to " } else { "" };
        self.head(
            bytes,
            &format!("{reply}{name}, IMAX layout without a frame number"),
            motion.code.is_none(),
        );
        match motion.code {
            Some(code) => self.answer(code, Dialect::Mbox),
            None => self.codes(motion.accept, motion.reply),
        }
        self.channel(motion.channel, &format!("{} axes", motion.positions.len()));
        self.time(motion.timing, motion.time_ms);
        self.positions(&motion.positions);
        match motion.code {
            Some(_) => self.bits("inputs", 'X', motion.port),
            None => self.bits("outputs", 'Y', motion.port),
        }
        self.field("analogue outputs", sheet::analogue(motion.dac), motion.dac);
    }

    fn imax_registers(&mut self, bytes: &[u8], reply: &ImaxRegisters<'_>) {
        let what = match reply.access {
            Access::Read => "reply to read registers, IMAX layout of 32 bits",
            Access::Write => "reply to write registers, IMAX layout of 32 bits",
        };
        self.head(bytes, what, false);
        self.answer(reply.code, Dialect::Mbox);
        self.field("channel", reply.channel, reply.channel);
        self.asked(reply.start, reply.num, None);
        let values: Vec<_> = reply.values().collect();
        match values.first() {
            Some(error) if reply.code.refused() => self.error(u16::try_from(*error).unwrap_or(u16::MAX)),
            _ => self.wide_registers(reply.start, &values),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn read(hex: &str, reading: MessageReading) -> FieldSheet {
        let bytes: Vec<u8> =
            (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect();
        sheet(&bytes, reading, VibrationPort::Two).unwrap()
    }

    #[test]
    fn a_frame_with_vibration_is_told_field_by_field() {
        let sheet = read(
            "55aa000019010000ffff00000000000300000032ffffffff00000000000000018802\
             0190000a0000000000000000",
            MessageReading::Smc,
        );
        assert_eq!(
            sheet.text(),
            "\
message    motion with vibration, relative time
function   0x1901
direction  host to controller
bytes      46
accept     ffff: every station
reply      0000: nobody answers
channel    0: 3 axes
frame      3
time       50 ms to reach the positions
a1         -1 pulses
a2         0 pulses
a3         1 pulses
outputs    Y02 Y12 (0x8802)
v1         20.00 Hz, 10 pulses (period 400 x 0.125 ms)
v2         none
v3         none
"
        );
    }

    #[test]
    fn a_refusal_is_told_with_its_error_in_words() {
        let text = read("55aa00001203000a00000000005500010005", MessageReading::Smc).text();
        assert!(text.contains("x = 3: running with an error"), "{text}");
        assert!(text.contains("Err10: alarm of the servo of axis 1"), "{text}");
    }

    #[test]
    fn a_refusal_of_a_read_or_write_shows_its_error_where_each_dialect_has_it() {
        for function in ["1103", "1203"] {
            let smc = format!("55aa0000{function}000a0000000000550001");
            let mbox = format!("55aa0000{function}00010000000000550001000a");
            let wide = format!("55aa0000{function}000100000000005500010000000a");
            let readings =
                [(smc, MessageReading::Smc), (mbox, MessageReading::Mbox), (wide, MessageReading::Imax)];
            for (hex, reading) in readings {
                let text = read(&hex, reading).text();
                assert!(
                    text.contains("error      Err10: alarm of the servo of axis 1"),
                    "{reading:?}: {text}"
                );
                assert!(!text.contains("0x55 "), "it tells no register: {text}");
            }
        }
    }

    #[test]
    fn position_registers_are_told_as_positions_too() {
        let hex = "55aa00001102000000000000000600041a800006ff9cffff";
        let text = read(hex, MessageReading::Smc).text();
        assert!(text.contains("DP06       6784 (0x1a80)"), "{text}");
        assert!(
            text.contains("a1         400000 pulses") && text.contains("a2         -100 pulses"),
            "{text}"
        );
        let json = read(hex, MessageReading::Smc).into_object();
        assert_eq!(json["words"], json!([6784, 6, 65436, 65535]));
    }

    #[test]
    fn the_same_write_means_another_table_in_another_dialect() {
        let hex = "55aa000012010000ffffffff009000010001";
        assert!(read(hex, MessageReading::Smc).text().contains("DP90"));
        assert!(read(hex, MessageReading::Mbox).text().contains("PA90"));
    }

    #[test]
    fn the_printed_imax_layout_is_read_where_asked_for() {
        let hex = "55aa000014010000ffffffff000000320000000100000002fffffffd0000000000000000";
        let text = read(hex, MessageReading::Imax).text();
        assert!(text.contains("IMAX layout") && text.contains("a3                -3 pulses"), "{text}");
    }
}
