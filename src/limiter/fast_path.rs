//! The quick test that nearly every pose passes, from frame to frame alone.
//!
//! A divided difference over a distance is a mean of the differences from frame to frame inside it, each with a weight of
//! at most two over the distance in periods. So where acceleration and jerk from frame to frame stay below a level, or are above it
//! by little in sum over what the measure looks back on, the measure sees less than the limits; and will still do so if
//! next frame the axis begins to brake with no more than the level. Nothing of this is a guess: what is not sure by these
//! sums goes to the long test.

use super::limits::AxisLimits;
use crate::motion::{AxisState, MAX_AXES, Pose, Spacing};

// Any shares below 1 are right; why these: docs/limiter.md, section 3.
/// Shares of the acceleration and of the jerk up to which frames are calm, and with which an axis is thought to brake.
pub(super) const LEVEL: (f64, f64) = (0.9, 0.8);

/// Axes that are judged together: what one instruction of the processor takes.
const WIDTH: usize = 2;
/// Groups of so many that a lane has at the most.
const GROUPS: usize = MAX_AXES / WIDTH;

/// A number for each axis of a group.
type GroupRow = [f64; WIDTH];

/// Limits of a group of axes, each in a row of its own; none for axes that a lane does not have.
#[derive(Debug, Clone, Copy)]
struct GroupRows {
    velocity: GroupRow,
    step: GroupRow,
    acceleration: GroupRow,
    jerk: GroupRow,
    /// What sums of acceleration and of jerk beyond the level may come to.
    rest: [GroupRow; 2],
    /// For the way to rest: half of 1 / jerk, half of 1 / acceleration, half of acceleration / jerk, at the level.
    half_per_jerk: GroupRow,
    half_per_acceleration: GroupRow,
    half_rise: GroupRow,
}

/// A group of axes: what it may do, and what is known of it from frame to frame. What one frame needs of it lies together.
#[derive(Debug, Clone, Copy)]
struct AxisGroup {
    rows: GroupRows,
    position: GroupRow,
    velocity: GroupRow,
    acceleration: GroupRow,
    /// Sums beyond the level in the present stretch of frames and in the one before: acceleration, jerk.
    sums: [[GroupRow; 2]; 2],
}

/// What one more frame makes of an axis, frame to frame.
#[derive(Debug, Clone, Copy)]
struct Glance {
    velocity: f64,
    acceleration: f64,
    /// Acceleration and jerk beyond the level.
    beyond: [f64; 2],
    /// At the pose itself, of the cubic through the newest four.
    speed: f64,
    pull: f64,
    calm: bool,
}

/// Seconds and their reciprocals: of the newest frame, and together with one and two before it.
#[derive(Debug, Clone, Copy, Default)]
struct FrameSpans {
    /// The Times they are of, newest first.
    times: [f64; 3],
    frame: f64,
    two: f64,
    per_frame: f64,
    double_per_two: f64,
    triple_per_three: f64,
}

/// What is known from frame to frame of all axes of a lane.
#[derive(Debug, Clone)]
pub(super) struct FastPath {
    groups: [AxisGroup; GROUPS],
    /// How many of them the lane has.
    used: usize,
    /// Frames of a stretch, no less than the measure looks back on; and those left of the present one.
    stretch: usize,
    left: usize,
    /// Times of the newest frames, s, newest first.
    times: [f64; 2],
    spans: FrameSpans,
}

