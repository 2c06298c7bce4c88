//! What the service tells a recorder beside what crosses its taps.

use serde::Serialize;
use serde_json::{Value, json};

use super::schemas::{schema, state_schema};

/// How the hall stands.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct HallNote {
    /// The number of its state.
    pub(crate) state: usize,
    /// Why.
    pub(crate) cause: String,
    /// What a person does next.
    pub(crate) next: String,
    /// What is loaded; empty for nothing.
    pub(crate) cue: String,
    /// The level of motion, 0 to 1.
    pub(crate) level: f64,
    /// The level of vibration, 0 to 1.
    pub(crate) vibration: f64,
    /// How much later than the film the motion is, ms.
    pub(crate) trim_ms: i32,
    /// Effects that are switched off.
    pub(crate) effects_off: Vec<String>,
    /// Seats that a person took out.
    pub(crate) seats_out: Vec<String>,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct EventNote {
    /// What: `standing`, `incident`, `trouble` …
    pub(crate) kind: &'static str,
    /// Whose; empty for the hall's.
    pub(crate) seat: String,
    /// In words.
    pub(crate) text: String,
}

/// What somebody asked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ActionNote {
    /// Who, or the role alone.
    pub(crate) who: String,
    /// What.
    pub(crate) what: String,
    /// What came of it.
    pub(crate) result: String,
    /// What the hall was in.
    pub(crate) state: String,
}

/// A moment that somebody marked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct MarkNote {
    /// Show time, seconds.
    pub(crate) film_s: f64,
    /// In their words; may be empty.
    pub(crate) text: String,
    /// Who, or the role alone.
    pub(crate) who: String,
}

/// A line of the log, as `foxglove.Log` has it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct LogNote {
    /// 2 for information, 3 for a warning, 4 for an error.
    pub(crate) level: u8,
    /// In words.
    pub(crate) message: String,
    /// Which part of the program.
    pub(crate) name: String,
}

/// A line as viewers want it: its time stands in it once more.
#[derive(Serialize)]
struct TimedLine<'a> {
    timestamp: LineTime,
    #[serde(flatten)]
    line: &'a LogNote,
}

#[derive(Serialize)]
struct LineTime {
    sec: u64,
    nsec: u64,
}

/// Where the film is that leads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct TimecodeNote {
    /// Which source leads; empty for none.
    pub(crate) source: String,
    /// Show time, seconds.
    pub(crate) film_s: f64,
    /// How far the seats are from it, ms.
    pub(crate) error_ms: f64,
    /// Whether it runs.
    pub(crate) locked: bool,
}

/// One of these.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Note {
    /// How the hall stands from now on.
    Hall(HallNote),
    /// Something happened.
    Event(EventNote),
    /// Somebody asked something.
    Action(ActionNote),
    /// Somebody marked a moment.
    Mark(MarkNote),
    /// A line of the log.
    Log(LogNote),
    /// Where the film is.
    Timecode(TimecodeNote),
}

impl Note {
    /// Its topic's place among [`topics`].
    pub(super) const fn topic(&self) -> usize {
        match self {
            Self::Hall(_) => 0,
            Self::Event(_) => 1,
            Self::Action(_) => 2,
            Self::Mark(_) => 3,
            Self::Log(_) => 4,
            Self::Timecode(_) => 5,
        }
    }

    /// As JSON, of that instant on the wall clock, ns since 1970.
    pub(super) fn json(&self, wall: u64) -> serde_json::Result<Vec<u8>> {
        match self {
            Self::Hall(note) => serde_json::to_vec(note),
            Self::Event(note) => serde_json::to_vec(note),
            Self::Action(note) => serde_json::to_vec(note),
            Self::Mark(note) => serde_json::to_vec(note),
            Self::Log(line) => {
                let timestamp = LineTime { sec: wall / 1_000_000_000, nsec: wall % 1_000_000_000 };
                serde_json::to_vec(&TimedLine { timestamp, line })
            }
            Self::Timecode(note) => serde_json::to_vec(note),
        }
    }
}

/// A note as a person reads it, of its JSON; `None` where that is something else.
pub(crate) fn note_in_words(topic: &str, json: &str) -> Option<String> {
    let note: Value = serde_json::from_str(json).ok()?;
    let text = |key: &str| note[key].as_str().unwrap_or_default();
    let or = |text: &str, other: &str| if text.is_empty() { other.to_owned() } else { text.to_owned() };
    match topic {
        "/event" if text("kind") == "incident" => Some(format!("incident: {}", text("text"))),
        "/event" => Some(format!("{} {}", text("seat"), text("text")).trim_start().to_owned()),
        "/action" => Some(format!("{}: {}, {}", text("what"), text("result"), text("who"))),
        "/mark" => Some(format!("{}, {}", or(text("text"), "marked"), text("who"))),
        "/log" => Some(text("message").to_owned()),
        _ => None,
    }
}

/// The topics of all notes, and their schemas.
pub(super) fn topics() -> [(&'static str, Value); 6] {
    let [text, number, count] = ["string", "number", "integer"].map(|kind| json!({"type": kind}));
    let names = json!({"type": "array", "items": {"type": "string"}});
    let timestamp =
        json!({"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}});
    let of = |title: &str, fields: &[(&str, &Value)]| {
        let fields: Vec<_> = fields.iter().map(|(name, kind)| (*name, (*kind).clone())).collect();
        schema(title, &fields, &[])
    };
    [
        (
            "/hall",
            schema(
                "kinocue.hall",
                &[("state", state_schema())],
                &[
                    ("cause", text.clone()),
                    ("next", text.clone()),
                    ("cue", text.clone()),
                    ("level", number.clone()),
                    ("vibration", number.clone()),
                    ("trim_ms", count.clone()),
                    ("effects_off", names.clone()),
                    ("seats_out", names),
                ],
            ),
        ),
        ("/event", of("kinocue.event", &[("kind", &text), ("seat", &text), ("text", &text)])),
        (
            "/action",
            of("kinocue.action", &[("who", &text), ("what", &text), ("result", &text), ("state", &text)]),
        ),
        ("/mark", of("kinocue.mark", &[("film_s", &number), ("text", &text), ("who", &text)])),
        (
            "/log",
            of(
                "foxglove.Log",
                &[("timestamp", &timestamp), ("level", &count), ("message", &text), ("name", &text)],
            ),
        ),
        (
            "/timecode",
            of(
                "kinocue.timecode",
                &[
                    ("source", &text),
                    ("film_s", &number),
                    ("error_ms", &number),
                    ("locked", &json!({"type": "boolean"})),
                ],
            ),
        ),
    ]
}
