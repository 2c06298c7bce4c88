//! A recording that is damaged, was not closed, or is in another order, written anew: everything that is complete in it, by time, with an index
//! and a note.

use std::collections::BTreeMap;
use std::io::{self, Cursor, Read, Seek, Write};

use jiff::Timestamp;
use mcap::records::{MessageHeader, Metadata, op};
use mcap::{Attachment, McapError, Writer};

use super::read::{MOST, ReadError, is_beginning, is_late, owned};
use super::recording::{ChunkTime, Opening, RECOVERED, options};
use crate::container::{self, AttachmentRecord, ChannelRecord, LostStretch, Salvaged, Trouble, each_saved};

/// Octets of messages that are put into order at the most: all are held for it.
const MOST_SORTED: u64 = 1 << 30;

/// What was saved.
#[derive(Debug)]
pub(crate) struct Recovered {
    /// Messages of each topic.
    pub(crate) messages: BTreeMap<String, u64>,
    /// What was wrong with the file, and what is lost of it.
    pub(crate) salvaged: Salvaged,
    /// Messages that are lost because nothing says what they are of.
    nameless: u64,
    /// False where it was in another order than that of time.
    is_sorted: bool,
}

impl Recovered {
    /// True where all is saved that the file had.
    pub(crate) fn loses_nothing(&self) -> bool {
        self.salvaged.lost.is_empty() && self.lost_messages() == Some(0)
    }

    /// Messages that are lost; `None` where nothing says how many.
    pub(crate) fn lost_messages(&self) -> Option<u64> {
        self.salvaged.messages.map(|lost| lost + self.nameless)
    }

    /// What was wrong with the file, and what is lost of it.
    pub(crate) fn in_words(&self) -> String {
        /// Stretches that are told.
        const TOLD: usize = 8;
        let Salvaged { trouble, lost, more, .. } = &self.salvaged;
        let mut words = match trouble {
            Some(trouble) => trouble.to_string(),
            None if !self.loses_nothing() => "is damaged".to_owned(),
            None if !self.is_sorted => ReadError::UNSORTED.to_owned(),
            None => "was whole".to_owned(),
        };
        if self.loses_nothing() {
            return words;
        }
        words += &match self.lost_messages() {
            Some(1) => "; lost is 1 message".to_owned(),
            Some(count) => format!("; lost are {count} messages"),
            None => "; lost are messages, how many is not known".to_owned(),
        };
        lost.iter().take(TOLD).for_each(|stretch| words += &stretch_in_words(stretch));
        let more = lost.len().saturating_sub(TOLD) as u64 + more;
        if more > 0 {
            words += &format!("; and {more} more stretches");
        }
        words
    }
}

fn stretch_in_words(LostStretch { octets, span, trouble, .. }: &LostStretch) -> String {
    let time = |ns: u64| {
        let at = i64::try_from(ns).ok().and_then(|ns| Timestamp::from_nanosecond(ns.into()).ok());
        at.unwrap_or_default().strftime("%F %T%.3f UTC").to_string()
    };
    let when = match *span {
        (Some(from), Some(until)) => {
            #[expect(clippy::cast_precision_loss, reason = "to a tenth")]
            let seconds = until.saturating_sub(from) as f64 / 1e9;
            format!("{seconds:.1} s from {} on", time(from))
        }
        (Some(from), None) => format!("what came after {}", time(from)),
        (None, Some(until)) => format!("what came before {}", time(until)),
        (None, None) => "all of it".to_owned(),
    };
    if *octets == 0 { format!("; {when}") } else { format!("; {when}: {octets} bytes; this part {trouble}") }
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

/// Copies what is complete; what is damaged in between is left out, and what is in another order is put into that of time.
///
/// # Errors
/// Where the file is no recording, and where writing fails.
pub(crate) fn recover<W: Write + Seek>(
    mut input: impl Read + Seek,
    out: W,
) -> Result<(Recovered, W), RecoverError> {
    let mut order = FileOrder::default();
    each_saved(&mut input, MOST, |opcode, body| order.record(opcode, body))?;
    let mut copy = Copy::new(options().chunk_size(None).create(out)?);
    let is_sorted = order.is_of_time();
    let salvaged = if is_sorted {
        each_saved(&mut input, MOST, |opcode, body| copy.record(opcode, body))?
    } else {
        copy.in_order(&mut input, &order)?
    };
    if !copy.is_recording {
        return Err(ReadError::Foreign.into());
    }
    let recovered = Recovered { messages: copy.messages, salvaged, nameless: copy.nameless, is_sorted };
    // Of a file that was only in another order the copy lacks nothing.
    let is_whole = recovered.loses_nothing() && recovered.salvaged.trouble.is_none();
    let why = if is_whole { String::new() } else { recovered.in_words() };
    let metadata = [("why".to_owned(), why)].into();
    copy.writer.write_metadata(&Metadata { name: RECOVERED.to_owned(), metadata })?;
    copy.writer.finish()?;
    Ok((recovered, copy.writer.into_inner()))
}

/// In which order a file has its records.
#[derive(Debug, Default)]
struct FileOrder {
    /// What it says of itself came before its messages.
    begins: bool,
    newest: u64,
    messages: u64,
    is_mixed: bool,
    /// Octets of its messages.
    octets: u64,
}

impl FileOrder {
    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), RecoverError> {
        match opcode {
            op::METADATA if self.messages == 0 => self.begins |= is_beginning(body),
            op::MESSAGE => {
                let Some((_, log_time, _)) = container::message(body) else { return Ok(()) };
                self.is_mixed |= is_late(log_time, self.newest);
                self.newest = self.newest.max(log_time);
                (self.messages, self.octets) = (self.messages + 1, self.octets + body.len() as u64);
            }
            _ => {}
        }
        Ok(())
    }

    const fn is_of_time(&self) -> bool {
        !self.is_mixed && (self.begins || self.messages == 0)
    }
}

