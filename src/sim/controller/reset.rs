//! Resets: homing, the automatic reset, and starting again.

use std::time::Duration;

use super::monitor::ReceivedSoFar;
use super::{Controller, NEVER, OUTPUTS};
use crate::sim::pa;
use crate::time::MonoTime;

impl Controller {
    /// Resets: errors are cleared that a reset clears, then it homes.
    pub(super) fn reset(&mut self, at: MonoTime) {
        self.reset_in(self.invented.homing, at);
    }

    /// Resets by DPF0, which alone goes to zero without homing where PA0E says so.
    pub(super) fn reset_by_dpf0(&mut self, at: MonoTime) {
        let homes = self.registers.get(pa::RESET_WAY) != 1;
        self.reset_in(if homes { self.invented.homing } else { Duration::ZERO }, at);
    }

    fn reset_in(&mut self, duration: Duration, at: MonoTime) {
        self.errors.reset();
        self.estop.unlatch();
        self.run_functions(at);
        self.go_home(duration, at, at);
    }

    /// Moves to zero from `start` on. With an error that stays, it gets nowhere, and is never done. The rotary axis is
    /// in zero already (PA03), but for a reset that only goes there.
    fn go_home(&mut self, duration: Duration, start: MonoTime, at: MonoTime) {
        self.jog = None;
        self.released = None;
        self.last_absolute = None;
        self.auto_reset_at = NEVER;
        let pace = *self.pace();
        self.player.hold(at, &pace);
        if self.errors.stop_play() {
            self.homing_until = NEVER;
            return;
        }
        let rotary = usize::from(self.registers.get(pa::ROTARY_AXIS));
        if !duration.is_zero() && (1..=self.registers.axes()).contains(&rotary) {
            self.player.zero(rotary - 1);
        }
        self.player.go_to_zero(duration, start, at, &pace);
        self.homing_until = self.player.end();
    }

    /// Starts again, as after a power cycle: silent for PA3D and while it homes.
    pub(super) fn reboot(&mut self, at: MonoTime) {
        self.registers.restart();
        self.errors.restart();
        self.estop.restart();
        self.seen = ReceivedSoFar::default();
        self.player.restart();
        self.outputs = self.registers.get(pa::START_OUTPUTS) & OUTPUTS;
        self.extend = 0;
        let start = at + self.registers.millis(pa::START_DELAY);
        self.go_home(self.invented.homing, start, at);
        self.silent_until =
            if self.homing_until == NEVER { start + self.invented.homing } else { self.homing_until };
        self.inputs.polarity(self.registers.get(pa::INPUT_POLARITY) == 1, at);
        self.run_functions(at);
        self.schedule_reports(self.silent_until);
        if !self.errors.is_empty() {
            self.report_fault(self.silent_until);
        }
    }

    /// Homing that is cut short is only done by another reset. Says whether it was.
    pub(super) fn spoil_homing(&mut self, at: MonoTime) -> bool {
        let spoilt = at < self.homing_until;
        if spoilt {
            self.homing_until = NEVER;
        }
        spoilt
    }

    /// Starts the time anew after which it resets by itself (PA0D).
    pub(super) fn put_off_auto_reset(&mut self, at: MonoTime) {
        self.auto_reset_at = match self.registers.get(pa::AUTO_RESET) {
            0 => NEVER,
            units => at + self.invented.auto_reset_unit.saturating_mul(u32::from(units)),
        };
        self.next_event = self.next_event.min(self.auto_reset_at);
    }

    /// The commands have stopped. An emergency stop waits for a person's reset, not for this one.
    pub(super) fn auto_reset(&mut self, at: MonoTime) {
        if !self.estop.in_effect() && at >= self.homing_until {
            self.reset(at);
        }
    }
}
