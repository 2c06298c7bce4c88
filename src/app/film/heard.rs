//! What a line carries, by whoever listens to it: timecode, or a film's own sound.

use std::sync::Arc;

use super::told::SourceNotes;
use crate::film::ltc::LtcReader;
use crate::film::observation::Observation;
use crate::film::sound::{SoundIndex, SoundReader};
use crate::film::source::FilmArgs;
use crate::time::MonoTime;

/// What a line is listened to for.
#[derive(Debug, Clone)]
pub(super) enum Listening {
    Ltc,
    /// The show's film, and others that are to be told from it.
    Sound(Arc<[SoundIndex]>),
}

/// Whoever listens.
pub(super) enum Listener {
    Ltc(Box<LtcReader>),
    Sound(Box<SoundReader>),
}

impl Listening {
    /// Somebody who listens to so many samples a second.
    pub(super) fn begin(&self, samples_per_s: u32, args: &FilmArgs) -> Listener {
        let FilmArgs { rate, start, latency, .. } = *args;
        match self {
            Self::Ltc => Listener::Ltc(Box::new(LtcReader::new(samples_per_s, latency, rate, start))),
            Self::Sound(films) => {
                let films = Arc::clone(films);
                Listener::Sound(Box::new(SoundReader::new(samples_per_s, latency, args.begin(), films)))
            }
        }
    }
}

impl Listener {
    pub(super) fn hear(&mut self, block: &[i16], at: MonoTime, mut out: impl FnMut(Observation)) {
        match self {
            Self::Ltc(reader) => reader.hear(block, at, &mut out),
            Self::Sound(reader) => reader.hear(block, at, &mut out),
        }
    }

    /// What a person should know of it.
    pub(super) fn note(&self, notes: &mut SourceNotes) {
        let level = match self {
            Self::Ltc(reader) => {
                notes.label(reader.labels());
                f64::from(reader.level())
            }
            Self::Sound(reader) => {
                notes.refused = reader.refused();
                notes.film = reader.film().map(str::to_owned);
                reader.level()
            }
        };
        notes.level_db = Some(20.0 * level.max(1e-6).log10());
    }
}
