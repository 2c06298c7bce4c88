//! A message as a sheet of named fields: in full and in one line for people, as an object for programs.

use std::fmt::{Display, Write as _};

use serde_json::{Map, Value, json};

use super::names::{answer_name, register_name, station};
use crate::motion::Pulses;
use crate::wire::{
    Analogue, Code, DP_POSITIONS, DeviceError, Dialect, ReplyCode, Space, Timing, Vibration, Words, positions,
};

/// The most registers that the one-line form shows.
const REGISTERS_IN_A_LINE: usize = 8;

/// The fields of a message in the order they stand.
#[derive(Debug, Default)]
pub(super) struct FieldSheet {
    function: u16,
    lines: Vec<(String, String)>,
    brief: Vec<String>,
    object: Map<String, Value>,
}

impl FieldSheet {
    /// The function code.
    pub(super) const fn function(&self) -> u16 {
        self.function
    }

    /// What kind of message it is.
    pub(super) fn name(&self) -> &str {
        self.lines.first().map_or("", |(_, what)| what)
    }

    /// One aligned line for each field.
    pub(super) fn text(&self) -> String {
        let width = self.lines.iter().map(|(label, _)| label.len()).max().unwrap_or(0);
        let mut text = String::new();
        for (label, value) in &self.lines {
            let _ = writeln!(text, "{label:width$}  {value}"); // writing to a String cannot fail
        }
        text
    }

    /// What matters most, in one line.
    pub(super) fn brief(&self) -> String {
        format!("{}: {}", self.name(), self.brief.join(", "))
    }

    /// The fields as one JSON object.
    pub(super) fn into_object(self) -> Map<String, Value> {
        self.object
    }

    pub(super) fn line(&mut self, label: impl Into<String>, text: impl Display) {
        self.lines.push((label.into(), text.to_string()));
    }

    pub(super) fn field(&mut self, name: &str, text: impl Display, value: impl Into<Value>) {
        self.line(name, text);
        self.object.insert(name.replace(' ', "_"), value.into());
    }

    pub(super) fn head(&mut self, bytes: &[u8], what: &str, from_host: bool) {
        self.function = u16::from_be_bytes([bytes[4], bytes[5]]);
        let direction = if from_host { "host to controller" } else { "controller to host" };
        let function = format!("0x{:04x}", self.function);
        self.field("message", what, what);
        self.field("function", &function, function.clone());
        self.field("direction", direction, direction);
        self.field("bytes", bytes.len(), bytes.len());
    }

    pub(super) fn codes(&mut self, accept: Code, reply: Code) {
        self.field("accept", station(accept), accept.to_string());
        let answer = if reply == Code::NONE { "0000: nobody answers".to_owned() } else { station(reply) };
        self.field("reply", answer, reply.to_string());
        if accept != Code::ALL {
            self.brief.push(format!("for {accept}"));
        }
    }

    pub(super) fn channel(&mut self, channel: u16, meaning: &str) {
        self.field("channel", format!("{channel}: {meaning}"), channel);
    }

    pub(super) fn answer(&mut self, code: ReplyCode, dialect: Dialect) {
        let (x, meaning) = (code as u8, answer_name(code, dialect));
        self.field("answer", format!("x = {x}: {meaning}"), x);
        self.brief.push(meaning.to_owned());
    }

    /// Slot 6 of a reply: object channel or error number.
    pub(super) fn slot(
        &mut self,
        code: ReplyCode,
        channel: u16,
        meaning: &str,
        error: u16,
        dialect: Dialect,
    ) {
        match (code, dialect) {
            (ReplyCode::Running, _) => self.channel(channel, meaning),
            (_, Dialect::Smc) => self.error(error),
            (_, Dialect::Mbox) => self.field("channel", error, error),
        }
    }

    pub(super) fn error(&mut self, number: u16) {
        self.field("error", DeviceError(number), number);
        if number != 0 {
            self.brief.push(DeviceError(number).to_string());
        }
    }

    /// A field that the one-line form shows with its name.
    pub(super) fn numbered(&mut self, name: &str, number: u32) {
        self.field(name, number, number);
        self.brief.push(format!("{name} {number}"));
    }

    pub(super) fn station(&mut self, code: Code) {
        self.field("station", station(code), code.to_string());
        self.brief.push(format!("station {code}"));
    }

    pub(super) fn time(&mut self, timing: Timing, time_ms: u32) {
        let (text, brief) = match timing {
            Timing::Absolute => {
                (format!("{time_ms} ms from the start of the play"), format!("at {time_ms} ms"))
            }
            Timing::Relative => (format!("{time_ms} ms to reach the positions"), format!("in {time_ms} ms")),
        };
        self.line("time", text);
        self.object.insert("time_ms".to_owned(), time_ms.into());
        self.brief.push(brief);
    }

    pub(super) fn positions(&mut self, positions: &[Pulses]) {
        for (axis, position) in positions.iter().enumerate() {
            self.line(format!("a{}", axis + 1), format!("{} pulses", position.0));
        }
        let pulses: Vec<i32> = positions.iter().map(|position| position.0).collect();
        self.brief.push(format!("positions {}", listed(&pulses)));
        self.object.insert("positions".to_owned(), json!(pulses));
    }

    /// Values of drives; the one-line form names those that are not 0.
    pub(super) fn servo_errors(&mut self, errors: &[u16]) {
        for (axis, &error) in (1..).zip(errors).filter(|(_, error)| **error != 0) {
            self.line(format!("a{axis} servo error"), error);
            self.brief.push(format!("a{axis} servo error {error}"));
        }
        self.object.insert("servo_errors".to_owned(), json!(errors));
    }

