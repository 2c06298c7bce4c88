//! How late frames leave and how soon their acks come, measured over seats that do not move: which frames hold a seat,
//! the times in a file, and two such files side by side. Control thread; pure but for the reader and writer it is given.

mod compare;
mod hold;
mod log;
mod percentiles;

pub(crate) use compare::{Comparison, TimesRow};
pub(crate) use hold::{cue, held};
pub(crate) use log::Log;
pub use log::read;
pub use percentiles::Percentiles;

use crate::rt::Times;

/// What was counted since `earlier`, a reading of the same play.
///
/// # Panics
/// Where `earlier` counts what `now` does not.
#[must_use]
pub(crate) fn between(earlier: &Times, now: &Times) -> Times {
    let mut part = now.clone();
    let grows = "counts only grow";
    part.lateness.subtract(&earlier.lateness).expect(grows);
    part.acks.subtract(&earlier.acks).expect(grows);
    part
}
