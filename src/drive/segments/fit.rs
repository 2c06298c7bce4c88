//! From what an axis does in the middle of each slice to segments of a SilverMax.
//!
//! A segment has a straight velocity, so a course of segments is a quadratic spline with the ends of slices as knots. It is
//! fitted where it stands: the control value of a slice is -1/8, 5/4, -1/8 of the middles of the slice before, itself and
//! the next, which a parabola passes unchanged. To meet the poses at the knots instead would make each velocity what the
//! one before was not, and swing for ever.

use super::knots::{Knot, Knots};
use super::model::{DriveCourse, DriveUnits};
use super::segment::{LEAST_ACCELERATION, MOST_ACCELERATION, Segment};

/// What of what the drive lacks is added to each next velocity: rounding is made up for, and nothing swings.
const MADE_UP: f64 = 0.5;
/// Middles that differ by less, in counts, stand still.
const STILL: f64 = 1e-6;

/// Makes segments of middles, one axis. The same for a proof and for a play.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SegmentFit {
    units: DriveUnits,
    knots: Knots,
    /// The least and greatest control value, counts: the spline stays between them.
    reach: (f64, f64),
    /// Of the slice before the one that is next to be made, itself, and the two after it; counts.
    middles: [f64; 4],
    /// Control value of the slice before.
    before: f64,
    /// How much later than the exact knot that slice ended, in slices.
    late: f64,
    /// How many middles are still needed.
    wanted: u32,
    course: DriveCourse,
}

impl SegmentFit {
    /// At rest at `position`; never led outside `reach`, the lower first; all in counts.
    #[must_use]
    pub(crate) fn at_rest(units: DriveUnits, knots: Knots, reach: (f64, f64), position: i32) -> Self {
        let (place, course) = (f64::from(position), DriveCourse::at_rest(units, position));
        let (low, high) = (reach.0.max(f64::from(i32::MIN + 1)), reach.1.min(f64::from(i32::MAX - 1)));
        let reach = (low.min(place), high.max(place));
        Self { units, knots, reach, middles: [place; 4], before: place, late: 0.0, wanted: 3, course }
    }

    /// What the drive makes of the segments so far.
    #[must_use]
    pub(crate) const fn course(&self) -> DriveCourse {
        self.course
    }

    /// From the next slice on the drive's clock runs so fast against ours.
    pub(crate) fn set_clock(&mut self, clock: f64) {
        self.knots.set_clock(clock);
    }

    /// What was put in beside the segments made here lasted so many ticks, and the drive is on `course` behind all of them.
    pub(crate) fn put_in(&mut self, ticks: u32, course: DriveCourse) {
        self.knots.put_in(ticks);
        self.late += f64::from(ticks) / self.knots.slice();
        self.course = course;
    }

    /// Takes the middle of the next slice, in counts, and gives the segment of the one two before it, which is none before
    /// the third. One that is no number is as the one before.
    pub(crate) fn push(&mut self, middle: f64) -> Option<Segment> {
        let [_, a, b, c] = self.middles;
        self.middles = [a, b, c, if middle.is_finite() { middle } else { c }];
        self.wanted = self.wanted.saturating_sub(1);
        if self.wanted > 0 {
            return None;
        }
        let knot = self.knots.next();
        let segment = self.segment(knot);
        self.course = self.course.after(segment);
        Some(segment)
    }

    fn segment(&mut self, knot: Knot) -> Segment {
        let [a, b, c, d] = self.middles;
        let control = |a: f64, b: f64, c: f64| (1.25 * b - 0.125 * (a + c)).clamp(self.reach.0, self.reach.1);
        let (here, next) = (control(a, b, c), control(b, c, d));
        // Counts a slice, at the exact knots.
        let (begins, ends) = (here - self.before, next - here);
        let begun_at = (self.before + here) / 2.0 + begins * self.late;
        let lacks = begun_at - self.course.position();
        let ends = ends + (ends - begins) * knot.late;
        (self.before, self.late) = (here, knot.late);
        if [a, c, d].iter().all(|other| (other - b).abs() < STILL) {
            return self.arriving(here, knot.ticks);
        }
        self.moving(ends + MADE_UP * lacks, knot.ticks)
    }

