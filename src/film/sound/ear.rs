//! What a line plays: which of some films, and where in it.

use std::sync::Arc;

use super::correlate::PIECE;
use super::finder::Finder;
use super::hold::{Comparer, FilmPlace, Holder, LineTrace};
use super::index::{SoundIndex, to_sound};
use super::kernel::Resampler;
use super::trace::{TRACE_RATE, TraceStream};

/// A place is heard so often, samples of the trace: ten times a second.
const HOLD_EVERY: usize = 160;
/// While none is held, one is looked for so often: four times a second.
const FIND_EVERY: usize = 400;
/// What was heard before a place was proved is gone through as well, for so long: a chase has not to wait for as many again.
const BACK: usize = 8 * HOLD_EVERY;
/// A place is proved from there on. By chance 1,000 passages of other films came to 9.3.
pub(crate) const PROOF_Z: f64 = 12.0;
/// Two that are proved almost as well are two: nobody knows which.
const ALIKE: f64 = 0.7;
/// Places nearer than that are one, samples of the trace.
const SAME: f64 = 80.0;
/// A hold is in doubt after so many pieces in a row, and over after so many: 0.5 and 10 s.
const DOUBT: u32 = 5;
const OVER: u32 = 100;
/// Below that nothing is heard, decibels of full scale, for so many samples of the sound: 0.2 s.
const SILENCE_DB: f64 = -70.0;
const SILENT_SAMPLES: usize = 1_600;

/// A film is quiet where its trace is below that, for so many samples of it: 0.2 s.
const QUIET_DB: f64 = -66.0;
const QUIET_SAMPLES: i64 = 320;

/// What is made of a line at present.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EarState {
    /// It carries nothing.
    Silent,
    /// It carries nothing, and neither does the film here.
    Quiet,
    /// It carries what no film has, or not enough of it yet.
    Unknown,
    /// It carries what is in the films more than once, at so many places.
    Ambiguous(usize),
    /// It carries that film.
    Film(usize),
}

/// A place that was heard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeardPlace {
    pub(crate) film: usize,
    /// When, seconds of the line from its first sample on.
    pub(crate) line_s: f64,
    /// Where the film was, seconds.
    pub(crate) media_s: f64,
    /// How sure that is, deviations.
    pub(crate) z: f64,
}

/// Listens to one line.
pub(crate) struct SoundEar {
    films: Arc<[SoundIndex]>,
    resampler: Resampler,
    stream: TraceStream,
    line: LineTrace,
    finder: Finder,
    compare: Comparer,
    holder: Option<Holder>,
    sound: Vec<f32>,
    next_hold: usize,
    next_find: usize,
    /// Samples of the sound without any since something was heard.
    silent: usize,
    state: EarState,
}

impl SoundEar {
    pub(crate) fn new(films: Arc<[SoundIndex]>, samples_per_s: u32) -> Self {
        Self {
            resampler: to_sound(samples_per_s, 1.0),
            stream: TraceStream::new(),
            line: LineTrace::default(),
            finder: Finder::new(samples_per_s, films.len()),
            compare: Comparer::new(),
            holder: None,
            sound: Vec::new(),
            next_hold: 0,
            next_find: 0,
            silent: SILENT_SAMPLES,
            state: EarState::Silent,
            films,
        }
    }

    pub(crate) const fn state(&self) -> EarState {
        self.state
    }

    /// Takes a block of samples; tells of the places that were heard in it.
    pub(crate) fn hear(&mut self, block: &[f32], out: &mut impl FnMut(HeardPlace)) {
        self.finder.push(block, &self.films);
        self.sound.clear();
        self.resampler.push(block, &mut self.sound);
        self.mind_silence();
        self.stream.push(&self.sound, self.line.samples());
        self.hold(out);
        if self.line.count() >= self.next_find {
            self.next_find = self.line.count() + FIND_EVERY;
            self.look();
        }
        self.line.trim();
    }

    fn mind_silence(&mut self) {
        if self.sound.is_empty() {
            return;
        }
        let power =
            self.sound.iter().map(|sample| f64::from(sample * sample)).sum::<f64>() / self.sound.len() as f64;
        self.silent = if 10.0 * power.log10() < SILENCE_DB { self.silent + self.sound.len() } else { 0 };
    }

    /// Holds on, as far as there is sound.
    fn hold(&mut self, out: &mut impl FnMut(HeardPlace)) {
        let half = PIECE / 2;
        while let Some(holder) = &mut self.holder
            && self.next_hold + half <= self.line.count()
        {
            let heard = holder.hold(&mut self.compare, &self.line, &self.films, self.next_hold);
            // A piece that ends in silence says where the film was, and not that it runs on.
            if let Some(place) = heard.filter(|_| self.silent < SILENT_SAMPLES) {
                // Told for the end of the piece: a source that is asked where the film was would seem to be silent.
                let at = place.at + half as f64;
                out(HeardPlace {
                    film: place.film,
                    line_s: at / TRACE_RATE,
                    media_s: place.media_at(at) / TRACE_RATE,
                    z: place.z,
                });
            }
            self.next_hold += HOLD_EVERY;
            if holder.misses() >= OVER {
                self.holder = None;
            }
        }
    }

    /// Looks for the place unless one is held.
    fn look(&mut self) {
        if self.silent >= SILENT_SAMPLES {
            // Where a film that was cut off would be quiet by now says nothing.
            if self.state != EarState::Silent {
                self.state = if self.film_is_quiet() { EarState::Quiet } else { EarState::Silent };
            }
            return;
        }
        if let Some(holder) = self.holder.as_ref().filter(|holder| holder.misses() < DOUBT) {
            self.state = EarState::Film(holder.film());
            return;
        }
        let places = self.proved();
        self.state = match places.as_slice() {
            [] => EarState::Unknown,
            [one] => {
                self.holder = Some(Holder::new(*one));
                self.next_hold = (one.at as usize).saturating_sub(BACK);
                EarState::Film(one.film)
            }
            // The clock that there was goes on where it is among them.
            several => EarState::Ambiguous(several.len()),
        };
    }

    /// True if the film that is held has no sound where it is thought to be.
    fn film_is_quiet(&self) -> bool {
        // In the index alone: on the line a film that was turned down and one that is quiet look alike.
        self.holder.as_ref().is_some_and(|holder| {
            let now = holder.place().media_at(self.line.count() as f64);
            let film = &self.films[holder.film()];
            10.0 * film.trace.power(now as i64 - QUIET_SAMPLES..now as i64).log10() < QUIET_DB
        })
    }

    /// The places that are proved, none of them much better than another.
    fn proved(&mut self) -> Vec<FilmPlace> {
        let proposals = self.finder.proposals();
        let mut places: Vec<FilmPlace> = Vec::new();
        for proposal in &proposals {
            let Some(place) = self.compare.judge(&self.line, &self.films, proposal) else { continue };
            let is_same =
                |other: &FilmPlace| other.film == place.film && (other.media - place.media).abs() < SAME;
            if place.z >= PROOF_Z && !places.iter().any(is_same) {
                places.push(place);
            }
        }
        places.sort_by(|one, other| other.z.total_cmp(&one.z));
        let least = places.first().map_or(0.0, |best| best.z * ALIKE);
        places.retain(|place| place.z >= least);
        places
    }
}
