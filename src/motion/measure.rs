//! How speed, acceleration and jerk of what is sent are judged: by divided differences over poses 20 ms and more
//! apart, never tick by tick, because pulses are whole and some curves change their acceleration at a point.
//!
//! Two distances without a common factor are used, since either is blind to motion at its own frequency.

use crate::time::ShowTime;

/// The poses one third difference spans at the most: 3 x 27 periods at 1,000 Hz, and its own end.
const HISTORY: usize = 82;

/// How many periods apart the poses of a difference are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spacing {
    /// 20 ms in whole periods, halves up, at least one.
    pub(crate) n: usize,
    /// The smallest count over 1.3 n that shares no factor with it.
    pub(crate) m: usize,
}

impl Spacing {
    /// The distances at a rate of 1 to 1,000 Hz; other rates are taken as the nearer end.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1 to 20 after the clamp")]
    pub fn at_rate(rate_hz: f64) -> Self {
        let n = ((0.020 * rate_hz.clamp(1.0, 1000.0) + 0.5).floor() as usize).max(1);
        let mut m = 13 * n / 10 + 1;
        while gcd(m, n) != 1 {
            m += 1;
        }
        Self { n, m }
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// A measured value and the show time in the middle of the poses it was measured over.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reading {
    /// In the position's unit, per second, per second squared, or per second cubed.
    pub value: f64,
    /// Show time in the middle of the poses that gave it.
    pub(crate) at: ShowTime,
}

/// What one more pose showed; a part is 0 until enough poses have come.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Readings {
    /// Distance over Time of the newest frame.
    pub(crate) velocity: Reading,
    /// Change of velocity from the frame before to the newest, per second (not divided by time).
    pub(crate) step: Reading,
    /// Of the two distances, the acceleration of larger size.
    pub acceleration: Reading,
    /// Of the two distances, the jerk of larger size.
    pub jerk: Reading,
}

/// Measures one axis pose by pose. Never allocates.
#[derive(Debug, Clone)]
pub struct Measure {
    times: MeasureTimes,
    places: MeasurePlaces<1>,
}

impl Measure {
    /// A measure that has seen no pose yet.
    #[must_use]
    pub const fn new(spacing: Spacing) -> Self {
        Self { times: MeasureTimes::new(spacing), places: MeasurePlaces::NONE }
    }

    /// Takes the next pose, at a show time after the one before, and says what it showed.
    pub fn push(&mut self, at: ShowTime, position: f64) -> Readings {
        let spans = self.times.push(at);
        let [readings] = self.places.push(&spans, &[position]);
        readings
    }
}

/// When the poses of a measure were, which is the same for all axes of a seat. Never allocates.
#[derive(Debug, Clone)]
pub(crate) struct MeasureTimes {
    spacing: Spacing,
    seen: usize,
    /// Where the newest pose stands.
    newest: usize,
    times: [i64; HISTORY],
}

/// Where the poses stand that the newest makes differences with, and how long is between them.
#[derive(Debug, Clone)]
pub(crate) struct MeasureSpans {
    newest: usize,
    /// The pose before, one over the seconds from it to the newest, and the middle of both; none of the first pose.
    before: Option<(usize, f64, ShowTime)>,
    /// When the pose before was, where there was one before that.
    step_at: Option<ShowTime>,
    /// Of each distance; none before there are enough poses.
    apart: [Option<ApartSpans>; 2],
}

/// The poses of a third difference, the newest first, and what its steps are multiplied with: a division of each would cost most of a
/// measure, and the spans are those of all axes.
#[derive(Debug, Clone, Copy)]
struct ApartSpans {
    slots: [usize; 4],
    /// One over the seconds between each and the next; two over those between two apart.
    one: [f64; 3],
    two: [f64; 2],
    second_at: ShowTime,
    /// Three over the seconds between all, and the middle; none where there are no four.
    third: Option<(f64, ShowTime)>,
}

impl MeasureTimes {
    pub(crate) const fn new(spacing: Spacing) -> Self {
        Self { spacing, seen: 0, newest: HISTORY - 1, times: [0; HISTORY] }
    }

