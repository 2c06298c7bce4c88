//! The protocol of the SIXpack 2, as host and as unit: octets to frames, frames to commands and replies, and back. Any thread;
//! nothing here allocates, writing cannot fail, and reading takes any octets without a panic.
//!
//! A frame is nine octets each way: an address, a command and seven parameters, values of several octets with the low one first
//! (its manual, pages 21 and 36). There is no sum, and nothing is acknowledged: only queries are answered, to the address that they
//! name. [`SixpackCommand`] reads whatever a log shows; [`SixpackOrder`] is what may be sent.

mod can;
mod clock;
mod collector;
mod command;
mod frame;
mod layout;
mod order;
mod reply;
#[cfg(test)]
mod tests;

#[cfg(test)]
pub(crate) use can::CanFrameError;
pub(crate) use can::{CanFrame, ID_ZEROS};
pub(crate) use clock::{
    BAUD_CLOCK, GREATEST_DIVIDER, MOST_SPEED, MOST_STEPS, WAKING_DIVISOR, baud_of, greatest_divider,
    steps_of_a_unit,
};
pub(crate) use collector::FrameCollector;
pub(crate) use command::{
    AbortSearch, ActionsQuery, BaudSwitch, ClockDivider, CurrentSettings, InputQuery, JointStart,
    JointTarget, MotorSettings, PacketTimeout, PeakCurrent, PiSettings, PiTarget, PositionPreset,
    PositionQuery, RampSettings, ReferenceSearch, ReferenceSettings, Rotation, SixpackCommand, StartSettings,
    UnitQuery, VelocityQuery, ZeroSettings, p5, p6,
};
pub(crate) use frame::{FRAME_LEN, SixpackFrame};
pub(crate) use order::SixpackOrder;
pub(crate) use reply::{ActionsTold, InputTold, PositionTold, SixpackReply, UnitTold, VelocityTold, action};