struct Copy<W: Write + Seek> {
    writer: Writer<W>,
    /// What the file says of itself.
    begin: BTreeMap<String, String>,
    /// Messages of channels that nothing names.
    nameless: u64,
    written: ChunkTime,
    /// Schemas and channels that the next message is written behind: viewers take a chunk of these alone for one of 1970.
    undeclared: Vec<(u8, Vec<u8>)>,
    schemas: BTreeMap<u16, u16>,
    channels: BTreeMap<u16, (u16, String)>,
    messages: BTreeMap<String, u64>,
    is_recording: bool,
}

impl<W: Write + Seek> Copy<W> {
    fn new(writer: Writer<W>) -> Self {
        Self {
            writer,
            begin: BTreeMap::new(),
            nameless: 0,
            written: ChunkTime::default(),
            undeclared: Vec::new(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            messages: BTreeMap::new(),
            is_recording: false,
        }
    }

    /// Copies a file that is in another order: what it says of itself, then its messages by their log times, then all else.
    fn in_order(
        &mut self,
        input: &mut (impl Read + Seek),
        order: &FileOrder,
    ) -> Result<Salvaged, RecoverError> {
        if order.octets > MOST_SORTED {
            return Err(ReadError::Order("and is too large to be put into order").into());
        }
        each_saved(&mut *input, MOST, |opcode, body| {
            let is_first = opcode == op::METADATA && !self.is_recording && is_beginning(body);
            if is_first { self.metadata(body) } else { Ok(()) }
        })?;
        let mut messages: Vec<(u64, u16, Vec<u8>)> = Vec::new();
        let salvaged = each_saved(&mut *input, MOST, |opcode, body| match opcode {
            op::SCHEMA | op::CHANNEL => self.record(opcode, body),
            op::MESSAGE => {
                self.declare_all()?;
                let Some((channel, log_time, data)) = container::message(body) else { return Ok(()) };
                messages.push((log_time, channel, data.to_vec()));
                Ok(())
            }
            _ => Ok(()),
        })?;
        messages.sort_by_key(|(log_time, ..)| *log_time);
        for (log_time, channel, data) in &messages {
            self.write(*channel, *log_time, data)?;
        }
        let mut begun = false;
        each_saved(&mut *input, MOST, |opcode, body| match opcode {
            op::METADATA if !begun && is_beginning(body) => {
                begun = true;
                Ok(())
            }
            op::METADATA | op::ATTACHMENT => self.record(opcode, body),
            _ => Ok(()),
        })?;
        Ok(salvaged)
    }

    fn declare_all(&mut self) -> Result<(), RecoverError> {
        let declared = std::mem::take(&mut self.undeclared);
        declared.iter().try_for_each(|(opcode, body)| self.declare(*opcode, body))
    }

    /// Declares the channels that a recording has which says that of itself, where the file names none of that number any more.
    fn declare_own(&mut self) -> Result<(), RecoverError> {
        let Some(opening) = Opening::of_metadata(&std::mem::take(&mut self.begin)) else { return Ok(()) };
        let mut first = options().create(Cursor::new(Vec::new()))?;
        let (theirs, topics) = (opening.declare(&mut first)?, opening.topics());
        let ours = opening.declare(&mut self.writer)?;
        for ((theirs, ours), topic) in theirs.into_iter().zip(ours).zip(topics) {
            self.channels.entry(theirs).or_insert_with(|| (ours, topic.to_owned()));
        }
        Ok(())
    }

    /// One that cannot be taken apart is left out.
    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), RecoverError> {
        match opcode {
            op::METADATA => self.metadata(body),
            op::SCHEMA | op::CHANNEL => {
                self.undeclared.push((opcode, body.to_vec()));
                Ok(())
            }
            op::MESSAGE => {
                self.declare_all()?;
                let Some((channel, log_time, data)) = container::message(body) else { return Ok(()) };
                self.write(channel, log_time, data)
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
        let metadata = owned(entries);
        if !self.is_recording && is_beginning(body) {
            (self.is_recording, self.begin) = (true, metadata.clone());
        }
        Ok(self.writer.write_metadata(&Metadata { name: name.to_owned(), metadata })?)
    }

    fn write(&mut self, channel: u16, log_time: u64, data: &[u8]) -> Result<(), RecoverError> {
        if !self.channels.contains_key(&channel) && !self.begin.is_empty() {
            self.declare_own()?;
        }
        let Some((channel_id, topic)) = self.channels.get(&channel) else {
            self.nameless += 1;
            return Ok(());
        };
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
