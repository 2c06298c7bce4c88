//! The index of a film's sound, and how it is made.

use std::ops::RangeInclusive;

use super::kernel::Resampler;
use super::landmarks::{Density, Landmark, LandmarkStream, SOUND_RATE};
use super::trace::{PackedTrace, TRACE_RATE, TraceStream};

// What would fold onto the lines that are looked at, from 4,500 Hz on, comes through 45 dB softer.
/// What passes into the sound that all is made of, Hz.
const PASSES: f64 = 3_600.0;

/// A film by its sound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SoundIndex {
    /// How people call it.
    pub(crate) name: String,
    /// By hash.
    pub(crate) landmarks: Vec<Landmark>,
    pub(crate) trace: PackedTrace,
}

impl SoundIndex {
    /// How long the film is, seconds.
    pub(crate) fn seconds(&self) -> f64 {
        self.trace.len() as f64 / TRACE_RATE
    }

    /// Landmarks of these hashes, and where they stand.
    pub(crate) fn with_hashes(&self, hashes: RangeInclusive<u32>) -> impl Iterator<Item = (u32, u32)> {
        let from = self.landmarks.partition_point(|mark| mark.hash < *hashes.start());
        self.landmarks[from..]
            .iter()
            .take_while(move |mark| mark.hash <= *hashes.end())
            .map(|mark| (mark.hash, mark.frame))
    }
}

/// Sound at any rate into that of which indexes are made, at a speed at which it is thought to play.
pub(crate) fn to_sound(samples_per_s: u32, speed: f64) -> Resampler {
    let rate = f64::from(samples_per_s);
    Resampler::new(rate / f64::from(SOUND_RATE) / speed, (PASSES / (rate / 2.0)).min(0.95))
}

/// Makes an index of the sound of a film, block by block.
pub(crate) struct IndexMaker {
    samples_per_s: u32,
    count: usize,
    resampler: Resampler,
    landmarks: LandmarkStream,
    trace: TraceStream,
    sound: Vec<f32>,
    unpacked: Vec<f32>,
    found: Vec<Landmark>,
    packed: PackedTrace,
}

impl IndexMaker {
    pub(crate) fn new(samples_per_s: u32) -> Self {
        Self {
            samples_per_s,
            count: 0,
            resampler: to_sound(samples_per_s, 1.0),
            landmarks: LandmarkStream::new(Density::INDEX),
            trace: TraceStream::new(),
            sound: Vec::new(),
            unpacked: Vec::new(),
            found: Vec::new(),
            packed: PackedTrace::default(),
        }
    }

    /// Takes samples, of full scale 1.
    pub(crate) fn push(&mut self, samples: &[f32]) {
        self.count += samples.len();
        self.sound.clear();
        self.resampler.push(samples, &mut self.sound);
        self.landmarks.push(&self.sound, &mut self.found);
        self.trace.push(&self.sound, &mut self.unpacked);
        self.packed.pack(&mut self.unpacked);
    }

    /// The index of all that came.
    pub(crate) fn finish(mut self, name: &str) -> SoundIndex {
        let seconds = self.count as f64 / f64::from(self.samples_per_s);
        self.push(&vec![0.0; self.samples_per_s as usize / 2]); // what is still on its way through the filters
        self.packed.cut((seconds * TRACE_RATE) as usize);
        // By hash, so that a landmark is looked up by halving.
        self.found.sort_unstable();
        self.found.dedup();
        SoundIndex { name: name.to_owned(), landmarks: self.found, trace: self.packed }
    }
}
