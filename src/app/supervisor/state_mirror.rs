//! Mirrors the state of the hall from the tick thread's news, and words its answers.

use std::time::Duration;

use crate::control::{Code, Problem};
use crate::rt::News;
use crate::state::{Cause, Next, State};
use crate::time::MonoTime;

/// How long the tick thread has to answer a command; a tick takes a second at most.
pub(super) const ANSWER: Duration = Duration::from_secs(2);

/// What is known of the hall's state.
#[derive(Debug)]
pub(super) struct StateMirror {
    pub(super) state: State,
    pub(super) cause: Cause,
    pub(super) next: Next,
    pub(super) since: MonoTime,
}

impl StateMirror {
    pub(super) const fn new(now: MonoTime) -> Self {
        let (state, cause, next) = (State::Boot, Cause::Started, Next::AwaitAnswers);
        Self { state, cause, next, since: now }
    }

    /// Takes news; says from which state to which the hall went, where it did.
    pub(super) fn hear(&mut self, news: News) -> Option<(State, State)> {
        let News::Entered { state, cause, next, at } = news else { return None };
        let from = self.state;
        (self.state, self.cause, self.next, self.since) = (state, cause, next, at);
        (from != state).then_some((from, state))
    }

    /// True if a stop is in effect.
    pub(super) const fn is_stopping(&self) -> bool {
        matches!(self.state, State::Stopping | State::Stopped | State::Fault)
    }

    /// Seconds until the state ends by itself; `None` if it does not.
    pub(super) fn lapses(&self, now: MonoTime) -> Option<f64> {
        let end = self.since + self.state.lasts(self.cause)?;
        Some(end.since(now).as_secs_f64())
    }
}

/// The answer to a command; `None` where the news is none.
pub(super) fn answer(news: News) -> Option<Result<(), Problem>> {
    match news {
        News::Taken => Some(Ok(())),
        News::Refused(refusal) => Some(Err(refusal.into())),
        News::NotLoaded(state) => Some(Err(not_loaded(state))),
        News::Entered { .. } | News::Unplanned(_) | News::Started | News::CalledOff(_) => None,
    }
}

fn not_loaded(state: State) -> Problem {
    Problem::new(Code::State, format!("cannot load while {state}: the seats move"), "park first")
}

/// More commands wait than a person can give.
pub(super) fn busy() -> Problem {
    Problem::new(Code::Busy, "too many commands wait for the tick thread", "try again in a second")
}

/// The tick thread says nothing.
pub(super) fn no_answer() -> Problem {
    Problem::new(
        Code::Timeout,
        format!("the tick thread did not answer within {} s", ANSWER.as_secs()),
        "check the status before you repeat the command: it may still take effect",
    )
}

/// The tick thread has ended.
pub(super) fn closed(why: &str) -> Problem {
    Problem::new(
        Code::Timeout,
        format!("{why} before the tick thread had answered"),
        "check the status, and repeat the command if it took no effect",
    )
}