    pub(super) fn forces(&mut self, forces: &[i16]) {
        for (axis, force) in (1..).zip(forces) {
            self.line(format!("a{axis} force"), force);
        }
        self.object.insert("forces".to_owned(), json!(forces));
    }

    /// Outputs (Y) or inputs (X) that are on; the bits past the twelfth mean nothing and are shown in the word alone.
    pub(super) fn bits(&mut self, name: &str, letter: char, word: u32) {
        let on: Vec<String> = (1..=12)
            .filter(|bit| word >> (bit - 1) & 1 == 1)
            .map(|bit| format!("{letter}{bit:02}"))
            .collect();
        let names = if on.is_empty() { "none".to_owned() } else { on.join(" ") };
        if !on.is_empty() {
            self.brief.push(format!("{name} {names}"));
        }
        self.line(name, format!("{names} (0x{word:04x})"));
        self.object.insert(name.to_owned(), json!({ "word": word, "on": on }));
    }

    /// What stands after the outputs or inputs of a motion frame.
    pub(super) fn tail(&mut self, extend: u32, vibration: Option<&[Vibration]>) {
        let Some(vibration) = vibration else {
            return self.field("extend", analogue(extend), extend);
        };
        let mut values = Vec::new();
        for (axis, shake) in (1..).zip(vibration) {
            let (hz, period, amplitude) = (shake.hz(), shake.period, shake.amplitude);
            let text = match hz {
                Some(hz) => {
                    self.brief.push(format!("v{axis} {hz:.2} Hz {amplitude} pulses"));
                    format!("{hz:.2} Hz, {amplitude} pulses (period {period} x 0.125 ms)")
                }
                None => "none".to_owned(),
            };
            self.line(format!("v{axis}"), text);
            values.push(json!({ "hz": hz, "period": period, "amplitude": amplitude }));
        }
        self.object.insert("vibration".to_owned(), values.into());
    }

    /// What a datagram has beyond the layout of its message.
    pub(super) fn surplus(&mut self, bytes: &[u8], layout: usize) {
        let Some(surplus) = bytes.get(layout..).filter(|surplus| !surplus.is_empty()) else { return };
        let hex: String = surplus.iter().map(|byte| format!("{byte:02x}")).collect();
        let text = format!("{} bytes after the layout", surplus.len());
        self.field("surplus", format!("{text}: {hex}"), hex.clone());
        self.brief.push(text);
    }

    /// Registers that a request names, or a reply that holds none.
    pub(super) fn asked(&mut self, start: u16, num: u16, space: Option<Space>) {
        self.range(start, num, space);
        let first = register_name(space, u32::from(start));
        self.brief.push(match num {
            1 => first,
            _ => format!("{num} registers from {first}"),
        });
    }

    /// Registers that a reply holds, and those that were asked for.
    pub(super) fn told(&mut self, start: u16, num: u16, data: Words<'_>, space: Option<Space>) {
        if data.is_empty() {
            self.asked(start, num, space);
        } else {
            self.range(start, num, space);
        }
        self.registers(start, data, space);
    }

    fn range(&mut self, start: u16, num: u16, space: Option<Space>) {
        self.field("first", register_name(space, u32::from(start)), start);
        self.field("count", num, num);
    }

    pub(super) fn registers(&mut self, start: u16, data: Words<'_>, space: Option<Space>) {
        for (index, (number, word)) in (u32::from(start)..).zip(data.iter()).enumerate() {
            let name = register_name(space, number);
            match index {
                0..REGISTERS_IN_A_LINE => self.brief.push(format!("{name} = {word}")),
                REGISTERS_IN_A_LINE => self.brief.push(format!("... {} in all", data.len())),
                _ => {}
            }
            self.line(name, format!("{word} (0x{word:04x})"));
        }
        self.object.insert("first".to_owned(), start.into());
        self.object.insert("words".to_owned(), data.iter().collect::<Vec<_>>().into());
    }

    /// Registers of 32 bits.
    pub(super) fn wide_registers(&mut self, start: u16, values: &[u32]) {
        for (number, value) in (u32::from(start)..).zip(values) {
            self.line(format!("0x{number:02x}"), format!("{value} (0x{value:08x})"));
        }
        self.brief.push(format!("values {}", listed(values)));
        self.object.insert("words".to_owned(), json!(values));
    }

    /// Positions, where the words are those of position registers from a first one on.
    pub(super) fn monitored_positions(&mut self, start: u16, data: Words<'_>, dialect: Dialect) {
        let Some(first) = DP_POSITIONS.iter().position(|&register| register == start) else { return };
        let axes_left = 3 - first % 3;
        for (axis, position) in positions(data, dialect).iter().enumerate().take(axes_left) {
            let axis = first + axis + 1;
            self.line(format!("a{axis}"), format!("{} pulses", position.0));
            self.brief.push(format!("a{axis} at {}", position.0));
        }
    }
}

fn listed<T: Display>(values: &[T]) -> String {
    values.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// Analogue outputs, as the word that they are and, where one is on, as levels.
pub(super) fn analogue(extend: u32) -> String {
    let [dac1, dac2] = Analogue::of_extend(extend).levels();
    let levels = if extend == 0 { String::new() } else { format!(" (dac1 {dac1:.3}, dac2 {dac2:.3})") };
    format!("0x{extend:08x}{levels}")
}
