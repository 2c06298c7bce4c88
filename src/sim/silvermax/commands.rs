//! What a unit takes, refuses and answers.

use super::mover::{MoverMode, QueuedSegment, StopWords};
use super::trajectory::{Trajectory, TrajectoryGoal};
use super::unit::Unit;
use crate::wire::silvermax::{
    ALL_UNITS, AnyRequest, Class, Internal, NakReason, Poll, Reply, Words, register,
};

/// What commands answer: data, or that they are done.
type CommandAnswer = Result<Option<Words>, NakReason>;

/// HLT, RST, SPR, VMI, GOL, KDD, RSM, RSN, TIM.
const FORBIDDEN: [u8; 9] = [2, 4, 13, 15, 143, 183, 196, 198, 218];

/// Motions: those that wait for the running one.
const MOTIONS: [u8; 3] = [134, 135, 253];

impl Unit {
    /// Takes a request, if it is for this unit; answers one that is for it alone.
    pub(super) fn hear(&mut self, request: &AnyRequest) -> Option<Reply> {
        let is_own = request.unit == self.setup.unit;
        if !(self.is_there() && (is_own || [self.setup.group, ALL_UNITS].contains(&request.unit))) {
            return None;
        }
        self.tally.requests += 1;
        let unit = self.setup.unit;
        let command = u16::from(request.number);
        let reply = match self.take(request) {
            Ok(None) => Reply::Ack { unit },
            Ok(Some(words)) => Reply::Data { unit, command, words },
            Err(reason) => {
                let is_full = reason == NakReason::QueueFull;
                *(if is_full { &mut self.tally.full } else { &mut self.tally.refused }) += 1;
                Reply::Nak { unit, command, reason }
            }
        };
        // A unit that starts again does not answer (RST, page 26).
        (is_own && self.is_there()).then(|| self.signed(reply))
    }

    /// The reply under the name that it answers by.
    const fn signed(&self, reply: Reply) -> Reply {
        let Some(other) = self.world.answers_as else { return reply };
        match reply {
            Reply::Ack { .. } => Reply::Ack { unit: other },
            Reply::Data { command, words, .. } => Reply::Data { unit: other, command, words },
            Reply::Nak { command, reason, .. } => Reply::Nak { unit: other, command, reason },
        }
    }

    fn take(&mut self, request: &AnyRequest) -> CommandAnswer {
        let command = request.command().ok_or(NakReason::Command)?;
        let parameters = request.parameters.as_slice();
        let fit = command.parameters.iter().zip(parameters).all(|(parameter, value)| parameter.takes(*value));
        if !fit || command.parameters.len() != parameters.len() {
            return Err(NakReason::Format);
        }
        if FORBIDDEN.contains(&request.number) {
            self.tally.forbidden += 1;
        }
        if command.class == Class::E {
            return Err(NakReason::Command);
        }
        if command.class == Class::A {
            return self.take_at_once(request.number, parameters);
        }
        let is_free = self.settings.is_multi_tasking && command.class == Class::D;
        if self.pending.is_some() || self.is_moving() && !is_free {
            return Err(NakReason::Busy);
        }
        if MOTIONS.contains(&request.number) {
            if self.is_moving() {
                self.pending = Some(*request);
            } else {
                self.begin(request);
            }
            return Ok(None);
        }
        self.status.news |= Poll::DONE;
        self.set(request.number, parameters)
    }

    /// Commands of class A.
    fn take_at_once(&mut self, number: u8, parameters: &[i64]) -> CommandAnswer {
        let word = |word: u16| Ok(Some(Words::of(&[word])));
        match (number, parameters) {
            (0, _) => {
                self.status.told |= std::mem::take(&mut self.status.news);
                return if self.status.told == 0 { Ok(None) } else { word(self.status.told) };
            }
            (1, [mask]) => self.status.told &= !low_word(*mask),
            (2, _) => {
                self.settings.is_driving = false;
                self.halt();
            }
            (3, [deceleration]) => self.stop(*deceleration),
            (4, _) => self.reset(),
            (5, _) => return Ok(Some(Words::of(&[0x1116, 0x1998, 0x0321, 0x0a34]))),
            (11, [register, value]) => self.write(*register, *value),
            (12, [register]) => return self.read(*register).map(|value| Some(Words::of_value(value))),
            (15, [acceleration, velocity, enable, state]) => {
                let goal = TrajectoryGoal::Velocity { to: *velocity, acceleration: acceleration.abs() };
                self.mode = MoverMode::Move { goal, stop: StopWords { enable: *enable, state: *state } };
            }
            (20, _) => return word(self.internal()),
            (21, _) => return word(self.io()),
            (25, [ticks, position, acceleration, velocity]) => {
                let segment = QueuedSegment {
                    ticks: u32::try_from(*ticks).unwrap_or(u32::MAX),
                    position: i32::try_from(*position).unwrap_or(0),
                    acceleration: *acceleration,
                    velocity: *velocity,
                };
                return if self.queue.push(segment) { Ok(None) } else { Err(NakReason::QueueFull) };
            }
            _ => return Err(NakReason::Command),
        }
        Ok(None)
    }

