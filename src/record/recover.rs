//! A recording that its writer did not close, written anew: everything that is complete in it, with an index and a note.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom, Write};

use jiff::Timestamp;
use mcap::records::{MessageHeader, Metadata, op};
use mcap::{Attachment, McapError, Writer};

use super::read::ReadError;
use super::recording::{ChunkTime, RECOVERED, options};
use crate::container::{self, AttachmentRecord, ChannelRecord, LostChunk, Trouble};

/// Lost chunks that are kept account of.
const LOST: usize = 10_000;

/// What was saved.
#[derive(Debug)]
pub(crate) struct Recovered {
    /// Messages of each topic.
    pub(crate) messages: BTreeMap<String, u64>,
    /// Why there are no more behind the last; nothing where the file has its end.
    pub(crate) trouble: Option<Trouble>,
    /// What is missing between them.
    pub(crate) lost: Vec<LostChunk>,
}

impl Recovered {
    /// What was wrong with the file, and what is lost of it.
    pub(crate) fn in_words(&self) -> String {
        /// Chunks whose times are told.
        const TOLD: usize = 8;
        let mut words = match (&self.trouble, self.lost.len()) {
            (Some(trouble), _) => trouble.to_string(),
            (None, 0) => "was whole".to_owned(),
            (None, _) => "is damaged".to_owned(),
        };
        for LostChunk { span: (from, until), trouble } in self.lost.iter().take(TOLD) {
            #[expect(clippy::cast_precision_loss, reason = "to a tenth")]
            let seconds = until.saturating_sub(*from) as f64 / 1e9;
            let at = i64::try_from(*from).ok().and_then(|ns| Timestamp::from_nanosecond(ns.into()).ok());
            let at = at.unwrap_or_default().strftime("%F %T%.3f UTC");
            words += &format!("; lost are {seconds:.1} s from {at} on: a chunk that {trouble}");
        }
        if self.lost.len() > TOLD {
            words += &format!("; and {} more chunks", self.lost.len() - TOLD);
        }
        words
    }
}

/// Why nothing was saved.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecoverError {
    /// The file cannot be read from its beginning on.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Writing failed.
    #[error("writing failed")]
    Write(#[from] io::Error),
}

impl From<Trouble> for RecoverError {
    fn from(trouble: Trouble) -> Self {
        Self::Read(trouble.into())
    }
}

impl From<McapError> for RecoverError {
    fn from(error: McapError) -> Self {
        Self::Write(match error {
            McapError::Io(error) => error,
            other => io::Error::other(other.to_string()),
        })
    }
}

/// Copies what is complete; what is damaged in between is left out.
///
/// # Errors
/// Where the file is no recording, and where writing fails.
pub(crate) fn recover<W: Write + Seek>(
    mut input: impl Read + Seek,
    out: W,
) -> Result<(Recovered, W), RecoverError> {
    const MOST: u64 = 256 << 30;
    let mut copy = Copy {
        writer: options().chunk_size(None).create(out)?,
        written: ChunkTime::default(),
        undeclared: Vec::new(),
        schemas: BTreeMap::new(),
        channels: BTreeMap::new(),
        messages: BTreeMap::new(),
        is_recording: false,
    };
    // What a chunk that is lost said first stands in the summary again.
    container::each_outside(&mut input, MOST, |opcode, body| {
        if matches!(opcode, op::SCHEMA | op::CHANNEL) {
            copy.undeclared.push((opcode, body.to_vec()));
        }
    });
    input.seek(SeekFrom::Start(0))?;
    let mut lost = Vec::new();
    let saved = container::each_saved(
        input,
        MOST,
        |opcode, body| copy.record(opcode, body),
        |chunk| {
            if lost.len() < LOST {
                lost.push(chunk);
            }
        },
    );
    let trouble = match saved {
        Ok(()) => None,
        Err(RecoverError::Read(ReadError::File(trouble))) if copy.is_recording => Some(trouble),
        Err(error) => return Err(error),
    };
    if !copy.is_recording {
        return Err(ReadError::Foreign.into());
    }
    let recovered = Recovered { messages: copy.messages, trouble, lost };
    let is_whole = recovered.trouble.is_none() && recovered.lost.is_empty();
    let why = if is_whole { String::new() } else { recovered.in_words() };
    let metadata = [("why".to_owned(), why)].into();
    copy.writer.write_metadata(&Metadata { name: RECOVERED.to_owned(), metadata })?;
    copy.writer.finish()?;
    Ok((recovered, copy.writer.into_inner()))
}

