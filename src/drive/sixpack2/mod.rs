//! The host's end of a line of SIXpack 2 units: how they are found and brought to the rate of the link, what is asked of them, how a seat on
//! one finds its zero, and how poses become motion. Straight-line blocking procedures over a [`LinkPort`](super::link::LinkPort), which knows the time, so
//! that whole homings and shows run in virtual time. The thread of the link; nothing here is called by the tick thread.
//!
//! ```text
//!  find, look, home --SixpackOrder--> Talk --break, nine octets--> LinkPort        one exchange at a time
//!  poses --ring--> Stream --targets--> Talk                                        all of a slice at once
//!                     '--events--> ring
//! ```

mod ask;
mod find;
mod home;
mod look;
mod reach;
mod scale;
mod set_up;
mod stream;
mod talk;
#[cfg(test)]
mod tests;

pub(crate) use find::FindError;
#[cfg(test)]
pub(crate) use find::find;
pub(crate) use home::{Homing, home};
#[cfg(test)]
pub(crate) use look::MotorFacts;
pub(crate) use look::{UnitFacts, look_for};
pub(crate) use reach::{OrderGap, Reach};
pub(crate) use set_up::{HomeError, SeatMotors};
pub(crate) use stream::{Sixpack2, read_every};
pub(crate) use talk::{Talk, TalkFault};