    /// A ramp over all of its ticks, to a velocity in counts a slice.
    #[expect(clippy::cast_possible_truncation, reason = "within full scale")]
    #[expect(clippy::cast_sign_loss, reason = "a size")]
    fn moving(&self, velocity: f64, ticks: u32) -> Segment {
        const MOST: f64 = i32::MAX as f64;
        let wanted = (velocity / self.knots.slice() * self.units.per_count()).clamp(-MOST, MOST) as i64;
        let change = wanted - self.course.velocity();
        let span = i64::from(ticks.max(1));
        let acceleration = ((change.abs() + span / 2) / span).min(i64::from(MOST_ACCELERATION));
        let until = if acceleration < i64::from(LEAST_ACCELERATION) {
            // Too little to ramp over all of it.
            wanted
        } else {
            self.course.velocity() + change.signum() * acceleration * span
        };
        let until = until.clamp(-i64::from(i32::MAX), i64::from(i32::MAX));
        Segment::moving(ticks, acceleration as u32, self.directed(until))
    }

    /// A velocity that is 0 in mid-course still has the direction of the motion.
    #[expect(clippy::cast_possible_truncation, reason = "within full scale")]
    fn directed(&self, velocity: i64) -> i32 {
        if velocity == 0 && self.course.velocity() < 0 { -1 } else { velocity as i32 }
    }

