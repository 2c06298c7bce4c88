//! What a drive makes of segments, in whole numbers as the drive counts, so that nothing drifts between it and us.
//!
//! In each tick it is taken to move by the mean of the velocities at its ends. A drive that counts one or the other of them
//! is off by half the velocity, in counts a tick, and comes back from that as it comes to rest.

use super::segment::{End, Segment};

/// Nanoseconds of a drive's tick.
pub(crate) const TICK_NS: u32 = 120_000;

/// How a drive counts: 2 to the power of this, in velocity units, is a count a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DriveUnits {
    bits: u32,
}

/// Where the target of a drive is, and how fast it moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct DriveCourse {
    units: DriveUnits,
    /// Velocity units, positive upwards.
    velocity: i64,
    /// Twice the sum of the velocity over all ticks, since half of one is no whole number.
    twice: i64,
}

impl DriveUnits {
    /// Of a drive with so many counts a turn; none where full velocity is no power of two there.
    #[must_use]
    pub(crate) fn of(counts_per_turn: f64) -> Option<Self> {
        // Full velocity, 4,000 turns a minute, is 32 counts a tick at 4,000 counts a turn (command reference, page 11).
        let known = [(4_000.0, 26), (8_000.0, 25), (16_000.0, 24)];
        known.into_iter().find(|(counts, _)| *counts == counts_per_turn).map(|(_, bits)| Self { bits })
    }

    /// Velocity units of a count a tick; also what one of acceleration is in counts a tick squared.
    #[must_use]
    pub(crate) fn per_count(self) -> f64 {
        f64::from(1_u32 << self.bits)
    }
}

impl DriveCourse {
    /// At rest at a place in counts.
    #[must_use]
    pub(crate) fn at_rest(units: DriveUnits, position: i32) -> Self {
        Self { units, velocity: 0, twice: i64::from(position) << (units.bits + 1) }
    }

    /// The place, counts.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "to some billionths of a count")]
    pub(crate) fn position(&self) -> f64 {
        self.twice as f64 / (2.0 * self.units.per_count())
    }

    /// The velocity in units, positive upwards; within full scale.
    #[must_use]
    pub(crate) const fn velocity(&self) -> i64 {
        self.velocity
    }

    /// After the whole segment.
    #[must_use]
    pub(crate) fn after(&self, segment: Segment) -> Self {
        self.within(segment, segment.ticks)
    }

    /// After so many ticks of a segment, at most all.
    #[must_use]
    pub(crate) fn within(&self, segment: Segment, ticks: u32) -> Self {
        let ticks = ticks.min(segment.ticks);
        match segment.end() {
            End::Moving(velocity) => {
                let mut course = *self;
                course.ramp(i64::from(velocity), i64::from(segment.acceleration), i64::from(ticks));
                course
            }
            End::AtRest(position) if ticks == segment.ticks => Self::at_rest(self.units, position),
            End::AtRest(position) => self.coming_to_rest(position, segment.ticks, ticks),
        }
    }

    /// To a velocity by whole steps of an acceleration, the last one shorter, then at that.
    fn ramp(&mut self, until: i64, acceleration: i64, ticks: i64) {
        let change = until - self.velocity;
        let whole = (change.abs() / acceleration.max(1)).min(ticks);
        self.go(self.velocity + change.signum() * acceleration * whole, whole);
        let left = ticks - whole;
        self.go(until, left.min(1));
        self.go(until, (left - 1).max(0));
    }

    /// Straight to a velocity in so many ticks.
    fn go(&mut self, until: i64, ticks: i64) {
        if ticks > 0 {
            self.twice = self.twice.saturating_add(ticks.saturating_mul(self.velocity + until));
            self.velocity = until;
        }
    }

