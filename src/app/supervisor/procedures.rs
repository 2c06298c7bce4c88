//! What is to be done: procedures, one after the other, each of acts that are done in turn. One that waits for the tick thread
//! holds up all that is behind it, so that nothing comes between the acts for an ask.

use std::collections::VecDeque;

use super::act::Act;
use super::hall::Undo;
use super::state_mirror::no_answer;
use crate::control::{Asked, Problem};
use crate::rt::Ticket;
use crate::time::MonoTime;

/// Acts for one ask, or for something that happened.
#[derive(Debug, Default)]
pub(super) struct Procedure {
    acts: VecDeque<Act>,
    /// What is done where one of them fails.
    pub(super) otherwise: Vec<Act>,
    awaited: Option<Awaited>,
    /// The tick thread has been told at the end whether a show can be armed.
    has_told: bool,
    pub(super) name: Option<String>,
    pub(super) asked: Option<Asked>,
    pub(super) failed: Option<Problem>,
}

/// What a procedure waits for, and how long.
#[derive(Debug)]
pub(super) enum Awaited {
    /// The answer to the command of that ticket; where that is a refusal, it is undone so.
    Answer(Ticket, Undo, MonoTime),
    /// A stop in the state.
    Stop(MonoTime),
}

/// All procedures; the first is under way.
#[derive(Debug, Default)]
pub(super) struct Procedures(VecDeque<Procedure>);

impl Procedures {
    /// Has these acts done once all is done that was to be done before.
    pub(super) fn add(&mut self, acts: Vec<Act>) {
        self.0.push_back(Procedure { acts: acts.into(), ..Procedure::default() });
    }

    /// The same for an ask, which is answered then; or why they are not done.
    pub(super) fn add_for(&mut self, asked: Option<Asked>, acts: Result<Vec<Act>, Problem>) {
        let (acts, failed) = acts.map_or_else(|problem| (Vec::new(), Some(problem)), |acts| (acts, None));
        self.0.push_back(Procedure { acts: acts.into(), asked, failed, ..Procedure::default() });
    }

    /// True if nothing is to be done.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The one that is under way; one that does nothing where none is.
    pub(super) fn first(&mut self) -> &mut Procedure {
        if self.0.is_empty() {
            self.add(Vec::new());
        }
        &mut self.0[0]
    }

    /// Until when something is waited for; `None` if nothing is.
    pub(super) fn waits_until(&self) -> Option<MonoTime> {
        self.0.front()?.awaited.as_ref().map(|awaited| match awaited {
            Awaited::Answer(_, _, until) | Awaited::Stop(until) => *until,
        })
    }

    /// The next act that can be done now; at the end of each procedure the tick thread is told of readiness.
    pub(super) fn next_act(&mut self) -> Option<Act> {
        let first = self.0.front_mut().filter(|first| first.awaited.is_none())?;
        first.acts.pop_front().or_else(|| {
            let told = std::mem::replace(&mut first.has_told, true);
            (!told).then_some(Act::TellReadiness)
        })
    }

    /// The first, which is done; `None` if it is not, or there is none.
    pub(super) fn take_done(&mut self) -> Option<Procedure> {
        self.0.pop_front_if(|first| first.awaited.is_none() && first.acts.is_empty())
    }

    /// Takes an answer of the tick thread: gives what is undone, and why, where it is a refusal. One that nobody waits for any
    /// more is none.
    pub(super) fn answered(
        &mut self,
        ticket: Ticket,
        answer: Result<(), Problem>,
    ) -> Option<(Undo, Problem)> {
        let is_it = |awaited: &mut Awaited| matches!(awaited, Awaited::Answer(of, ..) if *of == ticket);
        let Awaited::Answer(_, undo, _) = self.0.front_mut()?.awaited.take_if(is_it)? else { return None };
        answer.err().map(|problem| (undo, problem))
    }

    /// Looks whether a stop that is waited for is there, or it is over with waiting: gives what is undone then, and why.
    pub(super) fn on_time(&mut self, is_stopping: bool, now: MonoTime) -> Option<(Undo, Problem)> {
        let is_over = |awaited: &mut Awaited| match awaited {
            Awaited::Answer(_, _, until) => now >= *until,
            Awaited::Stop(until) => is_stopping || now >= *until,
        };
        match self.0.front_mut()?.awaited.take_if(is_over)? {
            Awaited::Answer(_, undo, _) => Some((undo, no_answer())),
            Awaited::Stop(_) => None,
        }
    }

