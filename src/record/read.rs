//! What a recording says of itself, as far as it is read back, and what its messages tell. What is complete of a file that is cut short or
//! damaged is read, and why there is no more is said. Control thread; takes any bytes without a panic.

use std::collections::BTreeMap;
use std::io::{Read, Seek};

use mcap::records::op;

use super::full::BlockMotions;
use super::judging::Judging;
use super::margins::Margin;
use super::recording::VERSION;
use super::sampled::{SeatSample, SeatSum, TickSample};
use super::seat::RecordedSeat;
use crate::container::{self, Trouble};
use crate::plain::escaped;
use crate::time::MonoTime;

/// What a file may unpack to: a day of the largest hall.
pub(super) const MOST: u64 = 256 << 30;
/// Faults that are told; more are counted.
const FAULTS_TOLD: usize = 20;
/// Seats of a hall at the most.
const SEATS: usize = 4_096;

/// Why a file tells nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum ReadError {
    /// It cannot be read as MCAP, from its beginning on.
    #[error("{0}")]
    File(Trouble),
    /// It is MCAP, and no recording.
    #[error("is not a recording of kinocue: it has no metadata record \"kinocue\" of kind \"recording\"")]
    Foreign,
    /// Its messages are not in the order of their times, by which a reader knows where the film is; or no longer, and why not.
    #[error("{what}, {0}", what = Self::UNSORTED)]
    Order(&'static str),
    /// It says something of itself that cannot be.
    #[error("its metadata record \"kinocue\": {field}: {why}")]
    Metadata {
        /// Which entry.
        field: &'static str,
        /// What is wrong with it.
        why: String,
    },
}

impl ReadError {
    /// What is said of such a file.
    pub(super) const UNSORTED: &str = "has its records in another order than that of time";
}

/// What to do about a file that is in another order.
pub(super) const REMEDY: &str = "which kinocue record recover puts right";

/// True of a message that is so much older than the newest before it that more than its writer's haste is to blame.
pub(super) const fn is_late(log_time: u64, newest: u64) -> bool {
    const LATE_NS: u64 = 1_000_000_000;
    log_time.saturating_add(LATE_NS) < newest
}

impl From<Trouble> for ReadError {
    fn from(trouble: Trouble) -> Self {
        Self::File(trouble)
    }
}

/// What a message tells.
#[derive(Debug)]
pub(crate) enum Told<'a> {
    /// A sample of the seat of that place.
    Seat(usize, Box<SeatSample>),
    /// The same, without places.
    Sum(usize, SeatSum),
    /// A sample of the ticks.
    Tick(TickSample),
    /// The number of the hall's state from then on.
    State(u64),
    /// Whole ticks: chunks, one behind the other.
    Chunks(Vec<u8>),
    /// The same, only where each seat was sent.
    Motions(BlockMotions),
    /// Drains of the ack thread: chunks, one behind the other.
    Drains(Vec<u8>),
    /// Anything else, as it stands there: topic and octets.
    Other(&'a str, &'a [u8]),
}

/// What a file says of itself, as far as it was read.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Contents {
    /// The entries of its first metadata record.
    pub(crate) begin: BTreeMap<String, String>,
    /// Those of its last; empty where it was not closed.
    pub(crate) end: BTreeMap<String, String>,
    /// The seats.
    pub(crate) seats: Vec<RecordedSeat>,
    /// Messages of each topic.
    pub(crate) messages: BTreeMap<String, u64>,
    /// Names and sizes of what is attached.
    pub(crate) attachments: BTreeMap<String, usize>,
    /// The report of the play, if it is attached.
    pub(crate) report: Option<Vec<u8>>,
    /// Wall clock of the first and the last message, ns since 1970.
    pub(crate) span: Option<(u64, u64)>,
    /// Messages that tell nothing, with why; the first of them.
    pub(crate) faults: Vec<String>,
    /// Why there is no more than was read.
    pub(crate) trouble: Option<Trouble>,
    /// What was wrong with the file from which it was recovered, if it was.
    pub(crate) recovered: Option<String>,
    clocks: (u64, u64),
}

impl Contents {
    /// An entry of the first metadata record; empty where there is none.
    pub(crate) fn entry(&self, key: &str) -> &str {
        self.begin.get(key).map_or("", String::as_str)
    }

    /// What is missing in it or not as it was written, in words; empty where it is whole.
    pub(crate) fn flaws(&self) -> Vec<String> {
        let trouble = self.trouble.as_ref().map(|trouble| {
            format!("the file {trouble}; only what precedes is shown; kinocue record recover saves it")
        });
        let recovered = self.recovered.as_ref().map(|why| format!("recovered from a file that {why}"));
        let faults = self.faults.iter().map(|fault| format!("not read: {fault}"));
        trouble.into_iter().chain(recovered).chain(faults).collect()
    }

    /// The rate of its ticks, Hz.
    pub(crate) fn rate_hz(&self) -> f64 {
        self.entry("rate_hz").parse().unwrap_or(100.0)
    }

    /// How long a sample is at the most, s: a tick may come late.
    pub(crate) fn sample_s(&self) -> f64 {
        let hz = self.entry("sample_hz").parse().ok().filter(|hz| (1.0..=1000.0).contains(hz));
        1.5 / hz.unwrap_or(20.0)
    }

    /// When that happened of which it is an incident; `None` where it is of something else.
    pub(crate) fn caused_at(&self) -> Option<MonoTime> {
        self.entry("caused_ns").parse().ok().map(MonoTime::from_nanos)
    }

    /// The most that each axis was sent to do, as the recorder measured it.
    pub(crate) fn most(&self) -> Vec<Margin> {
        self.end.get("most").and_then(|text| serde_json::from_str(text).ok()).unwrap_or_default()
    }

