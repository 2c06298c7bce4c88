//! The file: MCAP with a metadata record first, JSON samples under schemas that viewers draw, and what it came to at the end.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapResult, WriteOptions, Writer};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::acks::standing_words;
use super::flight::Entry;
use super::notes::topics;
use super::{Message, RecordedSeat};
use crate::motion::AxisUnit;
use crate::state::State;
use crate::time::MonoTime;

/// The version of topics, messages and metadata.
const VERSION: &str = "1";
/// Samples a second of each seat.
pub(crate) const SAMPLE_HZ: u32 = 20;
/// Topics of notes.
const NOTE_TOPICS: usize = 6;
/// Topics of every tick and every reply: chunks as they crossed the taps, one behind the other.
const FULL_TOPICS: [&str; 2] = ["/full/ticks", "/full/replies"];

/// What a recording is of.
#[derive(Debug, Clone)]
pub(crate) struct About {
    /// The hall's name.
    pub(crate) hall: String,
    /// The cue, as people know it.
    pub(crate) cue: String,
    /// Its title; empty for none.
    pub(crate) title: String,
    /// SHA-256 of what it does.
    pub(crate) cue_sha256: String,
    /// Ticks a second.
    pub(crate) rate_hz: f64,
    /// One instant on both clocks: monotonic, and wall in nanoseconds since 1970.
    pub(crate) clocks: (MonoTime, u64),
}

/// What a file begins with: whoever has it can write what was folded for it, and needs to know nothing else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Opening {
    /// The metadata record `kinocue`.
    pub(crate) metadata: BTreeMap<String, String>,
    channels: Vec<OpeningChannel>,
}

/// A channel, and how its messages are written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct OpeningChannel {
    topic: String,
    schema_name: String,
    schema_encoding: String,
    schema: String,
    encoding: String,
}

impl Opening {
    /// That of a recording of these seats.
    pub(crate) fn new(about: &About, seats: &[RecordedSeat]) -> Self {
        let json = |topic: &str, schema: &Value| OpeningChannel {
            topic: topic.to_owned(),
            schema_name: schema["title"].as_str().unwrap_or_default().to_owned(),
            schema_encoding: "jsonschema".to_owned(),
            schema: schema.to_string(),
            encoding: "json".to_owned(),
        };
        let octets = |topic: &str| OpeningChannel {
            topic: topic.to_owned(),
            schema_name: String::new(),
            schema_encoding: String::new(),
            schema: String::new(),
            encoding: "application/octet-stream".to_owned(),
        };
        let of_seat = schema_of_seat();
        let seat = |seat: &RecordedSeat| json(&format!("/seat/{}", seat.name), &of_seat);
        let mut channels: Vec<_> = seats.iter().map(seat).collect();
        channels.push(json("/tick", &schema_of_tick()));
        channels.extend(topics().iter().map(|(topic, schema)| json(topic, schema)));
        channels.extend(FULL_TOPICS.map(octets));
        Self { metadata: first(about, seats), channels }
    }

    /// Octets from which it is read back.
    pub(crate) fn to_octets(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// From these octets; `None` where they are of no opening.
    pub(crate) fn of_octets(octets: &[u8]) -> Option<Self> {
        serde_json::from_slice(octets).ok()
    }

    /// The same of a part, or of something else.
    pub(crate) fn with(mut self, key: &str, value: impl Into<String>) -> Self {
        self.metadata.insert(key.to_owned(), value.into());
        self
    }
}

/// Makes messages of what was folded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EntryMaker {
    seats: usize,
    clocks: (MonoTime, u64),
}

impl EntryMaker {
    /// One of so many seats; `clocks` is one instant on both clocks, as [`About`] has it.
    pub(crate) const fn new(seats: usize, clocks: (MonoTime, u64)) -> Self {
        Self { seats, clocks }
    }

    /// The wall clock's time of an instant, ns since 1970.
    pub(crate) const fn wall(&self, at: MonoTime) -> u64 {
        let (origin, wall) = self.clocks;
        wall.saturating_add(at.as_nanos()).saturating_sub(origin.as_nanos())
    }

