//! A message as a sheet of named fields, for people and for programs.

use std::fmt::{Display, Write as _};

use serde_json::{Map, Value, json};

use super::names::{answer_name, motion_name, register_name, space_name, station};
use crate::motion::Pulses;
use crate::wire::{
    Access, Code, DP_POSITIONS, DeviceError, Dialect, ImaxMotion, ImaxRegisters, MAX_SERVO_READ, Message,
    MotionReply, MotionRequest, ReplyCode, Space, Status, Timing, Vibration, WireError, Words, positions,
};

/// How to read a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Reading {
    Smc,
    Mbox,
    Imax,
}

impl Reading {
    const fn dialect(self) -> Dialect {
        match self {
            Self::Smc => Dialect::Smc,
            Self::Mbox | Self::Imax => Dialect::Mbox,
        }
    }
}

/// The fields of a message in the order they stand.
#[derive(Debug, Default)]
pub(super) struct Sheet {
    lines: Vec<(String, String)>,
    object: Map<String, Value>,
}

/// The fields of a message.
///
/// # Errors
/// At which octet, and why, these octets are none.
pub(super) fn sheet(octets: &[u8], reading: Reading) -> Result<Sheet, WireError> {
    let mut sheet = Sheet::default();
    if reading == Reading::Imax {
        if let Ok(motion) = ImaxMotion::parse(octets) {
            sheet.imax_motion(octets, &motion);
            return Ok(sheet);
        }
        if let Ok(reply) = ImaxRegisters::parse(octets) {
            sheet.imax_registers(octets, &reply);
            return Ok(sheet);
        }
    }
    let message = Message::parse(octets)?;
    sheet.message(octets, &message, reading.dialect());
    Ok(sheet)
}

impl Sheet {
    /// One aligned line for each field.
    pub(super) fn text(&self) -> String {
        let width = self.lines.iter().map(|(label, _)| label.len()).max().unwrap_or(0);
        let mut text = String::new();
        for (label, value) in &self.lines {
            let _ = writeln!(text, "{label:width$}  {value}"); // writing to a String cannot fail
        }
        text
    }

    /// The fields as one JSON object.
    pub(super) fn json(self) -> Value {
        Value::Object(self.object)
    }

    fn line(&mut self, label: impl Into<String>, text: impl Display) {
        self.lines.push((label.into(), text.to_string()));
    }

    fn field(&mut self, name: &str, text: impl Display, value: impl Into<Value>) {
        self.line(name, text);
        self.object.insert(name.replace(' ', "_"), value.into());
    }

    fn head(&mut self, octets: &[u8], what: &str, from_host: bool) {
        let direction = if from_host { "host to controller" } else { "controller to host" };
        let function = format!("0x{:02x}{:02x}", octets[4], octets[5]);
        self.field("message", what, what);
        self.field("function", &function, function.clone());
        self.field("direction", direction, direction);
        self.field("octets", octets.len(), octets.len());
    }

    fn message(&mut self, octets: &[u8], message: &Message<'_>, dialect: Dialect) {
        match message {
            Message::Motion(motion) => self.motion(octets, motion),
            Message::MotionReply(reply) => self.motion_reply(octets, reply, dialect),
            Message::Read(read) => {
                self.head(octets, "read registers", true);
                self.codes(read.accept, read.reply);
                let space = Space::of_read(read.channel);
                self.channel(read.channel, space_name(space));
                self.asked(read.start, read.num, space);
            }
            Message::Write(write) => {
                self.head(octets, "write registers", true);
                self.codes(write.accept, write.reply);
                let space = Space::of_write(write.channel, dialect);
                self.channel(write.channel, space_name(space));
                self.registers(write.start, write.data, space);
            }
            Message::RegisterReply(reply) => {
                let (what, space) = match reply.access {
                    Access::Read => ("reply to read registers", Space::of_read(reply.channel)),
                    Access::Write => ("reply to write registers", Space::of_write(reply.channel, dialect)),
                };
                let space = space.filter(|_| reply.code == ReplyCode::Running);
                self.head(octets, what, false);
                self.answer(reply.code, dialect);
                self.slot(reply.code, reply.channel, space_name(space), reply.error, dialect);
                self.asked(reply.start, reply.num, space);
                self.registers(reply.start, reply.data, space);
                if reply.access == Access::Read && space == Some(Space::Monitor) {
                    self.monitored_positions(reply.start, reply.data, dialect);
                }
            }
            Message::ServoRead(_) | Message::ServoWrite(_) | Message::ServoReply(_) => {
                self.servo(octets, message, dialect);
            }
            Message::Status(status) => self.status(octets, status),
            Message::Report(report) => {
                self.head(octets, "report of registers", false);
                let space = Space::of_read(report.channel);
                self.channel(report.channel, space_name(space));
                self.registers(report.start, report.data, space);
            }
        }
    }

