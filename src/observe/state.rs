//! The last known state of one controller.

use std::time::Duration;

use crate::motion::Pulses;
use crate::time::MonoTime;
use crate::wire::{FrameNo, PerAxis, ReplyCode};

/// Something that a controller said, and when the kernel received it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heard<T> {
    /// What it said.
    pub value: T,
    /// When.
    pub(crate) at: MonoTime,
}

impl<T> Heard<T> {
    /// How old it is at `now`.
    #[must_use]
    pub(crate) const fn age(&self, now: MonoTime) -> Duration {
        now.since(self.at)
    }
}

/// The last known state of one controller; a part that it never told is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ControllerState {
    /// When it was last heard at all.
    pub(crate) heard_at: Option<MonoTime>,
    /// What it last answered to a motion frame.
    pub(crate) reply: Option<Heard<ReplyCode>>,
    /// The positions of that answer: an echo of the command, until a controller proves otherwise.
    pub(crate) echoed: Option<Heard<PerAxis<Pulses>>>,
    /// Where its axes were, as measured: position registers (DP06 and following) or a status report (0x3101).
    pub measured: Option<Heard<PerAxis<Pulses>>>,
    /// Force of each axis, in the drive's own unit.
    pub(crate) forces: Option<Heard<PerAxis<i16>>>,
    /// Error number of each drive; 0 for none.
    pub(crate) servo_errors: Option<Heard<PerAxis<u16>>>,
    /// Error number of the controller (chapter 6 of both manuals); 0 for none.
    pub error: Option<Heard<u16>>,
    /// Inputs, bit 0 = X01.
    pub(crate) inputs: Option<Heard<u16>>,
    /// Outputs, bit 0 = Y01.
    pub(crate) outputs: Option<Heard<u16>>,
    /// Reports that it sent unasked (0x3101, 0x1001).
    pub reports: u64,
    /// When its last status report (0x3101) came.
    pub(crate) reported_at: Option<MonoTime>,
    /// The newest frame that it answered.
    pub(super) answered: Option<FrameNo>,
    pub(super) stopped_by_reply: bool,
    pub(super) stopped_by_inputs: bool,
    /// Nothing asks for the emergency stop any more, but it lasts until a reset.
    pub(super) stop_is_held: bool,
    /// True if the error number came with a reply, so that a reply without one ends it; else only a report does.
    pub(super) error_by_reply: bool,
}

impl ControllerState {
    /// True if an emergency stop is in effect: its replies say so, or one of the configured inputs does.
    #[must_use]
    pub(crate) const fn emergency_stop(&self) -> bool {
        self.stopped_by_reply || self.stopped_by_inputs
    }
}
