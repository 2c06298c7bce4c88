//! Virtual controllers that behave as the manuals say: the same `wire`, seen from the other end.
//!
//! ```text
//!  datagram --> link (loss) --> controller --> player        where the motors are
//!                                  |   registers             PA, with what the one table of registers says of them
//!                                  |   inputs, errors        emergency stop, jog, reset; Err1 to Err21
//!  answer, report <-- link <-------+
//!  (repeat, delay)                 +--- script, remote       switches, faults, power
//! ```
//!
//! All of it but [`Farm`] is told the time and touches neither socket nor clock. A farm runs many controllers on one
//! thread of normal priority; once it runs, a motion frame costs it no allocation. What the manuals leave open is
//! [`Invented`], and can be played the other way.

pub(crate) mod chance;
mod command;
mod controller;
mod counts;
mod errors;
mod event_loop;
mod farm;
mod inputs;
mod invented;
mod link;
mod log;
mod outcome;
pub mod pa;
mod player;
mod registers;
pub(crate) mod serial;
mod setup;
mod sheet;
pub(crate) mod silvermax;
pub(crate) mod sixpack2;
mod station;
mod thread;

pub use command::{Action, Command, CommandError};
pub use controller::Controller;
pub(crate) use controller::MotionSeen;
pub(crate) use counts::Counts;
pub use farm::{Farm, FarmError};
pub(crate) use invented::{Commands, Invented};
pub(crate) use outcome::Outcome;
pub use setup::{LinkFaults, Options, Setup};
