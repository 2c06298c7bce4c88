//! Looking at a controller while a show runs: the registers that tell what it is, whether it has rebooted, and where its
//! seat stands. Ack thread; allocates nothing.

use std::sync::Arc;

use crate::config::{Controller, FanOut};
use crate::fanout::Lane;
use crate::health::{Identity, Sighting};
use crate::motion::{MAX_AXES, Pose, Pulses, SeatType};
use crate::net::{Delivery, Sender};
use crate::wire::{
    Access, Code, DP_POSITIONS, Dialect, MAX_LEN, ReadRequest, RegisterReply, ReplyCode, position_reads,
    positions,
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
    /// Where the slots of a frame rest that are not its own.
    park: Pose,
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
    places: [Option<Pulses>; DP_POSITIONS.len()],
    error: u16,
}

impl Looker {
    /// For a controller, and the lane that sends to it.
    pub(super) fn new(controller: &Controller, lane: &Lane) -> Self {
        Self {
            code: lane.code,
            dialect: controller.dialect,
            seat: Arc::clone(&controller.seat),
            first_slot: match controller.fan_out {
                FanOut::Slice => 0,
                FanOut::Shared => controller.axis_offset,
            },
            park: lane.window.park(),
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
        if reply.code != ReplyCode::Running {
            self.seen.error = reply.error;
        }
        let word = |index| reply.data.get(index);
        match (reply.channel, reply.start) {
            (PARAMETERS, start) if start == MODE.0 => self.seen.mode = word(0).zip(word(2)),
            (MONITORS, start) if start == VERSIONS.0 => self.seen.versions = word(0).zip(word(1)),
            (MONITORS, PACKETS) => self.seen.packets = word(0),
            (MONITORS, RESET) => self.seen.homed = word(0).map(|state| state == RESET_DONE),
            (MONITORS, start) => return self.hear_positions(start, &reply),
            _ => return false,
        }
        true
    }

    fn hear_positions(&mut self, start: u16, reply: &RegisterReply<'_>) -> bool {
        let Some(first) = DP_POSITIONS.iter().position(|register| *register == start) else { return false };
        for (place, pulses) in
            self.seen.places[first..].iter_mut().zip(positions(reply.data, self.dialect).iter())
        {
            *place = Some(*pulses);
        }
        true
    }

    /// What was seen, and where the seat stands, once all has been told; once for each time it was asked.
    pub(super) fn take(&mut self) -> Option<(Sighting, Pose)> {
        let Seen { asked, mode, versions, packets, homed, error, .. } = self.seen;
        let ((work_mode, axes), (minor_version, version), homed) = (mode?, versions?, homed?);
        let told = packets.is_some() || self.dialect != Dialect::Smc;
        let pose = self.pose().filter(|_| asked && told)?;
        self.seen.asked = false;
        let identity = Identity { version, minor_version, work_mode, axes };
        Some((Sighting { identity, error, packets, homed }, pose))
    }

    /// Axes past the sixth have no position register: they count as parked.
    fn pose(&self) -> Option<Pose> {
        let mut pose = self.park;
        for (axis, place) in self.seen.places.iter().enumerate().take(self.seat.axes) {
            let slot = self.first_slot + axis;
            if slot < MAX_AXES {
                pose[slot] = self.seat.fraction((*place)?).clamp(0.0, 1.0);
            }
        }
        Some(pose)
    }
}
