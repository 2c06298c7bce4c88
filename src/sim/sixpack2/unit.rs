//! One unit: nine octets to what its six motors do, and to what it answers after its delay.

use std::collections::VecDeque;
use std::time::Duration;

use super::motor::{Doing, LOOP, SixpackMotor};
use super::shaft::{Shaft, ShaftSetup};
use crate::time::MonoTime;
use crate::wire::sixpack2::{
    ActionsTold, FrameCollector, GREATEST_DIVIDER, InputTold, SixpackCommand, SixpackFrame, SixpackReply,
    UnitTold, VelocityTold, WAKING_DIVISOR, baud_of,
};

/// Motors of a unit.
pub(crate) const MOTORS: usize = 6;
/// What times are told in.
const TIME: Duration = Duration::from_millis(2);
/// How long it waits before it answers, at power-up: 6 ms (manual, page 44).
const WAKING_DELAY: u16 = 3;
/// Divider of the clock at power-up (manual, page 28).
const WAKING_DIVIDER: u8 = 5;
/// The input that is the supply, and its units a volt.
const SUPPLY: u8 = 7;
const UNITS_A_VOLT: u16 = 22;
/// Its version, as the example of the manual.
const FIRMWARE: u8 = 148;

/// A unit and what is on its motors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SixpackSetup {
    /// Its number, 1 to 255.
    pub(crate) unit: u8,
    /// What it tells of itself.
    pub(crate) serial: u16,
    /// What is on each motor.
    pub(crate) shafts: [ShaftSetup; MOTORS],
    /// Only one may speak at a time: what it hears while it drives the line is lost.
    pub(crate) is_two_wires: bool,
    /// It is on a CAN bus of so many bits a second, whatever it is told of its serial line.
    pub(crate) can_baud: Option<u32>,
}

/// What can happen to a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SixpackFault {
    /// It forgets all it was told, and where it is.
    Reset,
    /// It is so warm.
    Celsius(i8),
    /// Its supply has so many volts.
    Volts(u8),
    /// Something holds what is on a motor, or lets go.
    Block {
        /// Which motor; one that is not there is left alone.
        motor: usize,
        /// Holds it.
        is_blocked: bool,
    },
    /// The switch of a motor gives the level of an open one for ever, or works again.
    BreakSwitch {
        /// Which motor; one that is not there is left alone.
        motor: usize,
        /// Does not close.
        is_broken: bool,
    },
    /// All its motors lose steps where their speed changes by more than this at once, microsteps a second.
    Jump(f64),
    /// It neither hears nor moves nor answers, or its power comes back, and it wakes.
    Dead(bool),
}

/// What a unit has been told, and should not have been.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct UnitBooks {
    /// Frames to it.
    pub(crate) frames: u64,
    /// Commands that are not known, and those that must never be sent.
    pub(crate) unknown: u64,
    /// Commands to motors that it has not.
    pub(crate) no_motor: u64,
    /// Targets and moves that it left alone, as its motor was searching.
    pub(crate) left_alone: u64,
    /// Settings of a motor that was moving.
    pub(crate) settings_in_motion: u64,
    /// Octets that came while it drove the line.
    pub(crate) collisions: u64,
}

/// A unit.
#[derive(Debug, Clone)]
pub(crate) struct SixpackUnit {
    pub(crate) motors: [SixpackMotor; MOTORS],
    pub(crate) books: UnitBooks,
    setup: SixpackSetup,
    is_dead: bool,
    was_reset: bool,
    celsius: i8,
    volts: u8,
    collector: FrameCollector,
    last_octet: MonoTime,
    divisor: u16,
    delay: u16,
    clock_divider: u8,
    next_loop: MonoTime,
    /// Octets to be sent, each from a time on.
    answers: VecDeque<(MonoTime, u8)>,
    /// Until when it drives the line.
    drives_until: MonoTime,
}

impl SixpackUnit {
    /// One that wakes now.
    pub(crate) fn waking(setup: SixpackSetup, now: MonoTime) -> Self {
        let mut numbers = 0..;
        let motor = |shaft| SixpackMotor::new(numbers.next().unwrap_or(u8::MAX), Shaft::new(shaft));
        Self {
            motors: setup.shafts.map(motor),
            books: UnitBooks::default(),
            setup,
            is_dead: false,
            was_reset: true,
            celsius: 30,
            volts: 24,
            collector: FrameCollector::new(None),
            last_octet: now,
            divisor: WAKING_DIVISOR,
            delay: WAKING_DELAY,
            clock_divider: WAKING_DIVIDER,
            next_loop: now + LOOP,
            answers: VecDeque::new(),
            drives_until: MonoTime::default(),
        }
    }

