//! The parameters of a virtual controller (PA00 to PAFF) and how fast they let it move.

use std::net::SocketAddrV4;
use std::time::Duration;

use super::Setup;
use super::player::Pace;
use crate::motion::MAX_AXES;
use crate::wire::Code;

/// Registers of a whole table.
pub(super) const TABLE: usize = 256;

/// Numbers of the parameters that a virtual controller heeds (SMC manual 2.3.1).
pub mod pa {
    /// Working axes, 1 to 12.
    pub const AXES: u8 = 0x02;
    /// 1: speed up when more than two commands wait.
    pub const FAST_FORWARD: u8 = 0x06;
    /// Greatest speed, rpm.
    pub const MAX_RPM: u8 = 0x07;
    /// Writing 1 resets; reads 0 when done.
    pub const RESET: u8 = 0x08;
    /// Time of commands without one, ms.
    pub const INTERVAL: u8 = 0x09;
    /// Longest time of a command, ms; 0 for none.
    pub const MAX_TIME: u8 = 0x0b;
    /// What a reset does: 0 home, 1 go to zero.
    pub const RESET_WAY: u8 = 0x0e;
    /// Writing 1 takes back the defaults, 2 keeps what is set over a power cycle.
    pub const KEEP: u8 = 0x0f;
    /// The first of four registers with the controller's address.
    pub const ADDRESS: u8 = 0x10;
    /// The third octet of the address: the station's column.
    pub const COLUMN: u8 = 0x12;
    /// The fourth octet of the address: the station's row.
    pub const ROW: u8 = 0x13;
    /// The controller's port.
    pub const PORT: u8 = 0x14;
    /// 0: no answers.
    pub const ANSWERS: u8 = 0x15;
    /// The port that frames must come from; 0 takes any.
    pub const HOST_PORT: u8 = 0x24;
    /// Silence after a start, ms.
    pub const START_DELAY: u8 = 0x3d;
    /// Amplitude: 0 all of it, 1 to 9 tenths.
    pub const AMPLITUDE: u8 = 0x55;
    /// The first of six registers with the greatest speed of an axis, rpm; 0 for none.
    pub const AXIS_RPM: u8 = 0x80;
    /// Bit 0: emergency stop by input.
    pub const INPUT_FUNCTIONS: u8 = 0x90;
    /// What an emergency stop does: 0 hold and go on, 1 go to zero and go on, 2 hold until a reset.
    pub const ESTOP_WAY: u8 = 0x91;
    /// Inputs that must all be active for an emergency stop.
    pub const ESTOP_INPUTS: u8 = 0x92;
    /// How long inputs must be active, ms.
    pub const INPUT_FILTER: u8 = 0x93;
    /// Axis offset: the first axis takes this axis + 1 of a command.
    pub const OFFSET: u8 = 0x95;
    /// 1: outputs of motion frames are ignored.
    pub const KEEP_OUTPUTS: u8 = 0x9d;
    /// Outputs after a start.
    pub const START_OUTPUTS: u8 = 0x9f;
    /// The first of six registers with the acceleration factor of an axis.
    pub const ACCELERATION_FACTOR: u8 = 0xa0;
    /// The first of six registers with the acceleration of an axis.
    pub const ACCELERATION: u8 = 0xb0;
}

/// Axes with limits of their own.
const OWN_LIMITS: usize = 6;
/// Pulses in one turn of a motor, which the parameters do not tell.
const PULSES_PER_TURN: f64 = 10_000.0;
const MS_PER_MINUTE: f64 = 60_000.0;

/// Defaults other than 0: those of the IMAX manual 2.3.1, and of the SMC manual 2.3.1 where it has its own.
const DEFAULTS: [(u8, u16); 26] = [
    (pa::AXES, 3),
    (0x04, 1),
    (pa::FAST_FORWARD, 1),
    (pa::MAX_RPM, 3_000),
    (pa::INTERVAL, 100),
    (pa::MAX_TIME, 3_000),
    (0x0c, 1),
    (0x10, 192),
    (0x11, 168),
    (0x12, 15),
    (0x13, 201),
    (pa::PORT, 7_408),
    (pa::ANSWERS, 1),
    (0x20, 192),
    (0x21, 168),
    (0x22, 15),
    (0x23, 101),
    (pa::HOST_PORT, 8_410),
    (pa::START_DELAY, 1_000),
    (0x3e, 60),
    (0x3f, 100),
    (0x40, 100),
    (0x41, 50),
    (0x50, 100),
    (0x51, 4),
    (pa::INPUT_FILTER, 200),
];

/// The parameters, and what of them a power cycle leaves.
#[derive(Debug, Clone)]
pub(super) struct Registers {
    now: [u16; TABLE],
    kept: [u16; TABLE],
    factory: [u16; TABLE],
}

