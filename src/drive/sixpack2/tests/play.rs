//! Seats that are home, and a play to them.

use std::time::Duration;

use super::bench::*;
use crate::drive::link::{LinkTalk as _, VirtualPlay, ride_about};
use crate::drive::sixpack2::*;
use crate::sim::sixpack2::{SixpackBus, SixpackSetup};

pub(super) fn wired(unit: u8, is_two_wires: bool) -> SixpackSetup {
    SixpackSetup { is_two_wires, ..unit_with(unit, shaft()) }
}

/// A play to one seat on the first three motors of each unit, all led alike.
pub(super) type Play = VirtualPlay<Sixpack2, SixpackBus>;

impl Play {
    /// A play to a seat on each of so many units, home or not.
    pub(super) fn to(talk: Talk<VirtualPort>, units: u8) -> Result<Self, HomeError> {
        // Of two at 113,636 baud.
        let period = if units > 1 { Duration::from_micros(5_950) * u32::from(units) } else { PERIOD };
        let (seat, drive) = (seat(), drive(SWITCH));
        let sixpack2 = drive.sixpack2.clone().unwrap();
        let of = |unit| SeatMotors {
            name: "A1",
            twins: &[],
            seat: &seat,
            drive: &drive,
            sixpack2: &sixpack2,
            unit,
            motors: &[0, 1, 2],
            period: PERIOD,
        };
        let lanes: Vec<_> = (1..=units).map(of).collect();
        Self::over(talk, period, &lanes, Self::judge)
    }

    pub(super) fn homed(setups: &[SixpackSetup], baud: u32) -> Self {
        let mut talk = talk_at(setups, baud);
        let numbers: Vec<u8> = setups.iter().map(|setup| setup.unit).collect();
        find(&mut talk, &numbers).unwrap();
        for unit in &numbers {
            assert_eq!(home_on(&mut talk, &drive(SWITCH), *unit, &[0, 1, 2]).0, Ok(()));
        }
        talk.port().line.bus_mut().forget();
        let mut play = Self::to(talk, setups.len() as u8).unwrap();
        play.wait(setups.len() as f64);
        assert!(play.all_ready(), "{:?}", play.rare());
        play
    }

    pub(super) fn bus(&mut self) -> &SixpackBus {
        self.line().bus()
    }

    pub(super) fn bus_mut(&mut self) -> &mut SixpackBus {
        self.line().bus_mut()
    }

    /// How far the axes are beside where they should be by now.
    pub(super) fn judge(&mut self, at: f64) {
        for (index, place) in self.places().into_iter().enumerate() {
            let wanted = (self.course)(at, index % 3);
            // Where a motor is between two loops is that of the first: half a loop late.
            let later = (self.course)(at - 0.002, index % 3);
            let off = if (place - wanted) * (place - later) <= 0.0 {
                0.0
            } else {
                (place - wanted).abs().min((place - later).abs())
            };
            self.worst[index % 3] = self.worst[index % 3].max(off);
        }
    }

    /// Where the axes are, mm, seat by seat.
    pub(super) fn places(&mut self) -> Vec<f64> {
        let motors = self.bus().units().iter().flat_map(|unit| &unit.motors[..3]);
        motors.map(|motor| motor.shaft.place() / MM).collect()
    }

    /// The farthest that an axis is beside these places.
    pub(super) fn off(&mut self, places: [f64; 3]) -> f64 {
        let off =
            self.places().into_iter().enumerate().map(|(index, place)| (place - places[index % 3]).abs());
        off.fold(0.0, f64::max)
    }

    /// Of the fastest axis, mm/s.
    pub(super) fn speed(&mut self) -> f64 {
        let motors = self.bus().units().iter().flat_map(|unit| &unit.motors[..3]);
        let speeds = motors
            .map(|motor| f64::from(motor.speed()).abs() * crate::wire::sixpack2::steps_of_a_unit(3) / MM);
        speeds.fold(0.0, f64::max)
    }

    /// That no axis left its stroke, and none lost a step.
    pub(super) fn assert_inside(&mut self) {
        for unit in self.bus().units() {
            for (index, motor) in unit.motors[..3].iter().enumerate() {
                let executed = motor.shaft.executed();
                let (low, high) = (executed.lowest / MM, executed.highest / MM);
                assert!(low >= -0.06 && high <= 150.06, "{index}: {low} {high}");
                assert_eq!((executed.lost, motor.own_searches), (0.0, 0), "{index}");
            }
        }
    }

    /// That besides no motor was made to jump by more than a seat's acceleration makes in a slice, and the whole units of speed add.
    pub(super) fn assert_gentle(&mut self) {
        self.assert_inside();
        for unit in self.bus().units() {
            for (index, motor) in unit.motors[..3].iter().enumerate() {
                let jump = motor.shaft.executed().jump / MM;
                assert!(jump <= 32.0, "{index}: {jump} mm/s at once");
            }
        }
    }
}

/// Swings of up to some 190 mm/s and 1,900 mm/s² that begin gently, in mm.
pub(super) fn ride(at: f64, axis: usize) -> f64 {
    ride_about(72.0, at, axis)
}
