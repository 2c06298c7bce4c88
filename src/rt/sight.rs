//! Looking at a controller while a show runs: the registers that tell what it is, whether it has rebooted, and where its
//! seat stands. Ack thread; allocates nothing.

use std::sync::Arc;

use crate::config::Controller;
use crate::fanout::Lane;
use crate::health::{Identity, Sighting};
use crate::motion::{MAX_AXES, Pose, SeatType};
use crate::net::{Delivery, Sender};
use crate::observe::{Look, StopSign};
use crate::wire::{
    Access, Code, DP_POSITIONS, Dialect, MAX_LEN, ReadRequest, RegisterReply, ReplyCode, Words, WriteRequest,
    position_reads,
};

/// Object channels of reads: monitors, parameters (SMC manual 2.2.2.1).
const MONITORS: u16 = 0;
const PARAMETERS: u16 = 1;
/// DPF1: outputs, counted from DPF0 in the channel of writes.
const CONTROLS: u16 = 2;
const OUTPUTS: u16 = 1;
/// PA00 to PA02: work mode, and working axes.
const MODE: (u16, u16) = (0x00, 3);
/// DP5E: active inputs, bit 0 = X01.
pub(super) const INPUTS: u16 = 0x5e;
/// So many looks in a row without a sign of an emergency stop say that it is over: one answer may be late or repeated.
const CALM_LOOKS: u8 = 2;
/// PA92: the inputs that all have to be active for an emergency stop; SMC alone is asked.
const STOP_MASK: u16 = 0x92;
/// DP34: datagrams received; SMC alone.
const PACKETS: u16 = 0x34;
/// DPF0: 2 once the controller knows its zero.
pub(super) const RESET: u16 = 0xf0;
pub(super) const RESET_DONE: u16 = 2;
/// How far from where it rests a seat has to be found to have been moved, in strokes: 0.3 mm of 150.
const NEAR: f64 = 0.002;
/// DPFE and DPFF: versions.
const VERSIONS: (u16, u16) = (0xfe, 2);

/// What has to be known of a controller to look at it.
#[derive(Debug, Clone)]
pub(super) struct Looker {
    code: Code,
    dialect: Dialect,
    seat: Arc<SeatType>,
    /// The place of its first own axis in a frame.
    first_slot: usize,
    park: Pose,
    /// Axes for which its frames have places, and those of them whose registers are read.
    places: usize,
    axes: usize,
    /// Inputs of which any one means an emergency stop.
    estop_inputs: u16,
    /// Looks in a row without a sign of an emergency stop.
    calm: u8,
    /// Looks in a row that saw it last although its inputs, which had asked for it, do no more; none before they had.
    held: Option<u8>,
    /// Its packet counter alone was asked for; and what it told.
    counting: bool,
    count: Option<u16>,
    seen: Seen,
}

/// What it has told since it was asked last.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    asked: bool,
    mode: Option<(u16, u16)>,
    versions: Option<(u16, u16)>,
    packets: Option<u16>,
    homed: Option<bool>,
    /// The axes whose positions were told, a bit each.
    axes: u16,
    inputs: Option<u16>,
    stop_mask: Option<u16>,
    /// Which of the reads were answered, in whatever way: a bit for each of [`Looker::stop_reads`].
    answered: u8,
    /// There was a sign of an emergency stop since it was asked.
    stopped: bool,
    /// What it says of an emergency stop was taken.
    stop_taken: bool,
    error: u16,
}

impl Looker {
    /// For a controller, and the lane that sends to it.
    pub(super) fn new(controller: &Controller, lane: &Lane) -> Self {
        Self {
            code: lane.code,
            dialect: controller.dialect,
            seat: Arc::clone(&controller.seat),
            first_slot: controller.first_slot(),
            park: lane.window.park(),
            places: places(controller, lane),
            axes: axes_to_read(controller, lane).min(DP_POSITIONS.len()),
            estop_inputs: controller.estop_inputs,
            calm: 0,
            held: None,
            counting: false,
            count: None,
            seen: Seen::default(),
        }
    }

