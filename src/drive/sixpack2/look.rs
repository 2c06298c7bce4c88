//! What a unit says of itself; nothing is written and nothing moves. Asking clears its reset flag, and the stop flag of a motor.

use super::ask::{WHO, at_waking_rate, position, searches, who};
use super::set_up::{MotorAxis, SeatMotors};
use super::talk::{ANSWER, Talk, TalkFault};
use crate::drive::link::{LinkPort, LinkTalk as _};
use crate::wire::sixpack2::{InputQuery, PositionTold, SixpackOrder, SixpackReply};

/// How far outside its stroke a seat that is home may stand, mm.
pub(super) const OUTSIDE_MM: f64 = 0.5;
/// The input that is the supply, and its units a volt (manual, page 43).
const SUPPLY: u8 = 7;
const UNITS_A_VOLT: f64 = 22.0;

/// A unit as it was read. Its settings cannot be.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct UnitFacts {
    /// Its number.
    pub(crate) unit: u8,
    /// Its version.
    pub(crate) firmware: u8,
    /// It was reset since somebody asked last: it has no settings, and its motors know no place.
    pub(crate) was_reset: bool,
    /// °C.
    pub(crate) celsius: i8,
    /// Its serial number.
    pub(crate) serial: u16,
    /// Of its supply.
    pub(crate) volts: f64,
    /// Each that was asked for, in that order.
    pub(crate) motors: Vec<MotorFacts>,
}

/// A motor as it was read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MotorFacts {
    /// Its number, from 0.
    pub(crate) motor: u8,
    /// Microsteps; a seat that is home has the lower end of its stroke where its settings say.
    pub(crate) position: i32,
    /// What it does, one of [`crate::wire::sixpack2::action`].
    pub(crate) action: u8,
    /// Its switch or an input stopped it.
    pub(crate) was_stopped: bool,
}

/// Reads a unit, and some of its motors.
///
/// # Errors
/// A [`TalkFault`] where it does not answer.
pub(crate) fn look<P: LinkPort>(talk: &mut Talk<P>, unit: u8, motors: &[u8]) -> Result<UnitFacts, TalkFault> {
    let silent = TalkFault::Silent { unit, baud: talk.baud() };
    let SixpackReply::UnitTold(told) = talk.insist(unit, WHO)? else { return Err(silent) };
    let supply = SixpackOrder::AskInput(InputQuery { channel: SUPPLY, response: ANSWER });
    let SixpackReply::InputTold(supply) = talk.insist(unit, supply)? else { return Err(silent) };
    let motor = |motor: &u8| {
        let PositionTold { motor, position, action, stop } = position(talk, unit, *motor)?;
        Ok(MotorFacts { motor, position, action, was_stopped: stop != 0 })
    };
    let motors = motors.iter().map(motor).collect::<Result<_, TalkFault>>()?;
    Ok(UnitFacts {
        unit,
        firmware: told.firmware,
        was_reset: told.reset != 0,
        celsius: told.celsius,
        serial: told.serial,
        volts: f64::from(supply.value) / UNITS_A_VOLT,
        motors,
    })
}

/// Reads a unit and some of its motors, at the rate of the line; none of one that answers as it woke, which somebody has to home.
///
/// # Errors
/// A [`TalkFault`] where it answers at neither rate.
pub(crate) fn look_for<P: LinkPort>(
    talk: &mut Talk<P>,
    unit: u8,
    motors: &[u8],
) -> Result<Option<UnitFacts>, TalkFault> {
    let looked = look(talk, unit, motors).map(Some);
    if talk.other_baud().is_none() || !matches!(looked, Err(TalkFault::Silent { .. })) {
        return looked;
    }
    let told = at_waking_rate(talk, |talk| who(talk, unit))?;
    if told.is_some() { Ok(None) } else { looked }
}

impl<'a> SeatMotors<'a> {
    /// Its motors that count no place of the seat: they were never homed, or were restarted.
    pub(crate) fn strangers(&self, facts: &UnitFacts) -> Vec<u8> {
        // Where no axis can be set, homing tells why.
        let axes = self.axes().unwrap_or_default();
        let told = |motor: u8| facts.motors.iter().find(|told| told.motor == motor);
        let is_stranger = |axis: &&MotorAxis<'_>| {
            let (low, high) = axis.scale.reach(OUTSIDE_MM);
            !told(axis.motor).is_some_and(|told| (low..=high).contains(&f64::from(told.position)))
        };
        axes.iter().filter(is_stranger).map(|axis| axis.motor).collect()
    }

    /// The seat that was homed as its motors count, where that is one that this may be taken for.
    pub(crate) fn homed_as(&self, facts: &UnitFacts) -> Option<&'a str> {
        let is_whose = |name| Self { name, ..*self }.strangers(facts).is_empty();
        self.twins.iter().map(String::as_str).find(|name| !is_whose(self.name) && is_whose(name))
    }

    /// Where the axis of a motor is by its counter, a part of its stroke; none of a motor that is not of the seat.
    pub(crate) fn place(&self, facts: &MotorFacts) -> Option<f64> {
        let axes = self.axes().ok()?;
        let axis = axes.iter().find(|axis| axis.motor == facts.motor)?;
        Some(axis.scale.fraction(facts.position.into()))
    }

    /// What the counters of its motors read at the lower end of the stroke once it is home.
    #[cfg(test)]
    pub(crate) fn at_low(&self) -> Vec<i32> {
        self.axes().unwrap().iter().map(|axis| axis.scale.whole(axis.axis.low)).collect()
    }
}

impl MotorFacts {
    /// True while it looks for its zero.
    pub(crate) const fn searches(&self) -> bool {
        searches(self.action)
    }
}
