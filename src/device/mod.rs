//! Slow talk with controllers: registers asked for and set, settings kept and compared, seats brought home. Control
//! thread, never during a show: it holds the frame port.
//!
//! ```text
//!  words of a person --> select --> Address --+--> request --> exchange --> talk --> net     one reply each, in time
//!                        table: what is it? --+                   |
//!        change: may it be written?   settings: a file, compared  +--> Answer, Fault          in words
//!                                     home: reset, and wait
//!                                     company: whether somebody else sends to it
//!                                     survey: all that preflight judges
//!                                     stand: whether a seat may be held where it is
//! ```
//!
//! Everything but [`Talk`] is told the time and touches neither socket nor clock. What a register is stands in one
//! place, [`table()`], and nowhere else.

mod address;
pub(crate) mod change;
pub(crate) mod company;
mod exchange;
mod fault;
pub(crate) mod home;
mod request;
mod select;
pub mod settings;
pub(crate) mod stand;
pub(crate) mod survey;
mod table;
mod talk;
#[cfg(test)]
mod testing;

pub use address::Address;
pub use exchange::Patience;
pub(crate) use exchange::{Endpoint, Exchange, Odds, RegisterAnswer, RequestOutcome};
pub(crate) use fault::PRINTED;
pub(crate) use fault::{Fault, Odd, refusal};
pub(crate) use request::Request;
pub use request::reads;
pub(crate) use select::{Assignment, Selection, assignments, selections};
pub(crate) use stand::{places, position_words_of};
pub use table::table;
pub(crate) use table::{Family, Flags, Register};
pub use talk::Talk;
pub(crate) use talk::{Link, Watch, peers};