    /// A message as it stands in files.
    ///
    /// # Errors
    /// Where a figure is none.
    pub(crate) fn entry(&self, at: MonoTime, message: &Message) -> serde_json::Result<Entry> {
        let (channel, data) = match message {
            Message::Seat(lane, sample) => (*lane, serde_json::to_vec(sample)?),
            Message::Tick(sample) => (self.seats, serde_json::to_vec(sample)?),
            Message::State(state) => {
                (self.seats + 1, serde_json::to_vec(&json!({"state": state_number(*state)}))?)
            }
            Message::Note(note) => (self.seats + 1 + note.topic(), note.json()?),
            Message::Full(topic, octets) => (self.seats + 1 + NOTE_TOPICS + topic, octets.clone()),
        };
        let channel = u16::try_from(channel).unwrap_or(u16::MAX);
        Ok(Entry { channel, log_time: self.wall(at), data })
    }

    /// True if a channel has every tick and every reply, not samples.
    pub(crate) const fn is_full(&self, channel: u16) -> bool {
        channel as usize > self.seats + NOTE_TOPICS
    }
}

/// A file that is being written.
pub(crate) struct Recording<W: Write + Seek> {
    writer: Writer<W>,
    channels: Vec<u16>,
    maker: EntryMaker,
    sequence: u32,
    last: u64,
}

