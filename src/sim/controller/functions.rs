//! What inputs do to a virtual controller (PA90 to PA98): emergency stop, jog, emergency reset.

use std::time::Duration;

use super::{Controller, NEVER};
use crate::device::Address;
use crate::motion::{MAX_AXES, Pulses};
use crate::sim::pa;
use crate::sim::player::{MotorPositions, PlayedLeg};
use crate::sim::registers::{OWN_REGISTERS, has};
use crate::time::MonoTime;
use crate::wire::{Dialect, PerAxis};

/// Bits of PA90.
mod function {
    pub(super) const EMERGENCY_STOP: u16 = 1;
    pub(super) const JOG: u16 = 1 << 1;
    pub(super) const JOG_BACK: u16 = 1 << 2; // IMAX manual 2.3.1; on SMC both ways hang on the bit before
    pub(super) const EMERGENCY_RESET: u16 = 1 << 3; // SMC manual 2.3.1
}

/// How long a jog goes on at most; the manuals set it no end.
const LONGEST_JOG: Duration = Duration::from_secs(60);

/// What is known about the emergency stop.
#[derive(Debug, Clone, Copy)]
pub(super) struct EmergencyStop {
    /// From when on it is forced by order of the setup.
    forced_at: MonoTime,
    /// True if it is in effect although no input asks for it.
    forced: bool,
    /// True if anything asks for it.
    asked: bool,
    in_effect: bool,
    /// True if only a reset ends it (PA91 = 2).
    latched: bool,
}

impl EmergencyStop {
    pub(super) fn new(forced_at: Option<MonoTime>) -> Self {
        let forced_at = forced_at.unwrap_or(NEVER);
        Self { forced_at, forced: false, asked: false, in_effect: false, latched: false }
    }

    pub(super) const fn forced_at(&self) -> MonoTime {
        self.forced_at
    }

    pub(super) const fn force(&mut self, on: bool) {
        self.forced = on;
    }

    pub(super) const fn asked(&self) -> bool {
        self.asked
    }

    pub(super) const fn in_effect(&self) -> bool {
        self.in_effect
    }

    pub(super) const fn unlatch(&mut self) {
        self.latched = false;
    }

    /// Forgets what it did, not who asks for it.
    pub(super) const fn restart(&mut self) {
        self.latched = false;
        self.in_effect = false;
    }
}

/// Which way inputs move the axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Jog {
    Out,
    Back,
}

impl Controller {
    pub(super) fn switch(&mut self, closed: u16, at: MonoTime) {
        self.inputs.switch(closed, self.registers.get(pa::INPUT_POLARITY) == 1, at);
        self.run_functions(at);
    }

    /// Does what the inputs ask for, their filter included.
    pub(super) fn run_functions(&mut self, at: MonoTime) {
        self.inputs.settle(self.registers.millis(pa::INPUT_FILTER), at);
        if self.estop.forced_at <= at {
            self.estop.forced_at = NEVER;
            self.estop.forced = true;
        }
        self.estop.asked = self.estop.forced || self.emergency_stop_asked();
        self.run_emergency_stop(at);
        self.run_emergency_reset(at);
        self.run_jog(at);
    }

    /// Programs stop an MBOX by enabling the function without any input, and release it by disabling that; an SMC
    /// needs an input.
    fn emergency_stop_asked(&self) -> bool {
        let by_register = self.dialect == Dialect::Mbox
            && self.registers.get(pa::INPUT_FUNCTIONS) & function::EMERGENCY_STOP != 0
            && self.registers.get(pa::ESTOP_INPUTS) == 0;
        by_register || self.inputs_ask(function::EMERGENCY_STOP, pa::ESTOP_INPUTS)
    }

    /// True if a function is enabled and all its inputs are active.
    fn inputs_ask(&self, function: u16, mask: u8) -> bool {
        self.registers.get(pa::INPUT_FUNCTIONS) & function != 0 && self.inputs.all(self.registers.get(mask))
    }

