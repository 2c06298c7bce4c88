//! The file: MCAP with a metadata record first, JSON samples under schemas that viewers draw, and what it came to at the end.

use std::collections::BTreeMap;
use std::io::{Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapResult, WriteOptions, Writer};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::descriptors::descriptors;
use super::flight::Entry;
use super::judging::Judging;
use super::notes::topics;
use super::schemas::{schema_of_seat, schema_of_tick, state_number};
use super::waiting::Waiting;
use super::{Message, RecordedSeat};
use crate::time::{MonoTime, Rate};

/// The version of topics, messages and metadata.
pub(super) const VERSION: &str = "2";
/// What writes files.
const PROGRAM: &str = concat!("kinocue ", env!("CARGO_PKG_VERSION"));
/// The topic of whole ticks.
pub(super) const SENT: &str = "/full/sent";
/// That of what the ack thread took.
pub(crate) const ACKS: &str = "/full/acks";
/// The metadata record of a file that was recovered.
pub(super) const RECOVERED: &str = "kinocue.recovered";
/// The metadata record that a file ends with.
pub(super) const END: &str = "kinocue.end";
/// The attachment that has the report.
pub(super) const REPORT: &str = "report.json";
/// Samples a second of each seat.
pub(crate) const SAMPLE_HZ: u32 = 20;
/// Topics of notes.
const NOTE_TOPICS: usize = 6;

/// How much is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub(crate) enum Mode {
    /// Samples, each the worst of its window.
    #[default]
    Sampled,
    /// Samples, and every tick and frame.
    Full,
}

impl Mode {
    /// The word for it.
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Sampled => "sampled",
            Self::Full => "full",
        }
    }
}

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
    /// How much of it is kept.
    pub(crate) mode: Mode,
    /// One instant on both clocks: monotonic, and wall in nanoseconds since 1970.
    pub(crate) clocks: (MonoTime, u64),
}

impl About {
    /// Of a hall with no cue, everything kept.
    pub(crate) fn of_hall(hall: &str, rate: Rate, clocks: (MonoTime, u64)) -> Self {
        let [cue, title, cue_sha256] = [const { String::new() }; 3];
        Self { hall: hall.to_owned(), cue, title, cue_sha256, rate_hz: rate.hz(), mode: Mode::Full, clocks }
    }
}

/// What a file begins with: whoever has it can write what was folded for it, and needs to know nothing else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Opening {
    /// The metadata record `kinocue`.
    pub(crate) metadata: BTreeMap<String, String>,
    /// Each with its name, its encoding and its octets.
    schemas: Vec<(String, String, Vec<u8>)>,
    /// Each with its topic, the place of its schema, and the encoding of its messages.
    channels: Vec<(String, usize, String)>,
}

impl Opening {
    /// That of a recording of these seats.
    pub(crate) fn new(about: &About, seats: &[RecordedSeat]) -> Self {
        let mut opening = Self { metadata: first(about, seats), schemas: Vec::new(), channels: Vec::new() };
        let of_seat = opening.schema(&schema_of_seat());
        for seat in seats {
            opening.channels.push((format!("/seat/{}", seat.name), of_seat, "json".to_owned()));
        }
        for (topic, schema) in [("/tick", schema_of_tick())].iter().chain(&topics()) {
            let schema = opening.schema(schema);
            opening.channels.push(((*topic).to_owned(), schema, "json".to_owned()));
        }
        if about.mode == Mode::Full {
            for (topic, name) in [(SENT, "kinocue.Sent"), (ACKS, "kinocue.Acks")] {
                opening.schemas.push((name.to_owned(), "protobuf".to_owned(), descriptors()));
                let schema = opening.schemas.len() - 1;
                opening.channels.push((topic.to_owned(), schema, "protobuf".to_owned()));
            }
        }
        opening
    }

    /// That of a recording which says this of itself, where this program has written it: the numbers of its channels are known then.
    pub(super) fn of_metadata(metadata: &BTreeMap<String, String>) -> Option<Self> {
        let entry = |key: &str| metadata.get(key).map(String::as_str);
        let mode = [Mode::Sampled, Mode::Full].into_iter().find(|mode| entry("mode") == Some(mode.word()))?;
        let seats: Vec<RecordedSeat> = serde_json::from_str(entry("seats")?).ok()?;
        let about = About { mode, ..About::of_hall("", Rate::from_hz(100.0), (MonoTime::default(), 0)) };
        (entry("program") == Some(PROGRAM)).then(|| Self::new(&about, &seats))
    }

    /// The topics of its channels.
    pub(super) fn topics(&self) -> impl Iterator<Item = &str> {
        self.channels.iter().map(|(topic, ..)| topic.as_str())
    }

