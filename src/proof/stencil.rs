//! Which poses the measure compares: for each figure the show times between them, and their weights.
//!
//! Times are whole milliseconds. Where the period is not, the poses of some frames are a millisecond farther apart than
//! those of others; each arrangement that there is has its own stencil.

use crate::motion::Spacing;
use crate::time::Rate;

/// The shortest time over which the change of velocity from frame to frame is judged, seconds.
const LEAST_STEP_S: f64 = 0.005;

/// Nanoseconds of a millisecond.
const MS: i64 = 1_000_000;

/// A weighted sum of poses at fixed distances: a divided difference, times 1, 2 or 6.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stencil {
    /// Show times of the poses after the first, which is at 0; nanoseconds.
    pub(super) offsets: Vec<i64>,
    /// Their weights, per second, per second squared, or per second cubed.
    pub(super) weights: Vec<f64>,
    /// The instant that the sum is said to be of, from the first pose.
    pub(super) middle: i64,
    /// What the sum is multiplied with: for a change of velocity the mean length of its two frames, else 1.
    pub(super) scale: f64,
}

/// The stencils of each figure at a rate.
#[derive(Debug, Clone)]
pub(super) struct Stencils {
    pub(super) velocity: Vec<Stencil>,
    /// Change of velocity from frame to frame.
    pub(super) step: Vec<Stencil>,
    pub(super) acceleration: Vec<Stencil>,
    pub(super) jerk: Vec<Stencil>,
}

impl Stencils {
    /// Those of frames at `rate`, however they fall on the cue.
    pub(super) fn at(rate: Rate) -> Self {
        let Spacing { n, m } = Spacing::at_rate(rate.hz());
        let both = |order: usize| {
            let mut all = stencils(rate, n, order);
            all.extend(stencils(rate, m, order));
            all
        };
        // A change of slope is the acceleration times half of what both frames span.
        let step = |stencil: Stencil| Stencil { scale: stencil.span() / 2.0, ..stencil };
        Self {
            velocity: stencils(rate, 1, 1),
            step: stencils(rate, 1, 2).into_iter().map(step).collect(),
            acceleration: both(2),
            jerk: both(3),
        }
    }

    /// The longest that any of them spans, nanoseconds.
    pub(super) fn reach(&self) -> i64 {
        self.jerk.iter().map(Stencil::reach).max().unwrap_or(0)
    }
}

/// How much velocity may change from frame to frame: 4 x the acceleration x the period or 5 ms.
pub(super) fn step_limit(acceleration: f64, rate: Rate) -> f64 {
    4.0 * acceleration * rate.hz().recip().max(LEAST_STEP_S)
}

impl Stencil {
    /// The divided difference over poses at these times, ms, times the factorial of its order.
    fn new(times: &[i64]) -> Self {
        let first = times[0];
        let offsets: Vec<i64> = times.iter().map(|time| (time - first) * MS).collect();
        let order = offsets.len() - 1;
        let factorial: f64 = [1.0, 1.0, 2.0, 6.0][order];
        let weight = |at: &i64| {
            // A divided difference weighs each pose by 1 over the product of its distances to all others.
            let others = offsets.iter().filter(|other| *other != at);
            factorial / others.map(|other| seconds(at - other)).product::<f64>()
        };
        let weights = offsets.iter().map(weight).collect();
        let middle = i64::midpoint(offsets[order / 2], offsets[order.div_ceil(2)]);
        Self { offsets, weights, middle, scale: 1.0 }
    }

    /// Nanoseconds from the first pose to the last.
    pub(super) fn reach(&self) -> i64 {
        self.offsets[self.offsets.len() - 1]
    }

    /// The same in seconds.
    fn span(&self) -> f64 {
        seconds(self.reach())
    }

    /// The most that the sum can be where the derivative of its order stays below `derivative`, and where position, slope
    /// and second derivative jump by these sizes in all: the sum is a mean of the derivative, weighted by a B-spline.
    pub(super) fn bound(&self, derivative: f64, jumps: [f64; 3]) -> f64 {
        let gap = self.offsets.windows(2).map(|pair| pair[1] - pair[0]).min().unwrap_or(MS);
        let gap = seconds(gap);
        let [position, slope, bend] = jumps;
        // The greatest value, slope and bend of a B-spline whose shortest gap that is (docs/limiter.md, section 2).
        let of_jumps = match self.offsets.len() {
            2 => position / gap,
            3 => slope / gap + position / (gap * gap),
            _ => bend / gap + slope / (gap * gap) + 2.0 * position / (gap * gap * gap),
        };
        // A little more: the sums that it bounds are rounded, and must not come out above it.
        (derivative + of_jumps) * self.scale * (1.0 + 1e-9)
    }
}

