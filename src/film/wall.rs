//! The clock of the day as the film's: a film that begins at an hour. Until then the clock may be set; from then on a film runs that
//! nobody can set, so that a step of the clock, a leap second too, is none of the film. On a reader's thread; told both clocks.

use std::time::Duration;

use super::observation::{FilmWord, Observation};
use crate::time::{MonoTime, ShowTime};

/// What the two clocks may differ by from one reading to the next without that one was set: they are steered together, so all of it
/// is the error of the readings.
const STEP_NS: i64 = 100_000;

/// Both clocks at about one instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ClockReading {
    pub(crate) at: MonoTime,
    /// Nanoseconds since 1970.
    pub(crate) wall_ns: u64,
    /// How far apart in time they may have been read.
    pub(crate) bound: Duration,
}

/// Makes a film of the clock of the day.
#[derive(Debug, Clone)]
pub(crate) struct WallFilm {
    begin_ns: i64,
    /// The wall clock less the machine's, when it was read last.
    ahead_ns: Option<i64>,
    /// What the clock was set by since the film began.
    stepped_ns: i64,
    steps: u64,
}

impl WallFilm {
    /// A film that begins at that time of the wall clock, nanoseconds since 1970.
    pub(crate) const fn new(begin_ns: i64) -> Self {
        Self { begin_ns, ahead_ns: None, stepped_ns: 0, steps: 0 }
    }

    /// How often the clock was set since the film began.
    pub(crate) const fn steps(&self) -> u64 {
        self.steps
    }

    /// Where the film is by a reading.
    pub(crate) fn read(&mut self, reading: &ClockReading) -> Observation {
        let wall_ns = signed(reading.wall_ns);
        let ahead_ns = wall_ns.saturating_sub(signed(reading.at.as_nanos()));
        let since_ns = |stepped_ns: i64| wall_ns.saturating_sub(self.begin_ns).saturating_sub(stepped_ns);
        let before = self.ahead_ns.replace(ahead_ns).unwrap_or(ahead_ns);
        let step = ahead_ns.saturating_sub(before);
        // By the clock as it is now: one that was wrong until now, and past the begin, has begun a film that nobody saw begin.
        let runs = since_ns(self.stepped_ns.saturating_add(step)) >= 0;
        let error_ns = STEP_NS.saturating_add(signed(crate::time::nanos(reading.bound)));
        // Seats that follow must not jump because somebody mends the hour.
        if runs && step.saturating_abs() > error_ns {
            self.stepped_ns = self.stepped_ns.saturating_add(step);
            self.steps += 1;
        }
        let media =
            ShowTime::from_nanos(wall_ns.saturating_sub(self.begin_ns).saturating_sub(self.stepped_ns));
        Observation { at: reading.at, bound: reading.bound, word: FilmWord::Position(media) }
    }
}

fn signed(nanos: u64) -> i64 {
    i64::try_from(nanos).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The film at ten times of the machine, s, as the wall clock is ahead by so much, s.
    fn film(at: &[(u64, i64)]) -> (Vec<i64>, u64) {
        let mut film = WallFilm::new(1_700_000_000_000_000_000);
        let mut media = |(mono_s, ahead_s): &(u64, i64)| {
            let wall_ns = (mono_s.cast_signed() + ahead_s).cast_unsigned() * 1_000_000_000;
            let at = MonoTime::from_nanos(mono_s * 1_000_000_000);
            match film.read(&ClockReading { at, wall_ns, bound: Duration::from_micros(1) }).word {
                FilmWord::Position(media) => media.as_nanos() / 1_000_000_000,
                _ => unreachable!("it knows nothing else"),
            }
        };
        (at.iter().map(&mut media).collect(), film.steps())
    }

    const AHEAD: i64 = 1_699_999_000;

    #[test]
    fn until_the_film_begins_the_clock_may_be_set_and_from_then_on_it_is_not_followed() {
        assert_eq!(film(&[(100, AHEAD), (101, AHEAD + 30), (102, AHEAD + 30)]), (vec![-900, -869, -868], 0));
        let set = [
            (1_000, AHEAD),
            (1_001, AHEAD),
            (1_002, AHEAD + 30),
            (1_003, AHEAD + 30),
            (1_004, AHEAD - 3_600),
        ];
        assert_eq!(film(&set), (vec![0, 1, 2, 3, 4], 2));
    }

    #[test]
    fn a_clock_that_is_set_past_the_begin_of_the_film_or_back_before_it_changes_nothing_of_one_that_runs() {
        // Set back by two hours while the film runs: by the clock it has not begun.
        assert_eq!(film(&[(1_010, AHEAD), (1_011, AHEAD - 7_200)]), (vec![10, 11], 1));
        // Set forward past the begin: the clock was wrong until then, and the film has begun.
        assert_eq!(film(&[(900, AHEAD), (901, AHEAD + 200)]), (vec![-100, 101], 0));
    }

    #[test]
    fn clocks_of_any_age_make_a_film_and_no_panic() {
        for wall_ns in [0, u64::MAX] {
            for at in [0, u64::MAX] {
                let reading = ClockReading { at: MonoTime::from_nanos(at), wall_ns, bound: Duration::MAX };
                let mut film = WallFilm::new(i64::MIN);
                film.read(&reading);
                film.read(&ClockReading { wall_ns: u64::MAX - wall_ns, ..reading });
            }
        }
    }
}
