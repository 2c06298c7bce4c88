//! Virtual SIXpack 2 on a line, in virtual time, with a world of their own: switches, mechanical stops and motors that lose steps.
//!
//! What its pages leave open is taken as the worse for a host: nothing but the loop bounds how speed changes on the way to a target;
//! a motor that searches obeys nothing but the end of the search; a search that does not find its switch begins again.

mod motor;
mod search;
mod shaft;
#[cfg(test)]
mod tests;
mod unit;

#[cfg(test)]
pub(crate) use motor::MotorWritten;
pub(crate) use motor::SixpackMotor;
pub(crate) use shaft::ShaftSetup;
pub(crate) use unit::{MOTORS, SixpackFault, SixpackSetup, SixpackUnit};

use super::serial::Bus;
use crate::time::MonoTime;

/// The units on one line.
#[derive(Debug, Clone)]
pub(crate) struct SixpackBus {
    units: Vec<SixpackUnit>,
}

impl SixpackBus {
    /// Units that wake now.
    pub(crate) fn waking(setups: impl IntoIterator<Item = SixpackSetup>, now: MonoTime) -> Self {
        Self { units: setups.into_iter().map(|setup| SixpackUnit::waking(setup, now)).collect() }
    }

    /// Something happens to one of them, or to all.
    pub(crate) fn suffer(&mut self, number: Option<u8>, fault: SixpackFault, now: MonoTime) {
        let is_meant = |unit: &&mut SixpackUnit| number.is_none_or(|number| number == unit.number());
        self.units.iter_mut().filter(is_meant).for_each(|unit| unit.suffer(fault, now));
    }

    /// What its axes execute is judged from here on, as after homing.
    #[cfg_attr(not(test), expect(dead_code, reason = "asked by tests of hosts"))]
    pub(crate) fn forget(&mut self) {
        let motors = self.units.iter_mut().flat_map(|unit| &mut unit.motors);
        motors.for_each(|motor| motor.shaft.forget());
    }

    /// All of them.
    pub(crate) fn units(&self) -> &[SixpackUnit] {
        &self.units
    }
}

impl Bus for SixpackBus {
    fn on_octet(&mut self, octet: u8, now: MonoTime) {
        self.advance(now);
        self.units.iter_mut().for_each(|unit| unit.on_octet(octet, now));
    }

    fn on_break(&mut self, now: MonoTime) {
        self.advance(now);
        self.units.iter_mut().for_each(SixpackUnit::on_break);
    }

    fn advance(&mut self, now: MonoTime) {
        self.units.iter_mut().for_each(|unit| unit.advance(now));
    }

    fn take_octet(&mut self, now: MonoTime) -> Option<u8> {
        self.units.iter_mut().find_map(|unit| unit.take_octet(now))
    }

    fn next(&self) -> Option<MonoTime> {
        self.units.iter().filter_map(SixpackUnit::next).min()
    }

    /// That of the slowest that is alive: where each is switched alone, a line is switched with the last.
    fn baud(&self) -> u32 {
        let slowest = self.units.iter().min_by_key(|unit| (unit.is_dead(), unit.baud()));
        slowest.map_or(1, SixpackUnit::baud)
    }
}
