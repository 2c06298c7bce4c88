//! How units are found and switched, and what a line may do to that.

use crate::drive::sixpack2::look::look;
use std::time::Duration;

use super::bench::*;
use crate::drive::link::{LinkFault, LinkPort, LinkTalk as _, TalkTerms};
use crate::drive::sixpack2::*;
use crate::sim::serial::{LineFaults, SerialLine};
use crate::sim::sixpack2::SixpackFault;
use crate::time::MonoTime;

#[test]
fn a_unit_that_woke_is_switched_to_the_rate_of_the_link_and_its_reset_is_told() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let found = find(&mut talk, &[1]).unwrap();
    assert_eq!((found[0].reset, found[0].serial), (1, 1_001));
    assert_eq!((unit(&mut talk).baud(), talk.baud()), (BAUD, BAUD));
    let again = find(&mut talk, &[1]).unwrap();
    assert_eq!(again[0].reset, 0);
    let facts = look(&mut talk, 1, &[0, 5]).unwrap();
    assert_eq!((facts.firmware, facts.was_reset, facts.celsius, facts.serial), (148, false, 30, 1_001));
    assert!((facts.volts - 24.0).abs() < 0.05, "{facts:?}");
    let motors: Vec<_> =
        facts.motors.iter().map(|motor| (motor.motor, motor.position, motor.action)).collect();
    assert_eq!(motors, [(0, 0, 0), (5, 0, 0)]);
    assert_eq!(unit(&mut talk).books.unknown, 0);
}

#[test]
fn a_unit_that_was_restarted_meanwhile_is_found_again() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    find(&mut talk, &[1]).unwrap();
    suffer(&mut talk, SixpackFault::Reset);
    assert_eq!(find(&mut talk, &[1]).unwrap()[0].reset, 1);
    assert_eq!(unit(&mut talk).baud(), BAUD);
}

#[test]
fn two_units_on_two_wires_are_switched_together() {
    let mut setups = [unit_with(1, shaft()), unit_with(2, shaft())];
    setups.iter_mut().for_each(|setup| setup.is_two_wires = true);
    let mut talk = talk_to(&setups);
    let found = find(&mut talk, &[2, 1]).unwrap();
    assert_eq!([found[0].serial, found[1].serial], [1_002, 1_001]);
    let units = talk.port().line.bus().units();
    let books: Vec<_> = units.iter().map(|unit| (unit.baud(), unit.books.collisions)).collect();
    assert_eq!(books, [(BAUD, 0), (BAUD, 0)]);
}

#[test]
fn a_link_may_stay_at_the_rate_with_which_units_wake() {
    let mut talk = talk_at(&[unit_with(1, shaft())], 19_231);
    assert_eq!(find(&mut talk, &[1]).unwrap()[0].reset, 1);
    let sent = talk.port().sent.clone();
    assert!(sent.iter().all(|(_, octets)| octets[1] != 0x40), "{sent:?}");
}

#[test]
fn a_unit_that_is_not_there_is_told_by_number_and_rates_and_the_line_is_back_at_its_own() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    let words = find(&mut talk, &[3]).unwrap_err().to_string();
    assert!(words.starts_with("unit 3 answers neither at 56818 nor at 19231 baud"), "{words}");
    assert_eq!(talk.baud(), BAUD);
    talk.port().is_gone = true;
    assert_eq!(find(&mut talk, &[1]), Err(FindError::Link(LinkFault)));
}

/// A line that has something against a rate, at the rate that it was told last.
struct Bad(VirtualPort, Against, u32);

#[derive(Clone, Copy, PartialEq)]
enum Against {
    /// Nothing of the greater comes back.
    Greater,
    /// Somebody pulls the adapter as soon as something is said at that with which units wake.
    Waking,
}

impl Bad {
    /// A conversation over one, at the rate of the link.
    fn talk(against: Against) -> Talk<Self> {
        let bus = talk_to(&[unit_with(1, shaft())]).port().line.bus().clone();
        let now = MonoTime::from_nanos(3_000_000_000);
        let line = SerialLine::new(bus, 10, LineFaults::default(), 7);
        let terms =
            TalkTerms { baud: BAUD, octet_bits: 10, has_echo: false, is_two_wires: false, is_bus: false };
        let mut port = VirtualPort::new(line, now);
        port.line.set_host_baud(Some(BAUD));
        Talk::new(Self(port, against, BAUD), terms)
    }

    const fn is_slow(&self) -> bool {
        self.2 < 20_000
    }
}

impl LinkPort for Bad {
    fn now(&self) -> MonoTime {
        self.0.now()
    }

    fn send(&mut self, octets: &[u8]) -> Result<(), LinkFault> {
        self.0.is_gone |= self.1 == Against::Waking && self.is_slow();
        self.0.send(octets)
    }

