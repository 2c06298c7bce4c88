//! Events of a controller, as far as it reports them.

use std::fmt;

use crate::time::MonoTime;
use crate::wire::DeviceError;

/// Something that happened to a controller, with the instant at which the kernel received word of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Event {
    /// Which controller, counted from 0 in the order of the lanes.
    pub(crate) controller: usize,
    /// When.
    pub(crate) at: MonoTime,
    /// What.
    pub(crate) what: What,
}

/// How an emergency stop showed first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Cause {
    /// A reply with x = 4.
    Reply,
    /// One of the inputs that the configuration names.
    Inputs,
}

/// What can happen to a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum What {
    /// An emergency stop is in effect.
    EmergencyStop {
        /// How it showed first.
        cause: Cause,
    },
    /// The emergency stop was released, and the controller holds it until it is reset.
    EmergencyStopHeld,
    /// No sign of an emergency stop is left.
    EmergencyStopOver,
    /// The controller's error number changed; 0 is none.
    Error(u16),
    /// A drive's error number changed.
    ServoError {
        /// Its axis, from 1.
        axis: usize,
        /// The number; 0 is none.
        error: u16,
    },
    /// An MBOX controller reported unasked that something is wrong (0x1001); with 0 it is over.
    Alarm {
        /// The monitor register: DPFE, the alarm of the drives, where that is among what it reported, else the first.
        register: u16,
        /// What stands in it.
        value: u16,
    },
    /// Another reported registers unasked.
    Report {
        /// The first of them.
        start: u16,
        /// What stands in it.
        first: u16,
    },
}

impl fmt::Display for What {
    /// A sentence part for people.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::EmergencyStop { cause: Cause::Reply } => f.write_str("emergency stop in effect (x = 4)"),
            Self::EmergencyStop { cause: Cause::Inputs } => f.write_str("emergency stop in effect (inputs)"),
            Self::EmergencyStopHeld => f.write_str("emergency stop released, and held until a reset"),
            Self::EmergencyStopOver => f.write_str("emergency stop over"),
            Self::Error(0) => f.write_str("error gone"),
            Self::Error(error) => write!(f, "{}", DeviceError(error)),
            Self::ServoError { axis, error: 0 } => write!(f, "drive of axis {axis}: error gone"),
            Self::ServoError { axis, error } => write!(f, "drive of axis {axis}: error {error}"),
            Self::Alarm { register, value: 0 } => write!(f, "alarm over (DP{register:02x} is 0)"),
            Self::Alarm { register, value } => write!(f, "alarm: DP{register:02x} is {value} (0x1001)"),
            Self::Report { start, first } => write!(f, "report of register {start:02x}: {first:#06x}"),
        }
    }
}