    /// To rest at a place in counts, in all of its ticks.
    #[expect(clippy::cast_possible_truncation, reason = "inside the reach; saturating")]
    #[expect(clippy::cast_precision_loss, reason = "velocities are within full scale")]
    #[expect(clippy::cast_sign_loss, reason = "sizes")]
    fn arriving(&self, place: f64, ticks: u32) -> Segment {
        let place = place.round();
        let (distance, span) = (place - self.course.position(), f64::from(ticks.max(1)));
        let speed = self.course.velocity() as f64 / self.units.per_count();
        if self.course.velocity() == 0 && distance == 0.0 {
            return Segment::resting(ticks, place as i32);
        }
        // Held for a while, then ramped down, where that takes all of the ticks; ramped down at once where it is nearer.
        let ramped = distance.abs().min((speed * span).abs() - distance.abs());
        let acceleration = if speed * distance > 0.0 && ramped > 0.0 {
            speed * speed / (2.0 * ramped)
        } else {
            (4.0 * distance.abs() / span + speed.abs()) / span
        };
        let fastest = speed.abs().max(2.0 * distance.abs() / span);
        let units = |value: f64| (value * self.units.per_count()).ceil();
        Segment::to_rest(
            ticks,
            place as i32,
            (units(acceleration) as u32).min(MOST_ACCELERATION),
            units(fastest) as i32,
        )
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use proptest::prelude::*;

    use super::super::segment::End;
    use super::*;

    const STROKE: (f64, f64) = (0.0, 120_000.0);

    fn fit(hz: f64, position: i32) -> SegmentFit {
        let units = DriveUnits::of(4_000.0).expect("known");
        SegmentFit::at_rest(units, Knots::new(Duration::from_secs_f64(hz.recip())), STROKE, position)
    }

    /// Swings and rests, counts at a time in slices.
    fn course(at: f64) -> f64 {
        let swing = |rate: f64, size: f64| size * (1.0 - (at * rate).cos());
        let envelope = if at < 0.0 { 0.0 } else { 1.0 };
        envelope * (swing(0.1, 12_000.0) + swing(0.037, 9_000.0) + swing(0.29, 800.0))
    }

    #[test]
    fn after_twelve_minutes_the_drive_is_where_it_would_be_after_one_whatever_its_clock() {
        for clock in [1.0, 1.000_2, 0.999_8] {
            let (mut fit, mut worst, mut ticks) = (fit(25.0, 500), [0.0_f64; 12], 0);
            fit.set_clock(clock);
            for slice in 0..12 * 60 * 25_u32 {
                let Some(segment) = fit.push(500.0 + course(f64::from(slice) + 0.5)) else { continue };
                ticks += segment.ticks;
                // The knot by the drive's own clock.
                let knot = f64::from(ticks) * 120e-6 / clock * 25.0;
                let off = if slice > 100 { fit.course().position() - 500.0 - course(knot) } else { 0.0 };
                let minute = &mut worst[slice as usize / 1_500];
                *minute = minute.max(off.abs());
            }
            assert!(worst.iter().all(|worst| *worst < 0.3), "{clock}: {worst:?} counts");
        }
    }

    #[test]
    fn a_parabola_is_met_to_a_hundredth_of_a_count() {
        let parabola = |at: f64| 1_000.0 + 40.0 * at + 1.5 * at * at;
        let mut fit = fit(30.0, 1_000);
        for slice in 0..200_u32 {
            let made = fit.push(parabola(f64::from(slice) + 0.5));
            let at = f64::from(slice) - 1.0 + fit.late;
            if made.is_some() && slice > 40 {
                let off = fit.course().position() - parabola(at);
                assert!(off.abs() < 0.01, "{slice}: {off}");
            }
        }
    }

    #[test]
    fn where_the_course_stops_sharply_at_an_end_of_the_stroke_it_is_not_led_beyond() {
        let mut fit = fit(30.0, 8_000);
        for slice in 0..400_u32 {
            let down_and_up = 500.0 * (f64::from(slice % 40) - 20.0).abs() - 2_000.0;
            fit.push(down_and_up.max(0.0));
            let place = fit.course().position();
            assert!(place >= -0.5, "{slice}: {place}");
        }
    }

    #[test]
    fn it_begins_and_ends_at_rest_in_the_very_place() {
        let mut fit = fit(25.0, 500);
        let mut last = None;
        for slice in 0..60_u32 {
            let at = f64::from(slice.clamp(5, 50) - 5) / 45.0;
            let eased = 500.25 + 20_000.0 * at * at * at * (10.0 - at * (15.0 - 6.0 * at));
            last = fit.push(eased).or(last);
        }
        let (segment, course) = (last.expect("many"), fit.course());
        assert_eq!(segment, Segment::resting(segment.ticks, 20_500));
        assert_eq!((course.position(), course.velocity()), (20_500.0, 0));
    }

    proptest! {
        #[test]
        fn whatever_it_is_given_it_stays_in_the_stroke_and_in_what_a_drive_takes(
            poses in prop::collection::vec(prop_oneof![-1e4..130_000.0, Just(f64::NAN), Just(f64::MAX)], 3..200),
            hz in 10.0..200.0,
        ) {
            let mut fit = fit(hz, 60_000);
            for pose in poses {
                let Some(segment) = fit.push(pose) else { continue };
                let within = segment.velocity >= 0 && (2..=MOST_ACCELERATION).contains(&segment.acceleration);
                prop_assert!(within && segment.ticks > 0, "{segment:?}");
                prop_assert!(segment.end() != End::Moving(0));
            }
        }

        #[test]
        fn a_smooth_course_never_leaves_the_stroke(rates in (0.001..0.02_f64, 0.001..0.02_f64), hz in 10.0..90.0) {
            let mut fit = fit(hz, 0);
            for slice in 0..600 {
                let at = f64::from(slice);
                let pose = 60_000.0 * (1.0 - (at * rates.0).cos() * (at * rates.1).cos());
                fit.push(pose);
                let place = fit.course().position();
                prop_assert!((-1.0..=120_001.0).contains(&place), "{slice}: {place}");
            }
        }
    }
}
