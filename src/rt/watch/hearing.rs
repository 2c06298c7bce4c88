//! What controllers answer to what they were asked, beside acks: what they are, and where their seats stand.

use super::super::idle::Beats;
use super::super::standby::Seen;
use super::Watch;
use crate::belief::Reading;
use crate::motion::Pulses;
use crate::time::MonoTime;
use crate::wire::{FromController, PerAxis, RegisterReply};

impl Watch {
    /// Hands a datagram to whoever else asks; says whether somebody does.
    pub(in super::super) fn pass_on(&mut self, controller: usize, octets: &[u8], at: MonoTime) -> bool {
        self.standby.as_mut().is_some_and(|standby| standby.pass_on(controller, octets, at))
    }

    /// Hears registers; says whether they were an answer to a look.
    pub(in super::super) fn hear(
        &mut self,
        controller: usize,
        reply: &RegisterReply<'_>,
        at: MonoTime,
    ) -> bool {
        let looker = &mut self.lookers[controller];
        let is_answer = looker.hear(reply);
        if let Some(packets) = looker.take_count() {
            self.health.on_count(controller, packets);
        }
        if is_answer {
            self.health.on_answer(controller, at);
        }
        is_answer
    }

    /// Hears whatever it was, `passed` on or not.
    pub(in super::super) fn hear_any(
        &mut self,
        controller: usize,
        message: &FromController<'_>,
        passed: bool,
        at: MonoTime,
    ) {
        if passed {
            self.health.on_answer(controller, at);
        }
        if matches!(message, FromController::WideRegisters) {
            self.health.on_wide_registers(controller);
        }
        self.take_sighting(controller, at);
    }

    /// A seat answers where some of its axes are. What nobody asked for here may be the answer to what the control plane asked;
    /// else it was repeated on its way.
    fn on_answer(&mut self, controller: usize, first: usize, told: &[Pulses], at: MonoTime) {
        if let Some(passing) = self.positions[controller].answer(first, told, at) {
            self.on_positions(controller, Some(passing), at);
        } else if !self.is_asked_otherwise() {
            self.positions[controller].on_repeated(at);
        }
    }

    /// What is known by now of where a seat is, is for the tick thread, too. One that frames lead is hardly ever read as a whole between
    /// two of them: then that is what an answer tells in passing.
    pub(super) fn on_positions(&mut self, controller: usize, passing: Option<Reading>, at: MonoTime) {
        // While frames lead a seat from a place that is known, each answer is held against where they led it.
        let is_led = self.live.is_moving() && self.stands(controller).may_move();
        let positions = &self.positions[controller];
        self.health.on_outside(controller, positions.outside());
        self.health.on_ambiguous(controller, !is_led && positions.is_ambiguous());
        let reading = positions.reading(at).or(passing.filter(|_| self.live.is_moving()));
        if let (Some(reading), Some(evidence)) = (reading, self.live.evidence(controller)) {
            evidence.on_reading(&reading);
        }
    }

    /// Whoever joins from where it is found has to be at rest there.
    fn take_sighting(&mut self, controller: usize, at: MonoTime) {
        let standing = self.stands(controller);
        let Some(reading) = self.positions[controller].reading(at) else { return };
        let looker = &mut self.lookers[controller];
        let Some(sighting) = looker.take() else { return };
        if looker.leads_more_axes(sighting.identity.axes) {
            self.health.on_more_axes(controller, sighting.identity.axes);
        }
        if reading.rests || !standing.is_looked_at() {
            self.health.on_sighting(controller, &sighting, at);
            if let Some(standby) = &mut self.standby {
                let at_park = looker.is_parked(&reading.pose);
                standby.on_seen(controller, Seen { homed: sighting.homed, at_park });
            }
        }
    }

    /// Hears an answer to a beat: a sign of life, and where the axes of the seat are, as far as that is known by now; none where
    /// it is none.
    pub(in super::super) fn hear_beat(
        &mut self,
        controller: usize,
        reply: &RegisterReply<'_>,
        at: MonoTime,
    ) -> Option<PerAxis<Pulses>> {
        let (first, told) = self.beats.hear(controller, reply)?;
        self.on_answer(controller, first, &told, at);
        self.health.on_status(controller, at);
        self.mind_rest(controller, at);
        self.positions[controller].told()
    }

    /// Hears an answer to a beat that asked whether a controller that is led knows its zero; says whether it is one.
    pub(in super::super) fn hear_zero(
        &mut self,
        controller: usize,
        reply: &RegisterReply<'_>,
        at: MonoTime,
    ) -> bool {
        let zero = Beats::hear_zero(reply);
        // One that homes because it was asked to does not know it meanwhile.
        if let Some(homed) = zero.filter(|_| self.live.is_moving()) {
            self.health.on_zero(controller, homed);
            self.health.on_status(controller, at);
        }
        zero.is_some()
    }

    /// Hears an answer to a beat that asked for inputs: a sign of life, and which are active; none where it is none.
    pub(in super::super) fn hear_inputs(
        &mut self,
        controller: usize,
        reply: &RegisterReply<'_>,
        at: MonoTime,
    ) -> Option<u16> {
        let inputs = self.beats.hear_inputs(controller, reply)?;
        self.health.on_status(controller, at);
        Some(inputs)
    }
}
