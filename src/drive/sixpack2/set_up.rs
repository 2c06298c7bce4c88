//! The settings of the motors of a seat: written whole where a person is, at rest. None can be read back, and all are gone with a reset.

use std::time::Duration;

use super::ask::{told_place, where_is};
use super::find::FindError;
use super::scale::MotorScale;
use super::talk::{Talk, TalkFault};
use crate::config::drive::homing::{HomeWay, Side};
use crate::config::drive::sixpack2::{MotorCurrent, PropDiv, SHARES, Sixpack2Drive};
use crate::config::drive::{SeatDrive, homing::DriveHoming};
use crate::drive::Lag;
use crate::drive::link::{HomedAs, LinkFault, LinkPort, LinkTalk as _, sum_of};
use crate::motion::{AxisGeometry, SeatType};
use crate::wire::sixpack2::{
    CurrentSettings, MotorSettings, PeakCurrent, PiSettings, PositionTold, RampSettings, ReferenceSettings,
    SixpackOrder, StartSettings, ZeroSettings, p5, p6,
};

/// With what speed ramps begin, and how slowly a search meets the edge (manual, page 36).
const START: u16 = 16;
/// The mask by which a switch is de-bounced for 22 ms (manual, pages 25 and 39).
const DEBOUNCE: u16 = 0x0fff;
/// How far around zero a switch may be closed, microsteps (manual, page 39).
const RANGE: u16 = 64;
/// How long after a move a motor counts as at rest, in 2 ms (manual, page 25).
const SETTLE: u16 = 500;
/// No sum of distances is taken (manual, page 25).
const NO_INTEGRAL: u16 = 129;
/// From standing to the speed of a search, seconds: gentle.
const RAMP: f64 = 0.2;
/// How far a search may run past its switch, mm: there is little room to the stop of the mechanics.
const OVERRUN_MM: f64 = 0.5;

/// A seat, and the motors that move it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SeatMotors<'a> {
    /// The name of its controller.
    pub(crate) name: &'a str,
    /// Those of seats that it may be taken for.
    pub(crate) twins: &'a [String],
    /// What it is.
    pub(crate) seat: &'a SeatType,
    /// How drives move it.
    pub(crate) drive: &'a SeatDrive,
    /// What its motors are set to.
    pub(crate) sixpack2: &'a Sixpack2Drive,
    /// The unit.
    pub(crate) unit: u8,
    /// The motor of each axis.
    pub(crate) motors: &'a [u8],
    /// From one target of an axis to the next, when it plays.
    pub(crate) period: Duration,
}

/// Why a seat is not home, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum HomeError {
    /// The line, or the unit.
    #[error(transparent)]
    Talk(#[from] TalkFault),
    /// It is not to be had.
    #[error(transparent)]
    Find(#[from] FindError),
    /// Two with one number.
    #[error(
        "two units answer as unit {unit}; connect each alone to the line, and give one of them another number"
    )]
    Twins {
        /// Their number.
        unit: u8,
    },
    /// The clock is too slow for the seat.
    #[error("{0}")]
    TooSlow(String),
    /// No setting of the position loop would do.
    #[error(
        "axis {axis}: with clock_divider {divider} no propdiv keeps the jumps of speed at {speed} mm/s below {jump:.1} mm/s; raise \
         jump_mm_s to what the motor takes, or use a higher baud"
    )]
    NoPropdiv {
        /// The axis, from 1.
        axis: usize,
        /// As it is set.
        divider: u8,
        /// The seat's greatest.
        speed: f64,
        /// What is allowed.
        jump: f64,
    },
    /// A unit that restarts would go on being understood.
    #[error(
        "{baud} baud is the rate of a restarted unit, which would follow targets without knowing its position; set another \
         baud for a link that plays, such as 57600"
    )]
    WakingRate {
        /// The rate of the link.
        baud: u32,
    },
    /// It does not stand still.
    #[error(
        "motor {motor} of unit {unit} does not come to rest within {seconds:.0} s; it was sent a stop; switch its power off and home it again"
    )]
    Moves {
        /// The unit.
        unit: u8,
        /// The motor.
        motor: u8,
        /// The limit.
        seconds: f64,
    },
    /// It was told to search and does not.
    #[error(
        "motor {motor} of unit {unit} does not begin its search for zero; check for a bad line, then home it again"
    )]
    NoSearch {
        /// The unit.
        unit: u8,
        /// The motor.
        motor: u8,
    },
    /// What was looked for is not there.
    #[error(
        "motor {motor} of unit {unit}: {what} not found within {seconds:.0} s, {travel_mm} mm at {speed_mm_s:.1} mm/s; the search was \
         ended; check it, its wiring, `active` and `toward`"
    )]
    NotFound {
        /// The unit.
        unit: u8,
        /// The motor.
        motor: u8,
        /// What.
        what: &'static str,
        /// The limit.
        seconds: f64,
        /// How far it may have to go.
        travel_mm: f64,
        /// As fast as its units allow.
        speed_mm_s: f64,
    },
    /// The search ended somewhere.
    #[error(
        "motor {motor} of unit {unit} ended its search {off_mm:.2} mm off its zero; find out what blocks it, then home it again"
    )]
    BesideZero {
        /// The unit.
        unit: u8,
        /// The motor.
        motor: u8,
        /// How far.
        off_mm: f64,
    },
    /// The counter is not what was written.
    #[error(
        "motor {motor} of unit {unit} counts {found} after {wanted} was written; does another program talk to it? Home it again"
    )]
    ReadBack {
        /// The unit.
        unit: u8,
        /// The motor.
        motor: u8,
        /// As read.
        found: i32,
        /// As written.
        wanted: i32,
    },
    /// It is elsewhere than it was sent.
    #[error(
        "motor {motor} of unit {unit} is at {found_mm:.2} mm instead of {wanted_mm:.2}; find out what blocks it, \
         then home it again"
    )]
    Elsewhere {
        /// The unit.
        unit: u8,
        /// The motor.
        motor: u8,
        /// Where it is, as it counts.
        found_mm: f64,
        /// Where it should be.
        wanted_mm: f64,
    },
    /// It was reset meanwhile.
    #[error("unit {unit} restarted while it homed; check its supply, then home it again")]
    Restarted {
        /// The unit.
        unit: u8,
    },
    /// Its line leads elsewhere.
    #[error(transparent)]
    Another(#[from] HomedAs),
    /// A person stopped it.
    #[error("homing was stopped; the seat is not home")]
    Aborted,
}

