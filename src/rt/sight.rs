//! Looking at a controller while a show runs: the registers that tell what it is, whether it has rebooted, and where its
//! seat stands. Ack thread; allocates nothing.

use std::sync::Arc;

use crate::config::Controller;
use crate::fanout::Lane;
use crate::health::{Identity, Sighting};
use crate::motion::{MAX_AXES, Pose, Pulses, SeatType};
use crate::net::{Delivery, Sender};
use crate::wire::{
    Access, Code, DP_INPUTS, DP_POSITIONS, Dialect, MAX_LEN, PerAxis, ReadRequest, RegisterReply, ReplyCode,
    position_reads, positions,
};

/// Object channels of reads: monitors, parameters (SMC manual 2.2.2.1).
const MONITORS: u16 = 0;
const PARAMETERS: u16 = 1;
/// PA00 to PA02: work mode, and working axes.
const MODE: (u16, u16) = (0x00, 3);
/// DP34: datagrams received; SMC alone.
const PACKETS: u16 = 0x34;
/// DPF0: 2 once the controller knows its zero.
const RESET: u16 = 0xf0;
const RESET_DONE: u16 = 2;
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
    seen: Seen,
    /// The positions of the last answer, from which axis on, until they are taken.
    told: Option<(usize, PerAxis<Pulses>)>,
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
            told: None,
            seen: Seen::default(),
        }
    }

    pub(super) const fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// Asks for all of it, and says in how many datagrams.
    pub(super) fn ask(&mut self, lane: usize, sender: &Sender) -> u32 {
        self.seen = Seen { asked: true, ..Seen::default() };
        let read =
            |channel, start, num| ReadRequest { channel, accept: self.code, reply: self.code, start, num };
        let packets = (self.dialect == Dialect::Smc).then(|| read(MONITORS, PACKETS, 1));
        let others = [
            read(PARAMETERS, MODE.0, MODE.1),
            read(MONITORS, RESET, 1),
            read(MONITORS, VERSIONS.0, VERSIONS.1),
            read(MONITORS, DP_INPUTS, 1),
        ];
        let reads =
            others.into_iter().chain(packets).chain(position_reads(self.seat.axes, self.code, self.code));
        let mut sent = 0;
        for request in reads {
            // What the kernel does not take is asked for again a fifth of a second later.
            if !matches!(sender.send(lane, request.emit(&mut [0; MAX_LEN])), Delivery::Failed(_)) {
                sent += 1;
            }
        }
        sent
    }

    /// Hears a datagram; says whether it was an answer to what was asked.
    pub(super) fn hear(&mut self, octets: &[u8]) -> bool {
        let reply = RegisterReply::parse(octets).ok();
        let Some(reply) = reply.filter(|reply| self.seen.asked && reply.access == Access::Read) else {
            return false;
        };
        match self.dialect {
            _ if reply.code == ReplyCode::Running => {}
            Dialect::Smc => self.seen.error = reply.error,
            // It tells of the request alone. What it has no versions for is known by the rest.
            Dialect::Mbox if reply.start == VERSIONS.0 => self.seen.versions = Some((0, 0)),
            Dialect::Mbox => return true,
        }
        let word = |index| reply.values(self.dialect).get(index);
        // An answer with x over 2 does not say its channel; of what is asked here, start and count tell all the same.
        let of_parameters = reply.channel == PARAMETERS
            || (reply.code != ReplyCode::Running && (reply.start, reply.num) == MODE);
        let channel = if of_parameters { PARAMETERS } else { reply.channel };
        match (channel, reply.start) {
            (PARAMETERS, start) if start == MODE.0 => self.seen.mode = word(0).zip(word(2)),
            (MONITORS, start) if start == VERSIONS.0 => {
                self.seen.versions = word(0).zip(word(1)).or(self.seen.versions);
            }
            (MONITORS, PACKETS) => self.seen.packets = word(0),
            (MONITORS, RESET) => self.seen.homed = word(0).map(|state| state == RESET_DONE),
            // The observer hears those, whoever asked.
            (MONITORS, DP_INPUTS) => {}
            (MONITORS, start) => return self.hear_positions(start, &reply),
            _ => return false,
        }
        true
    }

    fn hear_positions(&mut self, start: u16, reply: &RegisterReply<'_>) -> bool {
        let Some(first) = DP_POSITIONS.iter().position(|register| *register == start) else { return false };
        let told = positions(reply.values(self.dialect), self.dialect);
        self.seen.axes |= ((1 << told.len()) - 1) << first;
        self.told = Some((first, told));
        true
    }

    /// The positions that the answer told which was just heard, and the first of their axes.
    pub(super) const fn take_positions(&mut self) -> Option<(usize, PerAxis<Pulses>)> {
        self.told.take()
    }

    /// What was seen, once all has been told; once for each time it was asked.
    pub(super) fn take(&mut self) -> Option<Sighting> {
        let Seen { asked, mode, versions, packets, homed, error, axes } = self.seen;
        let ((work_mode, of_frame), (minor_version, version), homed) = (mode?, versions?, homed?);
        let all = (1 << self.seat.axes.min(DP_POSITIONS.len())) - 1;
        let told = packets.is_some() || self.dialect != Dialect::Smc;
        if !asked || !told || axes & all != all {
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::from_to_args;
    use crate::cue::{Source, read};
    use crate::fanout::{Manner, lanes};
    use crate::timeline::Timeline;
    use crate::wire::{Words, position_words};

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
        let stands = position_words(Pulses(75_000), Dialect::Smc);
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
            looker.hear(reply.emit(&mut [0; MAX_LEN]))
        };
        answers.into_iter().map(hear).collect()
    }

    #[test]
    fn what_a_controller_tells_is_taken_whole_and_once() {
        let mut looker = looker();
        assert_eq!(answer(&mut looker, ReplyCode::Running, 0), [true; 5]);
        let sighting = looker.take().unwrap();
        let (first, told) = looker.take_positions().unwrap();
        let identity = Identity { version: 3, minor_version: 1, work_mode: 2, axes: 1 };
        assert_eq!(sighting, Sighting { identity, error: 0, alarm: 0, packets: Some(77), homed: true });
        assert_eq!((first, &told[..]), (0, &[Pulses(75_000)][..]));
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
        assert_eq!(answer(&mut looker, ReplyCode::Fault, 21), [true; 5]);
        assert_eq!(looker.take().unwrap().error, 21);
    }

    #[test]
    fn nothing_is_taken_that_nobody_asked_for() {
        let mut looker = looker();
        looker.seen.asked = false;
        assert_eq!(answer(&mut looker, ReplyCode::Running, 0), [false; 5]);
        assert!(looker.take().is_none());
    }
}
