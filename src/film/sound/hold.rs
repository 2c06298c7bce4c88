//! The traces decide: if a film is where landmarks propose it, and from then on where it is, to a fraction of a millisecond.

use super::correlate::{BestLag, Correlator, Fit, PIECE, WIDTH, add_moved, best, z_at};
use super::finder::Proposal;
use super::index::SoundIndex;
use super::trace::{TRACE_RATE, TraceReader};

/// What of the line's trace is kept, samples: 8 s.
const KEPT: usize = 12_800;
/// Pieces that are looked at for a proof, how far apart they are, and how many there have to be.
const PIECES: usize = 12;
const APART: usize = 512;
const LEAST_PIECES: usize = 4;
/// What stands out by less after those is no place: of a film by 8 and more, of chance by 4 or 5.
const GLANCE_Z: f64 = 5.5;
/// How much faster or slower a copy may run that is thought to run at a speed.
const SLOPE: f64 = 2.5e-4;
// Six to either side: 0.15 %, a pull-down and half of one.
const SLOPES: usize = 13;
/// A piece holds from there on.
const HOLD_Z: f64 = 7.0;
/// What of the fits before counts with that of a piece, and how far a piece has to agree by itself.
const REMEMBERED: f32 = 0.7;
const AGREES_Z: f64 = 2.5;
/// Shares of what a piece is off that go into place and speed.
const PLACE_SHARE: f64 = 0.25;
const SPEED_SHARE: f64 = 0.03;
/// How far the speed of a hold goes from that which was proved.
const STRAYS: f64 = 0.003;
/// What is off by more was cut: its speed says nothing.
const CUT: f64 = 4.0;

/// The newest of the trace of a line.
#[derive(Debug, Clone, Default)]
pub(crate) struct LineTrace {
    samples: Vec<f32>,
    /// The number of the first that is kept.
    first: usize,
}

impl LineTrace {
    /// Where new samples go; [`Self::trim`] comes after.
    pub(crate) fn samples(&mut self) -> &mut Vec<f32> {
        &mut self.samples
    }

    pub(crate) fn trim(&mut self) {
        if self.samples.len() > 2 * KEPT {
            let old = self.samples.len() - KEPT;
            self.samples.drain(..old);
            self.first += old;
        }
    }

    /// Samples so far.
    pub(crate) const fn count(&self) -> usize {
        self.first + self.samples.len()
    }

    /// The piece around a sample.
    fn piece(&self, middle: usize) -> Option<&[f32]> {
        let from = (middle.checked_sub(PIECE / 2)?).checked_sub(self.first)?;
        self.samples.get(from..from + PIECE)
    }
}

/// Where a film was at a sample of the line's trace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FilmPlace {
    pub(crate) film: usize,
    /// Samples of the line's trace.
    pub(crate) at: f64,
    /// Samples of the film's.
    pub(crate) media: f64,
    /// How many of these pass in one of the line.
    pub(crate) speed: f64,
    /// How sure that is, deviations.
    pub(crate) z: f64,
}

impl FilmPlace {
    /// Where the film is later, samples of its trace.
    pub(crate) fn media_at(&self, at: f64) -> f64 {
        self.media + self.speed * (at - self.at)
    }
}

/// Holds pieces of a line against films.
pub(crate) struct Comparer {
    correlator: Correlator,
    reader: TraceReader,
    expected: Vec<f32>,
}

impl Comparer {
    pub(crate) fn new() -> Self {
        Self { correlator: Correlator::new(), reader: TraceReader::new(), expected: vec![0.0; PIECE] }
    }

    /// How the piece around a sample fits the film where it is thought to be.
    fn fit(
        &mut self,
        line: &LineTrace,
        film: &SoundIndex,
        thought: &FilmPlace,
        middle: usize,
    ) -> Option<Fit> {
        let from = thought.media_at((middle - PIECE / 2) as f64);
        self.reader.read(&film.trace, from, thought.speed, &mut self.expected);
        Some(self.correlator.fit(line.piece(middle)?, &self.expected))
    }

