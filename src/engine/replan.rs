//! A change of course: what it is for, when it is to happen, how far the planner is with it; and what the planner needs and gives.

use std::time::Duration;

use crate::plan::{Course, Request, Scene, To};
use crate::time::{Rate, ShowTime};

/// A course is asked for at least this long before it is to begin, and at least two ticks.
const LEAD: Duration = Duration::from_millis(20);

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

    /// Where it leads.
    pub(super) const fn to(self) -> To {
        match self {
            Self::Home | Self::Park => To::Park,
            Self::Cue | Self::Again => To::Cue,
            Self::Lanes => To::Same,
        }
    }
}

/// A change of course under way.
#[derive(Debug)]
pub(super) struct Replan {
    pub(super) goal: Goal,
    /// The show time, as it runs now, at which the course changes; none where the lanes rest, and show time with them, so
    /// that it changes as soon as there is a course.
    pub(super) at: Option<ShowTime>,
    /// The show time at which the new course begins.
    pub(super) start: ShowTime,
    /// How fast show time runs until then, as a multiple of the clock; the new course begins with what that makes of the
    /// old one's motion.
    pub(super) pace: f64,
    pub(super) serial: u32,
    pub(super) planned: Planned,
}

/// How far the planner is.
#[derive(Debug)]
pub(super) enum Planned {
    /// It is to be handed the request.
    Asked(Request),
    /// It has that.
    Planning,
    /// It found the course, for that scene.
    Ready(Box<Course>, Box<Scene>),
}

impl Replan {
    /// Whether the course changes before that show time.
    pub(super) fn is_near(&self, by: ShowTime) -> bool {
        self.at.is_some_and(|at| at <= by)
    }

    /// Whether its course can still be taken up, show time being `now`.
    pub(super) fn is_open(&self, now: ShowTime) -> bool {
        self.at.is_none_or(|at| now <= at)
    }

    /// Whether its course is there, and is to be taken up.
    pub(super) fn is_due(&self, now: ShowTime) -> bool {
        // Past it, not at it: the old course leads up to there, and the new one begins where that ends.
        matches!(self.planned, Planned::Ready(..)) && self.at.is_none_or(|at| now > at)
    }

    /// What of the film's lead the change takes back.
    pub(super) fn skips(&self) -> ShowTime {
        let at = self.at.filter(|_| self.goal == Goal::Cue).unwrap_or(self.start);
        ShowTime::from_nanos(self.start.as_nanos() - at.as_nanos())
    }

    /// The request, if the planner has not seen it yet.
    pub(super) fn take_request(&mut self) -> Option<Request> {
        match std::mem::replace(&mut self.planned, Planned::Planning) {
            Planned::Asked(request) => Some(request),
            before => {
                self.planned = before;
                None
            }
        }
    }
}

/// What crosses between engine and planner, and what they share: made before the show, so that nothing is freed while that plays.
#[derive(Debug)]
pub(super) struct Replanner {
    /// To describe the lanes in: each is with a request, with the planner, or here. A request may be followed by a stop before it is
    /// answered, and that by what the stop leads to.
    pub(super) scenes: Pool<Scene, 4>,
    /// Courses that are no longer followed, until another thread frees them: in one tick that of a phase that is left, with what was
    /// to follow, and answers that came too late.
    pub(super) retired: Pool<Course, 8>,
    /// The number of the newest course that was asked for.
    pub(super) serial: u32,
    /// Answers in a row that came too late.
    pub(super) late_answers: u32,
    /// Where in the cue somebody wants the show to go on, until a course leads there.
    pub(super) sought: Option<ShowTime>,
}

impl Replanner {
    pub(super) fn new(scene: &Scene, serial: u32) -> Self {
        let scenes = Pool(std::array::from_fn(|_| Some(Box::new(scene.clone()))));
        Self { scenes, retired: Pool([const { None }; 8]), serial, late_answers: 0, sought: None }
    }

    /// The time a planner is given: at least two ticks and 20 ms, twice as long after each answer that came too late.
    pub(super) fn lead(&self, rate: Rate) -> Duration {
        // Up to 64 times as long, 1.3 s where ticks are quick: waiting longer will not help either.
        LEAD.max(2 * rate.period()) * (1 << self.late_answers.min(6))
    }

    /// A change of course that nobody waits for any more.
    pub(super) fn give_up(&mut self, replan: Replan) {
        match replan.planned {
            Planned::Asked(request) => self.scenes.put(request.scene),
            Planned::Planning => {}
            Planned::Ready(course, scene) => {
                self.retired.put(course);
                self.scenes.put(scene);
            }
        }
    }
}

/// Places for boxes that go to and fro.
#[derive(Debug)]
pub(super) struct Pool<T, const PLACES: usize>([Option<Box<T>>; PLACES]);

impl<T, const PLACES: usize> Pool<T, PLACES> {
    /// Freeing memory, where there is no place, would be the lesser evil beside keeping it; there is one.
    pub(super) fn put(&mut self, kept: Box<T>) {
        if let Some(place) = self.0.iter_mut().find(|place| place.is_none()) {
            *place = Some(kept);
        }
    }

    pub(super) fn take(&mut self) -> Option<Box<T>> {
        self.0.iter_mut().find_map(Option::take)
    }
}
