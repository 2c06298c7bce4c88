//! Who takes a broadcast: asked by one, a read that all controllers of a network answer and nobody else. What is broadcast as motion
//! reaches everybody that takes the code, so that without such a look, and once anybody else has answered anything that was sent so,
//! each controller gets its own frames.

use std::net::SocketAddrV4;
use std::sync::Arc;
use std::time::Duration;

use super::Watch;
use crate::health::{HealthInput, HealthState};
use crate::net::Delivery;
use crate::rt::broadcast::{Broadcast, Broadcasts, Permit};
use crate::time::MonoTime;
use crate::wire::{Access, FromController, MAX_LEN, ReadRequest, VibrationPort};

/// PA12 and PA13, by which a controller knows whether a code means it (SMC manual 2.2.1). Nobody here asks for these two alone otherwise.
const PARAMETERS: u16 = 1;
const COLUMN_AND_ROW: u16 = 0x12;
const BOTH: u16 = 2;
/// How long answers are listened for: whoever is slow is to be heard as well.
const LISTEN: Duration = Duration::from_millis(500);
/// After how long a network is asked again of which one did not answer.
const AGAIN: Duration = Duration::from_secs(2);

/// How far a look at one network is.
#[derive(Debug)]
pub(super) struct BroadcastLook {
    state: LookState,
    /// Which of its lanes have answered, in their order there.
    answered: Vec<bool>,
}

#[derive(Debug, Clone, Copy)]
enum LookState {
    /// To be asked, not before then.
    Due(MonoTime),
    /// Asked then.
    Asked(MonoTime),
    /// All have answered, and nobody else.
    Passed,
}

impl BroadcastLook {
    /// One for each network.
    pub(super) fn of(broadcasts: Option<&Arc<Broadcasts>>) -> Vec<Self> {
        let one = |one: &Broadcast| Self {
            state: LookState::Due(MonoTime::default()),
            answered: vec![false; one.lanes.len()],
        };
        broadcasts.map_or_else(Vec::new, |all| all.all().iter().map(one).collect())
    }
}

/// Whether that is an answer to such a read.
fn is_answer(message: &FromController<'_>) -> bool {
    matches!(message, FromController::Registers(reply)
        if reply.access == Access::Read && reply.start == COLUMN_AND_ROW && reply.num == BOTH)
}

impl Watch {
    /// Looks who takes broadcasts, and takes the permit back where a controller does not take part.
    pub(super) fn mind_broadcasts(&mut self, now: MonoTime) {
        let Some(broadcasts) = self.live.broadcasts().cloned() else { return };
        for (network, one) in broadcasts.all().iter().enumerate() {
            if one.permit().is_final() {
                continue;
            }
            let is_out = |lane: &&usize| {
                let standing = self.stands(**lane);
                !matches!(standing, HealthState::Ok | HealthState::Degraded) || !self.takes_part(**lane)
            };
            if let Some(lane) = one.lanes.iter().find(is_out) {
                one.set(Permit::Out(*lane));
                self.looks[network].state = LookState::Due(now);
                continue;
            }
            self.look_at(network, one, now);
        }
    }

    fn look_at(&mut self, network: usize, one: &Broadcast, now: MonoTime) {
        // Preflight counts every datagram, and takes answers for its own.
        let others_ask = self.is_hushed() || self.is_asked_otherwise();
        match self.looks[network].state {
            LookState::Asked(_) if others_ask => self.looks[network].state = LookState::Due(now),
            LookState::Due(at) if now >= at && !others_ask => self.ask_all(network, one, now),
            LookState::Asked(since) if now.since(since) >= LISTEN => {
                let BroadcastLook { state, answered } = &mut self.looks[network];
                let silent = one.lanes.iter().zip(answered.iter()).find(|(_, answered)| !**answered);
                if let Some((lane, _)) = silent {
                    one.set(Permit::Silent(*lane));
                    *state = LookState::Due(now + AGAIN);
                } else {
                    one.set(Permit::Given);
                    *state = LookState::Passed;
                }
            }
            LookState::Due(_) | LookState::Asked(_) | LookState::Passed => {}
        }
    }

    fn ask_all(&mut self, network: usize, one: &Broadcast, now: MonoTime) {
        let (accept, reply) = (one.code, one.code);
        let read = ReadRequest { channel: PARAMETERS, accept, reply, start: COLUMN_AND_ROW, num: BOTH };
        let delivery = self.sender.send_to_all(network, read.emit(&mut [0; MAX_LEN]));
        let look = &mut self.looks[network];
        look.answered.fill(false);
        if let Delivery::Failed(_) = delivery {
            look.state = LookState::Due(now + AGAIN);
            return;
        }
        look.state = LookState::Asked(now);
        // One that sees its first again keeps what was said of it meanwhile.
        if one.permit() != Permit::Given && !matches!(one.permit(), Permit::Silent(_)) {
            one.set(Permit::Unasked);
        }
        one.lanes.iter().for_each(|lane| self.judge(HealthInput::OtherSent(*lane, 1)));
    }

    /// Hears a message of a controller that is no reply to a frame; says whether it answers a look.
    pub(in super::super) fn hear_look(&mut self, controller: usize, message: &FromController<'_>) -> bool {
        let Some(broadcasts) = self.live.broadcasts() else { return false };
        if !is_answer(message) || self.is_asked_otherwise() {
            return false;
        }
        let mut is_member = false;
        for (one, look) in broadcasts.all().iter().zip(&mut self.looks) {
            if let Some(place) = one.lanes.iter().position(|lane| *lane == controller) {
                is_member = true;
                look.answered[place] = true;
            }
        }
        if !is_member {
            broadcasts.all().iter().for_each(|one| one.set(Permit::Foreign(controller)));
        }
        true
    }

    /// Hears what somebody sent who is no controller of the hall: whoever answers frames, or a look, takes what is broadcast.
    pub(in super::super) fn hear_stranger(&self, from: SocketAddrV4, octets: &[u8]) {
        let Some(broadcasts) = self.live.broadcasts() else { return };
        let message = FromController::parse(VibrationPort::Two, octets);
        if matches!(message, FromController::Reply(_)) || is_answer(&message) {
            broadcasts.all().iter().for_each(|one| one.set(Permit::Stranger(from)));
        }
    }

    /// A controller answered a frame that it was not sent, or one frame twice: one that is in no network of broadcasts may have taken
    /// the frames of one.
    pub(super) fn mind_foreign(&self, controller: usize) {
        let Some(broadcasts) = self.live.broadcasts().filter(|all| !all.has(controller)) else { return };
        let given = broadcasts.all().iter().filter(|one| one.permit() == Permit::Given);
        given.for_each(|one| one.set(Permit::Foreign(controller)));
    }
}
