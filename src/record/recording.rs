//! The file: MCAP with a metadata record first, JSON samples under schemas that viewers draw, and what it came to at the end.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapError, McapResult, WriteOptions, Writer};
use serde_json::{Value, json};

use super::acks::standing_words;
use super::{Message, RecordedSeat};
use crate::motion::AxisUnit;
use crate::state::State;
use crate::time::MonoTime;

/// The version of topics, messages and metadata.
const VERSION: &str = "1";
/// Samples a second of each seat.
pub(crate) const SAMPLE_HZ: u32 = 20;

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

/// A file that is being written.
pub(crate) struct Recording<W: Write + Seek> {
    writer: Writer<W>,
    clocks: (MonoTime, u64),
    seats: Vec<u16>,
    ticks: u16,
    hall: u16,
    sequence: u32,
}

impl<W: Write + Seek> Recording<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// Where writing fails, as all of these.
    pub(crate) fn begin(out: W, about: &About, seats: &[RecordedSeat]) -> McapResult<Self> {
        let mut writer = WriteOptions::new()
            .library(concat!("kinocue ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            // By time alone, so that of a file that is cut short no more than half a second is lost.
            .chunk_size(None)
            .create(out)?;
        write_metadata(&mut writer, "kinocue", first(about, seats))?;
        let mut channel = |topic: &str, schema: &Value| {
            let name = schema["title"].as_str().unwrap_or_default();
            let schema = writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
            writer.add_channel(schema, topic, "json", &BTreeMap::new())
        };
        let names = seats.iter().map(|seat| format!("/seat/{}", seat.name));
        let seats = names.map(|topic| channel(&topic, &schema_of_seat())).collect::<McapResult<_>>()?;
        let (ticks, hall) = (channel("/tick", &schema_of_tick())?, channel("/hall", &schema_of_hall())?);
        Ok(Self { writer, clocks: about.clocks, seats, ticks, hall, sequence: 0 })
    }

    /// Adds a message.
    pub(crate) fn write(&mut self, at: MonoTime, message: &Message) -> McapResult<()> {
        let (channel_id, data) = match message {
            Message::Seat(lane, sample) => (self.seats[*lane], serde_json::to_vec(sample)),
            Message::Tick(sample) => (self.ticks, serde_json::to_vec(sample)),
            Message::State(state) => (self.hall, serde_json::to_vec(&json!({"state": number(*state)}))),
        };
        let (origin, wall) = self.clocks;
        let log_time = wall.saturating_add(at.as_nanos()).saturating_sub(origin.as_nanos());
        self.sequence = self.sequence.wrapping_add(1);
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.writer.write_to_known_channel(&header, &data.map_err(std::io::Error::from)?)
    }

    /// Has everything so far read even of a file that is cut short.
    pub(crate) fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Ends the file with these figures, and a report if there is one; gives what was written to.
    pub(crate) fn finish(mut self, end: &[(&str, u64)], report: Option<&[u8]>) -> McapResult<W> {
        if let Some(report) = report {
            let (name, media_type) = ("report.json".to_owned(), "application/json".to_owned());
            let log_time = self.clocks.1;
            let data = report.into();
            self.writer.attach(&Attachment { log_time, create_time: log_time, name, media_type, data })?;
        }
        let end = end.iter().map(|(key, value)| ((*key).to_owned(), value.to_string()));
        write_metadata(&mut self.writer, "kinocue.end", end.collect())?;
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}

fn write_metadata<W: Write + Seek>(
    writer: &mut Writer<W>,
    name: &str,
    metadata: BTreeMap<String, String>,
) -> Result<(), McapError> {
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
fn number(state: State) -> usize {
    State::ALL.iter().position(|one| *one == state).unwrap_or_default()
}

/// Viewers take one type a property, never null, arrays of scalars, and `oneOf` only to name numbers.
fn schema(title: &str, always: &[(&str, Value)], at_times: &[(&str, Value)]) -> Value {
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

fn schema_of_hall() -> Value {
    let named = State::ALL.map(|state| json!({"title": state.word(), "const": number(state)}));
    schema("kinocue.hall", &[("state", json!({"type": "integer", "oneOf": named}))], &[])
}
