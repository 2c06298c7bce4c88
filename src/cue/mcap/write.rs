//! From a cue to an MCAP file.

use std::collections::BTreeMap;
use std::io::{self, Seek, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::super::number::push_number;
use super::super::{Cue, Effects};
use super::{METADATA, Topic, VERSION};
use crate::channel::{Channel, ChannelId, Sample, Scope, TrackId};
use crate::time::ShowTime;

/// Small, so that little is lost where a file is cut short.
const CHUNK: u64 = 64 * 1024;

/// Writes a cue as MCAP, every value exactly, its messages in order of time.
///
/// # Errors
/// Where writing fails.
pub fn write(cue: &Cue, out: impl Write + Seek) -> io::Result<()> {
    write_mcap(cue, out).map_err(|error| match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    })
}

fn write_mcap(cue: &Cue, out: impl Write + Seek) -> Result<(), McapError> {
    let mut file = McapMessages::begin(cue, out)?;
    let mut changes = Changes::new(cue);
    for (row, time) in cue.times().iter().enumerate() {
        changes.write_until(*time, &mut file)?;
        file.write(Topic::Axes, *time, |json| {
            json.push_str("{\"a\":[");
            push_list(json, cue.row(row).iter(), |json, value| push_number(json, *value));
            json.push_str("]}");
        })?;
    }
    changes.write_until(ShowTime::from_nanos(i64::MAX), &mut file)?;
    file.writer.finish()?;
    Ok(())
}

/// An open file and its channels.
struct McapMessages<W: Write + Seek> {
    writer: Writer<W>,
    channels: BTreeMap<&'static str, (u16, u32)>,
    json: String,
}

impl<W: Write + Seek> McapMessages<W> {
    fn begin(cue: &Cue, out: W) -> Result<Self, McapError> {
        let mut writer = WriteOptions::new()
            .library(concat!("kinocue ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK))
            .create(out)?;
        // Before the messages, so that a file that is cut short still says what its numbers are.
        let units = cue.unit_words();
        let entries = [
            ("version", VERSION),
            ("title", cue.title().unwrap_or("")),
            ("units", &units),
            ("interpolation", cue.interpolation().name()),
        ];
        let metadata = entries.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        writer.write_metadata(&Metadata { name: METADATA.to_owned(), metadata })?;
        let mut channels = BTreeMap::new();
        let used = |topic: &Topic| match topic {
            // Programs of before this channel read the file of a cue that has none.
            Topic::Channel(id) if *id != ChannelId::Vibration => {
                cue.tracks().used().any(|(track, _)| track.channel == *id)
            }
            _ => true,
        };
        for topic in Topic::all().filter(used) {
            let name = format!("cue.{}", topic.name().trim_start_matches("/cue/"));
            let schema = writer.add_schema(&name, "jsonschema", topic.schema().as_bytes())?;
            let channel = writer.add_channel(schema, topic.name(), "json", &BTreeMap::new())?;
            channels.insert(topic.name(), (channel, 0));
        }
        Ok(Self { writer, channels, json: String::new() })
    }

    fn write(&mut self, topic: Topic, at: ShowTime, text: impl FnOnce(&mut String)) -> Result<(), McapError> {
        let Some((channel_id, count)) = self.channels.get_mut(topic.name()) else { return Ok(()) };
        *count += 1;
        let log_time = at.as_nanos().unsigned_abs();
        let header =
            MessageHeader { channel_id: *channel_id, sequence: *count, log_time, publish_time: log_time };
        self.json.clear();
        text(&mut self.json);
        self.writer.write_to_known_channel(&header, self.json.as_bytes())
    }
}

/// A change of something that holds until its next change.
#[derive(Debug, Clone, Copy)]
enum ChannelChange {
    /// The nth step of a track.
    Track(TrackId, usize),
    /// The nth step of the effects.
    Effects(usize),
    /// The nth marker.
    Marker(usize),
}

/// All changes of a cue in order of time.
struct Changes<'a> {
    cue: &'a Cue,
    order: std::iter::Peekable<std::vec::IntoIter<(ShowTime, ChannelChange)>>,
}

impl<'a> Changes<'a> {
    fn new(cue: &'a Cue) -> Self {
        let mut order = Vec::new();
        for (track, steps) in cue.tracks().used() {
            order.extend(
                steps.as_slice().iter().enumerate().map(|(n, s)| (s.at, ChannelChange::Track(track, n))),
            );
        }
        match cue.effects() {
            Effects::Named { steps, .. } => {
                order.extend(
                    steps.as_slice().iter().enumerate().map(|(n, s)| (s.at, ChannelChange::Effects(n))),
                );
            }
            Effects::Words(steps) => {
                order.extend(
                    steps.as_slice().iter().enumerate().map(|(n, s)| (s.at, ChannelChange::Effects(n))),
                );
            }
        }
        order.extend(
            cue.markers().iter().enumerate().map(|(n, marker)| (marker.at, ChannelChange::Marker(n))),
        );
        order.sort_by_key(|(at, _)| *at);
        Self { cue, order: order.into_iter().peekable() }
    }

    /// Writes the changes up to and at a time.
    fn write_until<W: Write + Seek>(
        &mut self,
        time: ShowTime,
        file: &mut McapMessages<W>,
    ) -> Result<(), McapError> {
        while let Some((at, change)) = self.order.next_if(|(at, _)| *at <= time) {
            match change {
                ChannelChange::Track(track, n) => {
                    let sample = self.cue.tracks().of(track).as_slice()[n].value;
                    file.write(Topic::Channel(track.channel), at, |json| push_sample(json, track, sample))?;
                }
                ChannelChange::Effects(n) => {
                    file.write(Topic::Io, at, |json| push_io(json, self.cue.effects(), n))?
                }
                ChannelChange::Marker(n) => {
                    let name = serde_json::to_string(&self.cue.markers()[n].name).map_err(io::Error::from)?;
                    file.write(Topic::Marker, at, |json| json.push_str(&format!("{{\"name\":{name}}}")))?;
                }
            }
        }
        Ok(())
    }
}

/// The axis where it is a channel of axes, and every part.
fn push_sample(json: &mut String, track: TrackId, Sample(values): Sample) {
    let Channel { scope, parts, .. } = track.channel.row();
    json.push('{');
    if *scope == Scope::Axis {
        json.push_str(&format!("\"axis\":{},", track.axis + 1));
    }
    push_list(json, parts.iter().zip(values), |json, (part, value)| {
        json.push_str(&format!("\"{}\":", part.name));
        push_number(json, value);
    });
    json.push('}');
}

/// Every effect each time: a message then needs none before it to be understood.
fn push_io(json: &mut String, effects: &Effects, step: usize) {
    match effects {
        Effects::Named { names, steps } => {
            let on = steps.as_slice()[step].value;
            json.push_str("{\"effects\":{");
            push_list(json, names.iter().enumerate(), |json, (bit, name)| {
                json.push_str(&format!("\"{name}\":{}", on >> bit & 1));
            });
            json.push_str("}}");
        }
        Effects::Words(steps) => json.push_str(&format!("{{\"word\":{}}}", steps.as_slice()[step].value)),
    }
}

fn push_list<T>(json: &mut String, items: impl Iterator<Item = T>, push: impl Fn(&mut String, T)) {
    for (n, item) in items.enumerate() {
        if n > 0 {
            json.push(',');
        }
        push(json, item);
    }
}
