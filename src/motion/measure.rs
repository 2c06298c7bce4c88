//! How speed, acceleration and jerk of what is sent are judged: by divided differences over poses 20 ms and more
//! apart, never tick by tick, because pulses are whole and some curves change their acceleration at a point.
//!
//! Two distances without a common factor are used, since either is blind to motion at its own frequency.

use std::array::from_fn;

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
        self.times.push(at);
        self.places.push(&self.times, &[position]).of(0)
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
    /// How many steps in a row were as long as the last: over even ones nothing is divided anew.
    even: usize,
    /// Of each distance.
    factors: [Factors; 2],
}

/// What the steps of a third difference are multiplied with: a division of each would cost most of a measure, and the spans are those of
/// all axes.
#[derive(Debug, Clone, Copy)]
struct Factors {
    /// One over the seconds between each pose and the next; two over those between two apart; three over those between all.
    one: [f64; 3],
    two: [f64; 2],
    three: f64,
}

impl MeasureTimes {
    pub(crate) const fn new(spacing: Spacing) -> Self {
        const NONE: Factors = Factors { one: [0.0; 3], two: [0.0; 2], three: 0.0 };
        Self { spacing, seen: 0, newest: HISTORY - 1, times: [0; HISTORY], even: 0, factors: [NONE; 2] }
    }

    /// Takes the time of the next pose, after that of the one before.
    pub(crate) fn push(&mut self, at: ShowTime) {
        let last = self.times[self.newest];
        let is_even = at.as_nanos() - last == last - self.times[self.slot(1)];
        self.even = if is_even { self.even + 1 } else { 1 };
        self.newest = if self.newest + 1 < HISTORY { self.newest + 1 } else { 0 };
        self.times[self.newest] = at.as_nanos();
        self.seen += 1;
        for distance in 0..2 {
            let apart = self.apart(distance);
            // Once all that it spans is even, it is so until something is not.
            if self.even <= 3 * apart && self.seen > 2 * apart {
                self.factors[distance] = Factors {
                    one: [0, 1, 2].map(|before| 1.0 / self.seconds(before * apart, apart)),
                    two: [0, 1].map(|before| 2.0 / self.seconds(before * apart, 2 * apart)),
                    three: 3.0 / self.seconds(0, 3 * apart),
                };
            }
        }
    }

    /// How many poses the poses of a difference are apart.
    const fn apart(&self, distance: usize) -> usize {
        if distance == 0 { self.spacing.n } else { self.spacing.m }
    }