impl FastPath {
    #[expect(clippy::cast_precision_loss, reason = "1 to 20")]
    pub(super) fn new<'a>(
        limits: impl Iterator<Item = &'a AxisLimits>,
        spacing: Spacing,
        pose: Pose,
        usual: f64,
    ) -> Self {
        let mut groups = [AxisGroup::WITHOUT_AXES; GROUPS];
        let mut axes = 0;
        for (axis, limits) in limits.enumerate() {
            groups[axis / WIDTH].rows.limit(axis % WIDTH, limits, spacing.n as f64);
            axes = axis + 1;
        }
        // The present stretch and the one before are summed, so at least one whole one: more than a difference spans.
        let stretch = 3 * spacing.m + 1;
        let mut calm = Self {
            groups,
            used: axes.div_ceil(WIDTH),
            stretch,
            left: stretch,
            times: [usual; 2],
            spans: FrameSpans::default(),
        };
        calm.rest(pose, usual);
        calm
    }

    /// All stand in `pose`, and have for long.
    pub(super) fn rest(&mut self, pose: Pose, usual: f64) {
        for (group, position) in self.groups.iter_mut().zip(in_groups(&pose)) {
            *group = AxisGroup { rows: group.rows, position: *position, ..AxisGroup::WITHOUT_AXES };
        }
        self.left = self.stretch;
        self.times = [usual; 2];
        self.look_at_times(usual);
    }

    fn look_at_times(&mut self, frame: f64) {
        // All divisions are made here, where a Time differs from those before: a pose only multiplies.
        let two = frame + self.times[0];
        self.spans = FrameSpans {
            times: [frame, self.times[0], self.times[1]],
            frame,
            two,
            per_frame: 1.0 / frame,
            double_per_two: 2.0 / two,
            triple_per_three: 3.0 / (two + self.times[1]),
        };
    }

    /// Tells of the frame that comes next.
    #[inline]
    pub(super) fn begin(&mut self, frame: f64) {
        let times = [frame, self.times[0], self.times[1]];
        if times != self.spans.times {
            self.look_at_times(frame);
        }
    }

    /// Takes `pose` if it is calm on all axes; true if it was.
    #[inline]
    pub(super) fn admit_calm(&mut self, pose: &Pose) -> bool {
        let (seen, calm) = self.see(pose);
        if calm {
            self.keep(pose, &seen);
        }
        calm
    }

    /// True if an axis is calm at that position.
    pub(super) fn is_calm(&self, axis: usize, position: f64) -> bool {
        self.groups[axis / WIDTH].glance::<true>(axis % WIDTH, position, &self.spans).calm
    }

    /// How an axis moves that lacks nothing at that position but the way to rest of one that is calm; none where it lacks more.
    pub(super) fn bounded(&self, axis: usize, position: f64) -> Option<AxisState> {
        // A parameter of the type, not of the call: for calm poses, which are nearly all, the loop stays one of vectors, and what is not
        // asked there costs nothing.
        let glance = self.groups[axis / WIDTH].glance::<false>(axis % WIDTH, position, &self.spans);
        let Glance { speed, pull, calm, .. } = glance;
        calm.then_some(AxisState { position, velocity: speed, acceleration: pull })
    }

    /// Takes what is sent, calm or not.
    pub(super) fn take(&mut self, pose: &Pose) {
        // What the long test let pass counts as well: the measure sees it for just as long.
        let (seen, _) = self.see(pose);
        self.keep(pose, &seen);
    }

    /// What that pose makes of all axes, and whether they are calm.
    #[inline(always)]
    fn see(&self, pose: &Pose) -> ([GroupSeen; GROUPS], bool) {
        let mut seen = [GroupSeen::NOTHING; GROUPS];
        let mut calm = true;
        for ((seen, group), position) in seen.iter_mut().zip(&self.groups[..self.used]).zip(in_groups(pose)) {
            calm &= group.see(position, &self.spans, seen);
        }
        (seen, calm)
    }

    #[inline]
    fn keep(&mut self, pose: &Pose, seen: &[GroupSeen; GROUPS]) {
        self.left -= 1;
        let ends = self.left == 0;
        if ends {
            self.left = self.stretch;
        }
        for ((group, seen), position) in self.groups[..self.used].iter_mut().zip(seen).zip(in_groups(pose)) {
            group.position = *position;
            group.keep(seen, ends);
        }
        self.times = [self.spans.frame, self.times[0]];
    }
}

fn in_groups(pose: &Pose) -> &[GroupRow] {
    pose.as_chunks().0
}

impl GroupRows {
    /// Nothing is asked of an axis that there is not.
    const ANY: Self = {
        let (none, any) = ([0.0; WIDTH], [f64::INFINITY; WIDTH]);
        Self {
            velocity: any,
            step: any,
            acceleration: any,
            jerk: any,
            rest: [any; 2],
            half_per_jerk: none,
            half_per_acceleration: none,
            half_rise: none,
        }
    };

    fn limit(&mut self, axis: usize, limits: &AxisLimits, apart: f64) {
        let (acceleration, jerk) = (LEVEL.0 * limits.acceleration, LEVEL.1 * limits.jerk);
        self.velocity[axis] = limits.velocity;
        self.step[axis] = limits.step;
        self.acceleration[axis] = acceleration;
        self.jerk[axis] = jerk;
        // No frame weighs more than 2/n in a difference, Times of 1 and 2 ms in turns included (docs/limiter.md, section 2).
        self.rest[0][axis] = (limits.acceleration - acceleration) * apart / 2.0;
        self.rest[1][axis] = (limits.jerk - jerk) * apart / 2.0;
        self.half_per_jerk[axis] = 0.5 / jerk;
        self.half_per_acceleration[axis] = 0.5 / acceleration;
        self.half_rise[axis] = 0.5 * acceleration / jerk;
    }

