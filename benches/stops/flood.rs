//! Everything that a show can be told but a stop, as fast as it goes.

use std::iter::Sum;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Scope, ScopedJoinHandle};

use kinocue::harness::engine::Mix;
use kinocue::harness::rt::{Command, Desk};
use kinocue::harness::state::Transition;
use kinocue::harness::time::ShowTime;
use rtrb::Producer;

/// Seeks are planned, which other commands are not: one in so many commands.
const SEEK_EVERY: u64 = 256;

/// How much there was of it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Flood {
    /// Commands that the mailbox took.
    pub(crate) taken: u64,
    /// Commands that found it full.
    pub(crate) full: u64,
    /// Settings of a lane or of the trim.
    pub(crate) settings: u64,
}

impl Sum for Flood {
    fn sum<I: Iterator<Item = Self>>(floods: I) -> Self {
        floods.fold(Self::default(), |sum, one| Self {
            taken: sum.taken + one.taken,
            full: sum.full + one.full,
            settings: sum.settings + one.settings,
        })
    }
}

/// One thread of commands and two of settings, until `done`.
pub(crate) fn begin<'scope, 'env>(
    scope: &'scope Scope<'scope, 'env>,
    commands: Producer<Command>,
    desk: &'scope Desk,
    done: &'scope AtomicBool,
) -> [ScopedJoinHandle<'scope, Flood>; 3] {
    [
        scope.spawn(move || command(commands, done)),
        scope.spawn(move || set(desk, done)),
        scope.spawn(move || set(desk, done)),
    ]
}

/// Keeps the mailbox full of commands that are refused, that change nothing, or that seek, until `done`.
fn command(mut commands: Producer<Command>, done: &AtomicBool) -> Flood {
    let mut flood = Flood::default();
    while !done.load(Ordering::Acquire) {
        let command = match flood.taken {
            taken if taken % SEEK_EVERY == 1 => Command::Seek(seek_to(taken)),
            taken if taken % 2 == 0 => Command::Request(Transition::Go),
            _ => Command::Request(Transition::Resume),
        };
        match commands.push(command) {
            Ok(()) => flood.taken += 1,
            Err(_) => flood.full += 1,
        }
    }
    flood
}

/// Somewhere in the first seconds of the ride.
fn seek_to(taken: u64) -> ShowTime {
    let ms = 1_000 + taken / SEEK_EVERY % 8 * 500;
    ShowTime::from_millis(i64::try_from(ms).expect("some seconds"))
}

/// Moves every fader and the trim about, until `done`.
fn set(desk: &Desk, done: &AtomicBool) -> Flood {
    let mut flood = Flood::default();
    while !done.load(Ordering::Acquire) {
        let level = if flood.settings.is_multiple_of(3) { 1.0 } else { 0.7 };
        for lane in 0..desk.lanes() {
            desk.set(lane, Mix { motion: level, vibration: level, ..Mix::FULL });
        }
        desk.set_trim_ms(if flood.settings.is_multiple_of(2) { 40 } else { -40 });
        flood.settings += 1 + desk.lanes() as u64;
    }
    flood
}
