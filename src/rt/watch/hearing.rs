//! What controllers answer to what they were asked, beside acks: evidence for health, observer and the tick thread.

use super::Watch;
use crate::drive::link::StreamEvent;
use crate::drive::{Evidence, Incoming, Seen, Whereabouts};
use crate::health::HealthInput;
use crate::observe::Observer;
use crate::time::MonoTime;

impl Watch {
    /// Hands a datagram to whoever else asks; says whether somebody does.
    pub(in super::super) fn pass_on(&mut self, controller: usize, octets: &[u8], at: MonoTime) -> bool {
        self.standby.as_mut().is_some_and(|standby| standby.pass_on(controller, octets, at))
    }

    /// Hears a message that is no reply to a frame; says whether it was an answer to something asked.
    pub(in super::super) fn hear(
        &mut self,
        observer: &mut Observer,
        controller: usize,
        arrival: Incoming<'_>,
    ) -> bool {
        let at = arrival.at;
        let mut evidence = std::mem::take(&mut self.evidence);
        self.peers[controller].receive(arrival, &mut evidence);
        let is_answer = !evidence.is_empty();
        if is_answer {
            self.tended[controller].answered = at;
        }
        for one in evidence.drain(..) {
            self.take(observer, controller, one, at);
        }
        self.evidence = evidence;
        is_answer
    }

    /// Hears what the thread of a link tells of one of its lanes.
    pub(in super::super) fn hear_link(
        &mut self,
        observer: &mut Observer,
        controller: usize,
        event: &StreamEvent,
        at: MonoTime,
    ) {
        let mut evidence = std::mem::take(&mut self.evidence);
        self.peers[controller].hear(event, at, &mut evidence);
        for one in evidence.drain(..) {
            self.take(observer, controller, one, at);
        }
        self.evidence = evidence;
    }

    fn take(&mut self, observer: &mut Observer, controller: usize, evidence: Evidence, at: MonoTime) {
        match evidence {
            Evidence::Answered => self.judge(HealthInput::Answered(controller, at)),
            Evidence::Alive => self.judge(HealthInput::Alive(controller, at)),
            Evidence::Position(place) => {
                self.publish(controller, &place);
                self.mind_rest(controller, &place);
                if let Some(told) = place.told {
                    observer.on_positions(controller, told, at);
                }
            }
            // One that homes because it was asked to does not know its zero meanwhile.
            Evidence::Homed(homed) if self.live.is_moving() => {
                self.judge(HealthInput::Zero(controller, homed));
                self.judge(HealthInput::Alive(controller, at));
            }
            Evidence::Homed(_) => {}
            Evidence::Count(packets) => self.judge(HealthInput::Count(controller, packets)),
            Evidence::Counted => self.judge(HealthInput::Counted(controller)),
            Evidence::Outputs(on) => observer.on_outputs(controller, on, at),
            Evidence::Unreadable => {
                self.note_layout(controller, true);
                self.judge(HealthInput::Wide(controller));
            }
            Evidence::OtherAxes(drives) => self.judge(HealthInput::OtherAxes(controller, drives)),
            Evidence::Seen(seen) => {
                self.note_layout(controller, false);
                self.on_seen(controller, seen, at);
            }
            Evidence::Code(code) => {
                observer.on_code(controller, code, at);
                if let Some(records) = &mut self.records {
                    records.code(controller, code, at);
                }
            }
            Evidence::Stop(look) => {
                observer.on_look(controller, look, at);
                if let Some(records) = &mut self.records {
                    records.look(controller, look, at);
                }
            }
            Evidence::Killed { axis, cause } => self.judge(HealthInput::Killed(controller, axis, cause)),
            Evidence::LostZero => self.judge(HealthInput::LostZero(controller)),
            // One that is out already is looked at anyway.
            Evidence::Fell(why) if self.stands(controller).may_move() => {
                self.judge(HealthInput::FellOut(controller, why));
            }
            Evidence::Fell(_) => {}
        }
    }

    /// The tick thread sends no frame to one that would read it otherwise.
    fn note_layout(&self, controller: usize, is_foreign: bool) {
        if let Some(evidence) = self.live.evidence(controller).filter(|it| it.is_foreign() != is_foreign) {
            evidence.on_layout(is_foreign);
        }
    }

    /// What is known by now of where a seat is, is for the tick thread, too. One that frames lead is hardly ever read as a whole between
    /// two of them: then that is what an answer tells in passing.
    pub(super) fn publish(&mut self, controller: usize, place: &Whereabouts) {
        // While frames lead a seat from a place that is known, each answer is held against where they led it.
        let is_led = self.live.is_moving() && self.stands(controller).may_move();
        self.judge(HealthInput::Outside(controller, place.outside));
        self.judge(HealthInput::Pushed(controller, place.pushed));
        self.judge(HealthInput::Ambiguous(controller, !is_led && place.is_ambiguous));
        let reading = place.reading.or(place.passing.filter(|_| self.live.is_moving()));
        if let (Some(reading), Some(evidence)) = (reading, self.live.evidence(controller)) {
            evidence.on_reading(&reading);
        }
    }

    fn on_seen(&mut self, controller: usize, seen: Seen, at: MonoTime) {
        let Seen { sighting, rests, sways, .. } = seen;
        // A vibration ends with the next frame. Two controllers of one address contradict each other, so that no place is ever known.
        let is_another = || self.health.is_refuted_by(controller, &sighting, at);
        if rests || sways || !self.stands(controller).is_looked_at() || is_another() {
            self.judge(HealthInput::Seen(controller, sighting, at));
            if let Some(standby) = &mut self.standby {
                standby.on_seen(controller, seen);
            }
        }
    }
}
