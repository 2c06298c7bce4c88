//! Two show machines of one hall, one of which leads: who may send to the controllers, and until when. Pure, and told the time; who
//! carries its messages is `app::pair`, and who keeps what is sent to it is `net::Lead`.
//!
//! A machine leads for as long as it was promised, by the later of two promises, each counted from when the request for it *left*, on its
//! own clock:
//!
//! - the **lease**, a key of the engine that it renews by compare-and-swap: whoever wants it has to see it unchanged for [`UNCHANGED`];
//! - the **word** of the other machine, which answers a heartbeat by "I shall not lead": it keeps that for [`KEPT`] from when it says so.
//!
//! Either is enough, so that the show goes on while the engine is away, or the other machine. What either is worth ends [`PROMISED`] after
//! the request, 200 ms sooner than whoever gave it counts: so long a thread may be held up between its look at the time and the frame that
//! it sends then. Clocks that differ by a thousandth take 1.2 ms of that.

mod claim;
mod mac;
mod message;

#[cfg(test)]
mod tests;

pub(crate) use claim::{Answer, Answered, Ask, Beat, Claim, Holder, PairMisfit, Role, Want};
pub(crate) use mac::PairKey;
pub(crate) use message::{Carried, LONGEST, Message};

use std::time::Duration;

/// How long a promise is worth something to whoever asked for it, from when the request left.
pub(crate) const PROMISED: Duration = Duration::from_secs(1);
/// How long whoever gives its word keeps it, from when it does.
const KEPT: Duration = Duration::from_millis(1_200);
/// How long a key has to be seen unchanged before another machine may take it.
const UNCHANGED: Duration = Duration::from_millis(1_200);
/// From one heartbeat to the next.
pub(crate) const BEAT: Duration = Duration::from_millis(20);
/// From one request to the engine to the next.
pub(crate) const RENEW: Duration = Duration::from_millis(100);
/// How old the newest look at the key may be, from when it was asked for, where the key is taken by it.
const FRESH: Duration = Duration::from_millis(300);
/// A key that was written fewer times is not taken: where the engine has lost its memory, and counts anew, what was written to the key that
/// is gone may bear the same number as what the leader writes now. It writes each [`RENEW`], so that it comes to this number 1.4 s after
/// it has made the key anew; whoever looked before that has [`FRESH`] to ask, and [`PROMISED`] to use what it is granted: 1.3 s.
const LEAST_REVISION: u64 = 15;
/// So long after a person has said that the other machine is off this one may make the key.
const ALONE: Duration = Duration::from_secs(10);
/// After so long without a heartbeat the other machine counts as away.
pub(crate) const AWAY: Duration = Duration::from_millis(600);