    /// Half way between two poses.
    fn middle(&self, back: usize, farther: usize) -> ShowTime {
        ShowTime::from_nanos(self.time(back).as_nanos().midpoint(self.time(farther).as_nanos()))
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

/// Where the poses of up to so many axes were: those of one instant side by side, as a pose needs seven of them of each axis. Axes that
/// there are not stay at 0: to work them out as well is quicker than to leave them out.
#[derive(Debug, Clone)]
pub(crate) struct MeasurePlaces<const N: usize> {
    last_velocities: [f64; N],
    positions: [[f64; N]; HISTORY],
}

impl<const N: usize> MeasurePlaces<N> {
    /// None yet.
    pub(crate) const NONE: Self = Self { last_velocities: [0.0; N], positions: [[0.0; N]; HISTORY] };

    /// Takes the positions of the pose whose time was taken last, and says what it showed.
    #[inline]
    pub(crate) fn push(&mut self, times: &MeasureTimes, positions: &[f64]) -> PoseReadings<N> {
        let axes = positions.len().min(N);
        self.positions[times.newest][..axes].copy_from_slice(&positions[..axes]);
        let mut shown = PoseReadings::NONE;
        if times.seen >= 2 {
            let [newest, before] = [0, 1].map(|back| &self.positions[times.slot(back)]);
            let per_second = 1.0 / times.seconds(0, 1);
            let velocity = from_fn(|axis| (newest[axis] - before[axis]) * per_second);
            let last = std::mem::replace(&mut self.last_velocities, velocity);
            shown.velocity = AxesReading { values: velocity, at: times.middle(0, 1) };
            if times.seen >= 3 {
                shown.step =
                    AxesReading { values: from_fn(|axis| velocity[axis] - last[axis]), at: times.time(1) };
            }
        }
        for distance in 0..2 {
            self.differences(times, distance, &mut shown);
        }
        shown
    }

    #[inline]
    fn differences(&self, times: &MeasureTimes, distance: usize, shown: &mut PoseReadings<N>) {
        let apart = times.apart(distance);
        if times.seen <= 2 * apart {
            return;
        }
        let Factors { one, two, three } = times.factors[distance];
        // Where there are but three poses, what the fourth makes is not used.
        let places: [_; 4] = from_fn(|index| &self.positions[times.slot(index * apart)]);
        let (mut second, mut third) = ([0.0; N], [0.0; N]);
        for (axis, (second, third)) in second.iter_mut().zip(&mut third).enumerate() {
            // Neighbours share the slope between them.
            let slope = |index: usize| (places[index][axis] - places[index + 1][axis]) * one[index];
            let [newest, older] = [(slope(0) - slope(1)) * two[0], (slope(1) - slope(2)) * two[1]];
            (*second, *third) = (newest, (newest - older) * three);
        }
        shown.acceleration[distance] = AxesReading { values: second, at: times.time(apart) };
        if times.seen > 3 * apart {
            shown.jerk[distance] = AxesReading { values: third, at: times.middle(apart, 2 * apart) };
        }
    }
}

/// What one more pose showed of up to so many axes; zeros until enough poses have come. Values of a kind are side by side, so that several
/// are worked out at once.
#[derive(Debug, Clone)]
pub(crate) struct PoseReadings<const N: usize> {
    velocity: AxesReading<N>,
    step: AxesReading<N>,
    /// By each of the two distances.
    acceleration: [AxesReading<N>; 2],
    jerk: [AxesReading<N>; 2],
}

/// A value of each axis, and the show time in the middle of the poses that gave them.
#[derive(Debug, Clone, Copy)]
struct AxesReading<const N: usize> {
    values: [f64; N],
    at: ShowTime,
}

impl<const N: usize> AxesReading<N> {
    const NONE: Self = Self { values: [0.0; N], at: ShowTime::ZERO };

    const fn of(&self, axis: usize) -> Reading {
        Reading { value: self.values[axis], at: self.at }
    }
}

impl<const N: usize> PoseReadings<N> {
    const NONE: Self = Self {
        velocity: AxesReading::NONE,
        step: AxesReading::NONE,
        acceleration: [AxesReading::NONE; 2],
        jerk: [AxesReading::NONE; 2],
    };

    /// Those of one axis.
    #[inline]
    pub(crate) fn of(&self, axis: usize) -> Readings {
        let larger = |pair: &[AxesReading<N>; 2]| {
            let [one, other] = pair.each_ref().map(|one| one.of(axis));
            if other.value.abs() > one.value.abs() { other } else { one }
        };
        Readings {
            velocity: self.velocity.of(axis),
            step: self.step.of(axis),
            acceleration: larger(&self.acceleration),
            jerk: larger(&self.jerk),
        }
    }

    /// How large speed, acceleration and jerk of each axis are.
    pub(crate) fn sizes(&self) -> [[f64; N]; 3] {
        let larger = |[one, other]: [&AxesReading<N>; 2]| {
            from_fn(|axis| {
                let (one, other) = (one.values[axis].abs(), other.values[axis].abs());
                if other > one { other } else { one }
            })
        };
        [larger([&self.velocity; 2]), larger(self.acceleration.each_ref()), larger(self.jerk.each_ref())]
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
                times.push(at);
                let seen = together.push(&times, &places);
                let [speed, acceleration, jerk] = seen.sizes();
                for (axis, (one, place)) in alone.iter_mut().zip(&places).enumerate() {
                    let readings = one.push(at, *place);
                    assert_eq!(seen.of(axis), readings, "pose {k} of {axes} axes");
                    let sizes = [readings.velocity, readings.acceleration, readings.jerk];
                    assert_eq!(
                        [speed[axis], acceleration[axis], jerk[axis]],
                        sizes.map(|one| one.value.abs())
                    );
                }
            }
        }
    }

    /// The third divided difference by its definition, times six.
    fn jerk_of(poses: &[(f64, f64)]) -> f64 {
        fn divided(poses: &[(f64, f64)]) -> f64 {
            let [(from, _), .., (to, _)] = poses else { return poses[0].1 };
            (divided(&poses[1..]) - divided(&poses[..poses.len() - 1])) / (to - from)
        }
        6.0 * divided(poses)
    }

    #[test]
    fn even_times_and_times_that_are_not_are_measured_by_the_differences_themselves() {
        let spacing = Spacing::at_rate(200.0);
        for step_ms in
            [|_| 5, |k: i64| 5 + k % 2, |k| if k < 60 { 5 } else { 7 }, |k| if k == 90 { 23 } else { 5 }]
        {
            let mut measure = Measure::new(spacing);
            let (mut at_ms, mut poses) = (0, Vec::new());
            for k in 0..200_i32 {
                at_ms += step_ms(k.into());
                let (at, place) = (ShowTime::from_millis(at_ms), (0.3 * f64::from(k)).sin());
                poses.push((at.as_secs_f64(), place));
                let seen = measure.push(at, place).jerk.value;
                let of = |apart: usize| {
                    let back = (0..4).map(|index| poses.len().checked_sub(1 + (3 - index) * apart));
                    let four: Option<Vec<_>> = back.map(|pose| Some(poses[pose?])).collect();
                    four.map_or(0.0, |four| jerk_of(&four))
                };
                let (one, other) = (of(spacing.n), of(spacing.m));
                let wanted = if other.abs() > one.abs() { other } else { one };
                assert!((seen - wanted).abs() <= 1e-6 * wanted.abs().max(1.0), "{k}: {seen}, not {wanted}");
            }
        }
    }

    #[test]
    fn rounding_to_pulses_alone_stays_far_below_the_limits() {
        let (_, a, j, _) = worst(1000, 2, |t| ((20.0 * t) / 0.0005).round() * 0.0005);
        assert!(a < 30.0 && j < 3000.0, "{a} {j}");
    }
}