    /// Its number.
    pub(crate) const fn number(&self) -> u8 {
        self.setup.unit
    }

    /// True while it neither hears nor moves nor answers.
    pub(super) const fn is_dead(&self) -> bool {
        self.is_dead
    }

    /// Octets that never became a frame.
    pub(crate) const fn strays(&self) -> u64 {
        self.collector.strays()
    }

    /// At which it listens and speaks.
    pub(crate) fn baud(&self) -> u32 {
        self.setup.can_baud.or(baud_of(self.divisor)).unwrap_or(1)
    }

    /// Something happens to it.
    pub(crate) fn suffer(&mut self, fault: SixpackFault, now: MonoTime) {
        match fault {
            SixpackFault::Reset | SixpackFault::Dead(false) => self.wake(now),
            SixpackFault::Celsius(celsius) => self.celsius = celsius,
            SixpackFault::Volts(volts) => self.volts = volts,
            SixpackFault::Block { motor, is_blocked } => {
                if let Some(motor) = self.motors.get_mut(motor) {
                    motor.shaft.block(is_blocked);
                }
            }
            SixpackFault::BreakSwitch { motor, is_broken } => {
                if let Some(motor) = self.motors.get_mut(motor) {
                    motor.shaft.break_switch(is_broken);
                }
            }
            SixpackFault::Jump(jump) => self.motors.iter_mut().for_each(|motor| motor.shaft.set_jump(jump)),
            SixpackFault::Dead(true) => {
                self.wake(now);
                self.is_dead = true;
            }
        }
    }

    /// Power comes: all but what is outside of it is as in the beginning.
    fn wake(&mut self, now: MonoTime) {
        let books = self.books;
        let motors = self.motors.each_ref().map(SixpackMotor::woken);
        *self = Self { motors, ..Self::waking(self.setup, now) };
        self.books = books;
    }

    /// Runs all loops up to now.
    pub(crate) fn advance(&mut self, now: MonoTime) {
        while self.next_loop <= now {
            if !self.is_dead {
                let divider = self.clock_divider;
                self.motors.iter_mut().for_each(|motor| motor.run(divider, self.next_loop));
            }
            self.next_loop = self.next_loop + LOOP;
        }
    }

    /// When something happens next, if anything is under way.
    pub(crate) fn next(&self) -> Option<MonoTime> {
        let is_busy = !self.is_dead && self.motors.iter().any(SixpackMotor::is_under_way);
        let answer = self.answers.front().map(|(at, _)| *at);
        [is_busy.then_some(self.next_loop), answer].into_iter().flatten().min()
    }

    /// The line is held at 0 for longer than an octet.
    pub(crate) fn on_break(&mut self) {
        self.collector.clear();
    }

    /// An octet has wholly arrived.
    pub(crate) fn on_octet(&mut self, octet: u8, now: MonoTime) {
        if self.is_dead {
            return;
        }
        if self.setup.is_two_wires && now < self.drives_until {
            self.books.collisions += 1;
            return;
        }
        let silence = now.since(self.last_octet).saturating_sub(self.octet_time());
        self.last_octet = now;
        if let Some(frame) = self.collector.push(octet, silence)
            && frame.address == self.setup.unit
        {
            self.books.frames += 1;
            self.obey(frame, now);
        }
    }

    /// The next octet of an answer, once its delay is over.
    pub(crate) fn take_octet(&mut self, now: MonoTime) -> Option<u8> {
        let (_, octet) = self.answers.pop_front_if(|(at, _)| *at <= now)?;
        // It still drives the line for as long as it waited before it spoke.
        let hold = self.delay();
        let begins = if self.drives_until > now + hold { self.drives_until } else { now + hold };
        self.drives_until = begins + self.octet_time();
        Some(octet)
    }

    fn octet_time(&self) -> Duration {
        Duration::from_nanos(10_000_000_000 / u64::from(self.baud().max(1)))
    }

    fn delay(&self) -> Duration {
        if self.setup.can_baud.is_some() { Duration::ZERO } else { TIME * u32::from(self.delay) }
    }

