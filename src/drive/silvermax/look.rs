//! What a unit says of itself; nothing is written, nothing moves, nothing is cleared.

use super::talk::{Answer, INTERNAL, Talk, TalkFault, internal_word};
use crate::drive::link::LinkPort;
use crate::wire::silvermax::register::{
    CANARY, DRY_BRAKE, ERROR_LIMITS, KILL_CAUSE, POSITION, SOFT_LIMIT_HIGH, SOFT_LIMIT_LOW, TARGET,
    TORQUE_CLOSED, TORQUE_OPEN,
};
use crate::wire::silvermax::{Internal, Io, Poll, Request, Words};

/// A unit as it was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UnitFacts {
    /// Its number.
    pub(crate) unit: u8,
    /// What it says to be (RVN); none where it does not know the command.
    pub(crate) revision: Option<Words>,
    /// What happened to it.
    pub(crate) poll: Poll,
    /// Its internal status.
    pub(crate) internal: Internal,
    /// Inputs and conditions.
    pub(crate) io: Io,
    /// What killed, the bits in the upper word (register 211).
    pub(crate) kill_cause: i32,
    /// 0 after each restart, and while it is not home (register 40).
    pub(crate) canary: i32,
    /// Where it is, counts.
    pub(crate) position: i32,
    /// Where it is to be.
    pub(crate) target: i32,
    /// Torque limits, hold and moving a word each: closed loop (206), open loop (207).
    pub(crate) torque: [i32; 2],
    /// Error limits, moving and holding a word each (208).
    pub(crate) error_limits: i32,
    /// With what a dry queue brakes (19).
    pub(crate) dry_brake: i32,
    /// Soft limits, the lower first (38, 39).
    pub(crate) soft_limits: [i32; 2],
}

/// Reads a unit.
///
/// # Errors
/// A [`TalkFault`] where it does not answer.
pub(crate) fn look<P: LinkPort>(talk: &mut Talk<P>, unit: u8) -> Result<UnitFacts, TalkFault> {
    let revision = match talk.insist(unit, Request::Revision)? {
        Answer::Data(words) => Some(words),
        Answer::Ack | Answer::Nak(_) => None,
    };
    let poll = Poll(talk.word(unit, Request::Poll)?);
    let io = Io(talk.word(unit, Request::IoStates)?);
    let mut value = |register| talk.register(unit, register);
    Ok(UnitFacts {
        unit,
        revision,
        poll,
        internal: internal_word(value(INTERNAL)?),
        io,
        kill_cause: value(KILL_CAUSE)?,
        canary: value(CANARY)?,
        position: value(POSITION)?,
        target: value(TARGET)?,
        torque: [value(TORQUE_CLOSED)?, value(TORQUE_OPEN)?],
        error_limits: value(ERROR_LIMITS)?,
        dry_brake: value(DRY_BRAKE)?,
        soft_limits: [value(SOFT_LIMIT_LOW)?, value(SOFT_LIMIT_HIGH)?],
    })
}
