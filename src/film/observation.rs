//! What a source tells of the film, in the one form that all of them share.

use std::time::Duration;

use crate::time::{MonoTime, ShowTime};

/// What a source told, and when that was so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observation {
    /// The instant that it speaks of, as well as the reader knows.
    pub(crate) at: MonoTime,
    /// How far off that instant may be, either way.
    pub(crate) bound: Duration,
    pub(crate) word: FilmWord,
}

impl Observation {
    /// One of which the instant is known as well as it can be.
    pub(crate) const fn new(at: MonoTime, word: FilmWord) -> Self {
        Self { at, bound: Duration::ZERO, word }
    }
}

/// What can be said of a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum FilmWord {
    /// The film is there.
    Position(ShowTime),
    /// Timecode comes that cannot be placed: its frame rate is not known, or nothing has confirmed its label.
    Unplaced,
    /// It was stopped.
    Stop,
    /// A machine has named the place that it runs through: where it has stopped, no position follows.
    MayStop,
    /// It runs again.
    Play,
    /// It is being wound: what is said of positions means nothing until [`FilmWord::Landed`].
    Seek,
    /// It was wound to where the next position says; whether it runs is what it was before.
    Landed,
    /// From now on it runs so many times as fast as the clock.
    Speed(f64),
    /// It is over.
    End,
    /// The line carries nothing: stopped at the other end, or pulled out.
    Silence,
    /// The line carries something that cannot be read.
    Dirt,
    /// Whoever told is not there any more.
    Gone,
}
