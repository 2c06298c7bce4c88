//! What a conversation with the drives of a link is reckoned by, whatever they speak.

use std::time::Duration;

use super::{Delays, LinkFault, LinkPort};
use crate::config::Link;
use crate::config::link::LinkWiring;
use crate::time::MonoTime;

/// Octets that are no answer and are listened to at the most, one after the other: a line that babbles holds nobody up for ever.
pub(crate) const MOST_STRAY: usize = 4_096;

/// So long after one unit another may answer the same question.
const TWIN: Duration = Duration::from_millis(30);

/// What a line is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TalkTerms {
    /// Bits a second.
    pub(crate) baud: u32,
    /// Bits of an octet with start and stop.
    pub(crate) octet_bits: u32,
    /// The adapter returns what is sent.
    pub(crate) has_echo: bool,
    /// All share two wires: only one may speak at a time.
    pub(crate) is_two_wires: bool,
    /// It is a CAN bus: each message is whole by itself and has a sum, and nobody changes its rate.
    pub(crate) is_bus: bool,
}

impl TalkTerms {
    /// Those of a link.
    pub(crate) fn of(link: &Link) -> Self {
        Self {
            baud: link.baud,
            octet_bits: link.octet_bits(),
            has_echo: link.has_echo,
            is_two_wires: link.wiring == LinkWiring::Rs485,
            is_bus: link.wiring == LinkWiring::Can,
        }
    }
}

/// What came over a line, counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct TalkCounts {
    /// Requests that wait for an answer.
    pub(crate) asked: u64,
    /// Those that got one in time.
    pub(crate) answered: u64,
    /// Answers that came after their time.
    pub(crate) late: u64,
    /// Answers where none was waited for any more.
    pub(crate) doubled: u64,
    /// Lines that are no answer, and octets that are no line.
    pub(crate) malformed: u64,
    /// Answers of a unit, or to a command, that was not asked.
    pub(crate) foreign: u64,
    /// The echo was not what was sent.
    pub(crate) echo_differs: u64,
    /// What was sent came back from a line that has no echo.
    pub(crate) echoed: u64,
}

impl TalkCounts {
    /// What was counted since these were.
    #[must_use]
    pub(crate) const fn since(self, before: Self) -> Self {
        Self {
            asked: self.asked - before.asked,
            answered: self.answered - before.answered,
            late: self.late - before.late,
            doubled: self.doubled - before.doubled,
            malformed: self.malformed - before.malformed,
            foreign: self.foreign - before.foreign,
            echo_differs: self.echo_differs - before.echo_differs,
            echoed: self.echoed - before.echoed,
        }
    }
}

/// When an exchange happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Moment {
    /// The last octet of the request had left.
    pub(crate) sent: MonoTime,
    /// The first octet of the answer began to arrive.
    pub(crate) answered: MonoTime,
}

impl Moment {
    /// How long the answer took to begin.
    pub(crate) const fn delay(&self) -> Duration {
        self.answered.since(self.sent)
    }
}

/// What a conversation over a port has come to.
#[derive(Debug)]
pub(crate) struct TalkState<P> {
    pub(crate) port: P,
    pub(crate) terms: TalkTerms,
    pub(crate) delays: Delays,
    pub(crate) counts: TalkCounts,
    pub(crate) moment: Moment,
}

impl<P> TalkState<P> {
    /// Of one that has not begun.
    pub(crate) fn over(port: P, terms: TalkTerms) -> Self {
        let counts = TalkCounts::default();
        Self { port, terms, delays: Delays::new(), counts, moment: Moment::default() }
    }
}

/// A conversation with the drives of a line, whatever they speak.
pub(crate) trait LinkTalk {
    /// What it goes over.
    type Port: LinkPort;

    /// What it has come to.
    fn state(&self) -> &TalkState<Self::Port>;

    /// The same, to be changed.
    fn state_mut(&mut self) -> &mut TalkState<Self::Port>;

    /// The present instant.
    fn now(&self) -> MonoTime {
        self.state().port.now()
    }

    /// The port.
    fn port(&mut self) -> &mut Self::Port {
        &mut self.state_mut().port
    }

    /// Bits a second.
    fn baud(&self) -> u32 {
        self.state().terms.baud
    }

    /// What came so far.
    fn counts(&self) -> TalkCounts {
        self.state().counts
    }

    /// What 99 of 100 answers take to begin.
    fn delay_p99(&self) -> Duration {
        self.state().delays.p99()
    }

    /// What nine of ten answers took to begin at the most; none where there were none.
    fn usual_delay(&self) -> Option<Duration> {
        self.state().delays.most_of(90)
    }

    /// When the last exchange was.
    fn moment(&self) -> Moment {
        self.state().moment
    }

    /// How long so many octets take.
    fn octets(&self, count: u32) -> Duration {
        let TalkTerms { baud, octet_bits, .. } = self.state().terms;
        Duration::from_nanos(u64::from(count * octet_bits) * 1_000_000_000 / u64::from(baud.max(1)))
    }

    /// Counts what came unasked: whole answers, and what is none.
    fn count_unasked(&mut self);

    /// True if more than one unit answers a question, one after the other: all of them obey what is meant for one.
    ///
    /// # Errors
    /// That of the question.
    fn has_twins<E>(&mut self, mut ask: impl FnMut(&mut Self) -> Result<(), E>) -> Result<bool, E> {
        // Once it may be an answer that came late.
        for _ in 0..2 {
            ask(self)?;
            let until = self.now() + TWIN;
            self.port().sleep_until(until);
            let before = self.counts().doubled;
            self.count_unasked();
            if self.counts().doubled == before {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Takes what came unasked.
    fn take_unasked(&mut self) -> Vec<u8> {
        let (port, mut came, mut octets) = (self.port(), Vec::new(), [0; 64]);
        // A port that is gone is found by whoever asks next.
        while came.len() < MOST_STRAY
            && let Ok(count @ 1..) = port.receive(&mut octets, MonoTime::default())
        {
            came.extend_from_slice(&octets[..count]);
        }
        came
    }

    /// Takes the echo of what was sent back, where there is one; it has to be there at the deadline.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    fn take_echo(&mut self, sent: &[u8], deadline: MonoTime) -> Result<(), LinkFault> {
        let TalkState { port, counts, .. } = self.state_mut();
        let (mut octet, mut same) = ([0], true);
        for wanted in sent {
            if port.receive(&mut octet, deadline)? == 0 {
                same = false;
                break;
            }
            same &= octet[0] == *wanted;
        }
        counts.echo_differs += u64::from(!same);
        Ok(())
    }
}
