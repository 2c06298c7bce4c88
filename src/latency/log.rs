//! Histograms in a file: `HdrHistogram`'s interval log, text format 1.3, compressed V2 histograms, values in nanoseconds.
//! Each interval has one line for the lateness of ticks and one for the latency of acks, told apart by their tags.

use std::io::{self, Write};
use std::time::{Duration, SystemTime};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use hdrhistogram::serialization::interval_log::{
    IntervalLogIterator, IntervalLogWriterBuilder, IntervalLogWriterError, LogEntry, LogIteratorError, Tag,
};
use hdrhistogram::serialization::{Deserializer, V2DeflateSerializer};

use crate::rt::Times;
use crate::tracker::Histogram;

/// Tag of the lateness of ticks.
pub(crate) const LATENESS: &str = "lateness";
/// Tag of the latency of acks.
pub(crate) const ACKS: &str = "ack_latency";

/// Why a file of histograms cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// Not a line of such a log.
    #[error("line {line}: no line of an HdrHistogram interval log")]
    Line {
        /// Its line, from 1.
        line: usize,
    },
    /// An interval without a histogram that can be read.
    #[error("interval {interval}: its histogram cannot be read: {why}")]
    Histogram {
        /// Which one, from 1.
        interval: usize,
        /// What is wrong with it.
        why: String,
    },
    /// Nothing in it is tagged as ours.
    #[error("holds no histogram tagged {LATENESS} or {ACKS}; `kinocue latency --out` writes such files")]
    Empty,
}

/// A log that is being written.
pub(crate) struct Log<W> {
    out: W,
    serializer: V2DeflateSerializer,
}

impl<W: Write> Log<W> {
    /// Begins a log of what happened from `start` on; `about` says in a line what was measured.
    ///
    /// # Errors
    /// That of the writer.
    pub(crate) fn begin(mut out: W, about: &str, start: SystemTime) -> io::Result<Self> {
        let mut serializer = V2DeflateSerializer::new();
        writeln!(out, "#[Histogram log format version 1.3]")?;
        let mut head = IntervalLogWriterBuilder::new();
        head.add_comment(about).add_comment("Values are nanoseconds, times seconds from BaseTime.");
        head.with_start_time(start).with_base_time(start).begin_log_with(&mut out, &mut serializer)?;
        writeln!(
            out,
            r#""StartTimestamp","Interval_Length","Interval_Max","Interval_Compressed_Histogram""#
        )?;
        Ok(Self { out, serializer })
    }

    /// Writes what was counted within `span` from `from` on, counted from the start.
    ///
    /// # Errors
    /// That of the writer.
    pub(crate) fn interval(&mut self, times: &Times, from: Duration, span: Duration) -> io::Result<()> {
        let mut lines =
            IntervalLogWriterBuilder::new().begin_log_with(&mut self.out, &mut self.serializer)?;
        for (tag, histogram) in [(LATENESS, &times.lateness), (ACKS, &times.acks)] {
            lines.write_histogram(histogram, from, span, Tag::new(tag)).map_err(|error| match error {
                IntervalLogWriterError::IoError(error) => error,
                IntervalLogWriterError::SerializeError(error) => io::Error::other(error.to_string()),
            })?;
        }
        Ok(())
    }