    pub(super) const fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// Asks for all of it, where its seat is only if that is wanted, and says in how many datagrams.
    pub(super) fn ask(&mut self, lane: usize, sender: &Sender, where_it_is: bool) -> u32 {
        self.seen = Seen { asked: true, ..Seen::default() };
        let read =
            |channel, start, num| ReadRequest { channel, accept: self.code, reply: self.code, start, num };
        let packets = (self.dialect == Dialect::Smc).then(|| read(MONITORS, PACKETS, 1));
        let mask = (self.dialect == Dialect::Smc).then(|| read(PARAMETERS, STOP_MASK, 1));
        let inputs = self.asks_inputs().then(|| read(MONITORS, INPUTS, 1));
        let others = [
            read(PARAMETERS, MODE.0, MODE.1),
            read(MONITORS, RESET, 1),
            read(MONITORS, VERSIONS.0, VERSIONS.1),
        ];
        let positions = position_reads(if where_it_is { self.axes } else { 0 }, self.code, self.code);
        let reads = others.into_iter().chain(packets).chain(mask).chain(inputs).chain(positions);
        let mut sent = 0;
        for request in reads {
            // What the kernel does not take is asked for again a fifth of a second later.
            if !matches!(sender.send(lane, request.emit(&mut [0; MAX_LEN])), Delivery::Failed(_)) {
                sent += 1;
            }
        }
        sent
    }

    /// Asks for its packet counter alone, where it tells one.
    pub(super) fn ask_count(&mut self, lane: usize, sender: &Sender) {
        if self.dialect != Dialect::Smc {
            return;
        }
        let read =
            ReadRequest { channel: MONITORS, accept: self.code, reply: self.code, start: PACKETS, num: 1 };
        self.counting = !matches!(sender.send(lane, read.emit(&mut [0; MAX_LEN])), Delivery::Failed(_));
    }

    /// What the packet counter told that was asked for alone; once.
    pub(super) const fn take_count(&mut self) -> Option<u16> {
        self.count.take()
    }

    /// Switches its effects off, which no frame can that does not move it (DPF1, SMC manual 2.3.4); nobody answers.
    pub(super) fn darken(&self, lane: usize, sender: &Sender) {
        let off = [0];
        let (channel, start) = (CONTROLS, OUTPUTS);
        let write = WriteRequest {
            channel,
            accept: self.code,
            reply: Code::NONE,
            start,
            data: Words::from(&off[..]),
        };
        // It is sent three times.
        let _ = sender.send(lane, write.emit(&mut [0; MAX_LEN]));
    }

    /// True if it has answered something of what it was asked last.
    pub(super) const fn has_answered(&self) -> bool {
        self.seen.answered != 0 || self.seen.axes != 0
    }

    /// Hears registers; says whether they were an answer to what was asked.
    pub(super) fn hear(&mut self, reply: &RegisterReply<'_>) -> bool {
        if reply.access != Access::Read {
            return false;
        }
        let counted = self.hear_count(reply);
        if !self.seen.asked {
            return counted;
        }
        if let Some(read) = self.stop_reads().position(|start| start == reply.start) {
            self.seen.answered |= 1 << read;
        }
        match self.dialect {
            _ if reply.code == ReplyCode::Running => {}
            Dialect::Smc => {
                self.seen.error = reply.error;
                self.mind_stop(reply.code);
            }
            // It tells of the request alone. What it has no versions for is known by the rest.
            Dialect::Mbox if reply.start == VERSIONS.0 => self.seen.versions = Some((0, 0)),
            Dialect::Mbox => return true,
        }
        let word = |index| reply.values(self.dialect).get(index);
        // An answer with x over 2 does not say its channel; of what is asked here, start and count tell all the same.
        let of_parameters = reply.channel == PARAMETERS
            || (reply.code != ReplyCode::Running
                && [MODE, (STOP_MASK, 1)].contains(&(reply.start, reply.num)));
        let channel = if of_parameters { PARAMETERS } else { reply.channel };
        match (channel, reply.start) {
            (PARAMETERS, start) if start == MODE.0 => self.seen.mode = word(0).zip(word(2)),
            (PARAMETERS, STOP_MASK) => self.seen.stop_mask = word(0),
            (MONITORS, start) if start == VERSIONS.0 => {
                self.seen.versions = word(0).zip(word(1)).or(self.seen.versions);
            }
            (MONITORS, PACKETS) => self.seen.packets = word(0),
            (MONITORS, INPUTS) => self.seen.inputs = word(0),
            (MONITORS, RESET) => self.seen.homed = word(0).map(|state| state == RESET_DONE),
            (MONITORS, start) => {
                let Some(first) = DP_POSITIONS.iter().position(|register| *register == start) else {
                    return false;
                };
                self.seen.axes |= ((1 << (reply.num / 2)) - 1) << first;
            }
            _ => return false,
        }
        true
    }

