//! A zero-phase low-pass for coarse sources: three running means over evenly spaced samples of the curve, each as far to
//! the left as to the right, so that nothing is moved in time.

use crate::cue::{Cue, Interpolation, Unit, limits};
use crate::time::{ShowTime, nanos};
use crate::timeline::{Hint, Timeline};

/// Samples are at most this far apart, nanoseconds, unless the cue would have too many rows then.
const FINE: u64 = 10_000_000;
/// The mildest and the strongest rung of the ladder are this far apart, as a factor of the cut-off.
const RUNG: f64 = 1.3;
/// The lowest cut-off that is tried, Hz: below it hardly anything is left of a ride.
const LOWEST_HZ: f64 = 0.3;
/// The -3 dB point of a bell curve of 1 s standard deviation, Hz: sqrt(ln 2) / 2 pi.
const CUT_OFF: f64 = 0.132_505;

/// A low-pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Smoothing {
    /// Where it lets half the power through, Hz.
    pub(crate) cut_off_hz: f64,
}

/// The curves of a cue at evenly spaced times.
pub(super) struct Resampled {
    /// Nanoseconds from one sample to the next.
    step: u64,
    /// `[axis][sample]`; the last sample is at the end of the cue or after it.
    samples: Vec<Vec<f64>>,
    /// The rows of the smoothed cue: those of the cue, and so many between them that none are farther apart than a step.
    times: Vec<ShowTime>,
}

impl Resampled {
    pub(super) fn new(timeline: &Timeline) -> Self {
        let interval = nanos(timeline.row_interval()).max(1);
        let length = timeline.duration().as_nanos().unsigned_abs();
        let fine = FINE.max(length.div_ceil(limits::MAX_ROWS as u64 / 4));
        let step = (interval / interval.div_ceil(fine)).max(1);
        let count = length.div_ceil(step) + 1;
        let mut hint = Hint::default();
        let mut samples = vec![Vec::new(); timeline.axes()];
        for index in 0..count {
            let at = ShowTime::from_nanos(i64::try_from(index * step).expect("under a day"));
            let pose = timeline.sample(at, &mut hint);
            samples.iter_mut().zip(pose).for_each(|(samples, position)| samples.push(position));
        }
        Self { step, samples, times: refined(timeline.cue().times(), step) }
    }

    /// Strengths from mild to strong, each a rung lower in cut-off.
    pub(super) fn strengths(&self) -> Vec<usize> {
        let mut ladder: Vec<usize> = Vec::new();
        let most = self.samples[0].len() / 2;
        let mut lowest = f64::INFINITY;
        for strength in (1..).take_while(|strength| *strength < most) {
            let cut_off = self.cut_off_hz(strength);
            if cut_off * RUNG <= lowest {
                lowest = cut_off;
                ladder.push(strength);
            }
            if cut_off < LOWEST_HZ {
                break;
            }
        }
        ladder
    }

    /// The cue through the low-pass of a strength.
    pub(super) fn smoothed(&self, timeline: &Timeline, strength: usize) -> (Cue, Smoothing) {
        let cue = timeline.cue();
        let pass = |samples: &Vec<f64>| {
            halves(strength).into_iter().fold(samples.clone(), |samples, half| running_mean(&samples, half))
        };
        let smooth: Vec<Vec<f64>> = self.samples.iter().map(pass).collect();
        // The cubic between samples may dip below them; of what began at 0 nothing is to.
        let rows = || cue.positions().chunks(cue.axes());
        let least = |axis: usize| rows().map(|row| row[axis]).fold(0.0, f64::min);
        let lowest: Vec<f64> = (0..cue.axes()).map(least).collect();
        let mut positions = Vec::with_capacity(self.times.len() * cue.axes());
        for at in &self.times {
            let at = at.as_nanos().unsigned_abs();
            let held = |(axis, samples): (usize, &Vec<f64>)| {
                let most = if cue.units().of(axis) == Unit::Fraction { 1.0 } else { f64::INFINITY };
                self.between(samples, at).max(lowest[axis]).min(most)
            };
            positions.extend(smooth.iter().enumerate().map(held));
        }
        let smoothing = Smoothing { cut_off_hz: self.cut_off_hz(strength) };
        (cue.with_rows(self.times.clone(), positions, Interpolation::Spline), smoothing)
    }

    #[expect(clippy::cast_precision_loss, reason = "a few thousand samples of some milliseconds")]
    fn cut_off_hz(&self, strength: usize) -> f64 {
        let widths = halves(strength).map(|half| (2 * half + 1) as f64);
        let variance: f64 = widths.iter().map(|width| (width * width - 1.0) / 12.0).sum();
        CUT_OFF / (variance.sqrt() * self.step as f64 * 1e-9)
    }

