//! What all lanes do from a show time on: a planned move each, and then the cue or rest.

use super::states::following_by_slot;
use super::{Curve, Plan};
use crate::motion::{AxisState, MAX_AXES, Pose, Window};
use crate::time::ShowTime;

/// What comes after a lane's move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum After {
    /// The lane follows the cue.
    Cue,
    /// The lane rests where its move ended; without a move, in its park pose.
    Rest,
}

/// What one lane does.
#[derive(Debug, Clone)]
pub(crate) struct Leg {
    /// The show time at which its move starts.
    pub(crate) start: ShowTime,
    /// Its move; `None` if the lane goes on as `then` says at once.
    pub(crate) plan: Option<Plan>,
    /// What comes after it.
    pub(crate) then: After,
    /// True if it is out: it rests in park while the others play.
    pub(crate) out: bool,
}

impl Leg {
    /// The show time at which its move has ended.
    fn settled(&self) -> ShowTime {
        let seconds = self.plan.as_ref().map_or(0.0, Plan::seconds);
        ShowTime::from_nanos(self.start.as_nanos() + ShowTime::from_secs_f64(seconds).as_nanos())
    }

    fn since_start(&self, at: ShowTime) -> f64 {
        at.since(self.start).as_secs_f64()
    }
}

/// A course: made by the planner, followed by the tick thread.
#[derive(Debug, Clone)]
pub struct Course {
    /// Which course this is, so that the planner knows from which one it is asked to go on.
    pub(crate) serial: u32,
    /// The show time at which it takes over.
    pub(crate) start: ShowTime,
    legs: Vec<Leg>,
    settled: ShowTime,
}

impl Course {
    /// A course of one leg for each lane.
    #[must_use]
    pub(crate) fn new(serial: u32, start: ShowTime, legs: Vec<Leg>) -> Self {
        let settled = legs.iter().map(Leg::settled).fold(start, ShowTime::max);
        Self { serial, start, legs, settled }
    }

    /// The show time at which the last of its moves has ended.
    #[must_use]
    pub const fn settled(&self) -> ShowTime {
        self.settled
    }

    /// True if a lane follows the cue at a show time.
    #[must_use]
    pub(crate) fn is_on_cue(&self, lane: usize, at: ShowTime) -> bool {
        self.legs[lane].then == After::Cue && at >= self.legs[lane].settled()
    }

    /// Where a lane's slots are at a show time, as fractions of the stroke; `cue` is the cue's pose then. Never
    /// allocates.
    pub(crate) fn pose(&mut self, lane: usize, at: ShowTime, window: &Window, cue: &Pose) -> Pose {
        let leg = &mut self.legs[lane];
        let seconds = leg.since_start(at);
        let Some(plan) = &mut leg.plan else {
            return if leg.then == After::Cue { window.place(cue) } else { window.park() };
        };
        if leg.then == After::Cue && seconds >= plan.seconds() {
            return window.place(cue);
        }
        plan.pose_at(at, leg.start, window)
    }

    /// True if a lane's move is over at a show time.
    #[must_use]
    pub(crate) fn is_settled(&self, lane: usize, at: ShowTime) -> bool {
        at >= self.legs[lane].settled()
    }

    /// What a lane does.
    pub(super) fn leg(&self, lane: usize) -> &Leg {
        &self.legs[lane]
    }

    /// How each moving slot of a lane moves at a show time.
    pub(super) fn states(
        &mut self,
        lane: usize,
        at: ShowTime,
        window: &Window,
        curve: &Curve<'_>,
    ) -> Vec<AxisState> {
        let states = self.states_by_slot(lane, at, window, curve);
        window.moving().map(|(slot, _)| states[slot]).collect()
    }

    /// The same for every slot, in frame order; those that do not move rest in park. Never allocates.
    #[must_use]
    pub(crate) fn states_by_slot(
        &mut self,
        lane: usize,
        at: ShowTime,
        window: &Window,
        curve: &Curve<'_>,
    ) -> [AxisState; MAX_AXES] {
        let leg = &mut self.legs[lane];
        let seconds = leg.since_start(at);
        match &mut leg.plan {
            Some(plan) if leg.then == After::Rest || seconds < plan.seconds() => {
                let mut states = window.park().map(AxisState::at_rest);
                let moving = window.moving().map(|(slot, _)| slot);
                moving.zip(plan.states_at(seconds)).for_each(|(slot, state)| states[slot] = state);
                states
            }
            None if leg.then == After::Rest => window.park().map(AxisState::at_rest),
            _ => following_by_slot(window, curve, at),
        }
    }
}
