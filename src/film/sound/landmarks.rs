//! Landmarks of a sound: pairs of peaks of its spectrum, which stay where they are whatever is done to level and tone.

use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{RealFftPlanner, RealToComplex};

/// Samples a second of the sound that landmarks are of.
pub(crate) const SOUND_RATE: u32 = 8_000;
/// Samples of a spectrum, and from one to the next: 128 and 32 ms.
const SIZE: usize = 1_024;
pub(crate) const HOP: usize = 256;
/// Spectral lines that are looked at: 200 to 3,500 Hz.
const LINES: std::ops::Range<usize> = 26..448;
/// What is below that is no peak, decibels of full scale.
const FLOOR_DB: f32 = -78.0;
/// The second peak of a pair comes so many spectra after the first, and at most so many lines beside it.
const AHEAD: std::ops::Range<u32> = 2..44;
const BESIDE: u32 = 110;

/// A pair of peaks, and when the first of them is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Landmark {
    /// Both lines and the spectra from one to the other, 24 bits.
    pub(crate) hash: u32,
    /// The spectrum of the first.
    pub(crate) frame: u32,
}

/// How many peaks are looked for, and how many pairs each begins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Density {
    /// A peak is the highest of so many lines and spectra to either side.
    lines: usize,
    frames: usize,
    pairs: usize,
}

impl Density {
    /// Of an index: few that are likely to be found again.
    pub(crate) const INDEX: Self = Self { lines: 22, frames: 7, pairs: 3 };
    /// Of a line: more, so that those of the index are among them where something else is heard over it.
    pub(crate) const LINE: Self = Self { lines: 8, frames: 3, pairs: 28 };
}

#[derive(Debug, Clone, Copy)]
struct Peak {
    frame: u32,
    line: u32,
}

/// Finds landmarks in a stream of sound.
pub(crate) struct LandmarkStream {
    density: Density,
    transform: Arc<dyn RealToComplex<f32>>,
    window: Vec<f32>,
    kept: Vec<f32>,
    windowed: Vec<f32>,
    spectrum: Vec<Complex<f32>>,
    scratch: Vec<Complex<f32>>,
    /// The newest spectra, decibels, and the number of the newest.
    levels: VecDeque<Vec<f32>>,
    frames: u32,
    peaks: VecDeque<Peak>,
}

impl LandmarkStream {
    pub(crate) fn new(density: Density) -> Self {
        let transform = RealFftPlanner::new().plan_fft_forward(SIZE);
        let turn = std::f32::consts::TAU / SIZE as f32;
        Self {
            density,
            window: (0..SIZE).map(|n| 0.5 - 0.5 * (turn * n as f32).cos()).collect(),
            kept: Vec::new(),
            windowed: transform.make_input_vec(),
            spectrum: transform.make_output_vec(),
            scratch: transform.make_scratch_vec(),
            transform,
            levels: VecDeque::new(),
            frames: 0,
            peaks: VecDeque::new(),
        }
    }

    /// Spectra so far.
    pub(crate) const fn frames(&self) -> u32 {
        self.frames
    }

    /// Takes sound; adds to `out` the landmarks that are complete.
    pub(crate) fn push(&mut self, sound: &[f32], out: &mut Vec<Landmark>) {
        self.kept.extend_from_slice(sound);
        let mut at = 0;
        while at + SIZE <= self.kept.len() {
            self.analyse(at);
            self.find_peaks(out);
            at += HOP;
        }
        self.kept.drain(..at);
    }

    fn analyse(&mut self, at: usize) {
        let sound = &self.kept[at..at + SIZE];
        for ((to, sample), weight) in self.windowed.iter_mut().zip(sound).zip(&self.window) {
            *to = sample * weight;
        }
        self.transform
            .process_with_scratch(&mut self.windowed, &mut self.spectrum, &mut self.scratch)
            .expect("all lengths are the transform's own");
        let most = 2 * self.density.frames + 1;
        let mut levels =
            if self.levels.len() == most { self.levels.pop_front().unwrap_or_default() } else { Vec::new() };
        levels.clear();
        // A sine of full scale has a line of SIZE / 4 through this window.
        let full = (SIZE * SIZE) as f32 / 16.0;
        levels.extend(self.spectrum.iter().map(|line| 10.0 * (line.norm_sqr() / full).max(1e-12).log10()));
        self.levels.push_back(levels);
        self.frames += 1;
    }

    /// Looks for peaks in the spectrum in the middle of those that are kept.
    fn find_peaks(&mut self, out: &mut Vec<Landmark>) {
        if self.levels.len() < 2 * self.density.frames + 1 {
            return;
        }
        let frame = self.frames - 1 - self.density.frames as u32;
        for line in LINES {
            if self.is_peak(line) {
                self.pair(Peak { frame, line: line as u32 }, out);
            }
        }
        while self.peaks.front().is_some_and(|peak| peak.frame + AHEAD.end < frame) {
            self.peaks.pop_front();
        }
    }

    fn is_peak(&self, line: usize) -> bool {
        // Most lines are none by their neighbours alone, which costs a hundredth of the whole look around.
        let middle = &self.levels[self.density.frames];
        let level = middle[line];
        if level < FLOOR_DB || middle[line - 1] >= level || middle[line + 1] >= level {
            return false;
        }
        let near = line.saturating_sub(self.density.lines)..(line + self.density.lines + 1).min(SIZE / 2);
        self.levels.iter().all(|levels| levels[near.clone()].iter().all(|other| *other <= level))
    }

    /// Pairs a peak with those before it that have not had enough.
    fn pair(&mut self, second: Peak, out: &mut Vec<Landmark>) {
        let fits = |first: &&Peak| {
            AHEAD.contains(&(second.frame - first.frame)) && first.line.abs_diff(second.line) <= BESIDE
        };
        // The latest are nearest, and most likely the same when noise has put others between.
        for first in self.peaks.iter().rev().filter(fits).take(self.density.pairs) {
            let hash = hash(first.line, second.line, second.frame - first.frame);
            out.push(Landmark { hash, frame: first.frame });
        }
        self.peaks.push_back(second);
    }
}

fn hash(first: u32, second: u32, apart: u32) -> u32 {
    first << 15 | second << 6 | apart
}

/// Both lines and the spectra between them.
pub(crate) const fn parts(hash: u32) -> [u32; 3] {
    [hash >> 15, hash >> 6 & 0x1ff, hash & 0x3f]
}

/// The hashes of pairs whose peaks were found up to one line or spectrum beside where they are.
pub(crate) fn alike(of: u32) -> impl Iterator<Item = RangeInclusive<u32>> {
    let [first, second, apart] = parts(of);
    (0..9).map(move |n| {
        let middle = hash(first + n % 3 - 1, second + n / 3 - 1, apart);
        middle - 1..=middle + 1
    })
}
