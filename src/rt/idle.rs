//! Each controller is asked again and again where its axes stand, three at a time, and whether it knows its zero: four times a
//! second while nothing moves, since no ack tells then that it lives, and more often while frames flow, since an ack does not tell
//! that a seat follows them. Ack thread; allocates nothing.

use std::time::Duration;

use super::sight::{INPUTS, RESET, RESET_DONE, axes_to_read};
use crate::config::Controller;
use crate::fanout::Lane;
use crate::motion::Pulses;
use crate::net::{Delivery, Sender};
use crate::time::MonoTime;
use crate::wire::{
    Access, Code, DP_POSITIONS, Dialect, MAX_LEN, PerAxis, ReadRequest, RegisterReply, position_reads,
    positions,
};

/// From one beat to the next.
const EVERY: Duration = Duration::from_millis(250);
/// From one to the next of one controller while frames flow: each of at most three reads is made more often than eight times a
/// second.
const EVERY_LED: Duration = Duration::from_millis(40);

/// Who beats, and when next.
#[derive(Debug)]
pub(super) struct Beats {
    next: MonoTime,
    /// When the next one is asked while frames flow, and which.
    next_led: (MonoTime, usize),
    hearts: Vec<Heart>,
}

/// What has to be known of a controller to beat.
#[derive(Debug, Clone, Copy)]
struct Heart {
    code: Code,
    dialect: Dialect,
    axes: usize,
    /// Whether its inputs are asked for as well: somebody waits for a belt.
    inputs: bool,
    /// How often it was asked: of what it tells, one is asked for at a time.
    turn: usize,
}

impl Beats {
    pub(super) fn new(controllers: &[Controller], lanes: &[Lane]) -> Self {
        let heart = |(one, lane): (&Controller, &Lane)| Heart {
            code: lane.code,
            dialect: one.dialect,
            axes: axes_to_read(one, lane).min(DP_POSITIONS.len()),
            inputs: one.belt_inputs != 0,
            turn: 0,
        };
        Self {
            next: MonoTime::default(),
            next_led: (MonoTime::default(), 0),
            hearts: controllers.iter().zip(lanes).map(heart).collect(),
        }
    }

    /// Whether it is time; if so, the next is due a while later.
    pub(super) fn take(&mut self, now: MonoTime) -> bool {
        let due = now >= self.next;
        if due {
            self.next = now + EVERY;
        }
        due
    }

    /// Whom to ask next while frames flow, if it is time: one controller after the other, so that there is no heap of answers.
    pub(super) fn take_led(&mut self, now: MonoTime) -> Option<usize> {
        let (at, controller) = self.next_led;
        if now < at || self.hearts.is_empty() {
            return None;
        }
        let others = u32::try_from(self.hearts.len()).unwrap_or(u32::MAX);
        let next = at.max(now.before(EVERY_LED)) + EVERY_LED / others;
        self.next_led = (next, (controller + 1) % self.hearts.len());
        Some(controller)
    }

    /// Asks a controller, also whether it knows its zero where frames lead it; says for which register, where the kernel took it.
    pub(super) fn send(&mut self, controller: usize, is_led: bool, sender: &Sender) -> Option<u16> {
        let Heart { code, axes, inputs, turn, .. } = &mut self.hearts[controller];
        *turn = turn.wrapping_add(1);
        let (code, axes) = (*code, *axes);
        let read = |start| ReadRequest { channel: 0, accept: code, reply: code, start, num: 1 };
        let others = inputs.then_some(read(INPUTS)).into_iter().chain(is_led.then_some(read(RESET)));
        let reads = || position_reads(axes, code, code).chain(others.clone());
        let read = reads().nth(*turn % reads().count().max(1))?;
        let delivery = sender.send(controller, read.emit(&mut [0; MAX_LEN]));
        (!matches!(delivery, Delivery::Failed(_))).then_some(read.start)
    }

