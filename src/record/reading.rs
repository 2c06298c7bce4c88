//! Recordings read back, record by record, so that a long one takes no more memory than a short one: taken apart on any thread, and told
//! in the order of the file. Takes any bytes without a panic.

use std::io::Read;
use std::sync::Arc;

use mcap::records::op;
use serde::Deserialize;
use serde_json::Value;

use super::ack_columns;
use super::full;
use super::read::{
    Contents, MOST, REMEDY, ReadError, Told, Wanted, WantedFull, WantedSamples, is_late, owned,
};
use super::recording::{ACKS, END, RECOVERED, REPORT, SENT};
use super::sample_text::seat_sample;
use super::seat::RecordedSeat;
use crate::container::{self, AttachmentRecord, ChannelRecord, SplitReader};
use crate::plain::escaped;
use crate::time::MonoTime;

/// The longest metadata or report that is kept, bytes.
const KEPT: usize = 16 << 20;

/// Reads a recording, and tells of each message that is wanted in the order of the file.
///
/// # Errors
/// Where it is none. What is complete in one that is cut short or damaged is read; [`Contents::trouble`] says so.
pub(crate) fn read(
    input: impl Read,
    wanted: Wanted<'_>,
    take: &mut dyn FnMut(&Contents, MonoTime, Told<'_>),
) -> Result<Contents, ReadError> {
    let mut reading = Reading::new(wanted, take);
    let read = container::each_sound(input, MOST, |opcode, body| reading.record(opcode, body));
    reading.end(read.map_err(|(_, error)| error))
}

/// The same for a process that has nothing else to do: chunks are taken apart by all its processors, ahead of what is told.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_ahead(
    input: impl Read,
    wanted: Wanted<'_>,
    take: &mut dyn FnMut(&Contents, MonoTime, Told<'_>),
) -> Result<Contents, ReadError> {
    let mut reading = Reading::new(wanted, take);
    let read = container::each_sound_ahead(input, MOST, &mut reading);
    reading.end(read)
}

/// What the messages of a channel are.
#[derive(Debug, Clone, Copy)]
enum RecordedTopic {
    /// Of them only the number is told.
    Passed,
    Seat(usize),
    Tick,
    Hall,
    Sent,
    Acks,
    Other,
}

/// What has to be known to take a message apart.
#[derive(Debug, Clone)]
struct KnownChannels {
    seats: Vec<RecordedSeat>,
    /// Topics of channels, by their numbers.
    topics: Vec<Option<(String, RecordedTopic)>>,
    /// The seat whose samples are wanted; `None` for all.
    seat: Option<String>,
    samples: WantedSamples,
    full: WantedFull,
}

/// What a message says.
#[derive(Debug)]
enum ReadMessage {
    /// That, or why it says nothing.
    Told(Result<Told<'static>, String>),
    /// Anything else, as it stands there.
    Other(Vec<u8>),
    /// It is not wanted.
    Passed,
}

/// What a record comes to.
#[derive(Debug)]
enum ReadPart {
    /// A message of that channel, with its log time.
    Message(u16, u64, ReadMessage),
    /// What is taken apart once all before it is known.
    Record(u8, Vec<u8>),
}

impl KnownChannels {
    fn topic(&self, topic: &str) -> RecordedTopic {
        match topic {
            "/tick" => RecordedTopic::Tick,
            "/hall" => RecordedTopic::Hall,
            SENT if self.full == WantedFull::None => RecordedTopic::Passed,
            ACKS if self.full != WantedFull::All => RecordedTopic::Passed,
            SENT => RecordedTopic::Sent,
            ACKS => RecordedTopic::Acks,
            other => {
                let name = other.strip_prefix("/seat/");
                let seat = name.and_then(|name| self.seats.iter().position(|seat| seat.name == name));
                let is_wanted = self.samples != WantedSamples::None
                    && self.seat.as_deref().is_none_or(|seat| name == Some(seat));
                match seat {
                    Some(_) if !is_wanted => RecordedTopic::Passed,
                    Some(lane) => RecordedTopic::Seat(lane),
                    None => RecordedTopic::Other,
                }
            }
        }
    }

    /// The place of the seat that is wanted; `None` for all.
    fn lane(&self) -> Option<usize> {
        let wanted = self.seat.as_deref()?;
        self.seats.iter().position(|seat| seat.name == wanted)
    }

    /// The topic of a channel, and what it is.
    fn channel(&self, channel: u16) -> Option<&(String, RecordedTopic)> {
        self.topics.get(usize::from(channel))?.as_ref()
    }

    /// Takes a message apart; `None` where its channel is unknown.
    fn message(&self, body: &[u8]) -> Option<ReadPart> {
        let (channel, log_time, data) = container::message(body)?;
        let (_, topic) = self.channel(channel)?;
        let told = match topic {
            RecordedTopic::Passed => return Some(ReadPart::Message(channel, log_time, ReadMessage::Passed)),
            RecordedTopic::Seat(lane) => {
                let sample = seat_sample(data).map_or_else(|| json(data), Ok);
                sample.map(|sample| match self.samples {
                    WantedSamples::Sums => Told::Sum(*lane, sample.sum()),
                    _ => Told::Seat(*lane, Box::new(sample)),
                })
            }
            RecordedTopic::Tick => json(data).map(Told::Tick),
            RecordedTopic::Hall => json::<Value>(data).and_then(|hall| {
                hall["state"].as_u64().map(Told::State).ok_or_else(|| "no state".to_owned())
            }),
            RecordedTopic::Sent => {
                let told = if self.full == WantedFull::Motions {
                    full::motions(data, &self.seats).map(Told::Motions)
                } else {
                    full::unpack(data, &self.seats, self.lane()).map(Told::Chunks)
                };
                told.ok_or_else(|| "not a block of ticks".to_owned())
            }
            RecordedTopic::Acks => {
                ack_columns::unpacked(data).map(Told::Drains).ok_or_else(|| "no drains".to_owned())
            }
            RecordedTopic::Other => {
                return Some(ReadPart::Message(channel, log_time, ReadMessage::Other(data.to_vec())));
            }
        };
        Some(ReadPart::Message(channel, log_time, ReadMessage::Told(told)))
    }
}

fn json<'a, T: Deserialize<'a>>(data: &'a [u8]) -> Result<T, String> {
    serde_json::from_slice(data).map_err(|error| error.to_string())
}

/// A recording that is being read.
struct Reading<'a> {
    contents: Contents,
    known: Arc<KnownChannels>,
    /// Messages of each channel since that was defined.
    counts: Vec<u64>,
    take: &'a mut dyn FnMut(&Contents, MonoTime, Told<'_>),
}

