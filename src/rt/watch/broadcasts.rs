//! Who takes a broadcast: asked by one, a read that all controllers of a network answer and nobody else. What is broadcast as motion
//! reaches everybody that takes the code, so that without such a look, and once anybody else has answered anything that was sent so,
//! each controller gets its own frames. All are asked again once they are on the cue, and from time to time, in a show and at rest: a
//! permit is as old as its question.

use std::net::SocketAddrV4;
use std::sync::Arc;
use std::time::Duration;

use super::Watch;
use crate::health::{HealthInput, HealthState};
use crate::net::Delivery;
use crate::rt::broadcast::{Broadcast, Broadcasts, Permit};
use crate::state::{PlayMode, State};
use crate::time::MonoTime;
use crate::tracker::Fate;
use crate::wire::{Access, FromController, MAX_LEN, ReadRequest, VibrationPort};

/// PA12 and PA13, by which a controller knows whether a code means it (SMC manual 2.2.1). Nobody here asks for these two alone otherwise.
const PARAMETERS: u16 = 1;
const COLUMN_AND_ROW: u16 = 0x12;
const BOTH: u16 = 2;
/// One look asks so often, so far apart: of somebody else each question or answer may be lost.
const QUESTIONS: u32 = 3;
const APART: Duration = Duration::from_millis(50);
/// How long answers are listened for from the first on: whoever is slow is to be heard as well.
const LISTEN: Duration = Duration::from_millis(300);
/// From one look to the next: of a network that waits for a permit, on the cue, and at rest.
const AGAIN: Duration = Duration::from_secs(1);
const ON_CUE: Duration = Duration::from_secs(4);
const AT_REST: Duration = Duration::from_secs(30);

/// How far the look at one network is.
#[derive(Debug)]
pub(super) struct BroadcastLook {
    /// When the last one ended, or was broken off.
    ended: Option<MonoTime>,
    /// The one that is under way: when it began, and how many questions were due, and have left.
    under_way: Option<(MonoTime, u32, u32)>,
    /// How often each of its lanes has answered, in their order there.
    answers: Vec<u32>,
}

impl BroadcastLook {
    /// One for each network.
    pub(super) fn of(broadcasts: Option<&Arc<Broadcasts>>) -> Vec<Self> {
        let one = |one: &Broadcast| Self { ended: None, under_way: None, answers: vec![0; one.lanes.len()] };
        broadcasts.map_or_else(Vec::new, |all| all.all().iter().map(one).collect())
    }

    /// Ends what is under way. What is still answered then is over before the next one.
    const fn end(&mut self, now: MonoTime) {
        self.under_way = None;
        self.ended = Some(now);
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
        // Preflight counts every datagram, and takes answers for its own.
        let others_ask = self.is_hushed() || self.is_asked_otherwise();
        for (network, one) in broadcasts.all().iter().enumerate() {
            if one.permit().is_final() {
                continue;
            }
            let is_out = |lane: &&usize| {
                let standing = self.stands(**lane);
                !matches!(standing, HealthState::Ok | HealthState::Degraded) || !self.takes_part(**lane)
            };
            let out = one.lanes.iter().find(is_out).copied();
            if let Some(lane) = out {
                one.set(Permit::Out(lane));
            }
            if out.is_some() || others_ask {
                self.looks[network].end(now);
            } else {
                self.look_at(network, one, now);
            }
        }
    }

    fn look_at(&mut self, network: usize, one: &Broadcast, now: MonoTime) {
        let every = match (self.live.state(), one.permit()) {
            (State::Playing(PlayMode::Following), Permit::Given) if !one.is_stale() => ON_CUE,
            (State::Playing(PlayMode::Following), _) | (_, Permit::Unasked | Permit::Out(_)) => AGAIN,
            _ => AT_REST,
        };
        let look = &mut self.looks[network];
        match look.under_way {
            None if look.ended.is_none_or(|ended| now.since(ended) >= every) => {
                look.answers.fill(0);
                look.under_way = Some((now, 0, 0));
            }
            None => return,
            Some((began, _, asked)) if now.since(began) >= LISTEN => {
                look.end(now);
                let silent = one.lanes.iter().zip(&look.answers).find(|(_, answers)| **answers == 0);
                match silent {
                    _ if asked == 0 => {}
                    Some((lane, _)) => one.set(Permit::Silent(*lane)),
                    None => one.give(began),
                }
                return;
            }
            Some(_) => {}
        }
        self.ask_all(network, one, now);
    }

    /// Asks the next question of the look that is under way, if it is due.
    fn ask_all(&mut self, network: usize, one: &Broadcast, now: MonoTime) {
        let Some((began, due, asked)) = &mut self.looks[network].under_way else { return };
        if *due >= QUESTIONS || now.since(*began) < *due * APART {
            return;
        }
        *due += 1;
        let (accept, reply) = (one.code, one.code);
        let read = ReadRequest { channel: PARAMETERS, accept, reply, start: COLUMN_AND_ROW, num: BOTH };
        if let Delivery::Failed(_) = self.sender.send_to_all(network, read.emit(&mut [0; MAX_LEN])) {
            return;
        }
        *asked += 1;
        one.lanes.iter().for_each(|lane| self.judge(HealthInput::OtherSent(*lane, 1)));
    }

    /// Hears a message of a controller that is no reply to a frame; says whether it answers a look.
    pub(in super::super) fn hear_look(&mut self, controller: usize, message: &FromController<'_>) -> bool {
        let Some(broadcasts) = self.live.broadcasts() else { return false };
        if !is_answer(message) || self.is_asked_otherwise() {
            return false;
        }
        if !broadcasts.has(controller) {
            broadcasts.all().iter().for_each(|one| one.set(Permit::Foreign(controller)));
            return true;
        }
        for (one, look) in broadcasts.all().iter().zip(&mut self.looks) {
            let place = one.lanes.iter().position(|lane| *lane == controller);
            let Some((place, (_, _, asked))) = place.zip(look.under_way) else { continue };
            look.answers[place] += 1;
            if look.answers[place] > asked {
                one.set(Permit::Twice(controller));
            }
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
    /// the frames of one, and where one of a network answers twice there may be two.
    pub(super) fn mind_foreign(&self, controller: usize, fate: Fate) {
        let Some(broadcasts) = self.live.broadcasts() else { return };
        let found = match fate {
            _ if !broadcasts.has(controller) => Permit::Foreign(controller),
            Fate::Duplicate => Permit::Twice(controller),
            _ => return,
        };
        let given = broadcasts.all().iter().filter(|one| one.permit() == Permit::Given);
        given.for_each(|one| one.set(found));
    }
}