#[expect(clippy::cast_precision_loss, reason = "spans of some seconds")]
fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

/// The differences of an order over poses `apart` periods from each other, one for each arrangement of Times.
fn stencils(rate: Rate, apart: usize, order: usize) -> Vec<Stencil> {
    let counts: Vec<u64> = (0..=order as u64).map(|node| node * apart as u64).collect();
    let mut all: Vec<Stencil> = Vec::new();
    for times in arrangements(rate, &counts) {
        let stencil = Stencil::new(&times);
        if !all.contains(&stencil) {
            all.push(stencil);
        }
    }
    all
}

/// Where the running sum of Times, in ms, stands after so many frames more, for every place in the alternation.
fn arrangements(rate: Rate, counts: &[u64]) -> Vec<Vec<i64>> {
    const PER_PERIOD: u64 = 1_000_000;
    let millihertz = rate_millihertz(rate);
    let grain = gcd(PER_PERIOD, millihertz);
    // A node moves on by a millisecond where its remainder wraps: no more arrangements than nodes (docs/limiter.md, section 5).
    // The sum after k frames is (k x 1,000,000 + half) / millihertz, rounded down. All that counts is what remains.
    let (half, remains) = (millihertz / 2, |count: u64| count * PER_PERIOD % millihertz);
    let turns = counts.iter().map(|&count| (millihertz - remains(count)) % millihertz);
    let first_at_or_after = |least: u64| least + (half % grain + grain - least % grain) % grain;
    let starts = turns.map(first_at_or_after).filter(|start| *start < millihertz);
    let sum = |start: u64, count: u64| {
        i64::try_from((start + count * PER_PERIOD) / millihertz).expect("a few seconds")
    };
    starts.map(|start| counts.iter().map(|&count| sum(start, count)).collect()).collect()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1,000 to 1,000,000")]
fn rate_millihertz(rate: Rate) -> u64 {
    (rate.hz() * 1000.0).round() as u64
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_arrangement_of_times_that_frames_have_is_known_and_no_other() {
        for hz in [1.0, 7.0, 23.976, 59.94, 60.0, 100.0, 144.0, 600.0, 700.0, 999.0, 1000.0] {
            let rate = Rate::from_hz(hz);
            let Spacing { n, m } = Spacing::at_rate(hz);
            for apart in [1, n, m] {
                let counts: Vec<u64> = (0..4).map(|node| node * apart as u64).collect();
                let known: BTreeSet<_> = arrangements(rate, &counts).iter().map(|a| relative(a)).collect();
                let mut sums = vec![0_i64];
                (0..20_000).for_each(|k| sums.push(sums[sums.len() - 1] + i64::from(rate.time_ms(k))));
                let met = (0..sums.len() - 3 * apart)
                    .map(|k| relative(&[sums[k], sums[k + apart], sums[k + 2 * apart], sums[k + 3 * apart]]));
                assert_eq!(known, met.collect::<BTreeSet<_>>(), "{hz} Hz, {apart} apart");
            }
        }
    }

    fn relative(times: &[i64]) -> Vec<i64> {
        times.iter().map(|time| time - times[0]).collect()
    }

    #[test]
    fn a_difference_of_a_cubic_is_its_derivative() {
        let stencils = Stencils::at(Rate::from_hz(60.0));
        for (list, order, value) in
            [(&stencils.velocity, 1, 3.0), (&stencils.acceleration, 2, 6.0), (&stencils.jerk, 3, 6.0)]
        {
            for stencil in list {
                let x = |t: f64| [0.0, 3.0 * t, 3.0 * t * t, t * t * t][order];
                let sum = stencil.offsets.iter().zip(&stencil.weights).map(|(at, w)| w * x(seconds(*at)));
                assert!((sum.sum::<f64>() / value - 1.0).abs() < 1e-9, "{stencil:?}");
            }
        }
    }
}