impl<'a> Reading<'a> {
    fn new(wanted: Wanted<'_>, take: &'a mut dyn FnMut(&Contents, MonoTime, Told<'_>)) -> Self {
        let Wanted { seat, samples, full } = wanted;
        let (seats, topics, seat) = (Vec::new(), Vec::new(), seat.map(ToOwned::to_owned));
        let known = Arc::new(KnownChannels { seats, topics, seat, samples, full });
        Self { contents: Contents::default(), known, counts: Vec::new(), take }
    }

    /// What was read, until that.
    ///
    /// # Errors
    /// Where it is no recording.
    fn end(mut self, read: Result<(), ReadError>) -> Result<Contents, ReadError> {
        (0..self.counts.len()).for_each(|channel| self.count(channel));
        let mut contents = self.contents;
        match read {
            Err(ReadError::File(trouble)) if !contents.begin.is_empty() => contents.trouble = Some(trouble),
            Err(error) => return Err(error),
            Ok(()) if contents.begin.is_empty() => return Err(ReadError::Foreign),
            Ok(()) => {}
        }
        Ok(contents)
    }

    /// Takes the next record.
    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), ReadError> {
        match opcode {
            op::METADATA => match container::metadata(body) {
                Some(("kinocue", entries)) if self.contents.begin.is_empty() => {
                    self.contents.begun(entries)?;
                    Arc::make_mut(&mut self.known).seats.clone_from(&self.contents.seats);
                }
                Some((RECOVERED, entries)) => {
                    let why = entries.get("why").filter(|why| !why.is_empty());
                    self.contents.recovered = why.map(|why| escaped(why, 1_000).into_owned());
                }
                Some((END, entries)) if body.len() <= KEPT => self.contents.end = owned(entries),
                _ => {}
            },
            op::CHANNEL => {
                if let Some(ChannelRecord { id, topic, .. }) = ChannelRecord::parse(body) {
                    let place = usize::from(id);
                    self.count(place);
                    let as_what = self.known.topic(topic);
                    let topics = &mut Arc::make_mut(&mut self.known).topics;
                    topics.resize_with(topics.len().max(place + 1), || None);
                    topics[place] = Some((topic.to_owned(), as_what));
                }
            }
            op::MESSAGE => {
                if let Some(ReadPart::Message(channel, log_time, message)) = self.known.message(body) {
                    self.message(channel, log_time, message)?;
                }
            }
            op::ATTACHMENT => {
                if let Some(AttachmentRecord { name, data, .. }) = AttachmentRecord::parse(body) {
                    self.contents.attachments.insert(name.to_owned(), data.len());
                    if name == REPORT && data.len() <= KEPT {
                        self.contents.report = Some(data.to_vec());
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, channel: u16, log_time: u64, message: ReadMessage) -> Result<(), ReadError> {
        let newest = self.contents.span.map_or(0, |(_, newest)| newest);
        if self.contents.begin.is_empty() || is_late(log_time, newest) {
            return Err(ReadError::Order(REMEDY));
        }
        let place = usize::from(channel);
        if self.counts.len() <= place {
            self.counts.resize(place + 1, 0);
        }
        self.counts[place] += 1;
        let Self { contents, known, counts, take } = self;
        let (first, last) = contents.span.unwrap_or((log_time, log_time));
        contents.span = Some((first.min(log_time), last.max(log_time)));
        let Some((name, _)) = known.channel(channel) else { return Ok(()) };
        match message {
            ReadMessage::Passed => {}
            ReadMessage::Other(data) => take(contents, contents.instant(log_time), Told::Other(name, &data)),
            ReadMessage::Told(Ok(told)) => take(contents, contents.instant(log_time), told),
            ReadMessage::Told(Err(why)) => {
                let number = counts[place] + contents.messages.get(name).copied().unwrap_or(0);
                let fault = format!("{}, message {number}: {}", escaped(name, 100), escaped(&why, 200));
                contents.fault(|| fault);
            }
        }
        Ok(())
    }

    /// Adds the messages of a channel to those of its topic.
    fn count(&mut self, channel: usize) {
        let Some(count) = self.counts.get_mut(channel).map(std::mem::take) else { return };
        let Some(Some((name, _))) = self.known.topics.get(channel).filter(|_| count > 0) else { return };
        *self.contents.messages.entry(name.clone()).or_default() += count;
    }
}

impl SplitReader for Reading<'_> {
    type Known = KnownChannels;
    type Part = ReadPart;
    type Error = ReadError;

    fn known(&self) -> &Arc<KnownChannels> {
        &self.known
    }

    fn part(known: Option<&KnownChannels>, opcode: u8, body: &[u8]) -> Option<ReadPart> {
        match (opcode, known) {
            (op::MESSAGE, Some(known)) => known.message(body),
            (op::MESSAGE | op::METADATA | op::CHANNEL | op::ATTACHMENT, _) => {
                Some(ReadPart::Record(opcode, body.to_vec()))
            }
            _ => None,
        }
    }

    fn take(&mut self, part: ReadPart) -> Result<(), ReadError> {
        match part {
            ReadPart::Message(channel, log_time, message) => self.message(channel, log_time, message),
            ReadPart::Record(opcode, body) => self.record(opcode, &body),
        }
    }
}
