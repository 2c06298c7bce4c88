//! The poses a lane was sent last, from which a brake knows how it moves, whatever led it there.

use std::time::Duration;

use crate::motion::{AxisState, MAX_AXES, Pose};

/// Poses kept: four of them, [`APART_S`] or one frame apart.
const KEPT: usize = 16;
/// How far apart the poses are that speed and acceleration are taken from, seconds, where frames come more often.
const APART_S: f64 = 0.005;

/// The last poses of one lane and their show times, seconds.
#[derive(Debug, Clone)]
pub(super) struct Trail {
    poses: [Pose; KEPT],
    times: [f64; KEPT],
    newest: usize,
}

impl Trail {
    /// A lane that has been at rest.
    pub(super) fn at_rest(pose: Pose) -> Self {
        let mut trail = Self { poses: [pose; KEPT], times: [0.0; KEPT], newest: 0 };
        trail.rest(pose);
        trail
    }

    /// The lane has been at rest there for a while.
    pub(super) fn rest(&mut self, pose: Pose) {
        self.poses = [pose; KEPT];
        for (age, time) in (0_u32..).zip(self.times.iter_mut().rev()) {
            // Apart by anything: slopes over poses of the same time would be 0 by 0.
            *time = -f64::from(age);
        }
        self.newest = KEPT - 1;
    }

    /// It was sent another pose, to be reached in `time`.
    pub(super) fn push(&mut self, time: Duration, pose: Pose) {
        let now = self.times[self.newest] + time.as_secs_f64();
        self.newest = (self.newest + 1) % KEPT;
        (self.times[self.newest], self.poses[self.newest]) = (now, pose);
    }

    /// The pose sent last.
    pub(super) const fn pose(&self) -> &Pose {
        &self.poses[self.newest]
    }

    /// The one before it.
    pub(super) const fn before(&self) -> &Pose {
        &self.poses[(self.newest + KEPT - 1) % KEPT]
    }

    /// How each slot moves as it reaches that pose: the cubic through four poses, right at its end.
    pub(super) fn states(&self) -> [AxisState; MAX_AXES] {
        let apart = self.apart();
        let at = |back: usize| (self.newest + KEPT - back * apart) % KEPT;
        let [a, b, c, d] = [0, 1, 2, 3].map(at);
        let [ta, tb, tc, td] = [a, b, c, d].map(|place| self.times[place]);
        let mut states = [AxisState::default(); MAX_AXES];
        for (axis, state) in states.iter_mut().enumerate() {
            let [pa, pb, pc, pd] = [a, b, c, d].map(|place| self.poses[place][axis]);
            let (ab, bc, cd) = ((pa - pb) / (ta - tb), (pb - pc) / (tb - tc), (pc - pd) / (tc - td));
            let (abc, bcd) = ((ab - bc) / (ta - tc), (bc - cd) / (tb - td));
            let abcd = (abc - bcd) / (ta - td);
            let (since_b, since_c) = (ta - tb, ta - tc);
            *state = AxisState {
                position: pa,
                velocity: ab + since_b * (abc + since_c * abcd),
                acceleration: 2.0 * (abc + (since_b + since_c) * abcd),
            };
        }
        states
    }

    /// How fast each slot went to that pose: the mean of the newest frames that together took `seconds`, or of the newest one
    /// where that took longer.
    pub(super) fn speed(&self, seconds: f64) -> Pose {
        let mut ages = (1..KEPT).map(|back| (self.newest + KEPT - back) % KEPT);
        let since = |place: usize| self.times[self.newest] - self.times[place];
        // Whole milliseconds may fall short of a period, and the oldest of a thousand frames a second is 15 ms back.
        let is_enough = |place: &usize| since(*place) >= 0.9 * seconds;
        let from = ages.clone().find(is_enough).or_else(|| ages.next_back());
        let mut speed = [0.0; MAX_AXES];
        if let Some(from) = from {
            for (axis, speed) in speed.iter_mut().enumerate() {
                *speed = (self.pose()[axis] - self.poses[from][axis]) / since(from);
            }
        }
        speed
    }

    /// How many frames make [`APART_S`]; one where they come less often, five at the most.
    fn apart(&self) -> usize {
        let before = (self.newest + KEPT - 1) % KEPT;
        let frame = self.times[self.newest] - self.times[before];
        (1..=KEPT / 3).rev().find(|apart| apart_s(*apart, frame) <= APART_S * 1.01).unwrap_or(1)
    }
}

#[expect(clippy::cast_precision_loss, reason = "five at the most")]
fn apart_s(frames: usize, frame_s: f64) -> f64 {
    frames as f64 * frame_s
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x = 0.1 + 0.2 t - 0.5 t² + 2 t³ at the end of a second, frames of those Times.
    fn at_the_end(times: &[u32]) -> AxisState {
        let x = |t: f64| 0.1 + t * (0.2 + t * (2.0 * t - 0.5));
        let mut trail = Trail::at_rest([0.1; MAX_AXES]);
        let mut ms = 0;
        for time in times.iter().cycle() {
            ms += time;
            trail.push(Duration::from_millis(u64::from(*time)), [x(f64::from(ms) * 1e-3); MAX_AXES]);
            if ms >= 1000 {
                break;
            }
        }
        assert_eq!(ms, 1000);
        trail.states()[0]
    }

    #[test]
    fn a_cubic_is_known_exactly_whatever_the_times_of_its_frames() {
        for times in [&[1][..], &[10], &[17, 17, 16], &[2, 1, 2], &[100]] {
            let state = at_the_end(times);
            let expected = AxisState { position: 1.8, velocity: 5.2, acceleration: 11.0 };
            assert!((state.position - expected.position).abs() < 1e-9, "{times:?}: {state:?}");
            assert!((state.velocity - expected.velocity).abs() < 1e-6, "{times:?}: {state:?}");
            assert!((state.acceleration - expected.acceleration).abs() < 1e-4, "{times:?}: {state:?}");
        }
    }

    #[test]
    fn its_speed_is_the_mean_of_so_long_and_that_of_a_long_frame_alone() {
        let mut trail = Trail::at_rest([0.0; MAX_AXES]);
        for place in [0.01, 0.03, 0.06] {
            trail.push(Duration::from_millis(10), [place; MAX_AXES]);
        }
        assert!((trail.speed(0.020)[0] - 2.5).abs() < 1e-9, "{}", trail.speed(0.020)[0]);
        trail.push(Duration::from_millis(100), [0.16; MAX_AXES]);
        assert!((trail.speed(0.020)[0] - 1.0).abs() < 1e-9, "{}", trail.speed(0.020)[0]);
    }

    #[test]
    fn its_poses_are_5_ms_apart_as_far_as_its_frames_let_them_be() {
        for (time_ms, apart) in [(1, 5), (2, 2), (3, 1), (5, 1), (10, 1)] {
            let mut trail = Trail::at_rest([0.0; MAX_AXES]);
            (0..KEPT).for_each(|_| trail.push(Duration::from_millis(time_ms), [0.5; MAX_AXES]));
            assert_eq!(trail.apart(), apart, "{time_ms} ms");
        }
    }

    #[test]
    fn a_lane_that_rested_does_not_move() {
        let mut trail = Trail::at_rest([0.4; MAX_AXES]);
        trail.push(Duration::from_millis(10), [0.5; MAX_AXES]);
        trail.rest([0.5; MAX_AXES]);
        assert_eq!(trail.states()[0], AxisState::at_rest(0.5));
    }
}
