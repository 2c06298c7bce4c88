//! What all lanes do from a show time on: a planned move each, and then the cue or rest.

use super::states::following;
use super::{AxisState, Curve, Plan};
use crate::motion::{Pose, Window};
use crate::time::ShowTime;

/// What comes after the moves of a course.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum After {
    /// The lanes follow the cue.
    Cue,
    /// The lanes rest where their moves ended; one without a move rests in its park pose.
    Rest,
}

/// A course: made by the planner, followed by the tick thread.
#[derive(Debug, Clone)]
pub struct Course {
    /// Which course this is, so that the planner knows from which one it is asked to go on.
    pub serial: u32,
    /// The show time at which its moves start.
    pub start: ShowTime,
    /// What comes after the moves.
    pub then: After,
    moves: Vec<Option<Plan>>,
    seconds: f64,
}

impl Course {
    /// A course of these moves, one for each lane; none where the lane goes on as `then` says at once.
    #[must_use]
    pub fn new(serial: u32, start: ShowTime, then: After, moves: Vec<Option<Plan>>) -> Self {
        let seconds = moves.iter().flatten().map(Plan::seconds).fold(0.0, f64::max);
        Self { serial, start, then, moves, seconds }
    }

    /// The show time at which the last of its moves has ended.
    #[must_use]
    pub fn settled(&self) -> ShowTime {
        ShowTime::from_nanos(self.start.as_nanos() + ShowTime::from_secs_f64(self.seconds).as_nanos())
    }

    /// Where a lane's slots are at a show time, as fractions of the stroke; `cue` is the cue's pose then. Never
    /// allocates.
    pub fn pose(&mut self, lane: usize, at: ShowTime, window: &Window, cue: &Pose) -> Pose {
        let seconds = self.since_start(at);
        let Some(plan) = &mut self.moves[lane] else {
            return if self.then == After::Cue { window.place(cue) } else { window.park() };
        };
        if self.then == After::Cue && seconds >= plan.seconds() {
            return window.place(cue);
        }
        plan.pose_at(at, self.start, window)
    }

    /// How each moving slot of a lane moves at a show time.
    pub(super) fn states(
        &mut self,
        lane: usize,
        at: ShowTime,
        window: &Window,
        curve: &Curve<'_>,
    ) -> Vec<AxisState> {
        let seconds = self.since_start(at);
        match &mut self.moves[lane] {
            Some(plan) if self.then == After::Rest || seconds < plan.seconds() => plan.states_at(seconds),
            None if self.then == After::Rest => {
                window.moving().map(|(_, slot)| AxisState::at_rest(slot.park)).collect()
            }
            _ => following(window, curve, at),
        }
    }

    fn since_start(&self, at: ShowTime) -> f64 {
        ShowTime::from_nanos(at.as_nanos().saturating_sub(self.start.as_nanos())).as_secs_f64()
    }
}
