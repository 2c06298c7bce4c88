//! The film's own sound: an index of it, made once, and an ear that finds in it what a line plays, from anywhere, and holds on to it.
//!
//! ```text
//!  samples -> resampler -+-> landmarks -> finder: places that may be it ---+
//!             8,000 /s   |                                                 v
//!                        +-> trace, 1,600 /s -------------> hold: proof, then the place ten times a second -> Observation
//! ```
//!
//! Landmarks find a place among hours in no time, and prove nothing. The trace does: four seconds of it stand out of what chance does
//! by twelve deviations, or nobody is told anything. On a reader's thread; told the samples and the time of each block.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "numbers of samples and of spectra of a film, which 32 bits and floats hold, and which are checked where a file says them"
)]

mod correlate;
mod ear;
mod file;
mod finder;
mod hold;
mod index;
mod kernel;
mod landmarks;
mod reader;
#[cfg(test)]
mod tests;
mod trace;

pub(crate) use file::{IndexFault, MOST_OCTETS, is_name};
pub(crate) use index::{IndexMaker, SoundIndex};
pub(crate) use reader::SoundReader;
