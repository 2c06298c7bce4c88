//! The axis that a unit moves: where it stands, what holds it, and what its inputs see.

use super::{Executed, UnitSetup};

/// Inputs of a unit.
const INPUTS: std::ops::RangeInclusive<u8> = 1..=7;

/// An axis between two stops; places are twice the generator's units from the lower one.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    place: i64,
    top: i64,
    shift: u32,
    setup: UnitSetup,
    /// Bit `n - 1` for input `n` that somebody holds high; all are, where nothing is connected.
    levels: u8,
    /// Nothing moves it.
    pub(super) is_blocked: bool,
    /// How far something pushes it off where its motor holds it by now, and how far it will.
    pushed: [i64; 2],
    pub(super) executed: Executed,
}

impl Axis {
    pub(super) fn new(setup: UnitSetup) -> Self {
        let shift = setup.bits + 1;
        let place = i64::from(setup.place) << shift;
        let top = i64::from(setup.top) << shift;
        let executed = Executed::at(f64::from(setup.place));
        Self { place, top, shift, setup, levels: 0x7f, is_blocked: false, pushed: [0; 2], executed }
    }

    pub(super) const fn place(&self) -> i64 {
        self.place
    }

    /// Something pushes it so many counts off from now on.
    pub(super) fn push(&mut self, counts: i32) {
        self.pushed[1] = i64::from(counts) << self.shift;
    }

    /// True if it gives way to that still.
    pub(super) const fn gives_way(&self) -> bool {
        self.pushed[0] != self.pushed[1]
    }

    /// The motor pulls it to a place, as far as stops, and what pushes or blocks it, let it; it gives way by a count a tick, 10 mm/s.
    pub(super) fn pull(&mut self, wanted: i64, tick: u64) {
        let ([now, then], count) = (self.pushed, 1 << self.shift);
        self.pushed[0] = now + (then - now).clamp(-count, count);
        if !self.is_blocked {
            self.place = (wanted + self.pushed[0]).clamp(0, self.top);
        }
        self.executed.see(tick, self.counts());
    }

    /// The same at once, however far it is.
    pub(super) fn jump(&mut self, wanted: i64) {
        let from = self.counts();
        if !self.is_blocked {
            self.place = wanted.clamp(0, self.top);
        }
        self.executed.jump(from, self.counts());
    }

    /// Sets the level of an input that is no switch.
    pub(super) fn set_input(&mut self, input: u8, is_high: bool) {
        if INPUTS.contains(&input) {
            let bit = 1 << (input - 1);
            self.levels = if is_high { self.levels | bit } else { self.levels & !bit };
        }
    }

    pub(super) fn is_high(&self, input: u8) -> bool {
        match self.setup.switch {
            Some(switch) if switch.input == input => {
                let is_on = self.place <= i64::from(switch.place) << self.shift;
                is_on == switch.is_high
            }
            _ => INPUTS.contains(&input) && self.levels & 1 << (input - 1) != 0,
        }
    }

    /// Where it stands, counts from the lower stop.
    #[expect(clippy::cast_precision_loss, reason = "some hundred thousand counts in millionths")]
    pub(super) fn counts(&self) -> f64 {
        self.place as f64 / f64::from(1_u32 << (self.shift - 1)) / 2.0
    }
}