impl From<LinkFault> for HomeError {
    fn from(fault: LinkFault) -> Self {
        TalkFault::Link(fault).into()
    }
}

/// What an axis is set up for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// To look for its zero, and go to park: slowly.
    Homing,
    /// To play.
    Show,
}

/// An axis with its motor.
#[derive(Debug, Clone, Copy)]
pub(super) struct MotorAxis<'a> {
    pub(super) motor: u8,
    pub(super) axis: &'a AxisGeometry,
    pub(super) scale: MotorScale,
    pub(super) lag: Lag,
    pub(super) is_reversed: bool,
    pub(super) of: SeatMotors<'a>,
}

impl<'a> SeatMotors<'a> {
    /// Its axes.
    pub(super) fn axes(&self) -> Result<Vec<MotorAxis<'a>>, HomeError> {
        if let Some(why) = self.sixpack2.too_slow_for(self.seat) {
            return Err(HomeError::TooSlow(why));
        }
        let divider = self.sixpack2.clock_divider;
        let axis = |(index, (axis, motor)): (usize, (&'a AxisGeometry, &u8))| {
            let is_reversed = self.drive.reverse[index];
            let scale = MotorScale::of(axis, is_reversed, divider);
            let lag = self.lag(index, axis)?;
            Ok(MotorAxis { motor: *motor, axis, scale, lag, is_reversed, of: *self })
        };
        let pairs = self.seat.own().iter().zip(self.motors).enumerate();
        let axes = pairs.map(axis).collect::<Result<Vec<_>, HomeError>>()?;
        let counting = |axis: &MotorAxis<'a>| {
            let whose = sum_of(&format!("{} {}", axis.motor, self.name));
            MotorAxis { scale: axis.scale.counting_by(axis.sum(&axes), whose), ..*axis }
        };
        Ok(axes.iter().map(counting).collect())
    }

    /// How many mm/s the motor of an axis may be asked for at once, where it gets a target in each period.
    pub(super) fn jump_mm_s(&self, axis: &AxisGeometry, period: Duration) -> f64 {
        self.sixpack2.jump_mm_s.unwrap_or(axis.max_acceleration * period.as_secs_f64())
    }

    /// How an axis follows: a setting of the seat type, by its limits and not by what it plays, as a proof has it.
    fn lag(&self, index: usize, axis: &AxisGeometry) -> Result<Lag, HomeError> {
        let divider = self.sixpack2.clock_divider;
        if let PropDiv::Fixed(propdiv) = self.sixpack2.propdiv {
            return Ok(Lag::new(divider, propdiv));
        }
        let (speed, jump) = (axis.max_velocity, self.jump_mm_s(axis, self.period));
        let lag = Lag::gentlest(divider, self.period, speed, jump);
        lag.ok_or(HomeError::NoPropdiv { axis: index + 1, divider, speed, jump })
    }
}

