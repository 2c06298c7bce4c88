//! The frames of one tick on their way out: one datagram for each lane, or one for all lanes of the network whose frames are the same.
//! Tick thread; allocates nothing.

use super::broadcast::{Apart, Broadcast};
use super::mail::{Mail, Sent};
use super::places::{self, Places};
use super::{FrameSink, Outgoing};
use crate::belief::Taken;
use crate::drive::{Lane, Stamped};
use crate::engine::Engine;
use crate::net::Delivery;
use crate::record::Asked;
use crate::time::{Clock, MonoTime};
use crate::wire::{FrameNo, MAX_LEN};

/// What sending takes.
pub(super) struct Sending<'t, C, S> {
    pub(super) lanes: &'t mut [Lane],
    pub(super) places: &'t mut Places,
    pub(super) engine: &'t mut Engine,
    pub(super) mail: &'t mut Mail,
    pub(super) sink: &'t mut S,
    pub(super) clock: &'t C,
    /// When the tick woke up.
    pub(super) tick: MonoTime,
    /// When the first left.
    pub(super) first: Option<MonoTime>,
}

/// The frame that is that of every lane of a network.
#[derive(Clone, Copy)]
struct Same {
    stamped: Stamped,
    len: usize,
}

impl<C: Clock, S: FrameSink> Sending<'_, C, S> {
    /// Sends to every lane that gets a frame.
    #[inline]
    pub(super) fn send_all(&mut self, buf: &mut [u8; MAX_LEN]) {
        let broadcast = self.mail.live().broadcast().cloned();
        if let Some(one) = &broadcast {
            self.send_network(one, buf);
        }
        for lane in 0..self.lanes.len() {
            if broadcast.as_ref().is_none_or(|one| !one.has(lane)) {
                self.send(lane, buf);
            }
        }
    }

    /// Sends to one lane, if it gets a frame.
    #[inline]
    fn send(&mut self, index: usize, buf: &mut [u8; MAX_LEN]) {
        let Self { lanes, places, engine, mail, sink, clock, first, .. } = self;
        if !engine.lane(index).gets_a_frame() {
            return;
        }
        let at = clock.now();
        let Some((beat, pose)) = places.admit(index, engine, at) else { return };
        let motion = engine.lane(index);
        let (stamped, datagram) = lanes[index].encode(&beat, &pose, motion.mix(), buf);
        first.get_or_insert(at);
        let (lasts_ms, at_most_ms) = (beat.lasts_ms, beat.at_most_ms());
        let (slots, level) = (lanes[index].window.slots().len(), motion.level());
        sink.asked(Asked { pose: *motion.asked(), slots, level, clamps: motion.clamps().clamps });
        let sent = Outgoing { index, stamped, pose: &pose, lasts_ms, at_most_ms, at };
        sent.hand_over(datagram, places, mail, *sink);
        mail.clamps(index, motion.clamps().clamps);
    }

    fn send_network(&mut self, one: &Broadcast, buf: &mut [u8; MAX_LEN]) {
        let at = self.clock.now();
        match self.same(one, at, buf) {
            Ok(same) => self.send_to_all(one, same, at, &buf[..same.len]),
            Err(why) => {
                let mut sends = false;
                for lane in &one.lanes {
                    sends |= self.engine.lane(*lane).gets_a_frame();
                    self.send(*lane, buf);
                }
                if sends {
                    one.on_apart(why);
                }
            }
        }
    }

    /// Writes the one frame that every lane of a network gets in this tick, to the bit, if it is so. A datagram reaches all of them or
    /// none: if any is not to be reached, or not like this, it is not sent. Looks only; what follows has its effects.
    fn same(&self, one: &Broadcast, at: MonoTime, buf: &mut [u8; MAX_LEN]) -> Result<Same, Apart> {
        let Self { lanes, places, engine, .. } = self;
        let is_reached = |lane: &usize| {
            let motion = engine.lane(*lane);
            motion.gets_a_frame() && motion.is_in() && !motion.is_blind()
        };
        if let Some(out) = one.lanes.iter().find(|lane| !is_reached(lane)) {
            // Whatever it comes back from, all are asked anew.
            one.rest(self.tick);
            return Err(Apart::Out(*out));
        }
        if !one.permits(self.tick) {
            return Err(Apart::NoPermit(one.permit()));
        }
        let (mut number, mut skips): (Option<FrameNo>, bool) = (None, false);
        for lane in &one.lanes {
            if !places.is_plain(*lane, engine.beat_of(*lane), at) {
                return Err(Apart::Differs(*lane));
            }
            if !places.belief(*lane).allows(engine.lane(*lane).pose(), engine.beat_of(*lane).lasts_ms, at) {
                return Err(Apart::Out(*lane));
            }
            let next = lanes[*lane].next_frame();
            skips |= number.is_some_and(|one| one != next);
            number = Some(number.filter(|newest| newest.since(next) >= 0).unwrap_or(next));
        }
        // Whoever leaves numbers out may leave out the one that was to ask for an ack: this one does.
        let every = one.lanes.first().map_or(0, |lane| lanes[*lane].ack_every);
        let number = number.map(|one| if skips { one.that_asks(every) } else { one });
        // Numbers go round: of some that lie all over the round none is later than all.
        let is_taken = |lane: &&usize| number.is_some_and(|one| one.since(lanes[**lane].next_frame()) < 0);
        if let Some(later) = one.lanes.iter().find(is_taken) {
            return Err(Apart::Differs(*later));
        }
        let mut all: Option<Same> = None;
        let mut other = [0; MAX_LEN];
        for lane in &one.lanes {
            let (motion, number) = (engine.lane(*lane), number.expect("it has this lane"));
            let room = if all.is_some() { &mut other } else { &mut *buf };
            let beat = engine.beat_of(*lane);
            let drafted = lanes[*lane].draft(number, one.code, beat, motion.pose(), motion.mix(), room);
            let (stamped, octets) = drafted.ok_or(Apart::Differs(*lane))?;
            let len = octets.len();
            let Some(same) = &mut all else {
                all = Some(Same { stamped, len });
                continue;
            };
            if buf[..same.len] != other[..len] || same.stamped.asked != stamped.asked {
                return Err(Apart::Differs(*lane));
            }
            // Pulses are the same, and what they were rounded from may not be: it vibrates by no more than the greatest.
            same.stamped.shakes = same.stamped.shakes.max(stamped.shakes);
        }
        all.ok_or(Apart::NoPermit(one.permit()))
    }

    /// Sends it, and notes for each lane what became of its frame.
    fn send_to_all(&mut self, one: &Broadcast, same: Same, at: MonoTime, datagram: &[u8]) {
        let Self { lanes, places, engine, mail, sink, first, tick, .. } = self;
        let Stamped { frame, asked, lights, shakes } = same.stamped;
        for lane in &one.lanes {
            let number = places::number(*lane);
            if lanes[*lane].take(frame) {
                mail.post(Sent::Skipped { lane: number, next: frame });
            }
            mail.post(Sent::Posted { lane: number, frame, asked, at: at.whole_micros(), lights, shakes });
        }
        first.get_or_insert(at);
        let delivery = sink.send_to_all(datagram);
        if let Delivery::Failed(_) = delivery {
            // The next goes to each by its own way, and all are asked anew.
            one.rest(*tick);
        } else {
            one.on_together();
        }
        for lane in &one.lanes {
            let (motion, beat) = (engine.lane(*lane), engine.beat_of(*lane));
            let (slots, level) = (lanes[*lane].window.slots().len(), motion.level());
            let clamps = motion.clamps().clamps;
            sink.asked(Asked { pose: *motion.asked(), slots, level, clamps });
            sink.went_along(*lane, datagram, at, delivery);
            let (lasts_ms, at_most_ms) = (beat.lasts_ms, beat.at_most_ms());
            let taken = Taken { frame, asked, pose: motion.pose(), lasts_ms, at_most_ms, shakes, at };
            places.sent(*lane, &taken, delivery);
            if let Delivery::Failed(_) = delivery {
                mail.post(Sent::Failed { lane: places::number(*lane), frame });
            }
            mail.clamps(*lane, clamps);
        }
    }
}