    /// The smooth curve at a time, by the cubic through the four samples around it.
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, reason = "under a day")]
    fn between(&self, samples: &[f64], at: u64) -> f64 {
        let (index, rest) = ((at / self.step) as usize, at % self.step);
        if rest == 0 {
            return samples[index];
        }
        let u = rest as f64 / self.step as f64;
        let sample = |offset: usize| samples[(index + offset).saturating_sub(1).min(samples.len() - 1)];
        let (before, here, next, after) = (sample(0), sample(1), sample(2), sample(3));
        // Lagrange's: a straight line between samples would have corners, and corners are jerk.
        let weights = [
            -u * (u - 1.0) * (u - 2.0) / 6.0,
            (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
            -(u + 1.0) * u * (u - 2.0) / 2.0,
            (u + 1.0) * u * (u - 1.0) / 6.0,
        ];
        weights.iter().zip([before, here, next, after]).map(|(weight, sample)| weight * sample).sum()
    }
}

/// How far the three means reach to either side, in samples.
fn halves(strength: usize) -> [usize; 3] {
    // As equal as they can be: three equal means are close to a bell, of which the cut-off is known.
    [strength, strength + 1, strength + 2].map(|part| part / 3)
}

/// The mean over `half` samples to either side. Beyond its ends a curve goes on as its point reflection there, so that the
/// first and the last sample stay what they are.
#[expect(clippy::cast_precision_loss, reason = "a few thousand samples")]
fn running_mean(samples: &[f64], half: usize) -> Vec<f64> {
    if half == 0 {
        return samples.to_vec();
    }
    let last = samples.len() - 1;
    let half = half.min(last);
    let before = (1..=half).rev().map(|i| 2.0 * samples[0] - samples[i]);
    let after = (1..=half).map(|i| 2.0 * samples[last] - samples[last - i]);
    let extended: Vec<f64> = before.chain(samples.iter().copied()).chain(after).collect();
    let width = 2 * half + 1;
    // Its rounding grows by some 1e-16 of it a sample, 1e-10 over a film: far below a pulse.
    let mut sum: f64 = extended[..width].iter().sum();
    let mut means = Vec::with_capacity(samples.len());
    means.push(sum / width as f64);
    for index in 1..samples.len() {
        sum += extended[index + width - 1] - extended[index - 1];
        means.push(sum / width as f64);
    }
    means
}

/// The rows of a cue with evenly spaced ones put between those that are farther apart than a step.
fn refined(times: &[ShowTime], step: u64) -> Vec<ShowTime> {
    let mut all = vec![times[0]];
    for pair in times.windows(2) {
        let (from, span) = (pair[0].as_nanos(), pair[1].as_nanos() - pair[0].as_nanos());
        let step = i64::try_from(step).unwrap_or(i64::MAX);
        let parts = (span + step - 1) / step;
        all.extend((1..=parts).map(|part| ShowTime::from_nanos(from + span * part / parts)));
    }
    all
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cue::{Source, read};

    #[test]
    fn a_mean_moves_nothing_in_time_and_keeps_the_ends() {
        let ramp: Vec<f64> = (0..50).map(f64::from).collect();
        let smooth = running_mean(&ramp, 4);
        assert!(ramp.iter().zip(&smooth).all(|(a, b)| (a - b).abs() < 1e-9), "{smooth:?}");
        let mut peak = vec![0.0; 51];
        peak[25] = 1.0;
        let smooth = [1, 2, 3].into_iter().fold(peak, |samples, half| running_mean(&samples, half));
        assert!((0..51).all(|i| (smooth[i] - smooth[50 - i]).abs() < 1e-12), "{smooth:?}");
        assert!(smooth[25] >= smooth[24] && smooth[24] > smooth[22]);
    }

    #[test]
    fn a_sine_at_the_cut_off_keeps_seven_tenths() {
        let mut text = "time_ms,a1\n".to_owned();
        for row in 0..=800 {
            text += &format!(
                "{},{}\n",
                row * 10,
                0.5 + 0.4 * (f64::from(row) * 0.01 * std::f64::consts::TAU * 2.0).sin()
            );
        }
        let timeline = Timeline::new(read(Path::new("t.csv"), text.as_bytes(), &Source::Native).unwrap());
        let source = Resampled::new(&timeline);
        let nearest = (1..200).find(|strength| source.cut_off_hz(*strength) < 2.0).unwrap();
        let (cue, smoothing) = source.smoothed(&timeline, nearest);
        assert!((smoothing.cut_off_hz - 2.0).abs() < 0.1, "{smoothing:?}");
        let middle = &cue.positions()[200..600];
        let most = middle.iter().copied().fold(0.0, f64::max) - 0.5;
        assert!((most / 0.4 - 0.707).abs() < 0.04, "{most}");
    }
}