impl<W: Write + Seek> Recording<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// Where writing fails, as all of these.
    pub(crate) fn begin(out: W, about: &About, seats: &[RecordedSeat]) -> McapResult<Self> {
        Self::open(out, &Opening::new(about, seats), EntryMaker::new(seats.len(), about.clocks))
    }

    /// The same with an opening that was made before.
    pub(crate) fn open(out: W, opening: &Opening, maker: EntryMaker) -> McapResult<Self> {
        let mut writer = WriteOptions::new()
            .library(concat!("kinocue ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            // By time alone, so that of a file that is cut short no more than half a second is lost.
            .chunk_size(None)
            .create(out)?;
        write_metadata(&mut writer, "kinocue", opening.metadata.clone())?;
        let mut channel = |one: &OpeningChannel| {
            let schema = if one.schema_name.is_empty() {
                0
            } else {
                writer.add_schema(&one.schema_name, &one.schema_encoding, one.schema.as_bytes())?
            };
            writer.add_channel(schema, &one.topic, &one.encoding, &BTreeMap::new())
        };
        let channels = opening.channels.iter().map(&mut channel).collect::<McapResult<_>>()?;
        Ok(Self { writer, channels, maker, sequence: 0, last: 0 })
    }

    /// Adds a message.
    pub(crate) fn write(&mut self, at: MonoTime, message: &Message) -> McapResult<()> {
        let entry = self.maker.entry(at, message).map_err(std::io::Error::from)?;
        self.put(&entry)
    }

    /// Adds one that was made before; of a channel that the opening lacks nothing.
    pub(crate) fn put(&mut self, entry: &Entry) -> McapResult<()> {
        let Entry { channel, log_time, data } = entry;
        let Some(&channel_id) = self.channels.get(usize::from(*channel)) else { return Ok(()) };
        self.sequence = self.sequence.wrapping_add(1);
        self.last = self.last.max(*log_time);
        let (log_time, publish_time) = (*log_time, *log_time);
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time };
        self.writer.write_to_known_channel(&header, data)
    }

    /// Attaches a file.
    pub(crate) fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> McapResult<()> {
        let (log_time, create_time) = (self.last, self.last);
        let (name, media_type) = (name.to_owned(), media_type.to_owned());
        self.writer.attach(&Attachment { log_time, create_time, name, media_type, data: data.into() })
    }

    /// Has everything so far read even of a file that is cut short.
    pub(crate) fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Ends the file with these figures, and a report if there is one; gives what was written to.
    pub(crate) fn finish(mut self, end: &[(&str, String)], report: Option<&[u8]>) -> McapResult<W> {
        if let Some(report) = report {
            self.attach("report.json", "application/json", report)?;
        }
        let end = end.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        write_metadata(&mut self.writer, "kinocue.end", end)?;
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}

fn write_metadata<W: Write + Seek>(
    writer: &mut Writer<W>,
    name: &str,
    metadata: BTreeMap<String, String>,
) -> McapResult<()> {
    writer.write_metadata(&Metadata { name: name.to_owned(), metadata })
}

/// What stands at the beginning, so that a file that is cut short still says what it is of.
fn first(about: &About, seats: &[RecordedSeat]) -> BTreeMap<String, String> {
    let About { hall, cue, title, cue_sha256, rate_hz, clocks: (origin, wall) } = about;
    let unit = |unit| if unit == AxisUnit::Degree { "deg" } else { "mm" };
    let seat = |seat: &RecordedSeat| json!({"name": &*seat.name, "units": seat.units().map(unit).collect::<Vec<_>>()});
    let seats = Value::from_iter(seats.iter().map(seat));
    let entries = [
        ("version", VERSION.to_owned()),
        ("kind", "recording".to_owned()),
        ("mode", "sampled".to_owned()),
        ("program", concat!("kinocue ", env!("CARGO_PKG_VERSION")).to_owned()),
        ("hall", hall.clone()),
        ("cue", cue.clone()),
        ("title", title.clone()),
        ("cue_sha256", cue_sha256.clone()),
        ("rate_hz", rate_hz.to_string()),
        ("sample_hz", SAMPLE_HZ.to_string()),
        ("seats", seats.to_string()),
        ("monotonic_ns", origin.as_nanos().to_string()),
        ("wall_ns", wall.to_string()),
    ];
    entries.map(|(key, value)| (key.to_owned(), value)).into()
}

/// A state as viewers have it: a number that the schema names.
pub(crate) fn state_number(state: State) -> usize {
    State::ALL.iter().position(|one| *one == state).unwrap_or_default()
}

/// Viewers take one type a property, never null, arrays of scalars, and `oneOf` only to name numbers.
pub(super) fn schema(title: &str, always: &[(&str, Value)], at_times: &[(&str, Value)]) -> Value {
    let required: Vec<&str> = always.iter().map(|(name, _)| *name).collect();
    let all = always.iter().chain(at_times);
    let properties: serde_json::Map<String, Value> =
        all.map(|(name, kind)| ((*name).to_owned(), kind.clone())).collect();
    json!({"title": title, "type": "object", "required": required, "properties": properties})
}

fn schema_of_seat() -> Value {
    let [number, count] = [json!({"type": "number"}), json!({"type": "integer"})];
    let places = json!({"type": "array", "items": {"type": "number"}});
    let standings =
        (0..).zip(standing_words()).map(|(at, word): (u8, _)| json!({"title": word, "const": at}));
    schema(
        "kinocue.seat",
        &[
            ("film_s", number.clone()),
            ("asked_mm", places.clone()),
            ("sent_mm", places.clone()),
            ("level", number.clone()),
            ("sent", count.clone()),
            ("unsent", count.clone()),
            ("clamps", count.clone()),
            ("measured_mm", places),
            ("acked", count.clone()),
            ("refused", count.clone()),
            ("lost", count),
        ],
        &[
            ("ack_us", number.clone()),
            ("ack_max_us", number),
            ("standing", json!({"type": "integer", "oneOf": standings.collect::<Vec<_>>()})),
        ],
    )
}

fn schema_of_tick() -> Value {
    let [number, count] = [json!({"type": "number"}), json!({"type": "integer"})];
    schema(
        "kinocue.tick",
        &[
            ("film_s", number.clone()),
            ("late_us", number.clone()),
            ("late_max_us", number),
            ("ticks", count.clone()),
            ("missed", count.clone()),
            ("dropped", count),
        ],
        &[],
    )
}

/// A state by number.
pub(super) fn state_schema() -> Value {
    let named = State::ALL.map(|state| json!({"title": state.word(), "const": state_number(state)}));
    json!({"type": "integer", "oneOf": named})
}
