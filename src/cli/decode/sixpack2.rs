//! Messages of a SIXpack 2 in words.

use std::time::Duration;

use serde_json::{Map, Value, json};

use super::serial::{Direction, EachWay, SerialDecoder, SerialSaid};
use crate::wire::sixpack2::{FrameCollector, SixpackCommand, SixpackFrame, SixpackReply, action};

/// The flags of P5 and P6 of `$15` (motor parameters, page 38).
const P5: [&str; 8] =
    ["PIMode", "Rotary", "AutonullCmd", "TestNull", "NullLeft", "NullCenter", "StopNull", "FilterSwitch"];
const P6: [&str; 8] = [
    "WayOptimization",
    "FastRef",
    "MechRef",
    "DelayTestNull",
    "StopSoft",
    "StopNoRef",
    "NullPositive",
    "StopAtFullsteps",
];

/// Reads both directions of a line, each by itself where they are known.
pub(super) struct SixpackDecoder {
    collectors: EachWay<FrameCollector>,
    /// What was asked last, and not answered yet.
    asked: Option<SixpackCommand>,
}

impl Default for SixpackDecoder {
    fn default() -> Self {
        let collector = FrameCollector::new(None);
        let collectors = EachWay { to_drive: collector, from_drive: collector, either: collector };
        Self { collectors, asked: None }
    }
}

impl SixpackDecoder {
    /// Octets that no frame will ever have: the next begins anew.
    fn give_up(&mut self, direction: Option<Direction>, why: &str) -> Option<SerialSaid> {
        let collector = self.collectors.of(direction);
        let said =
            (!collector.begun().is_empty()).then(|| SerialSaid::stray(direction, collector.begun(), why));
        collector.clear();
        said
    }

    fn frame(&mut self, direction: Option<Direction>, frame: SixpackFrame) -> SerialSaid {
        let reply = self.asked.and_then(|asked| asked.answered_by(frame));
        let reply = match direction {
            Some(Direction::FromDrive) => Some(reply.unwrap_or_else(|| SixpackReply::of(frame))),
            Some(Direction::ToDrive) => None,
            // Nothing else tells an answer from a command.
            None => reply,
        };
        let (text, fields) = match reply {
            Some(reply) => {
                self.asked = None;
                let known = (reply.words(), reply.frame(frame.address) == frame);
                worded(("answer", "response"), frame, known, |to| reply.tell(to))
            }
            None => {
                let command = SixpackCommand::of(frame);
                if is_query(command) {
                    self.asked = Some(command);
                }
                let known = (command.words(), command.frame(frame.address) == frame);
                let (mut text, mut fields) = worded(("request", "unit"), frame, known, |to| command.tell(to));
                if let Some(fault) = command.fault() {
                    text += &format!("  ({fault})");
                    fields.insert("fault".to_owned(), json!(fault));
                }
                (text, fields)
            }
        };
        SerialSaid { direction, text, fields, is_message: true }
    }
}

impl SerialDecoder for SixpackDecoder {
    fn take(&mut self, direction: Option<Direction>, octets: &[u8]) -> Vec<SerialSaid> {
        let mut said = Vec::new();
        if direction == Some(Direction::ToDrive) {
            // A host hands over whole frames; what is behind a piece of one is none of it.
            said.extend(self.give_up(direction, "a part of a frame"));
        }
        for octet in octets {
            let Some(frame) = self.collectors.of(direction).push(*octet, Duration::ZERO) else { continue };
            if direction == Some(Direction::ToDrive) && is_query(SixpackCommand::of(frame)) {
                // Whoever asks again waits for no answer any more.
                said.extend(self.give_up(Some(Direction::FromDrive), "a part of an answer"));
            }
            said.push(self.frame(direction, frame));
        }
        said
    }

    fn rest(&mut self) -> Vec<SerialSaid> {
        let ways = EachWay::<FrameCollector>::WAYS;
        let rest = ways.map(|direction| self.give_up(direction, "it ends in the middle of a frame"));
        rest.into_iter().flatten().collect()
    }
}

fn is_query(command: SixpackCommand) -> bool {
    matches!(
        command,
        SixpackCommand::PositionQuery(_)
            | SixpackCommand::VelocityQuery(_)
            | SixpackCommand::ActionsQuery(_)
            | SixpackCommand::InputQuery(_)
            | SixpackCommand::UnitQuery(_)
    )
}

/// A message for a person and for a program, by its words if it has any, and whether it has 0 in all that it does not use.
fn worded(
    (kind, address): (&str, &str),
    frame: SixpackFrame,
    (words, is_clean): (Option<&str>, bool),
    tell: impl FnOnce(&mut dyn FnMut(&'static str, i64)),
) -> (String, Map<String, Value>) {
    let name = words.map_or_else(|| format!("${:02X}?", frame.command), str::to_owned);
    let mut text = format!("{:>3}  {name}", frame.address);
    let mut values: Map<String, Value> = Map::new();
    tell(&mut |name, value| {
        text += &format!(" {name}={value}{}", meaning(name, value));
        match values.get_mut(name) {
            Some(Value::Array(several)) => several.push(json!(value)),
            Some(one) => *one = json!([one, value]),
            None => drop(values.insert(name.to_owned(), json!(value))),
        }
    });
    if !is_clean {
        text += "  (bytes that it does not use are not 0)";
    }
    let named = [
        ("kind", json!(kind)),
        (address, json!(frame.address)),
        ("command", json!(frame.command)),
        ("name", json!(words)),
        ("parameters", Value::Object(values)),
        ("unused_are_0", json!(is_clean)),
    ];
    let fields = named.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    (text, fields)
}

/// What a number means, behind it; nothing where it is a plain one.
fn meaning(name: &str, value: i64) -> String {
    let flags = |names: &[&str; 8]| {
        let is_set = |(bit, _): &(usize, &&str)| value & 1 << bit != 0;
        names.iter().enumerate().filter(is_set).map(|(_, name)| *name).collect::<Vec<_>>().join(", ")
    };
    let words = match name {
        "p5" => flags(&P5),
        "p6" => flags(&P6),
        "action" | "actions" => action_name(value).to_owned(),
        _ => String::new(),
    };
    if words.is_empty() { words } else { format!(" ({words})") }
}

fn action_name(value: i64) -> &'static str {
    match u8::try_from(value) {
        Ok(action::IDLE) => "idle",
        Ok(action::RAMP) => "ramp",
        Ok(action::PI) => "PI",
        Ok(action::ROTATION) => "rotation",
        Ok(action::SEARCH..=action::LAST_SEARCH) => "search",
        Ok(action::MECHANICAL) => "mechanical stop",
        _ => "",
    }
}