    /// STP, page 29: the program ends, a motion brakes; the queue keeps what is in it.
    fn stop(&mut self, deceleration: i64) {
        self.pending = None;
        if deceleration < 0 {
            self.target = self.actual();
            self.brake(0);
        } else if let Some(running) = self.mode.acceleration() {
            self.brake(if deceleration == 0 { running } else { deceleration });
        } else {
            self.mode = MoverMode::Hold;
        }
    }

    fn write(&mut self, register: i64, value: i64) {
        let place = usize::try_from(register).ok().and_then(|at| self.settings.registers.get_mut(at));
        if let (Some(place), Ok(value)) = (place, i32::try_from(value)) {
            *place = value;
        }
    }

    fn read(&self, register: i64) -> Result<i32, NakReason> {
        let register = u8::try_from(register).map_err(|_| NakReason::Format)?;
        let pair = |high: u16, low: u16| (u32::from(high) << 16 | u32::from(low)).cast_signed();
        let (settings, status) = (&self.settings, &self.status);
        let error = |error: i64| u16::try_from(error).unwrap_or(u16::MAX);
        Ok(match register {
            register::TARGET => self.target(),
            register::POSITION => self.position(),
            3 => pair(self.internal(), u16::from(self.is_moving())),
            register::ERRORS => {
                let now = (self.target - self.actual()).abs() >> (self.setup.bits + 1);
                pair(error(status.max_error), error(now))
            }
            register::TICKS_LEFT => self.ticks_left().cast_signed(),
            register::TORQUE_CLOSED => pair(settings.torque[0], settings.torque[1]),
            register::TORQUE_OPEN => pair(settings.torque[2], settings.torque[3]),
            register::ERROR_LIMITS => pair(settings.errors[0], settings.errors[1]),
            register::KILL_CAUSE => status.kill_cause.cast_signed(),
            41..=199 | 212.. => return Err(NakReason::Format),
            _ => settings.registers.get(usize::from(register)).copied().unwrap_or(0),
        })
    }

    /// Begins a motion: MAV, MRV, IMS.
    pub(super) fn begin(&mut self, request: &AnyRequest) {
        self.trajectory = Trajectory::at_rest(self.target);
        let &[to, acceleration, velocity, enable, state] = request.parameters.as_slice() else {
            self.mode = MoverMode::Queue { running: None, left: 0 };
            return;
        };
        let to = self.twice_of(i32::try_from(to).unwrap_or(0));
        let twice = if request.number == 134 { to } else { self.target + to };
        // At most half the velocity (page 99).
        let goal =
            TrajectoryGoal::Place { twice, acceleration: acceleration.min(velocity / 2).max(1), velocity };
        self.mode = MoverMode::Move { goal, stop: StopWords { enable, state } };
    }

    /// What is no motion, of class D.
    fn set(&mut self, number: u8, parameters: &[i64]) -> CommandAnswer {
        match (number, parameters) {
            (142 | 145, _) => self.count_from(self.axis.place()),
            (146, _) => {
                self.target = self.actual();
                self.trajectory = Trajectory::at_rest(self.target);
            }
            (147, _) => self.status.max_error = 0,
            (149, torque) => words(torque, &mut self.settings.torque),
            (151, errors) => words(errors, &mut self.settings.errors),
            (155, [both]) => {
                let [group, unit] = low_word(*both).to_be_bytes();
                (self.setup.group, self.setup.unit) = (group, unit);
            }
            (163, _) => self.status.latched = 0,
            (165, [1802]) => {
                let less = self.twice_of(self.settings.registers[usize::from(register::ACCUMULATOR)]);
                self.origin += less;
                self.target -= less;
                self.trajectory.twice -= less;
            }
            (167, kill) => words(kill, &mut self.settings.kill),
            (173, [ticks]) => self.setup.adl = low_word(*ticks),
            (193, [_, register]) => self.write(*register, SUPPLY),
            (174, [code]) if !BAUD_CODES.contains(code) => return Err(NakReason::Format),
            // The rate is the line's, and what MTT and GOC set shows nowhere.
            (174 | 214 | 237, _) => {}
            (221, [first]) => {
                self.settings.soft_limits = u8::try_from(*first).ok().filter(|first| *first >= 10)
            }
            (225, _) => self.settings.is_multi_tasking = true,
            (227, _) => {
                self.settings.is_driving = true;
                self.status.latched &= !Internal::HALTED;
                self.axis.jump(self.target + self.origin);
            }
            (254, _) => self.queue.clear(),
            _ => return Err(NakReason::Command),
        }
        Ok(None)
    }

    /// Target and position are 0 there.
    fn count_from(&mut self, place: i64) {
        self.origin = place;
        self.target = 0;
        self.trajectory = Trajectory::at_rest(0);
    }
}

/// Baud rates in hundreds (BRT, page 35).
const BAUD_CODES: [i64; 12] = [3, 12, 24, 48, 96, 192, 288, 384, 576, 1_000, 1_152, 2_304];

/// What its converter reads of a supply of 48 V; the command reference has no scale.
const SUPPLY: i64 = 480;

fn low_word(value: i64) -> u16 {
    u16::try_from(value & 0xffff).unwrap_or(0)
}

fn words(parameters: &[i64], kept: &mut [u16]) {
    kept.iter_mut().zip(parameters).for_each(|(kept, value)| *kept = low_word(*value));
}
