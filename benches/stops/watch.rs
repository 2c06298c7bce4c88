//! Sockets that note when each lane's effects went off, and where it went.

use kinocue::harness::motion::Pulses;
use kinocue::harness::net::{Delivery, Sender};
use kinocue::harness::rt::FrameSink;
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::{Clock as _, MonoTime};
use kinocue::wire::{MotionRequest, PerAxis};

/// The sockets, and what was seen of each lane.
pub(crate) struct Watch {
    sender: Sender,
    pub(crate) lanes: Vec<Seen>,
}

/// What was seen of one lane.
#[derive(Debug, Clone, Default)]
pub(crate) struct Seen {
    /// Whether its effects were on.
    lit: bool,
    /// When the kernel had the first frame without them.
    pub(crate) unlit: Option<MonoTime>,
    /// Frames from that one on.
    pub(crate) since: u64,
    last: PerAxis<Pulses>,
    /// How many of the newest frames say the same position.
    pub(crate) still: u64,
}

impl Watch {
    /// Nothing seen yet.
    pub(crate) fn new(sender: Sender, lanes: usize) -> Self {
        Self { sender, lanes: vec![Seen::default(); lanes] }
    }
}

impl FrameSink for Watch {
    fn send(&mut self, lane: usize, datagram: &[u8], at: MonoTime) -> Delivery {
        let delivery = self.sender.send(lane, datagram, at);
        let at = Monotonic.now();
        let frame = MotionRequest::parse(datagram).expect("only frames are sent");
        let seen = &mut self.lanes[lane];
        if frame.outputs != 0 {
            (seen.lit, seen.unlit, seen.since) = (true, None, 0);
        } else if seen.lit {
            seen.unlit.get_or_insert(at);
            seen.since += 1;
        }
        seen.still = if seen.last == frame.positions { seen.still + 1 } else { 1 };
        seen.last = frame.positions;
        delivery
    }
}
