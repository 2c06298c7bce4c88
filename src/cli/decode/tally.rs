//! What was decoded, counted.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::time::Duration;

use serde_json::{Value, json};

use super::sheet::FieldSheet;

/// Counts of all that was read.
#[derive(Debug, Default)]
pub(super) struct MessageTally {
    /// By function code: what it is called, and how many there were.
    messages: BTreeMap<u16, (String, u64)>,
    /// Bytes that are no message.
    pub(super) malformed: u64,
    /// Lines that are no hex.
    pub(super) not_hex: u64,
    /// Messages of which the capture kept only a part.
    pub(super) cut: u64,
    /// Parts of datagrams, which are not put together.
    pub(super) fragments: u64,
    /// Datagrams of other ports or, with all ports, of other protocols.
    pub(super) other_datagrams: u64,
    /// Packets that carry no UDP over IPv4.
    pub(super) other_packets: u64,
    /// Packets of link types that are not read, and those link types.
    unknown_links: (u64, BTreeSet<u16>),
    first: Option<Duration>,
    last: Option<Duration>,
}

impl MessageTally {
    pub(super) fn message(&mut self, sheet: &FieldSheet) {
        let of_function = self.messages.entry(sheet.function());
        of_function.or_insert_with(|| (sheet.name().to_owned(), 0)).1 += 1;
    }

    pub(super) fn unknown_link(&mut self, link: u16) {
        self.unknown_links.0 += 1;
        self.unknown_links.1.insert(link);
    }

    /// Takes the time of a packet, and gives it in seconds after the first packet that has one.
    pub(super) fn time(&mut self, at: Duration) -> f64 {
        let first = *self.first.get_or_insert(at);
        self.last = self.last.max(Some(at));
        at.as_secs_f64() - first.as_secs_f64()
    }

    /// True if all messages could be read.
    pub(super) const fn is_clean(&self) -> bool {
        self.malformed == 0 && self.not_hex == 0 && self.cut == 0
    }

    /// A line for each count that is not 0.
    pub(super) fn text(&self) -> String {
        let messages: u64 = self.messages.values().map(|(_, count)| count).sum();
        let mut text = format!("{messages} {}", if messages == 1 { "message" } else { "messages" });
        if let (Some(first), Some(last)) = (self.first, self.last) {
            let _ =
                write!(text, " in {:.3} s from {}", (last.saturating_sub(first)).as_secs_f64(), utc(first));
        }
        text.push('\n');
        for (function, (name, count)) in &self.messages {
            let _ = writeln!(text, "{count:>8}  0x{function:04x} {name}");
        }
        let link_types: Vec<_> = self.unknown_links.1.iter().map(ToString::to_string).collect();
        let unknown = format!("packets of link type {}, which is not read", link_types.join(", "));
        for (count, what) in [
            (self.malformed, "malformed"),
            (self.not_hex, "lines that are not hex"),
            (self.cut, "cut short by the capture"),
            (self.fragments, "fragments of datagrams, not reassembled"),
            (self.other_datagrams, "other datagrams"),
            (self.other_packets, "other packets"),
            (self.unknown_links.0, &unknown),
        ] {
            if count > 0 {
                let _ = writeln!(text, "{count:>8}  {what}");
            }
        }
        text
    }

    /// All counts.
    pub(super) fn json(&self) -> Value {
        let by_function: BTreeMap<String, u64> = self
            .messages
            .iter()
            .map(|(function, (_, count))| (format!("0x{function:04x}"), *count))
            .collect();
        json!({ "summary": {
            "messages": by_function,
            "malformed": self.malformed,
            "not_hex": self.not_hex,
            "cut": self.cut,
            "fragments": self.fragments,
            "other_datagrams": self.other_datagrams,
            "other_packets": self.other_packets,
            "unknown_link": self.unknown_links.0,
            "unknown_link_types": self.unknown_links.1,
        } })
    }
}

/// A time since 1970 as a date and a time of day, by the calendar that repeats every 400 years of 146,097 days.
fn utc(since_1970: Duration) -> String {
    let seconds = since_1970.as_secs();
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    let shifted = days + 719_468; // days since 0000-03-01, so that a leap day ends its year
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    let year = 400 * era + year_of_era + u64::from(month <= 2);
    let (hour, minute) = (second / 3_600, second / 60 % 60);
    format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{:02} UTC", second % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_follow_the_calendar_over_leap_days() {
        for (seconds, date) in [
            (0, "1970-01-01 00:00:00 UTC"),
            (951_782_399, "2000-02-28 23:59:59 UTC"),
            (951_782_400, "2000-02-29 00:00:00 UTC"),
            (1_767_225_599, "2025-12-31 23:59:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00:00 UTC"),
        ] {
            assert_eq!(utc(Duration::from_secs(seconds)), date);
        }
    }
}
