//! Requests to many controllers side by side, one at a time to each; replies matched to them. Told the time; touches
//! neither socket nor clock.
//!
//! Register messages carry no number, so a reply is known by function, channel, first register and count alone. That is
//! why each controller has one request under way, and why a request that was sent again is not followed by one of the same
//! register before a late answer to its first sending could have come: a stale value must never pass for a new one.

use std::collections::VecDeque;
use std::time::Duration;

use super::request::RequestId;
use super::{Fault, Odd, Request};
use crate::net::SendFault;
use crate::time::MonoTime;
use crate::wire::{
    Access, Code, DeviceError, Dialect, MAX_LEN, Message, RegisterReply, ReplyCode, ServoReply, WireError,
    Words, is_printed_imax,
};

/// How late an answer may be. The protocol says nothing; the books of a show call an ack lost after the same time.
const LATEST: Duration = Duration::from_secs(1);
/// Bytes of a register message before its words.
const HEAD_LEN: usize = 16;

/// How a controller is spoken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Endpoint {
    /// The message set it speaks.
    pub(crate) dialect: Dialect,
    /// The accept and reply code of what it is sent.
    pub(crate) code: Code,
}

/// How long to wait for an answer, and how often to ask for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// For each try.
    pub(crate) timeout: Duration,
    /// At least 1.
    pub(crate) tries: u32,
}

impl Default for Patience {
    /// 3 tries of 300 ms: a dead controller is known after 0.9 s.
    fn default() -> Self {
        Self { timeout: Duration::from_millis(300), tries: 3 }
    }
}

/// What a controller answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RegisterAnswer {
    /// The registers that were asked for, in order; what was written, echoed.
    pub(crate) words: Vec<u16>,
    /// How the controller is. An SMC controller answers in every state, and a reply with x = 3 or 4 tells of that state,
    /// not of the request.
    pub(crate) code: ReplyCode,
    /// Its error number; 0 for none.
    pub(crate) error: DeviceError,
    /// From the last sending to the answer.
    pub(crate) took: Duration,
    /// How often it was sent.
    pub(crate) tries: u32,
}

/// What became of a request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RequestOutcome {
    /// Whose it was.
    pub lane: usize,
    /// What was asked.
    pub(crate) request: Request,
    /// What came of it.
    pub result: Result<RegisterAnswer, Fault>,
}

/// What came from a controller's address and was no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Odds {
    /// No message, or a reply longer or shorter than its count.
    pub(crate) malformed: u64,
    /// Replies to what was never asked.
    pub(crate) foreign: u64,
    /// Replies to what had been given up or asked again.
    pub(crate) late: u64,
    /// Further replies to what had been answered: a repeating network, or a second controller of this address.
    pub(crate) duplicate: u64,
}

/// What is under way with every controller.
#[derive(Debug)]
pub(crate) struct Exchange {
    lanes: Vec<Lane>,
    patience: Patience,
    outcomes: Vec<Option<RequestOutcome>>,
    buf: Box<[u8; MAX_LEN]>,
}

#[derive(Debug)]
struct Lane {
    peer: Endpoint,
    queue: VecDeque<(usize, Request)>,
    flight: Option<Flight>,
    /// What may still be answered, though nobody waits for it.
    owed: Vec<Owed>,
    answered: Option<RequestId>,
    odds: Odds,
}

/// The request that an answer is waited for.
#[derive(Debug)]
struct Flight {
    index: usize,
    request: Request,
    id: RequestId,
    tries: u32,
    sent: MonoTime,
    odd: Option<Odd>,
}

#[derive(Debug)]
struct Owed {
    id: RequestId,
    answers: u32,
    until: MonoTime,
}

impl Exchange {
    /// Nothing under way with any of `peers`.
    #[must_use]
    pub(crate) fn new(peers: &[Endpoint]) -> Self {
        let lane = |&peer: &Endpoint| Lane {
            peer,
            queue: VecDeque::new(),
            flight: None,
            owed: Vec::new(),
            answered: None,
            odds: Odds::default(),
        };
        Self {
            lanes: peers.iter().map(lane).collect(),
            patience: Patience::default(),
            outcomes: Vec::new(),
            buf: Box::new([0; MAX_LEN]),
        }
    }

    /// How many controllers there are.
    #[must_use]
    pub(crate) const fn lanes(&self) -> usize {
        self.lanes.len()
    }

    /// Begins to ask; each controller's requests in the order given here. What was under way is dropped.
    ///
    /// # Panics
    /// If a request is for a lane that there is not.
    pub(crate) fn begin(&mut self, requests: Vec<(usize, Request)>, patience: Patience) {
        self.patience = patience;
        self.outcomes = requests.iter().map(|_| None).collect();
        for lane in &mut self.lanes {
            lane.queue.clear();
            lane.flight = None;
        }
        for (index, (lane, request)) in requests.into_iter().enumerate() {
            self.lanes[lane].queue.push_back((index, request));
        }
    }

