//! The planner's thread: sleeps until asked, plans, and frees what the tick thread is done with.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rtrb::{Consumer, Producer};

use super::Answer;
use crate::plan::{Course, Curve, PlanError, Planner, Request};
use crate::timeline::{Hint, Timeline};

/// The planner with its ends of the mailboxes.
#[derive(Debug)]
pub struct PlanLoop {
    /// Who plans.
    pub planner: Planner,
    /// The cue that is planned for.
    pub timeline: Arc<Timeline>,
    /// What is asked.
    pub requests: Consumer<Request>,
    /// What is answered.
    pub answers: Producer<Answer>,
    /// What is to be freed.
    pub retired: Consumer<Box<Course>>,
}

impl PlanLoop {
    /// Serves requests until `done`; whoever sets that wakes the thread. Returns what could not be planned.
    pub fn run(&mut self, done: &AtomicBool) -> Vec<PlanError> {
        let mut refusals = Vec::new();
        while !done.load(Ordering::Acquire) {
            self.serve(&mut refusals);
            std::thread::park();
        }
        refusals
    }

    /// Serves what is waiting.
    pub fn serve(&mut self, refusals: &mut Vec<PlanError>) {
        while self.retired.pop().is_ok() {}
        while let Ok(request) = self.requests.pop() {
            let timeline = &self.timeline;
            let pose = |at| timeline.sample(at, &mut Hint::default());
            let curve = Curve { pose: &pose, end: timeline.duration() };
            let answer = match self.planner.plan(&request, &curve) {
                Ok(course) => Answer::Course(Box::new(course), request.scene),
                Err(error) => {
                    refusals.push(error);
                    Answer::Refused(request.serial, request.scene)
                }
            };
            // One request is under way at a time, so there is room; a course nobody takes is only freed.
            drop(self.answers.push(answer));
        }
    }
}
