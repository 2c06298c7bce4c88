//! Where a sound may be in a film: places that many landmarks of the last seconds agree on. They are proposals, no more: the traces
//! decide.

use std::collections::VecDeque;

use super::index::{SoundIndex, to_sound};
use super::kernel::Resampler;
use super::landmarks::{Density, HOP, Landmark, LandmarkStream, SOUND_RATE, alike};

/// Speeds at which films are played: their own, and that of 24 frames a second shown at 25 and back.
const SPEEDS: [f64; 3] = [1.0, 25.0 / 24.0, 24.0 / 25.0];
/// Landmarks of so many spectra back are counted: 6 s.
const BACK: u32 = 190;
/// Landmarks that have to agree, and places that are proposed at the most.
const LEAST_VOTES: u32 = 3;
const MOST_PLACES: usize = 12;
/// A landmark that a film has more often says where it is not; and no more are kept at once.
const MOST_ALIKE: usize = 48;
const MOST_HITS: usize = 16_384;
/// Seconds from one spectrum to the next.
const FRAME_S: f64 = HOP as f64 / SOUND_RATE as f64;

/// Where a film may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Proposal {
    pub(crate) film: usize,
    pub(crate) speed: f64,
    /// Where it was, at that speed, when the first sample was heard, seconds.
    pub(crate) begin_s: f64,
    pub(crate) votes: u32,
}

/// A landmark that was heard, and that a film has.
#[derive(Debug, Clone, Copy)]
struct Hit {
    heard: u32,
    /// Spectra of the film before the first that was heard.
    begin: i64,
}

/// Listens at one speed.
struct SpeedListener {
    speed: f64,
    resampler: Resampler,
    landmarks: LandmarkStream,
    /// Of each film.
    hits: Vec<VecDeque<Hit>>,
}

/// Proposes places in films.
pub(crate) struct Finder {
    listeners: Vec<SpeedListener>,
    sound: Vec<f32>,
    found: Vec<Landmark>,
}

impl Finder {
    pub(crate) fn new(samples_per_s: u32, films: usize) -> Self {
        let listener = |speed| SpeedListener {
            speed,
            resampler: to_sound(samples_per_s, speed),
            landmarks: LandmarkStream::new(Density::LINE),
            hits: vec![VecDeque::new(); films],
        };
        Self { listeners: SPEEDS.map(listener).into(), sound: Vec::new(), found: Vec::new() }
    }

    /// Takes samples as they are heard.
    pub(crate) fn push(&mut self, samples: &[f32], films: &[SoundIndex]) {
        for listener in &mut self.listeners {
            self.sound.clear();
            self.found.clear();
            listener.resampler.push(samples, &mut self.sound);
            listener.landmarks.push(&self.sound, &mut self.found);
            listener.look_up(&self.found, films);
        }
    }

    /// The places that most landmarks agree on, the best first.
    pub(crate) fn proposals(&self) -> Vec<Proposal> {
        let mut all: Vec<Proposal> = self.listeners.iter().flat_map(SpeedListener::proposals).collect();
        // Chance makes places of three and four votes at any time: the best come first, and the traces sort out the rest.
        all.sort_by_key(|one| std::cmp::Reverse(one.votes));
        all.truncate(MOST_PLACES);
        all
    }
}

impl SpeedListener {
    fn look_up(&mut self, found: &[Landmark], films: &[SoundIndex]) {
        let oldest = self.landmarks.frames().saturating_sub(BACK);
        for (film, hits) in films.iter().zip(&mut self.hits) {
            for mark in found {
                let begins = alike(mark.hash).flat_map(|hash| film.with_hashes(hash).take(MOST_ALIKE));
                let hit = |frame| Hit { heard: mark.frame, begin: i64::from(frame) - i64::from(mark.frame) };
                hits.extend(begins.map(hit));
            }
            while hits.front().is_some_and(|hit| hit.heard < oldest) || hits.len() > MOST_HITS {
                hits.pop_front();
            }
        }
    }

    fn proposals(&self) -> Vec<Proposal> {
        let of = |(film, hits): (usize, &VecDeque<Hit>)| {
            let mut begins: Vec<(i64, u32)> = hits.iter().map(|hit| (hit.begin, hit.heard)).collect();
            begins.sort_unstable();
            // A peak beside another gives the same pair twice, and has one vote.
            begins.dedup();
            let propose = move |(begin, votes): (f64, u32)| Proposal {
                film,
                speed: self.speed,
                begin_s: begin * FRAME_S,
                votes,
            };
            peaks(&begins).into_iter().map(propose)
        };
        self.hits.iter().enumerate().flat_map(of).collect()
    }
}

/// Places of many votes, each of three neighbours: what is heard lies between the spectra of the film.
fn peaks(begins: &[(i64, u32)]) -> Vec<(f64, u32)> {
    let mut tops: Vec<(f64, u32)> = Vec::new();
    let mut last = 0;
    for (at, first) in begins.iter().enumerate() {
        let near = begins[at..].iter().take_while(|one| one.0 <= first.0 + 1);
        let (votes, sum) = near.fold((0, 0), |(votes, sum), one| (votes + 1, sum + one.0));
        if votes < LEAST_VOTES {
            continue;
        }
        let mean = sum as f64 / f64::from(votes);
        match tops.last_mut() {
            Some(top) if first.0 - last <= 2 => {
                if votes > top.1 {
                    *top = (mean, votes);
                }
            }
            _ => tops.push((mean, votes)),
        }
        last = first.0;
    }
    tops.sort_by_key(|top| std::cmp::Reverse(top.1));
    tops.truncate(MOST_PLACES);
    tops
}
