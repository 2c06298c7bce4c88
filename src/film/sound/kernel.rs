//! Sound at one rate into sound at another, or at another speed.

use std::f64::consts::PI;

/// Places between two samples for which there are weights: at 8,000 samples a second they are 1 us apart.
const PHASES: usize = 128;
/// The kernel ends at so many of its zeros.
const ZEROS: f64 = 8.0;

/// The weights of the samples around a place.
#[derive(Debug, Clone)]
pub(crate) struct SincKernel {
    half: usize,
    weights: Vec<f32>,
}

impl SincKernel {
    /// Lets pass what is below `cutoff`, of half the rate of the samples.
    pub(crate) fn new(cutoff: f64) -> Self {
        let half = (ZEROS / cutoff).ceil();
        let taps = 2 * half as usize + 1;
        let mut weights = Vec::with_capacity((PHASES + 1) * taps);
        // One more than there are between: a place may be rounded up to the next sample.
        for phase in 0..=PHASES {
            let between = phase as f64 / PHASES as f64;
            let row = (0..taps).map(|tap| {
                let apart = tap as f64 - half - between;
                let sinc =
                    if apart == 0.0 { 1.0 } else { (PI * cutoff * apart).sin() / (PI * cutoff * apart) };
                let window = (PI * (apart / (half + 1.0)).clamp(-1.0, 1.0) / 2.0).cos().powi(2);
                (cutoff * sinc * window) as f32
            });
            weights.extend(row);
        }
        Self { half: half as usize, weights }
    }

    /// Samples that are needed before a place and after it.
    pub(crate) const fn half(&self) -> usize {
        self.half
    }

    /// The value at a place; `None` unless all that is needed is there.
    pub(crate) fn at(&self, samples: &[f32], place: f64) -> Option<f32> {
        let whole = place.floor();
        let taps = 2 * self.half + 1;
        let first = (whole as usize).checked_sub(self.half)?;
        let around = samples.get(first..first + taps)?;
        let phase = ((place - whole) * PHASES as f64).round() as usize;
        let row = &self.weights[phase * taps..(phase + 1) * taps];
        Some(around.iter().zip(row).map(|(sample, weight)| sample * weight).sum())
    }
}

/// Makes a stream of another rate; nothing is delayed: sample `k` out lies at `k * step` in.
#[derive(Debug, Clone)]
pub(crate) struct Resampler {
    kernel: SincKernel,
    step: f64,
    /// The samples that are still needed, from that place on; before the first there was silence.
    kept: Vec<f32>,
    first: f64,
    next: f64,
}

impl Resampler {
    /// A sample every `step` samples, of what is below `cutoff`, of half the rate that comes in.
    pub(crate) fn new(step: f64, cutoff: f64) -> Self {
        let kernel = SincKernel::new(cutoff);
        let half = kernel.half();
        Self { kept: vec![0.0; half], first: -(half as f64), next: 0.0, kernel, step }
    }

    /// Takes a block; adds to `out` what is made of it.
    pub(crate) fn push(&mut self, block: &[f32], out: &mut Vec<f32>) {
        self.kept.extend_from_slice(block);
        while let Some(sample) = self.kernel.at(&self.kept, self.next * self.step - self.first) {
            out.push(sample);
            self.next += 1.0;
        }
        let used = (self.next * self.step - self.first).floor() as usize - self.kernel.half();
        let used = used.min(self.kept.len());
        self.kept.drain(..used);
        self.first += used as f64;
    }
}