    /// Takes the time of the next pose, after that of the one before.
    pub(crate) fn push(&mut self, at: ShowTime) -> MeasureSpans {
        self.newest = if self.newest + 1 < HISTORY { self.newest + 1 } else { 0 };
        self.times[self.newest] = at.as_nanos();
        self.seen += 1;
        let before = (self.seen >= 2).then(|| {
            let middle = self.times[self.slot(1)].midpoint(self.times[self.newest]);
            (self.slot(1), 1.0 / self.seconds(0, 1), ShowTime::from_nanos(middle))
        });
        MeasureSpans {
            newest: self.newest,
            before,
            step_at: (self.seen >= 3).then(|| self.time(1)),
            apart: [self.apart(self.spacing.n), self.apart(self.spacing.m)],
        }
    }

    fn apart(&self, apart: usize) -> Option<ApartSpans> {
        (self.seen > 2 * apart).then_some(())?;
        let has_third = self.seen > 3 * apart;
        let last = if has_third { 3 * apart } else { 2 * apart };
        let middle = || self.time(apart).as_nanos().midpoint(self.time(2 * apart).as_nanos());
        Some(ApartSpans {
            slots: [self.slot(0), self.slot(apart), self.slot(2 * apart), self.slot(last)],
            one: [0, 1, 2].map(|before| 1.0 / self.seconds(before * apart, apart)),
            two: [0, 1].map(|before| 2.0 / self.seconds(before * apart, 2 * apart)),
            second_at: self.time(apart),
            third: has_third.then(|| (3.0 / self.seconds(0, 3 * apart), ShowTime::from_nanos(middle()))),
        })
    }

    #[expect(clippy::cast_precision_loss, reason = "spans of some milliseconds")]
    fn seconds(&self, back: usize, apart: usize) -> f64 {
        (self.times[self.slot(back)] - self.times[self.slot(back + apart)]) as f64 * 1e-9
    }

    fn time(&self, back: usize) -> ShowTime {
        ShowTime::from_nanos(self.times[self.slot(back)])
    }

    fn slot(&self, back: usize) -> usize {
        if back <= self.newest { self.newest - back } else { self.newest + HISTORY - back }
    }
}

/// Where the poses of up to so many axes were: those of one instant side by side, as a pose needs seven of them of each axis.
#[derive(Debug, Clone)]
pub(crate) struct MeasurePlaces<const N: usize> {
    last_velocities: [f64; N],
    positions: [[f64; N]; HISTORY],
}

impl<const N: usize> MeasurePlaces<N> {
    /// None yet.
    pub(crate) const NONE: Self = Self { last_velocities: [0.0; N], positions: [[0.0; N]; HISTORY] };

    /// Takes the positions of the next pose, and says of each axis what it showed.
    pub(crate) fn push(&mut self, spans: &MeasureSpans, positions: &[f64]) -> [Readings; N] {
        let axes = positions.len().min(N);
        self.positions[spans.newest][..axes].copy_from_slice(&positions[..axes]);
        let mut readings = [Readings::default(); N];
        if let Some((before, per_second, at)) = spans.before {
            let (newest, before) = (&self.positions[spans.newest], &self.positions[before]);
            let all = readings.iter_mut().zip(&mut self.last_velocities).take(axes);
            for (axis, (readings, last_velocity)) in all.enumerate() {
                let velocity = (newest[axis] - before[axis]) * per_second;
                readings.velocity = Reading { value: velocity, at };
                let step = velocity - std::mem::replace(last_velocity, velocity);
                readings.step = spans.step_at.map_or(readings.step, |at| Reading { value: step, at });
            }
        }
        spans.apart.iter().flatten().for_each(|apart| self.differences(apart, &mut readings[..axes]));
        readings
    }

    fn differences(&self, spans: &ApartSpans, readings: &mut [Readings]) {
        let ApartSpans { slots, one, two, second_at, third } = spans;
        let places = |index: usize| &self.positions[slots[index]];
        let places = [places(0), places(1), places(2), places(3)];
        let (three, middle) = third.unwrap_or((0.0, ShowTime::ZERO));
        let (mut second, mut jerk) = ([0.0; N], [0.0; N]);
        let both = second.iter_mut().zip(&mut jerk).take(readings.len());
        for (axis, (second, jerk)) in both.enumerate() {
            // Neighbours share the slope between them.
            let slope = |index: usize| (places[index][axis] - places[index + 1][axis]) * one[index];
            let [newest, older] = [(slope(0) - slope(1)) * two[0], (slope(1) - slope(2)) * two[1]];
            (*second, *jerk) = (newest, (newest - older) * three);
        }
        for (axis, readings) in readings.iter_mut().enumerate() {
            keep_larger(&mut readings.acceleration, second[axis], *second_at);
            if third.is_some() {
                keep_larger(&mut readings.jerk, jerk[axis], middle);
            }
        }
    }
}

