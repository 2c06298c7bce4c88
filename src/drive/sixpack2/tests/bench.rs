//! A line with virtual units, and a seat on them.

use std::time::Duration;

use super::super::*;
use crate::config::drive::SeatDrive;
use crate::config::drive::homing::{DriveHoming, HomeWay, Side};
use crate::config::drive::sixpack2::{MotorCurrent, PropDiv, Sixpack2Drive};
use crate::drive::link::{LinkTalk as _, Step, TalkTerms};
use crate::motion::{AxisGeometry, MAX_AXES, SeatType};
use crate::sim::serial::{LineFaults, SerialLine};
use crate::sim::sixpack2::{
    MOTORS, MotorWritten, ShaftSetup, SixpackBus, SixpackFault, SixpackMotor, SixpackSetup, SixpackUnit,
};
use crate::time::MonoTime;

pub(super) const BAUD: u32 = 56_818;
/// Microsteps of a millimetre.
pub(super) const MM: f64 = 640.0;
/// Of three axes at that rate.
pub(super) const PERIOD: Duration = Duration::from_micros(9_505);

/// The host's end of a virtual line of units.
pub(super) type VirtualPort = crate::drive::link::VirtualPort<SixpackBus>;

/// What hangs on each motor: 165 mm, a switch 2 mm below the places of the seat.
pub(super) fn shaft() -> ShaftSetup {
    ShaftSetup { switch: Some(-2.0 * MM), ..ShaftSetup::default() }
}

pub(super) fn unit_with(unit: u8, shaft: ShaftSetup) -> SixpackSetup {
    SixpackSetup {
        unit,
        serial: 1_000 + u16::from(unit),
        shafts: [shaft; MOTORS],
        is_two_wires: false,
        can_baud: None,
    }
}

/// Units that wake, on a line without faults; the host's end is at the rate of the link.
pub(super) fn talk_to(setups: &[SixpackSetup]) -> Talk<VirtualPort> {
    talk_at(setups, BAUD)
}

pub(super) fn talk_at(setups: &[SixpackSetup], baud: u32) -> Talk<VirtualPort> {
    let now = MonoTime::from_nanos(3_000_000_000);
    let bus = SixpackBus::waking(setups.iter().copied(), now);
    let is_bus = setups.iter().any(|setup| setup.can_baud.is_some());
    // Octets of fifteen bits take as long as the frames of a bus.
    let octet_bits = if is_bus { 15 } else { 10 };
    let mut line = SerialLine::new(bus, octet_bits, LineFaults::default(), 7);
    line.set_host_baud(Some(baud));
    let is_two_wires = setups.iter().any(|setup| setup.is_two_wires);
    let terms = TalkTerms { baud, octet_bits, has_echo: false, is_two_wires, is_bus };
    Talk::new(VirtualPort::new(line, now), terms)
}

/// A seat type of three axes as the motors of the bench have it.
pub(super) fn seat() -> SeatType {
    SeatType::bench3(3).with_each(|axis| {
        *axis = AxisGeometry { pulses_per_rev: 3_200.0, ..AxisGeometry::BENCH };
    })
}

/// A seat on motors of unit 1.
pub(super) fn on_motors<'a>(
    seat: &'a SeatType,
    drive: &'a SeatDrive,
    motors: &'a [u8],
    period: Duration,
) -> SeatMotors<'a> {
    SeatMotors {
        name: "A1",
        twins: &[],
        seat,
        drive,
        sixpack2: drive.sixpack2.as_ref().unwrap(),
        unit: 1,
        motors,
        period,
    }
}

/// What the counters of its motors read at the lower end of the stroke.
pub(super) fn at_low(drive: &SeatDrive, motors: &[u8], period: Duration) -> Vec<i32> {
    on_motors(&SeatType { axes: motors.len(), ..seat() }, drive, motors, period).at_low()
}

pub(super) const SWITCH: HomeWay = HomeWay::Switch { input: None, active_high: true };

pub(super) fn drive(way: HomeWay) -> SeatDrive {
    let homing = DriveHoming {
        way,
        toward: Side::Down,
        speed_mm_s: 20.0,
        travel_mm: 165.0,
        zero_mm: -2.0,
        torque: Some(0.4),
        together: false,
    };
    SeatDrive {
        reverse: [false; MAX_AXES],
        homing,
        margin_mm: 1.0,
        max_deviation_mm: 0.5,
        vibration: 1.0,
        silvermax: None,
        sixpack2: Some(Sixpack2Drive {
            clock_divider: 3,
            propdiv: PropDiv::Auto,
            jump_mm_s: None,
            current: MotorCurrent { peak: 238, stand: 50, run: 75, ramp: 100 },
        }),
    }
}

/// Homes a seat on the first motors of unit 1; with what was told.
pub(super) fn home_as(
    talk: &mut Talk<VirtualPort>,
    drive: &SeatDrive,
    motors: &[u8],
) -> (Result<(), HomeError>, Vec<Step>) {
    home_on(talk, drive, 1, motors)
}

/// Homes a seat on motors of a unit; with what was told.
pub(super) fn home_on(
    talk: &mut Talk<VirtualPort>,
    drive: &SeatDrive,
    unit: u8,
    motors: &[u8],
) -> (Result<(), HomeError>, Vec<Step>) {
    let mut steps = Vec::new();
    let seat = SeatType { axes: motors.len(), ..seat() };
    let of = SeatMotors { unit, ..on_motors(&seat, drive, motors, PERIOD) };
    let mut told = |step| steps.push(step);
    let homed = home(talk, of, Homing { goes_on: &|| true, told: &mut told });
    (homed, steps)
}

pub(super) fn unit(talk: &mut Talk<VirtualPort>) -> &SixpackUnit {
    &talk.port().line.bus().units()[0]
}

pub(super) fn motor(talk: &mut Talk<VirtualPort>, motor: usize) -> &SixpackMotor {
    &unit(talk).motors[motor]
}

/// True if a motor brakes and runs as a show needs it.
pub(super) fn is_set_up_for_shows(motor: &SixpackMotor) -> bool {
    let MotorWritten { ramp, currents, pi, .. } = motor.written;
    (ramp.amax, ramp.vmax, pi.propdiv) == (12, 503, 25)
        && currents.is_some_and(|it| (it.run, it.ramp) == (1, 0))
}

/// Where an axis really is, mm.
pub(super) fn place(talk: &mut Talk<VirtualPort>, index: usize) -> f64 {
    motor(talk, index).shaft.place() / MM
}

pub(super) fn suffer(talk: &mut Talk<VirtualPort>, fault: SixpackFault) {
    let now = talk.now();
    talk.port().line.bus_mut().suffer(None, fault, now);
}
