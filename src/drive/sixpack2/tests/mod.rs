//! Homings and plays in virtual time, against virtual units; judged by where their axes really were.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "numbers of axes and seeds"
)]

mod bench;
mod bus;
mod finding;
mod homing;
mod lost;
mod play;
mod playing;
mod rates;
mod runaway;
mod trouble;
