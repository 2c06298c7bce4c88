//! The planner's thread: sleeps until asked, plans, and frees what the tick thread is done with.

use std::sync::atomic::{AtomicBool, Ordering};

use rtrb::{Consumer, Producer};

use super::{Answer, Planning, Task};
use crate::plan::{Curve, PlanError, Request};
use crate::timeline::Hint;

/// Refusals that are kept for the report.
const REFUSALS: usize = 100;

/// The planner with its ends of the mailboxes.
#[derive(Debug)]
pub struct PlanLoop {
    /// What it plans with.
    pub planning: Box<Planning>,
    /// What is asked.
    pub tasks: Consumer<Task>,
    /// What is answered.
    pub answers: Producer<Answer>,
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
        while let Ok(task) = self.tasks.pop() {
            match task {
                Task::Plan(request) => self.plan(request, refusals),
                Task::Load(planning) => self.planning = planning,
                Task::Free(show) => drop(show),
                Task::Retire(course) => drop(course),
            }
        }
    }

    /// Plans one course.
    pub fn plan(&mut self, request: Request, refusals: &mut Vec<PlanError>) {
        let Planning { planner, timeline } = &mut *self.planning;
        let pose = |at| timeline.sample(at, &mut Hint::default());
        let curve = Curve { pose: &pose, end: timeline.duration() };
        let answer = match planner.plan(&request, &curve) {
            Ok(course) => Answer::Course(Box::new(course), request.scene),
            Err(error) => {
                if refusals.len() < REFUSALS {
                    refusals.push(error);
                }
                Answer::Refused(request.serial, request.scene)
            }
        };
        // One request is under way at a time, so there is room; a course nobody takes is only freed.
        drop(self.answers.push(answer));
    }
}