    /// Hears its packet counter, where that alone was asked for.
    fn hear_count(&mut self, reply: &RegisterReply<'_>) -> bool {
        let is_ours = (reply.channel, reply.start, reply.num) == (MONITORS, PACKETS, 1);
        let counted = is_ours && std::mem::take(&mut self.counting);
        if counted {
            self.count = reply.data.get(0);
        }
        counted
    }

    /// What was seen, once all has been told; once for each time it was asked.
    pub(super) fn take(&mut self) -> Option<Sighting> {
        let Seen { asked, mode, versions, packets, homed, error, axes, .. } = self.seen;
        let ((work_mode, of_frame), (minor_version, version), homed) = (mode?, versions?, homed?);
        let all = (1 << self.axes) - 1;
        let told = packets.is_some() || self.dialect != Dialect::Smc;
        // Positions may have been asked for beside it: what comes before them is still to be heard then.
        if !asked || !told || axes & all != all || !self.is_whole() {
            return None;
        }
        self.seen.asked = false;
        let (minor_version, alarm) = match self.dialect {
            Dialect::Smc => (minor_version, 0),
            Dialect::Mbox => (0, minor_version),
        };
        let identity = Identity { version, minor_version, work_mode, axes: of_frame };
        Some(Sighting { identity, error, alarm, packets, homed })
    }

    /// True if frames would lead axes of a controller that nobody here reads: it takes as many as it drives (PA02).
    pub(super) fn leads_more_axes(&self, drives: u16) -> bool {
        usize::from(drives).min(self.places) > self.axes.max(self.seat.axes)
    }

    /// What it reads that tells of an emergency stop, each by its first register: by the reply code, or by the inputs.
    fn stop_reads(&self) -> impl Iterator<Item = u16> + use<> {
        let inputs = self.asks_inputs().then_some(INPUTS);
        [MODE.0, RESET, VERSIONS.0].into_iter().chain(inputs)
    }

    /// Whether all was answered that tells of an emergency stop.
    fn is_whole(&self) -> bool {
        self.stop_reads().enumerate().all(|(read, _)| self.seen.answered & (1 << read) != 0)
    }

    /// Whether inputs tell something of an emergency stop.
    fn asks_inputs(&self) -> bool {
        self.dialect == Dialect::Smc || self.estop_inputs != 0
    }

    /// Minds a reply code, which may be a sign of an emergency stop: what was asked before says nothing of its end.
    pub(super) fn mind_stop(&mut self, code: ReplyCode) {
        // An MBOX controller says with x = 4 that a request was too short.
        if self.dialect == Dialect::Smc && code == ReplyCode::EmergencyStop {
            self.seen.stopped = true;
            self.calm = 0;
        }
    }

    /// What this look says of an emergency stop, once all has been answered that tells of one; said once.
    pub(super) fn take_look(&mut self) -> Option<Look> {
        let Seen { inputs, stopped, stop_taken, .. } = self.seen;
        if stop_taken || !self.is_whole() {
            return None;
        }
        self.seen.stop_taken = true;
        let is_calm = inputs.map_or(self.estop_inputs == 0, |inputs| inputs & self.estop_inputs == 0);
        self.calm = if stopped || !is_calm { 0 } else { self.calm.saturating_add(1) };
        let stop = if self.calm > 0 {
            self.held = None;
            if self.calm >= CALM_LOOKS { StopSign::Over } else { StopSign::Unsure }
        } else {
            self.why_stopped(is_calm)
        };
        Some(Look { stop, inputs })
    }

