//! The monitor registers of a virtual controller, DP00 to DPFF (2.3.3 of both manuals), as they stand.

use std::time::Duration;

use super::{Controller, OUTPUTS};
use crate::sim::pa;
use crate::sim::registers::{MS_PER_MINUTE, OWN_REGISTERS, TABLE};
use crate::time::MonoTime;
use crate::wire::{DP_POSITIONS, Dialect, MotionRequest, position_words};

/// Numbers of the monitor registers that are not always 0.
pub(super) mod dp {
    pub(super) const SPEEDS: usize = 0x00; // of axes 1 to 3
    pub(super) const MORE_SPEEDS: usize = 0x18; // of axes 4 to 6
    pub(super) const MORE_SPEEDS_IMAX: usize = 0x1b; // of axes 4 to 6, IMAX manual
    pub(super) const PACKET_LEN: usize = 0x33;
    pub(super) const PACKETS: usize = 0x34;
    pub(super) const PACKET_TIME: usize = 0x35;
    pub(super) const COMMAND: usize = 0x37;
    pub(super) const COMMAND_TIME: usize = 0x38;
    pub(super) const QUEUE_WRITE: usize = 0x48;
    pub(super) const QUEUE_READ: usize = 0x49;
    pub(super) const REMAINING: usize = 0x50; // of axes 1 to 6, ms
    pub(super) const INPUTS: usize = 0x5e;
    pub(super) const ACTIVE_OUTPUTS: usize = 0x66;
    pub(super) const TORQUES: usize = 0x90; // of axes 1 to 6
    pub(in super::super) const CONTROL: usize = 0xf0; // DPF0
    pub(in super::super) const RESET: usize = 0xf0;
    pub(in super::super) const OUTPUTS: usize = 0xf1;
    pub(in super::super) const REBOOT: usize = 0xf2;
    pub(super) const AXES: usize = 0xf5;
    pub(super) const PACKET_INTERVAL: usize = 0xf6;
    pub(in super::super) const MINOR_VERSION: usize = 0xfe;
    pub(super) const VERSION: usize = 0xff;
}

/// What DPF0 reads while a reset runs, and when it is done.
const RESETTING: u16 = 1;
const RESET_DONE: u16 = 2;
/// Torque at rest, and what is added at 3,000 rpm; the manuals have neither unit nor figures.
const TORQUE_AT_REST: f64 = 10.0;
const TORQUE_OF_SPEED: f64 = 20.0 / 3_000.0;

/// What a controller remembers of what came.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ReceivedSoFar {
    packets: u16,
    len: u16,
    last: Option<MonoTime>,
    interval: Duration,
    function: u16,
    time_ms: u32,
    duration: Duration,
}

impl ReceivedSoFar {
    pub(super) fn datagram(&mut self, len: usize, at: MonoTime) {
        self.packets = self.packets.wrapping_add(1);
        self.len = u16::try_from(len).unwrap_or(u16::MAX);
        self.interval = self.last.map_or(Duration::ZERO, |last| at.since(last));
        self.last = Some(at);
    }

    /// From the datagram before to this one.
    pub(super) const fn interval(&self) -> Duration {
        self.interval
    }

    pub(super) const fn command(&mut self, motion: &MotionRequest, duration: Duration) {
        self.function = motion.function();
        self.time_ms = motion.time_ms;
        self.duration = duration;
    }
}

impl Controller {
    /// All monitor registers.
    pub(super) fn monitored(&self, at: MonoTime) -> [u16; TABLE] {
        let mut table = [0; TABLE];
        self.monitor_axes(&mut table, at);
        [table[dp::QUEUE_WRITE], table[dp::QUEUE_READ]] = self.player.pointers();
        table[dp::INPUTS] = self.inputs.active();
        let inverted = self.registers.get(pa::OUTPUT_POLARITY) == 1;
        table[dp::ACTIVE_OUTPUTS] = if inverted { !self.outputs & OUTPUTS } else { self.outputs };
        table[dp::RESET] = if at < self.homing_until { RESETTING } else { RESET_DONE };
        table[dp::OUTPUTS] = self.outputs;
        table[dp::VERSION] = self.invented.version[0];
        match self.dialect {
            Dialect::Smc => {
                table[dp::PACKET_LEN] = self.seen.len;
                table[dp::PACKETS] = self.seen.packets;
                table[dp::PACKET_TIME] = low_word(self.seen.time_ms);
                table[dp::COMMAND] = self.seen.function;
                table[dp::COMMAND_TIME] = millis(self.seen.duration);
                table[dp::MINOR_VERSION] = self.invented.version[1];
            }
            Dialect::Mbox => {
                table[dp::AXES] = self.registers.get(pa::AXES);
                table[dp::PACKET_INTERVAL] = millis(self.seen.interval);
                table[dp::MINOR_VERSION] = self.servo_alarm_kind();
            }
        }
        table
    }

    /// The kind of alarm of the drives (DPFE by the IMAX manual): the number of the error that stands.
    pub(super) fn servo_alarm_kind(&self) -> u16 {
        self.errors.shown()
    }

    fn monitor_axes(&self, table: &mut [u16; TABLE], at: MonoTime) {
        let positions = self.player.positions(at);
        let axes = self.registers.axes();
        for (axis, register) in DP_POSITIONS.into_iter().enumerate().take(axes) {
            let [first, second] = position_words(positions[axis], self.dialect);
            table[usize::from(register)] = first;
            table[usize::from(register) + 1] = second;
            let more = match self.dialect {
                Dialect::Smc => dp::MORE_SPEEDS,
                Dialect::Mbox => dp::MORE_SPEEDS_IMAX,
            };
            let speed = if axis < 3 { dp::SPEEDS + axis } else { more + axis - 3 };
            table[speed] = self.rpm(axis).cast_unsigned();
        }
        if self.dialect == Dialect::Smc {
            let remaining = millis(self.player.end().since(at));
            for axis in 0..axes.min(OWN_REGISTERS) {
                table[dp::REMAINING + axis] = remaining;
                table[dp::TORQUES + axis] = self.torque(axis).cast_unsigned();
            }
        }
    }

    /// Speed of an axis, rpm; below 0 towards its lower end.
    #[expect(clippy::cast_possible_truncation, reason = "a saturating cast is what is wanted")]
    fn rpm(&self, axis: usize) -> i16 {
        let turns = self.player.speeds()[axis] / f64::from(self.invented.pulses_per_turn.max(1));
        (turns * MS_PER_MINUTE).round() as i16
    }

    /// Torque of an axis; `None` if its drive cannot be spoken to or has an alarm.
    #[expect(clippy::cast_possible_truncation, reason = "a saturating cast is what is wanted")]
    pub(super) fn torque(&self, axis: usize) -> i16 {
        if self.errors.unreachable(axis) || self.errors.alarm(axis) {
            return 0;
        }
        (TORQUE_AT_REST + f64::from(self.rpm(axis)).abs() * TORQUE_OF_SPEED).round() as i16
    }
}

fn millis(span: Duration) -> u16 {
    u16::try_from(span.as_millis()).unwrap_or(u16::MAX)
}

#[expect(clippy::cast_possible_truncation, reason = "the lower half is what there is room for")]
const fn low_word(number: u32) -> u16 {
    number as u16
}
