//! The reads that a running hall makes of a controller, each always with the same first register and count: an answer names nothing
//! else.

use crate::wire::{
    AXES_PER_BLOCK, Access, Code, DP_INPUTS, DP_OUTPUTS, ReadRequest, RegisterReply, ReplyCode,
    position_parts, position_reads,
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
    /// PA05: 1 where outputs are inverted.
    Polarity,
    /// DP66: active outputs, bit 0 = Y01.
    Outputs,
    /// Where axes 1 to 3 are.
    FirstPositions,
    /// Where axes 4 to 6 are.
    MorePositions,
    /// Where axis 1 is, and where axes 2 and 3 are: a second source beside [`FirstPositions`].
    FirstAxis,
    NextAxes,
    /// The same of axes 4 to 6, beside [`MorePositions`].
    FourthAxis,
    LastAxes,
}

use MonitorRead::{
    FirstAxis, FirstPositions, FourthAxis, Inputs, LastAxes, Mode, MorePositions, NextAxes, Outputs, Packets,
    Polarity, StopMask, Versions, Zero,
};

/// A source of positions: answers to reads of one never pass for answers to reads of the other, so that no single datagram that the
/// network repeats is both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PositionSource {
    /// Reads of a whole block of axes.
    Blocks,
    /// Reads of a part of one.
    Parts,
}

impl PositionSource {
    /// Both of them.
    pub(super) const ALL: [Self; 2] = [Self::Blocks, Self::Parts];
}

/// What DPF0 says of a controller that knows its zero.
pub(super) const ZERO_KNOWN: u16 = 2;

impl MonitorRead {
    pub(super) const ALL: [Self; 14] = [
        Mode,
        Zero,
        Versions,
        Packets,
        StopMask,
        Inputs,
        Polarity,
        Outputs,
        FirstPositions,
        MorePositions,
        FirstAxis,
        NextAxes,
        FourthAxis,
        LastAxes,
    ];
    pub(super) const BLOCKS: [Self; 2] = [FirstPositions, MorePositions];
    pub(super) const POSITIONS: [Self; 6] =
        [FirstPositions, MorePositions, FirstAxis, NextAxes, FourthAxis, LastAxes];

    /// The first axis, from 0, that it tells the position of; none where it tells none.
    pub(super) const fn first_axis(self) -> Option<usize> {
        match self {
            FirstPositions | FirstAxis => Some(0),
            NextAxes => Some(1),
            MorePositions | FourthAxis => Some(AXES_PER_BLOCK),
            LastAxes => Some(AXES_PER_BLOCK + 1),
            _ => None,
        }
    }

    /// Which source of positions it is of; none where it tells none.
    pub(super) const fn source(self) -> Option<PositionSource> {
        match self {
            FirstPositions | MorePositions => Some(PositionSource::Blocks),
            FirstAxis | NextAxes | FourthAxis | LastAxes => Some(PositionSource::Parts),
            _ => None,
        }
    }

    /// True if it tells of a part of the axes that `block` tells of.
    pub(super) fn is_part_of(self, block: Self) -> bool {
        let blocks = [self, block].map(|read| read.first_axis().map(|axis| axis / AXES_PER_BLOCK));
        self.source() == Some(PositionSource::Parts) && blocks[0] == blocks[1]
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
            Outputs => (MONITORS, DP_OUTPUTS, 1),
            Polarity => (PARAMETERS, 0x05, 1),
            FirstPositions => return position_reads(axes, code, code).next(),
            MorePositions => return position_reads(axes, code, code).nth(1),
            FirstAxis => return position_parts(0, axes, code, code)[0],
            NextAxes => return position_parts(0, axes, code, code)[1],
            FourthAxis => return position_parts(AXES_PER_BLOCK, axes, code, code)[0],
            LastAxes => return position_parts(AXES_PER_BLOCK, axes, code, code)[1],
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
