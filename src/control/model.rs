//! The facts that status, reports, journal and client share: each is declared once, written and read back by serde. What is
//! missing has its default, for who wrote it may be older, and an unknown word is no reason not to read the rest.

use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::tracker::{self, Counts};

/// An enum whose words are stable, for programs: as it is written, read and shown.
macro_rules! words {
    ($(#[$about:meta])* $vis:vis $name:ident { $($(#[$of:meta])* $variant:ident = $word:tt,)+ }) => {
        $(#[$about])*
        #[derive(
            Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize, utoipa::ToSchema,
        )]
        $vis enum $name { $($(#[$of])* #[serde(rename = $word)] $variant,)+ }

        impl $name {
            /// All of them.
            #[cfg(test)]
            #[allow(dead_code, reason = "not all are walked")]
            $vis const ALL: &[Self] = &[$(Self::$variant,)+];

            /// Its word.
            #[must_use]
            $vis const fn word(self) -> &'static str {
                match self { $(Self::$variant => $word,)+ }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.word())
            }
        }
    };
}

pub(crate) use words;

words! {
    /// How a controller stands.
    #[derive(Default)]
    pub Health {
        /// It answers.
        Ok = "ok",
        /// It answers some frames.
        Degraded = "degraded",
        /// It does not answer.
        Lost = "lost",
        /// It answers again, and its seat joins the others.
        Rejoining = "rejoining",
        /// An emergency stop is in effect.
        Stopped = "stopped",
        /// It has an error.
        Error = "error",
        /// It waits for a person.
        Excluded = "excluded",
        /// Nobody listens for its answers.
        Unwatched = "unwatched",
        /// Out for good by the configuration.
        Out = "out",
        /// Not asked yet, or a word of another version.
        #[default]
        #[serde(other)]
        Unknown = "unknown",
    }
}

words! {
    /// How grave something is.
    #[derive(Default)]
    pub(crate) Severity {
        /// Good to know.
        #[default]
        Info = "info",
        /// Worth a look.
        Warning = "warning",
        /// The show suffers.
        Error = "error",
    }
}

words! {
    /// How a show ended.
    pub Ending {
        /// It was played to its end.
        Completed = "completed",
        /// A person ended it.
        Stopped = "stopped",
        /// Nobody answered any more when it ended.
        Lost = "lost",
        /// A fault ended it.
        Fault = "fault",
    }
}

words! {
    /// What follows the end of an entry of a playlist.
    #[derive(Default)]
    pub(crate) Then {
        /// The next entry waits for a person, or for its time.
        #[default]
        Hold = "hold",
        /// The next entry starts.
        Go = "go",
    }
}

/// A word of ours, or one of another version.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Word<T> {
    /// Ours.
    Known(T),
    /// Another; empty where there was none.
    Other(String),
}

impl<T> Default for Word<T> {
    fn default() -> Self {
        Self::Other(String::new())
    }
}

impl<T> From<T> for Word<T> {
    fn from(word: T) -> Self {
        Self::Known(word)
    }
}

impl<T: PartialEq> PartialEq<T> for Word<T> {
    fn eq(&self, other: &T) -> bool {
        matches!(self, Self::Known(word) if word == other)
    }
}

impl<T: fmt::Display> fmt::Display for Word<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Known(word) => word.fmt(f),
            Self::Other(word) => word.fmt(f),
        }
    }
}

/// What is said in words, for programs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct Coded {
    /// Stable; empty where there is none.
    pub(crate) code: String,
    /// What the words name, in their order.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) of: Vec<String>,
}

impl Coded {
    /// That code, of what the words name.
    pub(crate) fn new(code: &str, of: impl IntoIterator<Item = String>) -> Self {
        Self { code: code.to_owned(), of: of.into_iter().collect() }
    }
}

/// What became of frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct FrameCounts {
    /// Frames that the kernel took.
    pub sent: u64,
    /// Of these: asked for a reply. Once all have met their fate, asked = acked + refused + lost + withdrawn.
    pub asked: u64,
    /// Of these: answered with x = 2.
    pub acked: u64,
    /// Answered with x = 3, 4 or 5.
    pub refused: u64,
    /// Not answered within a second.
    pub lost: u64,
    /// Not executed by drives on a link, as they were told to stop; left out where there are none.
    #[serde(skip_serializing_if = "is_zero")]
    pub withdrawn: u64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
const fn is_zero(count: &u64) -> bool {
    *count == 0
}

