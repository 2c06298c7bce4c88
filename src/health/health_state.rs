//! Health of a group of controllers, its cause, and its consequences.

use crate::motion::Pulses;
use crate::state;
use crate::time::MonoTime;

/// Health of a motion group. One member's trouble is the whole group's: the seat is rigid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HealthState {
    /// All is well.
    Ok,
    /// Acks are missing; motion goes on.
    Degraded,
    /// Not heard for too long: hold frames, then no motion.
    Lost,
    /// Found again as it was: it takes part from the next join on.
    Rejoining,
    /// An emergency stop; no frame at all. Latched.
    Stopped,
    /// A controller or a drive has an error; no motion. Latched.
    Error,
    /// Its position is unknown, or nobody can tell: no motion until it is homed.
    Excluded,
    /// Acks are off: nobody notices when it is lost.
    Unwatched,
}

impl HealthState {
    /// True if motion frames may go to it.
    #[must_use]
    pub const fn may_move(self) -> bool {
        matches!(self, Self::Ok | Self::Degraded | Self::Rejoining | Self::Unwatched)
    }

    /// True if its registers are to be read, to see when it is back or put right.
    #[must_use]
    pub(crate) const fn is_looked_at(self) -> bool {
        matches!(self, Self::Lost | Self::Stopped | Self::Error)
    }
}

/// An axis that stands beside where its drive holds it; places in thousandths of a millimetre, or of a degree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Pushed {
    /// Which, from 0.
    pub(crate) axis: usize,
    /// Where it was read.
    pub(crate) at: i32,
    /// Where its drive holds it.
    pub(crate) held: i32,
}

impl Pushed {
    /// A place in them.
    #[expect(clippy::cast_possible_truncation, reason = "some metres; saturating")]
    pub(crate) const fn thousandths(place: f64) -> i32 {
        (place * 1e3).round() as i32
    }

    /// Where it was read, and where its drive holds it, to a tenth.
    pub(super) fn places(self) -> [String; 2] {
        [self.at, self.held].map(|place| format!("{:.1}", f64::from(place) / 1e3))
    }
}

/// Why a group stands as it does. Controllers are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Why {
    /// Acks come as they should.
    Acked,
    /// No acks are asked for.
    AcksOff,
    /// Acks of this controller are missing or late.
    AcksMissing(usize),
    /// No ack and no report came from this controller for too long.
    Silent(usize),
    /// Nobody has looked at it since it was cleared or homed.
    NotSeenYet,
    /// It was seen as it was before.
    SeenAgain,
    /// This controller's seat is elsewhere than frames left it.
    Moved(usize),
    /// It is not known where the frames to this controller have led its seat.
    Unsure(usize),
    /// The drives of this controller were stopped ahead of where poses have led its seat.
    CutShort(usize),
    /// The seat of this controller is elsewhere than acked frames have led it.
    Astray(usize),
    /// One of these was so three times within a minute.
    Unsteady(usize),
    /// Not all axes of this controller tell where they are.
    Unread(usize),
    /// The positions of this controller make two places each, and nothing says in which order their words come.
    Ambiguous(usize),
    /// An axis of this controller, from 0, says that it is outside of its stroke.
    Outside {
        /// Which controller.
        controller: usize,
        /// Which axis.
        axis: usize,
        /// Where.
        pulses: Pulses,
    },
    /// An axis of this controller stands beside where its drive holds it.
    Pushed {
        /// Which controller.
        controller: usize,
        /// Which axis, and where.
        pushed: Pushed,
    },
    /// An emergency stop at this controller.
    EmergencyStop(usize),
    /// An emergency stop at this controller was released, and it holds until it is reset.
    HeldUntilReset(usize),
    /// This controller has an error.
    Error {
        /// Which.
        controller: usize,
        /// The number.
        error: u16,
    },
    /// A drive of this controller has an alarm.
    Drive {
        /// Which.
        controller: usize,
        /// Its axis, from 1.
        axis: usize,
        /// The number.
        error: u16,
    },
    /// A drive of this controller let go of its motor.
    Killed {
        /// Which.
        controller: usize,
        /// Its axis, from 1.
        axis: usize,
        /// The bits of what killed, of register 211 of a SilverMax.
        cause: u16,
    },
    /// This controller reports an alarm (MBOX): of its drives where the register is DPFE.
    Alarm {
        /// Which.
        controller: usize,
        /// The monitor register that it reports.
        register: u16,
        /// What stands there.
        value: u16,
    },
    /// This controller refuses frames (x = 3, 5, MBOX also 4) and gives no error number.
    Refuses(usize),
    /// This controller answers with registers of 32 bits.
    Wide(usize),
    /// This controller drives fewer axes than its seat type has, or more, which frames would lead, too (PA02).
    OtherAxes {
        /// Which.
        controller: usize,
        /// How many it drives.
        drives: u16,
    },
    /// This controller has rebooted: its packet counter began anew.
    Rebooted(usize),
    /// This controller got more datagrams than were sent from here, and more than it can have got since a reboot.
    OtherMaster(usize),
    /// This controller was reset: it is not home any more.
    NotHome(usize),
    /// Another controller, or another mode, is where this one was.
    Other(usize),
    /// This controller, which counts no packets, was silent for so long that it may have rebooted.
    Gap(usize),
    /// True if this controller has rebooted cannot be told.
    Unproved(usize),
}

impl Why {
    /// The controller it is about; `None` if that is the whole group.
    #[must_use]
    pub(crate) const fn controller(self) -> Option<usize> {
        match self {
            Self::AcksMissing(controller)
            | Self::Silent(controller)
            | Self::Moved(controller)
            | Self::Unsure(controller)
            | Self::CutShort(controller)
            | Self::Astray(controller)
            | Self::Unsteady(controller)
            | Self::Unread(controller)
            | Self::Ambiguous(controller)
            | Self::OtherAxes { controller, .. }
            | Self::Outside { controller, .. }
            | Self::Pushed { controller, .. }
            | Self::EmergencyStop(controller)
            | Self::HeldUntilReset(controller)
            | Self::Error { controller, .. }
            | Self::Drive { controller, .. }
            | Self::Killed { controller, .. }
            | Self::Alarm { controller, .. }
            | Self::Refuses(controller)
            | Self::Wide(controller)
            | Self::Rebooted(controller)
            | Self::OtherMaster(controller)
            | Self::NotHome(controller)
            | Self::Other(controller)
            | Self::Gap(controller)
            | Self::Unproved(controller) => Some(controller),
            Self::Acked | Self::AcksOff | Self::NotSeenYet | Self::SeenAgain => None,
        }
    }
}

/// A group that stands otherwise than before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// Which, counted from 0.
    pub(crate) group: usize,
    /// When that was noticed.
    pub(crate) at: MonoTime,
    /// How it stood.
    pub(crate) from: HealthState,
    /// How it stands.
    pub(crate) to: HealthState,
    /// Why.
    pub(crate) why: Why,
}

/// What comes of a look at all groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Notice {
    /// For the lanes, the report and the console: a group stands otherwise.
    Group(Change),
    /// For the state machine of the hall.
    Hall(state::Event),
    /// Identity, mode, error, packet counter and DPF0 of this controller are to be read.
    Read(usize),
    /// The packet counter of this controller, to which frames go, is to be read.
    Count(usize),
}
