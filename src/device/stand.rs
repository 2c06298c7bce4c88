//! Where seats stand, read so that frames can hold them there and nothing moves: two readings some time apart, and every
//! setting by which a controller would make something else of a position than it says.

use std::time::Duration;

use super::settings::Values;
use super::survey::told;
use super::talk::Link;
use super::{Address, Fault, Patience, Request, RequestOutcome, Talk, reads, refusal};
use crate::config::{Controller, FanOut, Station};
use crate::motion::{PulseRange, Pulses};
use crate::time::Clock;
use crate::wire::{DP_POSITIONS, DeviceError, Dialect, ReplyCode, position};

/// From the first reading of the positions to the second; a seat at 2 mm/s is several hundred pulses farther by then.
const APART: Duration = Duration::from_millis(200);
const PATIENCE: Patience = Patience { timeout: Duration::from_millis(200), tries: 3 };

const AXES: Address = Address::Pa(0x02);
const AUTO_RESET: Address = Address::Pa(0x0d);
const AMPLITUDE: Address = Address::Pa(0x55);
const OFFSET: Address = Address::Pa(0x95);

/// Why a seat is not sent frames that should hold it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum StandError {
    /// It did not tell something that has to be known.
    #[error(transparent)]
    Unread(#[from] Fault),
    /// Something is the matter with it.
    #[error("{}; clear it first", refusal(*code, *error, *dialect))]
    State {
        /// Its reply code.
        code: ReplyCode,
        /// Its error number.
        error: DeviceError,
        /// By which the code is to be read.
        dialect: Dialect,
    },
    /// The seat has axes whose positions no register holds.
    #[error("has {axes} axes, but only axes 1 to {} have registers for their positions", DP_POSITIONS.len())]
    TooManyAxes {
        /// How many.
        axes: usize,
    },
    /// Frames would move other axes than are known.
    #[error(
        "works with {works} axes (PA02), but its seat here has {axes}; give it axes={works}, or that seat type"
    )]
    Axes {
        /// Axes of the controller.
        works: u16,
        /// Axes of the seat type.
        axes: usize,
    },
    /// It would take the positions of other axes.
    #[error("takes axes of frames from {offset} on (PA95), but should from {wanted} on; set PA95 = {wanted}")]
    Offset {
        /// What the controller has.
        offset: u16,
        /// What the configuration means.
        wanted: usize,
    },
    /// It would go to other positions than it is sent.
    #[error("plays positions at {0}0 % (PA55), so it would move; set PA55 = 0")]
    Amplitude(u16),
    /// It would move by itself once the frames end.
    #[error("resets by itself some time after the last frame (PA0d = {0}), so it would move; set PA0d = 0")]
    AutoReset(u16),
    /// Its positions could mean two different places.
    #[error(
        "axis {axis} is at {smc} pulses if this is an smc controller, at {mbox} if it is an mbox one, and nothing \
         tells which; move it elsewhere"
    )]
    WordOrder {
        /// The axis, from 1.
        axis: usize,
        /// By the one order of words.
        smc: i32,
        /// By the other.
        mbox: i32,
    },
    /// It stands where no frame can hold it.
    #[error("axis {axis} is at {pulses} pulses, outside its stroke of {stroke}; check the seat type")]
    PastStroke {
        /// The axis, from 1.
        axis: usize,
        /// Where it stands.
        pulses: i32,
        /// The stroke, pulses.
        stroke: PulseRange,
    },
    /// It does not stand still.
    #[error("axis {axis} moves, from {from} to {to} pulses within {} ms; wait until it is at rest", APART.as_millis())]
    Moves {
        /// The axis, from 1.
        axis: usize,
        /// Where it was.
        from: i32,
        /// Where it was then.
        to: i32,
    },
}

impl StandError {
    /// True if the controller answered, but will not do.
    #[must_use]
    pub(crate) const fn answered(&self) -> bool {
        match self {
            Self::Unread(fault) => fault.refused() || fault.is_foreign(),
            _ => true,
        }
    }
}

/// Asks where the seats of a conversation stand; gives the positions of each one's own axes, first axis first, or why its
/// seat must not be sent frames, in the order of `controllers`. Changes nothing and moves nothing.
///
/// # Panics
/// If `controllers` are fewer than the conversation was opened with.
pub(crate) fn stand<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    controllers: &[Controller<Station>],
) -> Vec<Result<Vec<Pulses>, StandError>> {
    let mut first = ask(talk, controllers, |one| {
        settings(one).into_iter().chain(places(one.seat.axes)).collect::<Vec<_>>()
    });
    let later = talk.now() + APART;
    talk.wait(later, &mut |_, _, _| {});
    let again = ask(talk, controllers, |one| places(one.seat.axes).collect::<Vec<_>>());
    let judged = controllers.iter().zip(first.drain(..).zip(again));
    judged.map(|(controller, (first, again))| judge(controller, &first?, &again?)).collect()
}

