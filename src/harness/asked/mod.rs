//! The limiter, asked for anything: sequences by chance, and a judge that knows the definition of the measure alone.

mod chance;
mod judge;
pub mod sound;
mod trial;
pub mod wild;

pub use chance::Chance;
pub use sound::Sound;
pub use trial::{Trial, read, standing, window};
pub use wild::Wild;
