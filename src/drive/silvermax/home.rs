//! A seat finds its zero, and is then set up for shows. Nobody sits on it, and a person watches.
//!
//! Each axis is disarmed, moves off its switch, looks for it by a move that cannot be longer than the travel, and is shifted by
//! where the drive itself noted the edge: the edge is where it was, whatever the motor ran past it. Then all go slowly to
//! park, and only inside the stroke are the soft limits switched on: a target outside them would jump to them.

use std::time::Duration;

use super::look::look;
use super::set_up::{HomeError, SeatUnits, UnitAxis, write, write_once};
use super::talk::Talk;
use crate::config::drive::homing::{HomeWay, Side};
use crate::drive::link::{HomedAs, LinkPort, LinkTalk as _, Step};
use crate::time::MonoTime;
use crate::wire::silvermax::register::{ACCUMULATOR, CANARY, INPUT_POSITION, POSITION};
use crate::wire::silvermax::{Internal, Io, Poll, Request, StatusWord, StopOn};

/// How far an axis moves off its switch, mm.
const OFF_SWITCH_MM: f64 = 10.0;
/// From standing to the speed of a search, seconds: gentle.
const RAMP: f64 = 0.2;
/// How far it may run past its switch, mm: there is little room to the stop of the mechanics.
const OVERRUN_MM: f64 = 0.5;
/// How far beside park an axis may come to stand, mm: what the motor holds, and no more.
const PARKED_MM: f64 = 0.1;
/// How much longer than it has to a move may take.
const PATIENCE: (f64, f64) = (1.5, 2.0);
/// Between two looks whether it still moves.
const LOOKS: Duration = Duration::from_millis(10);

/// Around a homing.
pub(crate) struct Homing<'a> {
    /// What is written into register 37 of each unit at the begin, and its upper half into 40 at the end: not 0, and no number that others
    /// would write.
    pub(crate) canary: i32,
    /// False once somebody wants it to end: the axes are braked before anything else is asked.
    pub(crate) goes_on: &'a dyn Fn() -> bool,
    /// Is told each step.
    pub(crate) told: &'a mut dyn FnMut(Step),
}

/// Homes a seat; all of its axes are at park afterwards. Gives what its units hold in register 40.
///
/// # Errors
/// A [`HomeError`]; by then all of its axes were told to brake, and it is not home.
pub(crate) fn home<P: LinkPort>(
    talk: &mut Talk<P>,
    seat: SeatUnits<'_>,
    mut around: Homing<'_>,
) -> Result<i32, HomeError> {
    if around.canary == 0 {
        return Err(HomeError::Canary);
    }
    let (axes, canary) = (seat.axes()?, seat.canary(around.canary)?);
    is_its_own(talk, seat)?;
    let done = run(talk, &axes, canary, &mut around);
    if done.is_err() {
        // What is wrong already is told; that the line is gone, too, is no news.
        let brakes = axes.iter().map(|axis| (axis.unit, Request::Stop { deceleration: axis.brake() }));
        let forgets =
            axes.iter().map(|axis| (axis.unit, Request::WriteRegister { register: CANARY, value: 0 }));
        for (unit, request) in brakes.chain(forgets) {
            let _ = talk.insist(unit, request);
        }
    }
    done.map(|()| canary)
}

/// That its units were not homed as another seat, which would move in its place from then on.
fn is_its_own<P: LinkPort>(talk: &mut Talk<P>, seat: SeatUnits<'_>) -> Result<(), HomeError> {
    if seat.twins.is_empty() {
        return Ok(());
    }
    let canary = |unit: &u8| Ok(look(talk, *unit)?.canary);
    let canaries = seat.units.iter().map(canary).collect::<Result<Vec<_>, HomeError>>()?;
    seat.homed_as(&canaries).map_or(Ok(()), |name| Err(HomedAs(name.to_owned()).into()))
}

fn run<P: LinkPort>(
    talk: &mut Talk<P>,
    axes: &[UnitAxis<'_>],
    canary: i32,
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    for axis in axes {
        let poll = |talk: &mut Talk<P>| talk.insist(axis.unit, Request::Poll).map(drop);
        if talk.has_twins(poll)? {
            return Err(HomeError::Twins { unit: axis.unit });
        }
    }
    for (index, axis) in axes.iter().enumerate() {
        goes_on(around)?;
        axis.disarm(talk, around.canary)?;
        (around.told)(Step::Held(index));
    }
    let together = axes.first().is_some_and(|axis| axis.of.drive.homing.together);
    let numbered: Vec<_> = axes.iter().copied().enumerate().collect();
    for group in numbered.chunks(if together { axes.len() } else { 1 }) {
        find(talk, group, around)?;
    }
    for axis in axes {
        axis.arm(talk)?;
    }
    park(talk, &numbered, around)?;
    for (index, axis) in axes.iter().enumerate() {
        axis.seal(talk, around.canary, canary)?;
        (around.told)(Step::Set(index));
    }
    Ok(())
}

type Numbered<'a> = (usize, UnitAxis<'a>);

