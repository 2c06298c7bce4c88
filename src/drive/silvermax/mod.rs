//! The host's end of a line of SilverMax units: what is asked of them, how a seat on them finds its zero, and how poses become motion.
//! Straight-line blocking procedures over a [`LinkPort`](super::link::LinkPort), which knows the time, so that whole homings and shows run in
//! virtual time. The thread of the link; nothing here is called by the tick thread.
//!
//! ```text
//!  look, home --Request--> Talk --octets--> LinkPort        one exchange at a time
//!  poses --ring--> Stream --segments--> Talk                the same, by what is due next
//!                     '--events--> ring
//! ```

mod home;
mod look;
mod scale;
mod set_up;
mod stream;
mod talk;
#[cfg(test)]
mod tests;

pub(crate) use home::{Homing, home};
pub(crate) use look::{UnitFacts, look};
pub(crate) use set_up::{HomeError, SeatUnits, UnitSettings};
pub(crate) use stream::SilverMax;
pub(crate) use talk::{Talk, TalkFault};