    /// What has to be sent to a controller now; to be called until it returns none.
    pub(crate) fn due(&mut self, lane: usize, at: MonoTime) -> Option<&[u8]> {
        let one = &mut self.lanes[lane];
        one.owed.retain(|owed| owed.until > at);
        if one.flight.as_ref().is_some_and(|flight| at < flight.sent + self.patience.timeout) {
            return None;
        }
        if one.flight.as_ref().is_some_and(|flight| flight.tries >= flight.request.tries(self.patience.tries))
        {
            self.give_up(lane);
        }
        let one = &mut self.lanes[lane];
        if one.flight.is_none() {
            let (index, request) = self.next(lane)?;
            let one = &mut self.lanes[lane];
            let id = request.id(one.peer.dialect)?;
            if one.owed.iter().any(|owed| owed.id.confusable(id)) {
                one.queue.push_front((index, request));
                return None;
            }
            one.flight = Some(Flight { index, request, id, tries: 0, sent: at, odd: None });
        }
        let Lane { flight, peer, .. } = &mut self.lanes[lane];
        let flight = flight.as_mut()?;
        flight.tries += 1;
        flight.sent = at;
        Some(flight.request.emit(flight.id, peer, &mut self.buf))
    }

    /// The next request that can be put into a message; those that cannot are refused here.
    fn next(&mut self, lane: usize) -> Option<(usize, Request)> {
        let one = &mut self.lanes[lane];
        while let Some((index, request)) = one.queue.pop_front() {
            if request.id(one.peer.dialect).is_some() {
                return Some((index, request));
            }
            let result = Err(Fault::NoWay { request: request.clone() });
            self.outcomes[index] = Some(RequestOutcome { lane, request, result });
        }
        None
    }

    /// Ends a request without an answer, and with it all that wait behind: whoever does not answer one will not answer
    /// the others, and nobody should wait for each.
    fn give_up(&mut self, lane: usize) {
        let Patience { timeout, .. } = self.patience;
        let one = &mut self.lanes[lane];
        let Some(Flight { index, request, id, tries, sent, odd }) = one.flight.take() else { return };
        one.owed.push(Owed { id, answers: tries, until: sent + LATEST });
        let result = Err(Fault::Silent { request: request.clone(), tries, timeout, odd });
        self.outcomes[index] = Some(RequestOutcome { lane, request, result });
        self.drop_queue(lane);
    }

    fn drop_queue(&mut self, lane: usize) {
        for (index, request) in self.lanes[lane].queue.drain(..) {
            let result = Err(Fault::Unasked { request: request.clone() });
            self.outcomes[index] = Some(RequestOutcome { lane, request, result });
        }
    }

    /// Ends all that is asked of a controller whose answers nobody can read: it would answer nothing else.
    fn on_foreign(&mut self, lane: usize) {
        self.lanes[lane].odds.malformed += 1;
        let Some(Flight { index, request, .. }) = self.lanes[lane].flight.take() else { return };
        let result = Err(Fault::Foreign { request: request.clone() });
        self.outcomes[index] = Some(RequestOutcome { lane, request, result });
        self.drop_queue(lane);
    }

    /// Notes that the kernel did not take what was due.
    pub(crate) fn on_unsent(&mut self, lane: usize, fault: SendFault) {
        self.note(lane, Odd::Unsent(fault));
    }

    /// Notes that the kernel reported a closed port.
    pub(crate) fn on_closed(&mut self, lane: usize) {
        self.note(lane, Odd::Closed);
    }

    fn note(&mut self, lane: usize, odd: Odd) {
        if let Some(flight) = self.lanes[lane].flight.as_mut() {
            flight.odd = Some(odd);
        }
    }

    /// Takes a datagram from a controller's address; says whether it was about registers or broken, and so is done
    /// with. Motion replies and reports are left to others.
    pub(crate) fn on_datagram(&mut self, lane: usize, bytes: &[u8], at: MonoTime) -> bool {
        match Reply::parse(bytes) {
            Ok(Some(reply)) => self.on_reply(lane, &reply, at),
            Ok(None) => return false,
            Err(_) if is_printed_imax(bytes) => self.on_foreign(lane),
            Err(error) => {
                self.lanes[lane].odds.malformed += 1;
                self.note(lane, Odd::Malformed(error));
            }
        }
        true
    }

