//! Virtual controllers that behave as the manual says: the same `wire`, seen from the other end.
//!
//! ```text
//!  datagram --> link (loss) --> controller --> player        where the motors are
//!                                  |   registers             PA, DP, DPF
//!  answer  <-- link (repeat, delay)+
//! ```
//!
//! All of it but [`Farm`] is told the time and touches neither socket nor clock. A farm runs many controllers on one
//! thread of normal priority; once it runs, a datagram costs it no allocation.

mod controller;
mod counts;
mod farm;
mod link;
mod log;
mod player;
mod registers;
mod setup;

pub use controller::{Controller, Handled, MotionSeen};
pub use counts::{Counts, Refused};
pub use farm::{Farm, FarmError, Outcome};
pub use registers::pa;
pub use setup::{LinkFaults, Options, Setup};