    fn motion(&mut self, octets: &[u8], motion: &MotionRequest) {
        self.head(octets, motion_name(motion.timing, motion.vibration.is_some()), true);
        self.codes(motion.accept, motion.reply);
        self.channel(motion.channel, &format!("{} axes", motion.positions.len()));
        self.field("frame", motion.frame, motion.frame.0);
        self.time(motion.timing, motion.time_ms);
        self.positions(&motion.positions);
        self.bits("outputs", 'Y', u32::from(motion.outputs));
        self.tail(octets, motion.layout_len(), motion.extend, motion.vibration.as_deref());
    }

    fn motion_reply(&mut self, octets: &[u8], reply: &MotionReply, dialect: Dialect) {
        let what = format!("reply to {}", motion_name(reply.timing, reply.vibration.is_some()));
        self.head(octets, &what, false);
        self.answer(reply.code, dialect);
        let axes = format!("{} axes", reply.positions.len());
        self.slot(reply.code, reply.channel, &axes, reply.error, dialect);
        self.field("frame", reply.frame, reply.frame.0);
        self.time(reply.timing, reply.time_ms);
        self.positions(&reply.positions);
        self.bits("inputs", 'X', u32::from(reply.inputs));
        self.tail(octets, reply.layout_len(), reply.extend, reply.vibration.as_deref());
    }

    fn servo(&mut self, octets: &[u8], message: &Message<'_>, dialect: Dialect) {
        match message {
            Message::ServoRead(read) => {
                self.head(octets, "read servo registers", true);
                self.codes(read.accept, read.reply);
                self.field("servo", read.servo, read.servo);
                self.asked(read.start, read.num, None);
                if read.num > MAX_SERVO_READ {
                    self.line(
                        "note",
                        format!("a controller answers at most {MAX_SERVO_READ} registers at once"),
                    );
                }
            }
            Message::ServoWrite(write) => {
                self.head(octets, "write servo registers", true);
                self.codes(write.accept, write.reply);
                self.field("servo", write.servo, write.servo);
                self.registers(write.start, write.data, None);
            }
            Message::ServoReply(reply) => {
                let what = match reply.access {
                    Access::Read => "reply to read servo registers",
                    Access::Write => "reply to write servo registers",
                };
                self.head(octets, what, false);
                self.answer(reply.code, dialect);
                if reply.code == ReplyCode::Running {
                    self.field("servo", reply.servo, reply.servo);
                } else {
                    self.field("error", DeviceError(reply.error), reply.error);
                }
                self.asked(reply.start, reply.num, None);
                self.registers(reply.start, reply.data, None);
            }
            _ => {}
        }
    }

    fn status(&mut self, octets: &[u8], status: &Status) {
        self.head(octets, "status report", false);
        self.field("station", station(status.station), status.station.to_string());
        self.positions(&status.positions);
        for (axis, force) in status.forces.iter().enumerate() {
            self.line(format!("a{} force", axis + 1), force);
        }
        self.object.insert("forces".to_owned(), json!(&*status.forces));
        for (axis, &error) in status.servo_errors.iter().enumerate().filter(|(_, error)| **error != 0) {
            self.line(format!("a{} servo error", axis + 1), error);
        }
        self.object.insert("servo_errors".to_owned(), json!(&*status.servo_errors));
        let error = match status.error {
            0 => "none".to_owned(),
            number => DeviceError(number).to_string(),
        };
        self.field("error", error, status.error);
        self.bits("outputs", 'Y', u32::from(status.outputs));
        self.bits("inputs", 'X', u32::from(status.inputs));
    }