    /// Lets the emergency stop come into effect or end (SMC manual 5.6).
    fn run_emergency_stop(&mut self, at: MonoTime) {
        let pace = *self.pace();
        match (self.estop.in_effect, self.estop.asked) {
            (false, true) => {
                self.estop.in_effect = true;
                self.jog = None;
                self.last_absolute = None;
                if self.spoil_homing(at) {
                    self.player.hold(at, &pace);
                }
                match self.registers.get(pa::ESTOP_WAY) {
                    0 => self.player.pause(at, &pace),
                    1 => self.player.pause_in_zero(at, &pace),
                    _ => {
                        self.player.hold(at, &pace);
                        self.estop.latched = true;
                    }
                }
            }
            (true, false) if !self.estop.latched => {
                self.estop.in_effect = false;
                self.player.advance(at, &pace);
                self.released = Some(self.player.executed);
                let slow = *self.pace();
                self.player.resume(at, &slow);
            }
            _ => {}
        }
    }

    /// Resets when its inputs come to ask for it.
    fn run_emergency_reset(&mut self, at: MonoTime) {
        let enabled = has(Address::Pa(pa::RESET_INPUTS), self.dialect);
        let asked = enabled && self.inputs_ask(function::EMERGENCY_RESET, pa::RESET_INPUTS);
        let comes = asked && !self.reset_asked;
        self.reset_asked = asked;
        if comes && !self.estop.asked {
            self.reset(at);
        }
    }

    /// Begins or ends a jog; only a controller at rest jogs.
    fn run_jog(&mut self, at: MonoTime) {
        let back = if self.dialect == Dialect::Mbox { function::JOG_BACK } else { function::JOG };
        let asked = if self.jog_asks(function::JOG, pa::JOG_OUT_INPUTS) {
            Some(Jog::Out)
        } else if self.jog_asks(back, pa::JOG_BACK_INPUTS) {
            Some(Jog::Back)
        } else {
            None
        };
        if asked == self.jog {
            return;
        }
        self.end_jog(at);
        let free = !self.estop.in_effect && self.errors.is_empty() && at >= self.homing_until;
        if let (Some(way), true, true) = (asked, free, self.player.idle()) {
            let pace = *self.pace();
            let leg = self.jog_leg(way, at);
            self.jog = self.player.push(leg, at, &pace).is_ok().then_some(way);
        }
    }

    /// Inputs that may stop the seat do not jog it (IMAX manual 2.3.1, PA96 and PA97).
    fn jog_asks(&self, function: u16, mask: u8) -> bool {
        self.registers.get(mask) & self.registers.get(pa::ESTOP_INPUTS) == 0
            && self.inputs_ask(function, mask)
    }

    /// Ends a jog where it is.
    pub(super) fn end_jog(&mut self, at: MonoTime) {
        if self.jog.take().is_some() {
            let pace = *self.pace();
            self.player.hold(at, &pace);
        }
    }

    /// Out, at the safe speed of each axis; or back to zero, no axis faster than that.
    #[expect(clippy::cast_possible_truncation, reason = "a saturating cast is what is wanted")]
    fn jog_leg(&self, way: Jog, at: MonoTime) -> PlayedLeg {
        let here = self.player.positions(at);
        let axes = self.registers.axes();
        let speeds: [f64; MAX_AXES] = std::array::from_fn(|axis| self.jog_speed(axis));
        let seconds = LONGEST_JOG.as_secs_f64();
        let (to, duration): (MotorPositions, _) = match way {
            Jog::Out => {
                let out = |axis: usize| f64::from(here[axis].0) + speeds[axis] * seconds * 1e3;
                let end = |axis: usize| if axis < axes { Pulses(out(axis) as i32) } else { here[axis] };
                (std::array::from_fn(end), LONGEST_JOG)
            }
            Jog::Back => {
                let ms = (0..axes).map(|axis| f64::from(here[axis].0).abs() / speeds[axis]);
                let duration = Duration::try_from_secs_f64(ms.fold(0.0, f64::max) / 1e3);
                ([Pulses(0); MAX_AXES], duration.unwrap_or(LONGEST_JOG))
            }
        };
        PlayedLeg { to, duration, vibration: PerAxis::default() }
    }

    /// Speed of an axis that jogs, pulses per millisecond.
    fn jog_speed(&self, axis: usize) -> f64 {
        let own =
            if axis < OWN_REGISTERS { self.registers.all()[usize::from(pa::SAFE_RPM) + axis] } else { 0 };
        self.registers.speed(if own == 0 { self.invented.jog_rpm.max(1) } else { own })
    }
}
