//! Between the state machine of the hall and the engine of the play: what is asked and what happens goes to the machine,
//! what the machine says is done by the engine, and what the engine then does is told to the machine. Tick thread.

use super::mail::{Alarm, News};
use crate::engine::{Ending, Engine, Rest};
use crate::state::{Cause, Event, Finding, Machine, Next, Readiness, Refusal, Request, Ride, State, Trouble};
use crate::time::{MonoTime, ShowTime};

/// The machine, and what was last done for it.
#[derive(Debug)]
pub struct Conductor {
    machine: Machine,
    /// The state that the engine was told last.
    told: State,
    /// The state that was made known last, why, since when it lasts, and what a person does next.
    known: Option<(State, Cause, MonoTime, Next)>,
    /// Whether a person is there to clear what is latched; else the play ends with it.
    attended: bool,
    /// Whether the hall lives on when its show is over.
    stays: bool,
}

impl Conductor {
    /// One of a hall in that state.
    #[must_use]
    pub const fn new(machine: Machine, attended: bool) -> Self {
        Self { told: machine.state(), machine, known: None, attended, stays: false }
    }

    /// One of a hall that lives on when its show is over.
    #[must_use]
    pub const fn of_a_hall(now: MonoTime) -> Self {
        Self { stays: true, ..Self::new(Machine::new(now), true) }
    }

    /// Whether the hall lives on when its show is over.
    #[must_use]
    pub const fn stays(&self) -> bool {
        self.stays
    }

    /// One of a play in the foreground: whoever started it has armed the hall and let it go. Its seats are brought to park
    /// before the first tick. Where it is not `attended`, a stop or a fault is the end of it.
    #[must_use]
    pub fn of_a_play(now: MonoTime, attended: bool) -> Self {
        let mut machine = Machine::new(now);
        machine.event(Event::Identified(Finding { homed: true, at_park: true, crashed: false }), now);
        machine.event(Event::Readiness(Readiness::Ready), now);
        for request in [Request::Arm, Request::Go] {
            // Neither is refused to a parked hall that is ready.
            let _ = machine.request(request, now);
        }
        Self::new(machine, attended)
    }

    /// Where the hall stands, and why.
    #[must_use]
    pub const fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Takes a request.
    ///
    /// # Errors
    /// [`Refusal`] where the state does not allow it; nothing has changed then.
    pub fn request(&mut self, request: Request, engine: &mut Engine, now: MonoTime) -> Result<(), Refusal> {
        self.look_for_stray(engine, now);
        self.machine.request(request, now)?;
        self.steer(engine);
        Ok(())
    }

    /// Goes on at that time of the film.
    ///
    /// # Errors
    /// As [`Conductor::request`].
    pub fn seek(&mut self, film: ShowTime, engine: &mut Engine, now: MonoTime) -> Result<(), Refusal> {
        self.machine.request(Request::Seek, now)?;
        engine.seek(film);
        self.steer(engine);
        Ok(())
    }

    /// Takes what the control plane has found out.
    pub fn event(&mut self, event: Event, engine: &mut Engine, now: MonoTime) {
        self.machine.event(event, now);
        self.steer(engine);
    }

    /// Takes what was seen of a controller.
    pub fn alarm(&mut self, alarm: Alarm, engine: &mut Engine, now: MonoTime) {
        match alarm {
            Alarm::Event(event) => self.machine.event(event, now),
            Alarm::Leave(lane) => engine.leave(usize::from(lane)),
            Alarm::Cut(lane) => engine.cut(usize::from(lane)),
            // Where it was found is looked up by whoever knows what the lane was sent.
            Alarm::Found(_) => {}
        }
        self.steer(engine);
    }

    /// Somebody wants the program to end: the seats park, as far as the hall may move; where it may not, the play is over.
    pub fn leave(&mut self, engine: &mut Engine, now: MonoTime) {
        match self.machine.state() {
            State::Playing(_) | State::Paused => {
                let _ = self.machine.request(Request::Park, now);
                self.steer(engine);
            }
            State::Stopping | State::Parking => {}
            _ => engine.end(),
        }
    }

    /// Stops; never refused.
    pub fn stop(&mut self, engine: &mut Engine, now: MonoTime) {
        let _ = self.machine.request(Request::Stop, now);
        self.steer(engine);
    }

    /// Ends what has lasted too long; to be told every tick, before the engine's.
    pub fn tick(&mut self, engine: &mut Engine, now: MonoTime) {
        self.machine.tick(now);
        self.steer(engine);
    }

    /// Has the engine do what the state says.
    fn steer(&mut self, engine: &mut Engine) {
        let state = self.machine.state();
        if std::mem::replace(&mut self.told, state) == state {
            return;
        }
        match state {
            State::Playing(_) => {
                engine.go();
                engine.resume();
            }
            State::Paused => engine.pause(),
            State::Stopping | State::Stopped | State::Fault => engine.stop(),
            State::Parking => engine.park(),
            State::Parked | State::Armed => engine.stand_by(),
            State::Boot | State::Recovering | State::Homing => {}
        }
    }

    /// Tells the machine what the engine does; to be called every tick, after the engine's.
    pub fn watch(&mut self, engine: &mut Engine, now: MonoTime) {
        if let Some(event) = self.what_happened(engine) {
            self.machine.event(event, now);
            self.steer(engine);
        }
        self.look_for_stray(engine, now);
        if !self.attended && self.machine.state().is_latched() {
            engine.end();
        }
    }

    /// Between shows a person may want a seat down that rests up.
    fn look_for_stray(&mut self, engine: &Engine, now: MonoTime) {
        if self.machine.state() == State::Parked {
            self.machine.event(Event::Astray(engine.is_astray()), now);
        }
    }

    fn what_happened(&self, engine: &mut Engine) -> Option<Event> {
        let planless = engine.take_planless();
        if planless && !self.machine.state().is_latched() {
            return Some(Event::Trouble(Trouble::Planner));
        }
        if engine.take_gate_fault() {
            return Some(Event::Trouble(Trouble::Gate));
        }
        match self.machine.state() {
            State::Playing(_) if engine.is_homeward() => Some(Event::CueEnded),
            State::Playing(ride) => match (ride, engine.rest()) {
                (Ride::Joining | Ride::Following, Some(Rest::Late)) => Some(Event::Late),
                (Ride::Freewheeling, None) => Some(Event::JoinBegun),
                (Ride::Joining, None) if engine.is_on_cue() => Some(Event::Joined),
                _ => None,
            },
            State::Stopping if engine.is_told_to_rest() => Some(Event::AtRest),
            State::Parking if engine.ending().is_some() => Some(Event::Parked),
            _ => None,
        }
    }

    /// What is new since it was asked last.
    pub fn news(&mut self) -> Option<News> {
        let known = (self.machine.state(), self.machine.cause(), self.machine.since(), self.machine.next());
        if self.known.replace(known) == Some(known) {
            return None;
        }
        let (state, cause, at, next) = known;
        Some(News::Entered { state, cause, next, at })
    }

    /// How the play ended.
    #[must_use]
    pub fn ending(&self, engine: &Engine) -> Ending {
        match engine.ending() {
            Some(ending) if self.machine.fault().is_none() => ending,
            _ => Ending::Fault,
        }
    }
}