    /// At least the way to rest from the speed that is left when an acceleration is gone.
    #[inline(always)]
    fn way(&self, axis: usize, speed: f64, acceleration: f64) -> f64 {
        // Let go at full speed, then stop: exact with a hold, more than the way without one (docs/limiter.md, section 3).
        speed
            * (2.0 * acceleration * self.half_per_jerk[axis]
                + speed * self.half_per_acceleration[axis]
                + self.half_rise[axis])
    }
}

impl AxisGroup {
    const WITHOUT_AXES: Self = {
        let none = [0.0; WIDTH];
        Self {
            rows: GroupRows::ANY,
            position: none,
            velocity: none,
            acceleration: none,
            sums: [[none; 2]; 2],
        }
    };

    /// What one more frame makes of its axes; says whether they are calm.
    #[inline(always)]
    fn see(&self, position: &GroupRow, spans: &FrameSpans, seen: &mut GroupSeen) -> bool {
        let mut calm = true;
        for (axis, &position) in position.iter().enumerate() {
            let glance = self.glance::<true>(axis, position, spans);
            seen.velocity[axis] = glance.velocity;
            seen.acceleration[axis] = glance.acceleration;
            seen.beyond[0][axis] = glance.beyond[0];
            seen.beyond[1][axis] = glance.beyond[1];
            calm &= glance.calm;
        }
        calm
    }

    /// Takes what was seen; a stretch ends with it, or not.
    #[inline(always)]
    fn keep(&mut self, seen: &GroupSeen, ends: bool) {
        self.velocity = seen.velocity;
        self.acceleration = seen.acceleration;
        for (sum, beyond) in self.sums[0].iter_mut().flatten().zip(seen.beyond.iter().flatten()) {
            *sum += beyond;
        }
        if ends {
            // Begun anew, not subtracted from: over hours of that the sums would gather rounding.
            self.sums = [[[0.0; WIDTH]; 2], self.sums[0]];
        }
    }

    /// What one more frame makes of an axis; without `ROOM` it is calm wherever it comes to rest.
    #[inline(always)]
    #[expect(clippy::manual_range_contains, reason = "without a branch the loops around it become vectors")]
    fn glance<const ROOM: bool>(&self, axis: usize, position: f64, spans: &FrameSpans) -> Glance {
        let rows = &self.rows;
        let velocity = (position - self.position[axis]) * spans.per_frame;
        let change = velocity - self.velocity[axis];
        let acceleration = change * spans.double_per_two;
        let jerk = (acceleration - self.acceleration[axis]) * spans.triple_per_three;
        // Here `max` makes 0 of what is no number; such a pose fails the comparisons below.
        let beyond = [
            (acceleration.abs() - rows.acceleration[axis]).max(0.0),
            (jerk.abs() - rows.jerk[axis]).max(0.0),
        ];
        // At the pose itself, of the cubic through the newest four: a brake from there has no jump of acceleration in it.
        let speed = velocity + spans.frame * (0.5 * acceleration + spans.two * jerk * (1.0 / 6.0));
        let pull = acceleration + (spans.frame + spans.two) * jerk * (1.0 / 3.0);
        let (rising, falling) = (pull.max(0.0), (-pull).max(0.0));
        let up = speed.max(0.0) + rising * rising * rows.half_per_jerk[axis];
        let down = (-speed).max(0.0) + falling * falling * rows.half_per_jerk[axis];
        // Limits without their slack: what is that close is for the long test. The
        // ways may end 1e-9 outside, a matter of last bits, as a brake is held inside.
        // A brake from here is seen together with old poses by one more acceleration, and by fewer than three more jerks
        // (docs/limiter.md, section 3).
        let calm = (self.sums[0][0][axis] + self.sums[1][0][axis] + 2.0 * beyond[0] <= rows.rest[0][axis])
            & (self.sums[0][1][axis] + self.sums[1][1][axis] + 4.0 * beyond[1] <= rows.rest[1][axis])
            & (pull.abs() <= rows.acceleration[axis])
            & (change.abs() <= rows.step[axis])
            & (velocity.abs() <= rows.velocity[axis])
            & (up.max(down) <= rows.velocity[axis])
            & (position >= 0.0)
            & (position <= 1.0)
            & (!ROOM | (position + rows.way(axis, up, rising) <= 1.0 + 1e-9))
            & (!ROOM | (position - rows.way(axis, down, falling) >= -1e-9));
        Glance { velocity, acceleration, beyond, speed, pull, calm }
    }
}

/// What was seen of a group of axes.
#[derive(Clone, Copy)]
struct GroupSeen {
    velocity: GroupRow,
    acceleration: GroupRow,
    beyond: [GroupRow; 2],
}

