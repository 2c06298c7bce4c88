//! What tests and benches share of the inside: a hall in virtual time, rides, sequences for the limiter, and judges of what was sent.
//! Built with feature `harness` alone, which the crate's own tests and benches ask for.

#![expect(
    missing_docs,
    clippy::missing_panics_doc,
    reason = "whoever uses it has it before the eyes, and a test may panic"
)]

pub mod asked;
pub mod doors;
mod hall;
mod link_outlets;
mod played;
pub mod recording;
mod ride;
mod rooms;
pub(crate) mod shown;

pub use hall::{Event, ORIGIN, Virtual, read_at_rest};
pub use link_outlets::LinkOutlets;
pub use played::{Frame, Played, Worst, worst_of_lines};
pub use ride::{ride, stage, stage_in, swell};
pub use rooms::*;
pub use shown::{ShownFilm, TrueFilm};
