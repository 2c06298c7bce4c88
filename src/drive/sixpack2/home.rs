//! A seat finds its zero, and is then set up for shows. Nobody sits on it, and a person watches.
//!
//! Each motor in turn searches by itself, and knows no end of that: whoever leads it ends a search that takes too long. Then its counter is
//! set, so that the lower end of the stroke is at 0, and all go slowly to park.
//!
//! What a unit is set to cannot be read, its counters can: so they lose their places before anything else is set, and last of all that end
//! becomes a number that is made of the settings. Whatever cuts a homing off, or is edited later, counters that have places of the seat are those
//! of motors that are set up for its shows.

use std::time::Duration;

use super::ask::{WHO, position, searches};
use super::find::find;
use super::look::look;
use super::set_up::{HomeError, MotorAxis, Purpose, SeatMotors};
use super::talk::Talk;
use crate::config::drive::homing::HomeWay;
use crate::drive::link::{HomedAs, LinkPort, LinkTalk as _, Step};
use crate::wire::sixpack2::{
    AbortSearch, ClockDivider, JointStart, JointTarget, PacketTimeout, PositionPreset, PositionTold,
    ReferenceSearch, SixpackOrder, SixpackReply, action,
};

/// How long the line may be silent within a frame, in 2 ms (manual, page 44).
const PACKET_TIMEOUT: u8 = 10;
/// How much longer than the travel takes a search may last: it meets its switch twice.
const SEARCH: (f64, f64) = (1.25, 5.0);
/// The same of a move.
const MOVE: (f64, f64) = (1.5, 2.0);
/// How long a motor has to come to rest, and to begin a search, seconds.
const REST: f64 = 5.0;
const BEGINS: f64 = 1.0;
/// Between two looks what it does.
const LOOKS: Duration = Duration::from_millis(20);
/// How far beside its zero a motor may end a search, and beside park a move, mm.
const BESIDE_MM: f64 = 1.0;
const PARKED_MM: f64 = 0.1;

/// Around a homing.
pub(crate) struct Homing<'a> {
    /// False once somebody wants it to end: the axes are braked before anything else is asked.
    pub(crate) goes_on: &'a dyn Fn() -> bool,
    /// Is told each step.
    pub(crate) told: &'a mut dyn FnMut(Step),
}

/// Finds the unit of a seat and homes it; all of its axes are at park afterwards.
///
/// # Errors
/// A [`HomeError`]; by then all of its motors were told to stop, and it is not home. They brake as in a show again, as far as they answer.
pub(crate) fn home<P: LinkPort>(
    talk: &mut Talk<P>,
    seat: SeatMotors<'_>,
    mut around: Homing<'_>,
) -> Result<(), HomeError> {
    let axes = seat.axes()?;
    let unit = seat.unit;
    find(talk, &[unit])?;
    if talk.has_twins(|talk| talk.insist(unit, WHO).map(drop))? {
        return Err(HomeError::Twins { unit });
    }
    let homed_as = if seat.twins.is_empty() { None } else { seat.homed_as(&look(talk, unit, seat.motors)?) };
    if let Some(name) = homed_as {
        return Err(HomedAs(name.to_owned()).into());
    }
    let done = run(talk, seat, &axes, &mut around);
    if done.is_err() {
        // What is wrong already is told; that the line is gone, too, is no news.
        let around = &mut Homing { goes_on: &|| true, told: &mut |_| {} };
        let _ = set_aside(talk, seat, &axes, Purpose::Show, around);
    }
    done
}

