//! SMC, IMAX and MBOX controllers: their frames, and how a running hall asks them for registers and hears of them.

mod frame;
mod on;
mod pending;
mod position;
mod probe;
mod reads;
mod stop_signs;

use std::sync::Arc;

use super::{Evidence, EvidenceList, Incoming, Lane, Need, Seen, SentFrame, Whereabouts};
use crate::belief::Reading;
use crate::config::{Controller, Station};
use crate::motion::{AxisGeometry, MAX_AXES, Pose, Pulses, SeatType};
use crate::time::MonoTime;
use crate::wire::{
    Code, DP_POSITIONS, Dialect, FrameNo, FromController, MAX_LEN, RegisterReply, ReplyCode, Words,
    WriteRequest, positions,
};
pub(super) use frame::{MotionCodec, Wiring};
use on::OnBelief;
use pending::Pending;
use position::Positions;
use probe::Probe;
use reads::{
    MonitorRead::{self, FirstPositions, Inputs, Mode, MorePositions, Outputs, Packets, Polarity, Zero},
    ZERO_KNOWN,
};

/// DPF1: outputs, counted from DPF0 in the channel of writes.
const CONTROLS: u16 = 2;
const OUTPUTS: u16 = 1;
/// What is asked for as a sign of life, one after the other.
const KEEP_ALIVE: [MonitorRead; 4] = [FirstPositions, MorePositions, Inputs, Zero];
/// How far from where it rests a seat has to be found to have been moved, in strokes: 0.3 mm of 150.
const NEAR: f64 = 0.002;

/// One controller.
#[derive(Debug)]
pub(crate) struct MboxPeer {
    /// Who takes requests, and who answers.
    code: Code,
    dialect: Dialect,
    seat: Arc<SeatType>,
    /// The place of its first own axis in a frame.
    first_slot: usize,
    /// Where its lane is parked.
    park: Pose,
    /// Axes for which its frames have places, and those of them whose registers are read.
    places: usize,
    axes: usize,
    /// The axes that it drives, as it said last (PA02): while it has not, or they are others than its frames lead, no motion begins.
    drives: Option<u16>,
    /// Somebody waits for a belt: its inputs are asked for while nothing moves as well.
    has_belts: bool,
    /// Inputs alone tell of an emergency stop.
    has_stop_inputs: bool,
    pub(super) pending: Pending,
    pub(super) position: Positions,
    pub(super) probe: Probe,
    /// What may be on there.
    pub(super) on: OnBelief,
    /// It answered in another layout, and has not been seen as a whole since: a write would mean something else there.
    is_foreign: bool,
    /// How often it was asked for a sign of life: of what it tells, one is asked for at a time.
    turn: usize,
}

impl MboxPeer {
    pub(super) fn new(controller: &Controller<Station>, lane: &Lane) -> Self {
        let Station { dialect, .. } = controller.connection;
        let (code, seat) = (Code(controller.connection.code()), &controller.seat);
        let first_slot = controller.first_slot();
        let slots = lane.window.slots();
        let places = slots.len() - first_slot;
        // Axes beyond those of the seat type are read where frames have no more than places that are always 0: whoever stands there
        // elsewhere than at 0 would be led there at once.
        let mut beyond = slots.iter().skip(first_slot + seat.axes);
        let led = if beyond.all(|slot| slot.axis.is_none()) { places } else { seat.axes };
        let axes = led.min(DP_POSITIONS.len());
        let on = OnBelief::unknown(dialect == Dialect::Smc);
        Self {
            code,
            dialect,
            seat: Arc::clone(seat),
            first_slot,
            park: lane.window.park(),
            places,
            axes,
            drives: None,
            has_belts: controller.belt_inputs != 0,
            has_stop_inputs: dialect == Dialect::Mbox && controller.estop_inputs != 0,
            pending: Pending::new(),
            position: Positions::new(Arc::clone(seat), first_slot, led, on.shakes()),
            on,
            is_foreign: false,
            probe: Probe::new(dialect, axes, controller.estop_inputs),
            turn: 0,
        }
    }