    /// Hands on all that was written.
    ///
    /// # Errors
    /// That of the writer.
    pub(crate) fn end(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

/// Adds up all intervals of a log; what is tagged otherwise is left out.
///
/// # Errors
/// [`LogError`] where the text is no such log, or holds nothing of ours.
pub fn read(text: &[u8]) -> Result<Times, LogError> {
    let mut times = Times::default();
    let mut interval = 0;
    let mut ours = false;
    let mut deserializer = Deserializer::new();
    for entry in IntervalLogIterator::new(text) {
        let entry = entry.map_err(|LogIteratorError::ParseError { offset }| LogError::Line {
            line: 1 + text[..offset].iter().filter(|byte| **byte == b'\n').count(),
        })?;
        let LogEntry::Interval(line) = entry else { continue };
        interval += 1;
        let sum = match line.tag().map(|tag| tag.as_str()) {
            Some(LATENESS) => &mut times.lateness,
            Some(ACKS) => &mut times.acks,
            _ => continue,
        };
        ours = true;
        let bad = |why: String| LogError::Histogram { interval, why };
        let bytes = STANDARD.decode(line.encoded_histogram()).map_err(|error| bad(error.to_string()))?;
        let part: Histogram =
            deserializer.deserialize(&mut &bytes[..]).map_err(|error| bad(error.to_string()))?;
        sum.add(&part).map_err(|_| bad("holds times of more than 10 s".to_owned()))?;
    }
    if ours { Ok(times) } else { Err(LogError::Empty) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn times(late_ns: u64, ack_ns: u64, count: u64) -> Times {
        let mut times = Times::default();
        times.lateness.record_n(late_ns, count).unwrap();
        times.acks.record_n(ack_ns, 2 * count).unwrap();
        times
    }

    fn written(intervals: &[Times]) -> String {
        let start = SystemTime::UNIX_EPOCH + Duration::from_millis(1_800_000_000_250);
        let mut log = Log::begin(Vec::new(), "kinocue, 1000 Hz", start).unwrap();
        for (second, times) in (0..).zip(intervals) {
            log.interval(times, SECOND * second, SECOND).unwrap();
        }
        String::from_utf8(log.end().unwrap()).unwrap()
    }

    #[test]
    fn a_log_begins_as_the_format_has_it_and_each_second_has_a_line_for_each_tag() {
        let text = written(&[times(5_000, 60_000, 1_000), times(6_000, 70_000, 990)]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "#[Histogram log format version 1.3]");
        assert!(lines[1..4].contains(&"#kinocue, 1000 Hz"), "{text}");
        assert!(text.contains("#[StartTime: 1800000000.250 (seconds since epoch)]\n"), "{text}");
        assert!(text.contains("\"StartTimestamp\",\"Interval_Length\""), "{text}");
        let tagged = |tag: &str| lines.iter().filter(|line| line.starts_with(tag)).count();
        assert_eq!((tagged("Tag=lateness,0.000,1.000,"), tagged("Tag=ack_latency,1.000,1.000,")), (1, 1));
        assert!(lines.last().unwrap().contains(",HISTFAAAA"), "compressed V2: {text}");
    }

    #[test]
    fn what_is_read_is_the_sum_of_what_was_written() {
        let read = read(written(&[times(5_000, 60_000, 1_000), times(90_000, 700_000, 10)]).as_bytes());
        let mut sum = times(5_000, 60_000, 1_000);
        sum.lateness.record_n(90_000, 10).unwrap();
        sum.acks.record_n(700_000, 20).unwrap();
        assert_eq!(read.unwrap(), sum);
    }

    #[test]
    fn a_file_that_is_no_log_is_refused_with_its_place() {
        let refused = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert!(refused("#[Histogram log format version 1.3]\nhello\n").starts_with("line 2: "));
        assert!(refused("").starts_with("holds no histogram"));
        assert!(refused("Tag=other,0.0,1.0,2.0,AAAA\n").starts_with("holds no histogram"));
        let broken = refused("Tag=lateness,0.0,1.0,2.0,A=A\n");
        assert!(broken.starts_with("interval 1: its histogram cannot be read: "), "{broken}");
        assert!(refused("Tag=lateness,0.0,1.0,2.0,AAAA\n").starts_with("interval 1: "));
    }

    #[test]
    fn no_cut_or_changed_byte_makes_reading_panic() {
        let text = written(&[times(5_000, 60_000, 1_000)]).into_bytes();
        for place in 0..text.len() {
            let _ = read(&text[..place]);
            let mut changed = text.clone();
            changed[place] ^= 0x15;
            let _ = read(&changed);
        }
    }
}