impl From<&Counts> for FrameCounts {
    fn from(counts: &Counts) -> Self {
        let Counts { sent, asked, acked, lost, withdrawn, .. } = *counts;
        Self { sent, asked, acked, refused: counts.refused(), lost, withdrawn }
    }
}

impl FrameCounts {
    /// These and others, each by each.
    fn with(self, other: Self, of: impl Fn(u64, u64) -> u64) -> Self {
        Self {
            sent: of(self.sent, other.sent),
            asked: of(self.asked, other.asked),
            acked: of(self.acked, other.acked),
            refused: of(self.refused, other.refused),
            lost: of(self.lost, other.lost),
            withdrawn: of(self.withdrawn, other.withdrawn),
        }
    }

    /// What came since.
    #[must_use]
    pub(crate) fn since(self, before: Self) -> Self {
        self.with(before, u64::saturating_sub)
    }
}

impl std::iter::Sum for FrameCounts {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |sum, one| sum.with(one, u64::saturating_add))
    }
}

/// Nanoseconds as µs, rounded to a tenth.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "a few seconds in nanoseconds")]
pub(crate) fn us(ns: u64) -> f64 {
    (ns as f64 / 100.0).round() / 10.0
}

/// How long so many of all of them are at the most, µs. The end of a bucket may be beyond the longest.
pub(crate) fn quantile_us(times: &tracker::Histogram, part: f64) -> Option<f64> {
    (!times.is_empty()).then(|| us(times.value_at_quantile(part).min(times.max())))
}

/// Percentiles in µs; null if nothing was counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct Percentiles {
    /// Half of them are no longer.
    pub p50_us: Option<f64>,
    /// 99 of 100.
    pub p99_us: Option<f64>,
    /// 999 of 1,000.
    pub p999_us: Option<f64>,
    /// The longest.
    pub max_us: Option<f64>,
}

impl Percentiles {
    /// Those of a histogram of nanoseconds.
    #[must_use]
    pub(crate) fn of(times: &tracker::Histogram) -> Self {
        let [p50_us, p99_us, p999_us, max_us] = [0.5, 0.99, 0.999, 1.0].map(|part| quantile_us(times, part));
        Self { p50_us, p99_us, p999_us, max_us }
    }
}

/// Percentiles where the name of the whole has the unit, for serde's `with`.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Percentiles")]
pub(crate) struct InMicros {
    #[serde(rename = "p50")]
    p50_us: Option<f64>,
    #[serde(rename = "p99")]
    p99_us: Option<f64>,
    #[serde(rename = "p999")]
    p999_us: Option<f64>,
    #[serde(rename = "max")]
    max_us: Option<f64>,
}

/// Times: percentiles, and how many there are of each size.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct Times {
    /// Percentiles.
    #[serde(flatten)]
    pub(crate) percentiles: Percentiles,
    /// How many there are.
    pub(crate) histogram: Histogram,
}

impl Times {
    /// True where there are none.
    pub(crate) fn is_none(&self) -> bool {
        self.percentiles.max_us.is_none()
    }
}

/// Counts by size.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub(crate) struct Histogram {
    /// The upper bounds, µs, each twice the one before or less; the last bucket has none.
    pub(crate) bounds_us: Vec<f64>,
    /// How many are in each bucket, one more than bounds.
    pub(crate) counts: Vec<u64>,
    /// The sum of all, s.
    pub(crate) sum_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::Status;

    #[test]
    fn every_field_of_a_status_is_read_as_it_was_written_and_written_as_it_ever_was() {
        let json = include_str!("../../tests/data/status.json");
        let status: Status = serde_json::from_str(json).unwrap();
        assert_eq!(serde_json::to_string_pretty(&status).unwrap() + "\n", json);
    }

    #[test]
    fn words_of_another_version_are_read() {
        let json = r#"{"state":"freewheeling","controllers":[{"health":"asleep","lost":2}],"warnings":[{"id":"x"}]}"#;
        let status: Status = serde_json::from_str(json).unwrap();
        assert_eq!(status.state.to_string(), "freewheeling");
        assert_eq!((status.controllers[0].health, status.controllers[0].frames.lost), (Health::Unknown, 2));
        assert_eq!(serde_json::from_str::<Status>("{}").unwrap(), Status::default());
    }

    #[test]
    fn frames_of_many_are_summed_and_those_before_taken_away() {
        let one = FrameCounts { sent: 10, asked: 8, acked: 5, refused: 1, lost: 2, withdrawn: 0 };
        let two: FrameCounts = [one, one].into_iter().sum();
        assert_eq!((two.sent, two.since(one)), (20, one));
    }
}
