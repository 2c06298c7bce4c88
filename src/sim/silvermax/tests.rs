//! Units in virtual time: asked as a host asks, judged by where their axes really were.

#![expect(clippy::cast_possible_truncation, reason = "counts and velocities within their range")]

use std::time::Duration;

use super::*;
use crate::sim::serial::{Bus as _, LineFaults, PtyLoop, SerialLine};
use crate::sys::clock::Monotonic;
use crate::sys::serial::{SerialPort, SerialSettings, StopBits};
use crate::time::{Clock as _, MonoTime};
use crate::wire::silvermax::{
    Collected, Internal, Io, LineCollector, MAX_LINE, NakReason, Poll, Reply, Request, StopOn, register,
};

mod queue;
mod safety;

/// Counts in a millimetre at a lead of 5 mm.
const MM: i32 = 800;
/// 240 mm/s and 3,000 mm/s².
const VELOCITY: u32 = 1_546_188_226;
const BRAKE: u32 = 2_319_282;

/// A host that speaks to units in virtual time.
struct Host {
    line: SerialLine<SilverBus>,
    now: MonoTime,
}

impl Host {
    fn with(setups: &[UnitSetup]) -> Self {
        let now = MonoTime::from_nanos(1_000_000_000);
        let bus = SilverBus::new(setups, 57_600, now);
        Self { line: SerialLine::new(bus, 11, LineFaults::default(), 3), now }
    }

    fn of(unit: u8) -> Self {
        Self::with(&[UnitSetup::new(unit)])
    }

    fn wait(&mut self, ms: u64) {
        self.now = self.now + Duration::from_millis(ms);
        self.line.advance(self.now);
    }

    /// All that comes back within 30 ms.
    fn send(&mut self, octets: &[u8]) -> Vec<u8> {
        self.line.send(octets, self.now);
        let until = self.now + Duration::from_millis(30);
        let mut answer = Vec::new();
        while let Some(next) = self.line.next().filter(|next| *next <= until) {
            self.now = next;
            self.line.advance(next);
            answer.extend(std::iter::from_fn(|| self.line.receive(next)));
        }
        if answer.is_empty() {
            self.now = until;
            self.line.advance(until);
        }
        answer
    }

    /// What a unit answers, if it does.
    fn ask(&mut self, unit: u8, request: Request) -> Option<Reply> {
        let octets = self.send(request.emit(unit, &mut [0; MAX_LINE]));
        let (last, line) = octets.split_last()?;
        assert_eq!(*last, b'\r');
        Some(Reply::parse(line).unwrap())
    }

    fn tell(&mut self, unit: u8, request: Request) {
        assert_eq!(self.ask(unit, request), Some(Reply::Ack { unit }), "{request:?}");
    }

    fn nak(&mut self, unit: u8, request: Request) -> NakReason {
        match self.ask(unit, request) {
            Some(Reply::Nak { reason, .. }) => reason,
            other => panic!("{request:?}: {other:?}"),
        }
    }

    fn read(&mut self, unit: u8, register: u8) -> i32 {
        match self.ask(unit, Request::ReadRegister { register }) {
            Some(Reply::Data { words, .. }) => words.value().unwrap(),
            other => panic!("{other:?}"),
        }
    }

    /// A status word; 0 where a poll has nothing to tell.
    fn word(&mut self, unit: u8, request: Request) -> u16 {
        match self.ask(unit, request) {
            Some(Reply::Data { words, .. }) => words.word().unwrap(),
            Some(Reply::Ack { .. }) => 0,
            other => panic!("{other:?}"),
        }
    }

    fn unit(&self) -> &Unit {
        &self.line.bus().units()[0]
    }

    fn act(&mut self, action: Action) {
        let now = self.now;
        self.line.bus_mut().act(None, action, now);
    }

    fn at_rest(&mut self) {
        for _ in 0..100_000 {
            if !self.unit().is_moving() {
                return;
            }
            self.wait(1);
        }
        panic!("{:?} moves for ever", self.unit());
    }
}

#[test]
fn stop_brakes_everybody_and_nobody_answers_a_group() {
    let mut host = Host::with(&[UnitSetup::new(16), UnitSetup::new(17)]);
    for unit in [16, 17] {
        host.tell(
            unit,
            Request::MoveRelative {
                distance: 40_000,
                acceleration: BRAKE,
                velocity: VELOCITY / 2,
                stop: StopOn::Nothing,
            },
        );
    }
    host.wait(100);
    let stop = Request::Stop { deceleration: BRAKE };
    assert_eq!(host.ask(255, stop), None);
    host.wait(50);
    assert!(host.line.bus().units().iter().all(|unit| !unit.is_moving() && unit.position() < 40_000));
    assert_eq!(host.ask(253, stop), None, "nor a group");
    host.tell(17, stop);
}

#[test]
fn a_motion_refuses_what_has_to_wait_unless_it_may_do_two_things() {
    let mut host = Host::of(16);
    let away = Request::MoveRelative {
        distance: 20_000,
        acceleration: 77_309,
        velocity: 64_424_509,
        stop: StopOn::Nothing,
    };
    host.tell(16, away);
    assert_eq!(host.nak(16, Request::ClearMaxError), NakReason::Busy);
    assert_eq!(host.nak(16, away), NakReason::Busy);
    host.read(16, register::POSITION);
    host.tell(16, Request::StopAtOnce);
    host.tell(16, Request::EnableMultiTasking);
    host.tell(16, away);
    host.tell(16, Request::ClearMaxError);
    host.tell(16, away); // waits for the running one
    assert_eq!(host.nak(16, Request::ClearMaxError), NakReason::Busy);
    host.at_rest();
    let stopped = host.unit().position() - 40_000;
    assert!((0..200).contains(&stopped), "both were made: {stopped}");
}

