//! Homings and plays in virtual time, against virtual units; judged by where their axes really were.

#![expect(clippy::cast_possible_truncation, reason = "numbers of axes, ticks and seeds")]

mod bench;
mod homing;
mod playing;
mod trouble;
