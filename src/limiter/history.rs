//! The poses that a lane was sent, and the differences that the next one makes with them.

use crate::motion::{Pose, Spacing};

/// Rows of the ring: a power of two that holds what a third difference spans, 3 x 27 periods and its own end.
const ROWS: usize = 128;

/// Poses and when they are reached, newest last. Never allocates.
#[derive(Debug, Clone)]
pub(super) struct PoseHistory {
    spacing: Spacing,
    poses: [Pose; ROWS],
    at_ms: [i64; ROWS],
    newest: usize,
    /// Frames in a row with the same Time.
    even: usize,
    /// Those of frames of that Time, once all that they span have it.
    differences: Option<[Reciprocals; 2]>,
}

/// The reciprocals that the differences of four poses need: of the times between them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reciprocals {
    /// Periods from one pose to the next.
    pub(super) apart: usize,
    /// Seconds from the newest pose back to the second and to the third.
    spans: [f64; 2],
    slopes: [f64; 3],
    seconds: [f64; 2],
    third: f64,
}

/// What four poses show.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shown {
    pub(super) slope: f64,
    /// Twice the second divided difference of the newest three.
    pub(super) acceleration: f64,
    /// Six times the third divided difference.
    pub(super) jerk: f64,
}

impl Reciprocals {
    /// For poses at these seconds, newest first.
    pub(super) fn new(apart: usize, at: [f64; 4]) -> Self {
        Self {
            apart,
            spans: [at[0] - at[1], at[0] - at[2]],
            slopes: [1.0 / (at[0] - at[1]), 1.0 / (at[1] - at[2]), 1.0 / (at[2] - at[3])],
            seconds: [2.0 / (at[0] - at[2]), 2.0 / (at[1] - at[3])],
            third: 3.0 / (at[0] - at[3]),
        }
    }

    /// What poses show, newest first.
    #[inline]
    pub(super) fn show(&self, x: [f64; 4]) -> Shown {
        // Reciprocals are kept: of frames with even Times they are the same each tick.
        let slope = (x[0] - x[1]) * self.slopes[0];
        let before = (x[1] - x[2]) * self.slopes[1];
        let earliest = (x[2] - x[3]) * self.slopes[2];
        let acceleration = (slope - before) * self.seconds[0];
        let earlier = (before - earliest) * self.seconds[1];
        Shown { slope, acceleration, jerk: (acceleration - earlier) * self.third }
    }

    /// Velocity and acceleration at the newest pose, of the cubic through all four.
    #[inline]
    pub(super) fn newest(&self, shown: Shown) -> (f64, f64) {
        let [one, two] = self.spans;
        // Newton's form of the cubic, differentiated at the newest of its nodes.
        let velocity = shown.slope + one * (shown.acceleration / 2.0 + two * shown.jerk / 6.0);
        (velocity, shown.acceleration + (one + two) * shown.jerk / 3.0)
    }
}

impl PoseHistory {
    /// At rest in a pose all along.
    pub(super) fn new(spacing: Spacing, pose: Pose, period_ms: u32) -> Self {
        let mut history =
            Self { spacing, poses: [pose; ROWS], at_ms: [0; ROWS], newest: 0, even: 0, differences: None };
        history.rest(pose, period_ms);
        history
    }

    /// Forgets what was before: the lane has stood in `pose` for long.
    pub(super) fn rest(&mut self, pose: Pose, period_ms: u32) {
        self.poses = [pose; ROWS];
        self.newest = ROWS - 1;
        self.even = 0;
        self.differences = None;
        // As if frames had held it there all along: what comes first is measured against rest.
        for (at, back) in self.at_ms.iter_mut().rev().zip(0..) {
            *at = -back * i64::from(period_ms);
        }
    }

    /// The pose `back` frames before the one that is being judged.
    #[inline]
    pub(super) fn before(&self, back: usize) -> &Pose {
        &self.poses[self.row(back)]
    }

    /// Seconds from the pose `back` frames before up to the one that is being judged, which is reached `time_ms` after
    /// the newest.
    #[expect(clippy::cast_precision_loss, reason = "some seconds")]
    pub(super) fn seconds_since(&self, back: usize, time_ms: u32) -> f64 {
        let passed = self.at_ms[self.row(1)] - self.at_ms[self.row(back)];
        if back == 0 { 0.0 } else { (passed + i64::from(time_ms)) as f64 * 1e-3 }
    }

    #[inline]
    const fn row(&self, back: usize) -> usize {
        // It may wrap below 0: ROWS divides 2^64, so that the row is right all the same.
        (self.newest + 1).wrapping_sub(back) % ROWS
    }

    /// The two differences that a pose reached `time_ms` after the newest makes.
    pub(super) fn differences(&mut self, time_ms: u32) -> [Reciprocals; 2] {
        // All 3 m Times of the longest difference are this one then: nothing has to be divided anew.
        let even = self.even > 3 * self.spacing.m && self.last_time() == i64::from(time_ms);
        if let (true, Some(differences)) = (even, self.differences) {
            return differences;
        }
        let Spacing { n, m } = self.spacing;
        let differences = [n, m].map(|apart| {
            Reciprocals::new(apart, [0, 1, 2, 3].map(|count| -self.seconds_since(count * apart, time_ms)))
        });
        self.differences = even.then_some(differences);
        differences
    }

    /// Time of the newest frame, ms.
    pub(super) fn last_time(&self) -> i64 {
        self.at_ms[self.row(1)] - self.at_ms[self.row(2)]
    }

    /// Takes what is sent.
    pub(super) fn push(&mut self, pose: Pose, time_ms: u32) {
        self.even = if self.last_time() == i64::from(time_ms) { self.even.saturating_add(1) } else { 0 };
        let at = self.at_ms[self.newest] + i64::from(time_ms);
        self.newest = (self.newest + 1) % ROWS;
        self.poses[self.newest] = pose;
        self.at_ms[self.newest] = at;
    }

    /// The pose sent last.
    pub(super) fn last(&self) -> &Pose {
        &self.poses[self.newest]
    }

    pub(super) const fn spacing(&self) -> Spacing {
        self.spacing
    }
}

const _: () = assert!(ROWS.is_power_of_two());
