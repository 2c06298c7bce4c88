//! One exchange at a time, in frames of nine octets: what a unit is told, and what it answers where it is asked.
//!
//! Nothing but a question is answered, and no frame carries a sum. So each frame begins behind a break, by which a unit forgets what it
//! has of another: an octet that is lost or comes twice costs one frame and no more. (On a bus each is whole by itself, and the break is
//! none.) What has to be taken is sent with a question right
//! behind it ([`Talk::confirm`]): the question is answered only where what stands before it had nine octets. A bit that is flipped
//! is obeyed all the same, so what can be read back is.

use std::time::Duration;

use crate::drive::link::{LinkFault, LinkPort, LinkTalk, MOST_STRAY, Moment, TalkState, TalkTerms};
use crate::time::MonoTime;
use crate::wire::sixpack2::{
    BAUD_CLOCK, BaudSwitch, FRAME_LEN, SixpackFrame, SixpackOrder, SixpackReply, WAKING_DIVISOR, baud_of,
};

/// The address of answers: no unit has it, so that none takes an answer on the same wires for a question.
pub(super) const ANSWER: u8 = 255;
/// How long a break is, in octets: longer than one.
pub(super) const BREAK: u32 = 2;
/// What a unit makes of a question, beyond its octets and its delay.
const SLACK: Duration = Duration::from_millis(4);
/// A unit holds two wires after its answer for as long as it waited before it, at power-up for so long (manual, page 44).
const LONGEST_HOLD: Duration = Duration::from_millis(6);
/// What a unit and its adapter may take to begin an answer.
pub(super) const LONGEST_DELAY: Duration = Duration::from_millis(17);
/// How often what does no harm twice is asked.
const TRIES: u32 = 4;
/// How long a unit is told to wait before it answers, and to hold the line, in 2 ms: what a host needs to let go of two wires.
const DELAY: u16 = 1;

/// The rate with which units wake.
pub(super) fn waking_baud() -> u32 {
    baud_of(WAKING_DIVISOR).unwrap_or(19_200)
}

/// Why there is no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum TalkFault {
    /// The port.
    #[error(transparent)]
    Link(#[from] LinkFault),
    /// Nothing that answers the question came in time.
    #[error(
        "unit {unit} does not answer at {baud} baud; check its number, that no other has it, its power and the wiring"
    )]
    Silent {
        /// Who was asked.
        unit: u8,
        /// Bits a second.
        baud: u32,
    },
}

/// A conversation with the units of a line.
#[derive(Debug)]
pub(crate) struct Talk<P> {
    state: TalkState<P>,
    /// The rate of the link, whatever it talks at for a while.
    own_baud: u32,
    /// Until when somebody drives the line.
    busy: MonoTime,
    /// When the last frame that was sent has wholly arrived.
    arrived: MonoTime,
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
        let came = self.take_unasked();
        let is_answer = |octets: &[u8]| {
            let frame = octets.try_into().map(SixpackFrame::from_octets);
            frame.is_ok_and(|frame| {
                frame.address == ANSWER && !matches!(SixpackReply::of(frame), SixpackReply::Other { .. })
            })
        };
        let has_answer = came.windows(FRAME_LEN).any(is_answer);
        self.state.counts.doubled += u64::from(has_answer);
        self.state.counts.malformed += u64::from(!has_answer && !came.is_empty());
    }
}

impl<P: LinkPort> Talk<P> {
    /// Over a port that is open.
    pub(crate) fn new(port: P, terms: TalkTerms) -> Self {
        let busy = port.now();
        Self { state: TalkState::over(port, terms), own_baud: terms.baud, busy, arrived: busy }
    }

    /// The rate of the link.
    pub(super) const fn own_baud(&self) -> u32 {
        self.own_baud
    }

    /// The other rate at which units may be found, as they wake; none where all talk at that of the link for ever.
    pub(super) fn other_baud(&self) -> Option<u32> {
        let waking = waking_baud();
        (!self.state.terms.is_bus && self.own_baud != waking).then_some(waking)
    }