struct Copy<W: Write + Seek> {
    writer: Writer<W>,
    written: ChunkTime,
    /// Schemas and channels that the next message is written behind: viewers take a chunk of these alone for one of 1970.
    undeclared: Vec<(u8, Vec<u8>)>,
    schemas: BTreeMap<u16, u16>,
    channels: BTreeMap<u16, (u16, String)>,
    messages: BTreeMap<String, u64>,
    is_recording: bool,
}

impl<W: Write + Seek> Copy<W> {
    /// One that cannot be taken apart is left out.
    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), RecoverError> {
        match opcode {
            op::METADATA => self.metadata(body),
            op::SCHEMA | op::CHANNEL => {
                self.undeclared.push((opcode, body.to_vec()));
                Ok(())
            }
            op::MESSAGE => {
                let declared = std::mem::take(&mut self.undeclared);
                declared.iter().try_for_each(|(opcode, body)| self.declare(*opcode, body))?;
                self.message(body)
            }
            op::ATTACHMENT => {
                let Some(read) = AttachmentRecord::parse(body) else { return Ok(()) };
                let AttachmentRecord { log_time, .. } = read;
                let (name, media_type) = (read.name.to_owned(), read.media_type.to_owned());
                let data = read.data.into();
                Ok(self.writer.attach(&Attachment {
                    log_time,
                    create_time: log_time,
                    name,
                    media_type,
                    data,
                })?)
            }
            _ => Ok(()),
        }
    }

    fn declare(&mut self, opcode: u8, body: &[u8]) -> Result<(), RecoverError> {
        match opcode {
            op::SCHEMA => {
                let Some((id, name, encoding, data)) = container::schema_of(body) else { return Ok(()) };
                // The writer has the same number for the same.
                let new = self.writer.add_schema(name, encoding, data)?;
                self.schemas.insert(id, new);
                Ok(())
            }
            _ => {
                let Some(channel) = ChannelRecord::parse(body) else { return Ok(()) };
                if self.channels.get(&channel.id).is_some_and(|(_, topic)| topic == channel.topic) {
                    return Ok(());
                }
                let schema = self.schemas.get(&channel.schema).copied().unwrap_or(0);
                let new =
                    self.writer.add_channel(schema, channel.topic, channel.encoding, &BTreeMap::new())?;
                self.channels.insert(channel.id, (new, channel.topic.to_owned()));
                Ok(())
            }
        }
    }

    fn metadata(&mut self, body: &[u8]) -> Result<(), RecoverError> {
        let Some((name, entries)) = container::metadata(body) else { return Ok(()) };
        self.is_recording |= name == "kinocue" && entries.get("kind") == Some(&"recording");
        let owned = |(key, value): (&str, &str)| (key.to_owned(), value.to_owned());
        let metadata = entries.into_iter().map(owned).collect();
        Ok(self.writer.write_metadata(&Metadata { name: name.to_owned(), metadata })?)
    }

    fn message(&mut self, body: &[u8]) -> Result<(), RecoverError> {
        let Some((channel, log_time, data)) = container::message(body) else { return Ok(()) };
        let Some((channel_id, topic)) = self.channels.get(&channel) else { return Ok(()) };
        if self.written.is_over(log_time) {
            self.writer.flush()?;
        }
        let count = self.messages.entry(topic.clone()).or_default();
        *count += 1;
        let sequence = u32::try_from(*count).unwrap_or(u32::MAX);
        let header = MessageHeader { channel_id: *channel_id, sequence, log_time, publish_time: log_time };
        Ok(self.writer.write_to_known_channel(&header, data)?)
    }
}
