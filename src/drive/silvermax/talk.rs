//! One exchange at a time: a request, and the answer of the unit that was asked.
//!
//! No line carries a sum, and an ack does not say what it is for. So an answer counts only from the unit asked, while it is
//! waited for; where it does not come, what was asked is in doubt, and nothing else is asked of the unit before
//! [`Talk::fence`]: a unit answers in turn, so what comes before the answer to a read belongs to what was asked before.

use std::time::Duration;

use crate::drive::link::{LinkFault, LinkPort, LinkTalk, MOST_STRAY, Moment, TalkState, TalkTerms};
use crate::time::MonoTime;
use crate::wire::silvermax::{
    ALL_UNITS, AnyRequest, Collected, Internal, LineCollector, MAX_LINE, NakReason, Reply, Request, Words,
};

/// What the unit makes of a request, beyond its octets and its delay.
const SLACK: Duration = Duration::from_millis(4);
/// Octets of the longest answer, that to a read of the revision apart.
const ANSWER: u32 = 24;
/// Octets of a refusal, the longest answer to a segment: what is in doubt has to be found out soon.
const REFUSAL: u32 = 15;
/// How often what does no harm twice is asked.
const TRIES: u32 = 4;

/// The register of the internal status word.
pub(super) const INTERNAL: u8 = 3;

/// What stands in that register, above the state of the drive.
pub(super) fn internal_word(register: i32) -> Internal {
    Internal(u16::try_from(register.cast_unsigned() >> 16).unwrap_or_default())
}

/// What a unit answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Taken.
    Ack,
    /// What was asked for.
    Data(Words),
    /// Not taken.
    Nak(NakReason),
}

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum TalkFault {
    /// The port.
    #[error(transparent)]
    Link(#[from] LinkFault),
    /// Nothing that can be read came in time: whether it was taken is not known.
    #[error(
        "unit {unit} does not answer; check its number (decimal here, hexadecimal in its answers), that no other has it, baud and wiring"
    )]
    Silent {
        /// Who was asked.
        unit: u8,
    },
    /// Somebody else answered: which of the two has taken it is not known.
    #[error("unit {by} answered a request to unit {unit}; is the line bad, or do two units share a number?")]
    Foreign {
        /// Who was asked.
        unit: u8,
        /// Who answered.
        by: u8,
    },
}

/// A conversation with the units of a line.
#[derive(Debug)]
pub(crate) struct Talk<P> {
    state: TalkState<P>,
}

impl<P: LinkPort> LinkTalk for Talk<P> {
    type Port = P;

    fn state(&self) -> &TalkState<P> {
        &self.state
    }

    fn state_mut(&mut self) -> &mut TalkState<P> {
        &mut self.state
    }

    fn count_unasked(&mut self) {
        let (came, mut collector) = (self.take_unasked(), LineCollector::of_replies());
        let counts = &mut self.state.counts;
        for octet in came {
            match collector.push(octet) {
                Some(Collected::Line(line)) if Reply::parse(line).is_ok() => counts.doubled += 1,
                Some(_) => counts.malformed += 1,
                None => {}
            }
        }
        counts.malformed += u64::from(!collector.rest().is_empty());
    }
}

impl<P: LinkPort> Talk<P> {
    /// Over a port that is open.
    pub(crate) fn new(port: P, terms: TalkTerms) -> Self {
        Self { state: TalkState::over(port, terms) }
    }

