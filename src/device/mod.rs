//! Slow talk with controllers: registers asked for and set, settings kept and compared, seats brought home. Control
//! thread, never during a show: it holds the frame port.
//!
//! ```text
//!  words of a person --> select --> Address --+--> request --> exchange --> talk --> net     one reply each, in time
//!                        table: what is it? --+                   |
//!        change: may it be written?   settings: a file, compared  +--> Answer, Fault          in words
//!                                     home: reset, and wait
//!                                     survey: all that preflight judges
//!                                     stand: whether a seat may be held where it is
//! ```
//!
//! Everything but [`Talk`] is told the time and touches neither socket nor clock. What a register is stands in one
//! place, [`table()`], and nowhere else.

mod address;
pub mod change;
mod exchange;
mod fault;
pub mod home;
mod request;
mod select;
pub mod settings;
pub mod stand;
pub mod survey;
mod table;
mod talk;
#[cfg(test)]
mod testing;

pub use address::Address;
pub use exchange::{Answer, Endpoint, Exchange, Odds, Outcome, Patience};
pub use fault::{Fault, Odd, refusal};
pub use request::{MAX_READ, Request, reads};
pub use select::{Assignment, SelectError, Selection, assignments, selections};
pub use stand::{places, position_words_of};
pub use table::{Family, Flags, Register, Table, table};
pub use talk::{Link, Talk, Watch, peers};
