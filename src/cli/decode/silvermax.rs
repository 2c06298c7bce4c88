//! Messages of a SilverMax in words.

use serde_json::{Map, Value, json};

use super::serial::{Direction, EachWay, SerialDecoder, SerialSaid};
use crate::wire::silvermax::{
    AnyRequest, Collected, Internal, Io, LineCollector, NineBit, Poll, Reply, StatusWord as _, Words,
    command, register,
};

/// First octets of a message in nine bits that are also those of a line: units 33, 35, 42 and 64.
const OPENINGS: [u8; 4] = *b"!#*@";

/// Reads both directions of a line, each by itself where they are known.
pub(super) struct SilverDecoder {
    collectors: EachWay<LineCollector>,
    /// What was asked last, which tells what an answer is about.
    asked: Option<AnyRequest>,
}

impl Default for SilverDecoder {
    fn default() -> Self {
        let collectors = EachWay {
            to_drive: LineCollector::of_requests(),
            from_drive: LineCollector::of_replies(),
            either: LineCollector::of_both(),
        };
        Self { collectors, asked: None }
    }
}

impl SilverDecoder {
    fn line(&mut self, direction: Option<Direction>, line: &[u8]) -> SerialSaid {
        let request = AnyRequest::parse(line);
        let (text, fields) = match (request, Reply::parse(line)) {
            (Ok(request), _) => self.request(request),
            (_, Ok(reply)) => self.reply(&reply),
            (Err(why), Err(_)) if line.first() == Some(&b'@') => {
                return SerialSaid::stray(direction, line, &why.to_string());
            }
            (_, Err(why)) => return SerialSaid::stray(direction, line, &why.to_string()),
        };
        SerialSaid { direction, text, fields, is_message: true }
    }

    fn request(&mut self, request: AnyRequest) -> (String, Map<String, Value>) {
        self.asked = Some(request);
        let AnyRequest { unit, number, parameters } = request;
        let known = request.command();
        let mnemonic = known.map(|command| command.mnemonic);
        let names = known.map_or(&[][..], |command| command.parameters);
        let mut text = format!("{unit:>3}  {}", mnemonic.map_or_else(|| format!("{number}?"), str::to_owned));
        let mut named = Map::new();
        for (index, value) in parameters.as_slice().iter().enumerate() {
            let name =
                names.get(index).map_or_else(|| format!("p{}", index + 1), |name| name.name.to_owned());
            text += &format!(" {name}={value}");
            if name == "register"
                && let Some(meaning) = u8::try_from(*value).ok().and_then(register::name)
            {
                text += &format!(" ({meaning})");
            }
            named.insert(name, json!(value));
        }
        let fields = json!({
            "kind": "request", "unit": unit, "command": number, "mnemonic": mnemonic, "parameters": named,
        });
        (text, object(fields))
    }

    fn reply(&self, reply: &Reply) -> (String, Map<String, Value>) {
        let unit = reply.unit();
        let number = reply.command();
        let name = number.map(|number| {
            let known = u8::try_from(number).ok().and_then(command);
            known.map_or_else(|| format!("{number}?"), |command| command.mnemonic.to_owned())
        });
        let head = format!("{unit:>3}  {}", name.as_deref().unwrap_or("ack"));
        let (text, fields) = match reply {
            Reply::Ack { .. } => (head, json!({ "kind": "ack" })),
            Reply::Nak { reason, .. } => {
                let fields = json!({ "kind": "nak", "reason": reason.number(), "why": reason.to_string() });
                (format!("{head} refused: {reason} ({})", reason.number()), fields)
            }
            Reply::Data { command, words, .. } => {
                let (text, fields) = self.data(unit, *command, words);
                (format!("{head} {text}"), fields)
            }
        };
        let mut fields = object(fields);
        fields.insert("unit".to_owned(), json!(unit));
        if let Some(number) = number {
            fields.insert("command".to_owned(), json!(number));
            fields.insert("mnemonic".to_owned(), json!(name));
        }
        (text, fields)
    }