    /// Tells all units something; none answers.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    pub(crate) fn tell_all(&mut self, request: Request) -> Result<(), LinkFault> {
        let octets = self.send(ALL_UNITS, request)?;
        let sent = self.now() + octets;
        self.state.port.sleep_until(sent);
        if self.state.terms.has_echo {
            self.state.port.flush();
        }
        Ok(())
    }

    /// Asks a unit, once.
    ///
    /// # Errors
    /// A [`TalkFault`]; [`Talk::fence`] has to follow where that is not the port.
    pub(crate) fn exchange(&mut self, unit: u8, request: Request) -> Result<Answer, TalkFault> {
        self.count_unasked();
        let sending = self.send(unit, request)?;
        self.state.counts.asked += 1;
        let sent = self.now() + sending;
        let octets = if matches!(request, Request::ImmediateSegment { .. }) { REFUSAL } else { ANSWER };
        let deadline = sent + self.octets(octets) + 2 * self.state.delays.p99() + SLACK;
        let command = u16::from(request.number());
        let fits = |reply: &Reply| reply.command().is_none_or(|told| told == command);
        match self.answer(sent, deadline)? {
            Some(reply) if reply.unit() == unit && fits(&reply) => {
                self.state.counts.answered += 1;
                Ok(Answer::of(reply))
            }
            Some(reply) => {
                self.state.counts.foreign += 1;
                // Of the right unit, and to another command: late, and no answer to this.
                Err(match reply.unit() {
                    by if by == unit => TalkFault::Silent { unit },
                    by => TalkFault::Foreign { unit, by },
                })
            }
            None => Err(TalkFault::Silent { unit }),
        }
    }

    /// Waits for what may still come of a request in doubt, by reading the revision behind it. Gives the answer to the request
    /// if that came late.
    ///
    /// Of all that is answered by data this is the read that nothing else asks for, and that an octet which is lost makes no
    /// other command of: of RIS and RIO, 20 and 21, it makes a HLT, 2, which drops what the motor holds.
    ///
    /// # Errors
    /// A [`TalkFault`] where no read is answered.
    pub(crate) fn fence(&mut self, unit: u8, doubtful: Request) -> Result<Option<Answer>, TalkFault> {
        let (number, fence) = (u16::from(doubtful.number()), u16::from(Request::Revision.number()));
        let (mut late, mut waited) = (None, 0);
        for open in 1..=2 {
            let sending = self.send(unit, Request::Revision)?;
            self.state.counts.asked += 1;
            let sent = self.now() + sending;
            let deadline = sent + self.octets(2 * ANSWER) + 2 * self.state.delays.p99() + SLACK;
            // The answers to all reads that were sent, so that none is left over.
            while waited < open
                && let Some(reply) = self.answer(sent, deadline)?
            {
                if reply.unit() != unit {
                    self.state.counts.foreign += 1;
                } else if reply.command() == Some(fence) {
                    waited += 1;
                } else {
                    self.state.counts.late += 1;
                    let is_of_it = reply.command().is_none_or(|command| command == number);
                    late = late.or(is_of_it.then(|| Answer::of(reply)));
                }
            }
            if waited > 0 {
                self.state.counts.answered += 1;
                return Ok(late);
            }
        }
        Err(TalkFault::Silent { unit })
    }

    /// Asks for what does no harm if it is done twice, a few times if need be.
    ///
    /// # Errors
    /// The last [`TalkFault`].
    pub(crate) fn insist(&mut self, unit: u8, request: Request) -> Result<Answer, TalkFault> {
        let mut last = self.exchange(unit, request);
        for _ in 1..TRIES {
            match last {
                Ok(_) | Err(TalkFault::Link(_)) => break,
                Err(_) => {}
            }
            last = match self.fence(unit, request)? {
                Some(answer) => Ok(answer),
                None => self.exchange(unit, request),
            };
        }
        last
    }

    /// A register.
    ///
    /// # Errors
    /// A [`TalkFault`]; an answer that is no value counts as none.
    pub(crate) fn register(&mut self, unit: u8, register: u8) -> Result<i32, TalkFault> {
        match self.insist(unit, Request::ReadRegister { register })? {
            Answer::Data(words) => words.value().ok_or(TalkFault::Silent { unit }),
            _ => Err(TalkFault::Silent { unit }),
        }
    }

    /// The internal status word, by the register that holds it (3): RIS is what an octet that is lost makes a HLT of.
    ///
    /// # Errors
    /// A [`TalkFault`].
    pub(crate) fn internal(&mut self, unit: u8) -> Result<Internal, TalkFault> {
        self.register(unit, INTERNAL).map(internal_word)
    }

    /// A word, 0 where a unit has nothing to tell.
    ///
    /// # Errors
    /// A [`TalkFault`]; an answer that is no word counts as none.
    pub(crate) fn word(&mut self, unit: u8, request: Request) -> Result<u16, TalkFault> {
        match self.insist(unit, request)? {
            Answer::Data(words) => words.word().ok_or(TalkFault::Silent { unit }),
            Answer::Ack => Ok(0),
            Answer::Nak(_) => Err(TalkFault::Silent { unit }),
        }
    }

    /// Sends, takes the echo back, and says how long the octets take from now on.
    fn send(&mut self, unit: u8, request: Request) -> Result<Duration, LinkFault> {
        let mut buf = [0; MAX_LINE];
        let line = request.emit(unit, &mut buf);
        let takes = self.octets(u32::try_from(line.len()).unwrap_or(u32::MAX));
        self.state.port.send(line)?;
        if !self.state.terms.has_echo {
            return Ok(takes);
        }
        let deadline = self.now() + takes + SLACK;
        self.take_echo(line, deadline)?;
        Ok(Duration::ZERO)
    }

    /// The next line that is an answer, none at the deadline.
    fn answer(&mut self, sent: MonoTime, deadline: MonoTime) -> Result<Option<Reply>, LinkFault> {
        let mut collector = LineCollector::of_replies();
        let mut octet = [0];
        let (mut begun, mut left) = (None, MOST_STRAY);
        while left > 0 && self.state.port.receive(&mut octet, deadline)? > 0 {
            left -= 1;
            begun.get_or_insert(self.now());
            let malformed = match collector.push(octet[0]) {
                Some(Collected::Line(line)) => match Reply::parse(line) {
                    Ok(reply) => {
                        // An octet is there when its last bit is.
                        let first = begun.unwrap_or(sent).before(self.octets(1));
                        self.state.moment = Moment { sent, answered: first.max(sent) };
                        self.state.delays.push(first.since(sent));
                        return Ok(Some(reply));
                    }
                    Err(_) => true,
                },
                Some(Collected::Stray(stray)) => {
                    let stray = stray.strip_suffix(b"\r").unwrap_or(stray);
                    self.state.counts.echoed += u64::from(AnyRequest::parse(stray).is_ok());
                    true
                }
                None => false,
            };
            if malformed {
                self.state.counts.malformed += 1;
                begun = None;
            }
        }
        self.state.counts.malformed += u64::from(!collector.rest().is_empty());
        Ok(None)
    }
}

impl Answer {
    fn of(reply: Reply) -> Self {
        match reply {
            Reply::Ack { .. } => Self::Ack,
            Reply::Data { words, .. } => Self::Data(words),
            Reply::Nak { reason, .. } => Self::Nak(reason),
        }
    }
}
