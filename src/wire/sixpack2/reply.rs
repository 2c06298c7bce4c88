//! What a unit answers to queries. An answer goes to the address that the query named, and repeats its command.

use super::layout::{Parameter, messages};
use super::{SixpackCommand, SixpackFrame};

messages! {
    /// An answer, by the command of its query.
    enum SixpackReply;

    /// Where a motor is.
    0x20 PositionTold "position" {
        /// Which motor.
        motor: u8,
        /// Microsteps.
        position: i32,
        /// One of [`action`].
        action: u8,
        /// Not 0 if it was stopped by its switch or an input since it was asked last.
        stop: u8,
    }
    /// How fast a motor is.
    0x21 VelocityTold "velocity" {
        /// Which motor.
        motor: u8,
        /// In units, negative downwards.
        velocity: i16,
        /// One of [`action`].
        action: u8,
    }
    /// What each motor is doing.
    0x28 ActionsTold "all actions" {
        /// One of [`action`] for each.
        actions: [u8; 6],
    }
    /// What is at an input.
    0x30 InputTold "input" {
        /// Which.
        channel: u8,
        /// In its own units; 22 a volt of the supply.
        value: u16,
        /// What else a unit says of its inputs.
        others: [u8; 4],
    }
    /// Who the unit is.
    0x43 UnitTold "unit" {
        /// Its version.
        firmware: u8,
        /// 1 if it was reset since it was asked last.
        reset: u8,
        /// Its temperature, °C.
        celsius: i8,
        /// Its serial number.
        serial: u16,
    }
}

/// What a motor can be doing.
pub(crate) mod action {
    /// Nothing; its target was reached.
    pub(crate) const IDLE: u8 = 0;
    /// A move by ramps.
    pub(crate) const RAMP: u8 = 5;
    /// Following a target.
    pub(crate) const PI: u8 = 10;
    /// Turning.
    pub(crate) const ROTATION: u8 = 15;
    /// The first step of a search for zero; the last is [`LAST_SEARCH`].
    pub(crate) const SEARCH: u8 = 20;
    /// The last step of a search.
    pub(crate) const LAST_SEARCH: u8 = 29;
    /// Driving into a mechanical stop.
    pub(crate) const MECHANICAL: u8 = 30;
}

impl SixpackCommand {
    /// The answer to this query, if a frame is that; nothing in it tells it from a frame to a unit but its address.
    #[must_use]
    pub(crate) fn answered_by(self, frame: SixpackFrame) -> Option<SixpackReply> {
        let reply = SixpackReply::of(frame);
        let (response, is_of_it) = match (self, reply) {
            (Self::PositionQuery(query), SixpackReply::PositionTold(told)) => {
                (query.response, query.motor == told.motor)
            }
            (Self::VelocityQuery(query), SixpackReply::VelocityTold(told)) => {
                (query.response, query.motor == told.motor)
            }
            (Self::InputQuery(query), SixpackReply::InputTold(told)) => {
                (query.response, query.channel == told.channel)
            }
            (Self::ActionsQuery(query), SixpackReply::ActionsTold(_)) => (query.response, true),
            (Self::UnitQuery(query), SixpackReply::UnitTold(_)) => (query.response, true),
            _ => return None,
        };
        (is_of_it && frame.address == response).then_some(reply)
    }
}
