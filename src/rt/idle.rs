//! While nothing moves, no frame asks and no ack tells that a controller lives. Then each is asked by a beat, four times a
//! second, where the first of its axes stand. Ack thread; allocates nothing.

use std::time::Duration;

use crate::config::Controller;
use crate::fanout::Lane;
use crate::motion::Pulses;
use crate::net::{Delivery, Sender};
use crate::time::MonoTime;
use crate::wire::{
    Access, Code, DP_POSITIONS, Dialect, MAX_LEN, PerAxis, RegisterReply, position_reads, positions,
};

/// From one beat to the next.
const EVERY: Duration = Duration::from_millis(250);

/// Who beats, and when next.
#[derive(Debug)]
pub(super) struct Beats {
    next: MonoTime,
    hearts: Vec<Heart>,
}

/// What has to be known of a controller to beat.
#[derive(Debug)]
struct Heart {
    code: Code,
    dialect: Dialect,
    axes: usize,
}

impl Beats {
    pub(super) fn new(controllers: &[Controller], lanes: &[Lane]) -> Self {
        let heart = |(one, lane): (&Controller, &Lane)| Heart {
            code: lane.code,
            dialect: one.dialect,
            axes: one.seat.axes.min(3),
        };
        Self { next: MonoTime::default(), hearts: controllers.iter().zip(lanes).map(heart).collect() }
    }

    /// Whether it is time; if so, the next is due a while later.
    pub(super) fn take(&mut self, now: MonoTime) -> bool {
        let due = now >= self.next;
        if due {
            self.next = now + EVERY;
        }
        due
    }

    /// Asks a controller; says whether the kernel took it.
    pub(super) fn send(&self, controller: usize, sender: &Sender) -> bool {
        let Heart { code, axes, .. } = self.hearts[controller];
        let read = position_reads(axes, code, code).next();
        read.is_some_and(|read| {
            !matches!(sender.send(controller, read.emit(&mut [0; MAX_LEN])), Delivery::Failed(_))
        })
    }

    /// The positions that an answer to a beat tells; none where it is none.
    pub(super) fn hear(&self, controller: usize, octets: &[u8]) -> Option<PerAxis<Pulses>> {
        let heart = &self.hearts[controller];
        let reply = RegisterReply::parse(octets).ok()?;
        let is_ours = reply.access == Access::Read && reply.channel == 0 && reply.start == DP_POSITIONS[0];
        (is_ours && usize::from(reply.num) == 2 * heart.axes).then(|| positions(reply.data, heart.dialect))
    }
}
