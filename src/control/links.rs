//! Serial links in the status of the hall.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// One serial link, since its thread started.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct LinkStatus {
    /// Its name.
    pub name: String,
    /// Its port.
    pub port: String,
    /// What its drives are: `silvermax`, or `sixpack2`, which confirms nothing.
    pub dialect: String,
    /// Segments, or targets, a second for each axis.
    pub rate_hz: f64,
    /// How long before its seats are there their poses are made, ms.
    pub lead_ms: f64,
    /// How far its drives are beside the loaded cue at the most, as it was proved at full level, mm; null where none is loaded.
    pub deviation_mm: Option<f64>,
    /// Why its port cannot be had, with what to do; null while it is open.
    pub fault: Option<String>,
    /// Requests that wait for an answer.
    pub asked: u64,
    /// Those that got one in time.
    pub answered: u64,
    /// Answers that came after their time.
    pub late: u64,
    /// What came that was no answer to anything asked: damaged, doubled, of another unit or command.
    pub stray: u64,
    /// 99 of 100 answers begin no later than that, µs.
    pub delay_p99_us: f64,
    /// Poses that came for seats which could not take them.
    pub poses_skipped: u64,
    /// The axes of its seats.
    pub axes: Vec<LinkAxisStatus>,
}

/// An axis on a serial link, since its thread started.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct LinkAxisStatus {
    /// Its controller.
    pub controller: String,
    /// The axis, from 1.
    pub axis: usize,
    /// Segments of motion that were made of poses.
    pub made: u64,
    /// Segments that the drive has taken.
    pub acked: u64,
    /// Targets that were sent to a drive which confirms none.
    pub unconfirmed: u64,
    /// Segments that it did not take.
    pub refused: u64,
    /// Segments that were not answered, taken or not.
    pub in_doubt: u64,
    /// Segments that were never sent, as the axis braked.
    pub skipped: u64,
    /// Segments that wait in its drive, the running one among them; 0 where a drive has no queue.
    pub queued: usize,
    /// How often its queue ran dry in motion.
    pub dry: u64,
    /// How far its motor was beside its target when both were read last, mm.
    pub error_mm: f64,
    /// The farthest that its target was beside its segments, mm.
    pub off_course_mm: f64,
    /// True if it is too hot.
    pub hot: bool,
}