    /// What has to be known to judge its acks again; `None` where it does not say, or nothing that can be.
    pub(crate) fn judging(&self) -> Option<Judging> {
        let judging: Judging = serde_json::from_str(self.entry("judging")).ok()?;
        judging.fault(self.seats.len()).is_none().then_some(judging)
    }

    /// The place of a seat.
    pub(crate) fn seat(&self, name: &str) -> Option<usize> {
        self.seats.iter().position(|seat| seat.name == name)
    }

    /// The instant of a message on the clock of the ticks.
    pub(super) fn instant(&self, log_time: u64) -> MonoTime {
        let (mono, wall) = self.clocks;
        MonoTime::from_nanos(log_time.saturating_add(mono).saturating_sub(wall))
    }

    /// The wall clock of an instant, ns since 1970.
    pub(crate) const fn wall(&self, at: MonoTime) -> u64 {
        let (mono, wall) = self.clocks;
        at.as_nanos().saturating_add(wall).saturating_sub(mono)
    }

    pub(super) fn fault(&mut self, fault: impl FnOnce() -> String) {
        if self.faults.len() < FAULTS_TOLD {
            self.faults.push(fault());
        }
    }

    pub(super) fn begun(&mut self, entries: BTreeMap<&str, &str>) -> Result<(), ReadError> {
        let entry = |key: &str| entries.get(key).copied().unwrap_or_default();
        let bad = |field, why: String| ReadError::Metadata { field, why: escaped(&why, 200).into_owned() };
        if entry("kind") != "recording" {
            return Err(ReadError::Foreign);
        }
        if entry("version") != VERSION {
            let why = format!("{:?}; this program reads version {VERSION}", entry("version"));
            return Err(bad("version", why));
        }
        let seats: Vec<RecordedSeat> =
            serde_json::from_str(entry("seats")).map_err(|error| bad("seats", error.to_string()))?;
        let fault = seats.iter().find_map(|seat| seat.fault().map(|fault| format!("{}: {fault}", seat.name)));
        if let Some(fault) = fault.or_else(|| (seats.len() > SEATS).then(|| "too many".to_owned())) {
            return Err(bad("seats", fault));
        }
        let number =
            |key: &'static str| entry(key).parse::<u64>().map_err(|_| bad(key, format!("{:?}", entry(key))));
        let rate = entry("rate_hz").parse::<f64>().ok().filter(|rate| (1.0..=1000.0).contains(rate));
        rate.ok_or_else(|| bad("rate_hz", format!("{:?} is not 1 to 1000", entry("rate_hz"))))?;
        self.clocks = (number("monotonic_ns")?, number("wall_ns")?);
        self.seats = seats;
        self.begin = owned(entries);
        Ok(())
    }
}

pub(super) fn owned(entries: BTreeMap<&str, &str>) -> BTreeMap<String, String> {
    entries.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect()
}

/// Which messages are taken apart; of others only the number is told.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted<'a> {
    /// The seat whose samples are; `None` for all.
    pub(crate) seat: Option<&'a str>,
    /// Samples of seats.
    pub(crate) samples: WantedSamples,
    /// Whole ticks, and what the ack thread took.
    pub(crate) full: WantedFull,
}

impl Wanted<'_> {
    /// All there is.
    pub(crate) const ALL: Self = Self { seat: None, samples: WantedSamples::Whole, full: WantedFull::All };
}

/// What of whole ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WantedFull {
    /// Nothing.
    None,
    /// Where each seat was sent.
    Motions,
    /// Frames of the wanted seat, or of all.
    Ticks,
    /// The same, and what the ack thread took.
    All,
}

/// What of samples of seats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WantedSamples {
    /// Nothing.
    None,
    /// What they come to, without places.
    Sums,
    /// All.
    Whole,
}

/// The entries of a recording's first metadata record, which stands at its front.
///
/// # Errors
/// Where it is no recording, or one in another order.
pub(crate) fn beginning(mut input: impl Read + Seek) -> Result<BTreeMap<String, String>, ReadError> {
    /// Records before it at the most.
    const BEFORE: u32 = 100;
    let (mut contents, mut records, mut is_named) = (Contents::default(), 0, false);
    let read = container::each_sound(&mut input, MOST, |opcode, body| {
        records += 1;
        if let (op::METADATA, Some(("kinocue", entries))) = (opcode, container::metadata(body)) {
            is_named = true;
            contents.begun(entries)?;
        }
        // That is no fault: there is no need to read on.
        if contents.begin.is_empty() && records < BEFORE { Ok(()) } else { Err(ReadError::Foreign) }
    });
    match read {
        _ if !contents.begin.is_empty() => Ok(contents.begin),
        Err((_, ReadError::Foreign)) if !is_named && begins_later(input) => Err(ReadError::Order(REMEDY)),
        Err((_, error)) => Err(error),
        Ok(()) => Err(ReadError::Foreign),
    }
}

/// True of a file that says behind its first records that it is a recording.
fn begins_later(input: impl Read + Seek) -> bool {
    let mut is_one = false;
    let read: Result<_, ReadError> = container::each_saved(input, MOST, |opcode, body| {
        is_one |= opcode == op::METADATA && is_beginning(body);
        Ok(())
    });
    read.is_ok() && is_one
}

/// True of the metadata record that a recording begins with.
pub(super) fn is_beginning(body: &[u8]) -> bool {
    let of_it = container::metadata(body);
    of_it.is_some_and(|(name, entries)| name == "kinocue" && entries.get("kind") == Some(&"recording"))
}
