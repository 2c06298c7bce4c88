//! What is asked of a unit beside its segments, and when: by a share of the line that is left free for it.

use std::time::Duration;

use crate::drive::silvermax::talk::INTERNAL;
use crate::time::MonoTime;
use crate::wire::silvermax::{Request, register};

/// A question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Question {
    /// What happened (POL).
    Events,
    /// Where it is.
    Position,
    /// How long its segment goes on: its clock.
    TicksLeft,
    /// Where it is to be: its course.
    Target,
    /// Whether it was restarted.
    Canary,
    /// How it is.
    Status,
}

/// All of them, and from one time to the next.
const QUESTIONS: [(Question, Duration); 6] = [
    (Question::Events, Duration::from_millis(200)),
    (Question::Position, Duration::from_millis(200)),
    (Question::TicksLeft, Duration::from_secs(1)),
    (Question::Target, Duration::from_secs(1)),
    (Question::Canary, Duration::from_secs(1)),
    (Question::Status, Duration::from_secs(10)),
];
/// While the crystal is not known the clock is read more often.
const OFTEN: Duration = Duration::from_millis(250);
const OFTEN_FOR: Duration = Duration::from_secs(5);

impl Question {
    pub(super) const fn request(self) -> Request {
        let register = match self {
            Self::Events => return Request::Poll,
            Self::Status => INTERNAL,
            Self::Position => register::POSITION,
            Self::TicksLeft => register::TICKS_LEFT,
            Self::Target => register::TARGET,
            Self::Canary => register::CANARY,
        };
        Request::ReadRegister { register }
    }

    /// It is of use only while segments run.
    const fn is_of_course(self) -> bool {
        matches!(self, Self::TicksLeft | Self::Target)
    }
}

/// How soon a question is asked again that was not answered.
const AGAIN: Duration = Duration::from_millis(200);

fn place(question: Question) -> usize {
    QUESTIONS.iter().position(|(other, _)| *other == question).unwrap_or(0)
}

/// When each is due.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polls {
    due: [MonoTime; QUESTIONS.len()],
    /// Since when each has told nothing.
    untold: [Option<MonoTime>; QUESTIONS.len()],
    started: MonoTime,
}

impl Polls {
    pub(super) fn new(now: MonoTime) -> Self {
        Self { due: [now; QUESTIONS.len()], untold: [None; QUESTIONS.len()], started: now }
    }

    /// Nothing is held against it of before.
    pub(super) const fn forget_untold(&mut self) {
        self.untold = [None; QUESTIONS.len()];
    }

    /// Its queue began to run.
    pub(super) fn on_start(&mut self, now: MonoTime) {
        self.started = now;
        self.forget_untold();
        self.hurry(Question::TicksLeft, now);
        self.due[3] = now + OFTEN;
    }

    /// To be asked as soon as there is time.
    pub(super) fn hurry(&mut self, question: Question, now: MonoTime) {
        let at = place(question);
        // Who is asked for it again and again is not put off by that.
        self.due[at] = self.due[at].min(now);
    }

    /// Whether the answer told anything; since when none has.
    pub(super) fn told(&mut self, question: Question, is_told: bool, now: MonoTime) -> Option<MonoTime> {
        let untold = &mut self.untold[place(question)];
        if is_told {
            *untold = None;
            return None;
        }
        let since = *untold.get_or_insert(now);
        self.hurry(question, now + AGAIN);
        Some(since)
    }

    /// What is due longest, and since when.
    pub(super) fn next(&self, now: MonoTime, runs: bool) -> Option<(MonoTime, Question)> {
        let all = QUESTIONS.iter().zip(self.due).map(|((question, _), due)| (due, *question));
        let due = all.filter(|(due, question)| *due <= now && (runs || !question.is_of_course()));
        due.min_by_key(|(due, _)| *due)
    }

    /// It was asked.
    pub(super) fn asked(&mut self, question: Question, now: MonoTime) {
        let (at, is_new) =
            (place(question), question == Question::TicksLeft && now < self.started + OFTEN_FOR);
        self.due[at] = now + if is_new { OFTEN } else { QUESTIONS[at].1 };
    }
}
