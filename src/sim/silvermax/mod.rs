//! Virtual SilverMax units on one line: what the command reference says of them, tick by tick of 120 µs in whole numbers.
//!
//! ```text
//!  octet --> SilverBus --line--> Unit    takes a command or refuses it; words, registers
//!  octet <--  ADL   <---Reply---   |     mover: what moves, timed queue, brakes
//!                                  |     trajectory: the one that makes every motion
//!                                  +---> Executed: where the axis really was
//! ```
//!
//! A unit has a place, which is where its axis stands between two mechanical stops, and counts from where it was switched
//! on. What happens to it is an [`Action`]. Commands that kinocue never sends are obeyed as a unit would, and counted.

mod action;
mod axis;
mod bus;
mod commands;
mod conditions;
mod executed;
mod mover;
#[cfg(test)]
mod tests;
mod trajectory;
mod unit;
mod unit_setup;

pub(crate) use action::Action;
pub(crate) use bus::SilverBus;
use executed::Executed;
pub(crate) use unit::Unit;
pub(crate) use unit_setup::UnitSetup;

/// Nanoseconds of a tick by a crystal that is right.
const TICK_NS: u32 = 120_000;