    /// When a frame that is sent now has wholly arrived, and how long one takes.
    pub(crate) fn arrival(&self) -> (MonoTime, Duration) {
        let frame = self.octets(NINE);
        (self.now().max(self.busy) + self.octets(BREAK) + frame, frame)
    }

    /// When the last frame that was sent has wholly arrived.
    pub(crate) const fn arrived(&self) -> MonoTime {
        self.arrived
    }

    /// How long a question holds up what is said next.
    pub(crate) fn question(&self) -> Duration {
        let delay = self.state.delays.p99();
        let hold = if self.state.terms.is_two_wires { delay.min(LONGEST_HOLD) } else { Duration::ZERO };
        self.octets(BREAK + 2 * NINE) + delay + hold
    }

    /// How long an answer is waited for, from the end of its question: no longer than a slow adapter needs, since nothing else is said
    /// meanwhile.
    fn patience(&self) -> Duration {
        patience(self.octets(1), self.state.delays.p99())
    }

    /// When a question that is asked next is over.
    pub(crate) fn question_over(&self) -> MonoTime {
        self.now().max(self.busy) + self.question()
    }

    /// Does nothing for so long.
    pub(crate) fn pause(&mut self, span: Duration) {
        let until = self.now() + span;
        self.state.port.sleep_until(until);
    }

