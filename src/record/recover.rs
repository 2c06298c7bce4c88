//! A recording that its writer did not close, written anew: everything that is complete in it, with an index and a note.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, Write};

use mcap::records::{MessageHeader, Metadata, op};
use mcap::{Attachment, McapError, Writer};

use super::read::ReadError;
use super::recording::options;
use crate::container::{self, ChannelRecord, Trouble};

/// What was saved.
#[derive(Debug)]
pub(crate) struct Recovered {
    /// Messages of each topic.
    pub(crate) messages: BTreeMap<String, u64>,
    /// Why there are no more; nothing where the file was whole.
    pub(crate) trouble: Option<Trouble>,
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

/// Copies what is complete.
///
/// # Errors
/// Where the file is no recording, and where writing fails.
pub(crate) fn recover<W: Write + Seek>(input: impl Read, out: W) -> Result<(Recovered, W), RecoverError> {
    const MOST: u64 = 256 << 30;
    let mut copy = Copy {
        writer: options().create(out)?,
        schemas: BTreeMap::new(),
        channels: BTreeMap::new(),
        messages: BTreeMap::new(),
        is_recording: false,
    };
    let trouble = match container::each_sound(input, MOST, |opcode, body| copy.record(opcode, body)) {
        Ok(()) => None,
        Err((_, RecoverError::Read(ReadError::File(trouble)))) if copy.is_recording => Some(trouble),
        Err((_, error)) => return Err(error),
    };
    if !copy.is_recording {
        return Err(ReadError::Foreign.into());
    }
    let why = trouble.as_ref().map_or_else(String::new, ToString::to_string);
    let metadata = [("why".to_owned(), why)].into();
    copy.writer.write_metadata(&Metadata { name: "kinocue.recovered".to_owned(), metadata })?;
    copy.writer.finish()?;
    Ok((Recovered { messages: copy.messages, trouble }, copy.writer.into_inner()))
}

struct Copy<W: Write + Seek> {
    writer: Writer<W>,
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
            op::SCHEMA => {
                let Some((id, name, encoding, data)) = container::schema_of(body) else { return Ok(()) };
                let new = self.writer.add_schema(name, encoding, data)?;
                self.schemas.insert(id, new);
                Ok(())
            }
            op::CHANNEL => {
                let Some(channel) = ChannelRecord::parse(body) else { return Ok(()) };
                let schema = self.schemas.get(&channel.schema).copied().unwrap_or(0);
                let new =
                    self.writer.add_channel(schema, channel.topic, channel.encoding, &BTreeMap::new())?;
                self.channels.insert(channel.id, (new, channel.topic.to_owned()));
                Ok(())
            }
            op::MESSAGE => self.message(body),
            op::ATTACHMENT => {
                let Some((name, data)) = container::attachment(body) else { return Ok(()) };
                let (name, media_type) = (name.to_owned(), "application/json".to_owned());
                let data = data.into();
                Ok(self.writer.attach(&Attachment { log_time: 0, create_time: 0, name, media_type, data })?)
            }
            _ => Ok(()),
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
        let count = self.messages.entry(topic.clone()).or_default();
        *count += 1;
        let sequence = u32::try_from(*count).unwrap_or(u32::MAX);
        let header = MessageHeader { channel_id: *channel_id, sequence, log_time, publish_time: log_time };
        Ok(self.writer.write_to_known_channel(&header, data)?)
    }
}
