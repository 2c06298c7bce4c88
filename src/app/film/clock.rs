//! The clock of the day: read together with the machine's, ten times a second, and asked how far off it may be.

use std::time::Duration;

use super::{FilmError, WordSink, start};
use crate::film::source::ClockStart;
use crate::film::wall::{ClockReading, WallFilm};
use crate::sys::adjusted::wall_error;
use crate::sys::clock::{Monotonic, local_now, wall_now_ns};
use crate::time::Clock as _;

const READ_EVERY: Duration = Duration::from_millis(100);
/// The narrowest of so many readings: the others were interrupted.
const READINGS: usize = 5;

/// Begins to read the clock; one that may be off by more than is allowed leads nobody.
pub(super) fn start_reading(from: &ClockStart, told: WordSink) -> Result<(), FilmError> {
    let error = wall_error().map_err(|source| FilmError::Open { what: "the clock".to_owned(), source })?;
    if error.most > from.max_error {
        return Err(FilmError::Clock { most: error.most, likely: error.likely, allowed: from.max_error });
    }
    let Some(at_ns) = from.at_ns(&local_now()) else { return Err(FilmError::NoSuchTime) };
    let mut film = WallFilm::new(at_ns);
    start("clock", move || {
        let mut next = Monotonic.now();
        while told.tell(film.read(&read())) {
            told.note(|notes| {
                notes.clock_steps = film.steps();
                notes.clock_error_ms = wall_error().ok().map(|error| error.most.as_secs_f64() * 1e3);
            });
            next = next + READ_EVERY;
            Monotonic.sleep_until(next);
        }
    })?;
    Ok(())
}

/// Both clocks, the day's between two readings of the machine's.
fn read() -> ClockReading {
    let once = || {
        let (before, wall_ns, after) = (Monotonic.now(), wall_now_ns(), Monotonic.now());
        let bound = after.since(before) / 2;
        ClockReading { at: before + bound, wall_ns, bound }
    };
    let mut best = once();
    for _ in 1..READINGS {
        let other = once();
        if other.bound < best.bound {
            best = other;
        }
    }
    best
}