    /// Asks a controller where all of its axes are; says in how many datagrams.
    pub(super) fn send_all(&self, controller: usize, sender: &Sender) -> u64 {
        let Heart { code, axes, .. } = self.hearts[controller];
        let taken = |read: &ReadRequest| {
            !matches!(sender.send(controller, read.emit(&mut [0; MAX_LEN])), Delivery::Failed(_))
        };
        position_reads(axes, code, code).filter(taken).count() as u64
    }

    /// Which axes an answer to a beat tells of, the first of them counted from 0, and where they are; none where it is none.
    pub(super) fn hear(
        &mut self,
        controller: usize,
        reply: &RegisterReply<'_>,
    ) -> Option<(usize, PerAxis<Pulses>)> {
        let Heart { axes, code, dialect, .. } = self.hearts[controller];
        let mut reads = position_reads(axes, code, code);
        let is_ours = reply.access == Access::Read
            && reply.channel == 0
            && reads.any(|read| (read.start, read.num) == (reply.start, reply.num));
        let first = DP_POSITIONS.iter().position(|register| is_ours && *register == reply.start)?;
        Some((first, positions(reply.values(dialect), dialect)))
    }

    /// Whether it knows its zero, where this is the answer to a beat that asked for that.
    pub(super) fn hear_zero(reply: &RegisterReply<'_>) -> Option<bool> {
        let is_ours = (reply.access, reply.channel, reply.start, reply.num) == (Access::Read, 0, RESET, 1);
        reply.data.get(0).filter(|_| is_ours).map(|state| state == RESET_DONE)
    }

    /// The inputs that are active, where this is the answer to a beat that asked for them.
    pub(super) fn hear_inputs(&self, controller: usize, reply: &RegisterReply<'_>) -> Option<u16> {
        let is_ours = self.hearts[controller].inputs
            && (reply.access, reply.channel, reply.start, reply.num) == (Access::Read, 0, INPUTS, 1);
        reply.data.get(0).filter(|_| is_ours)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{ReplyCode, Words, position_words};

    fn beats(heart: Heart) -> Beats {
        Beats { next: MonoTime::default(), next_led: (MonoTime::default(), 0), hearts: vec![heart] }
    }

    #[test]
    fn an_answer_to_a_beat_tells_of_three_axes_and_no_other_answer_is_one() {
        let heart = Heart { code: Code(1), dialect: Dialect::Smc, axes: 6, inputs: false, turn: 0 };
        let mut beats = beats(heart);
        let mut hear = |start, stand: [i32; 3]| {
            let words: Vec<u16> =
                stand.iter().flat_map(|at| position_words(Pulses(*at), Dialect::Smc)).collect();
            let reply = RegisterReply {
                access: Access::Read,
                code: ReplyCode::Running,
                channel: 0,
                error: 0,
                start,
                num: 6,
                data: Words::from(&words[..]),
            };
            let (first, told) = beats.hear(0, &reply)?;
            Some((first, told.iter().map(|pulses| pulses.0).collect::<Vec<_>>()))
        };
        assert_eq!(hear(DP_POSITIONS[3], [4, 5, 6]), Some((3, vec![4, 5, 6])));
        assert_eq!(hear(DP_POSITIONS[0], [1, 2, 3]), Some((0, vec![1, 2, 3])));
        assert_eq!(hear(DP_POSITIONS[1], [1, 2, 3]), None, "nobody asks so");
    }

    #[test]
    fn inputs_are_heard_where_they_are_asked_for() {
        let heart = Heart { code: Code(1), dialect: Dialect::Smc, axes: 3, inputs: true, turn: 0 };
        let mut beats = beats(heart);
        let reply = |start| RegisterReply {
            access: Access::Read,
            code: ReplyCode::EmergencyStop,
            channel: 0,
            error: 0,
            start,
            num: 1,
            data: Words::from(&[3][..]),
        };
        assert_eq!(
            beats.hear_inputs(0, &reply(INPUTS)),
            Some(3),
            "also while it says that no belt is closed"
        );
        assert_eq!(beats.hear_inputs(0, &reply(0x66)), None);
        beats.hearts[0].inputs = false;
        assert_eq!(beats.hear_inputs(0, &reply(INPUTS)), None);
    }
}
