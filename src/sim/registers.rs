//! The parameters of a virtual controller (PA00 to PAFF) and how fast they let it move.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use super::player::Pace;
use super::{Setup, pa};
use crate::device::{Address, table};
use crate::motion::MAX_AXES;
use crate::wire::{Code, Dialect};

/// Registers of a whole table.
pub(super) const TABLE: usize = 256;
/// Axes with registers of their own.
pub(super) const OWN_REGISTERS: usize = 6;
/// Milliseconds in a minute.
pub(super) const MS_PER_MINUTE: f64 = 60_000.0;
/// The interval of commands without a time where PA09 is 0, ms.
const INTERVAL_MS: u16 = 100;

/// True if a controller of `dialect` has this register and takes this value.
pub(super) fn takes(register: Address, value: u16, dialect: Dialect) -> bool {
    let register = table().get(register).filter(|register| register.dialect.has(dialect));
    register.is_some_and(|register| register.range().contains(&value))
}

/// True if a controller of `dialect` has this register.
pub(super) fn has(register: Address, dialect: Dialect) -> bool {
    table().get(register).is_some_and(|register| register.dialect.has(dialect))
}

/// The parameters, and what of them a power cycle leaves.
#[derive(Debug, Clone)]
pub(super) struct Registers {
    now: [u16; TABLE],
    saved: [u16; TABLE],
    factory: [u16; TABLE],
    pulses_per_turn: f64,
    fast_forward: u32,
    /// Speed after an emergency stop where PA94 sets none.
    release_rpm: Option<u16>,
    /// How moves run with these parameters, and how after an emergency stop.
    paces: [Pace; 2],
}

impl Registers {
    /// Defaults, then the address it listens on, then what the setup says.
    pub(super) fn new(setup: &Setup, address: SocketAddrV4) -> Self {
        let mut factory = [0; TABLE];
        for register in table().of(setup.dialect) {
            if let (Address::Pa(number), Some(value)) = (register.address, register.default(setup.dialect)) {
                factory[usize::from(number)] = value;
            }
        }
        for (byte, value) in address.ip().octets().into_iter().enumerate() {
            factory[usize::from(pa::ADDRESS) + byte] = u16::from(value);
        }
        factory[usize::from(pa::PORT)] = address.port();
        let mut now = factory;
        now[usize::from(pa::HOST_PORT)] = setup.host_port;
        now[usize::from(pa::AXES)] = setup.axes;
        for &(register, value) in &setup.parameters {
            now[usize::from(register)] = value;
        }
        let still = Pace { fast_forward: None, limits: [0.0; MAX_AXES] };
        let mut registers = Self {
            now,
            saved: now,
            factory,
            pulses_per_turn: f64::from(setup.invented.pulses_per_turn),
            fast_forward: setup.invented.fast_forward,
            release_rpm: setup.invented.release_rpm,
            paces: [still; 2],
        };
        registers.measure_paces();
        registers
    }

    /// The value of a parameter.
    pub(super) const fn get(&self, register: u8) -> u16 {
        self.now[register as usize]
    }

    /// The values of all parameters.
    pub(super) const fn all(&self) -> &[u16; TABLE] {
        &self.now
    }

    /// Sets a parameter, and does what setting PA0F does: 1 takes back the defaults, all but the address, which a
    /// virtual controller cannot change; 2 keeps the others over a power cycle. `keep` does so for this one.
    pub(super) fn set(&mut self, register: u8, value: u16, keep: bool) {
        match (register, value) {
            (pa::KEEP, 1) => (self.now, self.saved) = (self.factory, self.factory),
            (pa::KEEP, 2) => self.save(),
            (pa::KEEP | pa::RESET, _) => {}
            _ => {
                self.now[usize::from(register)] = value;
                if keep && saved(register) {
                    self.saved[usize::from(register)] = value;
                }
            }
        }
        self.measure_paces();
    }

    fn save(&mut self) {
        for register in (0..=u8::MAX).filter(|&register| saved(register)) {
            self.saved[usize::from(register)] = self.get(register);
        }
    }

    /// Forgets what was not kept, as a power cycle does.
    pub(super) fn restart(&mut self) {
        self.now = self.saved;
        self.measure_paces();
    }

    /// Working axes, 1 to 12 whatever PA02 says.
    pub(super) fn axes(&self) -> usize {
        usize::from(self.get(pa::AXES)).clamp(1, MAX_AXES)
    }