    /// The same with more topics of JSON, each with its schema; and the channel of the first.
    pub(super) fn with_topics(mut self, topics: &[(&str, Value)]) -> (Self, u16) {
        let first = u16::try_from(self.channels.len()).unwrap_or(u16::MAX);
        for (topic, schema) in topics {
            let schema = self.schema(schema);
            self.channels.push(((*topic).to_owned(), schema, "json".to_owned()));
        }
        (self, first)
    }

    /// Writes all channels with their schemas; gives their numbers.
    pub(super) fn declare<W: Write + Seek>(&self, writer: &mut Writer<W>) -> McapResult<Vec<u16>> {
        let mut channels = Vec::new();
        for (topic, schema, encoding) in &self.channels {
            let schema = match self.schemas.get(*schema) {
                Some((name, encoding, octets)) => writer.add_schema(name, encoding, octets)?,
                None => 0,
            };
            channels.push(writer.add_channel(schema, topic, encoding, &BTreeMap::new())?);
        }
        Ok(channels)
    }

    fn schema(&mut self, schema: &Value) -> usize {
        let name = schema["title"].as_str().unwrap_or_default().to_owned();
        self.schemas.push((name, "jsonschema".to_owned(), schema.to_string().into_bytes()));
        self.schemas.len() - 1
    }

    /// The same of samples alone.
    pub(crate) fn sampled(mut self) -> Self {
        self.channels.retain(|(topic, ..)| ![SENT, ACKS].contains(&topic.as_str()));
        self.with("mode", Mode::Sampled.word())
    }

    /// Octets from which it is read back.
    pub(crate) fn to_octets(&self) -> Vec<u8> {
        serde_json::to_vec(self).unwrap_or_default()
    }

    /// From these octets; `None` where they are of no opening.
    pub(crate) fn of_octets(octets: &[u8]) -> Option<Self> {
        serde_json::from_slice(octets).ok()
    }

    /// The same of a hall whose acks are judged so.
    pub(crate) fn judged(self, judging: &Judging) -> Self {
        let judging = serde_json::to_string(judging).unwrap_or_default();
        self.with("judging", judging)
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
            Message::Note(note) => (self.seats + 1 + note.topic(), note.json(self.wall(at))?),
            Message::Ticks(octets) => (self.seats + 1 + NOTE_TOPICS, octets.clone()),
            Message::Drains(octets) => (self.seats + 2 + NOTE_TOPICS, octets.clone()),
        };
        let channel = u16::try_from(channel).unwrap_or(u16::MAX);
        Ok(Entry { channel, log_time: self.wall(at), data })
    }

    /// True if a channel has every tick and every reply, not samples.
    pub(crate) const fn is_full(&self, channel: u16) -> bool {
        channel as usize > self.seats + NOTE_TOPICS
    }
}

/// Where one chunk of a file ends and the next begins, by log time: a damaged one costs as little as that. The first has one message
/// alone, beside the channels of all others.
#[derive(Debug, Default)]
pub(super) struct ChunkTime {
    since: Option<u64>,
    messages: u64,
}

impl ChunkTime {
    /// The longest, ns.
    const LONGEST: u64 = 1_000_000_000;

    /// True if a message of that time begins a chunk of its own.
    pub(super) fn is_over(&mut self, log_time: u64) -> bool {
        self.messages += 1;
        let since = *self.since.get_or_insert(log_time);
        let is_over = self.messages == 2 || log_time.saturating_sub(since) >= Self::LONGEST;
        if is_over {
            self.since = Some(log_time);
        }
        is_over
    }
}

/// A file that is being written.
pub(crate) struct Recording<W: Write + Seek> {
    writer: Writer<W>,
    written: ChunkTime,
    /// Topics of all channels, and their numbers in the file.
    topics: Vec<String>,
    channels: Vec<u16>,
    /// What the first message is written behind: viewers take a chunk of channels alone for one of 1970.
    undeclared: Option<Opening>,
    maker: EntryMaker,
    sequence: u32,
    last: u64,
    waiting: Waiting,
    /// The channel of samples of ticks, and the log time of the last: all samples up to then are told.
    ticks: Option<u16>,
    sampled: u64,
}