    fn imax_motion(&mut self, octets: &[u8], motion: &ImaxMotion) {
        let name = motion_name(motion.timing, false);
        let reply = if motion.code.is_some() { "reply to " } else { "" };
        self.head(
            octets,
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
        self.field("analogue outputs", format!("0x{:08x}", motion.dac), motion.dac);
    }

    fn imax_registers(&mut self, octets: &[u8], reply: &ImaxRegisters<'_>) {
        let what = match reply.access {
            Access::Read => "reply to read registers, IMAX layout of 32 bits",
            Access::Write => "reply to write registers, IMAX layout of 32 bits",
        };
        self.head(octets, what, false);
        self.answer(reply.code, Dialect::Mbox);
        self.field("channel", reply.channel, reply.channel);
        self.asked(reply.start, reply.num, None);
        let values: Vec<u32> = reply.values().collect();
        for (index, value) in values.iter().enumerate() {
            self.line(
                format!("0x{:02x}", usize::from(reply.start) + index),
                format!("{value} (0x{value:08x})"),
            );
        }
        self.object.insert("words".to_owned(), json!(values));
    }

    fn codes(&mut self, accept: Code, reply: Code) {
        self.field("accept", station(accept), accept.to_string());
        let answer = if reply == Code::NONE { "0000: nobody answers".to_owned() } else { station(reply) };
        self.field("reply", answer, reply.to_string());
    }

    fn channel(&mut self, channel: u16, meaning: &str) {
        self.field("channel", format!("{channel}: {meaning}"), channel);
    }

    fn answer(&mut self, code: ReplyCode, dialect: Dialect) {
        let x = code as u8;
        self.field("answer", format!("x = {x}: {}", answer_name(code, dialect)), x);
    }

    /// Slot 6 of a reply: object channel or error number.
    fn slot(&mut self, code: ReplyCode, channel: u16, meaning: &str, error: u16, dialect: Dialect) {
        match (code, dialect) {
            (ReplyCode::Running, _) => self.channel(channel, meaning),
            (_, Dialect::Smc) => self.field("error", DeviceError(error), error),
            (_, Dialect::Mbox) => self.field("channel", error, error),
        }
    }

    fn time(&mut self, timing: Timing, time_ms: u32) {
        let text = match timing {
            Timing::Absolute => format!("{time_ms} ms from the start of the play"),
            Timing::Relative => format!("{time_ms} ms to reach the positions"),
        };
        self.line("time", text);
        self.object.insert("time_ms".to_owned(), time_ms.into());
    }

    fn positions(&mut self, positions: &[Pulses]) {
        for (axis, position) in positions.iter().enumerate() {
            self.line(format!("a{}", axis + 1), format!("{} pulses", position.0));
        }
        let pulses: Vec<i32> = positions.iter().map(|position| position.0).collect();
        self.object.insert("positions".to_owned(), json!(pulses));
    }

    /// Outputs (Y) or inputs (X) that are on; the bits past the twelfth mean nothing and are shown in the word alone.
    fn bits(&mut self, name: &str, letter: char, word: u32) {
        let on = (1..=12).filter(|number| word >> (number - 1) & 1 == 1);
        let on: Vec<String> = on.map(|number| format!("{letter}{number:02}")).collect();
        let names = if on.is_empty() { "none".to_owned() } else { on.join(" ") };
        self.line(name, format!("{names} (0x{word:04x})"));
        self.object.insert(name.to_owned(), json!({ "word": word, "on": on }));
    }

    /// What stands after the outputs or inputs of a motion frame.
    fn tail(&mut self, octets: &[u8], layout: usize, extend: u32, vibration: Option<&[Vibration]>) {
        if let Some(vibration) = vibration {
            let mut values = Vec::new();
            for (axis, shake) in vibration.iter().enumerate() {
                let text = match shake.hz() {
                    Some(hz) => {
                        format!("{hz:.2} Hz, {} pulses (period {} x 0.125 ms)", shake.amplitude, shake.period)
                    }
                    None => "none".to_owned(),
                };
                self.line(format!("v{}", axis + 1), text);
                values
                    .push(json!({ "hz": shake.hz(), "period": shake.period, "amplitude": shake.amplitude }));
            }
            self.object.insert("vibration".to_owned(), values.into());
        } else {
            self.field("extend", format!("0x{extend:08x}"), extend);
        }
        if let Some(surplus) = octets.get(layout..).filter(|surplus| !surplus.is_empty()) {
            let hex: String = surplus.iter().map(|octet| format!("{octet:02x}")).collect();
            self.field("surplus", format!("{} octets after the layout: {hex}", surplus.len()), hex.clone());
        }
    }

    fn asked(&mut self, start: u16, num: u16, space: Option<Space>) {
        self.field("first", register_name(space, u32::from(start)), start);
        self.field("count", num, num);
    }

    fn registers(&mut self, start: u16, data: Words<'_>, space: Option<Space>) {
        for (number, word) in (u32::from(start)..).zip(data.iter()) {
            self.line(register_name(space, number), format!("{word} (0x{word:04x})"));
        }
        self.object.insert("first".to_owned(), start.into());
        self.object.insert("words".to_owned(), data.iter().collect::<Vec<_>>().into());
    }

    /// Positions, where the words are those of position registers from a first one on.
    fn monitored_positions(&mut self, start: u16, data: Words<'_>, dialect: Dialect) {
        let Some(first) = DP_POSITIONS.iter().position(|&register| register == start) else { return };
        let axes_left = 3 - first % 3;
        for (axis, position) in positions(data, dialect).iter().enumerate().take(axes_left) {
            self.line(format!("a{}", first + axis + 1), format!("{} pulses", position.0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(hex: &str, reading: Reading) -> Sheet {
        let octets: Vec<u8> =
            (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect();
        sheet(&octets, reading).unwrap()
    }

    #[test]
    fn a_frame_with_vibration_is_told_field_by_field() {
        let sheet = read(
            "55aa000019010000ffff00000000000300000032ffffffff00000000000000018802\
             0190000a0000000000000000",
            Reading::Smc,
        );
        assert_eq!(
            sheet.text(),
            "\
message    motion with vibration, relative time
function   0x1901
direction  host to controller
octets     46
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
        let text = read("55aa00001203000a00000000005500010005", Reading::Smc).text();
        assert!(text.contains("x = 3: running with an error"), "{text}");
        assert!(text.contains("Err10: alarm of the servo of axis 1"), "{text}");
    }

    #[test]
    fn position_registers_are_told_as_positions_too() {
        let hex = "55aa00001102000000000000000600041a800006ff9cffff";
        let text = read(hex, Reading::Smc).text();
        assert!(text.contains("DP06       6784 (0x1a80)"), "{text}");
        assert!(
            text.contains("a1         400000 pulses") && text.contains("a2         -100 pulses"),
            "{text}"
        );
        let json = read(hex, Reading::Smc).json();
        assert_eq!(json["words"], json!([6784, 6, 65436, 65535]));
    }

    #[test]
    fn the_same_write_means_another_table_in_another_dialect() {
        let hex = "55aa000012010000ffffffff009000010001";
        assert!(read(hex, Reading::Smc).text().contains("DP90"));
        assert!(read(hex, Reading::Mbox).text().contains("PA90"));
    }

    #[test]
    fn the_printed_imax_layout_is_read_where_asked_for() {
        let hex = "55aa000014010000ffffffff000000320000000100000002fffffffd0000000000000000";
        let text = read(hex, Reading::Imax).text();
        assert!(text.contains("IMAX layout") && text.contains("a3                -3 pulses"), "{text}");
    }
}