    fn obey(&mut self, frame: SixpackFrame, now: MonoTime) {
        let command = SixpackCommand::of(frame);
        if command.fault().is_some() && usize::from(frame.parameters[0]) < MOTORS {
            self.books.unknown += 1;
            return;
        }
        match command {
            SixpackCommand::ClockDivider(told) => {
                let moves = self.motors.iter().any(|motor| !motor.is_at_rest());
                self.books.settings_in_motion += u64::from(moves);
                self.clock_divider = told.divider.min(GREATEST_DIVIDER);
            }
            SixpackCommand::BaudSwitch(told) if told.divisor > 0 => {
                (self.divisor, self.delay) = (told.divisor, told.delay);
            }
            SixpackCommand::PacketTimeout(told) => {
                let timeout = (told.timeout > 0).then(|| TIME * u32::from(told.timeout));
                self.collector.set_timeout(timeout);
            }
            SixpackCommand::StopSeveral(told) => self.each(told.mask, |motor| {
                motor.doing = Doing::Ramp(motor.position(), 1.0);
            }),
            SixpackCommand::JointStart(told) => self.start_jointly(told.mask),
            SixpackCommand::BaudSwitch(_) | SixpackCommand::Other { .. } => self.books.unknown += 1,
            _ => match self.answer(command) {
                Some((response, reply)) => self.send(reply.frame(response), now),
                None => self.tell_motor(frame, command),
            },
        }
    }

    /// An answer goes to where its query says.
    fn answer(&mut self, query: SixpackCommand) -> Option<(u8, SixpackReply)> {
        Some(match query {
            SixpackCommand::PositionQuery(query) => {
                let motor = self.motors.get_mut(usize::from(query.motor))?;
                (query.response, motor.tell_position(query.motor).into())
            }
            SixpackCommand::VelocityQuery(query) => {
                let motor = self.motors.get(usize::from(query.motor))?;
                let (velocity, action) = (motor.speed(), motor.action());
                (query.response, VelocityTold { motor: query.motor, velocity, action }.into())
            }
            SixpackCommand::ActionsQuery(query) => {
                // One that is to wait for motors is answered at once all the same: no host of ours asks for that.
                let actions = self.motors.each_ref().map(SixpackMotor::action);
                (query.response, ActionsTold { actions }.into())
            }
            SixpackCommand::InputQuery(query) => {
                let is_supply = query.channel == SUPPLY;
                let value = if is_supply { u16::from(self.volts) * UNITS_A_VOLT } else { 0 };
                (query.response, InputTold { channel: query.channel, value, others: [0; 4] }.into())
            }
            SixpackCommand::UnitQuery(query) => {
                let reset = u8::from(std::mem::replace(&mut self.was_reset, false));
                let (celsius, serial) = (self.celsius, self.setup.serial);
                (query.response, UnitTold { firmware: FIRMWARE, reset, celsius, serial }.into())
            }
            _ => return None,
        })
    }

    fn send(&mut self, frame: SixpackFrame, now: MonoTime) {
        let at = now + self.delay();
        self.answers.extend(frame.octets().map(|octet| (at, octet)));
    }

    /// What is for one motor, the first parameter of all of these.
    fn tell_motor(&mut self, frame: SixpackFrame, command: SixpackCommand) {
        let Some(motor) = self.motors.get_mut(usize::from(frame.parameters[0])) else {
            self.books.no_motor += 1;
            return;
        };
        match command {
            SixpackCommand::AbortSearch(_) => motor.abort_search(),
            _ if matches!(motor.doing, Doing::Searching(_)) => self.books.left_alone += 1,
            SixpackCommand::ReferenceSearch(_) => motor.search(),
            SixpackCommand::PiTarget(told) => motor.doing = Doing::Following(told.target),
            SixpackCommand::Rotation(told) => motor.doing = Doing::Turning(told.velocity),
            SixpackCommand::JointTarget(told) => motor.joint = told.target,
            SixpackCommand::PositionPreset(told) => motor.preset(told.position),
            setting => {
                self.books.settings_in_motion += u64::from(!motor.is_at_rest());
                motor.write(setting);
            }
        }
    }

    fn each(&mut self, mask: u8, act: impl FnMut(&mut SixpackMotor)) {
        let is_meant = |(motor, _): &(usize, _)| mask & 1 << motor != 0;
        self.motors.iter_mut().enumerate().filter(is_meant).map(|(_, motor)| motor).for_each(act);
    }

    /// All of them at once, each as fast as it has to be to arrive with the others; those that move are left alone.
    fn start_jointly(&mut self, mask: u8) {
        let way = |motor: &SixpackMotor| f64::from(motor.joint.abs_diff(motor.position()));
        let mut longest = 1.0_f64;
        self.each(mask, |motor| longest = longest.max(way(motor)));
        self.each(mask, |motor| {
            if motor.is_at_rest() {
                motor.doing = Doing::Ramp(motor.joint, way(motor) / longest);
            }
        });
    }
}
