//! The reads that a running hall makes of a controller, each always with the same first register and count: an answer names nothing
//! else.

use crate::wire::{
    Access, Code, DP_INPUTS, DP_POSITIONS, ReadRequest, RegisterReply, ReplyCode, position_reads,
};

/// Object channels of reads: monitors, parameters (SMC manual 2.2.2.1).
const MONITORS: u16 = 0;
const PARAMETERS: u16 = 1;

/// What is read, in the order in which all of it is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MonitorRead {
    /// PA00 to PA02: work mode, and working axes.
    Mode,
    /// DPF0: [`ZERO_KNOWN`] once the controller knows its zero.
    Zero,
    /// DPFE and DPFF: versions.
    Versions,
    /// DP34: datagrams received; SMC alone.
    Packets,
    /// PA92: the inputs that all have to be active for an emergency stop; SMC alone.
    StopMask,
    /// DP5E: active inputs, bit 0 = X01.
    Inputs,
    /// Where axes 1 to 3 are.
    FirstPositions,
    /// Where axes 4 to 6 are.
    MorePositions,
}

use MonitorRead::{FirstPositions, Inputs, Mode, MorePositions, Packets, StopMask, Versions, Zero};

/// What DPF0 says of a controller that knows its zero.
pub(super) const ZERO_KNOWN: u16 = 2;

impl MonitorRead {
    pub(super) const ALL: [Self; 8] =
        [Mode, Zero, Versions, Packets, StopMask, Inputs, FirstPositions, MorePositions];
    pub(super) const POSITIONS: [Self; 2] = [FirstPositions, MorePositions];

    /// The first axis, from 0, that it tells the position of; none where it tells none.
    pub(super) fn first_axis(self) -> Option<usize> {
        let block = Self::POSITIONS.iter().position(|read| *read == self)?;
        Some(block * DP_POSITIONS.len() / Self::POSITIONS.len())
    }

    /// What asks a controller for it of which so many axes are read; none where it has no such axes.
    pub(super) fn request(self, axes: usize, code: Code) -> Option<ReadRequest> {
        let (channel, start, num) = match self {
            Mode => (PARAMETERS, 0x00, 3),
            Zero => (MONITORS, 0xf0, 1),
            Versions => (MONITORS, 0xfe, 2),
            Packets => (MONITORS, 0x34, 1),
            StopMask => (PARAMETERS, 0x92, 1),
            Inputs => (MONITORS, DP_INPUTS, 1),
            FirstPositions => return position_reads(axes, code, code).next(),
            MorePositions => return position_reads(axes, code, code).nth(1),
        };
        Some(ReadRequest { channel, accept: code, reply: code, start, num })
    }

    /// The read that a reply answers. One with x over 2 does not say its channel, and may have no count: of what is read here, first
    /// register and count tell all the same.
    pub(super) fn answered_by(reply: &RegisterReply<'_>, axes: usize) -> Option<Self> {
        let refused = reply.code != ReplyCode::Running;
        let is_answer = |request: ReadRequest| {
            reply.start == request.start
                && (reply.num == request.num || (refused && reply.num == 0))
                && (refused || reply.channel == request.channel)
        };
        let is_read = reply.access == Access::Read;
        Self::ALL.into_iter().find(|read| is_read && read.request(axes, Code::NONE).is_some_and(is_answer))
    }
}
