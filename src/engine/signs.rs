//! What the engine tells of its lanes, and of how it goes.

use std::fmt;
use std::time::Duration;

use super::{Ending, Engine, Phase, Rider};
use crate::limiter::Counts;

/// What the planner found no move for, while the show goes on without it. In words by its `Display`, without the name of the seat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unplanned {
    /// The seek that was asked for.
    Seek,
    /// The way of this lane into the show, or out of it.
    Lane(usize),
}

impl fmt::Display for Unplanned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Seek => {
                "the seek was not done: no move within the limits leads there; seek a little earlier or later"
            }
            Self::Lane(_) => {
                "it stays where it is: no move within the limits leads it to where it should be; seek elsewhere in the cue, \
                 or park"
            }
        })
    }
}

impl Engine {
    /// What could not be planned since this was asked last, without ending the show; each is said once.
    pub fn take_unplanned(&mut self) -> Option<Unplanned> {
        if std::mem::take(&mut self.seek_refused) {
            return Some(Unplanned::Seek);
        }
        self.riders.iter_mut().position(Rider::take_refusal).map(Unplanned::Lane)
    }

    /// What the limiter had to do for a lane.
    #[must_use]
    pub fn clamps(&self, lane: usize) -> &Counts {
        self.riders[lane].clamps()
    }

    /// Whether the limiter has held a lane back three times within a second since this was asked last.
    pub fn take_gate_fault(&mut self) -> bool {
        self.riders.iter_mut().fold(false, |any, rider| any | rider.take_fault())
    }

    /// Whether a move that the show needs could not be planned since this was asked last.
    pub fn take_planless(&mut self) -> bool {
        std::mem::take(&mut self.planless)
    }

    /// A lane that was away and is where the others are again; each is said once.
    pub fn take_joined(&mut self) -> Option<usize> {
        let Self { riders, course, reached, .. } = self;
        let mut lanes = riders.iter_mut().enumerate();
        lanes.find_map(|(lane, rider)| rider.take_arrival(course.is_settled(lane, *reached)).then_some(lane))
    }

    /// How far missed ticks have put the show behind its grid.
    #[must_use]
    pub fn lag(&self) -> Duration {
        self.slew.lag()
    }

    /// The level of a lane's motion as it is now.
    #[must_use]
    pub fn level(&self, lane: usize) -> f64 {
        self.riders[lane].fader.level()
    }

    /// How the play ended; none while it lasts.
    #[must_use]
    pub fn ending(&self) -> Option<Ending> {
        (self.phase == Phase::Done).then_some(self.ending)
    }
}