/// Brings all of its motors to rest, has them forget where they are, and sets them up.
fn set_aside<P: LinkPort>(
    talk: &mut Talk<P>,
    seat: SeatMotors<'_>,
    axes: &[MotorAxis<'_>],
    purpose: Purpose,
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    // All are told, whichever does not answer, before any is waited for.
    axes.iter().map(|axis| axis.stop(talk)).fold(Ok(()), Result::and)?;
    axes.iter().try_for_each(|axis| axis.await_rest(talk, around))?;
    axes.iter().try_for_each(|axis| axis.forget_zero(talk))?;
    let (unit, divider) = (seat.unit, seat.sixpack2.clock_divider);
    talk.confirm(unit, SixpackOrder::Timeout(PacketTimeout { timeout: PACKET_TIMEOUT }), WHO)?;
    talk.confirm(unit, SixpackOrder::Clock(ClockDivider { divider }), WHO)?;
    for (index, axis) in axes.iter().enumerate() {
        axis.set_up(talk, purpose)?;
        (around.told)(Step::Held(index));
    }
    Ok(())
}

fn run<P: LinkPort>(
    talk: &mut Talk<P>,
    seat: SeatMotors<'_>,
    axes: &[MotorAxis<'_>],
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    let unit = seat.unit;
    set_aside(talk, seat, axes, Purpose::Homing, around)?;
    for (index, axis) in axes.iter().enumerate() {
        axis.find_zero(talk, index, around)?;
        (around.told)(Step::Found(index));
    }
    park(talk, seat, axes, around)?;
    for (index, axis) in axes.iter().enumerate() {
        axis.set_up(talk, Purpose::Show)?;
        (around.told)(Step::Set(index));
    }
    has_its_settings(talk, unit)?;
    axes.iter().try_for_each(|axis| axis.prove(talk))?;
    // A unit that was reset meanwhile took that for its place.
    has_its_settings(talk, unit)
}

/// That a unit was not reset since it was asked last.
fn has_its_settings<P: LinkPort>(talk: &mut Talk<P>, unit: u8) -> Result<(), HomeError> {
    match talk.insist(unit, WHO)? {
        SixpackReply::UnitTold(told) if told.reset != 0 => Err(HomeError::Restarted { unit }),
        _ => Ok(()),
    }
}

/// The slow move to park, of all at once; that they stand there proves the counters.
fn park<P: LinkPort>(
    talk: &mut Talk<P>,
    seat: SeatMotors<'_>,
    axes: &[MotorAxis<'_>],
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    goes_on(around)?;
    (around.told)(Step::Parking);
    let (mut farthest, mut mask) = (0.0_f64, 0);
    for axis in axes {
        let target = axis.unproved(axis.park_mm());
        let here = axis.write(talk, SixpackOrder::JointTarget(JointTarget { motor: axis.motor, target }))?;
        let way = (axis.park_mm() - axis.unproved_mm(here)).abs();
        farthest = farthest.max(way / axis.search_mm_s());
        mask |= 1 << axis.motor;
    }
    for axis in axes {
        // Those that move already leave it alone.
        axis.write(talk, SixpackOrder::JointStart(JointStart { mask }))?;
    }
    for axis in axes {
        let seconds = farthest * MOVE.0 + MOVE.1;
        let there = axis.await_idle(talk, seconds, around)?.ok_or_else(|| axis.moves(seconds))?;
        let (found_mm, wanted_mm) = (axis.unproved_mm(there), axis.park_mm());
        if (found_mm - wanted_mm).abs() > PARKED_MM {
            let (unit, motor) = (seat.unit, axis.motor);
            return Err(HomeError::Elsewhere { unit, motor, found_mm, wanted_mm });
        }
    }
    Ok(())
}

fn goes_on(around: &Homing<'_>) -> Result<(), HomeError> {
    if (around.goes_on)() { Ok(()) } else { Err(HomeError::Aborted) }
}

impl MotorAxis<'_> {
    fn park_mm(&self) -> f64 {
        self.axis.place(self.axis.park)
    }

    /// The speed of its search as it makes it.
    fn search_mm_s(&self) -> f64 {
        self.scale.mm_s(self.scale.speed(self.homing().speed_mm_s))
    }

    /// What the counter has at the lower end of the stroke once the seat is home; until then it has 0.
    fn base(&self) -> i32 {
        self.scale.whole(self.axis.low)
    }

    /// The counter at a place as long as the seat is not home.
    fn unproved(&self, mm: f64) -> i32 {
        self.scale.whole(mm) - self.base()
    }

    /// The place of such a counter.
    fn unproved_mm(&self, told: PositionTold) -> f64 {
        self.scale.mm(f64::from(told.position) + f64::from(self.base()))
    }

    /// Its counter has no place of the seat any more.
    fn forget_zero<P: LinkPort>(&self, talk: &mut Talk<P>) -> Result<(), HomeError> {
        // By settings of others that may begin a search (manual, page 42).
        self.write(talk, self.kind())?;
        self.count_as(talk, 0)
    }

    /// Its counter has the place of the seat where it stands.
    fn prove<P: LinkPort>(&self, talk: &mut Talk<P>) -> Result<(), HomeError> {
        let stands = position(talk, self.of.unit, self.motor)?.position;
        self.count_as(talk, self.base().saturating_add(stands))?;
        // Where a joint move leads that nobody asked for.
        let target = self.scale.whole(self.park_mm());
        Ok(self
            .write(talk, SixpackOrder::JointTarget(JointTarget { motor: self.motor, target }))
            .map(drop)?)
    }

    /// Sets its counter.
    fn count_as<P: LinkPort>(&self, talk: &mut Talk<P>, wanted: i32) -> Result<(), HomeError> {
        let (unit, motor) = (self.of.unit, self.motor);
        let preset = SixpackOrder::Preset(PositionPreset { motor, position: wanted });
        let found = self.write(talk, preset)?.position;
        if found == wanted { Ok(()) } else { Err(HomeError::ReadBack { unit, motor, found, wanted }) }
    }

    fn moves(&self, seconds: f64) -> HomeError {
        HomeError::Moves { unit: self.of.unit, motor: self.motor, seconds }
    }

    /// Ends a search, and stops by the ramp whatever else it does.
    fn stop<P: LinkPort>(&self, talk: &mut Talk<P>) -> Result<(), HomeError> {
        let motor = self.motor;
        self.write(talk, SixpackOrder::AbortSearch(AbortSearch { motor }))?;
        self.write(talk, SixpackOrder::RampedStop { motor })?;
        Ok(())
    }

    fn await_rest<P: LinkPort>(&self, talk: &mut Talk<P>, around: &Homing<'_>) -> Result<(), HomeError> {
        self.await_idle(talk, REST, around)?.map(drop).ok_or_else(|| self.moves(REST))
    }

    /// Where it is once it does nothing; none after so many seconds.
    fn await_idle<P: LinkPort>(
        &self,
        talk: &mut Talk<P>,
        seconds: f64,
        around: &Homing<'_>,
    ) -> Result<Option<PositionTold>, HomeError> {
        let limit = talk.now() + Duration::from_secs_f64(seconds);
        loop {
            goes_on(around)?;
            let told = position(talk, self.of.unit, self.motor)?;
            if told.action == action::IDLE {
                return Ok(Some(told));
            }
            if talk.now() > limit {
                return Ok(None);
            }
            talk.pause(LOOKS);
        }
    }

    /// Looks for its zero, and sets its counter by that.
    fn find_zero<P: LinkPort>(
        &self,
        talk: &mut Talk<P>,
        index: usize,
        around: &mut Homing<'_>,
    ) -> Result<(), HomeError> {
        goes_on(around)?;
        let (unit, motor, homing) = (self.of.unit, self.motor, self.homing());
        // A search without settings goes the other way.
        has_its_settings(talk, unit)?;
        let beside = match homing.way {
            // Where it stands is what the person said, whatever its counter reads.
            HomeWay::Here => 0,
            _ => {
                (around.told)(Step::Searching(index));
                self.search(talk, around)?
            }
        };
        // A counter that was reset looks like a zero that was found.
        has_its_settings(talk, unit)?;
        let off_mm = self.scale.mm_of(beside.into());
        if off_mm.abs() > BESIDE_MM {
            return Err(HomeError::BesideZero { unit, motor, off_mm });
        }
        self.count_as(talk, self.unproved(homing.zero_mm).saturating_add(beside))
    }

    /// Has its motor search; how far beside its zero that ended, microsteps.
    fn search<P: LinkPort>(&self, talk: &mut Talk<P>, around: &Homing<'_>) -> Result<i32, HomeError> {
        let (unit, motor, homing) = (self.of.unit, self.motor, self.homing());
        let order = SixpackOrder::Search(ReferenceSearch { motor });
        // Where something else was made of the order, a counter that happens to be at 0 looks like a zero that was found.
        let begins = talk.now() + Duration::from_secs_f64(BEGINS);
        while !searches(self.write(talk, order)?.action) {
            if talk.now() > begins {
                return Err(HomeError::NoSearch { unit, motor });
            }
        }
        let (travel_mm, speed_mm_s) = (homing.travel_mm, self.search_mm_s());
        let seconds = travel_mm / speed_mm_s * SEARCH.0 + SEARCH.1;
        let what = if homing.way == HomeWay::HardStop { "the hard stop" } else { "its switch" };
        let not_found = HomeError::NotFound { unit, motor, what, seconds, travel_mm, speed_mm_s };
        self.await_idle(talk, seconds, around)?.map(|told| told.position).ok_or(not_found)
    }
}
