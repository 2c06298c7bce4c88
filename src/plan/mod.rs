//! Jerk-limited moves, planned off the tick thread in units of the stroke: joins onto the moving cue, and parking.
//!
//! The solver has absolute tolerances, so nothing here is ever in millimetres or pulses. Its error path allocates:
//! only [`Course::pose`] may be called on the tick thread.

mod course;
mod join;
mod park;
mod planner;
mod scene;
mod seam;
mod solve;
mod states;

pub(crate) use course::{After, Course, Leg};
pub(crate) use park::slow_park_time;
pub(crate) use planner::Planner;
pub use planner::{From, Request, To};
pub use scene::{LaneScene, Place, Scene};

use std::time::Duration;

use rsruckig::prelude::{DataArrayOrVec, Trajectory};

use crate::motion::{AxisState, Pose, Window};
use crate::time::ShowTime;

/// The cue as the planner sees it.
#[derive(Clone, Copy)]
pub struct Curve<'a> {
    /// Its pose at a show time, in its own unit; before its first and after its last row those rows'.
    pub pose: &'a dyn Fn(ShowTime) -> Pose,
    /// Its last row.
    pub end: ShowTime,
}

impl Curve<'_> {
    /// Has `job` done with the cue as a lane sees it whose controller executes poses `lead` after they are made.
    pub(crate) fn ahead<T>(&self, lead: Duration, job: impl FnOnce(&Curve<'_>) -> T) -> T {
        let pose = |at: ShowTime| (self.pose)(at + lead);
        job(&Curve { pose: &pose, end: self.end - lead })
    }
}

/// Why no move could be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// No join of up to 10 s meets the cue.
    #[error(
        "no move of up to {limit_s} s joins the cue at {at}: {reason}; make the cue gentler there, or start elsewhere"
    )]
    NoJoin {
        /// The show time at which the join would begin.
        at: ShowTime,
        /// The longest join tried, seconds.
        limit_s: f64,
        /// What the solver said last.
        reason: String,
    },
    /// Lanes are said to be on a course that was not given out, or was given up.
    #[error("course {0} is not known")]
    UnknownCourse(u32),
    /// A request said nothing of a lane.
    #[error("nothing is said of lane {0}")]
    UnknownLane(usize),
    /// A lane is said to be on a course, but not on which.
    #[error("lane {0} is on no course that is known")]
    UnknownPlace(usize),
    /// The solver refused even to stop.
    #[error("no way to stop could be planned: {0}")]
    NoStop(String),
}

/// A finished move of the moving slots of one lane: one trajectory, or a stop and what follows it.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    parts: Vec<Trajectory<0>>,
    positions: DataArrayOrVec<f64, 0>,
    velocities: DataArrayOrVec<f64, 0>,
    accelerations: DataArrayOrVec<f64, 0>,
}

impl Plan {
    fn new(trajectory: Trajectory<0>, axes: usize) -> Self {
        let zeros = || DataArrayOrVec::new(Some(axes), 0.0);
        Self { parts: vec![trajectory], positions: zeros(), velocities: zeros(), accelerations: zeros() }
    }

    /// This move and `next` after it, which starts where this one ends.
    fn then(mut self, next: Self) -> Self {
        self.parts.extend(next.parts);
        self
    }

    /// How long the move takes, seconds.
    #[must_use]
    pub(crate) fn seconds(&self) -> f64 {
        self.parts.iter().map(Trajectory::get_duration).sum()
    }

    /// The positions `seconds` after its start, one for each moving slot, clamped to the move's own duration and to the
    /// stroke. Never allocates.
    pub(crate) fn position_at(&mut self, seconds: f64) -> &[f64] {
        let (part, t) = self.part_at(seconds);
        let positions = &mut self.positions;
        self.parts[part].at_time(t, &mut Some(positions), &mut None, &mut None, &mut None, &mut None);
        for position in self.positions.iter_mut() {
            *position = position.clamp(0.0, 1.0);
        }
        &self.positions
    }

    /// Where a lane's slots are at a show time, if the move starts at `start`; slots that do not move rest at park. Never
    /// allocates.
    fn pose_at(&mut self, at: ShowTime, start: ShowTime, window: &Window) -> Pose {
        let seconds = at.since(start).as_secs_f64();
        let mut pose = window.park();
        for ((slot, _), position) in window.moving().zip(self.position_at(seconds)) {
            pose[slot] = *position;
        }
        pose
    }

    /// The state of each moving slot `seconds` after the start, clamped likewise. Never allocates.
    pub(crate) fn states_at(&mut self, seconds: f64) -> impl Iterator<Item = AxisState> {
        let (part, t) = self.part_at(seconds);
        let (p, v, a) = (&mut self.positions, &mut self.velocities, &mut self.accelerations);
        self.parts[part].at_time(t, &mut Some(p), &mut Some(v), &mut Some(a), &mut None, &mut None);
        let moves = self.velocities.iter().zip(self.accelerations.iter());
        self.positions.iter().zip(moves).map(|(position, (velocity, acceleration))| AxisState {
            position: position.clamp(0.0, 1.0),
            velocity: *velocity,
            acceleration: *acceleration,
        })
    }

    fn part_at(&self, seconds: f64) -> (usize, f64) {
        let mut t = seconds.max(0.0);
        let last = self.parts.len() - 1;
        for (part, trajectory) in self.parts[..last].iter().enumerate() {
            if t < trajectory.get_duration() {
                return (part, t);
            }
            t -= trajectory.get_duration();
        }
        (last, t.min(self.parts[last].get_duration()))
    }
}
