//! A virtual controller that is led by somebody else than kinocue, as by who jogs it.

use std::net::{Ipv4Addr, UdpSocket};
use std::time::Duration;

use kinocue::harness::motion::Pulses;
use kinocue::harness::sys::clock::Monotonic;
use kinocue::harness::time::Clock as _;
use kinocue::wire::{
    Analogue, Code, Dialect, FrameNo, MAX_LEN, Motion, ReadRequest, RegisterReply, Timing, position,
};

/// Where an axis of a controller is led to.
pub(crate) struct JoggedTo<'p> {
    pub(crate) channel: u16,
    /// Of the one frame that it takes.
    pub(crate) frame: FrameNo,
    /// Pulses, axis by axis.
    pub(crate) positions: &'p [i32],
    /// The axis that is waited for, from 0, and the register in which it is read.
    pub(crate) axis: usize,
    pub(crate) register: u16,
}

impl JoggedTo<'_> {
    /// Leads the controller there, and waits until it is.
    pub(crate) fn to(&self, address: &str) {
        let controller = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
        controller.connect(address).expect("loopback can be reached");
        let positions: Vec<_> = self.positions.iter().copied().map(Pulses).collect();
        let motion = Motion {
            timing: Timing::Relative,
            channel: self.channel,
            accept: Code::ALL,
            reply: Code::NONE,
            frame: self.frame,
            time_ms: 500,
            positions: &positions,
            outputs: 0,
            analogue: Analogue::OFF,
            vibration: None,
        };
        controller.send(motion.emit(&mut [0; MAX_LEN])).expect("loopback takes it");
        while self.place(&controller) != self.positions[self.axis] {
            // More questions than it can take would be an error of its own.
            Monotonic.sleep_until(Monotonic.now() + Duration::from_millis(10));
        }
    }

    fn place(&self, controller: &UdpSocket) -> i32 {
        let (accept, reply) = (Code::ALL, Code::ALL);
        let ask = ReadRequest { channel: 0, accept, reply, start: self.register, num: 2 };
        let mut bytes = [0; MAX_LEN];
        controller.send(ask.emit(&mut [0; MAX_LEN])).expect("loopback takes it");
        let len = controller.recv(&mut bytes).expect("it answers");
        let words: Vec<u16> = RegisterReply::parse(&bytes[..len]).expect("an answer").data.iter().collect();
        position([words[0], words[1]], Dialect::Smc).0
    }
}
