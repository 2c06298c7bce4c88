//! What came of judging a recording again.

use serde::Serialize;

use crate::control::Percentiles;
use crate::control::model::FrameCounts;

/// Differences that are told; more are counted.
const TOLD: usize = 100;

/// Something that the recording says otherwise than what was judged again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ReplayDifference {
    /// Wall clock, ns since 1970; of a total the end of the file.
    pub(crate) wall_ns: u64,
    /// Show time, s.
    pub(crate) film_s: f64,
    /// The seat; none of what is of all.
    pub(crate) seat: Option<String>,
    /// What it is about.
    pub(crate) what: String,
    /// What was recorded.
    pub(crate) recorded: String,
    /// What it comes to now.
    pub(crate) replayed: String,
}

/// A seat as it was judged again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct SeatVerdict {
    /// Its name.
    pub(crate) name: String,
    /// Its frames.
    #[serde(flatten)]
    pub(crate) frames: FrameCounts,
    /// Latency of its acks.
    pub(crate) ack_us: Percentiles,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub(crate) struct ReplayVerdict {
    /// Drains of the ack thread.
    pub(crate) drains: u64,
    /// Frames that went into the books.
    pub(crate) frames: u64,
    /// Replies whose fate was judged again.
    pub(crate) fates: u64,
    /// Changes of how groups stand that were judged again.
    pub(crate) standings: u64,
    /// True if the recording begins with its hall, so that all of it was judged.
    pub(crate) from_the_start: bool,
    /// How often something was missing, so that what followed was judged from where enough was known again.
    pub(crate) gaps: u64,
    /// How often a group was not judged further, because what it is known by is from before the recording.
    pub(crate) unjudged: u64,
    /// The seats, in their order.
    pub(crate) seats: Vec<SeatVerdict>,
    /// Lateness of the ticks that sent.
    pub(crate) lateness_us: Option<Percentiles>,
    /// What differs; the first of it.
    pub(crate) differences: Vec<ReplayDifference>,
    /// How much more does.
    pub(crate) more: u64,
}

impl ReplayVerdict {
    pub(super) fn differs(&mut self, difference: ReplayDifference) {
        if self.differences.len() < TOLD {
            self.differences.push(difference);
        } else {
            self.more += 1;
        }
    }
}