impl MotorAxis<'_> {
    /// A number that is another once anything is that homing writes to a motor of the seat, or that its places are measured by.
    fn sum(&self, all: &[Self]) -> u64 {
        let each = |axis: &Self| {
            let (scale, homing) = (axis.scale, axis.homing());
            let written = [Purpose::Homing, Purpose::Show].map(|purpose| axis.settings(purpose));
            format!("{scale:?} {} {:?} {written:?}", homing.zero_mm, homing.toward)
        };
        sum_of(&format!("{} {:?}", self.motor, all.iter().map(each).collect::<Vec<_>>()))
    }

    /// Tells its motor what has to be taken, and gives where it is by then.
    pub(super) fn write<P: LinkPort>(
        &self,
        talk: &mut Talk<P>,
        order: SixpackOrder,
    ) -> Result<PositionTold, TalkFault> {
        let unit = self.of.unit;
        let reply = talk.confirm(unit, order, where_is(self.motor))?;
        told_place(reply, TalkFault::Silent { unit, baud: talk.baud() })
    }

    /// Writes all of its settings; it is at rest.
    pub(super) fn set_up<P: LinkPort>(&self, talk: &mut Talk<P>, purpose: Purpose) -> Result<(), TalkFault> {
        self.settings(purpose).into_iter().try_for_each(|order| self.write(talk, order).map(drop))
    }

    fn settings(&self, purpose: Purpose) -> [SixpackOrder; 8] {
        let (motor, homing) = (self.motor, self.homing());
        let speed = self.scale.speed(homing.speed_mm_s);
        let most = self.scale.acceleration(self.axis.max_acceleration);
        let (amax, vmax) = match purpose {
            Purpose::Homing => {
                let mm_s = self.scale.mm_s(speed);
                let brakes = (mm_s / RAMP).max(mm_s * mm_s / (2.0 * OVERRUN_MM));
                // Rounded down it would brake too late.
                ((self.scale.acceleration(brakes) + 1).min(most), speed)
            }
            Purpose::Show => (most, self.scale.speed(self.axis.max_velocity)),
        };
        [
            SixpackOrder::Peak(PeakCurrent { motor, value: self.of.sixpack2.current.peak }),
            self.currents(purpose),
            SixpackOrder::Start(StartSettings { motor, vmin: 0, vstart: START.min(speed), div: 0 }),
            SixpackOrder::Ramp(RampSettings { motor, amax, vmax }),
            self.kind(),
            SixpackOrder::Reference(ReferenceSettings {
                motor,
                vrefmax: speed,
                debounce: DEBOUNCE,
                stop_after: 1,
            }),
            SixpackOrder::Zero(ZeroSettings { motor, offset: 0, range: RANGE }),
            SixpackOrder::Pi(PiSettings {
                motor,
                propdiv: self.lag.propdiv(),
                intdiv: NO_INTEGRAL,
                intclip: NO_INTEGRAL,
                intinpclip: 1,
            }),
        ]
    }

    /// What flows when. Whatever switches it down, the seat is held.
    fn currents(&self, purpose: Purpose) -> SixpackOrder {
        let MotorCurrent { stand, run, ramp, .. } = self.of.sixpack2.current;
        let searching = self.homing().torque.filter(|_| purpose == Purpose::Homing);
        let most = |share: u8| searching.map_or(share, |torque| share.min(percent(torque)));
        let [stand, run, ramp] = [stand, most(run), most(ramp)].map(step);
        SixpackOrder::Currents(CurrentSettings {
            motor: self.motor,
            power_down: stand,
            stand,
            run,
            ramp,
            t0: SETTLE,
        })
    }

    /// Where its zero is and what tells it; the order keeps it from searching by itself.
    pub(super) fn kind(&self) -> SixpackOrder {
        let homing = self.homing();
        let is_left = (homing.toward == Side::Down) != self.is_reversed;
        let way = match homing.way {
            HomeWay::Switch { active_high: true, .. } => p6::NULL_POSITIVE,
            HomeWay::HardStop => p6::MECH_REF,
            _ => 0,
        };
        SixpackOrder::Motor(MotorSettings {
            motor: self.motor,
            poslimit: self.scale.way(homing.travel_mm.max(self.axis.stroke())),
            p5: p5::FILTER_SWITCH | if is_left { p5::NULL_LEFT } else { 0 },
            p6: p6::FAST_REF | p6::STOP_SOFT | way,
        })
    }

    pub(super) const fn homing(&self) -> &DriveHoming {
        &self.of.drive.homing
    }
}

/// A share as percent, rounded down.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 100")]
fn percent(share: f64) -> u8 {
    (share * 100.0 + 1e-9).clamp(0.0, 100.0) as u8
}

/// The greatest of the shares of current that is no more, and holds something; as `$11` numbers them.
fn step(percent: u8) -> u8 {
    let least = SHARES.len() - 2;
    let at = SHARES.iter().position(|share| *share <= percent).unwrap_or(least);
    u8::try_from(at.min(least)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_current_is_the_greatest_that_is_no_more_and_never_none() {
        assert_eq!([100, 75, 74, 50, 9, 8, 0].map(step), [0, 1, 2, 2, 7, 7, 7]);
        assert_eq!([0.4, 0.29, 1.0].map(percent), [40, 29, 100]);
    }
}