#[test]
fn what_happened_is_told_until_it_is_cleared_and_never_cleared_unread() {
    let mut host = Host::of(16);
    assert_eq!(host.word(16, Request::Poll), Poll::DONE, "its own program has run");
    host.tell(16, Request::TargetToPosition);
    // Done once more, which nobody has read.
    host.tell(16, Request::ClearPoll { mask: 0xffff });
    assert_eq!(host.word(16, Request::Poll), Poll::DONE);
    assert_eq!(host.word(16, Request::Poll), Poll::DONE, "told again");
    host.tell(16, Request::ClearPoll { mask: 0xffff });
    assert_eq!(host.ask(16, Request::Poll), Some(Reply::Ack { unit: 16 }), "nothing to tell");
}

#[test]
fn units_of_any_number_answer_in_hexadecimal_and_only_themselves() {
    let setups = [10, 16, 26, 254].map(UnitSetup::new);
    let mut host = Host::with(&setups);
    for unit in [10, 16, 26, 254] {
        host.tell(unit, Request::ClearPoll { mask: 0 });
    }
    assert_eq!(host.ask(11, Request::Poll), None);
    assert_eq!(host.send(b"@26\r"), b"# 1A 0000 2000\r");
    host.line.bus_mut().act(Some(26), Action::AnswersAs(Some(16)), MonoTime::from_nanos(0));
    assert_eq!(host.ask(26, Request::ClearPoll { mask: 0 }), Some(Reply::Ack { unit: 16 }));
    host.line.bus_mut().act(Some(254), Action::Dead(true), MonoTime::from_nanos(0));
    assert_eq!(host.ask(254, Request::Poll), None);
}

#[test]
fn two_units_of_one_number_garble_each_other() {
    let mut host = Host::with(&[UnitSetup::new(16), UnitSetup { adl: 4, place: 0, ..UnitSetup::new(16) }]);
    let now = host.now;
    host.line.bus_mut().units_mut()[1].act(Action::Input { input: 7, is_high: false }, now);
    let answer = host.send(b"@16 21\r");
    let line = answer.strip_suffix(b"\r");
    assert!(line.is_none_or(|line| Reply::parse(line).is_err()), "{answer:?}");
}

#[test]
fn what_cannot_be_is_refused_by_its_reason() {
    let mut host = Host::of(16);
    for (line, answer) in [
        (&b"@16 12 99\r"[..], &b"! 10 000C 0005\r"[..]),
        (b"@16 12\r", b"! 10 000C 0005\r"),
        (b"@16 0 1\r", b"! 10 0000 0005\r"),
        (b"@16 7\r", b"! 10 0007 0001\r"),
        (b"@16 11 41 0\r", b"! 10 000B 0005\r"),
        (b"@16 25 1 2 3\r", b"! 10 0019 0005\r"),
        (b"@16 174 575\r", b"! 10 00AE 0005\r"),
        (b"16 0\r", b""),
        (b"@16 0x\r", b""),
    ] {
        assert_eq!(host.send(line), answer, "{}", String::from_utf8_lossy(line));
    }
    assert_eq!(host.unit().tally().refused, 7);
}

#[test]
fn what_kinocue_never_sends_is_obeyed_and_counted() {
    let mut host = Host::of(16);
    assert_eq!(host.send(b"@16 15 200000 107374200 0 0\r"), b"* 10\r");
    host.wait(500);
    assert!(host.unit().is_moving() && host.unit().position() > 3_000, "it runs on");
    assert_eq!(host.send(b"@16 2\r"), b"* 10\r");
    assert!(!host.unit().is_moving());
    assert_eq!(host.send(b"@16 4\r"), b"", "a unit that starts does not answer");
    assert_eq!((host.unit().tally().forbidden, host.unit().tally().resets), (3, 1));
}

#[test]
fn the_delay_of_answers_is_as_it_was_set_and_the_rate_is_changed_before_the_answer() {
    let answered = |adl| {
        let mut host = Host::with(&[UnitSetup { adl, ..UnitSetup::new(16) }]);
        let from = host.now;
        host.tell(16, Request::ClearPoll { mask: 0 });
        host.now.since(from)
    };
    assert_eq!(answered(20) - answered(4), Duration::from_micros(16 * 120));
    let mut host = Host::of(16);
    assert_eq!(host.send(b"@16 174 2304\r"), b"* 10\r");
    assert_eq!(host.line.bus().baud(), 230_400);
}

#[test]
fn units_answer_whoever_opens_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stalls");
    let bus = SilverBus::new(&[UnitSetup::new(16)], 57_600, Monotonic.now());
    let line = SerialLine::new(bus, 11, LineFaults::default(), 3);
    let running = PtyLoop::start(line, &path, Vec::new()).unwrap();
    let settings = SerialSettings { baud: 57_600, stop_bits: StopBits::Two, is_rs485: false };
    let port = SerialPort::open(&path, settings).unwrap();
    let deadline = Monotonic.now() + Duration::from_secs(10);
    port.line().write(Request::Revision.emit(16, &mut [0; MAX_LINE]), deadline).unwrap();
    let (mut collector, mut octet) = (LineCollector::of_replies(), [0]);
    let reply = loop {
        assert_eq!(port.line().read(&mut octet, deadline), Ok(1), "an answer in time");
        if let Some(Collected::Line(line)) = collector.push(octet[0]) {
            break Reply::parse(line).unwrap();
        }
    };
    assert_eq!((reply.unit(), reply.command()), (16, Some(5)));
    assert_eq!(running.stop().bus().units()[0].tally().requests, 1);
}