/// The parameters that decide what becomes of a position, as far as the controller's manual has them.
fn settings(controller: &Controller<Station>) -> Vec<Address> {
    match controller.connection.dialect {
        Dialect::Smc => vec![AXES, AUTO_RESET, AMPLITUDE, OFFSET],
        Dialect::Mbox => vec![AXES, OFFSET],
    }
}

/// The registers with the positions of the first `axes` axes.
pub(crate) fn places(axes: usize) -> impl Iterator<Item = Address> {
    (0..axes).map_while(words).flatten()
}

/// The two registers of an axis's position, from 0; `None` if it has none.
fn words(axis: usize) -> Option<[Address; 2]> {
    let first = u8::try_from(*DP_POSITIONS.get(axis)?).ok()?;
    Some([Address::Dp(first), Address::Dp(first + 1)])
}

/// What the position registers of the first `axes` axes hold, two words each; `None` if one of them is missing.
#[must_use]
pub(crate) fn position_words_of(values: &Values, axes: usize) -> Option<Vec<[u16; 2]>> {
    let held = |address| values.get(&address).copied();
    (0..axes.min(DP_POSITIONS.len()))
        .map(|axis| {
            let [first, second] = words(axis)?;
            Some([held(first)?, held(second)?])
        })
        .collect()
}

fn ask<L: Link, C: Clock>(
    talk: &mut Talk<L, C>,
    controllers: &[Controller<Station>],
    wanted: impl Fn(&Controller<Station>) -> Vec<Address>,
) -> Vec<Result<Values, StandError>> {
    let mut requests: Vec<(usize, Request)> = Vec::new();
    for (lane, controller) in controllers.iter().enumerate() {
        requests.extend(reads(&wanted(controller)).into_iter().map(|read| (lane, read)));
    }
    let mut found: Vec<Result<Values, StandError>> = vec![Ok(Values::new()); controllers.len()];
    for RequestOutcome { lane, request, result } in talk.ask(requests, PATIENCE) {
        let dialect = controllers[lane].connection.dialect;
        let Ok(values) = &mut found[lane] else { continue };
        match result {
            Ok(answer) if answer.code != ReplyCode::Running => {
                found[lane] = Err(StandError::State { code: answer.code, error: answer.error, dialect });
            }
            Ok(answer) => values.extend(told(&request, &answer)),
            Err(fault) => found[lane] = Err(fault.into()),
        }
    }
    found
}

/// Where the seat stands, of what it told first and then again.
fn judge(
    controller: &Controller<Station>,
    first: &Values,
    again: &Values,
) -> Result<Vec<Pulses>, StandError> {
    let axes = controller.seat.axes;
    if axes > DP_POSITIONS.len() {
        return Err(StandError::TooManyAxes { axes });
    }
    judge_settings(controller, first)?;
    let place = |values: &Values, axis: usize, dialect| {
        let held = |address| values.get(&address).copied().unwrap_or_default();
        position(words(axis).map_or([0; 2], |words| words.map(held)), dialect)
    };
    (0..axes)
        .map(|axis| {
            let stroke = controller.seat.each[axis].pulse_range();
            let inside = |pulses: Pulses| stroke.contains(pulses);
            let [was, is] = [first, again].map(|values| place(values, axis, controller.connection.dialect));
            let [smc, mbox] = [Dialect::Smc, Dialect::Mbox].map(|dialect| place(again, axis, dialect));
            let axis = axis + 1;
            if was.0.abs_diff(is.0) > 1 {
                return Err(StandError::Moves { axis, from: was.0, to: is.0 });
            }
            if !inside(is) {
                return Err(StandError::PastStroke { axis, pulses: is.0, stroke });
            }
            if inside(smc) && inside(mbox) && smc.0.abs_diff(mbox.0) > 1 {
                return Err(StandError::WordOrder { axis, smc: smc.0, mbox: mbox.0 });
            }
            Ok(is)
        })
        .collect()
}

fn judge_settings(controller: &Controller<Station>, values: &Values) -> Result<(), StandError> {
    let of = |address| values.get(&address).copied();
    let axes = controller.seat.axes;
    if let Some(works) = of(AXES).filter(|works| usize::from(*works) != axes) {
        return Err(StandError::Axes { works, axes });
    }
    let wanted = match controller.connection.fan_out {
        FanOut::Slice => 0,
        FanOut::Shared => controller.axis_offset,
    };
    if let Some(offset) = of(OFFSET).filter(|offset| usize::from(*offset) != wanted) {
        return Err(StandError::Offset { offset, wanted });
    }
    if let Some(tenths) = of(AMPLITUDE).filter(|tenths| *tenths != 0) {
        return Err(StandError::Amplitude(tenths));
    }
    match of(AUTO_RESET).filter(|after| *after != 0) {
        Some(after) => Err(StandError::AutoReset(after)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
