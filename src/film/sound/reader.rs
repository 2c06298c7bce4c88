//! Blocks of samples, as they are read, into observations of the film of a show.

use std::sync::Arc;
use std::time::Duration;

use super::ear::{EarState, HeardPlace, SoundEar};
use super::index::SoundIndex;
use crate::film::observation::{FilmWord, Observation};
use crate::film::samples::SampleClock;
use crate::time::{MonoTime, ShowTime};

/// How far off a place may be, beside its noise: tone controls delay what they pass.
const BOUND: Duration = Duration::from_micros(300);
/// What is heard is in no index after so long: before that it may be a quiet passage, or a dialogue that was dubbed.
const STRANGE_S: f64 = 5.0;
/// Of the loudness before, what remains in each second.
const LOUDNESS_KEPT: f64 = 0.05;

/// Reads one line as the sound of a film.
pub(crate) struct SoundReader {
    ear: SoundEar,
    /// The film of the show, and others that are to be told from it.
    films: Arc<[SoundIndex]>,
    samples: SampleClock,
    samples_per_s: f64,
    count: f64,
    /// How long sound takes from the line to a block.
    latency: Duration,
    /// Where the film is when the cue begins.
    begin: ShowTime,
    power: f64,
    block: Vec<f32>,
    /// The state that was told last, and when the line began to be in the one that it is in, samples.
    told: EarState,
    since: f64,
}

impl SoundReader {
    /// A line of so many samples a second; the first of the films is that of the show.
    pub(crate) fn new(
        samples_per_s: u32,
        latency: Duration,
        begin: ShowTime,
        films: Arc<[SoundIndex]>,
    ) -> Self {
        Self {
            ear: SoundEar::new(Arc::clone(&films), samples_per_s),
            films,
            samples: SampleClock::new(samples_per_s),
            samples_per_s: samples_per_s.into(),
            count: 0.0,
            latency,
            begin,
            power: 0.0,
            block: Vec::new(),
            told: EarState::Unknown,
            since: 0.0,
        }
    }

    /// How loud the line is, of full scale.
    pub(crate) fn level(&self) -> f64 {
        self.power.sqrt()
    }

    /// Takes a block that was read at an instant.
    pub(crate) fn hear(&mut self, block: &[i16], at: MonoTime, out: &mut impl FnMut(Observation)) {
        if block.is_empty() {
            return;
        }
        let count = block.len() as f64;
        self.count += count;
        self.samples.note(self.count, at);
        self.block.clear();
        self.block.extend(block.iter().map(|sample| f32::from(*sample) / 32_768.0));
        let power = self.block.iter().map(|sample| f64::from(sample * sample)).sum::<f64>() / count;
        self.power += (power - self.power) * (1.0 - LOUDNESS_KEPT.powf(count / self.samples_per_s));
        let Self { ear, samples, samples_per_s, latency, begin, .. } = self;
        ear.hear(&self.block, &mut |place: HeardPlace| {
            // Another film leads nobody.
            let Some(read) = samples.time_of(place.line_s * *samples_per_s).filter(|_| place.film == 0)
            else {
                return;
            };
            let media = ShowTime::from_secs_f64(place.media_s).since(*begin);
            let at = read.before(*latency);
            out(Observation { at, bound: BOUND, word: FilmWord::Position(media) });
        });
        self.tell_state(at, out);
    }

    /// Says once what the line carries instead of the film.
    fn tell_state(&mut self, now: MonoTime, out: &mut impl FnMut(Observation)) {
        let state = self.ear.state();
        if state == self.told {
            return;
        }
        (self.told, self.since) = (state, self.count);
        let word = match state {
            EarState::Silent => FilmWord::Silence,
            // As much as is to be heard of a film that runs; but it may have been stopped here.
            EarState::Quiet => FilmWord::Dirt,
            EarState::Film(film) if film > 0 => FilmWord::Gone,
            EarState::Film(_) | EarState::Unknown | EarState::Ambiguous(_) => return,
        };
        out(Observation::new(now, word));
    }

    /// The film that is heard.
    pub(crate) fn film(&self) -> Option<&str> {
        match self.told {
            EarState::Film(film) => self.films.get(film).map(|film| film.name.as_str()),
            _ => None,
        }
    }

    /// Why what is heard leads nobody, for a person.
    pub(crate) fn refused(&self) -> Option<String> {
        let name = |film: usize| self.films.get(film).map_or("", |film| film.name.as_str());
        match self.told {
            EarState::Film(film) if film > 0 => {
                Some(format!("{} is playing, but the film of the show is {}", name(film), name(0)))
            }
            EarState::Ambiguous(count) => Some(format!(
                "this passage is in the films {count} times or more; the sound that follows will decide which it is"
            )),
            EarState::Unknown if self.count - self.since > STRANGE_S * self.samples_per_s => Some(
                "this sound is in none of the given indexes; check that they are of this film".to_owned(),
            ),
            _ => None,
        }
    }
}