    /// Gives the asks of all of them, none of which goes on.
    pub(super) fn into_asked(self) -> impl Iterator<Item = Asked> {
        self.0.into_iter().filter_map(|one| one.asked)
    }
}

impl Procedure {
    /// Does these before all else that is to be done.
    pub(super) fn go_on_with(&mut self, acts: Vec<Act>) {
        acts.into_iter().rev().for_each(|act| self.acts.push_front(act));
    }

    /// Waits for that.
    pub(super) fn wait(&mut self, awaited: Awaited) {
        self.awaited = Some(awaited);
    }

    /// Nothing more of it is done but what was to be done then.
    pub(super) fn fail(&mut self, problem: Problem) {
        self.acts = std::mem::take(&mut self.otherwise).into();
        self.failed.get_or_insert(problem);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::supervisor::state_mirror::busy;
    use crate::control::Code;

    fn ms(ms: u64) -> MonoTime {
        MonoTime::from_nanos(ms * 1_000_000)
    }

    fn note(text: &str) -> Act {
        Act::Note(text.to_owned())
    }

    /// The notes that can be made now.
    fn notes(procedures: &mut Procedures) -> Vec<String> {
        let acts = std::iter::from_fn(|| procedures.next_act());
        acts.filter_map(|act| if let Act::Note(text) = act { Some(text) } else { None }).collect()
    }

    #[test]
    fn an_answer_that_came_too_late_is_not_taken_for_that_of_the_next_command() {
        let mut procedures = Procedures::default();
        procedures.add(vec![]);
        procedures.first().wait(Awaited::Answer(0, Undo::Nothing, ms(2_000)));
        assert!(procedures.on_time(false, ms(1_999)).is_none());
        let (_, problem) = procedures.on_time(false, ms(2_000)).unwrap();
        assert_eq!(problem.code, Code::Timeout);
        procedures.first().wait(Awaited::Answer(1, Undo::Nothing, ms(4_000)));
        assert!(procedures.answered(0, Err(busy())).is_none());
        assert_eq!(procedures.waits_until(), Some(ms(4_000)));
        assert!(procedures.answered(1, Ok(())).is_none());
        assert_eq!(procedures.waits_until(), None);
    }

    #[test]
    fn nothing_comes_between_the_acts_of_a_procedure_be_it_that_it_waits() {
        let mut procedures = Procedures::default();
        procedures.add(vec![note("one"), note("two")]);
        procedures.add(vec![note("other")]);
        procedures.next_act();
        procedures.first().wait(Awaited::Answer(0, Undo::Nothing, ms(2_000)));
        assert!(procedures.next_act().is_none() && procedures.take_done().is_none());
        procedures.first().go_on_with(vec![note("between")]);
        procedures.answered(0, Ok(()));
        assert_eq!(notes(&mut procedures), ["between", "two"]);
        assert!(procedures.take_done().is_some());
        assert_eq!(notes(&mut procedures), ["other"]);
    }

    #[test]
    fn a_procedure_that_fails_does_what_was_to_be_done_then_and_no_more() {
        let mut procedures = Procedures::default();
        procedures.add(vec![note("never")]);
        procedures.first().otherwise = vec![note("instead")];
        procedures.first().wait(Awaited::Answer(7, Undo::Unload, ms(2_000)));
        let Some((Undo::Unload, problem)) = procedures.answered(7, Err(busy())) else {
            panic!("it is undone")
        };
        procedures.first().fail(problem.clone());
        assert_eq!(notes(&mut procedures), ["instead"]);
        assert_eq!(procedures.take_done().unwrap().failed, Some(problem));
    }

    #[test]
    fn a_stop_is_waited_for_until_it_is_seen() {
        let mut procedures = Procedures::default();
        procedures.add(vec![note("seen")]);
        procedures.first().wait(Awaited::Stop(ms(2_000)));
        procedures.on_time(false, ms(10));
        assert!(notes(&mut procedures).is_empty());
        procedures.on_time(true, ms(11));
        assert_eq!(notes(&mut procedures), ["seen"]);
    }
}
