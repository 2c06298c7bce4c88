use std::time::Duration;

use super::*;
use crate::sim::counts::RefusedCounts;
use crate::wire::{
    Analogue, FrameNo, Motion, MotionReply, ReadRequest, RegisterReply, Timing, Vibration, VibrationPort,
    Words, WriteRequest,
};

mod faults;
mod functions;
mod motion;
mod reports;
mod requests;
mod resets;

const HOST: u16 = 8410;

/// A controller in virtual time, and the host that talks to it.
struct Bench {
    controller: Controller,
    at_ms: u64,
    from_port: u16,
}

/// A relative frame to three axes that everyone obeys and answers.
const FRAME: Motion<'static> = Motion {
    timing: Timing::Relative,
    channel: 0,
    accept: Code::ALL,
    reply: Code::ALL,
    frame: FrameNo(7),
    time_ms: 100,
    positions: &[Pulses(1_000), Pulses(2_000), Pulses(-3_000)],
    outputs: 0,
    analogue: Analogue::OFF,
    vibration: None,
};

impl Bench {
    fn new(setup: &Setup) -> Self {
        let address = "192.168.15.201:7408".parse().unwrap();
        Self { controller: Controller::new(setup, address, at(0)), at_ms: 0, from_port: HOST }
    }

    fn with(parameters: &[(u8, u16)]) -> Self {
        Self::new(&Setup { parameters: parameters.to_vec(), ..Setup::default() })
    }

    /// Sends bytes and returns the answer.
    fn send(&mut self, bytes: &[u8]) -> Option<Vec<u8>> {
        let from = SocketAddrV4::new([192, 168, 15, 101].into(), self.from_port);
        let mut buf = [0xa5; MAX_LEN];
        let handled = self.controller.on_datagram(from, bytes, at(self.at_ms), &mut buf);
        handled.reply.map(<[u8]>::to_vec)
    }

    fn play(&mut self, motion: &Motion<'_>) -> Option<MotionReply> {
        let mut buf = [0; MAX_LEN];
        let bytes = motion.emit(&mut buf).to_vec();
        self.send(&bytes).map(|answer| MotionReply::parse(&answer).unwrap())
    }

    /// Plays a frame and returns the x of its answer and the error.
    fn x(&mut self, motion: &Motion<'_>) -> (u8, u16) {
        let answer = self.play(motion).expect("it answers");
        (answer.code as u8, answer.error)
    }

    /// Reads registers: x and the words.
    fn read(&mut self, channel: u16, start: u16, num: u16) -> (u8, Vec<u16>) {
        let mut buf = [0; MAX_LEN];
        let request = ReadRequest { channel, accept: Code::ALL, reply: Code::ALL, start, num };
        let answer = self.send(request.emit(&mut buf)).expect("it answers");
        let answer = RegisterReply::parse(&answer).unwrap();
        (answer.code as u8, answer.data.iter().collect())
    }

    fn word(&mut self, channel: u16, register: u16) -> u16 {
        self.read(channel, register, 1).1[0]
    }

    /// Writes registers and returns the x of the answer.
    fn write(&mut self, channel: u16, start: u16, words: &[u16]) -> u8 {
        let mut buf = [0; MAX_LEN];
        let data = Words::from(words);
        let request = WriteRequest { channel, accept: Code::ALL, reply: Code::ALL, start, data };
        let answer = self.send(request.emit(&mut buf)).expect("it answers");
        RegisterReply::parse(&answer).unwrap().code as u8
    }

    fn wait(&mut self, ms: u64) -> &mut Self {
        self.at_ms += ms;
        self
    }

    fn positions(&mut self) -> Vec<i32> {
        self.controller.positions(at(self.at_ms)).iter().map(|position| position.0).collect()
    }

    /// How many milliseconds the move takes that a frame starts, at rest.
    fn duration(&mut self, motion: &Motion<'_>) -> u64 {
        self.play(motion);
        let end = self.controller.player.end();
        u64::try_from(end.since(at(self.at_ms)).as_millis()).unwrap()
    }

    fn refused(&self) -> RefusedCounts {
        self.controller.counts().refused
    }
}

fn at(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

fn absolute(time_ms: u32) -> Motion<'static> {
    Motion { timing: Timing::Absolute, time_ms, ..FRAME }
}