    /// The station's own code (PA12, PA13).
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a byte each; the upper half of the register means nothing"
    )]
    pub(super) const fn station(&self) -> Code {
        let (column, row) = (self.get(pa::COLUMN) as u8, self.get(pa::ROW) as u8);
        Code::station([0, 0, column, row])
    }

    /// An address and its port, from five registers; none without a port.
    #[expect(clippy::cast_possible_truncation, reason = "the upper half of the registers means nothing")]
    pub(super) fn socket(&self, first: u8) -> Option<SocketAddrV4> {
        let [a, b, c, d] = std::array::from_fn(|byte| self.now[usize::from(first) + byte] as u8);
        let port = self.now[usize::from(first) + 4];
        (port != 0).then(|| SocketAddrV4::new(Ipv4Addr::new(a, b, c, d), port))
    }

    /// A parameter in milliseconds.
    pub(super) fn millis(&self, register: u8) -> Duration {
        Duration::from_millis(u64::from(self.get(register)))
    }

    /// The time of commands without one, ms.
    pub(super) fn interval_ms(&self) -> u32 {
        match self.get(pa::INTERVAL) {
            0 => u32::from(INTERVAL_MS),
            interval => u32::from(interval),
        }
    }

    /// How moves run with these parameters.
    pub(super) const fn pace(&self) -> &Pace {
        &self.paces[0]
    }

    /// How they run after the release of an emergency stop.
    pub(super) const fn release_pace(&self) -> &Pace {
        &self.paces[1]
    }

    /// A speed in pulses per millisecond.
    pub(super) fn speed(&self, rpm: u16) -> f64 {
        f64::from(rpm) * self.pulses_per_turn / MS_PER_MINUTE
    }

    fn measure_paces(&mut self) {
        let fast_forward = (self.get(pa::FAST_FORWARD) == 1).then_some(self.fast_forward);
        let limits = std::array::from_fn(|axis| self.max_rpm(axis) * self.pulses_per_turn / MS_PER_MINUTE);
        let release = match self.get(pa::RELEASE_RPM) {
            0 => self.release_rpm,
            rpm => Some(rpm),
        };
        let release = release.map_or(f64::INFINITY, |rpm| self.speed(rpm));
        let released = limits.map(|limit: f64| limit.min(release));
        self.paces = [limits, released].map(|limits| Pace { fast_forward, limits });
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
        if axis < OWN_REGISTERS {
            let own = |first: u8| u32::from(self.now[usize::from(first) + axis]);
            limit(own(pa::AXIS_RPM));
            limit(own(pa::ACCELERATION_FACTOR) * own(pa::ACCELERATION));
        }
        lowest
    }
}

/// True if a parameter is one of those that can outlast a power cycle.
fn saved(register: u8) -> bool {
    table().get(Address::Pa(register)).is_none_or(|register| register.saved)
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
        assert_eq!(registers.socket(pa::HOST), Some("192.168.15.101:8410".parse().unwrap()));
        assert_eq!(registers.socket(pa::SECOND_HOST), None);
    }

    #[test]
    fn the_defaults_are_those_of_the_dialect() {
        let of = |dialect| {
            let setup = Setup { dialect, ..Setup::default() };
            let registers = Registers::new(&setup, "127.0.0.1:7500".parse().unwrap());
            [0x02, 0x04, 0x07, 0x0b, 0x30, 0x41, 0x50, 0x93, 0xa0, 0xb5].map(|number| registers.get(number))
        };
        assert_eq!(of(Dialect::Smc), [3, 1, 3_000, 3_000, 47, 50, 0, 200, 2, 1_500]);
        assert_eq!(of(Dialect::Mbox), [3, 1, 3_000, 3_000, 47, 50, 100, 200, 0, 0]);
    }

    #[test]
    fn the_lowest_speed_limit_wins_and_zero_is_none() {
        let limits = |parameters: &[(u8, u16)]| registers(parameters).pace().limits;
        assert_eq!(limits(&[])[0], 500.0);
        assert_eq!(limits(&[(0x81, 600)])[..2], [500.0, 100.0]);
        assert_eq!(limits(&[(0xb0, 300)])[0], 100.0);
        assert_eq!(limits(&[(0x07, 0)])[11], f64::INFINITY);
        assert_eq!(registers(&[(0x94, 60)]).release_pace().limits, [10.0; MAX_AXES]);
        assert_eq!(registers(&[]).release_pace().limits[0], 500.0);
    }

    #[test]
    fn only_what_was_kept_outlasts_a_power_cycle() {
        let mut registers = registers(&[]);
        registers.set(0x55, 5, false);
        registers.set(pa::KEEP, 2, false);
        registers.set(0x55, 7, false);
        registers.set(0x06, 0, true);
        registers.restart();
        assert_eq!((registers.get(0x55), registers.get(0x06), registers.get(pa::KEEP)), (5, 0, 0));
    }

    #[test]
    fn the_factory_settings_come_back_but_for_the_address() {
        let mut registers = registers(&[(0x55, 5), (0x06, 0)]);
        registers.set(pa::KEEP, 1, false);
        registers.restart();
        assert_eq!([0x55, 0x06, 0x02, 0x24, 0x13].map(|number| registers.get(number)), [0, 1, 3, 8410, 1]);
    }
}
