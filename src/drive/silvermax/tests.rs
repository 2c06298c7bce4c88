//! Homings and plays in virtual time, against virtual units; judged by where their axes really were.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "numbers of axes, ticks, segments and seeds"
)]

mod bench;
mod homing;
mod playing;
mod rates;
mod trouble;
