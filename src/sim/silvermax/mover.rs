//! What moves a unit: an ordinary move, the timed queue, a brake.

use std::collections::VecDeque;

use super::trajectory::TrajectoryGoal;

/// Segments that wait, beside the one that runs (IMW, page 95).
const QUEUE: usize = 4;

/// A segment of the timed queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct QueuedSegment {
    pub(super) ticks: u32,
    pub(super) position: i32,
    pub(super) acceleration: i64,
    pub(super) velocity: i64,
}

/// What ends a move early, as the command has it: stop enable and stop state (page 132).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct StopWords {
    pub(super) enable: i64,
    pub(super) state: i64,
}

/// What a unit does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MoverMode {
    /// Holds its target.
    Hold,
    /// Moves until the goal is reached or something is sensed.
    Move { goal: TrajectoryGoal, stop: StopWords },
    /// Executes the timed queue; nothing runs yet where there is no segment.
    Queue { running: Option<TrajectoryGoal>, left: u32 },
}

impl MoverMode {
    /// Comes to rest and holds.
    pub(super) const fn brake(deceleration: i64) -> Self {
        let goal = TrajectoryGoal::Velocity { to: 0, acceleration: deceleration };
        Self::Move { goal, stop: StopWords { enable: 0, state: 0 } }
    }

    /// The acceleration at which it is at work, if any.
    pub(super) const fn acceleration(&self) -> Option<i64> {
        match *self {
            Self::Move { goal, .. } | Self::Queue { running: Some(goal), .. } => match goal {
                TrajectoryGoal::Velocity { acceleration, .. }
                | TrajectoryGoal::Place { acceleration, .. } => Some(acceleration),
            },
            Self::Hold | Self::Queue { running: None, .. } => None,
        }
    }
}

/// The timed queue.
#[derive(Debug, Clone, Default)]
pub(super) struct Queue(VecDeque<QueuedSegment>);

impl Queue {
    /// One more; false where there is no room.
    pub(super) fn push(&mut self, segment: QueuedSegment) -> bool {
        let has_room = self.0.len() < QUEUE;
        if has_room {
            self.0.push_back(segment);
        }
        has_room
    }

    pub(super) fn pop(&mut self) -> Option<QueuedSegment> {
        self.0.pop_front()
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

impl QueuedSegment {
    /// What it is for, where a count is so many of the generator's units; full scale says the direction alone.
    pub(super) fn goal(&self, twice_of: impl Fn(i32) -> i64) -> TrajectoryGoal {
        let acceleration = self.acceleration;
        match self.position {
            i32::MAX => TrajectoryGoal::Velocity { to: self.velocity, acceleration },
            i32::MIN => TrajectoryGoal::Velocity { to: -self.velocity, acceleration },
            place => TrajectoryGoal::Place { twice: twice_of(place), acceleration, velocity: self.velocity },
        }
    }

    /// The same for the last one, an ordinary move to its position.
    pub(super) const fn last_goal(&self, twice: i64) -> TrajectoryGoal {
        TrajectoryGoal::Place { twice, acceleration: self.acceleration, velocity: self.velocity }
    }
}
