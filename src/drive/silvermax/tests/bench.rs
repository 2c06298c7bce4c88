//! A line with virtual units, a seat on them, and whoever plays to it.

use std::time::Duration;

use super::super::*;
use crate::config::drive::homing::{DriveHoming, HomeWay, Side};
use crate::config::drive::{SeatDrive, SilverMaxDrive, Torque};
use crate::drive::link::*;
use crate::motion::{AxisGeometry, MAX_AXES, SeatType};
use crate::sim::serial::{LineFaults, SerialLine};
use crate::sim::silvermax::{SilverBus, Unit, UnitSetup};
use crate::time::MonoTime;

pub(super) const CANARY: i32 = 20_251_123;
pub(super) const BAUD: u32 = 57_600;
/// Counts of a millimetre, and of 0 mm above the lower stop.
pub(super) const MM: f64 = 800.0;
pub(super) const ZERO: f64 = 3_200.0;

/// The host's end of a virtual line of units.
pub(super) type VirtualPort = crate::drive::link::VirtualPort<SilverBus>;

/// Units 16 and up as they are set up, on a line without faults.
pub(super) fn talk_to(setups: &[UnitSetup]) -> Talk<VirtualPort> {
    let now = MonoTime::from_nanos(3_000_000_000);
    let bus = SilverBus::new(setups, BAUD, now);
    let line = SerialLine::new(bus, 11, LineFaults::default(), 7);
    Talk::new(
        VirtualPort::new(line, now),
        TalkTerms { baud: BAUD, octet_bits: 11, has_echo: false, is_two_wires: false, is_bus: false },
    )
}

/// A seat type of three axes as the drives of the bench have it.
pub(super) fn seat() -> SeatType {
    SeatType::bench3(3).with_each(|axis| {
        *axis = AxisGeometry { pulses_per_rev: 4_000.0, ..AxisGeometry::BENCH };
    })
}

pub(super) fn drive(way: HomeWay) -> SeatDrive {
    let homing = DriveHoming {
        way,
        toward: Side::Down,
        speed_mm_s: 10.0,
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
        silvermax: Some(SilverMaxDrive {
            torque: Torque { hold: 0.6, moving: 1.0, full: 20_000 },
            gravity: 0,
            max_error_mm: 3.0,
            hold_error_mm: 1.0,
            settle_ms: 120,
        }),
        sixpack2: None,
    }
}

pub(super) const SWITCH: HomeWay = HomeWay::Switch { input: Some(1), active_high: true };

/// Homes units 16, 17, 18; with what was told.
pub(super) fn home_as(
    talk: &mut Talk<VirtualPort>,
    drive: &SeatDrive,
    units: &[u8],
) -> (Result<(), HomeError>, Vec<Step>) {
    let mut steps = Vec::new();
    let seat = SeatType { axes: units.len(), ..seat() };
    let silvermax = drive.silvermax.clone().unwrap();
    let of = SeatUnits { name: "A1", twins: &[], seat: &seat, drive, silvermax: &silvermax, units };
    let mut told = |step| steps.push(step);
    let around = Homing { canary: CANARY, goes_on: &|| true, told: &mut told };
    (home(talk, of, around).map(drop), steps)
}

pub(super) fn unit(talk: &mut Talk<VirtualPort>, index: usize) -> &Unit {
    &talk.port().line.bus().units()[index]
}

/// A play to a seat that is home.
pub(super) type Play = VirtualPlay<SilverMax, SilverBus>;

pub(super) const PERIOD: Duration = Duration::from_micros(33_352);

impl Play {
    /// Units whose crystals are off by so much.
    pub(super) fn with_ppm(ppm: [i32; 3]) -> Self {
        Self::with_damage(ppm, None)
    }

    /// The same; what is asked first of units that are home may be damaged.
    pub(super) fn with_damage(ppm: [i32; 3], damage: Option<Damage>) -> Self {
        let mut unit = 15;
        let setups = ppm.map(|ppm| {
            unit += 1;
            UnitSetup { ppm, place: 12_000, ..UnitSetup::new(unit) }
        });
        let mut talk = talk_to(&setups);
        let drive = drive(SWITCH);
        let (homed, _) = home_as(&mut talk, &drive, &[16, 17, 18]);
        assert_eq!(homed, Ok(()));
        talk.port().line.bus_mut().units_mut().iter_mut().for_each(Unit::forget_executed);
        talk.port().damage = damage;
        let (seat, silvermax) = (seat(), drive.silvermax.clone().unwrap());
        let seat = SeatUnits {
            name: "A1",
            twins: &[],
            seat: &seat,
            drive: &drive,
            silvermax: &silvermax,
            units: &[16, 17, 18],
        };
        let mut play = Self::over(talk, PERIOD, &[seat], Self::judge).unwrap();
        play.wait(1.0);
        assert!(play.all_ready());
        play
    }

    pub(super) fn unit(&mut self, index: usize) -> &Unit {
        unit(&mut self.stream.talk, index)
    }

    /// How far the axes are beside where they should be by now.
    fn judge(&mut self, at: f64) {
        for index in 0..3 {
            let wanted = (self.course)(at, index);
            let off = (self.place(index) - wanted).abs();
            self.worst[index] = self.worst[index].max(off);
        }
    }

    /// Where an axis is, mm.
    pub(super) fn place(&mut self, index: usize) -> f64 {
        (self.unit(index).place() - ZERO) / MM
    }

    pub(super) fn figures(&self) -> [AxisFigures; 3] {
        [0, 1, 2].map(|axis| self.stream.axis(0, axis).unwrap())
    }

    /// That it stands there, mm; by the edge that homing found to a count.
    pub(super) fn assert_at(&mut self, places: [f64; 3]) {
        for (index, wanted) in places.into_iter().enumerate() {
            assert!((self.place(index) - wanted).abs() < 2.0 / MM, "{index}: {} {wanted}", self.place(index));
        }
    }

    /// That no axis left its stroke, and none moved harder than a seat may.
    pub(super) fn assert_gentle(&mut self) {
        for index in 0..3 {
            let executed = self.unit(index).executed().clone();
            let (low, high) = ((executed.lowest - ZERO) / MM, (executed.highest - ZERO) / MM);
            let (speed, acceleration) = (executed.velocity / MM, executed.acceleration / MM);
            assert!((-0.01..=150.01).contains(&low) && high <= 150.01, "{index}: {low} {high}");
            assert!(speed <= 240.5 && acceleration <= 3_060.0, "{index}: {speed} {acceleration}");
            assert_eq!((executed.jumps, self.unit(index).tally().forbidden), (0, 0), "{index}");
        }
    }
}

/// Swings of up to some 190 mm/s and 1,900 mm/s² that begin gently, in mm.
pub(super) fn ride(at: f64, axis: usize) -> f64 {
    ride_about(60.0, at, axis)
}
