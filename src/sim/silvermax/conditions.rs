//! What a unit senses, tells and is killed by.

use super::mover::{MoverMode, StopWords};
use super::unit::Unit;
use crate::wire::silvermax::{Internal, Io, Poll, StatusWord as _};

impl Unit {
    /// True if what ends a move is there. Negative codes are inputs and conditions, others masks of the word of RIO.
    pub(super) fn senses(&self, stop: StopWords) -> bool {
        let io = self.io();
        let has = |bit: u16| (io & bit != 0) == (stop.state != 0);
        match stop.enable {
            0 => false,
            -7..=-1 => has(Io::input_bit(u8::try_from(-stop.enable).unwrap_or(0))),
            -10..=-8 => self.counts(self.actual()).rem_euclid(self.counts_per_turn()) == 0,
            -11 => has(Io::MOVING_ERROR),
            -12 => has(Io::HOLDING_ERROR),
            -13 => has(Io::MOVING),
            -14 => has(Io::DELAYING),
            mask => u16::try_from(mask & !(i64::from(io) ^ stop.state)).unwrap_or(0) != 0,
        }
    }

    const fn counts_per_turn(&self) -> i32 {
        4_000 << (26 - self.setup.bits)
    }

    /// Notes the errors of this tick.
    pub(super) fn mind_errors(&mut self) {
        let error = (self.target - self.actual()).abs() >> (self.setup.bits + 1);
        self.status.max_error = self.status.max_error.max(error);
        let bits = self.error_bits();
        self.status.latched |= bits;
        self.status.news |= bits; // both words have both at the same bits
    }

    /// The moving and the holding error, as they are.
    fn error_bits(&self) -> u16 {
        let error = (self.target - self.actual()).abs() >> (self.setup.bits + 1);
        let [moving, holding, _] = self.settings.errors.map(i64::from);
        let is_holding = self.mode == MoverMode::Hold && self.status.settling == 0;
        let is_past = |limit: i64| self.settings.is_driving && limit > 0 && error > limit;
        let moving = if is_past(moving) { Internal::MOVING_ERROR } else { 0 };
        moving | if is_holding && is_past(holding) { Internal::HOLDING_ERROR } else { 0 }
    }

    /// KMC, page 57: the first condition that is met drops the driver.
    pub(super) fn mind_kill(&mut self) {
        let [enable, state] = self.settings.kill;
        let found = self.internal();
        let cause = enable & !(found ^ state);
        if cause == 0 || !self.settings.is_driving {
            return;
        }
        self.tally.kills += 1;
        self.settings.is_driving = false;
        self.status.latched |= Internal::HALTED;
        self.status.news |= Poll::KILLED;
        self.status.kill_cause = u32::from(cause) << 16 | u32::from(found & cause);
        self.halt();
    }

    /// The internal status word (RIS).
    pub(super) fn internal(&self) -> u16 {
        const INPUTS: u16 = 0x70;
        self.status.latched | self.io() & (INPUTS | Io::COOL) | self.error_bits()
    }

    /// The word of RIO.
    pub(super) fn io(&self) -> u16 {
        let inputs = (1..=7).filter(|input| self.axis.is_high(*input)).map(Io::input_bit).sum::<u16>();
        let cool = if self.world.is_hot { 0 } else { Io::COOL };
        let moving = if self.is_moving() { Io::MOVING } else { 0 };
        inputs | cool | moving | self.error_bits()
    }
}
