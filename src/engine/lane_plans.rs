//! One lane as the planner is asked for it: how it is, what it needs, and whether whoever parks waits for it.

use super::lane::{LaneMode, LaneMotion};
use crate::plan::{LaneScene, Place};

impl LaneMotion {
    /// How it is as a course is asked for.
    pub(super) fn scene(&self) -> LaneScene {
        let place = match self.mode {
            LaneMode::Following => Place::OnCourse,
            LaneMode::Blind(_) | LaneMode::Unseen | LaneMode::Away => Place::Away,
            LaneMode::Braking(_) | LaneMode::Still if self.leaving.is_some() => Place::Away,
            LaneMode::Braking(_) | LaneMode::Still => Place::Still(*self.pose()),
        };
        LaneScene { place, level: self.fader.level(), out: self.wants_out() }
    }

    /// Whether it is to be out on the next course.
    pub(super) const fn wants_out(&self) -> bool {
        !self.wanted.on
    }

    /// Whether it is not where it is to be, and only a new course can bring it there.
    pub(super) fn needs_a_course(&self) -> bool {
        let apart = match self.mode {
            LaneMode::Following => self.out != self.wants_out(),
            LaneMode::Still => self.leaving.is_none(),
            LaneMode::Braking(_) | LaneMode::Blind(_) | LaneMode::Unseen | LaneMode::Away => false,
        };
        apart && !self.refused
    }

    /// Whether it may still come to park: it has just stepped out and is looked at, or is about to, or its seat is to be read first.
    pub(super) const fn is_awaited(&self) -> bool {
        self.is_unseen() || (self.wanted.on && (self.awaited > 0 || self.is_blind()))
    }

    /// Whether it is there again, and the others left for park without it.
    pub(super) fn is_left_behind(&self) -> bool {
        self.mode == LaneMode::Still && self.needs_a_course()
    }

    /// Whether it takes part, and stays where it is, wherever that may be: nobody knows.
    #[must_use]
    pub(crate) fn is_lost_sight_of(&self) -> bool {
        self.wanted.on && matches!(self.mode, LaneMode::Away | LaneMode::Blind(_))
    }

    /// Whether a park is not over without it.
    pub(super) fn is_missing(&self) -> bool {
        self.is_awaited() || self.is_left_behind()
    }

    /// Hears that no such course could be planned; says whether it needs one.
    pub(super) fn refuse(&mut self) -> bool {
        self.refused = self.needs_a_course();
        self.refused
    }

    /// Takes up the course that was asked for with `scene`.
    pub(super) fn take_up(&mut self, scene: &LaneScene) {
        // One that stands elsewhere by now, or moves, is not where this course begins: it would jump there.
        let as_planned = match (self.mode, scene.place) {
            (LaneMode::Following, Place::OnCourse) => true,
            (LaneMode::Still, Place::Still(pose)) => self.leaving.is_none() && pose == *self.pose(),
            _ => false,
        };
        if as_planned {
            (self.mode, self.out) = (LaneMode::Following, scene.out);
        }
    }

    /// Whether it has just arrived where the others are.
    pub(super) fn arrives(&mut self, is_settled: bool) -> bool {
        let arrives = self.returning && self.mode == LaneMode::Following && is_settled;
        self.returning &= !arrives;
        arrives
    }
}
