//! A change of course that has been asked for: when it is to happen, and the new course once the planner made it.

use crate::plan::{Course, Request, Scene};
use crate::time::ShowTime;

/// What a change of course is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Goal {
    /// Onto the cue: after a gap, from rest, or elsewhere in the film.
    Cue,
    /// Some lanes go out, come in, or come back; the others do what they did.
    Lanes,
    /// From the end of the cue onto its beginning.
    Again,
    /// From the end of the cue to park, and then the end.
    Home,
    /// To park at once, and then the end.
    Park,
}

impl Goal {
    /// Whether it is what follows the end of the cue.
    pub(super) const fn is_after_the_end(self) -> bool {
        matches!(self, Self::Home | Self::Again)
    }
}

/// A change of course under way.
#[derive(Debug)]
pub(super) struct Switch {
    pub(super) goal: Goal,
    /// The show time, as it runs now, at which the course changes; none where the lanes rest, and show time with them, so
    /// that it changes as soon as there is a course.
    pub(super) at: Option<ShowTime>,
    /// The show time at which the new course begins.
    pub(super) start: ShowTime,
    /// How fast show time runs until then, as a multiple of the clock; the new course begins with what that makes of the
    /// old one's motion.
    pub(super) pace: f64,
    /// What of the film's lead the change takes back, seconds.
    pub(super) skipped_s: f64,
    pub(super) serial: u32,
    /// The request, until it is handed to the planner.
    pub(super) request: Option<Request>,
    /// The course, and the scene it was made for.
    pub(super) course: Option<(Box<Course>, Box<Scene>)>,
}

impl Switch {
    /// Whether the course changes before that show time.
    pub(super) fn is_near(&self, by: ShowTime) -> bool {
        self.at.is_some_and(|at| at <= by)
    }

    /// Whether its course can still be taken up, show time being `now`.
    pub(super) fn is_open(&self, now: ShowTime) -> bool {
        self.at.is_none_or(|at| now <= at)
    }
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

/// Scenes to describe the lanes with, made before the play; each is with a request, with the planner, or here.
#[derive(Debug)]
pub(super) struct Scenes([Option<Box<Scene>>; SCENES]);

/// A request that is followed by a stop before it is answered, and that by what the stop leads to.
const SCENES: usize = 4;

impl Scenes {
    pub(super) fn like(scene: &Scene) -> Self {
        Self(std::array::from_fn(|_| Some(Box::new(scene.clone()))))
    }

    pub(super) fn take(&mut self) -> Option<Box<Scene>> {
        self.0.iter_mut().find_map(Option::take)
    }

    pub(super) fn put(&mut self, scene: Box<Scene>) {
        if let Some(place) = self.0.iter_mut().find(|place| place.is_none()) {
            *place = Some(scene);
        }
    }
}