impl GroupSeen {
    const NOTHING: Self =
        Self { velocity: [0.0; WIDTH], acceleration: [0.0; WIDTH], beyond: [[0.0; WIDTH]; 2] };
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::history::Reciprocals;
    use super::super::times::FrameTimes;
    use super::*;
    use crate::time::Rate;

    /// What the newest of the differences of that order is, where poses are as `x` says.
    fn over(apart: usize, order: usize, at: &[f64], x: impl Fn(usize) -> f64) -> f64 {
        let newest = at.len() - 1;
        // Of an acceleration, nothing is asked of the fourth pose.
        let places = [0, 1, 2, 3].map(|count| newest.saturating_sub(count * apart));
        let mut seconds = places.map(|place| at[place]);
        if order == 2 {
            seconds[3] = seconds[2] - 1.0;
        }
        let shown = Reciprocals::new(apart, seconds).show(places.map(x));
        if order == 2 { shown.acceleration } else { shown.jerk }
    }

    const HZ: f64 = 100.0;

    /// The frame at rest at which an axis is calm again that was off its place for one frame, after so many in it.
    fn calm_again_after(limits: &AxisLimits, off: f64, rested: usize) -> Option<usize> {
        let at = |place: f64| {
            let mut pose = [0.0; MAX_AXES];
            pose[0] = place;
            pose
        };
        let mut path = FastPath::new(std::iter::once(limits), Spacing::at_rate(HZ), at(0.5), 0.01);
        (0..rested).for_each(|_| path.take(&at(0.5)));
        path.take(&at(0.5 + off));
        // The fourth difference is of poses that are all in one place.
        (0..3).for_each(|_| path.take(&at(0.5)));
        (0..1_000).find(|_| {
            let is_calm = path.is_calm(0, 0.5);
            path.take(&at(0.5));
            is_calm
        })
    }

    #[test]
    fn what_was_above_the_level_counts_for_as_long_as_the_measure_looks_back_whenever_it_was() {
        let Spacing { m, .. } = Spacing::at_rate(HZ);
        let any = AxisLimits { velocity: 1e3, acceleration: 1e9, jerk: 1e9, step: 1e3 };
        // One that jumps so is above twice the level of one of them, and far below that of the other.
        let tight =
            [(AxisLimits { acceleration: 1.0, ..any }, 2e-4), (AxisLimits { jerk: 1.0, ..any }, 2e-6)];
        for (limits, off) in tight {
            for rested in 0..2 * (3 * m + 1) {
                let calm = calm_again_after(&limits, off, rested);
                let looks_back = 3 * m - 2..2 * (3 * m + 1);
                assert!(
                    calm.is_some_and(|calm| looks_back.contains(&calm)),
                    "{calm:?} after {rested}: {limits:?}"
                );
            }
        }
    }

    proptest! {
        #[test]
        fn a_difference_over_a_distance_is_a_mean_of_those_from_frame_to_frame_none_of_which_weighs_more_than_is_allowed_for(
            millihertz in prop_oneof![1_000..1_000_000_u32, 400_000..1_000_000_u32], start in 0..100_000_u64,
        ) {
            let rate = Rate::from_hz(f64::from(millihertz) * 1e-3);
            let spacing = Spacing::at_rate(rate.hz());
            let most = 2.0 / f64::from(u32::try_from(spacing.n).expect("1 to 20"));
            for (apart, order) in [(spacing.n, 2), (spacing.m, 2), (spacing.n, 3), (spacing.m, 3)] {
                let mut times = FrameTimes::new(rate);
                let mut at = vec![0.0];
                for frame in 0..order * apart {
                    at.push(at[frame] + f64::from(times.of(start + frame as u64)) * 1e-3);
                }
                let mut sum = 0.0;
                for first in 0..=at.len() - 1 - order {
                    // Of such a curve one difference from frame to frame alone is not 0: that of the poses from `first` on.
                    let (b, c) = (at[first + 1], at[first + order - 1]);
                    let bent = |k: usize| match order {
                        _ if k < first + order => 0.0,
                        2 => at[k] - b,
                        _ => (at[k] - b) * (at[k] - c),
                    };
                    let few: Vec<f64> = at[first..=first + order].to_vec();
                    let one = over(1, order, &few, |k| bent(first + k));
                    let weight = over(apart, order, &at, bent) / one;
                    prop_assert!((-1e-6..=most).contains(&weight), "{weight} at {first}");
                    sum += weight;
                }
                prop_assert!((sum - 1.0).abs() < 1e-6, "{sum}");
            }
        }
    }
}
