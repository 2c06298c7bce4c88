//! How well two traces fit, and by how much one of them is late.

use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::trace::TRACE_RATE;

/// Samples that are held against each other: 0.64 s.
pub(crate) const PIECE: usize = 1_024;
// Padded with as much of nothing, so that no lag up to a piece wraps round onto the other end.
const SIZE: usize = 2 * PIECE;
/// The greatest lag that is looked at, samples: 50 ms; and that from which it is known what chance does.
pub(crate) const LAGS: usize = 80;
const NOISE_LAGS: usize = 240;
/// All lags that are reckoned.
pub(crate) const WIDTH: usize = 2 * NOISE_LAGS + 1;
/// What is compared, Hz.
const BAND: (f64, f64) = (90.0, 690.0);
/// Beside a peak, what belongs to it.
const LOBE: usize = 6;

/// A fit, by lag: the middle is none.
pub(crate) type Fit = [f32; WIDTH];

/// The best of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BestLag {
    /// By so many samples the first is late.
    pub(crate) lag: f64,
    /// How far it stands out of what chance does: deviations.
    pub(crate) z: f64,
}

/// Correlates pieces, every frequency with the same weight: no tone, be it ever so loud, speaks for all.
pub(crate) struct Correlator {
    forward: Arc<dyn RealToComplex<f32>>,
    back: Arc<dyn ComplexToReal<f32>>,
    window: Vec<f32>,
    padded: Vec<f32>,
    spectra: [Vec<Complex<f32>>; 2],
    scratch: Vec<Complex<f32>>,
}

impl Correlator {
    pub(crate) fn new() -> Self {
        let mut planner = RealFftPlanner::new();
        let (forward, back) = (planner.plan_fft_forward(SIZE), planner.plan_fft_inverse(SIZE));
        let turn = std::f32::consts::TAU / PIECE as f32;
        let longest = forward.get_scratch_len().max(back.get_scratch_len());
        Self {
            window: (0..PIECE).map(|n| 0.5 - 0.5 * (turn * (n as f32 + 0.5)).cos()).collect(),
            padded: forward.make_input_vec(),
            spectra: [forward.make_output_vec(), forward.make_output_vec()],
            scratch: vec![Complex::default(); longest],
            forward,
            back,
        }
    }

    /// The fit of a piece to what it is thought to be.
    pub(crate) fn fit(&mut self, live: &[f32], expected: &[f32]) -> Fit {
        for (place, piece) in [live, expected].into_iter().enumerate() {
            self.transform(place, piece);
        }
        self.weigh();
        self.back
            .process_with_scratch(&mut self.spectra[0], &mut self.padded, &mut self.scratch)
            .expect("all lengths are the transform's own, and the ends are real");
        let mut fit = [0.0; WIDTH];
        for (n, to) in fit.iter_mut().enumerate() {
            *to = self.padded[(SIZE + n - NOISE_LAGS) % SIZE];
        }
        fit
    }

    fn transform(&mut self, place: usize, piece: &[f32]) {
        self.padded.fill(0.0);
        for ((to, sample), weight) in self.padded.iter_mut().zip(piece).zip(&self.window) {
            *to = sample * weight;
        }
        self.forward
            .process_with_scratch(&mut self.padded, &mut self.spectra[place], &mut self.scratch)
            .expect("all lengths are the transform's own");
    }

    /// The product of both spectra, in the band alone, each line as long as any other.
    fn weigh(&mut self) {
        let line = |hertz: f64| (hertz / TRACE_RATE * SIZE as f64) as usize;
        let band = line(BAND.0)..line(BAND.1);
        let [live, expected] = &mut self.spectra;
        for (n, (one, other)) in live.iter_mut().zip(expected.iter()).enumerate() {
            let product = *one * other.conj();
            let length = product.norm();
            // Not by all of its length: lines of which there is next to nothing would count as much as sound.
            *one = if band.contains(&n) && length > 1e-20 {
                product / length.powf(0.8)
            } else {
                Complex::default()
            };
        }
    }
}

/// Adds a fit to others, moved by so many samples.
pub(crate) fn add_moved(sum: &mut Fit, fit: &Fit, by: f64) {
    let by = by.round() as isize;
    for (n, to) in sum.iter_mut().enumerate() {
        *to += n.checked_add_signed(by).and_then(|n| fit.get(n)).copied().unwrap_or(0.0);
    }
}

/// How far a fit stands out of what chance does at a lag, or beside it.
pub(crate) fn z_at(fit: &Fit, lag: f64) -> f64 {
    let at = (lag.round() + NOISE_LAGS as f64) as usize;
    let height = fit[at - 1].max(fit[at]).max(fit[at + 1]);
    f64::from(height) / deviation(fit, at).max(1e-12)
}

/// What chance does, beside a peak.
fn deviation(fit: &Fit, peak: usize) -> f64 {
    let rest = || fit.iter().enumerate().filter(|(n, _)| n.abs_diff(peak) > LOBE);
    (rest().map(|(_, value)| f64::from(value * value)).sum::<f64>() / rest().count() as f64).sqrt()
}

/// The best lag of a fit, none where there is no sound.
pub(crate) fn best(fit: &Fit) -> Option<BestLag> {
    let near = NOISE_LAGS - LAGS..=NOISE_LAGS + LAGS;
    let (peak, height) = near.map(|n| (n, fit[n])).max_by(|one, other| one.1.total_cmp(&other.1))?;
    // Not by the greatest value that there could be: a long tone fits nearly as well at every turn of its wave.
    let noise = deviation(fit, peak);
    if noise <= 0.0 || height <= 0.0 {
        return None;
    }
    let [before, after] = [peak - 1, peak + 1].map(|n| f64::from(fit[n]));
    let height = f64::from(height);
    // The top of the parabola through three heights: the peak lies between samples, 0.6 ms apart.
    let bend = before - 2.0 * height + after;
    let between = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some(BestLag { lag: peak as f64 - NOISE_LAGS as f64 + between, z: height / noise })
}