    pub(super) fn poll(&mut self, need: Need, now: MonoTime, send: &mut dyn FnMut(&[u8]) -> bool) -> u32 {
        let mut written = 0;
        let next = match need {
            // What is off is only read.
            Need::Dark if self.on.left_on().outputs && !self.is_foreign => {
                written = u32::from(self.darken(send));
                None
            }
            Need::KeepAlive { is_led } => self.next_sign(is_led),
            Need::Identity | Need::Count | Need::Position | Need::Dark => None,
        };
        let is_behind = self.pending.is_behind(now);
        let wanted = MonitorRead::ALL.map(|read| match need {
            Need::Identity if read.first_axis().is_some() => !is_behind,
            Need::Identity => self.probe.asks(read),
            Need::Count => read == Packets && self.probe.asks(read),
            Need::Position => read.first_axis().is_some() || (read == Mode && self.drives.is_none()),
            // What frames lead is known by their acks; a seat at rest by two sources, which have to agree.
            Need::KeepAlive { is_led } => {
                next == Some(read) || (!is_led && next.is_some_and(|next| read.is_part_of(next)))
            }
            Need::Dark if read == Polarity => self.on.wants_polarity(),
            Need::Dark if read.first_axis().is_some() => self.on.left_on().vibrates() && !is_behind,
            Need::Dark => read == Outputs,
        });
        if need == Need::Identity {
            self.probe.begin();
        }
        let reads = MonitorRead::ALL.into_iter().zip(wanted).filter(|(_, wanted)| *wanted);
        written + reads.map(|(read, _)| self.ask(read, need, now, send)).sum::<u32>()
    }

    /// Asks for that, if the controller has it; what the kernel does not take is not waited for.
    fn ask(
        &mut self,
        read: MonitorRead,
        need: Need,
        now: MonoTime,
        send: &mut dyn FnMut(&[u8]) -> bool,
    ) -> u32 {
        let Some(request) = read.request(self.axes, self.code) else { return 0 };
        let taken = send(request.emit(&mut [0; MAX_LEN]));
        if taken {
            self.pending.asked(read, need, now);
        }
        u32::from(taken)
    }

    /// What is asked for next as a sign of life.
    fn next_sign(&mut self, is_led: bool) -> Option<MonitorRead> {
        self.turn = self.turn.wrapping_add(1);
        let is_asked = |read: &MonitorRead| match read {
            // No reply of an MBOX controller says that an emergency stop is pressed: with no acks that is in its inputs alone.
            Inputs => self.has_belts || (!is_led && self.has_stop_inputs),
            Zero => is_led,
            read => read.first_axis().is_some_and(|first| first < self.axes),
        };
        let signs = || KEEP_ALIVE.into_iter().filter(is_asked);
        signs().nth(self.turn % signs().count().max(1))
    }

    /// Switches effects off by a register (DPF1, SMC manual 2.3.4), which no frame can that does not move the seat.
    fn darken(&self, send: &mut dyn FnMut(&[u8]) -> bool) -> bool {
        let (accept, off) = (self.code, [0]);
        let data = Words::from(&off[..]);
        let write = WriteRequest { channel: CONTROLS, accept, reply: Code::NONE, start: OUTPUTS, data };
        send(write.emit(&mut [0; MAX_LEN]))
    }

    pub(super) fn receive(&mut self, arrival: Incoming<'_>, out: &mut EvidenceList) {
        let Incoming { message, at, others_ask } = arrival;
        match message {
            FromController::Registers(reply) => self.on_registers(&reply, arrival, out),
            FromController::PrintedImax => {
                // Only a whole look from now on says that somebody else is there.
                self.probe.abandon();
                self.is_foreign = true;
                out.push(Evidence::Unreadable);
            }
            _ => {}
        }
        out.extend(others_ask.then_some(Evidence::Answered));
        out.extend(self.take_seen(at).map(Evidence::Seen));
        out.extend(self.probe.take_look().map(Evidence::Stop));
    }

    /// Takes the answer to a read.
    fn on_registers(&mut self, reply: &RegisterReply<'_>, arrival: Incoming<'_>, out: &mut EvidenceList) {
        let Incoming { at, others_ask, .. } = arrival;
        let read = MonitorRead::answered_by(reply, self.axes);
        if read.is_some() || others_ask {
            self.probe.mind_stop(reply.code);
            out.push(Evidence::Code(reply.code));
        }
        let Some(read) = read else { return };
        let claim = self.pending.answered(read, at);
        // What nobody waits for may be the answer to what another thread asked; else it was repeated on its way.
        let is_answer = claim.is_some() || others_ask;
        let is_sign =
            read.first_axis().is_some() || (read == Inputs && (self.has_belts || self.has_stop_inputs));
        out.extend((is_answer && is_sign).then_some(Evidence::Alive));
        let word = reply.data.get(0);
        if let Some((first, source)) = read.first_axis().zip(read.source()) {
            let told = positions(reply.values(self.dialect), self.dialect);
            match claim {
                Some(claim) => {
                    let passing = self.position.answer(first, &told, source, claim, at);
                    out.push(Evidence::Position(self.whereabouts(Some(passing), at)));
                    self.mind_shaking(at);
                }
                // Of it and of what was taken for the answer one is old, and nobody knows which.
                None if !others_ask && self.position.on_repeated(first, &told, at) => {
                    out.push(Evidence::Position(self.whereabouts(None, at)));
                }
                None => {}
            }
        }
        let told = reply.values(self.dialect).get(0);
        match (read, claim) {
            (Outputs, Some(claim)) => {
                let on = told.and_then(|word| self.on.on_outputs(word, claim.oldest));
                out.extend(on.map(Evidence::Outputs));
            }
            (Polarity, Some(_)) => told.into_iter().for_each(|word| self.on.on_polarity(word)),
            (Mode, Some(_)) => {
                self.drives = reply.values(self.dialect).get(2).or(self.drives);
                out.extend(self.drives.filter(|drives| !self.leads_all(*drives)).map(Evidence::OtherAxes));
            }
            (Zero, _) => out.extend(word.map(|state| Evidence::Homed(state == ZERO_KNOWN))),
            (Packets, Some(claim)) if claim.is_count => out.extend(word.map(Evidence::Count)),
            (Packets, _) => out.extend(word.map(|_| Evidence::Counted)),
            _ => {}
        }
        self.probe.hear(read, reply);
        out.extend(claim.map(|_| Evidence::Answered));
    }