    /// How well the last seconds fit a proposal: the best place near it.
    pub(crate) fn judge(
        &mut self,
        line: &LineTrace,
        films: &[SoundIndex],
        proposed: &Proposal,
    ) -> Option<FilmPlace> {
        // A pull-down apart, the pieces of four seconds would smear what they have in common: each speed near has a sum of its own.
        let newest = line.count().checked_sub(PIECE / 2)?;
        let media = proposed.begin_s * TRACE_RATE + proposed.speed * newest as f64;
        let thought =
            FilmPlace { film: proposed.film, at: newest as f64, media, speed: proposed.speed, z: 0.0 };
        let (mut sums, mut pieces) = ([[0.0; WIDTH]; SLOPES], 0);
        for piece in 0..PIECES {
            let Some(middle) = newest.checked_sub(piece * APART).filter(|middle| *middle >= PIECE / 2) else {
                break;
            };
            let Some(fit) = self.fit(line, &films[proposed.film], &thought, middle) else { break };
            pieces += 1;
            for (n, sum) in sums.iter_mut().enumerate() {
                add_moved(sum, &fit, slope(n) * (newest - middle) as f64);
            }
            // Most proposals are chance, and that is seen soon.
            if pieces == LEAST_PIECES && best_slope(&sums)?.0.z < GLANCE_Z {
                return None;
            }
        }
        if pieces < LEAST_PIECES {
            return None;
        }
        let (BestLag { lag, z }, slope) = best_slope(&sums)?;
        let speed = thought.speed * (1.0 + slope);
        Some(FilmPlace { media: thought.media - lag * thought.speed, speed, z, ..thought })
    }
}

/// How much faster a copy runs that is thought to, by the number of its slope.
fn slope(n: usize) -> f64 {
    (n as f64 - (SLOPES / 2) as f64) * SLOPE
}

/// The best lag of the sums of each slope, and that slope.
fn best_slope(sums: &[Fit; SLOPES]) -> Option<(BestLag, f64)> {
    let bests = sums.iter().enumerate().filter_map(|(n, sum)| Some((best(sum)?, slope(n))));
    bests.max_by(|one, other| one.0.z.total_cmp(&other.0.z))
}

/// Holds on to a place.
#[derive(Debug, Clone)]
pub(crate) struct Holder {
    place: FilmPlace,
    /// The speed that was proved, from which that of the hold does not go far.
    proved: f64,
    /// The fits of the last pieces, the newest with the most weight.
    fits: Fit,
    /// Pieces in a row that did not fit.
    misses: u32,
}

impl Holder {
    pub(crate) const fn new(place: FilmPlace) -> Self {
        Self { place, proved: place.speed, fits: [0.0; WIDTH], misses: 0 }
    }

    pub(crate) const fn film(&self) -> usize {
        self.place.film
    }

    pub(crate) const fn misses(&self) -> u32 {
        self.misses
    }

    /// Where the film is thought to be at a sample of the line's trace.
    pub(crate) const fn place(&self) -> &FilmPlace {
        &self.place
    }

    /// Listens to the piece around a sample; where the film was then, if it fits.
    pub(crate) fn hold(
        &mut self,
        compare: &mut Comparer,
        line: &LineTrace,
        films: &[SoundIndex],
        middle: usize,
    ) -> Option<FilmPlace> {
        let at = middle as f64;
        let fit = compare.fit(line, &films[self.place.film], &self.place, middle)?;
        let passed = at - self.place.at;
        // Whether it fits or not: a place that is held goes on through what cannot be heard.
        (self.place.media, self.place.at) = (self.place.media_at(at), at);
        for (sum, one) in self.fits.iter_mut().zip(&fit) {
            *sum = REMEMBERED * *sum + one;
        }
        let agrees = |found: &BestLag| found.z >= HOLD_Z && z_at(&fit, found.lag) >= AGREES_Z;
        let Some(found) = best(&self.fits).filter(agrees) else {
            self.misses += 1;
            return None;
        };
        self.misses = 0;
        let off = -found.lag * self.place.speed;
        let heard = FilmPlace { media: self.place.media + off, z: found.z, ..self.place };
        if found.lag.abs() > CUT {
            self.place.media = heard.media;
            self.fits = [0.0; WIDTH];
        } else {
            self.place.media += PLACE_SHARE * off;
            // The first piece lies before the proof, and says nothing of the speed.
            // Slowly: pieces overlap by five sixths, so that an error comes six times.
            let speed = self.place.speed + if passed > 0.0 { SPEED_SHARE * off / passed } else { 0.0 };
            self.place.speed = speed.clamp(self.proved * (1.0 - STRAYS), self.proved * (1.0 + STRAYS));
        }
        Some(heard)
    }
}
