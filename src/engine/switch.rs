//! A change of course that has been asked for: when it is to happen, and the new course once the planner made it.

use std::time::Duration;

use crate::plan::{Course, Request};
use crate::time::ShowTime;

/// What a change of course is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Goal {
    /// Back onto the cue after a gap.
    Rejoin,
    /// From the end of the cue onto its beginning.
    Again,
    /// From the end of the cue to park, and then the end.
    Home,
    /// To park at once, and then the end.
    Stop,
}

/// A change of course under way.
#[derive(Debug)]
pub(super) struct Switch {
    pub(super) goal: Goal,
    /// The show time, as it runs now, at which the course changes.
    pub(super) at: ShowTime,
    /// How fast show time runs until then, as a multiple of the clock; the new course begins with what that makes of the
    /// old one's motion.
    pub(super) pace: f64,
    /// What show time gains on its grid by the change.
    pub(super) skipped: Duration,
    pub(super) request: Request,
    /// Whether the request still has to be handed to the planner.
    pub(super) unsent: bool,
    pub(super) course: Option<Box<Course>>,
}

/// Courses that are no longer followed, until another thread frees them.
#[derive(Debug, Default)]
pub(super) struct Retired([Option<Box<Course>>; 4]);

impl Retired {
    pub(super) fn put(&mut self, course: Option<Box<Course>>) {
        let Some(course) = course else { return };
        match self.0.iter_mut().find(|place| place.is_none()) {
            Some(place) => *place = Some(course),
            // Freeing memory here would be the lesser evil beside keeping none; the loop empties this every tick.
            None => drop(course),
        }
    }

    pub(super) fn take(&mut self) -> Option<Box<Course>> {
        self.0.iter_mut().find_map(Option::take)
    }
}
