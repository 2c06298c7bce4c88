//! Requests by persons.

use super::{Cause, Goal, Latch, Machine, PlayMode, Readiness, Refusal, State, Transition, Why};
use crate::time::MonoTime;

impl Machine {
    /// Takes a request. One that would change nothing is taken; [`Transition::Stop`] always is.
    ///
    /// [`Transition::Seek`] is taken while the hall is armed, playing or paused; only while it plays does it change the state.
    ///
    /// # Errors
    /// [`Refusal`] where the state does not allow it; nothing has changed then.
    pub fn request(&mut self, request: Transition, now: MonoTime) -> Result<(), Refusal> {
        let taken = match request {
            Transition::Home => self.home(now),
            Transition::Arm | Transition::HomeAndArm => self.arm(request, now),
            Transition::Disarm => self.disarm(now),
            Transition::Go => self.go(now),
            Transition::Pause => self.pause(now),
            Transition::Resume => self.resume(now),
            Transition::Seek => self.seek(now),
            Transition::Stop => {
                self.stop(now);
                Ok(())
            }
            Transition::Park => self.park(now),
            Transition::Clear => self.clear(now),
        };
        taken.map_err(|why| Refusal { state: self.state, asked: request, why })
    }

    fn home(&mut self, now: MonoTime) -> Result<(), Why> {
        match self.state {
            State::Homing => Ok(()),
            State::Parked | State::Recovering if !self.facts.identified => Err(Why::NotIdentified),
            State::Parked | State::Recovering => {
                self.begin_homing(Goal::Parked, Transition::Home, now);
                Ok(())
            }
            state => Err(in_the_way(state)),
        }
    }

    fn begin_homing(&mut self, goal: Goal, asked: Transition, now: MonoTime) {
        self.goal = goal;
        self.facts.homed = false;
        self.enter(State::Homing, Cause::Asked(asked), now);
    }

    fn arm(&mut self, asked: Transition, now: MonoTime) -> Result<(), Why> {
        match self.state {
            State::Homing if self.goal == Goal::Armed => return Ok(()),
            State::Parked | State::Armed => {}
            state => return Err(in_the_way(state)),
        }
        if let Some(why) = against_arming(self.facts.readiness) {
            return Err(why);
        }
        if self.facts.homed {
            self.enter(State::Armed, Cause::Asked(asked), now);
        } else if asked == Transition::HomeAndArm {
            self.begin_homing(Goal::Armed, asked, now);
        } else {
            return Err(Why::HomesFirst);
        }
        Ok(())
    }

    fn disarm(&mut self, now: MonoTime) -> Result<(), Why> {
        match self.state {
            State::Armed => self.enter(State::Parked, Cause::Asked(Transition::Disarm), now),
            State::Homing => self.goal = Goal::Parked,
            State::Parked => {}
            state => return Err(in_the_way(state)),
        }
        Ok(())
    }

    fn go(&mut self, now: MonoTime) -> Result<(), Why> {
        match self.state {
            State::Armed => {
                self.enter(State::Playing(PlayMode::Joining), Cause::Asked(Transition::Go), now);
                Ok(())
            }
            State::Playing(_) => Err(Why::PlaysAlready),
            State::Paused => Err(Why::PausedNow),
            State::Parked => Err(Why::NotArmed),
            state => Err(in_the_way(state)),
        }
    }

    fn pause(&mut self, now: MonoTime) -> Result<(), Why> {
        match self.state {
            State::Playing(_) => self.enter(State::Paused, Cause::Asked(Transition::Pause), now),
            State::Paused => {}
            state => return Err(nothing_plays(state)),
        }
        Ok(())
    }

    fn resume(&mut self, now: MonoTime) -> Result<(), Why> {
        match self.state {
            State::Paused => {
                self.enter(State::Playing(PlayMode::Joining), Cause::Asked(Transition::Resume), now);
            }
            State::Playing(_) => {}
            State::Recovering if self.cause == Cause::TookOver => self.take_up(now)?,
            state => return Err(nothing_plays(state)),
        }
        Ok(())
    }

    /// The show that the other machine led goes on here, as out of a pause: the seats join it from where they were read.
    fn take_up(&mut self, now: MonoTime) -> Result<(), Why> {
        self.known_position()?;
        match self.facts.readiness {
            Readiness::Ready => {}
            Readiness::NotPreflighted => return Err(Why::NotPreflighted),
            // What was played there is not loaded.
            Readiness::NoCue | Readiness::NotProved => return Err(Why::SeatsAnywhere),
        }
        self.enter(State::Playing(PlayMode::Joining), Cause::Asked(Transition::Resume), now);
        Ok(())
    }