    fn receive(&mut self, buf: &mut [u8], deadline: MonoTime) -> Result<usize, LinkFault> {
        if self.1 == Against::Waking || self.is_slow() {
            return self.0.receive(buf, deadline);
        }
        self.0.sleep_until(deadline);
        Ok(0)
    }

    fn flush(&mut self) -> usize {
        self.0.flush()
    }

    fn send_break(&mut self, span: Duration) -> Result<(), LinkFault> {
        self.0.send_break(span)
    }

    fn set_baud(&mut self, baud: u32) -> Result<(), LinkFault> {
        self.2 = baud;
        self.0.set_baud(baud)
    }

    fn sleep_until(&mut self, at: MonoTime) {
        self.0.sleep_until(at);
    }
}

#[test]
fn a_unit_that_answers_only_as_it_woke_is_told_so() {
    let mut talk = Bad::talk(Against::Greater);
    let words = find(&mut talk, &[1]).unwrap_err().to_string();
    assert!(
        words.starts_with("unit 1 answers at 19231 baud, its power-on rate, but not at 56818"),
        "{words}"
    );
}

#[test]
fn an_adapter_that_is_pulled_while_a_unit_is_looked_for_as_it_woke_is_opened_again_at_the_rate_of_its_link() {
    let finds = |talk: &mut Talk<Bad>| find(talk, &[1]) == Err(FindError::Link(LinkFault));
    let looks = |talk: &mut Talk<Bad>| look_for(talk, 1, &[0]) == Err(TalkFault::Link(LinkFault));
    for is_told in [finds as fn(&mut Talk<Bad>) -> bool, looks] {
        let mut talk = Bad::talk(Against::Waking);
        assert!(is_told(&mut talk));
        assert_eq!((talk.baud(), talk.port().2), (BAUD, BAUD));
    }
}

#[test]
fn answers_that_are_lost_late_or_doubled_are_counted_and_asked_for_again() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    find(&mut talk, &[1]).unwrap();
    talk.port().line.faults = LineFaults {
        lost: 0.003,
        doubled: 0.003,
        flipped: 0.003,
        answer_lost: 0.05,
        ..LineFaults::default()
    };
    let positions: Vec<_> =
        (0..200).map(|_| look(&mut talk, 1, &[0]).map(|facts| facts.motors.len())).collect();
    let counts = talk.counts();
    assert!(positions.iter().filter(|looked| looked.is_ok()).count() > 195, "{positions:?}");
    assert!(counts.answered < counts.asked && counts.malformed > 5, "{counts:?}");
}

#[test]
fn an_echo_is_taken_back_and_is_no_answer() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    find(&mut talk, &[1]).unwrap();
    let terms = TalkTerms { baud: BAUD, octet_bits: 10, has_echo: true, is_two_wires: true, is_bus: false };
    let now = talk.now();
    let bus = talk.port().line.bus().clone();
    let mut line = SerialLine::new(bus, 10, LineFaults { echo: true, ..LineFaults::default() }, 3);
    line.set_host_baud(Some(BAUD));
    let mut talk = Talk::new(VirtualPort::new(line, now), terms);
    assert_eq!(look(&mut talk, 1, &[2]).unwrap().motors[0].motor, 2);
    let counts = talk.counts();
    assert_eq!((counts.echo_differs, counts.malformed, counts.asked), (0, 0, counts.answered), "{counts:?}");
    assert!(talk.now() > now);
}

#[test]
fn on_two_wires_nothing_is_said_while_a_unit_still_holds_them() {
    let mut setup = unit_with(1, shaft());
    setup.is_two_wires = true;
    let mut talk = talk_to(&[setup]);
    find(&mut talk, &[1]).unwrap();
    for _ in 0..20 {
        look(&mut talk, 1, &[0, 1, 2]).unwrap();
    }
    assert_eq!((unit(&mut talk).books.collisions, talk.counts().asked), (0, talk.counts().answered + 2));
}

#[test]
fn a_look_tells_a_unit_that_waits_as_it_woke_from_one_that_is_not_there_and_switches_neither() {
    let mut talk = talk_to(&[unit_with(1, shaft())]);
    assert_eq!(look_for(&mut talk, 1, &[0]), Ok(None));
    let silent = look_for(&mut talk, 2, &[0]).unwrap_err();
    assert_eq!(silent, TalkFault::Silent { unit: 2, baud: BAUD });
    assert_eq!(look_for(&mut talk, 1, &[0]), Ok(None), "it was not switched");
    find(&mut talk, &[1]).unwrap();
    let told = look_for(&mut talk, 1, &[0, 1]).unwrap().expect("it talks at the rate of the link");
    assert_eq!((told.unit, told.motors.len()), (1, 2));
}
