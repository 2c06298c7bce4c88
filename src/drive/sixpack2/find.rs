//! Units are found at the rate of their link, or at that with which they wake, and then talk at that of the link. A unit that was
//! restarted is back at 19,200 baud: silence at the rate of the link does not mean that nobody is there.

use std::time::Duration;

use super::ask::{at_waking_rate, who};
use super::talk::{Talk, TalkFault};
use crate::drive::link::{LinkFault, LinkPort};
use crate::wire::sixpack2::UnitTold;

/// How often all that are silent are looked for at either rate.
const ROUNDS: u32 = 3;
/// What a unit is given to change its rate.
const CHANGE: Duration = Duration::from_millis(20);

/// Why a unit is not to be talked to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum FindError {
    /// The port.
    #[error(transparent)]
    Link(#[from] LinkFault),
    /// It does not answer at the only rate that there is.
    #[error(transparent)]
    Silent(TalkFault),
    /// It answers at neither rate.
    #[error(
        "unit {unit} answers neither at {baud} nor at {waking} baud, its power-on rate; check its number, that no other has it, its power \
         and the wiring, and whether another program has changed its rate"
    )]
    Nowhere {
        /// Who was asked.
        unit: u8,
        /// The rate of the link.
        baud: u32,
        /// The other.
        waking: u32,
    },
    /// It answers as it woke, and not after it was switched.
    #[error(
        "unit {unit} answers at {waking} baud, its power-on rate, but not at {baud}, to which it was switched; set a lower baud, or \
         shorten the line"
    )]
    Stays {
        /// Who was asked.
        unit: u8,
        /// The rate of the link.
        baud: u32,
        /// The other.
        waking: u32,
    },
}

/// Finds units of a line, and has all of them talk at its rate; with what each said of itself first, so that its reset flag is
/// not lost. In the order of `units`.
///
/// # Errors
/// A [`FindError`] of the first that cannot be had; the line is back at its own rate.
pub(crate) fn find<P: LinkPort>(talk: &mut Talk<P>, units: &[u8]) -> Result<Vec<UnitTold>, FindError> {
    let (baud, other) = (talk.own_baud(), talk.other_baud());
    let mut first: Vec<Option<UnitTold>> = vec![None; units.len()];
    let mut missing: Vec<usize> = (0..units.len()).collect();
    for _ in 0..ROUNDS {
        ask_each(talk, units, &mut missing, &mut first)?;
        if missing.is_empty() {
            return Ok(first.into_iter().flatten().collect());
        }
        if other.is_some() {
            at_waking_rate(talk, |talk| wake(talk, units, &missing, &mut first, baud))?;
        }
    }
    let (unit, is_awake) = (units[missing[0]], first[missing[0]].is_some());
    Err(match other {
        Some(waking) if is_awake => FindError::Stays { unit, baud, waking },
        Some(waking) => FindError::Nowhere { unit, baud, waking },
        None => FindError::Silent(TalkFault::Silent { unit, baud }),
    })
}

/// Asks those that are missing; those that answer are not any more.
fn ask_each<P: LinkPort>(
    talk: &mut Talk<P>,
    units: &[u8],
    missing: &mut Vec<usize>,
    first: &mut [Option<UnitTold>],
) -> Result<(), LinkFault> {
    let mut silent = Vec::new();
    for &index in &*missing {
        match who(talk, units[index])? {
            Some(told) => {
                first[index].get_or_insert(told);
            }
            None => silent.push(index),
        }
    }
    *missing = silent;
    Ok(())
}

/// Those that answer at the rate with which they wake are switched, all of them last: one that is switched already takes what is said at
/// this rate for anything.
fn wake<P: LinkPort>(
    talk: &mut Talk<P>,
    units: &[u8],
    missing: &[usize],
    first: &mut [Option<UnitTold>],
    baud: u32,
) -> Result<(), LinkFault> {
    let mut asleep = missing.to_vec();
    ask_each(talk, units, &mut asleep, first)?;
    for index in missing.iter().filter(|index| !asleep.contains(index)) {
        talk.switch(units[*index], baud)?;
    }
    talk.pause(CHANGE);
    Ok(())
}
