//! What any procedure asks of a unit: who it is, and where a motor of it is.

use super::talk::{ANSWER, Talk, TalkFault, waking_baud};
use crate::drive::link::{LinkFault, LinkPort, LinkTalk as _};
use crate::wire::sixpack2::{
    PositionQuery, PositionTold, SixpackOrder, SixpackReply, UnitQuery, UnitTold, action,
};

/// How often a unit is asked at a rate before it counts as silent there.
const TRIES: u32 = 2;

/// Who it is; asking clears its reset flag.
pub(super) const WHO: SixpackOrder = SixpackOrder::AskUnit(UnitQuery { response: ANSWER });

/// Who a unit is, if it is there.
pub(super) fn who<P: LinkPort>(talk: &mut Talk<P>, unit: u8) -> Result<Option<UnitTold>, LinkFault> {
    for _ in 0..TRIES {
        if let Some(told) = who_now(talk, unit)? {
            return Ok(Some(told));
        }
    }
    Ok(None)
}

/// The same, asked once.
pub(super) fn who_now<P: LinkPort>(talk: &mut Talk<P>, unit: u8) -> Result<Option<UnitTold>, LinkFault> {
    match talk.ask(unit, WHO) {
        Ok(SixpackReply::UnitTold(told)) => Ok(Some(told)),
        Err(TalkFault::Link(fault)) => Err(fault),
        Ok(_) | Err(TalkFault::Silent { .. }) => Ok(None),
    }
}

/// True where a motor that does this looks for its zero.
pub(super) const fn searches(does: u8) -> bool {
    matches!(does, action::SEARCH..=action::LAST_SEARCH | action::MECHANICAL)
}

/// Where a motor is.
pub(super) fn position<P: LinkPort>(
    talk: &mut Talk<P>,
    unit: u8,
    motor: u8,
) -> Result<PositionTold, TalkFault> {
    let reply = talk.insist(unit, where_is(motor))?;
    told_place(reply, TalkFault::Silent { unit, baud: talk.baud() })
}

/// Where is it?
pub(super) const fn where_is(motor: u8) -> SixpackOrder {
    SixpackOrder::AskPosition(PositionQuery { motor, response: ANSWER })
}

/// What was answered to that.
pub(super) fn told_place(reply: SixpackReply, other: TalkFault) -> Result<PositionTold, TalkFault> {
    match reply {
        SixpackReply::PositionTold(told) => Ok(told),
        // Cannot be: an answer is one to the question.
        _ => Err(other),
    }
}

/// Does that at the rate with which units wake, and goes back to the link's own, also where the port is gone: it is opened again at that.
pub(super) fn at_waking_rate<P: LinkPort, T>(
    talk: &mut Talk<P>,
    work: impl FnOnce(&mut Talk<P>) -> Result<T, LinkFault>,
) -> Result<T, LinkFault> {
    let set = talk.set_baud(waking_baud());
    let done = set.and_then(|()| work(talk));
    let back = talk.set_baud(talk.own_baud());
    let done = done?;
    back.map(|()| done)
}