/// Finds the zero of axes that move at once.
fn find<P: LinkPort>(
    talk: &mut Talk<P>,
    group: &[Numbered<'_>],
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    let way = group[0].1.of.drive.homing.way;
    if let HomeWay::Switch { input: Some(input), active_high }
    | HomeWay::Index { input: Some(input), active_high } = way
    {
        off_switch(talk, group, (input, active_high), around)?;
        let stop = StopOn::Input { input, is_high: active_high };
        let what = format!("the switch on input {input}");
        search(talk, group, (stop, Some(&what)), around)?;
    }
    match way {
        HomeWay::Switch { .. } => shift_all(talk, group, INPUT_POSITION)?,
        HomeWay::Index { .. } => {
            index(talk, group, around)?;
            shift_all(talk, group, INPUT_POSITION)?;
        }
        HomeWay::HardStop => {
            search(talk, group, (StopOn::MovingError, Some("the hard stop")), around)?;
            for (_, axis) in group {
                // The target is beyond the stop: let go of that.
                write(talk, axis.unit, Request::TargetToPosition)?;
            }
            shift_all(talk, group, POSITION)?;
        }
        HomeWay::Here => shift_all(talk, group, POSITION)?,
    }
    group.iter().for_each(|(index, _)| (around.told)(Step::Found(*index)));
    Ok(())
}

/// Moves those that stand on their switch off it.
fn off_switch<P: LinkPort>(
    talk: &mut Talk<P>,
    group: &[Numbered<'_>],
    (input, active_high): (u8, bool),
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    let mut on = Vec::new();
    for one in group {
        if one.1.is_on(talk, (input, active_high))? {
            on.push(*one);
        }
    }
    let stop = StopOn::Input { input, is_high: !active_high };
    for (index, axis) in &on {
        (around.told)(Step::OffSwitch(*index));
        axis.go(talk, -axis.toward() * OFF_SWITCH_MM, stop, around)?;
    }
    arrive(talk, &on, OFF_SWITCH_MM, around)?;
    for (_, axis) in &on {
        if axis.is_on(talk, (input, active_high))? {
            return Err(HomeError::SwitchStaysOn { unit: axis.unit, input, travel_mm: OFF_SWITCH_MM });
        }
    }
    Ok(())
}

/// Moves toward the zero until something is sensed; with words for what that is.
fn search<P: LinkPort>(
    talk: &mut Talk<P>,
    group: &[Numbered<'_>],
    (stop, what): (StopOn, Option<&str>),
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    let travel_mm = group[0].1.of.drive.homing.travel_mm;
    for (index, axis) in group {
        (around.told)(Step::Searching(*index));
        axis.go(talk, axis.toward() * travel_mm, stop, around)?;
    }
    arrive(talk, group, travel_mm, around)?;
    for (_, axis) in group {
        axis.sensed(talk, what.unwrap_or_default(), travel_mm)?;
    }
    Ok(())
}

/// The index pulse within a turn of the edge, away from the stop that lies behind the switch.
fn index<P: LinkPort>(
    talk: &mut Talk<P>,
    group: &[Numbered<'_>],
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    for (_, axis) in group {
        let turn = 1.1 * axis.axis.lead;
        axis.go(talk, -axis.toward() * turn, StopOn::Index, around)?;
    }
    let turn = 1.1 * group[0].1.axis.lead;
    arrive(talk, group, turn, around)?;
    group.iter().try_for_each(|(_, axis)| axis.sensed(talk, "the index pulse", turn))
}

/// Waits until none of them moves.
fn arrive<P: LinkPort>(
    talk: &mut Talk<P>,
    group: &[Numbered<'_>],
    travel_mm: f64,
    around: &Homing<'_>,
) -> Result<(), HomeError> {
    let speed = group.first().map_or(1.0, |(_, axis)| axis.of.drive.homing.speed_mm_s);
    let seconds = travel_mm / speed * PATIENCE.0 + PATIENCE.1;
    let limit = talk.now() + Duration::from_secs_f64(seconds);
    for (_, axis) in group {
        while !axis.happened(talk)?.has(Poll::DONE) {
            goes_on(around)?;
            if talk.now() > limit {
                return Err(HomeError::TooLong { unit: axis.unit, seconds });
            }
            let next: MonoTime = talk.now() + LOOKS;
            talk.port().sleep_until(next);
        }
    }
    goes_on(around)
}

/// The slow move to park; that they stand there proves the shift.
fn park<P: LinkPort>(
    talk: &mut Talk<P>,
    group: &[Numbered<'_>],
    around: &mut Homing<'_>,
) -> Result<(), HomeError> {
    goes_on(around)?;
    (around.told)(Step::Parking);
    // None moves before all have their zero: one that waited for the others may have been restarted.
    group.iter().try_for_each(|(_, axis)| axis.is_up_since(talk, around.canary))?;
    let mut farthest = 0.0_f64;
    for (_, axis) in group {
        let here = axis.scale.mm(f64::from(talk.register(axis.unit, POSITION)?));
        farthest = farthest.max((axis.park_mm() - here).abs());
        let [acceleration, velocity] = axis.pace();
        let position = axis.scale.whole(axis.park_mm());
        axis.forget(talk)?;
        write(talk, axis.unit, Request::MoveAbsolute { position, acceleration, velocity })?;
    }
    arrive(talk, group, farthest, around)?;
    for (_, axis) in group {
        let (unit, wanted_mm) = (axis.unit, axis.park_mm());
        let found_mm = axis.scale.mm(f64::from(talk.register(unit, POSITION)?));
        if (found_mm - wanted_mm).abs() > PARKED_MM {
            return Err(HomeError::Elsewhere { unit, found_mm, wanted_mm });
        }
    }
    Ok(())
}

/// What a register says is the zero.
fn shift_all<P: LinkPort>(talk: &mut Talk<P>, group: &[Numbered<'_>], register: u8) -> Result<(), HomeError> {
    for (_, axis) in group {
        let found = talk.register(axis.unit, register)?;
        let value = found.wrapping_sub(axis.scale.whole(axis.of.drive.homing.zero_mm));
        write(talk, axis.unit, Request::WriteRegister { register: ACCUMULATOR, value })?;
        write_once(talk, axis.unit, Request::SubtractAccumulator)?;
    }
    Ok(())
}

fn goes_on(around: &Homing<'_>) -> Result<(), HomeError> {
    if (around.goes_on)() { Ok(()) } else { Err(HomeError::Aborted) }
}

impl UnitAxis<'_> {
    /// 1 where the zero is up, -1 where it is down.
    fn toward(&self) -> f64 {
        if self.of.drive.homing.toward == Side::Up { 1.0 } else { -1.0 }
    }

    fn park_mm(&self) -> f64 {
        self.axis.place(self.axis.park)
    }

    /// Acceleration and velocity of a search.
    fn pace(&self) -> [u32; 2] {
        let speed = self.of.drive.homing.speed_mm_s;
        let velocity = self.scale.velocity(speed);
        let brakes = (speed / RAMP).max(speed * speed / (2.0 * OVERRUN_MM));
        let acceleration = self.scale.acceleration(brakes.min(self.axis.max_acceleration));
        [acceleration.min(velocity / 2), velocity]
    }

    /// Moves by so many mm, or until something is sensed. Relative: never farther.
    fn go<P: LinkPort>(
        &self,
        talk: &mut Talk<P>,
        mm: f64,
        stop: StopOn,
        around: &Homing<'_>,
    ) -> Result<(), HomeError> {
        self.is_up_since(talk, around.canary)?;
        let [acceleration, velocity] = self.pace();
        write(talk, self.unit, Request::ClearInternalStatus)?;
        self.forget(talk)?;
        let distance = self.scale.whole(mm);
        write_once(talk, self.unit, Request::MoveRelative { distance, acceleration, velocity, stop })
    }

    /// What happened until now is read and cleared, so that the end of the next move shows.
    fn forget<P: LinkPort>(&self, talk: &mut Talk<P>) -> Result<(), HomeError> {
        let mask = Poll(talk.word(self.unit, Request::Poll)?).0;
        write(talk, self.unit, Request::ClearPoll { mask })
    }

    /// True if the switch is on.
    fn is_on<P: LinkPort>(
        &self,
        talk: &mut Talk<P>,
        (input, active_high): (u8, bool),
    ) -> Result<bool, HomeError> {
        let word = match input {
            1..=3 => talk.internal(self.unit)?.0,
            _ => talk.word(self.unit, Request::IoStates)?,
        };
        Ok((word & Io::input_bit(input) != 0) == active_high)
    }

    /// That it stopped for what was looked for, and not since the travel was over.
    fn sensed<P: LinkPort>(&self, talk: &mut Talk<P>, what: &str, travel_mm: f64) -> Result<(), HomeError> {
        let internal = talk.internal(self.unit)?;
        if internal.has(Internal::INPUT_FOUND) || internal.has(Internal::MOVING_ERROR) {
            return Ok(());
        }
        Err(HomeError::NotFound { unit: self.unit, what: what.to_owned(), travel_mm })
    }
}
