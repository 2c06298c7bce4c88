//! While nothing moves, no frame asks and no ack tells that a controller lives. Then each is asked by a beat, four times a
//! second, where its axes stand, three at a time. Ack thread; allocates nothing.

use std::time::Duration;

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
/// DP5e: the inputs that are active.
const INPUTS: u16 = 0x5e;
/// So many answers in a row have to find a seat away from where it rests: the first may come on the heels of the last frames.
const SURE_AFTER: u8 = 2;

/// Who beats, and when next.
#[derive(Debug)]
pub(super) struct Beats {
    next: MonoTime,
    /// Which of its axes each is asked for.
    turn: usize,
    hearts: Vec<Heart>,
}

/// What has to be known of a controller to beat.
#[derive(Debug)]
struct Heart {
    code: Code,
    dialect: Dialect,
    axes: usize,
    /// Whether its inputs are asked for as well: somebody waits for a belt.
    inputs: bool,
    /// Where its axes stand, as far as it was asked since it rests.
    places: [Option<Pulses>; DP_POSITIONS.len()],
    /// Answers in a row that found it away from where it rests.
    away: u8,
}

impl Beats {
    pub(super) fn new(controllers: &[Controller], lanes: &[Lane]) -> Self {
        let heart = |(one, lane): (&Controller, &Lane)| Heart {
            code: lane.code,
            dialect: one.dialect,
            axes: one.seat.axes.min(DP_POSITIONS.len()),
            inputs: one.belt_inputs != 0,
            places: [None; DP_POSITIONS.len()],
            away: 0,
        };
        Self {
            next: MonoTime::default(),
            turn: 0,
            hearts: controllers.iter().zip(lanes).map(heart).collect(),
        }
    }

    /// Whether it is time; if so, the next is due a while later.
    pub(super) fn take(&mut self, now: MonoTime) -> bool {
        let due = now >= self.next;
        if due {
            self.next = now + EVERY;
            self.turn = self.turn.wrapping_add(1);
        }
        due
    }

    /// Seats move, or are worked on: where they stood says nothing any more.
    pub(super) fn forget(&mut self) {
        for heart in &mut self.hearts {
            heart.places = [None; DP_POSITIONS.len()];
            heart.away = 0;
        }
    }

    /// Asks a controller; says whether the kernel took it.
    pub(super) fn send(&self, controller: usize, sender: &Sender) -> bool {
        let Heart { code, axes, inputs, .. } = self.hearts[controller];
        let inputs =
            inputs.then_some(ReadRequest { channel: 0, accept: code, reply: code, start: INPUTS, num: 1 });
        let reads = || position_reads(axes, code, code).chain(inputs);
        let read = reads().nth(self.turn % reads().count().max(1));
        read.is_some_and(|read| {
            !matches!(sender.send(controller, read.emit(&mut [0; MAX_LEN])), Delivery::Failed(_))
        })
    }

    /// Where the axes stand, from the first one on, as far as it is known with this answer to a beat; none where it is none.
    pub(super) fn hear(&mut self, controller: usize, octets: &[u8]) -> Option<PerAxis<Pulses>> {
        let heart = &mut self.hearts[controller];
        let reply = RegisterReply::parse(octets).ok()?;
        let mut reads = position_reads(heart.axes, heart.code, heart.code);
        let is_ours = reply.access == Access::Read
            && reply.channel == 0
            && reads.any(|read| (read.start, read.num) == (reply.start, reply.num));
        let first = DP_POSITIONS.iter().position(|register| is_ours && *register == reply.start)?;
        for (place, pulses) in
            heart.places[first..].iter_mut().zip(positions(reply.data, heart.dialect).iter())
        {
            *place = Some(*pulses);
        }
        let known = heart.places.iter().take_while(|place| place.is_some()).count();
        Some(PerAxis::from_fn(known, |axis| heart.places[axis].unwrap_or_default()))
    }

    /// The inputs that are active, where this is the answer to a beat that asked for them.
    pub(super) fn hear_inputs(&self, controller: usize, octets: &[u8]) -> Option<u16> {
        let reply = RegisterReply::parse(octets).ok().filter(|_| self.hearts[controller].inputs)?;
        let is_ours =
            reply.access == Access::Read && (reply.channel, reply.start, reply.num) == (0, INPUTS, 1);
        reply.data.get(0).filter(|_| is_ours)
    }

    /// Notes whether a seat stands where it rests, by an answer that was just heard; says whether it is surely elsewhere, once.
    pub(super) fn is_away(
        &mut self,
        controller: usize,
        rests: impl FnOnce(&[Option<Pulses>]) -> bool,
    ) -> bool {
        let heart = &mut self.hearts[controller];
        heart.away = if rests(&heart.places) { 0 } else { heart.away.saturating_add(1) };
        heart.away == SURE_AFTER
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{ReplyCode, Words, position_words};

    fn beats(axes: usize) -> Beats {
        let heart = Heart {
            code: Code(1),
            dialect: Dialect::Smc,
            axes,
            inputs: true,
            places: [None; DP_POSITIONS.len()],
            away: 0,
        };
        Beats { next: MonoTime::default(), turn: 0, hearts: vec![heart] }
    }

    /// Hears that three axes from `first` on stand there, and says what is known then.
    fn hear(beats: &mut Beats, first: usize, stand: [i32; 3]) -> Option<Vec<i32>> {
        let words: Vec<u16> = stand.iter().flat_map(|at| position_words(Pulses(*at), Dialect::Smc)).collect();
        let reply = RegisterReply {
            access: Access::Read,
            code: ReplyCode::Running,
            channel: 0,
            error: 0,
            start: DP_POSITIONS[first],
            num: 6,
            data: Words::from(&words[..]),
        };
        let known = beats.hear(0, reply.emit(&mut [0; MAX_LEN]))?;
        Some(known.iter().map(|pulses| pulses.0).collect())
    }

    #[test]
    fn what_two_beats_tell_of_six_axes_is_put_together() {
        let mut beats = beats(6);
        assert_eq!(hear(&mut beats, 3, [4, 5, 6]), Some(vec![]), "nothing is known of the first yet");
        assert_eq!(hear(&mut beats, 0, [1, 2, 3]), Some(vec![1, 2, 3, 4, 5, 6]));
        beats.forget();
        assert_eq!(hear(&mut beats, 0, [1, 2, 3]), Some(vec![1, 2, 3]));
        assert_eq!(hear(&mut beats, 1, [1, 2, 3]), None, "nobody asks so");
    }

    #[test]
    fn inputs_are_heard_where_they_are_asked_for() {
        let mut beats = beats(3);
        let reply = |start| RegisterReply {
            access: Access::Read,
            code: ReplyCode::EmergencyStop,
            channel: 0,
            error: 0,
            start,
            num: 1,
            data: Words::from(&[3][..]),
        };
        let octets = reply(INPUTS).emit(&mut [0; MAX_LEN]).to_vec();
        assert_eq!(beats.hear_inputs(0, &octets), Some(3), "also while it says that no belt is closed");
        assert_eq!(beats.hear_inputs(0, reply(0x66).emit(&mut [0; MAX_LEN])), None);
        beats.hearts[0].inputs = false;
        assert_eq!(beats.hear_inputs(0, &octets), None);
    }

    #[test]
    fn a_seat_is_away_once_two_answers_in_a_row_say_so() {
        let mut beats = beats(3);
        let said = [true, false, true, false, false, false, true, false, false];
        let surely = said.map(|rests| beats.is_away(0, |_| rests));
        assert_eq!(surely, [false, false, false, false, true, false, false, false, true]);
    }
}
