//! Mirrors the state of the hall from the tick thread's news, with the result of the command that awaits its answer.

use std::time::Duration;

use crate::control::{Code, Problem};
use crate::rt::{News, Ticket};
use crate::state::{Cause, Next, State};
use crate::time::MonoTime;

/// What is known of the hall's state.
#[derive(Debug)]
pub(super) struct StateMirror {
    pub(super) state: State,
    pub(super) cause: Cause,
    pub(super) next: Next,
    pub(super) since: MonoTime,
    /// Commands that were given: the ticket of the next.
    given: Ticket,
    /// The answer to the command that was given last.
    answer: Option<Result<(), Problem>>,
}

impl StateMirror {
    pub(super) const fn new(now: MonoTime) -> Self {
        let (state, cause, next) = (State::Boot, Cause::Started, Next::AwaitAnswers);
        Self { state, cause, next, since: now, given: 0, answer: None }
    }

    /// Takes news; says from which state to which the hall went, where it did.
    pub(super) fn hear(&mut self, ticket: Option<Ticket>, news: News) -> Option<(State, State)> {
        let answer = match news {
            News::Entered { state, cause, next, at } => {
                let from = self.state;
                (self.state, self.cause, self.next, self.since) = (state, cause, next, at);
                return (from != state).then_some((from, state));
            }
            News::Taken => Ok(()),
            News::Refused(refusal) => Err(refusal.into()),
            News::NotLoaded(state) => Err(not_loaded(state)),
            News::Unplanned(_) => return None, // of no state, and no answer
        };
        // One that was given up on may still be answered.
        if ticket == Some(self.given.wrapping_sub(1)) {
            self.answer = Some(answer);
        }
        None
    }

    /// Seconds until the state ends by itself; `None` if it does not.
    pub(super) fn lapses(&self, now: MonoTime) -> Option<f64> {
        let end = self.since + self.state.lasts()?;
        Some(end.since(now).as_secs_f64())
    }

    /// A command was given: its answer is waited for.
    pub(super) fn expect(&mut self) {
        self.given = self.given.wrapping_add(1);
        self.answer = None;
    }

    pub(super) const fn take_answer(&mut self) -> Option<Result<(), Problem>> {
        self.answer.take()
    }
}

fn not_loaded(state: State) -> Problem {
    Problem::new(Code::State, format!("cannot load while {state}: the seats move"), "park first")
}

/// More commands wait than a person can give.
pub(super) fn busy() -> Problem {
    Problem::new(Code::Busy, "too many commands wait for the tick thread", "ask again in a second")
}

/// The tick thread says nothing.
pub(super) fn no_answer(after: Duration) -> Problem {
    Problem::new(
        Code::Timeout,
        format!("the tick thread did not answer within {} s", after.as_secs()),
        "look at the status before asking again: it may still be done",
    )
}
