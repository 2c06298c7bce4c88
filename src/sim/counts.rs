//! What became of the datagrams of one virtual controller.

use serde::Serialize;

/// Counts of one controller. `received = lost_frames + accepted + (all of refused)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counts {
    /// Datagrams that came to its address, those lost on purpose included.
    pub received: u64,
    /// Requests that it obeyed.
    pub accepted: u64,
    /// Of these, motion frames.
    pub(crate) motion: u64,
    /// Datagrams that it did not obey, by reason.
    pub refused: RefusedCounts,
    /// Answers that it gave, those lost on purpose included.
    pub replied: u64,
    /// Status and fault reports that it gave unasked, those lost on purpose included.
    pub reported: u64,
    /// Datagrams that were lost on purpose before they arrived.
    pub lost_frames: u64,
    /// Answers that were lost on purpose.
    pub lost_replies: u64,
    /// Answers that were sent twice on purpose.
    pub duplicated: u64,
    /// Answers that the system would not send.
    pub send_failed: u64,
    /// Moves that reached their end.
    pub(crate) executed: u64,
    /// Moves that ran in less than their time, since more than two were waiting.
    pub(crate) fast_forwarded: u64,
    /// Times that the queue of moves ran over (Err21).
    pub(crate) queue_overflows: u64,
}

/// Datagrams that were not obeyed, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct RefusedCounts {
    /// No message, or none that a host sends.
    pub(crate) malformed: u64,
    /// From another port than PA24 says.
    pub(crate) source_port: u64,
    /// For other stations.
    pub(crate) not_addressed: u64,
    /// While it was starting again (DPF2, or its power).
    pub(crate) rebooting: u64,
    /// Motion while it was homing; answered with x = 2.
    pub(crate) homing: u64,
    /// Motion while it had an error, or that made one; x = 3.
    pub(crate) fault: u64,
    /// Motion or reset while an emergency stop was in effect; x = 4.
    pub(crate) emergency_stop: u64,
    /// Commands that name what it has not; x = 5.
    pub(crate) command: u64,
}

impl RefusedCounts {
    /// All of them together.
    #[must_use]
    pub const fn total(&self) -> u64 {
        self.malformed
            + self.source_port
            + self.not_addressed
            + self.rebooting
            + self.homing
            + self.fault
            + self.emergency_stop
            + self.command
    }
}
