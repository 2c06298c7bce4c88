//! Positions that a player tells by message, OSC or HTTP: milliseconds of its film, whether it runs and how fast. On a reader's thread.

use std::time::Duration;

use rosc::OscType;
use serde::Deserialize;

use super::observation::{FilmWord, Observation};
use crate::time::{MonoTime, ShowTime};

/// A message that says it is older was stamped by another clock.
const OLDEST_S: f64 = 1.0;
/// From 1900, which OSC counts from, to 1970 (RFC 5905).
const UNIX_EPOCH_S: u64 = 2_208_988_800;

/// What a message says.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FilmPosition {
    /// Where the film is, milliseconds.
    pub(crate) media_ms: f64,
    /// How many times as fast as the clock it runs.
    #[serde(default = "one")]
    pub(crate) rate: f64,
    #[serde(default = "yes")]
    pub(crate) playing: bool,
    /// How long ago that was so, milliseconds.
    #[serde(default)]
    pub(crate) age_ms: f64,
}

const fn one() -> f64 {
    1.0
}

const fn yes() -> bool {
    true
}

impl FilmPosition {
    /// Position, whether it runs, rate, and when that was so; all but the first may be left out. `wall_ns` is the wall clock, since 1970.
    #[expect(clippy::cast_precision_loss, reason = "milliseconds of a film, nanoseconds of a day's clock")]
    pub(crate) fn of_osc(args: &[OscType], wall_ns: u64) -> Option<Self> {
        let (first, rest) = args.split_first()?;
        let media_ms = match first {
            OscType::Long(ms) => *ms as f64,
            OscType::Int(ms) => f64::from(*ms),
            OscType::Double(ms) => *ms,
            OscType::Float(ms) => f64::from(*ms),
            _ => return None,
        };
        let mut position = Self { media_ms, rate: 1.0, playing: true, age_ms: 0.0 };
        for more in rest {
            match more {
                OscType::Bool(playing) => position.playing = *playing,
                OscType::Double(rate) => position.rate = *rate,
                OscType::Float(rate) => position.rate = f64::from(*rate),
                OscType::Time(time) => {
                    let since_1970_s = u64::from(time.seconds).saturating_sub(UNIX_EPOCH_S);
                    let fraction_ns = u64::from(time.fractional).wrapping_mul(1_000_000_000) >> 32;
                    let at_ns = since_1970_s.saturating_mul(1_000_000_000).saturating_add(fraction_ns);
                    position.age_ms = wall_ns.saturating_sub(at_ns) as f64 / 1e6;
                }
                _ => return None,
            }
        }
        Some(position)
    }
}

/// Reads the messages of one player.
#[derive(Debug, Clone)]
pub(crate) struct PositionReader {
    begin: ShowTime,
    playing: Option<bool>,
    rate: f64,
}

impl PositionReader {
    /// The cue begins where the film is at `begin`.
    pub(crate) const fn new(begin: ShowTime) -> Self {
        Self { begin, playing: None, rate: 1.0 }
    }

    /// Takes what came at an instant.
    #[expect(clippy::float_cmp, reason = "a rate that was told before says nothing new")]
    pub(crate) fn hear(&mut self, told: &FilmPosition, at: MonoTime, out: &mut impl FnMut(Observation)) {
        let age_s = told.age_ms / 1e3;
        // What another clock says is worth nothing: the instant at which it came is off by the network alone.
        let age_s = if (0.0..=OLDEST_S).contains(&age_s) { age_s } else { 0.0 };
        let at = at.before(Duration::from_secs_f64(age_s));
        // Before the position: from here on the estimate runs at that rate, and need not find it out.
        if told.rate.is_finite() && told.rate != self.rate {
            self.rate = told.rate;
            out(Observation::new(at, FilmWord::Speed(told.rate)));
        }
        if self.playing != Some(told.playing) {
            // The first that runs is no play after a stop.
            let was_known = self.playing.replace(told.playing).is_some();
            match told.playing {
                true if was_known => out(Observation::new(at, FilmWord::Play)),
                true => {}
                false => out(Observation::new(at, FilmWord::Stop)),
            }
        }
        if told.media_ms.is_finite() {
            let media = ShowTime::from_secs_f64(told.media_ms / 1e3);
            out(Observation::new(at, FilmWord::Position(media.since(self.begin))));
        }
    }
}

#[cfg(test)]
mod tests {
    use rosc::OscTime;

    use super::*;

    fn words(reader: &mut PositionReader, told: &FilmPosition) -> Vec<FilmWord> {
        let mut words = Vec::new();
        reader.hear(told, MonoTime::from_nanos(5_000_000_000), &mut |what| words.push(what.word));
        words
    }

    #[test]
    fn a_player_that_stops_runs_again_and_changes_its_speed_says_so_once_each() {
        let mut reader = PositionReader::new(ShowTime::from_millis(1_000));
        let told = |media_ms, playing, rate| FilmPosition { media_ms, rate, playing, age_ms: 0.0 };
        let at = |ms| FilmWord::Position(ShowTime::from_millis(ms));
        assert_eq!(words(&mut reader, &told(3_000.0, true, 1.0)), [at(2_000)]);
        assert_eq!(words(&mut reader, &told(3_500.0, false, 1.0)), [FilmWord::Stop, at(2_500)]);
        assert_eq!(words(&mut reader, &told(3_500.0, false, 1.0)), [at(2_500)]);
        let goes_on = words(&mut reader, &told(3_500.0, true, 1.001));
        assert_eq!(goes_on, [FilmWord::Speed(1.001), FilmWord::Play, at(2_500)]);
        assert_eq!(words(&mut reader, &told(f64::NAN, true, f64::INFINITY)), []);
    }

    #[test]
    fn what_is_said_to_be_older_than_a_second_or_of_the_future_is_taken_as_of_now() {
        let now = MonoTime::from_nanos(5_000_000_000);
        let at = |age_ms| {
            let mut at = Vec::new();
            let told = FilmPosition { media_ms: 1.0, rate: 1.0, playing: true, age_ms };
            PositionReader::new(ShowTime::ZERO).hear(&told, now, &mut |what| at.push(what.at));
            at
        };
        assert_eq!(at(40.0), [now.before(Duration::from_millis(40))]);
        for age_ms in [-1.0, 1_001.0, f64::NAN, f64::INFINITY] {
            assert_eq!(at(age_ms), [now], "{age_ms}");
        }
    }

    #[test]
    fn a_message_of_osc_may_say_when_it_was_so() {
        let wall_ns = 1_700_000_000_250_000_000_u64;
        let time = OscTime { seconds: (1_700_000_000 + UNIX_EPOCH_S) as u32, fractional: 0 };
        let read =
            FilmPosition::of_osc(&[OscType::Int(7), OscType::Bool(true), OscType::Time(time)], wall_ns);
        assert!(read.is_some_and(|read| (read.age_ms - 250.0).abs() < 0.001), "{read:?}");
        assert_eq!(FilmPosition::of_osc(&[OscType::String("7".to_owned())], wall_ns), None);
        assert_eq!(FilmPosition::of_osc(&[OscType::Int(7), OscType::Nil], wall_ns), None);
    }
}
