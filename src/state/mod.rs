//! The state machine of a hall: requests by persons and events from the engine and the observers in, one state with its
//! cause and the next action out. Tick thread; pure: told the time, `Copy` values alone, no allocation.
//!
//! Motion frames leave only while [`Machine::may_send_motion`]. Nothing but a person's request leads up: to motion, from
//! a pause back to it, or out of what is latched. Where several things happen at once, stopped goes before fault, fault
//! before stopping, stopping before parking, parking before paused, paused before playing.
//!
//! A stop asked for while nothing moves is [`State::Stopped`] at once; while the seats move they decelerate first. So
//! it is with a reported emergency stop: the seats that it concerns are held by their controllers, and the others slow down
//! gently. A fault
//! while the seats move decelerates them as a stop does, because silence would halt them at the end of a straight line;
//! it is latched from the first moment, and only [`State::Stopped`] goes before it.

mod ask;
mod cause;
mod kinds;
mod next;
mod refusal;
#[cfg(any(test, feature = "harness"))]
pub(crate) mod rules;
mod tell;
#[cfg(test)]
mod tests;
mod words;

use std::time::Duration;

pub(crate) use cause::Whose;
pub use cause::{Cause, Trouble};
pub(crate) use kinds::Demand;
pub use kinds::{Event, Finding, Latch, LedBefore, PlayMode, Readiness, State, Transition};
pub(crate) use next::Next;
pub use refusal::{Refusal, Why};

use crate::time::MonoTime;

/// How long a hall stays armed.
pub(crate) const ARMED_FOR: Duration = Duration::from_mins(10);
/// How long a pause lasts before the seats park.
pub(crate) const PAUSED_FOR: Duration = Duration::from_mins(5);
/// How long homing may take. Whoever homes gives up after a minute, with drives after what the travel of each axis takes, the seats of a
/// link one after the other; this is for when no word of that comes.
pub(crate) const HOMING_FOR: Duration = Duration::from_mins(15);
/// How long the seats may decelerate before frames end without word that they are at rest.
pub(crate) const STOPPING_FOR: Duration = Duration::from_secs(5);
/// How long parking may take: a stroke of 5 m at 50 mm/s, and then some.
pub(crate) const PARKING_FOR: Duration = Duration::from_mins(2);

/// After a sleep that was longer nothing goes on by itself.
pub(crate) const SLEPT: Duration = Duration::from_secs(2);
/// After a sleep that was longer whatever was under way is over.
pub(crate) const SLEPT_LONG: Duration = Duration::from_mins(5);

/// The state of one hall.
#[derive(Debug, Clone)]
pub struct Machine {
    state: State,
    cause: Cause,
    since: MonoTime,
    facts: Facts,
    /// What homing leads to.
    goal: Goal,
    /// Why the hall stops, or is stopped.
    stop: Option<Cause>,
    /// What is wrong; kept until cleared.
    fault: Option<Trouble>,
    /// How often a person has cleared.
    clears: u32,
}

/// What is known beside the state.
#[derive(Debug, Clone, Copy)]
struct Facts {
    /// Every controller has said what it is.
    identified: bool,
    /// Every controller knows its position.
    homed: bool,
    /// The positions were read since the hall was cleared.
    measured: bool,
    /// A seat that frames may go to rests elsewhere than at park.
    astray: bool,
    /// An emergency stop is in effect.
    pressed: bool,
    /// What holds controllers that take part.
    latch: Latch,
    readiness: Readiness,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Goal {
    Parked,
    Armed,
}

impl Machine {
    /// A hall of which nothing is known, at the start of the program.
    #[must_use]
    pub const fn new(now: MonoTime) -> Self {
        Self {
            state: State::Boot,
            cause: Cause::Started,
            since: now,
            facts: Facts {
                identified: false,
                homed: false,
                measured: false,
                astray: false,
                pressed: false,
                latch: Latch::Free,
                readiness: Readiness::NoCue,
            },
            goal: Goal::Parked,
            stop: None,
            fault: None,
            clears: 0,
        }
    }

    /// Where the hall stands.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// Why it stands there.
    #[must_use]
    pub const fn cause(&self) -> Cause {
        self.cause
    }

    /// Since when.
    #[must_use]
    pub(crate) const fn since(&self) -> MonoTime {
        self.since
    }

    /// True if motion frames may leave.
    #[must_use]
    pub(crate) const fn may_send_motion(&self) -> bool {
        self.state.may_send_motion()
    }

    /// What is wrong, whatever the state: beside a stop, or while the seats still decelerate.
    #[must_use]
    pub(crate) const fn fault(&self) -> Option<Trouble> {
        self.fault
    }

    /// True if every controller knows its position.
    #[must_use]
    #[cfg(any(test, feature = "harness"))]
    pub(crate) const fn is_homed(&self) -> bool {
        self.facts.homed
    }

    /// True if the positions were read since the program started or the hall was cleared.
    #[must_use]
    #[cfg(test)]
    pub(crate) const fn is_measured(&self) -> bool {
        self.facts.measured
    }

    /// How often a person has cleared: whoever looks at the controllers looks anew each time.
    #[must_use]
    pub(crate) const fn clears(&self) -> u32 {
        self.clears
    }

    /// When the state ends by itself; `None` if it does not. For a hall that is armed or paused, worth showing.
    #[must_use]
    pub(crate) fn lapses(&self) -> Option<MonoTime> {
        Some(self.since + self.state.lasts(self.cause)?)
    }

    /// Ends a state whose time is over. To be told every tick; a clock that goes back ends nothing.
    pub fn tick(&mut self, now: MonoTime) {
        if self.lapses().is_none_or(|end| now < end) {
            return;
        }
        match self.state {
            State::Armed => self.enter(State::Parked, Cause::ArmLapsed, now),
            State::Paused => self.enter(State::Parking, Cause::PausedTooLong, now),
            State::Recovering => self.enter(State::Recovering, Cause::PausedTooLong, now),
            State::Homing => self.trouble(Trouble::HomingTime, now),
            State::Parking => self.trouble(Trouble::ParkingTime, now),
            State::Stopping => self.end_stopping(now),
            _ => {}
        }
    }

    const fn enter(&mut self, state: State, cause: Cause, now: MonoTime) {
        self.state = state;
        self.cause = cause;
        self.since = now;
    }

    /// Latches that something is wrong.
    fn trouble(&mut self, trouble: Trouble, now: MonoTime) {
        let first = *self.fault.get_or_insert(trouble);
        match self.state {
            State::Stopped | State::Stopping | State::Fault => {}
            state if state.may_send_motion() => self.enter(State::Stopping, Cause::Trouble(first), now),
            _ => self.enter(State::Fault, Cause::Trouble(first), now),
        }
    }

    /// The seats are at rest. Where both a stop and a fault are latched, stopped goes first and the fault stays known.
    const fn end_stopping(&mut self, now: MonoTime) {
        match self.stop {
            Some(cause) => self.enter(State::Stopped, cause, now),
            None => self.enter(State::Fault, self.cause, now),
        }
    }
}
