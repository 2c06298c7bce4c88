//! Where the frames of a hall with seats on links go, up to the rings of the links' threads.

use rtrb::{Consumer, RingBuffer};

use crate::drive::Lane;
use crate::drive::link::LedPose;
use crate::net::{Delivery, Sender};
use crate::rt::{FrameSink as _, LinkLane, Outlets};
use crate::time::MonoTime;

/// The outlets of such a hall, and the other ends of the rings.
#[derive(Debug)]
pub struct LinkOutlets {
    outlets: Outlets,
    poses: Vec<Consumer<LedPose>>,
}

impl LinkOutlets {
    /// The lanes behind the first `stations` are on links, each on one of its own.
    pub fn over(sender: Sender, stations: usize, lanes: &[Lane]) -> Self {
        let (rings, poses): (Vec<_>, Vec<_>) = lanes[stations..].iter().map(|_| RingBuffer::new(128)).unzip();
        let led = (0..).zip(&lanes[stations..]);
        let led = led.map(|(link, lane)| LinkLane { link, lane: 0, lead: lane.window.lead() }).collect();
        Self { outlets: Outlets::new(sender, stations, rings, led), poses }
    }

    /// Hands over the frame of a lane, as the tick thread does.
    pub fn send(&mut self, lane: usize, frame: &[u8], at: MonoTime) -> Delivery {
        self.outlets.send(lane, frame, at)
    }

    /// Takes what came to all links: how many poses.
    pub fn take(&mut self) -> usize {
        self.poses.iter_mut().map(|ring| std::iter::from_fn(|| ring.pop().ok()).count()).sum()
    }
}