impl<W: Write + Seek> Recording<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// Where writing fails, as all of these.
    #[cfg(test)]
    pub(crate) fn begin(out: W, about: &About, seats: &[RecordedSeat]) -> McapResult<Self> {
        Self::open(out, &Opening::new(about, seats), EntryMaker::new(seats.len(), about.clocks))
    }

    /// The same with an opening that was made before.
    ///
    /// # Errors
    /// Where writing fails, as all of these.
    pub(crate) fn open(out: W, opening: &Opening, maker: EntryMaker) -> McapResult<Self> {
        // By time alone, so that of a file that is cut short or damaged no more than a second is lost.
        let mut writer = options().chunk_size(None).create(out)?;
        write_metadata(&mut writer, "kinocue", opening.metadata.clone())?;
        let ticks = opening.channels.iter().position(|(topic, ..)| topic == "/tick");
        Ok(Self {
            writer,
            written: ChunkTime::default(),
            topics: opening.channels.iter().map(|(topic, ..)| topic.clone()).collect(),
            channels: Vec::new(),
            undeclared: Some(opening.clone()),
            maker,
            sequence: 0,
            last: 0,
            waiting: Waiting::default(),
            ticks: ticks.and_then(|place| u16::try_from(place).ok()),
            sampled: 0,
        })
    }

    /// Adds a message.
    pub(crate) fn write(&mut self, at: MonoTime, message: &Message) -> McapResult<()> {
        let entry = self.maker.entry(at, message).map_err(std::io::Error::from)?;
        self.put(&entry)
    }

    /// Adds what was told under a topic in another file; under one that this lacks nothing.
    pub(super) fn note(&mut self, at: MonoTime, topic: &str, data: &[u8]) -> McapResult<()> {
        let channel = self.topics.iter().position(|one| one == topic).and_then(|at| u16::try_from(at).ok());
        let Some(channel) = channel else { return Ok(()) };
        self.put(&Entry { channel, log_time: self.maker.wall(at), data: data.to_vec() })
    }

    /// Adds one that was made before; of a channel that the opening lacks nothing.
    pub(crate) fn put(&mut self, entry: &Entry) -> McapResult<()> {
        if usize::from(entry.channel) >= self.topics.len() {
            return Ok(());
        }
        self.last = self.last.max(entry.log_time);
        if self.ticks == Some(entry.channel) {
            self.sampled = self.sampled.max(entry.log_time);
        }
        self.waiting.put(entry);
        if self.waiting.is_long() { self.settle(self.told()) } else { Ok(()) }
    }

    /// The log time up to which all is told; where there are no samples nothing waits for them.
    const fn told(&self) -> u64 {
        /// What a person or the hall tells comes so much later than the samples of that instant.
        const LATE_NS: u64 = 50_000_000;
        if self.sampled == 0 { u64::MAX } else { self.sampled.saturating_sub(LATE_NS) }
    }

    /// Writes what waits, in the order of its log times, up to one of these.
    fn settle(&mut self, until: u64) -> McapResult<()> {
        let Self { writer, written, channels, undeclared, sequence, waiting, .. } = self;
        waiting.hand_over(until, |channel, log_time, data| {
            if let Some(opening) = undeclared.take() {
                *channels = opening.declare(writer)?;
            }
            if written.is_over(log_time) {
                writer.flush()?;
            }
            *sequence = sequence.wrapping_add(1);
            let (channel_id, sequence) = (channels[usize::from(channel)], *sequence);
            let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, data)
        })
    }

    /// Attaches a file.
    pub(crate) fn attach(&mut self, name: &str, media_type: &str, data: &[u8]) -> McapResult<()> {
        let (log_time, create_time) = (self.last, self.last);
        let (name, media_type) = (name.to_owned(), media_type.to_owned());
        self.writer.attach(&Attachment { log_time, create_time, name, media_type, data: data.into() })
    }

    /// Has everything so far read even of a file that is cut short; what is newer than the last samples the next time.
    pub(crate) fn flush(&mut self) -> McapResult<()> {
        self.settle(self.told())?;
        self.writer.flush()
    }

    /// Ends the file with these figures, and a report if there is one; gives what was written to.
    pub(crate) fn finish(mut self, end: &[(&str, String)], report: Option<&[u8]>) -> McapResult<W> {
        self.settle(u64::MAX)?;
        if let Some(report) = report {
            self.attach(REPORT, "application/json", report)?;
        }
        let end = end.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        write_metadata(&mut self.writer, END, end)?;
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}

/// How files are written.
pub(super) fn options() -> WriteOptions {
    let options = WriteOptions::new().library(PROGRAM);
    options.compression(Some(Compression::Lz4))
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
    let About { hall, cue, title, cue_sha256, rate_hz, mode, clocks: (origin, wall) } = about;
    let seats = serde_json::to_string(seats).unwrap_or_default();
    let entries = [
        ("version", VERSION.to_owned()),
        ("kind", "recording".to_owned()),
        ("mode", mode.word().to_owned()),
        ("program", PROGRAM.to_owned()),
        ("hall", hall.clone()),
        ("cue", cue.clone()),
        ("title", title.clone()),
        ("cue_sha256", cue_sha256.clone()),
        ("rate_hz", rate_hz.to_string()),
        ("sample_hz", SAMPLE_HZ.to_string()),
        ("seats", seats),
        ("monotonic_ns", origin.as_nanos().to_string()),
        ("wall_ns", wall.to_string()),
    ];
    entries.map(|(key, value)| (key.to_owned(), value)).into()
}