    fn data(&self, unit: u8, command: u16, words: &Words) -> (String, Value) {
        let hex: Vec<String> = words.as_slice().iter().map(|word| format!("{word:04X}")).collect();
        let hex = hex.join(" ");
        let all = words.as_slice();
        if let (12, Some(value)) = (command, words.value()) {
            let register = self.asked.filter(|asked| asked.unit == unit && asked.number == 12);
            let register =
                register.and_then(|asked| u8::try_from(*asked.parameters.as_slice().first()?).ok());
            let what = register.map_or_else(String::new, |register| match register::name(register) {
                Some(name) => format!("register {register} ({name}) = "),
                None => format!("register {register} = "),
            });
            let fields = json!({ "kind": "data", "words": all, "value": value, "register": register });
            return (format!("{what}{value} ({hex})"), fields);
        }
        match words.word().and_then(|word| bits(command, word)) {
            Some(bits) => {
                let fields = json!({ "kind": "data", "words": all, "bits": bits });
                (
                    format!(
                        "{hex}: {}",
                        if bits.is_empty() { "nothing".to_owned() } else { bits.join(", ") }
                    ),
                    fields,
                )
            }
            None => (hex, json!({ "kind": "data", "words": all })),
        }
    }

    /// A message in nine bits, where a log has one on a line; `None` where it is none.
    fn nine_bit(&mut self, direction: Direction, octets: &[u8]) -> Option<SerialSaid> {
        let read = match direction {
            Direction::ToDrive => NineBit::request(octets),
            Direction::FromDrive => NineBit::reply(octets),
        };
        let read = read.ok()?;
        if OPENINGS.contains(octets.first()?) {
            return Some(SerialSaid::stray(
                Some(direction),
                octets,
                "it may be nine-bit or part of a line; which of them is unknown",
            ));
        }
        let (text, mut fields) = match read {
            NineBit::Request(request) => self.request(request),
            NineBit::Reply(reply) => self.reply(&reply),
        };
        fields.insert("nine_bits".to_owned(), json!(true));
        Some(SerialSaid {
            direction: Some(direction),
            text: format!("{text}  (nine bits)"),
            fields,
            is_message: true,
        })
    }
}

impl SerialDecoder for SilverDecoder {
    fn take(&mut self, direction: Option<Direction>, octets: &[u8]) -> Vec<SerialSaid> {
        let is_between = self.collectors.of(direction).is_empty();
        let opens = octets.first().is_some_and(|first| OPENINGS.contains(first));
        let may_be_a_line = opens && octets.last() == Some(&b'\r');
        if let (Some(direction), true, false) = (direction, is_between, may_be_a_line)
            && let Some(said) = self.nine_bit(direction, octets)
        {
            return vec![said];
        }
        let mut said = Vec::new();
        for octet in octets {
            let (is_line, kept) = match self.collectors.of(direction).push(*octet) {
                None => continue,
                Some(Collected::Line(line)) => (true, line.to_vec()),
                Some(Collected::Stray(stray)) => (false, stray.to_vec()),
            };
            said.push(if is_line {
                self.line(direction, &kept)
            } else {
                SerialSaid::stray(direction, &kept, "no line")
            });
        }
        said
    }

    fn rest(&mut self) -> Vec<SerialSaid> {
        let mut said = Vec::new();
        for direction in EachWay::<LineCollector>::WAYS {
            let rest = self.collectors.of(direction).rest();
            if !rest.is_empty() {
                said.push(SerialSaid::stray(direction, rest, "it ends in the middle of a line"));
            }
        }
        said
    }
}

/// The names of the bits of a status word that a command answered.
fn bits(command: u16, word: u16) -> Option<Vec<&'static str>> {
    Some(match command {
        0 => Poll(word).names().collect(),
        20 => Internal(word).names().chain(Internal(word).is_hot().then_some("hot")).collect(),
        21 => Io(word).names().collect(),
        _ => return None,
    })
}

fn object(fields: Value) -> Map<String, Value> {
    match fields {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}
