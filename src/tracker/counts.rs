//! The accounts in which frames and replies end.

use crate::wire::ReplyCode;

/// How many frames and replies of one controller ended in which account.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Frames that the kernel took.
    pub sent: u64,
    /// Of these, the ones that requested a reply: acked, refused, lost, withdrawn, or still in flight.
    pub asked: u64,
    /// Frames answered with x = 2 in time.
    pub acked: u64,
    /// Frames refused with x = 3: the controller has an error.
    pub fault: u64,
    /// Frames refused with x = 4: an emergency stop is in effect.
    pub emergency_stop: u64,
    /// Frames refused with x = 5: the command was wrong.
    pub command: u64,
    /// Frames without a reply in time.
    pub lost: u64,
    /// Frames that drives did not execute, as they were told to stop.
    pub(crate) withdrawn: u64,
    /// Replies to a frame that had been answered.
    pub duplicate: u64,
    /// Replies to a lost frame, or to one too old to be remembered.
    pub stale: u64,
    /// Datagrams that are no reply to any frame that was sent and asked for one.
    pub stray: u64,
    /// Frames that the kernel did not take.
    pub send_failed: u64,
    /// How often the kernel reported that the controller's port is closed.
    pub(crate) port_closed: u64,
}

impl Counts {
    /// Frames refused, for whichever reason.
    #[must_use]
    pub const fn refused(&self) -> u64 {
        self.fault + self.emergency_stop + self.command
    }

    /// Frames that asked and whose fate is still open.
    #[must_use]
    pub const fn in_flight(&self) -> u64 {
        self.asked - self.acked - self.refused() - self.lost - self.withdrawn
    }

    pub(super) const fn add_reply(&mut self, fate: Fate) {
        *match fate {
            Fate::Answered(ReplyCode::Running) => &mut self.acked,
            Fate::Answered(ReplyCode::Fault) => &mut self.fault,
            Fate::Answered(ReplyCode::EmergencyStop) => &mut self.emergency_stop,
            Fate::Answered(ReplyCode::Command) => &mut self.command,
            Fate::Duplicate => &mut self.duplicate,
            Fate::Stale => &mut self.stale,
            Fate::Stray => &mut self.stray,
        } += 1;
    }
}

/// What a reply turned out to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// The first reply to a frame in flight, in time: it is acked, or refused.
    Answered(ReplyCode),
    /// Its frame had been answered.
    Duplicate,
    /// Its frame is lost, or too old to be remembered.
    Stale,
    /// Its frame was never sent, or asked for nothing.
    Stray,
}