fn keep_larger(kept: &mut Reading, value: f64, at: ShowTime) {
    if value.abs() > kept.value.abs() {
        *kept = Reading { value, at };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distances_are_about_20_ms_and_coprime() {
        for (rate, n, m) in
            [(1.0, 1, 2), (25.0, 1, 2), (50.0, 1, 2), (100.0, 2, 3), (200.0, 4, 7), (1000.0, 20, 27)]
        {
            assert_eq!(Spacing::at_rate(rate), Spacing { n, m }, "{rate} Hz");
        }
    }

    fn worst(rate: u32, seconds: u32, position: impl Fn(f64) -> f64) -> (f64, f64, f64, f64) {
        let mut measure = Measure::new(Spacing::at_rate(f64::from(rate)));
        let mut worst = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..=rate * seconds {
            let t = f64::from(k) / f64::from(rate);
            let r = measure.push(ShowTime::from_secs_f64(t), position(t));
            worst.0 = worst.0.max(r.velocity.value.abs());
            worst.1 = worst.1.max(r.acceleration.value.abs());
            worst.2 = worst.2.max(r.jerk.value.abs());
            worst.3 = worst.3.max(r.step.value.abs());
        }
        worst
    }

    #[test]
    fn a_cubic_is_measured_exactly() {
        // x = t³: v = 3t², a = 6t, j = 6. Differences see the acceleration in their middle, 40 ms before the end.
        let (v, a, j, _) = worst(100, 1, |t| t * t * t);
        assert!((v - 2.9701).abs() < 1e-3, "{v}");
        assert!((a - 6.0 * 0.98).abs() < 1e-6, "{a}");
        assert!((j - 6.0).abs() < 1e-5, "{j}");
    }

    #[test]
    fn a_zigzag_that_one_distance_is_blind_to_shows_at_the_other_or_from_frame_to_frame() {
        let zigzag = |t: f64| if (t * 100.0).round().rem_euclid(2.0) < 0.5 { 1.5 } else { -1.5 };
        let (_, a, _, step) = worst(100, 1, zigzag);
        assert!(a > 3000.0 || step > 4.0 * 3000.0 * 0.010, "{a} {step}");
        let fine = |t: f64| if (t * 200.0).round().rem_euclid(2.0) < 0.5 { 0.25 } else { -0.25 };
        let (_, a, _, step) = worst(200, 1, fine);
        assert!(a > 3000.0 || step > 4.0 * 3000.0 * 0.005, "{a} {step}");
    }

    #[test]
    fn axes_side_by_side_are_measured_as_each_by_itself() {
        let spacing = Spacing::at_rate(200.0);
        for axes in [1, 3, 11] {
            let (mut times, mut together) = (MeasureTimes::new(spacing), MeasurePlaces::<12>::NONE);
            let mut alone = vec![Measure::new(spacing); axes];
            for k in 0..400_i32 {
                if k == 250 {
                    // Anew, over what is left of before.
                    times = MeasureTimes::new(spacing);
                    alone.fill(Measure::new(spacing));
                }
                let at = ShowTime::from_millis(i64::from(5 * k + k % 3));
                let place = |axis: u8| (0.001 * f64::from(k * k) + f64::from(axis)).sin();
                let places: Vec<f64> = (0..12).take(axes).map(place).collect();
                let seen = together.push(&times.push(at), &places);
                let each: Vec<_> =
                    alone.iter_mut().zip(&places).map(|(one, place)| one.push(at, *place)).collect();
                assert_eq!(seen[..axes], each, "pose {k} of {axes} axes");
                assert!(seen[axes..].iter().all(|none| *none == Readings::default()));
            }
        }
    }

    #[test]
    fn rounding_to_pulses_alone_stays_far_below_the_limits() {
        let (_, a, j, _) = worst(1000, 2, |t| ((20.0 * t) / 0.0005).round() * 0.0005);
        assert!(a < 30.0 && j < 3000.0, "{a} {j}");
    }
}