    /// Whether the inputs ask for the emergency stop that is in effect. That they do not is believed only once they had: else
    /// it may come from elsewhere.
    fn why_stopped(&mut self, is_calm: bool) -> StopSign {
        let Seen { inputs: Some(inputs), stop_mask: Some(mask @ 1..), .. } = self.seen else {
            return StopSign::Unsure;
        };
        if !is_calm || inputs & mask == mask {
            self.held = Some(0);
            return StopSign::Asked;
        }
        self.held = self.held.map(|looks| looks.saturating_add(1));
        if self.held.is_some_and(|looks| looks >= CALM_LOOKS) { StopSign::Held } else { StopSign::Unsure }
    }

    /// Whether a seat in that pose stands at park, to a pulse.
    pub(super) fn is_parked(&self, pose: &Pose) -> bool {
        (0..self.seat.axes).map(|axis| self.first_slot + axis).take_while(|slot| *slot < MAX_AXES).all(
            |slot| {
                let apart = self.seat.pulses(pose[slot]).0.abs_diff(self.seat.pulses(self.park[slot]).0);
                apart <= 1
            },
        )
    }

    /// Whether a seat that is read in that pose is where it is parked, but for what is noise.
    pub(super) fn rests_at_park(&self, pose: &Pose) -> bool {
        let own = self.first_slot..MAX_AXES.min(self.first_slot + self.seat.axes.min(DP_POSITIONS.len()));
        own.into_iter().all(|slot| (self.park[slot] - pose[slot]).abs() <= NEAR)
    }
}

/// Axes of a controller for which its lane's frames have places.
fn places(controller: &Controller, lane: &Lane) -> usize {
    lane.window.slots().len() - controller.first_slot()
}

