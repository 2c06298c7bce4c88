//! Where a sound may be in a film: places that many landmarks of the last seconds agree on. They are proposals, no more: the traces
//! decide.

use std::collections::VecDeque;

use super::index::{SoundIndex, to_sound};
use super::kernel::Resampler;
use super::landmarks::{Density, HOP, Landmark, LandmarkStream, SOUND_RATE, alike, parts};

/// Speeds at which films are played: their own, and that of 24 frames a second shown at 25 and back.
const SPEEDS: [f64; 3] = [1.0, 25.0 / 24.0, 24.0 / 25.0];
/// Landmarks of so many spectra back are counted: 6 s.
const BACK: u32 = 190;
/// Landmarks that have to agree, and places that are proposed at the most.
const LEAST_VOTES: u32 = 2;
const MOST_PLACES: usize = 40;
/// What a landmark that is exactly the film's, and only there, says for its place; each number of it that is one beside costs one, and each
/// time e that the film has more like it. Two hours have thousands of places by chance: these come last.
const WEIGHT: f32 = 6.0;
const LEAST_WEIGHT: f32 = 0.1;
/// A landmark that a film has more often says where it is not; and no more are kept at once.
const MOST_ALIKE: usize = 48;
const MOST_HITS: usize = 65_536;
/// Seconds from one spectrum to the next.
const FRAME_S: f64 = HOP as f64 / SOUND_RATE as f64;

/// Where a film may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Proposal {
    pub(crate) film: usize,
    pub(crate) speed: f64,
    /// Where it was, at that speed, when the first sample was heard, seconds.
    pub(crate) begin_s: f64,
    /// By the weight of each.
    pub(crate) votes: f32,
}

/// A landmark that was heard, and that a film has.
#[derive(Debug, Clone, Copy)]
struct Hit {
    heard: u32,
    /// Spectra of the film before the first that was heard.
    begin: i64,
    /// How much it says for that.
    weight: f32,
}

/// Listens at one speed.
struct SpeedListener {
    speed: f64,
    resampler: Resampler,
    landmarks: LandmarkStream,
    /// Of each film.
    hits: Vec<VecDeque<Hit>>,
    /// What one film has like a landmark: hashes, and where they stand.
    alike: Vec<(u32, u32)>,
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
            alike: Vec::new(),
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
        // Chance makes places of some votes at any time: the best come first, and the traces sort out the rest.
        all.sort_by(|one, other| other.votes.total_cmp(&one.votes));
        all.truncate(MOST_PLACES);
        all
    }
}

impl SpeedListener {
    fn look_up(&mut self, found: &[Landmark], films: &[SoundIndex]) {
        let oldest = self.landmarks.frames().saturating_sub(BACK);
        for (film, hits) in films.iter().zip(&mut self.hits) {
            for mark in found {
                self.alike.clear();
                for hashes in alike(mark.hash) {
                    self.alike.extend(film.with_hashes(hashes).take(MOST_ALIKE));
                }
                let hit = |(hash, frame): &(u32, u32)| Hit {
                    heard: mark.frame,
                    begin: i64::from(*frame) - i64::from(mark.frame),
                    weight: weight(*hash, mark.hash, self.alike.len()),
                };
                hits.extend(self.alike.iter().map(hit));
            }
            while hits.front().is_some_and(|hit| hit.heard < oldest) || hits.len() > MOST_HITS {
                hits.pop_front();
            }
        }
    }

    fn proposals(&self) -> Vec<Proposal> {
        let of = |(film, hits): (usize, &VecDeque<Hit>)| {
            let mut begins: Vec<(i64, u32, f32)> =
                hits.iter().map(|hit| (hit.begin, hit.heard, hit.weight)).collect();
            begins.sort_unstable_by_key(|one| (one.0, one.1));
            // A peak beside another gives the same pair twice, and has one vote.
            begins.dedup_by(|later, one| {
                let is_same = (later.0, later.1) == (one.0, one.1);
                one.2 = if is_same { one.2.max(later.2) } else { one.2 };
                is_same
            });
            let propose = move |(begin, votes): (f64, f32)| Proposal {
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

/// What a landmark says for a place: more, the nearer it is to that of the film, and the fewer of the kind the film has.
fn weight(found: u32, wanted: u32, alike: usize) -> f32 {
    let differs = |part: fn([u32; 3]) -> u32| f32::from(u8::from(part(parts(found)) != part(parts(wanted))));
    let off = differs(|[first, ..]| first) + differs(|[_, second, _]| second) + differs(|[.., apart]| apart);
    (WEIGHT - off - (alike.max(1) as f32).ln()).max(LEAST_WEIGHT)
}

/// Places of many votes, each of three neighbours: what is heard lies between the spectra of the film.
fn peaks(begins: &[(i64, u32, f32)]) -> Vec<(f64, f32)> {
    let mut tops: Vec<(f64, f32)> = Vec::new();
    let mut last = 0;
    for (at, first) in begins.iter().enumerate() {
        let near = begins[at..].iter().take_while(|one| one.0 <= first.0 + 1);
        let (n, sum, votes) =
            near.fold((0, 0, 0.0), |(n, sum, votes), one| (n + 1, sum + one.0, votes + one.2));
        if n < LEAST_VOTES {
            continue;
        }
        let mean = sum as f64 / f64::from(n);
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
    tops.sort_by(|one, other| other.1.total_cmp(&one.1));
    tops.truncate(MOST_PLACES);
    tops
}