impl Registers {
    /// Defaults, then the address it listens on, then what the setup says.
    pub(super) fn new(setup: &Setup, address: SocketAddrV4) -> Self {
        let mut now = [0; TABLE];
        for (register, value) in DEFAULTS {
            now[usize::from(register)] = value;
        }
        for axis in 0..6 {
            now[usize::from(pa::ACCELERATION_FACTOR) + axis] = 2;
            now[usize::from(pa::ACCELERATION) + axis] = 1_500;
            now[0x30 + axis] = 47;
        }
        for (octet, value) in address.ip().octets().into_iter().enumerate() {
            now[usize::from(pa::ADDRESS) + octet] = u16::from(value);
        }
        now[usize::from(pa::PORT)] = address.port();
        now[usize::from(pa::HOST_PORT)] = setup.host_port;
        now[usize::from(pa::AXES)] = setup.axes;
        for &(register, value) in &setup.parameters {
            now[usize::from(register)] = value;
        }
        Self { now, kept: now, factory: now }
    }

    /// The value of a parameter.
    pub(super) const fn get(&self, register: u8) -> u16 {
        self.now[register as usize]
    }

    /// The values of all parameters.
    pub(super) const fn all(&self) -> &[u16; TABLE] {
        &self.now
    }

    /// Sets a parameter, and does what setting PA0F does.
    pub(super) fn set(&mut self, register: u8, value: u16) {
        match (register, value) {
            (pa::KEEP, 1) => self.now = self.factory,
            (pa::KEEP, 2) => self.kept = self.now,
            (pa::KEEP | pa::RESET, _) => {}
            _ => self.now[usize::from(register)] = value,
        }
    }

    /// Forgets what was not kept, as a power cycle does.
    pub(super) const fn restart(&mut self) {
        self.now = self.kept;
    }

    /// Working axes, 1 to 12 whatever PA02 says.
    pub(super) fn axes(&self) -> usize {
        usize::from(self.get(pa::AXES)).clamp(1, MAX_AXES)
    }

    /// The station's own code (PA12, PA13).
    #[expect(
        clippy::cast_possible_truncation,
        reason = "an octet each; the upper half of the register means nothing"
    )]
    pub(super) const fn station(&self) -> Code {
        let (column, row) = (self.get(pa::COLUMN) as u8, self.get(pa::ROW) as u8);
        Code::station([0, 0, column, row])
    }

    /// A parameter in milliseconds.
    pub(super) fn millis(&self, register: u8) -> Duration {
        Duration::from_millis(u64::from(self.get(register)))
    }

    /// How moves run with these parameters.
    pub(super) fn pace(&self) -> Pace {
        Pace {
            fast_forward: self.get(pa::FAST_FORWARD) == 1,
            limits: std::array::from_fn(|axis| self.max_rpm(axis) * PULSES_PER_TURN / MS_PER_MINUTE),
        }
    }

    /// Greatest speed of an axis: the lowest of PA07, PA80.. and PAA0.. x PAB0..; those of 0 set none.
    fn max_rpm(&self, axis: usize) -> f64 {
        let mut lowest = f64::INFINITY;
        let mut limit = |rpm: u32| {
            if rpm != 0 {
                lowest = lowest.min(f64::from(rpm));
            }
        };
        limit(u32::from(self.get(pa::MAX_RPM)));
        if axis < OWN_LIMITS {
            let own = |first: u8| u32::from(self.now[usize::from(first) + axis]);
            limit(own(pa::AXIS_RPM));
            limit(own(pa::ACCELERATION_FACTOR) * own(pa::ACCELERATION));
        }
        lowest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn registers(parameters: &[(u8, u16)]) -> Registers {
        let setup = Setup { axes: 6, parameters: parameters.to_vec(), ..Setup::default() };
        Registers::new(&setup, "127.0.0.1:7500".parse().unwrap())
    }

    #[test]
    fn the_address_parameters_follow_the_address_it_listens_on() {
        let registers = registers(&[]);
        assert_eq!(registers.all()[0x10..=0x14], [127, 0, 0, 1, 7500]);
        assert_eq!(registers.station(), Code(0x0001));
        assert_eq!(registers.axes(), 6);
    }

    #[test]
    fn the_lowest_speed_limit_wins_and_zero_is_none() {
        let limits = |parameters: &[(u8, u16)]| registers(parameters).pace().limits;
        assert_eq!(limits(&[])[0], 500.0);
        assert_eq!(limits(&[(0x81, 600)])[..2], [500.0, 100.0]);
        assert_eq!(limits(&[(0xb0, 300)])[0], 100.0);
        assert_eq!(limits(&[(0x07, 0)])[11], f64::INFINITY);
    }

    #[test]
    fn only_what_was_kept_outlasts_a_power_cycle() {
        let mut registers = registers(&[]);
        registers.set(0x55, 5);
        registers.set(pa::KEEP, 2);
        registers.set(0x55, 7);
        registers.restart();
        assert_eq!(registers.get(0x55), 5);
        registers.set(pa::KEEP, 1);
        assert_eq!(registers.get(0x55), 0);
    }
}