    /// On the parabola that ends at rest at a place: what a drive does whose distance, time and velocity fit each other.
    #[expect(clippy::cast_possible_truncation, reason = "within full scale, else saturating")]
    fn coming_to_rest(&self, position: i32, of: u32, ticks: u32) -> Self {
        let left = f64::from(of - ticks) / f64::from(of);
        let distance = f64::from(position) - self.position();
        let at = f64::from(position) - distance * left * left;
        let velocity = 2.0 * distance * left / f64::from(of) * self.units.per_count();
        let twice = (at * 2.0 * self.units.per_count()).round() as i64;
        Self { velocity: velocity.round() as i64, twice, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const UNITS: DriveUnits = DriveUnits { bits: 26 };

    /// What a drive does tick by tick, and the same where it counts the velocity before or after each step: twice the sums.
    fn tick_by_tick(segments: &[Segment]) -> (i64, [i64; 3]) {
        let (mut velocity, mut sums) = (0_i64, [0_i64; 3]);
        for segment in segments {
            let End::Moving(until) = segment.end() else { panic!("{segment:?} rests") };
            for _ in 0..segment.ticks {
                let most = i64::from(segment.acceleration);
                let next = velocity + (i64::from(until) - velocity).clamp(-most, most);
                for (sum, moved) in sums.iter_mut().zip([velocity + next, 2 * velocity, 2 * next]) {
                    *sum += moved;
                }
                velocity = next;
            }
        }
        (velocity, sums)
    }

    fn segments() -> impl Strategy<Value = Vec<Segment>> {
        let one = (1_u32..400, 2_u32..40_000_000, -i32::MAX..=i32::MAX);
        prop::collection::vec(one.prop_map(|(t, a, v)| Segment::moving(t, a, v)), 1..40)
    }

    proptest! {
        #[test]
        fn the_model_is_what_a_drive_sums_up_tick_by_tick(segments in segments()) {
            let from = DriveCourse::at_rest(UNITS, 0);
            let course = segments.iter().fold(from, |course, segment| course.after(*segment));
            let (velocity, [mean, before, after]) = tick_by_tick(&segments);
            prop_assert_eq!((course.velocity, course.twice), (velocity, mean));
            // The order of a drive's integration is unknown: it makes half a velocity and no more.
            prop_assert_eq!((mean - before, after - mean), (velocity, velocity));
        }

        #[test]
        fn a_segment_in_two_parts_is_the_whole(segments in segments(), part in 0_u32..400) {
            let whole = segments.iter().fold(DriveCourse::at_rest(UNITS, 9), |at, segment| at.after(*segment));
            let halves = |at: DriveCourse, segment: &Segment| {
                let first = Segment { ticks: part.min(segment.ticks), ..*segment };
                at.after(first).after(Segment { ticks: segment.ticks - first.ticks, ..*segment })
            };
            prop_assert_eq!(segments.iter().fold(DriveCourse::at_rest(UNITS, 9), halves), whole);
        }
    }

    #[test]
    fn full_velocity_is_4000_turns_a_minute() {
        for counts in [4_000.0, 8_000.0, 16_000.0] {
            let units = DriveUnits::of(counts).expect("known");
            let tick = f64::from(i32::MAX) / units.per_count();
            let turns = tick / counts / f64::from(TICK_NS) * 60e9;
            assert!((turns - 4_000.0).abs() < 0.01, "{turns}");
        }
        assert_eq!(DriveUnits::of(10_000.0), None);
    }

    #[test]
    fn a_segment_that_comes_to_rest_ends_at_its_place_whatever_came_before() {
        let moving = DriveCourse::at_rest(UNITS, 100).after(Segment::moving(200, 2_000_000, 400_000_000));
        let to_rest = Segment::to_rest(200, 1_292, 2_000_000, 400_000_000);
        let half = moving.within(to_rest, 100);
        assert_eq!(moving.after(to_rest), DriveCourse::at_rest(UNITS, 1_292));
        assert!((half.velocity() - 200_000_000).abs() < 200_000, "{half:?}");
        assert!((half.position() - moving.position() - 447.0).abs() < 0.5, "{half:?}");
    }
}