    /// Sends and listens at another rate from now on; what units make of it is theirs.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    pub(super) fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        self.state.port.sleep_until(self.busy);
        // A port that is gone is opened again at the rate that it was told last.
        self.state.terms.baud = baud;
        self.state.port.set_baud(baud)
    }

    /// Tells a unit to talk at another rate. Nobody answers.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    pub(super) fn switch(&mut self, unit: u8, baud: u32) -> Result<(), LinkFault> {
        let near = (1..=u16::MAX)
            .min_by_key(|divisor| baud_of(*divisor).map_or(BAUD_CLOCK, |made| made.abs_diff(baud)));
        let divisor = near.unwrap_or(1);
        self.tell(unit, SixpackOrder::Baud(BaudSwitch { divisor, delay: DELAY }))
    }

    /// Tells a unit something. Nobody answers; returns once it has left.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    pub(crate) fn tell(&mut self, unit: u8, order: SixpackOrder) -> Result<(), LinkFault> {
        self.send(&[order.frame(unit)])?;
        self.state.port.sleep_until(self.busy);
        Ok(())
    }

    /// Asks a unit, once.
    ///
    /// # Errors
    /// A [`TalkFault`] where it does not answer.
    pub(crate) fn ask(&mut self, unit: u8, question: SixpackOrder) -> Result<SixpackReply, TalkFault> {
        self.exchange(unit, &[question.frame(unit)], question)
    }

    /// Asks a unit, a few times if need be.
    ///
    /// # Errors
    /// The last [`TalkFault`].
    pub(crate) fn insist(&mut self, unit: u8, question: SixpackOrder) -> Result<SixpackReply, TalkFault> {
        self.repeat(unit, &[question.frame(unit)], question)
    }

    /// Tells a unit what does no harm if it is told it twice, with a question right behind it, until that is answered.
    ///
    /// # Errors
    /// The last [`TalkFault`].
    pub(crate) fn confirm(
        &mut self,
        unit: u8,
        order: SixpackOrder,
        question: SixpackOrder,
    ) -> Result<SixpackReply, TalkFault> {
        self.repeat(unit, &[order.frame(unit), question.frame(unit)], question)
    }

    fn repeat(
        &mut self,
        unit: u8,
        frames: &[SixpackFrame],
        question: SixpackOrder,
    ) -> Result<SixpackReply, TalkFault> {
        let mut last = self.exchange(unit, frames, question);
        for _ in 1..TRIES {
            match last {
                Ok(_) | Err(TalkFault::Link(_)) => break,
                Err(TalkFault::Silent { .. }) => last = self.exchange(unit, frames, question),
            }
        }
        last
    }

    /// Sends frames of which the last is a question, and waits for its answer.
    fn exchange(
        &mut self,
        unit: u8,
        frames: &[SixpackFrame],
        question: SixpackOrder,
    ) -> Result<SixpackReply, TalkFault> {
        self.count_unasked();
        self.send(frames)?;
        self.state.counts.asked += 1;
        let sent = self.busy;
        let deadline = sent + self.patience();
        let Some((reply, begun)) = self.answer(unit, question, deadline)? else {
            return Err(TalkFault::Silent { unit, baud: self.state.terms.baud });
        };
        self.state.counts.answered += 1;
        self.state.moment = Moment { sent, answered: begun.max(sent) };
        let delay = self.state.moment.delay();
        self.state.delays.push(delay);
        if self.state.terms.is_two_wires {
            self.busy = self.now() + delay.min(LONGEST_HOLD);
        }
        Ok(reply)
    }

    /// Sends frames behind a break, once the line is free, and takes the echo back; it is busy until they have left.
    ///
    /// # Errors
    /// A [`LinkFault`] where the port is gone.
    pub(super) fn send(&mut self, frames: &[SixpackFrame]) -> Result<(), LinkFault> {
        self.state.port.sleep_until(self.busy);
        self.state.port.send_break(self.octets(BREAK))?;
        if self.state.terms.has_echo {
            self.state.port.flush();
        }
        let octets: Vec<u8> = frames.iter().flat_map(|frame| frame.octets()).collect();
        let takes = self.octets(u32::try_from(octets.len()).unwrap_or(u32::MAX));
        self.state.port.send(&octets)?;
        self.busy = self.now() + takes;
        self.arrived = self.busy;
        if self.state.terms.has_echo {
            let deadline = self.busy + SLACK;
            self.take_echo(&octets, deadline)?;
            self.busy = self.now();
        }
        Ok(())
    }

    /// The answer to a question, with when it began to arrive; none at the deadline. Among other octets it is found where it begins.
    fn answer(
        &mut self,
        unit: u8,
        question: SixpackOrder,
        deadline: MonoTime,
    ) -> Result<Option<(SixpackReply, MonoTime)>, LinkFault> {
        let (mut window, mut count, mut octet, mut left) = ([0; FRAME_LEN], 0, [0], MOST_STRAY);
        while left > 0 && self.state.port.receive(&mut octet, deadline)? > 0 {
            left -= 1;
            if count == FRAME_LEN {
                window.rotate_left(1);
                self.state.counts.malformed += 1;
                count -= 1;
            }
            window[count] = octet[0];
            count += 1;
            if count < FRAME_LEN {
                continue;
            }
            let frame = SixpackFrame::from_octets(window);
            self.state.counts.echoed += u64::from(frame == question.frame(unit));
            if let Some(reply) = question.answered_by(frame) {
                return Ok(Some((reply, self.now().before(self.octets(NINE)))));
            }
            match SixpackReply::of(frame) {
                SixpackReply::Other { .. } => {}
                _ if frame.address == ANSWER => {
                    self.state.counts.late += 1;
                    count = 0;
                }
                _ => self.state.counts.foreign += 1,
            }
        }
        self.state.counts.malformed += u64::from(count > 0);
        Ok(None)
    }
}

/// How long an answer is waited for where an octet takes so long, and nearly all answers begin so late.
pub(super) const fn patience(octet: Duration, delay: Duration) -> Duration {
    let delay = if delay.as_nanos() < LONGEST_DELAY.as_nanos() { delay } else { LONGEST_DELAY };
    octet.saturating_mul(NINE).saturating_add(delay.saturating_mul(2)).saturating_add(SLACK)
}

/// Octets of a frame.
pub(super) const NINE: u32 = 9;
const _: () = assert!(NINE as usize == FRAME_LEN);
