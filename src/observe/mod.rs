//! Self-reports of the controllers: the last known state of each, its age, and their events.
//! Ack thread; messages and time are arguments; all memory is allocated at the start.
//!
//! One structure that the report, the API and the console read alike.

mod event;
mod hear;
mod state;

pub(crate) use event::{Cause, Event, What};
pub(crate) use state::{ControllerState, Heard};

use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddrV4};

use crate::config::{Controller, Station};
use crate::motion::Pulses;
use crate::time::MonoTime;
use crate::wire::{
    Code, DPFE, Dialect, FrameNo, FromController, MotionReply, PerAxis, RegisterReport, ReplyCode, Status,
    VibrationPort,
};

/// Events that are kept; of more the oldest go.
const EVENTS_KEPT: usize = 1_000;

/// What has to be known of a controller to understand it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Watched {
    /// Where it is; the last two bytes of the address are its control ID (PA12, PA13).
    pub address: SocketAddrV4,
    /// Its message set.
    pub dialect: Dialect,
    /// How its answers to vibration frames have the inputs.
    pub vibration_port: VibrationPort,
    /// The inputs of which any one means an emergency stop, bit 0 = X01; 0 if none does.
    pub estop_inputs: u16,
}

impl Watched {
    /// What the configuration says of a controller.
    #[must_use]
    pub fn of(controller: &Controller<Station>) -> Self {
        let Station { address, dialect, vibration_port, .. } = controller.connection;
        Self { address, dialect, vibration_port, estop_inputs: controller.estop_inputs }
    }

    fn station(&self) -> Code {
        Code::station(self.address.ip().octets())
    }
}

/// What the first reply to a frame says beside positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FirstAnswer {
    /// The frame that it answers.
    pub(crate) frame: FrameNo,
    /// How the controller does.
    pub(crate) code: ReplyCode,
    /// Its error number; 0 for none.
    pub(crate) error: u16,
    /// Its inputs, bit 0 = X01.
    pub(crate) inputs: u16,
}

/// What a look at the registers of a controller says of an emergency stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Look {
    /// How it stands with it.
    pub(crate) stop: StopSign,
    /// The inputs, where they were told; bit 0 = X01.
    pub(crate) inputs: Option<u16>,
}

/// How it stands with an emergency stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopSign {
    /// This look alone does not tell.
    Unsure,
    /// Its inputs ask for it.
    Asked,
    /// Its inputs asked for it and do no more, and it is still in effect: the controller holds until a reset (PA91 = 2).
    Held,
    /// All answers of this look, and of the one before, were asked for since the last sign of it, and none had one.
    Over,
}

/// The states of all controllers, counted from 0 in the order of their lanes, and the events that led to them.
#[derive(Debug)]
pub struct Observer {
    watched: Vec<Watched>,
    states: Vec<ControllerState>,
    events: VecDeque<Event>,
    /// Events that are no longer kept.
    forgotten: u64,
}

impl Observer {
    /// Nothing known yet of these controllers.
    #[must_use]
    pub(crate) fn new(watched: Vec<Watched>) -> Self {
        Self {
            states: vec![ControllerState::default(); watched.len()],
            events: VecDeque::with_capacity(EVENTS_KEPT),
            forgotten: 0,
            watched,
        }
    }

    /// Knows of so many more behind them, which are on no network.
    pub(crate) fn add(&mut self, controllers: usize) {
        self.states.resize(self.states.len() + controllers, ControllerState::default());
    }

