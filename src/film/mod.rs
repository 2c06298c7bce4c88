//! Where the film is, by whoever knows: timecode, a player, a clock. What a source tells becomes observations, these an estimate,
//! the best of the estimates the point that the tick thread follows, a little faster or slower, never in a jump.
//!
//! ```text
//!  bytes, sound, lines -> ltc, mtc, artnet, mpv -> Observation -> SourceTracker -> Chooser -> PublishedPoint
//!                          readers' threads                                                         | tick thread
//!                                                     playhead, hold, park <- Chase <- Follower <---+
//! ```
//!
//! All of it is told the time and asks nobody. Nothing in here can arm, home, clear, or move a seat that nobody armed: [`chase::Chase`]
//! says what a hall that is armed may do, and no more.
#![cfg_attr(
    test,
    expect(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        clippy::cast_sign_loss,
        clippy::print_stdout,
        reason = "tests reckon with small numbers, and print their figures to who asks for them"
    )
)]

pub(crate) mod artnet;
pub(crate) mod chase;
pub(crate) mod chooser;
mod estimate;
pub(crate) mod follower;
pub(crate) mod labels;
mod late;
mod lines;
pub(crate) mod ltc;
pub(crate) mod message;
pub(crate) mod mpv;
pub(crate) mod mtc;
pub(crate) mod observation;
pub(crate) mod point;
mod samples;
pub(crate) mod sound;
pub(crate) mod source;
#[cfg(test)]
mod tests;
pub(crate) mod timecode;
pub(crate) mod tracker;
pub(crate) mod wall;
pub(crate) mod words;