/// Axes of a controller that are read: those of its seat type, and those beyond for which frames have no more than places that are
/// always 0. Whoever stands there elsewhere than at 0 would be led there at once.
pub(super) fn axes_to_read(controller: &Controller, lane: &Lane) -> usize {
    let own = controller.seat.axes;
    let beyond = lane.window.slots().iter().skip(controller.first_slot() + own);
    if beyond.into_iter().all(|slot| slot.axis.is_none()) { places(controller, lane) } else { own }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::from_to_args;
    use crate::cue::{Source, read};
    use crate::fanout::{Manner, lanes};
    use crate::motion::Pulses;
    use crate::timeline::Timeline;
    use crate::wire::position_words;

    fn looker() -> Looker {
        let cue = read(Path::new("a.csv"), &b"time_ms,a1\n0,0\n1000,0.1\n"[..], &Source::Native).unwrap();
        let config = from_to_args(&["127.0.0.1:1".to_owned()], &[], 1).unwrap();
        let lanes = lanes(&config, &Timeline::new(cue), Manner { level: 1.0, silent: false });
        let mut looker = Looker::new(&config.controllers[0], &lanes[0]);
        looker.seen.asked = true;
        looker
    }

    /// Answers to all that is asked, as a controller gives them in that state.
    fn answer(looker: &mut Looker, code: ReplyCode, error: u16) -> Vec<bool> {
        let is_well = code == ReplyCode::Running;
        let place = position_words(Pulses(75_000), Dialect::Smc);
        let stands = [place, [0, 0], [0, 0]].concat();
        let answers: [(u16, u16, &[u16]); 5] = [
            (PARAMETERS, MODE.0, &[2, 0, 1]),
            (MONITORS, RESET, &[RESET_DONE]),
            (MONITORS, VERSIONS.0, &[1, 3]),
            (MONITORS, PACKETS, &[77]),
            (MONITORS, DP_POSITIONS[0], &stands),
        ];
        let hear = |(channel, start, words): (u16, u16, &[u16])| {
            let num = u16::try_from(words.len()).unwrap();
            let data = Words::from(words);
            let channel = if is_well { channel } else { 0 };
            let error = if is_well { 0 } else { error };
            let reply = RegisterReply { access: Access::Read, code, channel, error, start, num, data };
            looker.hear(&reply)
        };
        answers.into_iter().map(hear).collect()
    }

    #[test]
    fn what_a_controller_tells_is_taken_whole_and_once() {
        let mut looker = looker();
        assert_eq!(answer(&mut looker, ReplyCode::Running, 0), [true; 5]);
        assert!(looker.take().is_none(), "its inputs are to come");
        look(&mut looker, ReplyCode::Running, 0);
        let sighting = looker.take().unwrap();
        let identity = Identity { version: 3, minor_version: 1, work_mode: 2, axes: 1 };
        assert_eq!(sighting, Sighting { identity, error: 0, alarm: 0, packets: Some(77), homed: true });
        assert!(looker.take().is_none());
    }

    #[test]
    fn an_mbox_tells_the_alarm_of_its_drives_where_others_tell_a_version_and_a_refusal_tells_nothing() {
        let mut looker = looker();
        looker.dialect = Dialect::Mbox;
        answer(&mut looker, ReplyCode::Running, 0);
        let sighting = looker.take().unwrap();
        assert_eq!((sighting.identity.minor_version, sighting.alarm), (0, 1));
        looker.seen = Seen { asked: true, ..Seen::default() };
        assert_eq!(answer(&mut looker, ReplyCode::Fault, 0), [true; 5]);
        assert!(looker.take().is_none());
    }

    #[test]
    fn one_with_an_error_is_heard_as_well_though_its_answers_name_no_channel() {
        let mut looker = looker();
        looker.seen.answered = 0b1000; // its inputs
        assert_eq!(answer(&mut looker, ReplyCode::Fault, 21), [true; 5]);
        assert_eq!(looker.take().unwrap().error, 21);
    }

    /// What sends to a controller, and what that hears.
    fn link() -> (Sender, std::net::UdpSocket) {
        let controller = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = controller.local_addr().unwrap().to_string().parse().unwrap();
        let ports = crate::net::Ports::open("127.0.0.1:0".parse().unwrap(), &[address]).unwrap();
        (ports.split().0, controller)
    }

    /// A look that is answered so, with those inputs, of which the first is that of the emergency stop.
    fn look(looker: &mut Looker, code: ReplyCode, inputs: u16) -> StopSign {
        looker.seen = Seen { asked: true, ..Seen::default() };
        answer(looker, code, 0);
        for (channel, start, word) in [(PARAMETERS, STOP_MASK, 1), (MONITORS, INPUTS, inputs)] {
            let channel = if code == ReplyCode::Running { channel } else { 0 };
            let words = [word];
            let data = Words::from(&words[..]);
            let reply = RegisterReply { access: Access::Read, code, channel, error: 0, start, num: 1, data };
            assert!(looker.hear(&reply));
        }
        looker.take_look().expect("it is whole").stop
    }

    #[test]
    fn an_emergency_stop_is_over_after_two_whole_looks_that_were_asked_since_its_last_sign() {
        use ReplyCode::{EmergencyStop, Fault, Running};
        use StopSign::{Over, Unsure};
        let mut looker = looker();
        assert_eq!(look(&mut looker, EmergencyStop, 0), Unsure);
        assert_eq!([Running, Running].map(|code| look(&mut looker, code, 0)), [Unsure, Over]);
        assert_eq!(look(&mut looker, EmergencyStop, 0), Unsure);
        assert_eq!(
            [Fault, Running].map(|code| look(&mut looker, code, 0)),
            [Unsure, Over],
            "an error is none"
        );
        looker.mind_stop(EmergencyStop);
        look(&mut looker, Running, 0);
        looker.seen = Seen { asked: true, ..Seen::default() };
        looker.mind_stop(EmergencyStop);
        answer(&mut looker, Running, 0);
        assert!(looker.take_look().is_none(), "without the inputs it is not whole");
        assert_eq!(looker.calm, 0, "what was asked before the last sign does not count");
    }

    #[test]
    fn one_whose_inputs_asked_for_it_and_do_no_more_holds_it_until_a_reset() {
        use ReplyCode::EmergencyStop;
        use StopSign::{Asked, Held, Unsure};
        let mut looker = looker();
        let looks =
            |looker: &mut Looker, inputs: [u16; 3]| inputs.map(|one| look(looker, EmergencyStop, one));
        assert_eq!(looks(&mut looker, [0, 0, 0]), [Unsure; 3], "nobody knows what asks for it");
        assert_eq!(looks(&mut looker, [1, 0, 0]), [Asked, Unsure, Held]);
        assert_eq!(looks(&mut looker, [1, 0b10, 0b11]), [Asked, Unsure, Asked]);
    }

    #[test]
    fn an_mbox_is_not_asked_for_a_count_that_it_does_not_tell_and_a_request_that_is_too_short_stops_nobody() {
        let (sender, controller) = link();
        let mut looker = Looker { dialect: Dialect::Mbox, ..looker() };
        looker.ask_count(0, &sender);
        looker.darken(0, &sender);
        let mut heard = [0; MAX_LEN];
        let length = controller.recv(&mut heard).unwrap();
        assert!(WriteRequest::parse(&heard[..length]).is_ok(), "the first that comes");
        assert!(!looker.counting);
        looker.mind_stop(ReplyCode::EmergencyStop);
        assert!(!looker.seen.stopped);
    }

    #[test]
    fn effects_are_switched_off_by_a_register_that_moves_nothing_and_nobody_answers() {
        let (sender, controller) = link();
        let looker = looker();
        looker.darken(0, &sender);
        let mut heard = [0; MAX_LEN];
        let length = controller.recv(&mut heard).unwrap();
        let write = WriteRequest::parse(&heard[..length]).unwrap();
        assert_eq!((write.channel, write.start, write.data.get(0)), (2, 1, Some(0)), "DPF1");
        assert_eq!((write.accept, write.reply), (looker.code, Code::NONE));
    }

    #[test]
    fn one_late_answer_of_before_is_no_whole_look() {
        let mut looker = looker();
        looker.mind_stop(ReplyCode::EmergencyStop);
        looker.seen = Seen { asked: true, ..Seen::default() };
        let words = [RESET_DONE];
        let data = Words::from(&words[..]);
        let code = ReplyCode::Running;
        let late = RegisterReply {
            access: Access::Read,
            code,
            channel: MONITORS,
            error: 0,
            start: RESET,
            num: 1,
            data,
        };
        for _ in 0..9 {
            assert!(looker.hear(&late));
        }
        assert!(looker.take_look().is_none());
    }

    #[test]
    fn inputs_that_mean_an_emergency_stop_are_a_sign_of_it_whatever_the_replies_say() {
        use StopSign::{Asked, Over, Unsure};
        let mut looker = Looker { estop_inputs: 1, ..looker() };
        let looks = [0, 0, 1, 0].map(|inputs| look(&mut looker, ReplyCode::Running, inputs));
        assert_eq!(looks, [Unsure, Over, Asked, Unsure]);
    }

    #[test]
    fn axes_that_a_controller_drives_and_nobody_reads_are_led_where_its_frames_have_places_for_them() {
        let looker = looker(); // one axis, in frames of three
        assert_eq!((looker.places, looker.axes), (3, 3));
        assert!([1, 3, 12].into_iter().all(|drives| !looker.leads_more_axes(drives)));
        let looker = Looker { places: 10, axes: 6, ..looker };
        assert_eq!([6, 7, 12].map(|drives| looker.leads_more_axes(drives)), [false, true, true]);
    }

    #[test]
    fn nothing_is_taken_that_nobody_asked_for() {
        let mut looker = looker();
        looker.seen.asked = false;
        assert_eq!(answer(&mut looker, ReplyCode::Running, 0), [false; 5]);
        assert!(looker.take().is_none());
    }
}