    /// A datagram, as that controller writes them.
    #[must_use]
    pub(crate) fn read<'a>(&self, controller: usize, bytes: &'a [u8]) -> FromController<'a> {
        FromController::parse(self.watched[controller].vibration_port, bytes)
    }

    /// The last known states.
    #[must_use]
    pub fn states(&self) -> &[ControllerState] {
        &self.states
    }

    /// What happened, oldest first; the last 1,000 of it.
    pub(crate) fn events(&self) -> impl Iterator<Item = &Event> {
        self.events.iter()
    }

    /// Gives `on` what happened since so many events; returns how many there are now. What is no longer kept is left out.
    pub(crate) fn events_since(&self, heard: u64, on: impl FnMut(&Event)) -> u64 {
        let new = usize::try_from(heard.saturating_sub(self.forgotten)).unwrap_or(usize::MAX);
        self.events.iter().skip(new).for_each(on);
        self.forgotten + self.events.len() as u64
    }

    /// Events that are no longer kept.
    #[must_use]
    #[cfg(test)]
    pub(crate) const fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// Hears a reply to a motion frame, be it an old one or a repeated one: what it says of the controller counts only once
    /// it is known for neither ([`Observer::on_answer`]).
    pub(crate) fn on_reply(&mut self, controller: usize, reply: &MotionReply, at: MonoTime) {
        let state = &mut self.states[controller];
        state.reply = Some(Heard { value: reply.code, at });
        state.echoed = Some(Heard { value: reply.positions, at });
        state.heard_at = Some(at);
    }

    /// Hears the first reply to a frame. One to a frame older than the newest that was answered says nothing new.
    pub(crate) fn on_answer(&mut self, controller: usize, answer: &FirstAnswer, at: MonoTime) {
        let smc = self.is_smc(controller);
        let state = &mut self.states[controller];
        if state.answered.is_some_and(|newest| answer.frame.since(newest) <= 0) {
            return;
        }
        state.answered = Some(answer.frame);
        // An MBOX controller says with x = 4 that a frame was too short, and has no error numbers in motion replies.
        self.on_code(controller, answer.code, at);
        if smc && answer.code != ReplyCode::Running {
            self.states[controller].error_by_reply = true;
            self.note_error(controller, answer.error, at);
        } else if std::mem::take(&mut self.states[controller].error_by_reply) {
            self.note_error(controller, 0, at);
        }
        self.note_inputs(controller, answer.inputs, at);
    }

    /// Hears the reply code of any answer, to a frame or to registers: an emergency stop begins with the first that says so.
    /// It ends by [`Observer::on_look`] alone: an answer may be from before it was pressed.
    pub(crate) fn on_code(&mut self, controller: usize, code: ReplyCode, at: MonoTime) {
        if self.is_smc(controller) && code == ReplyCode::EmergencyStop {
            self.note_stop(controller, Cause::Reply, true, at);
        }
    }

    /// Hears what a whole look at a controller says of an emergency stop.
    pub(crate) fn on_look(&mut self, controller: usize, look: Look, at: MonoTime) {
        if let Some(inputs) = look.inputs {
            self.note_inputs(controller, inputs, at);
        }
        let state = &mut self.states[controller];
        match look.stop {
            StopSign::Over => {
                self.note_stop(controller, Cause::Reply, false, at);
                self.note_stop(controller, Cause::Inputs, false, at);
            }
            StopSign::Held if state.emergency_stop() && !state.stop_is_held => {
                state.stop_is_held = true;
                self.happened(controller, at, What::EmergencyStopHeld);
            }
            StopSign::Asked if std::mem::take(&mut state.stop_is_held) => {
                self.happened(controller, at, What::EmergencyStop { cause: Cause::Inputs });
            }
            StopSign::Unsure | StopSign::Asked | StopSign::Held => {}
        }
    }

    fn is_smc(&self, controller: usize) -> bool {
        self.watched.get(controller).is_some_and(|watched| watched.dialect == Dialect::Smc)
    }

    /// Hears a status report; one of another station is not taken. Says whether it was.
    pub(crate) fn on_status(&mut self, controller: usize, status: &Status, at: MonoTime) -> bool {
        if status.station != self.watched[controller].station() {
            return false;
        }
        let state = &mut self.states[controller];
        state.reports += 1;
        state.reported_at = Some(at);
        state.outputs = Some(Heard { value: status.outputs, at });
        state.forces = Some(Heard { value: status.forces, at });
        let before = state.servo_errors.replace(Heard { value: status.servo_errors, at });
        for (axis, error) in status.servo_errors.iter().enumerate() {
            let known = before.and_then(|before| before.value.get(axis).copied()).unwrap_or(0);
            if *error != known {
                self.happened(controller, at, What::ServoError { axis: axis + 1, error: *error });
            }
        }
        self.note_error(controller, status.error, at);
        self.note_inputs(controller, status.inputs, at);
        self.on_positions(controller, status.positions, at);
        true
    }

    /// Hears registers that an IMAX or MBOX controller reports unasked.
    pub(crate) fn on_report(&mut self, controller: usize, report: &RegisterReport<'_>, at: MonoTime) {
        let state = &mut self.states[controller];
        state.reports += 1;
        state.heard_at = Some(at);
        let first = (report.start, report.data.get(0).unwrap_or(0));
        if self.watched[controller].dialect != Dialect::Mbox {
            return self.happened(controller, at, What::Report { start: first.0, first: first.1 });
        }
        let of_drives = DPFE.checked_sub(report.start).and_then(|index| report.data.get(usize::from(index)));
        let (register, value) = of_drives.map_or(first, |alarm| (DPFE, alarm));
        self.happened(controller, at, What::Alarm { register, value });
    }

    /// Hears positions that were measured: position registers, or a status report.
    pub(crate) fn on_positions(&mut self, controller: usize, positions: PerAxis<Pulses>, at: MonoTime) {
        let state = &mut self.states[controller];
        state.measured = Some(Heard { value: positions, at });
        state.heard_at = Some(at);
    }

    /// Which controller sent a report from a port that is none of the frame ports: the one at that address, where there
    /// are several the one whose control ID it says. None where that leaves it open.
    #[must_use]
    pub(crate) fn sender_of_report(&self, from: Ipv4Addr, station: Option<Code>) -> Option<usize> {
        let may_be =
            |one: &Watched| *one.address.ip() == from && station.is_none_or(|it| it == one.station());
        let mut found =
            self.watched.iter().enumerate().filter(|(_, one)| may_be(one)).map(|(index, _)| index);
        let controller = found.next()?;
        found.next().is_none().then_some(controller)
    }

    /// Hears which outputs are on, as they were read.
    pub(crate) fn on_outputs(&mut self, controller: usize, value: u16, at: MonoTime) {
        self.states[controller].outputs = Some(Heard { value, at });
    }

    fn note_inputs(&mut self, controller: usize, inputs: u16, at: MonoTime) {
        let state = &mut self.states[controller];
        state.heard_at = Some(at);
        state.inputs = Some(Heard { value: inputs, at });
        let estop_inputs = self.watched.get(controller).map_or(0, |watched| watched.estop_inputs);
        if inputs & estop_inputs != 0 {
            self.note_stop(controller, Cause::Inputs, true, at);
        }
    }

    /// An emergency stop begins with the first of its signs and is over with the last.
    fn note_stop(&mut self, controller: usize, cause: Cause, active: bool, at: MonoTime) {
        let state = &mut self.states[controller];
        let before = state.emergency_stop();
        match cause {
            Cause::Reply => state.stopped_by_reply = active,
            Cause::Inputs => state.stopped_by_inputs = active,
        }
        match (before, state.emergency_stop()) {
            (false, true) => self.happened(controller, at, What::EmergencyStop { cause }),
            (true, false) => {
                self.states[controller].stop_is_held = false;
                self.happened(controller, at, What::EmergencyStopOver);
            }
            _ => {}
        }
    }

    fn note_error(&mut self, controller: usize, error: u16, at: MonoTime) {
        let before = self.states[controller].error.replace(Heard { value: error, at });
        if before.map_or(0, |before| before.value) != error {
            self.happened(controller, at, What::Error(error));
        }
    }

    fn happened(&mut self, controller: usize, at: MonoTime, what: What) {
        if self.events.len() == EVENTS_KEPT {
            self.events.pop_front();
            self.forgotten += 1;
        }
        self.events.push_back(Event { controller, at, what });
    }
}

#[cfg(test)]
mod tests;
