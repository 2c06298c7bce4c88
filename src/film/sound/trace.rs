//! The trace of a sound: its lower part, 4 bits a sample, by which a place is held to a fraction of a millisecond.

use super::kernel::{Resampler, SincKernel};
use super::landmarks::SOUND_RATE;

/// Samples a second of a trace.
pub(crate) const TRACE_RATE: f64 = 1_600.0;
/// What of the sound is in it: below 700 Hz.
const CUTOFF: f64 = 700.0 / (SOUND_RATE as f64 / 2.0);
/// Samples that share a scale, and the octets of them all.
const BLOCK: usize = 128;
pub(crate) const BLOCK_OCTETS: usize = BLOCK / 2 + 1;
/// The greatest step of 4 bits.
const MOST: f32 = 7.0;
/// Steps of the scale for each doubling.
const SCALE_STEPS: f32 = 8.0;

/// Makes the trace of a stream of sound, live: each sample is the step from the last, so that what rumbles does not drown the rest.
#[derive(Debug, Clone)]
pub(crate) struct TraceStream {
    down: Resampler,
    last: f32,
    lower: Vec<f32>,
}

impl TraceStream {
    pub(crate) fn new() -> Self {
        Self {
            down: Resampler::new(f64::from(SOUND_RATE) / TRACE_RATE, CUTOFF),
            last: 0.0,
            lower: Vec::new(),
        }
    }

    pub(crate) fn push(&mut self, sound: &[f32], out: &mut Vec<f32>) {
        self.lower.clear();
        self.down.push(sound, &mut self.lower);
        for sample in &self.lower {
            out.push(sample - self.last);
            self.last = *sample;
        }
    }
}

/// A trace that is packed: blocks of a scale and of two samples an octet.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct PackedTrace {
    octets: Vec<u8>,
}

impl PackedTrace {
    /// Of octets as they are kept; what is no whole block is left out.
    pub(crate) fn of(mut octets: Vec<u8>) -> Self {
        octets.truncate(octets.len() / BLOCK_OCTETS * BLOCK_OCTETS);
        Self { octets }
    }

    pub(crate) fn octets(&self) -> &[u8] {
        &self.octets
    }

    /// Samples that there are.
    pub(crate) fn len(&self) -> usize {
        self.octets.len() / BLOCK_OCTETS * BLOCK
    }

    /// Leaves out the blocks after so many samples.
    pub(crate) fn cut(&mut self, samples: usize) {
        self.octets.truncate(samples.div_ceil(BLOCK) * BLOCK_OCTETS);
    }

    /// Packs what is whole of `samples`, and takes it out.
    pub(crate) fn pack(&mut self, samples: &mut Vec<f32>) {
        let whole = samples.len() / BLOCK * BLOCK;
        for block in samples[..whole].chunks_exact(BLOCK) {
            let peak = block.iter().fold(0.0_f32, |peak, sample| peak.max(sample.abs()));
            // By the peak of each block: what is soft has as many steps as what is loud.
            // Rounded up, so that the peak itself is within seven steps and is not cut.
            let scale = ((peak.max(1e-9).log2() * SCALE_STEPS).ceil() + 240.0).clamp(0.0, 255.0);
            self.octets.push(scale as u8);
            let step = step(scale as u8);
            let nibble = |sample: f32| ((sample / step).round().clamp(-MOST, MOST) + 8.0) as u8;
            self.octets.extend(block.chunks_exact(2).map(|two| nibble(two[0]) << 4 | nibble(two[1])));
        }
        samples.drain(..whole);
    }

    /// How loud it is, on the average of some samples.
    pub(crate) fn power(&self, samples: std::ops::Range<i64>) -> f64 {
        let count = samples.clone().count().max(1) as f64;
        samples.map(|at| f64::from(self.sample(at)).powi(2)).sum::<f64>() / count
    }

    /// The sample at a place; silence outside.
    fn sample(&self, at: i64) -> f32 {
        let Ok(at) = usize::try_from(at) else { return 0.0 };
        let block = at / BLOCK * BLOCK_OCTETS;
        let (Some(scale), Some(pair)) = (self.octets.get(block), self.octets.get(block + 1 + at % BLOCK / 2))
        else {
            return 0.0;
        };
        let nibble = if at % 2 == 0 { pair >> 4 } else { pair & 15 };
        (f32::from(nibble) - 8.0) * step(*scale)
    }
}

fn step(scale: u8) -> f32 {
    ((f32::from(scale) - 240.0) / SCALE_STEPS).exp2() / MOST
}

/// Reads pieces of packed traces, at any speed.
#[derive(Debug, Clone)]
pub(crate) struct TraceReader {
    kernel: SincKernel,
    around: Vec<f32>,
}

impl TraceReader {
    pub(crate) fn new() -> Self {
        Self { kernel: SincKernel::new(0.95), around: Vec::new() }
    }

    /// Fills `out` with the samples at `from`, `from + step` and so on.
    pub(crate) fn read(&mut self, trace: &PackedTrace, from: f64, step: f64, out: &mut [f32]) {
        let half = self.kernel.half();
        let first = from.floor() - half as f64;
        let count = (step * out.len() as f64).ceil() as usize + 2 * half + 2;
        self.around.clear();
        self.around.extend((0..count as i64).map(|n| trace.sample(first as i64 + n)));
        for (n, to) in out.iter_mut().enumerate() {
            *to = self.kernel.at(&self.around, from - first + step * n as f64).unwrap_or(0.0);
        }
    }
}
