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
        matches!(self.planned, Planned::Ready(..)) && self.at.is_none_or(|at| now > at)
    }

    /// What of the film's lead the change takes back, seconds.
    pub(super) fn skips_s(&self) -> f64 {
        let at = self.at.filter(|_| self.goal == Goal::Cue);
        at.map_or(0.0, |at| ShowTime::from_nanos(self.start.as_nanos() - at.as_nanos()).as_secs_f64())
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
    scenes: Scenes,
    retired: Retired,
    /// The number of the newest course that was asked for.
    serial: u32,
    /// Answers in a row that came too late.
    late_answers: u32,
    /// Where in the cue somebody wants the show to go on, until a course leads there.
    pub(super) sought: Option<ShowTime>,
}

impl Replanner {
    pub(super) fn new(scene: &Scene, serial: u32) -> Self {
        Self {
            scenes: Scenes::like(scene),
            retired: Retired::default(),
            serial,
            late_answers: 0,
            sought: None,
        }
    }

    /// A scene to describe the lanes in; without one the planner still has all of them.
    pub(super) fn scene(&mut self) -> Option<Box<Scene>> {
        self.scenes.take()
    }

    pub(super) fn next_serial(&mut self) -> u32 {
        self.serial = self.serial.wrapping_add(1);
        self.serial
    }

    /// An answer came too late.
    pub(super) const fn count_late(&mut self) {
        self.late_answers += 1;
    }

    /// A scene that served.
    pub(super) fn served(&mut self, scene: Box<Scene>) {
        self.scenes.put(scene);
    }

    /// A course was taken up; the scene it was made for served.
    pub(super) fn taken_up(&mut self, scene: Box<Scene>) {
        self.late_answers = 0;
        self.scenes.put(scene);
    }

    /// The time a planner is given: at least two ticks and 20 ms, twice as long after each answer that came too late.
    pub(super) fn lead(&self, rate: Rate) -> Duration {
        LEAD.max(2 * rate.period()) * (1 << self.late_answers.min(6))
    }

    /// A course that nobody follows any more.
    pub(super) fn retire(&mut self, course: Box<Course>) {
        self.retired.put(course);
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

    /// A course that is to be freed on another thread.
    pub(super) fn take_retired(&mut self) -> Option<Box<Course>> {
        self.retired.0.iter_mut().find_map(Option::take)
    }
}

/// Courses that are no longer followed, until another thread frees them: in one tick that of a phase that is left, with what was to
/// follow, and answers that came too late.
#[derive(Debug, Default)]
struct Retired([Option<Box<Course>>; 8]);

impl Retired {
    fn put(&mut self, course: Box<Course>) {
        match self.0.iter_mut().find(|place| place.is_none()) {
            Some(place) => *place = Some(course),
            // Freeing memory here would be the lesser evil beside keeping none; the loop empties this every tick.
            None => drop(course),
        }
    }
}

/// Scenes to describe the lanes with, made before the play; each is with a request, with the planner, or here.
#[derive(Debug)]
struct Scenes([Option<Box<Scene>>; SCENES]);

/// A request that is followed by a stop before it is answered, and that by what the stop leads to.
const SCENES: usize = 4;

impl Scenes {
    fn like(scene: &Scene) -> Self {
        Self(std::array::from_fn(|_| Some(Box::new(scene.clone()))))
    }

    fn take(&mut self) -> Option<Box<Scene>> {
        self.0.iter_mut().find_map(Option::take)
    }

    fn put(&mut self, scene: Box<Scene>) {
        if let Some(place) = self.0.iter_mut().find(|place| place.is_none()) {
            *place = Some(scene);
        }
    }
}