    fn on_reply(&mut self, lane: usize, reply: &Reply<'_>, at: MonoTime) {
        let one = &mut self.lanes[lane];
        let dialect = one.peer.dialect;
        if let Some(flight) = one.flight.take_if(|flight| reply.answers(flight.id, dialect)) {
            let Flight { index, request, id, tries, sent, .. } = flight;
            if tries > 1 {
                one.owed.push(Owed { id, answers: tries - 1, until: sent + LATEST });
            }
            one.answered = Some(id);
            let result = reply.result(&request, dialect, at.since(sent), tries);
            self.outcomes[index] = Some(RequestOutcome { lane, request, result });
        } else if let Some(owed) = one.owed.iter_mut().find(|owed| reply.answers(owed.id, dialect)) {
            owed.answers -= 1;
            one.owed.retain(|owed| owed.answers > 0);
            one.odds.late += 1;
        } else if one.answered.is_some_and(|id| reply.answers(id, dialect)) {
            one.odds.duplicate += 1;
        } else {
            one.odds.foreign += 1;
            self.note(lane, Odd::Foreign { start: reply.start, num: reply.num });
        }
    }

    /// When something may next be due, if nothing comes before; none when all is done.
    #[must_use]
    pub(crate) fn wake(&self) -> Option<MonoTime> {
        self.lanes.iter().filter_map(|lane| lane.wake(self.patience.timeout)).min()
    }

    /// True if every request has its outcome.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn finished(&self) -> bool {
        self.lanes.iter().all(|lane| lane.flight.is_none() && lane.queue.is_empty())
    }

    /// The outcomes of a finished exchange, in the order of the requests.
    pub(crate) fn take(&mut self) -> Vec<RequestOutcome> {
        self.outcomes.drain(..).flatten().collect()
    }

    /// What came from a controller's address and was no answer, since the beginning.
    #[must_use]
    pub(crate) fn odds(&self, lane: usize) -> Odds {
        self.lanes[lane].odds
    }
}

impl Lane {
    fn wake(&self, timeout: Duration) -> Option<MonoTime> {
        if let Some(flight) = &self.flight {
            return Some(flight.sent + timeout);
        }
        let (_, request) = self.queue.front()?;
        // One that no message says is refused at once.
        let Some(id) = request.id(self.peer.dialect) else { return Some(MonoTime::default()) };
        let owed = self.owed.iter().filter(|owed| owed.id.confusable(id)).map(|owed| owed.until).max();
        Some(owed.unwrap_or_default())
    }
}

/// A reply about registers of a controller or of a drive.
#[derive(Debug)]
struct Reply<'a> {
    servo: bool,
    access: Access,
    code: ReplyCode,
    /// Slot 6: the channel or drive of a reply with x = 2; else the error number, or what an MBOX controller leaves there.
    slot: u16,
    start: u16,
    num: u16,
    words: Words<'a>,
}

impl<'a> Reply<'a> {
    /// `None` if it is a whole message, but no reply about registers.
    fn parse(bytes: &'a [u8]) -> Result<Option<Self>, WireError> {
        let reply = match Message::parse(bytes)? {
            Message::RegisterReply(RegisterReply { access, code, channel, error, start, num, data }) => {
                Self { servo: false, access, code, slot: channel | error, start, num, words: data }
            }
            Message::ServoReply(ServoReply { access, code, servo, error, start, num, data }) => {
                Self { servo: true, access, code, slot: servo | error, start, num, words: data }
            }
            _ => return Ok(None),
        };
        // A refusal may bring an error number in place of its words.
        let words = if reply.code.refused() { reply.num.max(1) } else { reply.num };
        let (len, need) = (bytes.len(), HEAD_LEN + 2 * usize::from(words));
        if len > need { Err(WireError::Surplus { len, need }) } else { Ok(Some(reply)) }
    }

    fn answers(&self, id: RequestId, dialect: Dialect) -> bool {
        let slot_tells = !self.code.refused() || (dialect == Dialect::Mbox && !self.servo);
        let counts = self.num == id.num || (self.code.refused() && self.num == 0);
        self.servo == id.servo
            && self.access == id.access
            && self.start == id.start
            && counts
            && (!slot_tells || self.slot == id.channel)
    }

    fn result(
        &self,
        request: &Request,
        dialect: Dialect,
        took: Duration,
        tries: u32,
    ) -> Result<RegisterAnswer, Fault> {
        let words: Vec<u16> = self.words.iter().collect();
        let error = match dialect {
            _ if !self.code.refused() => DeviceError(0),
            Dialect::Smc => DeviceError(self.slot),
            Dialect::Mbox => DeviceError(words.first().copied().unwrap_or(0)),
        };
        // x = 3 and 4 of an SMC controller tell how it is. A read has then succeeded if the words are there; a write is
        // proved by reading back.
        let tells_state = matches!(self.code, ReplyCode::Fault | ReplyCode::EmergencyStop);
        let whole = self.access == Access::Write || words.len() == usize::from(self.num);
        let done = !self.code.refused() || (dialect == Dialect::Smc && tells_state && whole && self.num > 0);
        if done {
            Ok(RegisterAnswer { words, code: self.code, error, took, tries })
        } else {
            Err(Fault::Refused { request: request.clone(), code: self.code, error, dialect })
        }
    }
}

#[cfg(test)]
mod tests;