    /// Whoever joins from where it is found has to be at rest there.
    fn take_seen(&mut self, at: MonoTime) -> Option<Seen> {
        let reading = self.position.reading(at)?;
        let sighting = self.probe.take()?;
        self.is_foreign = false;
        Some(Seen {
            sighting,
            rests: reading.rests,
            sways: reading.sways > 0.0,
            at_park: reading.rests && self.is_parked(&reading.pose),
        })
    }

    fn whereabouts(&self, passing: Option<Reading>, at: MonoTime) -> Whereabouts {
        let leads_all = self.drives.is_some_and(|drives| self.leads_all(drives));
        let reading = self.position.reading(at).filter(|_| leads_all);
        Whereabouts {
            passing,
            told: self.position.told(),
            outside: self.position.outside(),
            pushed: None,
            is_ambiguous: self.position.is_ambiguous(),
            is_off_park: reading.is_some_and(|reading| !self.rests_at_park(&reading.pose)),
            reading,
        }
    }

    pub(super) fn on_sent(&mut self, sent: &SentFrame) {
        self.on.on_sent(sent);
        self.position.on_sent(sent.at);
        self.position.may_shake(self.on.shakes());
    }

    pub(super) fn on_ack(&mut self, acked: FrameNo) {
        self.on.on_ack(acked);
        self.position.may_shake(self.on.shakes());
    }

    pub(super) fn on_cut_off(&mut self, shakes: f64) {
        self.on.on_cut_off(shakes);
        self.position.may_shake(self.on.shakes());
    }

    /// A seat that was read in one place for long enough does not vibrate.
    fn mind_shaking(&mut self, at: MonoTime) {
        if self.on.shakes() > 0.0 && self.position.reading(at).is_some_and(|reading| reading.rests) {
            self.on.on_still();
            self.position.may_shake(0.0);
        }
    }

    pub(super) fn on_reply_code(&mut self, code: ReplyCode) -> bool {
        self.probe.mind_stop(code);
        // With x = 4 an SMC controller tells of an emergency stop, which the observer hears.
        match self.dialect {
            Dialect::Smc => matches!(code, ReplyCode::Fault | ReplyCode::Command),
            Dialect::Mbox => code.refused(),
        }
    }

    pub(super) fn on_report(
        &mut self,
        positions: &[Pulses],
        outputs: Option<u16>,
        at: MonoTime,
    ) -> Whereabouts {
        self.position.report(positions, at);
        outputs.into_iter().for_each(|word| self.on.on_reported(word));
        self.whereabouts(None, at)
    }

    /// True if a controller that drives so many axes (PA02) takes all that its seat has of a frame, and none that nobody here reads.
    fn leads_all(&self, drives: u16) -> bool {
        let drives = usize::from(drives).min(self.places);
        (self.seat.axes..=self.axes.max(self.seat.axes)).contains(&drives)
    }

    /// Whether a seat in that pose stands at park, to a pulse.
    fn is_parked(&self, pose: &Pose) -> bool {
        let Self { seat, first_slot, park, .. } = self;
        let apart = |(index, axis): (usize, &AxisGeometry)| {
            let [stands, parks] = [pose, park].map(|pose| axis.pulses(pose[first_slot + index]));
            stands.0.abs_diff(parks.0)
        };
        seat.own().iter().take(MAX_AXES - first_slot).enumerate().all(|axis| apart(axis) <= 1)
    }

    /// Whether a seat that is read in that pose is where it is parked, but for what is noise.
    fn rests_at_park(&self, pose: &Pose) -> bool {
        let Self { seat, first_slot, park, .. } = self;
        let own = *first_slot..MAX_AXES.min(first_slot + seat.axes.min(DP_POSITIONS.len()));
        own.into_iter().all(|slot| (park[slot] - pose[slot]).abs() <= NEAR)
    }
}

#[cfg(test)]
mod tests;
