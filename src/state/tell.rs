//! Events from the engine and the observers.

use std::time::Duration;

use super::{Cause, Demand, Event, Finding, Goal, Machine, PlayMode, Readiness, SLEPT, SLEPT_LONG, State};
use crate::time::MonoTime;

impl Machine {
    /// Takes an event. One that does not fit the state, because it comes late, changes nothing but what is known.
    pub fn event(&mut self, event: Event, now: MonoTime) {
        match event {
            Event::Identified(finding) => self.identified(finding, now),
            Event::PositionsRead => self.facts.measured = true,
            Event::Astray(astray) => self.facts.astray = astray,
            Event::Rebooted(controller) => self.rebooted(controller, now),
            Event::Readiness(readiness) => self.ready(readiness, now),
            Event::Homed => self.homed(now),
            Event::JoinBegun if self.state == State::Playing(PlayMode::Holding) => {
                self.enter(State::Playing(PlayMode::Joining), Cause::GapOver, now);
            }
            Event::Joined if self.rides_in(&[PlayMode::Joining, PlayMode::Holding]) => {
                self.enter(State::Playing(PlayMode::Following), Cause::Joined, now);
            }
            Event::Late if self.rides_in(&[PlayMode::Joining, PlayMode::Following]) => {
                self.enter(State::Playing(PlayMode::Holding), Cause::Late, now);
            }
            Event::FilmLeads if self.state == State::Playing(PlayMode::Waiting) => {
                self.enter(State::Playing(PlayMode::Joining), Cause::FilmLeads, now);
            }
            Event::FilmAwaited(why) if self.rides() && self.cause != Cause::FilmAwaited(why) => {
                self.enter(State::Playing(PlayMode::Waiting), Cause::FilmAwaited(why), now);
            }
            Event::FilmOver(why) if self.rides() => self.enter(State::Parking, Cause::FilmOver(why), now),
            Event::CueEnded if self.rides() => self.enter(State::Parking, Cause::CueEnded, now),
            Event::AtRest if self.state == State::Stopping => self.end_stopping(now),
            Event::Parked if self.state == State::Parking => {
                self.enter(State::Parked, Cause::ArrivedAtPark, now);
            }
            Event::Policy(demand, group) => self.policy(demand, group, now),
            Event::EmergencyStop(controller) => self.emergency_stop(controller, now),
            Event::AllReleased => self.facts.pressed = false,
            Event::Slept(span) => self.slept(span, now),
            Event::Trouble(trouble) => self.trouble(trouble, now),
            Event::Latched(latch) => self.facts.latch = latch,
            // Before, and while they home, others say so.
            Event::ZerosKnown => self.facts.homed |= self.facts.identified && self.state != State::Homing,
            Event::JoinBegun
            | Event::Joined
            | Event::Late
            | Event::FilmLeads
            | Event::FilmAwaited(_)
            | Event::FilmOver(_)
            | Event::CueEnded
            | Event::AtRest
            | Event::Parked => {}
        }
    }

    fn rides_in(&self, modes: &[PlayMode]) -> bool {
        modes.iter().any(|mode| self.state == State::Playing(*mode))
    }

    const fn rides(&self) -> bool {
        matches!(self.state, State::Playing(_))
    }

    fn identified(&mut self, finding: Finding, now: MonoTime) {
        // While the seats move or are armed, only a reboot or homing says anything new of their zero.
        if !matches!(self.state, State::Boot | State::Recovering | State::Stopped | State::Fault) {
            return;
        }
        self.facts.identified = true;
        self.facts.homed = finding.homed;
        self.facts.measured = true;
        if self.state == State::Boot {
            let (state, cause) = finding.leads_to();
            self.enter(state, cause, now);
        }
    }

    fn rebooted(&mut self, controller: usize, now: MonoTime) {
        self.facts.homed = false;
        if self.state == State::Armed {
            self.enter(State::Parked, Cause::Rebooted(controller), now);
        }
    }

    fn ready(&mut self, readiness: Readiness, now: MonoTime) {
        self.facts.readiness = readiness;
        if readiness == Readiness::Ready {
            return;
        }
        match self.state {
            State::Armed => self.enter(State::Parked, Cause::NotReady(readiness), now),
            State::Homing => self.goal = Goal::Parked,
            _ => {}
        }
    }

    fn homed(&mut self, now: MonoTime) {
        if self.state != State::Homing {
            return;
        }
        self.facts.homed = true;
        self.facts.measured = true;
        let state = match self.goal {
            Goal::Parked => State::Parked,
            Goal::Armed => State::Armed,
        };
        self.enter(state, Cause::Homed, now);
    }

    /// The seats stood where the last frame before the sleep had left them, and somebody may have got up, or on. Homing is the
    /// controllers' own, and what is latched stays so.
    fn slept(&mut self, span: Duration, now: MonoTime) {
        if span <= SLEPT {
            return;
        }
        match self.state {
            State::Playing(_) | State::Paused if span <= SLEPT_LONG => {
                self.enter(State::Paused, Cause::Slept, now);
            }
            State::Playing(_) | State::Paused | State::Parking => {
                let cause = *self.stop.get_or_insert(Cause::Slept);
                self.enter(State::Stopped, cause, now);
            }
            State::Stopping => self.end_stopping(now),
            // Nothing moves, and whoever lets it go looks at the seats.
            State::Armed if span > SLEPT_LONG => self.enter(State::Parked, Cause::Slept, now),
            _ => {}
        }
    }

    /// Of a show that runs. Nothing moves out of a pause but by a person: somebody may have got up, or be at work on the seat.
    fn policy(&mut self, demand: Demand, group: usize, now: MonoTime) {
        if !matches!(self.state, State::Playing(_)) {
            return;
        }
        let state = match demand {
            Demand::Pause => State::Paused,
            Demand::Park => State::Parking,
        };
        self.enter(state, Cause::GroupOut(group), now);
    }

    /// An emergency stop goes before a person's stop as a cause; the first controller that told of it is the one named.
    ///
    /// Nothing more goes to a group in emergency stop; the others decelerate, because silence would halt them at the end of
    /// a straight line.
    fn emergency_stop(&mut self, controller: usize, now: MonoTime) {
        self.facts.pressed = true;
        if matches!(self.stop, Some(Cause::EmergencyStop(_))) {
            return;
        }
        let cause = Cause::EmergencyStop(controller);
        self.stop = Some(cause);
        match self.state {
            State::Stopping => self.cause = cause,
            state if state.may_send_motion() => self.enter(State::Stopping, cause, now),
            _ => self.enter(State::Stopped, cause, now),
        }
    }
}