    fn seek(&mut self, now: MonoTime) -> Result<(), Why> {
        match self.state {
            State::Playing(_) => {
                self.enter(State::Playing(PlayMode::Joining), Cause::Asked(Transition::Seek), now);
            }
            State::Armed | State::Paused => {}
            State::Parked => return Err(Why::NotArmed),
            state => return Err(nothing_plays(state)),
        }
        Ok(())
    }

    fn stop(&mut self, now: MonoTime) {
        let cause = match self.state {
            State::Homing => Cause::StoppedHoming,
            _ => Cause::Asked(Transition::Stop),
        };
        let cause = *self.stop.get_or_insert(cause);
        match self.state {
            State::Stopped | State::Stopping => {}
            state if state.may_send_motion() => self.enter(State::Stopping, cause, now),
            _ => self.enter(State::Stopped, cause, now),
        }
    }

    fn park(&mut self, now: MonoTime) -> Result<(), Why> {
        let cause = Cause::Asked(Transition::Park);
        match self.state {
            State::Playing(_) | State::Paused => self.enter(State::Parking, cause, now),
            State::Armed => self.enter(State::Parked, cause, now),
            // Whether all are there is read once more, and what is not is led there.
            State::Parked if self.facts.astray || self.facts.homed => self.enter(State::Parking, cause, now),
            State::Parked | State::Parking => {}
            State::Recovering => {
                self.known_position()?;
                self.enter(State::Parking, cause, now);
            }
            state => return Err(in_the_way(state)),
        }
        Ok(())
    }

    /// A ramp begins where the seats stand: that has to be known.
    const fn known_position(&self) -> Result<(), Why> {
        if !self.facts.identified {
            Err(Why::NotIdentified)
        } else if !self.facts.homed {
            Err(Why::PositionUnknown)
        } else if !self.facts.measured {
            Err(Why::PositionsNotRead)
        } else {
            Ok(())
        }
    }

    fn clear(&mut self, now: MonoTime) -> Result<(), Why> {
        match self.state {
            State::Stopped | State::Fault if self.facts.pressed => Err(Why::StillPressed),
            // Before every controller has told, one of them may be in an emergency stop.
            State::Stopped | State::Fault if !self.facts.identified => Err(Why::NotIdentified),
            State::Stopped | State::Fault => {
                self.stop = None;
                self.fault = None;
                self.cleared(now);
                Ok(())
            }
            State::Stopping => Err(Why::StoppingNow),
            State::Parked | State::Recovering => self.clear_controllers(now),
            _ => Err(Why::NothingToClear),
        }
    }

    /// Nothing is latched but single controllers, which went wrong while nothing moved.
    fn clear_controllers(&mut self, now: MonoTime) -> Result<(), Why> {
        match self.facts.latch {
            Latch::Free => return Err(Why::NothingToClear),
            Latch::Held => return Err(Why::StillWrong),
            Latch::Over => self.cleared(now),
        }
        Ok(())
    }

    fn cleared(&mut self, now: MonoTime) {
        self.facts.measured = false;
        self.clears = self.clears.wrapping_add(1);
        // One controller is free again, and the show that another machine led may go on with it.
        if self.cause != Cause::TookOver {
            self.enter(State::Recovering, Cause::Cleared, now);
        }
    }
}

const fn against_arming(readiness: Readiness) -> Option<Why> {
    match readiness {
        Readiness::NoCue => Some(Why::NoCue),
        Readiness::NotProved => Some(Why::NotProved),
        Readiness::NotPreflighted => Some(Why::NotPreflighted),
        Readiness::Ready => None,
    }
}

/// What the state itself has against most requests.
const fn in_the_way(state: State) -> Why {
    match state {
        State::Boot => Why::NotIdentified,
        State::Recovering => Why::SeatsAnywhere,
        State::Parked => Why::NothingPlays,
        State::Homing => Why::HomingNow,
        State::Armed => Why::ArmedNow,
        State::Playing(_) | State::Paused => Why::Riding,
        State::Stopping => Why::StoppingNow,
        State::Stopped | State::Fault => Why::Latched,
        State::Parking => Why::ParkingNow,
    }
}

/// The same for requests about a cue that plays.
const fn nothing_plays(state: State) -> Why {
    match state {
        State::Armed => Why::NothingPlays,
        state => in_the_way(state),
    }
}
